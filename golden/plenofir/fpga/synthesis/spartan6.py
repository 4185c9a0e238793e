# SPDX-License-Identifier: Apache-2.0
"""Spartan-6 netlists by Yosys, and their resources."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from plenofir.fpga.resources.record import Figures
from plenofir.fpga.tools.synthesis import Generics, cell_declarations, run_yosys, write_verilog

# Look-up tables of a cell; LUTs as memory come in slices of four.
_LUT_CELLS = {
    **{f"LUT{inputs}": 1 for inputs in range(1, 7)},
    "RAM32M": 4,
    "RAM64M": 4,
    "RAM32X1D": 2,
    "RAM64X1D": 2,
    "RAM128X1D": 4,
    "SRL16E": 1,
    "SRLC32E": 1,
}
_FLIP_FLOP_CELLS = ("FDRE", "FDSE", "FDCE", "FDPE")
_LATCH_CELLS = ("LDCE", "LDPE")
TMDS_ENDS = {
    "IBUFDS": 4,
    "IODELAY2": 6,
    "ISERDES2": 6,
    "OSERDES2": 8,
    "OBUFDS": 4,
    "BUFPLL": 2,
    "PLL_ADV": 2,
    "DCM_CLKGEN": 1,
}
"""Primitives of the TMDS ends and their clocks: three channels and a clock in, the same out."""
# Cells that end a path from register to register.
_REGISTERS = (*_FLIP_FLOP_CELLS, "RAM*", "DSP*", "SRL*", *TMDS_ENDS, "BUF*")


class Netlist(BaseModel):
    """A synthesised design."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    figures: Figures  # what it takes
    cells: dict[str, int]  # number of each type
    edif: Path
    verilog: Path


def cell_models() -> Path:
    """Verilog file of the installed Yosys with models of the cells, block RAM excepted."""
    return cell_declarations()[0].with_name("cells_sim.v")


def synthesise(
    sources: Sequence[Path], top: str, generics: Generics, directory: Path, *, board: bool = False
) -> Netlist:
    """Synthesise a design for Spartan-6 in an empty folder.

    `board`: the ports are pins and the sources instantiate Xilinx's primitives.
    """
    directory.mkdir(parents=True, exist_ok=True)
    verilog = write_verilog(sources, top, generics, directory, primitives="unisim" if board else "")
    pads = "-iopad" if board else "-noiopad"
    netlist = directory / f"{top}.netlist.v"
    edif = directory / f"{top}.edif"
    cells_file, path_file = directory / "cells.json", directory / "path.txt"
    run_yosys(
        [
            f"read_verilog {verilog.name}",
            f"synth_xilinx -family xc6s -flatten -ise {pads} -top {top}",
            f"tee -q -o {cells_file.name} stat -json",
            f"write_edif -pvector bra {edif.name}",
            f"write_verilog -noattr -norename {netlist.name}",
            "delete " + " ".join(f"t:{name}" for name in _REGISTERS),
            f"tee -q -o {path_file.name} ltp -noff",
        ],
        directory / "yosys.log",
        reads=[verilog],
        writes=[file.name for file in (cells_file, path_file, edif, netlist)],
    )
    text = cells_file.read_text()
    counted = json.loads(text[text.index("{") :])["design"]["num_cells_by_type"]
    cells = Counter({name: n for name, n in counted.items() if not name.startswith("$")})
    latches = sum(cells[name] for name in _LATCH_CELLS)
    if latches:
        raise AssertionError(f"{top} has {latches} latches")
    length = next(
        int(line.split("length=")[1].split(")")[0])
        for line in path_file.read_text().splitlines()
        if "length=" in line
    )
    figures = Figures(
        lut=sum(cells[name] * luts for name, luts in _LUT_CELLS.items()),
        flip_flops=sum(cells[name] for name in _FLIP_FLOP_CELLS),
        ramb16=cells["RAMB16BWER"],
        ramb8=cells["RAMB8BWER"],
        dsp=cells["DSP48A1"],
        carry=cells["CARRY4"],
        path=length,
    )
    return Netlist(figures=figures, cells=dict(sorted(cells.items())), edif=edif, verilog=netlist)
