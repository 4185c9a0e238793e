# SPDX-License-Identifier: Apache-2.0
"""Faults planted in the sources, to check that they are found."""

from collections.abc import Iterable
from pathlib import Path

import pytest

from plenofir.fpga import hdl

FOUND = r"(?m)^(AssertionError: |.*:error: bound check failure)"
"""Pattern of a failure for a wrong result, and not because something is missing or broken."""


STALE = pytest.StashKey[list[str]]()
"""Tests of this session whose planted fault is in no source any more."""


def stale_faults(items: Iterable[pytest.Item]) -> list[str]:
    """Find tests with a planted fault (a parameter ``old``) that can no longer be planted.

    Those without a parameter ``file`` plant it in any source.
    """
    texts = {source.stem: source.read_text() for source in hdl.hdl_sources()}
    stale = []
    for item in items:
        arguments = (
            item.callspec.params
            if isinstance(item, pytest.Function) and hasattr(item, "callspec")
            else {}
        )
        if "old" in arguments:
            stem = Path(arguments.get("file", "")).stem
            within = texts.values() if stem == "" else [texts[stem]]
            if sum(text.count(arguments["old"]) for text in within) != 1:
                stale.append(item.nodeid)
    return stale


def plant(folder: Path, sources: Iterable[Path], file: str, old: str, new: str) -> list[Path]:
    """Copy sources into a folder with one of them changed, in which `old` occurs once."""
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
