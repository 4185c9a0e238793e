# SPDX-License-Identifier: Apache-2.0
"""Commands from a scene to hardware: plan, configure, verilog, project, synth."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from plenofir.commands import options
from plenofir.commands.console import print_json, print_line, print_table, steps_bar
from plenofir.commands.plan_lines import beside, print_boxes, print_plan
from plenofir.commands.results import check_plot_and_csv, write_plot_and_csv
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from plenofir.fpga.devices import Device
    from plenofir.fpga.resources.record import Figures
    from plenofir.plan.plan import Plan
    from plenofir.plan.sensor.resampler import Load

Scene = Annotated[str, typer.Argument(help="Scene, a TOML file or the name of a shipped one.")]
Part = Annotated[
    str | None,
    typer.Option(
        "--device", help="Device to use instead of the scene's, such as xc7a35t (plenofir devices)."
    ),
]

app = typer.Typer()


@app.command()
def plan(
    scene: Scene,
    device: Part = None,
    resolution: Annotated[
        float | None,
        typer.Option(
            help="Choose the box that leaves half contrast at so many cycles a micro lens, in "
            "place of the scene's."
        ),
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            help="Choose a box that leaves at most this share of the raw image's noise, in place "
            "of the scene's."
        ),
    ] = None,
    boxes: Annotated[
        bool,
        typer.Option(
            "--boxes", help="Compare all boxes that the slices can have: resolution, noise, cost."
        ),
    ] = False,
    as_json: options.AsJson = False,
    plot: options.PlotFile = None,
    csv_file: options.CsvFile = None,
) -> None:
    """Plan the smallest hardware for a scene: slices, resources, latency, what is left out."""
    from plenofir.plan import load_scene, make_plan
    from plenofir.plan.placements import placed_beside_full
    from plenofir.plan.planner import compared_boxes
    from plenofir.plan.scene_box import with_wishes

    loaded = load_scene(scene, device)
    if resolution is not None or noise is not None:
        loaded = with_wishes(loaded, resolution=resolution, noise=noise)
    planned = make_plan(loaded)
    check_plot_and_csv(plot, csv_file, scene)
    compared = compared_boxes(loaded, planned) if boxes else []
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
    placement = placed_beside_full(planned)
    if as_json:
        placed = None if placement is None else placement.model_dump()
        content = {**planned.model_dump(mode="json"), "placed": placed}
        if boxes:
            content["boxes"] = [
                {"box": box}
                | (
                    {"refused": plan.problem}
                    if isinstance(plan, InputError)
                    else plan.model_dump(mode="json", include={"slices", "needs"})
                )
                for box, plan in compared
            ]
        print_json(content)
    else:
        print_plan(planned, placement)
        if boxes:
            print_boxes(compared, planned)


def _drawn(planned: "Plan") -> "Figure":
    from plenofir.plan.plot import plot_plan

    return plot_plan(planned)


def _calibration_for(plan: "Plan", calib: str) -> "list[Load]":
    """Words of a calibration for a scene's resampler."""
    from plenofir.camera.calibration import load_calibration
    from plenofir.plan.sensor.board_load import BoardResampler, calibration_loads
    from plenofir.plan.sensor.chip import check_frame

    sensor, where = plan.sensor, options.typed("calib")
    if sensor is None or sensor.calibrated:
        problem = "has no sensor" if sensor is None else "has its calibration built in"
        raise InputError(f"the scene {plan.scene} {problem}: there is nothing to load", where=where)
    calibration = load_calibration(calib)
    check_frame(calibration, sensor.rows, sensor.columns, where=calib)
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
def verilog(
    scene: Annotated[
        list[str], typer.Argument(help="Scenes, TOML files or the names of shipped ones.")
    ],
    device: Part = None,
    out: options.OutFolder = "build/verilog",
) -> None:
    """Write one Verilog module whose parameters of sizes choose among scenes; needs GHDL."""
    from plenofir.plan import load_scene, make_plan
    from plenofir.plan.verilog_parameters import write_module

    plans = [make_plan(load_scene(each, device, core=True)) for each in scene]
    file = write_module(plans, Path(out))
    print_line("scenes", ", ".join(planned.scene for planned in plans))
    print_line("file", str(file))


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
    # Vivado builds a board of its own from the whole scene; other tools and tops get the core
    # alone.
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
        # The first tool is the one that gets a project unasked.
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
            (name, *beside(plan.needs[name], amount), str(plan.available[name]))
            for name, amount in counted.amounts(family).items()
        ],
        left=(plan.scene,),
    )


@app.command()
def synth(
    scene: Annotated[
        str | None,
        typer.Argument(
            help="Scene, a TOML file or the name of a shipped one; by default all shipped cores."
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
    from plenofir.plan.configure import top_of
    from plenofir.plan.synthesised import (
        core_name,
        core_plan,
        is_nextpnr_board,
        shipped_plans,
        synthesise_plan,
        takes_a_minute,
    )

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
        chosen = {planned.scene: planned}
    else:
        cores = {core_name(plan): core_plan(plan) for plan in shipped_plans()}
        # Cores that take a minute each are synthesised where a scene names them.
        chosen = {name: plan for name, plan in cores.items() if not takes_a_minute(plan)}
    # Other versions count otherwise: only what these counted is compared.
    recorded_figures = load_record().counted_with(ghdl, yosys)
    rows = []
    with steps_bar("synthesis") as show:
        for number, (name, plan) in enumerate(chosen.items()):
            show(name, number, len(chosen))
            with tempfile.TemporaryDirectory(prefix="plenofir-") as work:
                netlist = synthesise_plan(plan, Path(work))
                if scene:
                    publish_files(Path(work), folder)
                    # Written again, because the lists of sources are relative to their folder.
                    write_project(plan, folder)
            same = recorded_figures.get(name)
            state = "" if same is None else "same" if same == netlist.figures else "differs"
            rows.append((name, netlist.figures, state))
    typer.echo(f"GHDL {ghdl}, Yosys {yosys}")
    scene_device = planned.chip if scene else DEVICES[DEFAULT_DEVICE]
    # A scene for another family is shown beside the board's device, and need not fit it.
    reference = scene_device if scene_device.family == "spartan6" else DEVICES[DEFAULT_DEVICE]
    _print_figures(rows, reference)
    if scene:
        top = top_of(planned)
        print_line("files", f"{folder}/: {top}.edif, {top}.netlist.v, yosys.log")
    if scene and reference == scene_device and (over := reference.overflow(rows[0][1].usage)):
        raise InputError(
            f"does not fit the {reference.title}: {'; '.join(over)}; take a larger device",
            where=scene,
        )
