# SPDX-License-Identifier: Apache-2.0
"""Cores in Verilator, by way of GHDL's Verilog and the file bench in C++ (``tb/file_bench``)."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from plenofir.fpga.tools.simulators import Simulator
from plenofir.ground import project

# Compiling a fast program takes some seconds more.
_PIXELS_TO_OPTIMISE_FOR = 100_000
PROGRAM = Path("model/bench")
"""Results of `build_bench`, in its folder."""


def build_bench(
    simulator: Simulator,
    verilog: Sequence[Path],
    top: str,
    directory: Path,
    *,
    pixels: int,
    toggles: bool = False,
    bench: str = "file_bench",
) -> None:
    """Translate a core in Verilog, or its netlist, and compile it with the file bench: `PROGRAM`.

    For many `pixels` the compiler optimises, which takes longer. With `toggles` the program writes
    how often each bit of a signal changes to ``toggles.dat``. `bench` is the name of the file
    bench.
    """
    optimisation = "-O3" if pixels > _PIXELS_TO_OPTIMISE_FOR else "-O0"
    python = f"PYTHON3={shlex.quote(sys.executable)}"
    simulator.run(
        [
            str(Path(simulator.environment["VERILATOR_ROOT"]) / "bin" / "verilator"),
            *("--cc", "--exe", "--build", "--no-timing"),
            *("-Wno-fatal", "-Wno-lint", "-Wno-style"),
            *("--x-assign", "0", "--x-initial", "0"),
            *(("--coverage-toggle", "--coverage-underscore") if toggles else ()),
            # The package does not set the first, compiles for size, and expects a command "python".
            *("-MAKEFLAGS", f"CFG_CXXFLAGS_PCH_I=-include OPT_FAST={optimisation} {python}"),
            *("--top-module", top, "--Mdir", str(PROGRAM.parent), "-o", PROGRAM.name),
            *(str(file.resolve()) for file in verilog),
            str(project.root() / "tb" / "file_bench" / f"{bench}.cpp"),
        ],
        directory,
    )
