# SPDX-License-Identifier: Apache-2.0
"""Counts of a design's cells by Yosys for any family, and the cores whose counts are recorded."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.families import FAMILIES, Family
from plenofir.fpga.resources.record import Figures
from plenofir.fpga.synthesis.comparison import LANES, SETS, Cell, measured_cells
from plenofir.fpga.synthesis.output_registers import use_output_registers
from plenofir.fpga.tools.synthesis import Generics, run_yosys, write_verilog
from plenofir.refocus.arithmetic import StoredProductArithmetic

COUNTED: tuple[Family, ...] = ("series7", "cyclonev", "nexus", "gw2a", "gw5a", "gatemate")
"""Families whose counts are recorded; those of GW1N are GW2A's, which has the same cells."""


# Options that the comparison lacks: stored products, several rows at once, interpolation.
_VARIANTS: dict[str, dict[str, Any]] = {
    "fir M=3 a'=0..2 RGB stored, 3 rows": {
        "micro_image_size": 3,
        "shifts": (0, 1, 2),
        "max_columns": 843,
        "channels": 3,
        "arithmetic": StoredProductArithmetic(fraction_bits=0, guard_bits=0),
        "engine": FirEngine(parallel_rows=3),
    },
    "fir M=3 a'=1 grey, 3 rows": {
        "micro_image_size": 3,
        "shifts": (1,),
        "max_columns": 640,
        "engine": FirEngine(parallel_rows=3),
    },
    "fir M=5 a'=2 grey stored": {
        "micro_image_size": 5,
        "shifts": (2,),
        "max_columns": 640,
        "arithmetic": StoredProductArithmetic(),
    },
    "fir M=5 a'=2 grey linear": {
        "micro_image_size": 5,
        "shifts": (2,),
        "max_columns": 640,
        "order": 1,
    },
    "moving_sum M=5 a'=2 grey linear": {
        "micro_image_size": 5,
        "shifts": (2,),
        "max_columns": 640,
        "order": 1,
        "engine": MovingSumEngine(),
    },
}


def counted_cores() -> Iterator[tuple[str, CoreConfiguration]]:
    """Cores that are counted for each family, by name: cells of the comparison, and variants."""
    for cell in measured_cells():
        m = cell.micro_image_size
        one = len(cell.shifts) == 1 and cell.shifts[0] in (2, m)
        if one or (m, cell.shifts, cell.channels) in SETS:
            yield cell.name, cell.core()
    for lanes in LANES:
        cell = Cell(*lanes[:3], "moving_sum", 2)
        yield cell.name, cell.core()
    for name, fields in _VARIANTS.items():
        yield name, CoreConfiguration.model_validate(fields)


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
