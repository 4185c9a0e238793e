# SPDX-License-Identifier: Apache-2.0
"""The VHDL sources, in the order of analysis."""

import re
from pathlib import Path

from plenofir.files import input_file
from plenofir.project import root

_BOARD_MARK = re.compile(r"# Board (\w+),")
_PORTABLE = ""


def _listed(folder: Path) -> dict[str, list[Path]]:
    """What a folder's ``sources.txt`` lists: sources of no board (no name), then each board's."""
    parts: dict[str, list[Path]] = {_PORTABLE: []}
    board = _PORTABLE
    for line in input_file(folder / "sources.txt").read_text().splitlines():
        if mark := _BOARD_MARK.match(line):
            board = mark[1]
            parts[board] = []
        elif line and not line.startswith("#"):
            parts[board].append(input_file(folder / line))
    return parts


def hdl_sources() -> list[Path]:
    """Synthesisable VHDL sources that need no vendor's library, in the order of analysis.

    Returns
    -------
    list of Path
        What ``hdl/sources.txt`` lists before the boards' sources.
    """
    return _listed(root() / "hdl")[_PORTABLE]


def board_sources(board: str = "atlys") -> list[Path]:
    """Synthesisable VHDL sources of a board, in the order of analysis.

    Parameters
    ----------
    board
        Its name.

    Returns
    -------
    list of Path
        The sources of no board, then its own if it has any: they need a vendor's library.
    """
    parts = _listed(root() / "hdl")
    return parts[_PORTABLE] + parts.get(board, [])


def all_sources() -> list[Path]:
    """All synthesisable VHDL sources, in the order of analysis.

    Returns
    -------
    list of Path
        What ``hdl/sources.txt`` lists.
    """
    return [source for part in _listed(root() / "hdl").values() for source in part]


def model_sources(library: str = "unisim") -> list[Path]:
    """Models of a family's primitives for simulation, in order of analysis.

    Parameters
    ----------
    library
        The vendor's name of their library: ``"unisim"`` (Spartan-6) or ``"ecp5u"``.

    Returns
    -------
    list of Path
        What ``sources.txt`` of their folder below ``hdl/sim`` lists.
    """
    return _listed(root() / "hdl" / "sim" / library)[_PORTABLE]
