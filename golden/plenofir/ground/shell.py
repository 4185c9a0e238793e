# SPDX-License-Identifier: Apache-2.0
"""Commands that are printed, for people to paste into a shell."""

import shlex
from pathlib import Path


def command(*words: str | int | Path) -> str:
    """A command of plenofir as a shell takes it, whatever the names of files.

    Paths are quoted where needed, and never taken for an option.
    """
    return " ".join(["plenofir", *map(quoted, words)])


def quoted(word: str | int | Path) -> str:
    """A word of a command as a shell takes it."""
    is_option = isinstance(word, Path) and str(word).startswith("-")
    return shlex.quote(f"./{word}" if is_option else str(word))
