# SPDX-License-Identifier: Apache-2.0
"""A build with GHDL, Yosys, nextpnr and a packer, for any family that nextpnr places."""

import importlib.metadata
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.steps import Progress, nextpnr_stage, run_steps
from plenofir.fpga.boards import Board
from plenofir.fpga.tools.synthesis import (
    Generics,
    ghdl_version,
    run_tool,
    write_verilog,
    yosys_version,
)
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish, remove_results


class ClockTiming(BaseModel):
    """Wanted and reached frequency of a clock."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    clock: str
    wanted_mhz: float  # fastest clock of the build
    reached_mhz: float  # what the placed design keeps


class CrossingTiming(BaseModel):
    """Longest delay of words between two clocks, and the time available."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    crossing: str  # both clocks
    wanted_ns: float  # time available
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
    crossings: tuple[CrossingTiming, ...]  # between clocks that are not asynchronous
    utilisation: dict[str, tuple[int, int]]  # resource: used, there
    plls: dict[
        str, dict[str, int]
    ] = {}  # corner of the device: words of the finished configuration
    pins: dict[str, str] = {}  # what each is set to in it
    beyond_data_sheet: tuple[str, ...] = ()  # see `ecp5_limits`
    tools: dict[str, str]  # versions
    seconds: dict[str, float]  # processor time of each tool


Judged = tuple[tuple[ClockTiming, ...], tuple[CrossingTiming, ...]]
"""What clocks and crossings reach."""


@dataclass(frozen=True)
class OpenBuild:
    """The design to build, the options of a family's tools; files are beside the netlist."""

    board: Board
    device: str
    top: str
    generics: Generics  # those that differ from the top level's defaults
    packages: Mapping[str, str]  # VHDL packages in place of the board's own: name to text
    constraints: Mapping[str, str]  # files that nextpnr reads: name to text
    check: Callable[[], object]  # InputError if a tool is missing
    tools: tuple[str, ...]  # packages whose versions the report names beside GHDL's and Yosys's
    synthesise: Callable[[Path], None]  # makes this netlist of the Verilog that GHDL wrote
    place: Sequence[str]  # nextpnr's command without netlist and report
    judge: Callable[[Mapping[str, Any]], Judged]  # reads nextpnr's report
    packer: str  # name of the last step, and its command
    pack: Sequence[str]
    bits: str  # name of the bitstream
    utilisation: Mapping[str, tuple[str, ...]]  # resource: nextpnr's kinds of it
    clocks_mhz: tuple[float, float]  # slowest and fastest pixel clock
    # Step in the folder before the configuration is packed; result: fields of the report.
    finish: Callable[[Path], Mapping[str, Any]] = lambda _: {}


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


def check_constraints(log: Path) -> None:
    """Refuse a placement from which nextpnr left out a constraint, which it only warns of."""
    ignored = re.search(r"^Warning: *(.*\bignoring\b.*)$", log.read_text(errors="replace"), re.M)
    if ignored:
        raise InputError(
            f"nextpnr left a constraint out: {ignored[1]}; name what the netlist has",
            where=str(log),
        )


def versions(build: OpenBuild) -> dict[str, str]:
    """Versions of the tools; InputError if one is missing."""
    build.check()
    return {
        "ghdl": ghdl_version(),
        "yosys": yosys_version(),
        **{name: importlib.metadata.version(name) for name in build.tools},
    }


def run_build(build: OpenBuild, out: Path, progress: Progress) -> NextpnrReport:
    """Build a bitstream; the result is also in ``report.json``.

    There is none if a tool fails, the device is too small, or timing is not met.
    """
    tools, top = versions(build), build.top
    work = out / "work"
    # An older bitstream would pass for this one if a tool fails.
    remove_results([out / build.bits, out / "report.json", work])
    work.mkdir(parents=True)
    sources = hdl.with_packages(hdl.board_sources(build.board.name), build.packages, work)
    for name, text in build.constraints.items():
        (work / name).write_text(text)
    netlist, report, log = work / f"{top}.json", work / "nextpnr.json", work / "nextpnr.log"
    judged: Judged = ((), ())
    content: dict[str, Any] = {}
    entries: Mapping[str, Any] = {}

    def analyse() -> None:
        library = build.board.library
        write_verilog(
            sources, top, build.generics, work, primitives=library, contents_in_files=True
        )

    def place() -> None:
        nonlocal content, judged
        # Timing is judged here, clock by clock; nextpnr would end without a report.
        files = ("--json", netlist.name, "--report", report.name, "--timing-allow-fail")
        stage_bar = lambda: progress(f"nextpnr: {nextpnr_stage(log)}", 2, len(steps))  # noqa: E731
        run_tool([*build.place, *files], log, poll=stage_bar)
        check_constraints(log)
        content = json.loads(report.read_text())
        judged = build.judge(content)
        check_timing(*judged, report)

    def pack() -> None:
        nonlocal entries
        entries = build.finish(work)
        run_tool(list(build.pack), work / f"{build.packer}.log")

    steps = {
        "ghdl": analyse,
        "yosys": lambda: build.synthesise(netlist),
        "nextpnr": place,
        build.packer: pack,
    }
    seconds = run_steps(steps, work, progress)
    used = content["utilization"]
    timing, crossings = judged
    result = NextpnrReport(
        board=build.board.name,
        device=build.device,
        top=top,
        generics=dict(build.generics),
        clocks_mhz=build.clocks_mhz,
        timing=timing,
        crossings=crossings,
        utilisation={
            name: (
                sum(used[kind]["used"] for kind in kinds if kind in used),
                sum(used[kind]["available"] for kind in kinds if kind in used),
            )
            for name, kinds in build.utilisation.items()
        },
        tools=tools,
        seconds=seconds,
        **entries,
    )
    publish(
        {
            build.bits: (work / build.bits).read_bytes(),
            "report.json": result.model_dump_json(indent=2) + "\n",
        },
        out,
    )
    return result
