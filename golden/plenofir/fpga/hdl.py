# SPDX-License-Identifier: Apache-2.0
"""The VHDL sources, in the order of analysis."""

from pathlib import Path

from plenofir.files import input_file
from plenofir.project import root


def _listed(path: str) -> list[Path]:
    """What a list below ``hdl`` names, each beside it."""
    found = input_file(root() / "hdl" / path)
    return [input_file(found.parent / line) for line in found.read_text().splitlines()]


def hdl_sources() -> list[Path]:
    """Synthesisable VHDL sources that need no vendor's library, in the order of analysis.

    Returns
    -------
    list of Path
        What ``hdl/sources.txt`` lists.
    """
    return _listed("sources.txt")


def board_sources(board: str = "atlys") -> list[Path]:
    """Synthesisable VHDL sources of a board, in the order of analysis.

    Parameters
    ----------
    board
        Its name.

    Returns
    -------
    list of Path
        The sources of no board, then what ``hdl/sources_NAME.txt`` lists if there is one: they need
        a vendor's library.
    """
    own = f"sources_{board}.txt"
    return hdl_sources() + (_listed(own) if (root() / "hdl" / own).exists() else [])


def all_sources() -> list[Path]:
    """All synthesisable VHDL sources, in the order of analysis.

    Returns
    -------
    list of Path
        Those of no board, then those of each.
    """
    lists = sorted(path.name for path in (root() / "hdl").glob("sources_*.txt"))
    return hdl_sources() + [source for own in lists for source in _listed(own)]


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
    return _listed(f"sim/{library}/sources.txt")
