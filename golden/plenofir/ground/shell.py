# SPDX-License-Identifier: Apache-2.0
"""Commands that are printed, for people to paste into a shell."""

import shlex
from pathlib import Path


def command(*words: str | int | Path) -> str:
    """A command of plenofir as a shell takes it, whatever the names of files.

    Paths are quoted where needed, and never taken for an option.
    """
    typed = [
        f"./{word}" if isinstance(word, Path) and str(word).startswith("-") else str(word)
        for word in words
    ]
    return shlex.join(["plenofir", *typed])
