# SPDX-License-Identifier: Apache-2.0
"""Switching activity of a netlist: how often each net changes while frames go through it."""

import json
import re
import shutil
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.resources.record import Figures
from plenofir.fpga.simulate.file_bench import CORE, core_generics, core_sources, run_bench
from plenofir.fpga.synthesis.spartan6 import cell_models, synthesise
from plenofir.fpga.tools.simulators import SimulationError, Simulator
from plenofir.fpga.tools.synthesis import run_yosys
from plenofir.refocus.operator import Image
from plenofir_studies.block_rams import block_ram_models

_CHANGE = re.compile(rb"\x01o\x02([^\x01]+):(?:0->1|1->0)\x01[^']*' (\d+)$")
_CARRY = "CARRY4"
# Pins that a driver in the same slice reaches without external routing.
_INSIDE_SLICE = {"FDRE": {"D"}, "FDSE": {"D"}, _CARRY: {"S", "DI", "CI"}, "MUXF7": {"I0", "I1"}}
_INSIDE_SLICE["FDCE"] = _INSIDE_SLICE["FDPE"] = {"D"}
_INSIDE_SLICE["MUXF8"] = _INSIDE_SLICE["MUXF7"]


@dataclass(frozen=True)
class Activity:
    """Switching activity of a core while frames go through it."""

    figures: Figures  # resources of the netlist
    clocks: int  # from the first pixel in to the last pixel out
    pixels: int  # of all frames
    nets: int  # nets that leave their slice
    toggles: int  # changes of these nets, without the clock and glitches
    inside: int  # changes of nets inside a slice

    @property
    def rate(self) -> float:
        """Mean number of changes per clock of a net that leaves its slice."""
        return self.toggles / self.nets / self.clocks


def read_toggles(path: Path) -> dict[str, int]:
    """Changes of each signal, or bit (``name[bit]``), in both directions, from ``toggles.dat``."""
    counts: Counter[str] = Counter()
    for line in path.read_bytes().splitlines():
        if match := _CHANGE.search(line):
            counts[match[1].decode()] += int(match[2])
    return dict(counts)


def net_toggles(netlist: Mapping[str, Any], toggles: Mapping[str, int]) -> dict[int, int]:
    """Changes of each net of a netlist (a module of Yosys' JSON), by its number.

    Nets without a signal's name are left out.
    """
    counts = {}
    for name, net in netlist["netnames"].items():
        bits, low = net["bits"], net.get("offset", 0)
        for place, bit in enumerate(bits):
            key = name if len(bits) == 1 and name in toggles else f"{name}[{low + place}]"
            if isinstance(bit, int) and key in toggles:
                counts[bit] = toggles[key]
    return counts


def count_activity(netlist: Mapping[str, Any], toggles: Mapping[str, int]) -> tuple[int, int, int]:
    """Count the changes of nets that leave their slice, and of those that do not.

    Result: number of nets that cells drive and that leave their slice; their changes; and changes
    of the nets that go only to a flip-flop, multiplexer or carry chain in the same slice.
    """
    changes = net_toggles(netlist, toggles)
    driven: set[int] = set()
    clocks: set[int] = set()
    outside: set[int] = {
        bit
        for port in netlist["ports"].values()
        if port["direction"] == "output"
        for bit in port["bits"]
        if isinstance(bit, int)
    }
    readers: Counter[int] = Counter()
    for cell in netlist["cells"].values():
        kind = cell["type"]
        near = _INSIDE_SLICE.get(kind, set())
        for pin, bits in cell["connections"].items():
            numbers = {bit for bit in bits if isinstance(bit, int)}
            if cell["port_directions"][pin] == "output":
                driven |= numbers
                continue
            readers.update(numbers)
            if pin.startswith(("CLK", "WCLK")) or (pin == "C" and kind.startswith("FD")):
                clocks |= numbers
            elif pin not in near:
                outside |= numbers
    used = {bit for bit in driven & changes.keys() if readers[bit] or bit in outside} - clocks
    # Only the flip-flop beside the LUT is in the slice: a net with more readers leaves it.
    routed = {bit for bit in used if bit in outside or readers[bit] > 1}
    return (
        len(routed),
        sum(changes[bit] for bit in routed),
        sum(changes[bit] for bit in used - routed),
    )


def simulate_activity(
    simulator: Simulator, core: CoreConfiguration, frames: Image, directory: Path
) -> Activity:
    """Synthesise a core for Spartan-6, send frames through the netlist, and count changes.

    Frames: (frames, rows, columns[, channels]); the simulator is Verilator. SimulationError if the
    netlist's frames are not the golden model's.
    """
    netlist = synthesise(core_sources(), CORE, core_generics(core), directory)
    # Short names, one for each net.
    run_yosys(
        [
            f"read_verilog -lib {cell_models()}",
            f"read_verilog -lib {cell_models().with_name('cells_xtra.v')}",
            f"read_verilog {netlist.verilog.name}",
            f"hierarchy -top {CORE}",
            "opt_clean -purge",
            "rename -hide w:*",
            "rename -enumerate -pattern n% w:*",
            "write_verilog -noattr -norename nets.v",
            f"select {CORE}",
            "write_json -selected nets.json",
        ],
        directory / "nets.log",
    )
    cells = directory / "cells.v"
    cells.write_text(
        f"// verilator coverage_off\n{cell_models().read_text()}\n{block_ram_models()}"
    )
    bench = directory / "bench"
    shutil.rmtree(bench, ignore_errors=True)
    result = run_bench(
        simulator, core, frames, bench, verilog=[directory / "nets.v", cells], toggles=True
    )
    want = np.stack([core.golden(frame) for frame in frames])
    frames_out = result.frames[:, np.newaxis] if result.stacks is None else result.stacks
    if not np.array_equal(frames_out, want[:, : frames_out.shape[1]]):
        raise SimulationError("the netlist's frames are not those of the golden model")
    module = json.loads((directory / "nets.json").read_text())["modules"][CORE]
    nets, toggles, inside = count_activity(module, read_toggles(bench / "toggles.dat"))
    return Activity(
        figures=netlist.figures,
        clocks=result.clocks,
        pixels=int(np.prod(frames.shape[:3])),
        nets=nets,
        toggles=toggles,
        inside=inside,
    )
