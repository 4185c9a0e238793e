# SPDX-License-Identifier: Apache-2.0
"""The VHDL sources, in the order of analysis."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from plenofir.fpga.names import DEFAULT_BOARD
from plenofir.ground.files import input_file
from plenofir.ground.project import root


def _listed(path: str) -> list[Path]:
    """What a list below ``hdl`` names, each beside it."""
    listing = input_file(root() / "hdl" / path)
    return [
        input_file(listing.parent / line)
        for line in listing.read_text(encoding="utf-8").splitlines()
    ]


def hdl_sources() -> list[Path]:
    """Sources of ``hdl/sources.txt``: VHDL without a vendor's library, in the order of analysis."""
    return _listed("sources.txt")


def board_sources(board: str = DEFAULT_BOARD) -> list[Path]:
    """Sources of a board in the order of analysis.

    Those of no board, then what ``hdl/sources_NAME.txt`` lists, which needs a vendor's library.
    """
    listing = f"sources_{board}.txt"
    return hdl_sources() + (_listed(listing) if (root() / "hdl" / listing).exists() else [])


def all_sources() -> list[Path]:
    """All synthesisable VHDL sources, in the order of analysis."""
    lists = sorted(path.name for path in (root() / "hdl").glob("sources_*.txt"))
    # Boards of one family share its wrappers.
    sources = dict.fromkeys(source for name in lists for source in _listed(name))
    return hdl_sources() + list(sources)


def with_packages(sources: Sequence[Path], packages: Mapping[str, str], folder: Path) -> list[Path]:
    """Write packages (name to text) into a folder; the sources with them in place of theirs.

    ValueError if there is no such source: the board would be built without the package.
    """
    if missing := packages.keys() - {source.stem for source in sources}:
        raise ValueError(f"no source is named {' or '.join(sorted(missing))}")
    for name, text in packages.items():
        (folder / f"{name}.vhd").write_text(text, encoding="utf-8")
    return [folder / s.name if s.stem in packages else s for s in sources]


def model_sources(library: str = "unisim") -> list[Path]:
    """Models of a family's primitives for simulation, in order of analysis.

    `library` is the vendor's name of theirs: ``"unisim"`` (Spartan-6) or ``"ecp5u"``;
    ``sources.txt`` of its folder below ``hdl/sim`` lists them.
    """
    return _listed(f"sim/{library}/sources.txt")
