# SPDX-License-Identifier: Apache-2.0
"""Faults planted in the sources, to see that they are found."""

from collections.abc import Iterable
from pathlib import Path

FOUND = r"(?m)^(AssertionError: |.*:error: bound check failure)"
"""Pattern of a failure for a wrong result, and not because something is missing or broken."""


def plant(folder: Path, sources: Iterable[Path], file: str, old: str, new: str) -> list[Path]:
    """Copy sources with one of them changed.

    Parameters
    ----------
    folder
        Where the copies go; it is made if it is not there.
    sources
        VHDL files in order of analysis.
    file
        Name of the one to change.
    old, new
        Text that stands in it once, and what takes its place.

    Returns
    -------
    list of Path
        The copies, in the same order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    copies = []
    for source in sources:
        text = source.read_text()
        if source.name == file:
            assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {file}"
            text = text.replace(old, new)
        copies.append(folder / source.name)
        copies[-1].write_text(text)
    return copies
