"""The command ``plenofir``."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, cast, get_args

import typer
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from plenofir import __version__, project
from plenofir.commands import batch as cli_batch
from plenofir.commands import bitstream as cli_bitstream
from plenofir.commands import lightfield as cli_lightfield
from plenofir.commands import plan as cli_plan
from plenofir.commands import rays as cli_rays
from plenofir.commands import waves as cli_waves
from plenofir.commands.lightfield import progress_bar
from plenofir.commands.options import VARIABLES, arithmetic_options
from plenofir.commands.rays import integer
from plenofir.errors import EXIT_BAD_INPUT, EXIT_MISMATCH, EXIT_TOOL_FAILED, InputError, ToolError
from plenofir.fpga.core.configuration import SLICE_ENGINES
from plenofir.fpga.core.fir import FirEngine
from plenofir.fpga.core.moving_sum import MovingSumEngine
from plenofir.fpga.simulate.job import (
    FLOWER,
    FLOWER_FOCUS,
    FLOWER_MICRO_IMAGE_SIZE,
    Chain,
    SimulationJob,
    report_summary,
    run_job,
    scene_image,
    scene_job,
)
from plenofir.fpga.simulate.job import Progress as JobProgress
from plenofir.fpga.simulate.simulators import SimulationError
from plenofir.fpga.simulate.stack_job import StackJob, run_stack_job
from plenofir.images import write_png
from plenofir.refocus import interpolation_order

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Real-time refocusing for standard plenoptic cameras.",
)


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        typer.echo(__version__)
        raise typer.Exit


def _scene_job(path: str, job: SimulationJob, *, own_image: bool) -> SimulationJob:
    """Job of a scene; without an image of one's own, on the flower made to measure."""
    from plenofir.plan import load_scene, make_plan

    plan = make_plan(load_scene(path))
    if not own_image:
        image = project.root() / "build" / "scenes" / f"{plan.scene}.png"
        image.parent.mkdir(parents=True, exist_ok=True)
        write_png(image, scene_image(plan.core, plan.rows))
        job = job.model_copy(update={"raw": image})
    return scene_job(plan.core, job)


def _engine(name: str, parallel_rows: int, *, any_rows: bool) -> FirEngine | MovingSumEngine:
    """The engine of a name, without fields that it does not have."""
    if name == "fir":
        if any_rows:
            raise InputError("any rows", where="ANY_ROWS", expected="0 without ENGINE=moving_sum")
        return FirEngine(parallel_rows=parallel_rows)
    if parallel_rows > 1:
        what = f"{parallel_rows} rows at once"
        raise InputError(what, where="IOTA", expected="1 with ENGINE=moving_sum")
    return MovingSumEngine(any_rows=any_rows)


@contextmanager
def _steps() -> Iterator[JobProgress]:
    """Progress bars on standard output, one for each step of a job."""
    bars = Progress(
        TextColumn("{task.description:<20}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    tasks: dict[str, TaskID] = {}

    def show(step: str, done: int, total: int) -> None:
        bars.start()
        if step not in tasks:
            tasks[step] = bars.add_task(step, total=total)
        bars.update(tasks[step], completed=done)

    try:
        yield show
    finally:
        if tasks:
            bars.stop()


def _check_stack_options(unset: Mapping[str, str], settled: Mapping[str, tuple[str, str]]) -> None:
    """Refuse options that a stack has not, or has one value of."""
    for name, value in unset.items():
        if value:
            raise InputError(f"{name} with STACK", where=name, expected="one of them")
    for name, (value, only) in settled.items():
        if value != only:
            raise InputError(value, where=name, expected=f"{only} with STACK")


def _run_stack(job: StackJob) -> None:
    """Simulate a focal stack and tell what came out."""
    with _steps() as show:
        report = run_stack_job(job, show)
    size = f"{report.columns} x {report.rows} pixels, {report.channels} channels"
    typer.echo(f"image       {report.raw}, {size}, M = {report.M}")
    for a, count in zip(report.a, report.micro_images_of_slice, strict=True):
        typer.echo(f"{'a = ' + a:<11} sharpest in {count} micro images")
    typer.echo(f"mismatches  {report.mismatches} of {report.pixels_compared} pixels")
    typer.echo(f"clocks      {report.clocks}, {report.clocks_per_pixel} each pixel")
    parts = {
        "shared": report.history_bits,
        "of the slices": report.slice_bits,
        "waiting": report.waiting_bits,
        "judged": report.sharpness_bits,
    }
    kbit = ", ".join(f"{bits / 1024:.0f} {name}" for name, bits in parts.items())
    typer.echo(f"memory      kbit: {kbit}")
    typer.echo(f"files       {job.out}/{', '.join(report.pictures)}, report.json")
    if report.mismatches:
        raise typer.Exit(EXIT_MISMATCH)


@app.command()
def sim(
    raw: Annotated[
        str, typer.Option(help="Raw image: 8 or 16 bit, grey or RGB; the flower if not given.")
    ] = "",
    scene: Annotated[str, typer.Option(help="Scene profile; instead of what it settles.")] = "",
    micro_image: Annotated[
        str, typer.Option("--micro-image", "-M", help="M: micro image size in pixels.")
    ] = str(FLOWER_MICRO_IMAGE_SIZE),
    a: Annotated[
        str, typer.Option("--a", "-a", help="Focus setting: a fraction, denominator M.")
    ] = FLOWER_FOCUS,
    sweep: Annotated[
        str, typer.Option(help="Several focus settings, a frame each; instead of --a.")
    ] = "",
    stack: Annotated[
        str,
        typer.Option(help="Focus settings of a focal stack in one pass, with its depth index."),
    ] = "",
    window: Annotated[
        str, typer.Option(help="--stack: micro images around each that sharpness is judged in.")
    ] = "1",
    iota: Annotated[str, typer.Option(help="Rows that are filtered at once.")] = "1",
    engine: Annotated[
        str, typer.Option(help="fir or moving_sum; fir if not given, moving_sum with --stack.")
    ] = "",
    any_rows: Annotated[
        str, typer.Option(help="1: moving sums take frames of any number of rows without a pause.")
    ] = "0",
    interpolation: Annotated[
        str, typer.Option(help="nearest, linear, or the order of a B-spline, 0 to 3.")
    ] = "nearest",
    out: Annotated[str, typer.Option(help="Folder for the results.")] = "build/sim",
    arith: Annotated[str, typer.Option(help="exact, or stored (stored products).")] = "exact",
    fraction: Annotated[
        str, typer.Option(help="Stored products: fraction bits, 8 if not given.")
    ] = "",
    guard: Annotated[str, typer.Option(help="Stored products: guard bits, 2 if not given.")] = "",
    simulator: Annotated[str, typer.Option(help="ghdl, nvc or verilator.")] = "ghdl",
    chain: Annotated[
        str, typer.Option(help="core, or hdmi: the whole board, from serial bits to serial bits.")
    ] = "core",
    waves: Annotated[str, typer.Option(help="1: write a waveform and a GTKWave save file.")] = "0",
) -> None:
    """Refocus a raw image in the VHDL core and compare it with the golden model."""
    if waves not in ("", "0", "1"):
        raise InputError(f"{waves!r}", where="WAVES", expected="0 or 1")
    if any_rows not in ("", "0", "1"):
        raise InputError(f"{any_rows!r}", where="ANY_ROWS", expected="0 or 1")
    if chain not in get_args(Chain):
        raise InputError(f"{chain!r}", where="CHAIN", expected="core or hdmi")
    engine = engine or ("moving_sum" if stack else "fir")
    if engine not in SLICE_ENGINES:
        raise InputError(f"{engine!r}", where="ENGINE", expected="fir or moving_sum")
    rows = integer(iota, "IOTA")
    if rows < 1:
        raise InputError(f"{rows} rows at once", where="IOTA", expected="an integer, 1 or more")
    if stack:
        _check_stack_options(
            {"SCENE": scene, "SWEEP": sweep, "FRACTION": fraction, "GUARD": guard},
            {
                "ENGINE": (engine, "moving_sum"),
                "IOTA": (iota, "1"),
                "INTERPOLATION": (interpolation, "nearest"),
                "ARITH": (arith, "exact"),
                "CHAIN": (chain, "core"),
                "WAVES": (waves or "0", "0"),
                "ANY_ROWS": (any_rows or "0", "0"),
            },
        )
        _run_stack(
            StackJob(
                raw=Path(raw) if raw else FLOWER,
                micro_image_size=integer(micro_image, "M"),
                focus=tuple(stack.replace(",", " ").split()),
                radius=integer(window, "WINDOW"),
                out=Path(out),
                simulator=simulator,
            )
        )
        return
    job = SimulationJob(
        raw=Path(raw) if raw else FLOWER,
        micro_image_size=integer(micro_image, "M"),
        focus=tuple(sweep.replace(",", " ").split()) or (a,),
        interpolation=interpolation_order(interpolation, where="INTERPOLATION"),
        engine=_engine(engine, rows, any_rows=any_rows == "1"),
        out=Path(out),
        arithmetic=arithmetic_options(arith, fraction, guard),
        simulator=simulator,
        waves=waves == "1",
        chain=cast(Chain, chain),
    )
    if scene:
        job = _scene_job(scene, job, own_image=bool(raw))
    with _steps() as show:
        report = run_job(job, show)
    for name, value in report_summary(report):
        typer.echo(f"{name:<11} {value}")
    files = [name for slice_ in report.slices for name in slice_.pictures]
    typer.echo(f"{'files':<11} {job.out}/{', '.join(files)}, report.json")
    if report.mismatches:
        raise typer.Exit(EXIT_MISMATCH)


cli_bitstream.register(app)
cli_rays.register(app)
cli_waves.register(app)
cli_plan.register(app)
report = typer.Typer(no_args_is_help=True, help="Write reports.")
app.add_typer(report, name="report")
cli_lightfield.register(app, report)
cli_batch.register(app)


@report.command("rays")
def report_rays(
    out: Annotated[str, typer.Option(help="Folder for the report.")] = "build/report-rays",
) -> None:
    """Validation and numerical stability of the ray model: Markdown with figures."""
    from plenofir.studies.ray_report import write_report

    with Progress(TextColumn("{task.description:<30}"), BarColumn(), transient=True) as bars:
        task = bars.add_task("report", total=None)

        def show(step: str, done: int, total: int) -> None:
            bars.update(task, description=step, completed=done, total=total)

        path = write_report(Path(out), show)
    typer.echo(f"report: {path}")


@report.command("precision")
def report_precision(
    out: Annotated[str, typer.Option(help="Folder for the report.")] = "build/report-precision",
) -> None:
    """Error against run time of every way to refocus: Markdown with figures."""
    from plenofir.studies.precision_report import write_report

    with progress_bar("measuring") as show:
        path = write_report(Path(out), show)
    typer.echo(f"report: {path}")


@report.command("stability")
def report_stability(
    out: Annotated[str, typer.Option(help="Folder for the report.")] = "build/report-stability",
) -> None:
    """Extreme inputs, and how errors of floating point grow: Markdown with figures."""
    from plenofir.studies.refocus_stability import write_report

    with progress_bar("measuring") as show:
        path = write_report(Path(out), show)
    typer.echo(f"report: {path}")


def main() -> None:
    """Run the command line; user errors become one line on standard error."""
    try:
        app()
    except InputError as error:
        where = VARIABLES.get(error.where, error.where)
        typer.echo(f"plenofir: {where}: {error.what}; expected {error.expected}", err=True)
        sys.exit(EXIT_BAD_INPUT)
    except SimulationError as error:
        typer.echo(f"plenofir: simulation failed: {error}", err=True)
        sys.exit(EXIT_TOOL_FAILED)
    except ToolError as error:
        typer.echo(f"plenofir: {error}", err=True)
        sys.exit(EXIT_TOOL_FAILED)
    except KeyboardInterrupt:
        sys.exit(130)
