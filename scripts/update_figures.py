# SPDX-License-Identifier: Apache-2.0
"""Synthesises the designs of plenofir.plan.figures and writes their figures into the file.

Arguments: names of designs; all if there are none. JOBS designs at once (all cores without).
"""

import os
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir.fpga.tools.synthesis import ghdl_version, yosys_version
from plenofir.plan.figures import (
    FILE,
    Design,
    FiguresFile,
    designs,
    load_figures,
    save_figures,
)


def synthesise(design: Design) -> tuple[Figures, float]:
    """Figures of a design, and the seconds that they took."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        figures = design.synthesise(Path(folder)).figures
    return figures, time.perf_counter() - started


def main() -> int:
    """Write the file, after each design."""
    ghdl, yosys = ghdl_version(), yosys_version()
    known: dict[str, dict[str, Figures]] = {}
    if FILE.exists() and load_figures().yosys == yosys:
        known = dict(load_figures().figures)
    every = designs()
    chosen = [design for design in every if design.name in sys.argv[1:] or not sys.argv[1:]]
    own = dict(known.get(ghdl, {}))
    # The largest first, so that all jobs end together.
    order = sorted(chosen, key=lambda design: own[design.name].lut if design.name in own else 10**9)
    with ThreadPoolExecutor(int(os.environ.get("JOBS") or os.cpu_count() or 1)) as jobs:
        running = {jobs.submit(synthesise, design): design for design in reversed(order)}
        for done in as_completed(running):
            name = running[done].name
            own[name], seconds = done.result()
            print(f"{name}: {own[name]} ({seconds:.0f} s)", flush=True)
            known[ghdl] = {design.name: own[design.name] for design in every if design.name in own}
            save_figures(FiguresFile(yosys=yosys, figures=known))
    return 0


if __name__ == "__main__":
    sys.exit(main())
