"""Synthesises the designs of plenofir.plan.figures and writes their figures into the file.

Arguments: names of designs; all if there are none.
"""

import sys
import tempfile
import time
from pathlib import Path

from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir.fpga.synthesis.tools import ghdl_version, yosys_version
from plenofir.plan.figures import (
    FILE,
    Design,
    FiguresFile,
    designs,
    load_figures,
    save_figures,
)


def chosen(names: list[str]) -> list[Design]:
    """Designs that the arguments name."""
    every = designs()
    return [design for design in every if not names or design.name in names]


def main() -> int:
    """Write the file, after each design."""
    ghdl, yosys = ghdl_version(), yosys_version()
    known: dict[str, dict[str, Figures]] = {}
    if FILE.exists() and load_figures().yosys == yosys:
        known = dict(load_figures().figures)
    order = [design.name for design in designs()]
    for design in chosen(sys.argv[1:]):
        started = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            figures = design.synthesise(Path(folder)).figures
        print(f"{design.name}: {figures} ({time.perf_counter() - started:.0f} s)", flush=True)
        own = {**known.get(ghdl, {}), design.name: figures}
        known[ghdl] = {name: own[name] for name in order if name in own}
        save_figures(FiguresFile(yosys=yosys, figures=known))
    return 0


if __name__ == "__main__":
    sys.exit(main())
