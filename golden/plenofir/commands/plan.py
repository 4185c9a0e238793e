# SPDX-License-Identifier: Apache-2.0
"""Commands from a scene to hardware: plan, configure, synth."""

import tempfile
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import options
from plenofir.commands.console import print_json, print_line, print_table, steps_bar
from plenofir.commands.results import check_plot_and_csv, write_plot_and_csv
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from plenofir.fpga.devices import Device
    from plenofir.fpga.resources.record import Figures
    from plenofir.plan.plan import Plan, PlannedSensor
    from plenofir.plan.sensor.resampler import Load

Scene = Annotated[str, typer.Argument(help="Scene, a TOML file or the name of a shipped one.")]
Part = Annotated[
    str | None,
    typer.Option(
        "--device", help="Device to use instead of the scene's, such as xc7a35t (plenofir devices)."
    ),
]

app = typer.Typer()


def _millimetres(value: float | None) -> str:
    return "inf" if value is None or value == inf else f"{value:.1f}"


def _amounts(amounts: dict[str, int]) -> str:
    return ", ".join(f"{amount} {name}" for name, amount in amounts.items())


def _takes(plan: "Plan", kind: str) -> str:
    """Amounts of a device that blocks of a kind in a plan's core take."""
    from plenofir.fpga.resources.estimate import estimate

    device = plan.chip
    blocks = (block for block in plan.core.blocks if block.kind == kind)
    amounts = device.amounts(estimate(blocks, device.family))
    return _amounts({name: amount for name, amount in amounts.items() if amount})


def _sharpening(plan: "Plan") -> str:
    """Weights of the slices, and what they take."""
    from plenofir.fpga.core.sharpener import sharpener_bits
    from plenofir.refocus.sharpening import WEIGHT_UNITS

    core = plan.core
    weights = " ".join(str(Fraction(weight, WEIGHT_UNITS)) for weight in core.weights)
    lines = 2 * core.micro_image_size
    kbit = sharpener_bits(core, core.pixels_per_clock) / 1024
    return (
        f"b = {weights}: {lines} lines of sums ({kbit:.0f} Kbit), takes {_takes(plan, 'sharpener')}"
    )


def print_sensor(sensor: "PlannedSensor") -> None:
    """Print what makes the raster of raw frames."""
    core = sensor.core
    mosaic = "" if sensor.mosaic is None else f", mosaic {sensor.mosaic}"
    lenses = "hexagonal rows" if core.hexagonal else "rectangular"
    source = "calibration built in" if sensor.calibrated else "calibration loaded at run time"
    print_line(
        "sensor",
        f"{sensor.columns} x {sensor.rows}, {core.pixel_bits} bit{mosaic}; {lenses}, {source}",
    )
    print_line("ring", f"{sensor.lines} raw lines ({sensor.ring_bits / 1024:.0f} Kbit)")
    if not sensor.full_rate:
        print_line("note", "the raster has more pixels than the raw frame: the source must wait")
    needs = {name: amount for name, amount in sensor.needs.items() if amount}
    print_line("resampler", f"takes {_amounts(needs)}")


_OUTPUTS = {
    "r": "refocused",
    "a": "all-in-focus",
    "d": "depth",
    "i": "depth index",
    "s": "all slices",
}


def print_screen(plan: "Plan") -> None:
    """Print what comes out besides the refocused slice."""
    screen = plan.screen
    if screen.needs_stack:
        print_line("output", ", ".join(_OUTPUTS[letter] for letter in screen.outputs))
    if screen.needs_index:
        votes = f", votes within {screen.vote_radius}" if screen.vote_radius else ""
        waiting = screen.index(plan.core).memory_bits[0]
        print_line(
            "index",
            f"sharpness within {screen.radius} micro images{votes}; "
            + (f"pixels wait in {waiting / 1024:.0f} Kbit" if waiting else "no pixel waits"),
        )
    if screen.overlay is not None and plan.screen_needs is not None:
        takes = {name: amount for name, amount in plan.screen_needs.items() if amount}
        print_line("text", f"takes {_amounts(takes)}")
        for text in screen.overlay.texts:
            print_line("", text)
    if plan.stored is not None and plan.stored_needs is not None:
        takes = {name: amount for name, amount in plan.stored_needs.items() if amount}
        rows, columns = plan.stored.lenses
        print_line("stored", f"{columns} x {rows} micro images, takes {_amounts(takes)}")


def _beside(needed: float, full: float) -> tuple[str, str, str]:
    """An amount, that of the full build, and what leaving out changes."""
    change = f"{round(100 * (needed / full - 1)):+d}%" if full else ""
    return f"{needed:g}", f"{full:g}", "0%" if change == "+0%" else change


def print_placed(plan: "Plan") -> None:
    """Print what was recorded of a shipped scene's core and its full build, their clocks too."""
    from plenofir.plan.placements import placed_beside_full

    placement = placed_beside_full(plan)
    if placement is None:
        return
    print_table(
        ("core, placed", "this scene", "full build", "change"),
        [
            (name, *_beside(needed, placement.full[name]))
            for name, needed in placement.scene.items()
        ],
        left=("core, placed",),
        title=f"recorded, on an {placement.device}",
    )


def _print_frames(plan: "Plan") -> None:
    """Print what comes in: frames, sensor, camera, video, and the clock."""
    from plenofir.fpga.hdmi.edid import describe_edid

    core = plan.core
    frame = f"{plan.columns} x {plan.rows}, {core.channels} x {core.pixel_bits} bit"
    least = "" if plan.path == "video" else "at least "
    clock = "still" if plan.clock_mhz is None else f"pixel clock {least}{plan.clock_mhz:g} MHz"
    print_line("scene", f"{plan.scene}: {frame}, M = {core.micro_image_size}, {clock}")
    if plan.sensor is not None:
        print_sensor(plan.sensor)
    if core.pixels_per_clock > 1 and plan.clock_mhz is not None:
        print_line(
            "pixels",
            f"{core.pixels_per_clock} a clock, {plan.columns * plan.rows / plan.frame_clocks:.3g} "
            "with the ends of lines",
        )
    if plan.path == "core":
        kept = f"keeps {plan.kept_mhz:g} MHz" if plan.kept_mhz else "has no known clock"
        print_line(
            "clock",
            f"built for {plan.built_mhz:g} MHz; the {plan.part} {kept}"
            + " (assumed: no open tool places it in this grade)" * plan.chip.assumed,
        )
    if plan.blanking is not None:
        board = "in and out on the board, " if plan.path == "video" else ""
        print_line(
            "video",
            f"{board}blanking of {plan.blanking[0]} pixels and {plan.blanking[1]} lines",
        )
    if (camera := plan.camera) is not None:
        slow, fast = camera.clock_mhz, camera.wanted_mhz
        clock = f"{slow:g} MHz" if slow == fast else f"{slow:g} to {fast:g} MHz"
        print_line(
            "camera",
            f"{camera.board.lanes} lanes of {camera.lane_mbits:g} Mb/s, their bytes at "
            f"{camera.byte_mhz:g} MHz; the core's clock is {clock}, {camera.needed_mhz:.4g} needed",
        )
    if plan.edid is not None:
        print_line("edid", f"the scene's own: {describe_edid(bytes.fromhex(plan.edid))}")


def print_plan(plan: "Plan") -> None:
    """Print a plan for a person."""
    _print_frames(plan)
    core = plan.core
    for part in plan.slices:
        depth = (
            ""
            if part.near_mm is None
            else f", sharp from {_millimetres(part.near_mm)} to {_millimetres(part.far_mm)} mm"
        )
        print_line("slice", f"a = {part.a} (a' = {part.shift}){depth}")
    for low, high in plan.gaps_mm:
        print_line("not covered", f"{_millimetres(low)} to {_millimetres(high)} mm")
    for note in plan.notes:
        print_line("note", note)
    for name, text in core.engine.describe(core, plan.rows):
        print_line(name, text)
    print_screen(plan)
    if core.sharpens:
        print_line("sharpening", _sharpening(plan))
    if core.normalises:
        takes = _takes(plan, "border")
        print_line("border", f"divided by the views that reach it, takes {takes}")
    print_line("engine", f"{core.engine.kind}: {plan.engine_reason}")
    for option in plan.engines:
        if option.refused and option.refused in plan.engine_reason:
            continue
        numbers = option.refused if option.needs is None else _amounts(option.needs)
        print_line("", f"{option.engine}: {numbers}")
    arithmetic = core.arithmetic.model_dump()
    widths = "".join(f", {name} {value}" for name, value in arithmetic.items() if name != "kind")
    bound = f"error at most {plan.error_bound:.3g} grey levels"
    print_line("arithmetic", f"{core.arithmetic.kind}{widths}; {bound}")
    print_line(
        "latency",
        f"{plan.latency_clocks} clocks ({plan.latency_lines} lines); "
        f"{plan.frame_clocks} clocks for each frame",
    )
    print_table(
        ("estimate", "this scene", "full build", "change", plan.device.upper()),
        [
            (name, *_beside(needed, plan.full[name]), str(plan.available[name]))
            for name, needed in plan.needs.items()
        ],
        left=("estimate",),
    )
    print_line("estimate", plan.error_class)
    if plan.video_needs is not None:
        video = {name: amount for name, amount in plan.video_needs.items() if amount}
        print_line("video", f"takes {_amounts(video)} of it")
    print_line("full build", plan.full_build)
    above = {name: n - plan.full[name] for name, n in plan.needs.items() if n > plan.full[name]}
    if above:
        print_line("", f"takes {_amounts(above)} less than this scene")
    print_placed(plan)
    for omission in plan.left_out:
        change = omission.change(plan.available)
        change_text = ": ".join(filter(None, (omission.what, change)))
        print_line("left out", "; ".join(filter(None, (change_text, omission.reason))))


@app.command()
def plan(
    scene: Scene,
    device: Part = None,
    as_json: options.AsJson = False,
    plot: options.PlotFile = None,
    csv_file: options.CsvFile = None,
) -> None:
    """Plan the smallest hardware for a scene: slices, resources, latency, what is left out."""
    from plenofir.plan import load_scene, make_plan

    planned = make_plan(load_scene(scene, device))
    check_plot_and_csv(plot, csv_file, scene)
    rows = [
        {
            "resource": name,
            "this_scene": needed,
            "full_build": planned.full[name],
            "device": planned.available[name],
        }
        for name, needed in planned.needs.items()
    ]
    write_plot_and_csv(plot, lambda: _drawn(planned), csv_file, rows)
    if as_json:
        from plenofir.plan.placements import placed_beside_full

        placement = placed_beside_full(planned)
        placed = None if placement is None else placement.model_dump()
        print_json({**planned.model_dump(mode="json"), "placed": placed})
    else:
        print_plan(planned)


def _drawn(planned: "Plan") -> "Figure":
    from plenofir.plan.plot import plot_plan

    return plot_plan(planned)


def _calibration_for(plan: "Plan", calib: str) -> "list[Load]":
    """Words of a calibration for a scene's resampler."""
    from plenofir.camera.calibration import load_calibration
    from plenofir.plan.sensor.board_load import BoardResampler, calibration_loads

    sensor, where = plan.sensor, options.typed("calib")
    if sensor is None or sensor.calibrated:
        problem = "has no sensor" if sensor is None else "has its calibration built in"
        raise InputError(f"the scene {plan.scene} {problem}: there is nothing to load", where=where)
    calibration = load_calibration(calib)
    if calibration.image_shape != (sensor.rows, sensor.columns):
        rows, columns = calibration.image_shape
        raise InputError(
            f"is for {columns} x {rows} pixels; the sensor has {sensor.columns} x {sensor.rows}",
            where=calib,
        )
    return calibration_loads(BoardResampler(sensor.core, sensor.shown), calibration, where=calib)


@app.command()
def configure(
    scene: Scene,
    out: options.OutFolder = "build/scene",
    verilog: Annotated[
        bool, typer.Option("--verilog", help="Write the core as Verilog too; needs GHDL.")
    ] = False,
    calib: Annotated[
        str | None,
        typer.Option(
            help="Calibration; writes the lines that load it over the board's serial port."
        ),
    ] = None,
    device: Part = None,
) -> None:
    """Write the VHDL package, the top level and the project files of a scene."""
    from plenofir.plan import load_scene, make_plan
    from plenofir.plan.configure import configure as write_project

    planned = make_plan(load_scene(scene, device))
    loaded = None if calib is None else (_calibration_for(planned, calib))
    sources = write_project(planned, Path(out), verilog=verilog, loads=loaded)
    print_line("scene", f"{planned.scene}, {len(sources)} VHDL files")
    names = ", ".join(sorted(path.name for path in Path(out).iterdir() if path.is_file()))
    print_line("files", f"{out}/: {names}")


@app.command()
def project(
    scene: Scene,
    tool: Annotated[
        str | None,
        typer.Option(
            help="Tool: vivado, quartus, radiant, diamond, gowin, ise, gatemate or trellis; ipxact "
            "writes components for a block design.",
            show_default="the tool of the device",
        ),
    ] = None,
    device: Part = None,
    top: Annotated[
        Literal["scene_top", "parallel_top"],
        typer.Option(
            help="Top level: the core alone, or the core behind a camera with a parallel output."
        ),
    ] = "scene_top",
    out: options.OutFolder = "build/project",
) -> None:
    """Write a scene's core as a project for a vendor's tool, or as components (IP-XACT)."""
    from plenofir.fpga.boards import board_of
    from plenofir.plan import load_scene, make_plan
    from plenofir.plan.ip.files import write_components
    from plenofir.plan.project_files import PARALLEL, pins_note, tool_of, write_project

    if tool == "ipxact" and top == PARALLEL:
        where = options.typed("top")
        raise InputError(f"{PARALLEL} is not a component; leave it out, or --tool", where=where)
    loaded = load_scene(scene, device)
    board = board_of(loaded.scene.build.device)
    whole = loaded.scene.build.path != "core" and board is not None and board.flow == "vivado"
    if not whole or tool not in (None, "vivado") or top == PARALLEL:
        loaded = load_scene(scene, device, core=True)
    planned = make_plan(loaded)
    if tool == "ipxact":
        title = "a catalog of components"
        files = write_components(planned, Path(out))
    else:
        name, tool_row = tool_of(planned, tool)
        title = tool_row.title
        files = write_project(planned, name, Path(out), parallel=top == PARALLEL)
    print_line("project", f"{planned.scene} on the {planned.device.upper()}, for {title}")
    print_line("files", f"{out}/: {', '.join(files)}")
    if tool != "ipxact" and top != PARALLEL and (text := pins_note(planned)):
        print_line("note", text)
    print_line("note", "never built by a vendor's tool; the README says what was checked")


@app.command()
def devices() -> None:
    """List the devices that plan, configure, synth and project take."""
    from plenofir.fpga.devices import DEVICES
    from plenofir.fpga.families import FAMILIES
    from plenofir.plan.project_files import TOOLS

    rows = []
    for device in DEVICES.values():
        tools = [name for name, tool in TOOLS.items() if device.family in tool.families]
        total = device.total
        amounts = (total.lut, total.flip_flops, total.ramb16, total.dsp)
        rows.append((device.name, FAMILIES[device.family].title, *map(str, amounts), *tools[:1]))
    heads = ("device", "family", "LUT", "flip-flops", "block RAM", "multipliers", "project")
    print_table(
        heads, [(*row, *[""] * (len(heads) - len(row))) for row in rows], left=heads[:2], width=90
    )


def _print_figures(rows: "list[tuple[str, Figures, str]]", device: "Device") -> None:
    heads = ("design", "LUT", "flip-flops", "RAMB16", "RAMB8", "DSP48A1", "carry", "path")
    total = device.total
    there = (total.lut, total.flip_flops, total.ramb16, f"or {2 * total.ramb16}", total.dsp)
    lines = [
        (name, *(str(value) for value in figures.model_dump().values()), state)
        for name, figures, state in rows
    ]
    # Numbers are not cut off, whatever the width of the terminal.
    print_table(
        (*heads, "recorded"),
        [*lines, (device.name.upper(), *map(str, there), "", "", "")],
        left=("design",),
        width=110,
    )


def _count(plan: "Plan") -> None:
    """Print what Yosys makes of a scene's core for its device, beside the estimate."""
    from plenofir.fpga.synthesis.counts import count
    from plenofir.plan.configure import configure as write_project
    from plenofir.plan.configure import top_of

    family = plan.chip.family
    with tempfile.TemporaryDirectory(prefix="plenofir-") as work, steps_bar("synthesis") as show:
        show(plan.scene, 0, 1)
        sources = write_project(plan, Path(work))
        counted = count(family, sources, top_of(plan), {}, Path(work)).usage
    print_table(
        (plan.scene, "estimate", "counted", "off", plan.device.upper()),
        [
            (name, *_beside(plan.needs[name], amount), str(plan.available[name]))
            for name, amount in counted.amounts(family).items()
        ],
        left=(plan.scene,),
    )


@app.command()
def synth(
    scene: Annotated[
        str | None,
        typer.Argument(
            help="Scene, a TOML file or the name of a shipped one; by default all shipped ones."
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(help="Folder for the netlist of the scene.", show_default="build/synth/SCENE"),
    ] = None,
    device: Part = None,
) -> None:
    """Synthesise a scene with GHDL and Yosys and print what it takes.

    For Spartan-6, "path" is the largest number of cells between two registers.
    """
    from plenofir.fpga.devices import DEFAULT_DEVICE, DEVICES
    from plenofir.fpga.resources.record import load_record
    from plenofir.fpga.tools.synthesis import ghdl_version, yosys_version
    from plenofir.ground.files import publish_files
    from plenofir.plan import load_scene, make_plan
    from plenofir.plan.configure import configure as write_project
    from plenofir.plan.designs import designs, is_nextpnr_board, scene_design

    options.require("out", "scene", out is not None and scene is None)
    options.require("device", "scene", device is not None and scene is None)
    folder = Path(out or f"build/synth/{Path(scene or '').stem}")
    ghdl, yosys = ghdl_version(), yosys_version()
    if scene:
        planned = make_plan(load_scene(scene, device))
        if planned.path == "core" and planned.chip.family != "spartan6":
            _count(planned)
            return
        if is_nextpnr_board(planned):
            raise InputError(
                f"{planned.scene} is for a board with an {planned.device.upper()}; make bitstream "
                "synthesises it",
                where=scene,
            )
        chosen = [scene_design(planned)]
    else:
        chosen = [design for design in designs() if not design.slow]
    recorded_figures = load_record().counted_with(ghdl, yosys)
    rows = []
    with steps_bar("synthesis") as show:
        for number, design in enumerate(chosen):
            show(design.name, number, len(chosen))
            with tempfile.TemporaryDirectory(prefix="plenofir-") as work:
                netlist = design.synthesise(Path(work))
                if design.plan is not None and scene:
                    publish_files(Path(work), folder)
                    # Written again, because the lists of sources are relative to their folder.
                    write_project(design.plan, folder)
            same = recorded_figures.get(design.name)
            state = "" if same is None else "same" if same == netlist.figures else "differs"
            rows.append((design.name, netlist.figures, state))
    typer.echo(f"GHDL {ghdl}, Yosys {yosys}")
    scene_device = chosen[0].plan.chip if scene and chosen[0].plan else DEVICES[DEFAULT_DEVICE]
    # A scene for another family is shown beside the board's device, and need not fit it.
    reference = scene_device if scene_device.family == "spartan6" else DEVICES[DEFAULT_DEVICE]
    _print_figures(rows, reference)
    if scene:
        top = chosen[0].top
        print_line("files", f"{folder}/: {top}.edif, {top}.netlist.v, yosys.log")
    if scene and reference == scene_device and (over := reference.overflow(rows[0][1].usage)):
        raise InputError(
            f"does not fit the {reference.title}: {'; '.join(over)}; take a larger device",
            where=scene,
        )
