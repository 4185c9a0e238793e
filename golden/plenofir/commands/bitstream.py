# SPDX-License-Identifier: Apache-2.0
"""The command bitstream build, for all boards."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plenofir.commands import options
from plenofir.commands.console import print_line, steps_bar
from plenofir.commands.groups import grouped
from plenofir.fpga.names import DEFAULT_BOARD, DEFAULT_ENGINE, BoardName
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.fpga.bitstream import top_level
    from plenofir.fpga.bitstream.ise import BuildReport
    from plenofir.fpga.bitstream.open_build import NextpnrReport
    from plenofir.fpga.bitstream.steps import Progress
    from plenofir.fpga.boards import Board
    from plenofir.fpga.core.configuration import CoreConfiguration
    from plenofir.plan import Plan

# A build has hundreds of warnings that repeat; the first ones tell a fault.
_MOST_WARNINGS = 20

app = typer.Typer(no_args_is_help=True, help="Build the bitstream of a board.")


def board_generics(core: Mapping[str, Any]) -> "dict[str, top_level.Value]":
    """Generics of the top level that options mean; the others keep the top level's defaults."""
    from plenofir.fpga.bitstream import top_level
    from plenofir.refocus import interpolation_order
    from plenofir.refocus.arithmetic import StoredProductArithmetic

    options.check_combinations(
        core,
        {
            "engine": core.get("engine", DEFAULT_ENGINE),
            "arith": core.get("arith", "stored"),
        },
    )
    values: dict[str, top_level.Value] = {}
    if "micro_image" in core:
        options.require("micro_image", "a", "a" not in core)
        values["MICRO_IMAGE_SIZE"] = core["micro_image"]
    if "a" in core:
        size = int(values.get("MICRO_IMAGE_SIZE", top_level.default_generics()["MICRO_IMAGE_SIZE"]))
        shifts = options.shifts_of(options.focus_settings(core["a"], size), size)
        values["SHIFTS"] = " ".join(map(str, shifts))
    if "max_columns" in core:
        values["MAX_COLUMNS"] = core["max_columns"]
    if "engine" in core:
        values["ENGINE"] = core["engine"]
    if "interpolation" in core:
        values["INTERPOLATION_ORDER"] = interpolation_order(core["interpolation"])
    if {"arith", "fraction", "guard"} & set(core):
        arithmetic = options.arithmetic(
            core.get("arith", "stored"),
            core.get("fraction"),
            core.get("guard"),
        )
        values["EXACT"] = not isinstance(arithmetic, StoredProductArithmetic)
        if isinstance(arithmetic, StoredProductArithmetic):
            values["FRACTION_BITS"] = arithmetic.fraction_bits
            values["GUARD_BITS"] = arithmetic.guard_bits
    return values


def device_of(board: "Board", device: str) -> str:
    """A board's device by any of its names; InputError if it has none of it."""
    name = board.device(device)
    if name is None:
        raise InputError(
            f"the {board.title} has no {device}; choose from {', '.join(board.devices)}",
            where=options.typed("device"),
        )
    return name


def scene_plan(path: str, board: str | None = None, device: str | None = None) -> "Plan":
    """Plan of a scene that is a board's; board and device that are named go before its own."""
    from plenofir.fpga.boards import BOARDS, board_of
    from plenofir.plan import load_scene, make_plan

    loaded = load_scene(path)
    scene_device, project_path = loaded.scene.build.device, loaded.scene.build.path
    target = BOARDS[board] if board else board_of(scene_device)
    if target is not None and not target.modes and target.camera is None:
        raise InputError(
            f"the {target.title} takes no scene; give -M, -a and the other options instead",
            where=options.typed("board", str(board)),
        )
    if target is not None:
        # A board that is named may be another than the scene's, without its device.
        usual = scene_device if scene_device in target.devices else target.devices[0]
        chosen = device_of(target, device) if device else usual
        loaded = loaded if chosen == scene_device else load_scene(path, chosen)
    plan = make_plan(loaded)
    if plan.path == "core" and project_path != "core" and target is not None:
        raise InputError(
            f"the {target.title} has no input for {plan.scene} and does not show "
            f"{plan.columns} x {plan.rows} pixels; name another board",
            where=path,
        )
    if plan.path == "core":
        raise InputError(
            f"{plan.scene} is a core, not a board; synthesise it with make synth, or set "
            'build.path = "video" or "camera"',
            where=path,
        )
    return plan


def chosen_board(board: str | None, device: str | None, plan: "Plan | None") -> "tuple[Board, str]":
    """Board and device to build for: those of the scene's plan, or those that were named."""
    from plenofir.fpga.boards import BOARDS, board_of

    if plan is not None and (of_scene := board_of(plan.device)) is not None:
        # Several boards may have the plan's device.
        return BOARDS[board] if board else of_scene, plan.device
    chosen = BOARDS[board or DEFAULT_BOARD]
    return chosen, device_of(chosen, device) if device else chosen.devices[0]


def checked_core(
    board: "Board", device: str, generics: "dict[str, top_level.Value]"
) -> "CoreConfiguration":
    """Refocuser that generics mean; refused where the device is too small, board and all."""
    from plenofir.fpga.bitstream import top_level
    from plenofir.fpga.devices import DEVICES
    from plenofir.fpga.resources.estimate import VIDEO, estimate

    part = DEVICES[device]
    core = top_level.configuration({**top_level.default_generics(board.top), **generics})
    core.check_limits()
    blocks = (*core.blocks, VIDEO) if board.modes else core.blocks
    if over := part.overflow(estimate(blocks, part.family)):
        raise InputError(
            f"the {device.upper()} is too small: it needs {'; '.join(over)}; use fewer "
            "slices or columns, or a smaller M"
        )
    return core


def build_core(
    board: "Board",
    device: str,
    generics: "dict[str, top_level.Value]",
    out: Path,
    progress: "Progress",
    *,
    beyond: bool = False,
) -> "NextpnrReport":
    """Build with open tools what options mean, without a scene."""
    from plenofir.fpga.bitstream import gowin, nextpnr, nexus

    core = checked_core(board, device, generics)
    if board.flow == "gowin":
        return gowin.build(board, device, generics, out, progress)
    if board.flow == "nexus":
        # A camera whose frames are rasters.
        return nexus.build(board, device, generics, nexus.DEFAULT_CLOCKS, out, progress)
    clocks = 0
    if board.modes:
        # The slowest mode that has such lines.
        fit = [mode for mode in board.modes if mode.h_active <= core.max_columns]
        # Where every mode has longer lines, the first one says the clock.
        modes = fit or board.modes[:1]
        widest = next(mode for mode in modes if mode.h_active == max(m.h_active for m in modes))
        clocks = board.clock_range(widest)
    return nextpnr.build(board, device, generics, clocks, out, progress, beyond=beyond)


@dataclass(frozen=True)
class _Core:
    """The core, where no scene decides; the board's own where an option is missing."""

    micro_image: options.MicroImageIfGiven = None
    a: options.SettingsIfGiven = None
    max_columns: Annotated[
        int | None, typer.Option(help="Longest line that the core takes, in pixels.", min=1)
    ] = None
    engine: options.EngineIfGiven = None
    interpolation: options.InterpolationIfGiven = None
    arith: options.ArithIfGiven = None
    fraction: options.FractionIfGiven = None
    guard: options.GuardIfGiven = None


@app.command()
@grouped
def build(
    core: _Core,
    scene: options.SceneIfGiven = None,
    board: Annotated[
        BoardName | None,
        typer.Option(
            help="Board; by default that of the scene, or the Atlys. Without --scene the ULX3S "
            "builds a scene of its own."
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(help="Device, for a board that is sold with several: lfe5u-25f, or 25f."),
    ] = None,
    beyond_data_sheet: Annotated[
        bool,
        typer.Option(
            "--beyond-data-sheet",
            help="Build even if a clock is above the limit of the device's data sheet.",
        ),
    ] = False,
    out: options.OutFolder = "build/bitstream",
    ise: Annotated[str, typer.Option(help="ISE_DS folder, if ISE is not on the PATH.")] = "",
) -> None:
    """Build the bitstream of a board: the Atlys with Xilinx ISE 14.7, others with open tools."""
    from plenofir.fpga.bitstream import ise as tools
    from plenofir.fpga.boards import BOARDS
    from plenofir.fpga.hdmi.edid import describe_edid
    from plenofir.plan.board_build import build_scene
    from plenofir.plan.configure import board_packages, scene_generics

    options_of_core = {
        name: value for name, value in asdict(core).items() if value not in (None, [], ())
    }
    if scene is not None and options_of_core:
        options.refuse_both(next(iter(options_of_core)), options.typed("scene"))
    if scene is None and not options_of_core and board is not None:
        scene = BOARDS[board].scene or None
    plan = None if scene is None else scene_plan(scene, board, device)
    target, part = chosen_board(board, device, plan)
    if target.flow == "vivado":
        raise InputError(
            f"the {target.title} is built by Vivado; write its project by plenofir project "
            f"{scene or target.scene}",
            where=options.typed("board", target.name),
        )
    generics = board_generics(options_of_core) if plan is None else scene_generics(plan)
    if target.flow != "ise":
        with steps_bar("bitstream", 0.0) as show:
            if plan is not None:
                built = build_scene(plan, Path(out), show, board=target, beyond=beyond_data_sheet)
            else:
                built = build_core(
                    target, part, generics, Path(out), show, beyond=beyond_data_sheet
                )
        _print_nextpnr(built, out)
        return
    installation = tools.find_installation(ise)
    packages = {} if plan is None else board_packages(plan)
    with steps_bar("bitstream") as show:
        report = tools.build(installation, generics, Path(out), show, packages)
    if plan is not None and plan.edid is not None:
        print_line("edid", describe_edid(bytes.fromhex(plan.edid)))
    _print_ise(report, out)


def _print_ise(report: "BuildReport", out: str) -> None:
    for site, (used, there) in report.utilisation.items():
        print_line(site, f"{used} of {there}")
    for entry in report.timing:
        best = "no path" if entry.best is None else f"{entry.best:g} ns would be met"
        print_line("timing", f"{entry.constraint}: met, {best}")
    for clock, constraint in report.clocks.items():
        print_line("clock", f"{clock}: timed by {constraint.split(' = ')[0]}")
    for warning in report.warnings[:_MOST_WARNINGS]:
        times = f" ({warning.times} times)" if warning.times > 1 else ""
        print_line("warning", f"{warning.tool}: {warning.code}: {warning.text}{times}")
    rest = len(report.warnings) - _MOST_WARNINGS
    if rest > 0:
        print_line("", f"{rest} more in report.json")
    print_line("files", f"{out}/plenofir.bit, report.json, logs, work/")


def _print_nextpnr(report: "NextpnrReport", out: str) -> None:
    from plenofir.fpga.boards import BOARDS

    low, high = report.clocks_mhz
    several = low and low < high
    clocks = (
        f"pixel clocks of {low:g} to {high:g} MHz" if several else f"pixel clock of {high:g} MHz"
    )
    print_line("board", f"{report.board}, {report.device}: {clocks}")
    for site, (used, there) in report.utilisation.items():
        print_line(site, f"{used} of {there}")
    for clock in report.timing:
        reached = f"{clock.reached_mhz:g} MHz of {clock.wanted_mhz:g} MHz wanted"
        print_line("clock", f"{clock.clock}: {reached}")
    for crossing in report.crossings:
        print_line(
            "crossing",
            f"{crossing.crossing}: {crossing.reached_ns:g} ns of {crossing.wanted_ns:g} ns",
        )
    for corner, words in report.plls.items():
        print_line("PLL", f"{corner}: {', '.join(f'{n} {w}' for n, w in words.items())}")
    for sentence in report.beyond_data_sheet:
        print_line("data sheet", f"beyond it: {sentence}")
    print_line("seconds", f"{sum(report.seconds.values()):.0f} of processor time")
    print_line("files", f"{out}/{BOARDS[report.board].bitstream}, report.json, work/")
