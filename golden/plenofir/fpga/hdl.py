# SPDX-License-Identifier: Apache-2.0
"""The VHDL sources, in the order of analysis."""

from pathlib import Path

from plenofir.files import input_file
from plenofir.project import root

_BOARD_MARK = "# Board:"


def _listed(folder: Path) -> tuple[list[Path], list[Path]]:
    """Sources of a folder's ``sources.txt``, before and behind the mark of the board's ones."""
    lines = input_file(folder / "sources.txt").read_text().splitlines()
    marks = [i for i, line in enumerate(lines) if line.startswith(_BOARD_MARK)]
    border = marks[0] if marks else len(lines)
    parts = [
        [input_file(folder / line) for line in part if line and not line.startswith("#")]
        for part in (lines[:border], lines[border:])
    ]
    return parts[0], parts[1]


def hdl_sources() -> list[Path]:
    """Synthesisable VHDL sources that need no vendor's library, in the order of analysis.

    Returns
    -------
    list of Path
        What ``hdl/sources.txt`` lists before the board's sources.
    """
    return _listed(root() / "hdl")[0]


def board_sources() -> list[Path]:
    """All synthesisable VHDL sources, in the order of analysis.

    Returns
    -------
    list of Path
        What ``hdl/sources.txt`` lists; the last ones need the library unisim.
    """
    portable, board = _listed(root() / "hdl")
    return portable + board


def unisim_sources() -> list[Path]:
    """Models of the Spartan-6 primitives for simulation, library unisim, in order of analysis.

    Returns
    -------
    list of Path
        What ``hdl/sim/unisim/sources.txt`` lists.
    """
    return _listed(root() / "hdl" / "sim" / "unisim")[0]
