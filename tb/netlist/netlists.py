# SPDX-License-Identifier: Apache-2.0
"""Netlists of boards in Verilator: Yosys's models of the fabric, own models of the hard blocks."""

import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import run_yosys

FOLDER = Path(__file__).parent


def run(command: list[str], folder: Path) -> str:
    """Run a tool; what it prints."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def netlist_verilog(netlist: Path) -> Path:
    """Verilog of a netlist for nextpnr."""
    run_yosys(
        [
            f"read_json {netlist.name}",
            "delete t:$scopeinfo",
            "write_verilog -noattr -selected netlist.v",
        ],
        netlist.with_name("netlist.log"),
    )
    return netlist.with_name("netlist.v")


def run_netlist(
    netlist: Path, bench: str, models: Sequence[Path], include: Path, parameters: Mapping[str, int]
) -> np.ndarray:
    """Run a bench of this folder with a netlist; the words of its output.hex."""
    folder = netlist.parent
    simulator = find_simulator("verilator")
    # It runs for seconds, optimisation would take minutes. For other options see `build_bench`.
    fast = " ".join(f"OPT_{kind}=-O0" for kind in ("FAST", "SLOW", "GLOBAL"))
    make = f"CFG_CXXFLAGS_PCH_I=-include PYTHON3={shlex.quote(sys.executable)} {fast}"
    run(
        [
            str(Path(simulator.environment["VERILATOR_ROOT"]) / "bin" / "verilator"),
            *("--binary", "--timing", "-Wno-fatal", "-Wno-lint", "-Wno-style"),
            *("--x-assign", "0", "--x-initial", "0", "--top-module", "netlist_bench"),
            *(f"-G{name}={value}" for name, value in parameters.items()),
            f"-I{include}",
            *("-CFLAGS", "-std=gnu++20 -fcoroutines", "-MAKEFLAGS", make),
            *("--Mdir", "model", "-o", "bench"),
            *(str(FOLDER / bench), *map(str, models), netlist.name),
        ],
        folder,
    )
    print(run([str(folder / "model" / "bench")], folder))
    taken = (folder / "output.hex").read_text().split()
    return np.array([int(word, 16) for word in taken], np.uint32)
