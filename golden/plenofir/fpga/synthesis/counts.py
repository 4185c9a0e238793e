# SPDX-License-Identifier: Apache-2.0
"""Counts of a design's cells by Yosys for any family."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from plenofir.fpga.families import FAMILIES, Family
from plenofir.fpga.resources.record import Figures
from plenofir.fpga.synthesis.output_registers import use_output_registers
from plenofir.fpga.tools.synthesis import Generics, run_yosys, write_verilog


def count(
    family: Family,
    sources: Sequence[Path],
    top: str,
    generics: Generics,
    directory: Path,
) -> Figures:
    """Synthesise a design for a family in a folder, and count its resources."""
    directory.mkdir(parents=True, exist_ok=True)
    verilog = write_verilog(sources, top, generics, directory)
    facts, report, netlist = FAMILIES[family], directory / "cells.json", directory / "netlist.json"
    run_yosys(
        [
            f"read_verilog {verilog.name}",
            f"{facts.synthesis} {facts.ports} -top {top}",
            f"tee -q -o {report.name} stat -json",
            f"write_json {netlist.name}",
        ],
        directory / "yosys.log",
        reads=[verilog],
        writes=[report.name, netlist.name],
    )
    text = report.read_text()
    # Yosys prints lines of its own before the JSON.
    cells = json.loads(text[text.index("{") :])["design"]["num_cells_by_type"]
    if family == "ecp5":
        # As before placement: those that block RAM has of its own.
        cells["TRELLIS_FF"] -= use_output_registers(netlist)
    return count_cells(family, cells)


def count_cells(family: Family, cells: Mapping[str, int]) -> Figures:
    """Resources that so many cells of each type take."""
    lut, flip_flops, blocks, multipliers = (
        sum(cells.get(name, 0) * units for name, units in kinds.items())
        for kinds in FAMILIES[family].cells
    )
    return Figures(
        lut=round(lut), flip_flops=round(flip_flops), ramb16=round(blocks), dsp=round(multipliers)
    )
