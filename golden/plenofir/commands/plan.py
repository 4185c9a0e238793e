"""Commands from a scene to hardware: plan, configure, synth."""

import json
import tempfile
from math import inf
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from plenofir.errors import InputError
from plenofir.files import publish_files
from plenofir.fpga.devices import DEVICES, Device
from plenofir.fpga.synthesis.estimate import slice_engine
from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir.fpga.synthesis.tools import ghdl_version, yosys_version
from plenofir.plan.configure import configure as write_project
from plenofir.plan.figures import designs, load_figures, scene_design
from plenofir.plan.planner import Plan, make_plan
from plenofir.plan.scene import load_scene

SceneArgument = Annotated[str, typer.Argument(help="Scene profile: a TOML file.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
OutOption = Annotated[str, typer.Option("--out", help="Folder for the results.")]


def _millimetres(value: float | None) -> str:
    return "inf" if value is None or value == inf else f"{value:.1f}"


def _amounts(amounts: dict[str, int]) -> str:
    return ", ".join(f"{amount} {name}" for name, amount in amounts.items())


def print_plan(plan: Plan) -> None:
    """Print a plan for a person.

    Parameters
    ----------
    plan
        What to print.
    """
    core = plan.core
    frame = f"{plan.columns} x {plan.rows}, {core.channels} x {core.pixel_bits} bit"
    least = "" if plan.path == "video" else "at least "
    clock = "still" if plan.clock_mhz is None else f"pixel clock {least}{plan.clock_mhz:g} MHz"
    typer.echo(f"{'scene':<11} {plan.scene}: {frame}, M = {core.micro_image_size}, {clock}")
    if plan.blanking is not None:
        typer.echo(
            f"{'video':<11} in and out on the board, blanking of {plan.blanking[0]} pixels and "
            f"{plan.blanking[1]} lines"
        )
    for part in plan.slices:
        depth = (
            ""
            if part.near_mm is None
            else f", sharp from {_millimetres(part.near_mm)} to {_millimetres(part.far_mm)} mm"
        )
        typer.echo(f"{'slice':<11} a = {part.a} (a' = {part.shift}){depth}")
    for low, high in plan.gaps_mm:
        typer.echo(f"{'not covered':<11} {_millimetres(low)} to {_millimetres(high)} mm")
    for name, text in slice_engine(core).describe(core, plan.rows):
        typer.echo(f"{name:<11} {text}")
    typer.echo(f"{'engine':<11} {core.engine.kind}: {plan.engine_reason}")
    for option in plan.engines:
        numbers = option.refused if option.needs is None else _amounts(option.needs)
        typer.echo(f"{'':<11} {option.engine}: {numbers}")
    arithmetic = core.arithmetic.model_dump()
    widths = "".join(f", {name} {value}" for name, value in arithmetic.items() if name != "kind")
    bound = f"error at most {plan.error_bound:.3g} grey levels"
    typer.echo(f"{'arithmetic':<11} {core.arithmetic.kind}{widths}; {bound}")
    typer.echo(
        f"{'latency':<11} {plan.latency_clocks} clocks ({plan.latency_lines} lines); "
        f"{plan.frame_clocks} clocks for each frame"
    )
    table = Table()
    for column in ("estimate", "this scene", "full build", plan.device.upper()):
        table.add_column(column, justify="left" if column == "estimate" else "right")
    for name, needed in plan.needs.items():
        table.add_row(name, str(needed), str(plan.full[name]), str(plan.available[name]))
    Console().print(table)
    if plan.video_needs is not None:
        video = {name: amount for name, amount in plan.video_needs.items() if amount}
        typer.echo(f"{'video':<11} takes {_amounts(video)} of it")
    typer.echo(f"{'full build':<11} {plan.full_build}")
    for part_left_out in plan.left_out:
        saves = _amounts(part_left_out.saves)
        typer.echo(f"{'left out':<11} {part_left_out.what}{f': saves {saves}' if saves else ''}")


def plan(scene: SceneArgument, as_json: JsonOption = False) -> None:
    """The smallest hardware for a scene: slices, resources, latency, what is left out."""
    planned = make_plan(load_scene(scene))
    if as_json:
        typer.echo(json.dumps(planned.model_dump(mode="json"), indent=2, allow_nan=False))
        return
    print_plan(planned)


def configure(scene: SceneArgument, out: OutOption = "build/scene") -> None:
    """Write the VHDL package, the top level and the project files of a scene."""
    planned = make_plan(load_scene(scene))
    sources = write_project(planned, Path(out))
    typer.echo(f"{'scene':<11} {planned.scene}, {len(sources)} VHDL files")
    names = ", ".join(sorted(path.name for path in Path(out).iterdir() if path.is_file()))
    typer.echo(f"{'files':<11} {out}/: {names}")


def _print_figures(rows: list[tuple[str, Figures, str]], device: Device) -> None:
    table = Table()
    heads = ("design", "LUT", "flip-flops", "RAMB16", "RAMB8", "DSP48A1", "carry", "path")
    for head in (*heads, "recorded"):
        table.add_column(head, justify="left" if head == "design" else "right")
    for name, figures, state in rows:
        table.add_row(name, *(str(value) for value in figures.model_dump().values()), state)
    total = device.total
    table.add_row(
        device.name.upper(),
        str(total.lut),
        str(total.flip_flops),
        str(total.ramb16),
        f"or {2 * total.ramb16}",
        str(total.dsp),
        "",
        "",
        "",
    )
    # Numbers are not to be cut off, whatever the width of the terminal.
    Console(width=max(Console().width, 110)).print(table)


def synth(
    scene: Annotated[str, typer.Argument(help="Scene profile; all that is shipped if none.")] = "",
    out: OutOption = "",
) -> None:
    """Synthesise for Spartan-6 with GHDL and Yosys; "path" counts cells between registers."""
    ghdl, yosys = ghdl_version(), yosys_version()
    if scene:
        planned = make_plan(load_scene(scene))
        chosen = [scene_design(planned)]
    else:
        chosen = [design for design in designs() if not design.slow]
    recorded = load_figures()
    known = recorded.figures.get(ghdl, {}) if recorded.yosys == yosys else {}
    rows = []
    with Progress(TextColumn("{task.description:<40}"), BarColumn(), transient=True) as bars:
        task = bars.add_task("", total=len(chosen))
        for number, design in enumerate(chosen):
            bars.update(task, description=design.name, completed=number)
            with tempfile.TemporaryDirectory(prefix="plenofir-") as folder:
                netlist = design.synthesise(Path(folder))
                if out and design.plan is not None:
                    publish_files(Path(folder), Path(out))
                    # Once more, because the lists of sources are relative to their folder.
                    write_project(design.plan, Path(out))
            same = known.get(design.name)
            state = "" if same is None else "same" if same == netlist.figures else "differs"
            rows.append((design.name, netlist.figures, state))
    typer.echo(f"GHDL {ghdl}, Yosys {yosys}")
    device = DEVICES[chosen[0].plan.device if scene and chosen[0].plan else "xc6slx45"]
    _print_figures(rows, device)
    if out:
        top = chosen[0].top
        typer.echo(f"{'files':<11} {out}/: {top}.edif, {top}.netlist.v, yosys.log")
    over = device.overflow(rows[0][1].usage) if scene else []
    if over:
        raise InputError(
            f"does not fit the {device.name.upper()}: {'; '.join(over)}",
            where=scene,
            expected="a smaller scene or a larger device",
        )


def register(app: typer.Typer) -> None:
    """Add the commands.

    Parameters
    ----------
    app
        The command line.
    """
    for command in (plan, configure, synth):
        app.command()(command)
