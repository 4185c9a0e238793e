# SPDX-License-Identifier: Apache-2.0
"""Synthesises the cells of the comparison of both engines, and places some of them.

What data/comparison.json has already is left as it is, so a run that was cut off goes on.
Arguments: parts of the names of cells (all if there are none); --again measures anew; --places
also places and routes (needs nextpnr).
"""

import sys
import tempfile
import time
from collections.abc import Container
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.synthesis.comparison import (
    FILE,
    Cell,
    Comparison,
    load_comparison,
    measured_cells,
    placed_cells,
    save_comparison,
)
from plenofir.fpga.synthesis.ecp5 import check_tools, make_netlist, place
from plenofir.fpga.synthesis.spartan6 import Figures, synthesise
from plenofir.fpga.tools.synthesis import ghdl_version, yosys_version
from plenofir.plan.figures import CORE


def main() -> int:
    """Write the file, after each cell."""
    ghdl, yosys = ghdl_version(), yosys_version()
    wanted = [text for text in sys.argv[1:] if not text.startswith("--")]
    again = "--again" in sys.argv

    def chosen(cells: list[Cell], known: Container[str]) -> list[Cell]:
        named = [c for c in cells if not wanted or any(text in c.name for text in wanted)]
        return [cell for cell in named if again or cell.name not in known]

    content = Comparison(ghdl=ghdl, yosys=yosys, figures={}, placed={})
    if FILE.exists():
        known = load_comparison()
        if (known.ghdl, known.yosys) == (ghdl, yosys):
            content = known
    every_cell = list(measured_cells())
    order = [cell.name for cell in every_cell]
    cells = chosen(every_cell, content.figures)
    for number, cell in enumerate(cells):
        started = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            figures = synthesise(
                hdl.hdl_sources(), CORE, cell.core().generics(), Path(folder)
            ).figures
        seconds = time.perf_counter() - started
        print(f"{number + 1}/{len(cells)} {cell.name}: {figures} ({seconds:.0f} s)", flush=True)
        every: dict[str, Figures] = {**content.figures, cell.name: figures}
        content = content.model_copy(
            update={"figures": {name: every[name] for name in order if name in every}}
        )
        save_comparison(content)
    if "--places" not in sys.argv:
        return 0
    check_tools()
    for cell in chosen(list(placed_cells()), content.placed):
        with tempfile.TemporaryDirectory() as folder:
            netlist = make_netlist(
                hdl.hdl_sources(),
                CORE,
                cell.core().generics(),
                Path(folder),
                behind_few_pins=cell.pixels_per_clock > 1,
            )
            placed = place(netlist)
        print(f"{cell.name}: {placed}", flush=True)
        content = content.model_copy(update={"placed": {**content.placed, cell.name: placed}})
        save_comparison(content)
    return 0


if __name__ == "__main__":
    sys.exit(main())
