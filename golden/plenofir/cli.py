"""The command ``plenofir``."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from plenofir import __version__, cli_batch, cli_lightfield, cli_rays, cli_waves
from plenofir.cli_lightfield import progress_bar
from plenofir.cli_rays import integer
from plenofir.errors import EXIT_BAD_INPUT, EXIT_MISMATCH, EXIT_TOOL_FAILED, InputError
from plenofir.refocus import interpolation_order
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir.simulation.job import (
    FLOWER,
    FLOWER_FOCUS,
    FLOWER_MICRO_IMAGE_SIZE,
    SimulationJob,
    report_summary,
    run_job,
)
from plenofir.simulation.simulators import SimulationError

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


def _arithmetic(name: str, fraction_bits: str, guard_bits: str) -> Arithmetic:
    if name == "exact":
        if fraction_bits or guard_bits:
            raise InputError(
                "exact arithmetic has no fraction or guard bits",
                where="ARITH",
                expected="ARITH=stored with FRACTION or GUARD",
            )
        return ExactArithmetic()
    if name != "stored":
        raise InputError(f"{name!r} is no arithmetic", where="ARITH", expected="exact or stored")
    bits = {}
    if fraction_bits:
        bits["fraction_bits"] = integer(fraction_bits, "FRACTION")
    if guard_bits:
        bits["guard_bits"] = integer(guard_bits, "GUARD")
    try:
        return StoredProductArithmetic.model_validate(bits)
    except ValidationError as error:
        first = error.errors()[0]
        field = str(first["loc"][0]) if first["loc"] else "guard_bits"
        raise InputError(
            first["msg"],
            where={"fraction_bits": "FRACTION", "guard_bits": "GUARD"}[field],
            expected="0 <= GUARD <= FRACTION <= 12",
        ) from None


@app.command()
def sim(
    raw: Annotated[str, typer.Option(help="Raw image: 8 or 16 bit, grey or RGB.")] = str(FLOWER),
    micro_image: Annotated[
        str, typer.Option("--micro-image", "-M", help="M: micro image size in pixels.")
    ] = str(FLOWER_MICRO_IMAGE_SIZE),
    a: Annotated[
        str, typer.Option("--a", "-a", help="Focus setting: a fraction, denominator M.")
    ] = FLOWER_FOCUS,
    sweep: Annotated[
        str, typer.Option(help="Several focus settings, a frame each; instead of --a.")
    ] = "",
    iota: Annotated[str, typer.Option(help="Rows that are filtered at once.")] = "1",
    interpolation: Annotated[
        str, typer.Option(help="nearest, linear, or the order of a B-spline, 0 to 3.")
    ] = "nearest",
    out: Annotated[str, typer.Option(help="Folder for the results.")] = "build/sim",
    arith: Annotated[str, typer.Option(help="exact, or stored (stored products).")] = "exact",
    fraction: Annotated[
        str, typer.Option(help="Stored products: fraction bits, 8 if not given.")
    ] = "",
    guard: Annotated[str, typer.Option(help="Stored products: guard bits, 2 if not given.")] = "",
    simulator: Annotated[str, typer.Option(help="ghdl or nvc.")] = "ghdl",
    waves: Annotated[str, typer.Option(help="1: write a waveform and a GTKWave save file.")] = "0",
) -> None:
    """Refocus a raw image in the VHDL core and compare it with the golden model."""
    if waves not in ("", "0", "1"):
        raise InputError(f"{waves!r}", where="WAVES", expected="0 or 1")
    rows = integer(iota, "IOTA")
    if rows < 1:
        raise InputError(f"{rows} rows at once", where="IOTA", expected="an integer, 1 or more")
    job = SimulationJob(
        raw=Path(raw),
        micro_image_size=integer(micro_image, "M"),
        focus=tuple(sweep.replace(",", " ").split()) or (a,),
        interpolation=interpolation_order(interpolation, where="INTERPOLATION"),
        parallel_rows=rows,
        out=Path(out),
        arithmetic=_arithmetic(arith, fraction, guard),
        simulator=simulator,
        waves=waves == "1",
    )
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
        report = run_job(job, show)
    finally:
        if tasks:
            bars.stop()
    for name, value in report_summary(report):
        typer.echo(f"{name:<11} {value}")
    files = [name for slice_ in report.slices for name in slice_.pictures]
    typer.echo(f"{'files':<11} {job.out}/{', '.join(files)}, report.json")
    if report.mismatches:
        raise typer.Exit(EXIT_MISMATCH)


cli_rays.register(app)
cli_waves.register(app)
report = typer.Typer(no_args_is_help=True, help="Write reports.")
app.add_typer(report, name="report")
cli_lightfield.register(app, report)
cli_batch.register(app)


@report.command("rays")
def report_rays(
    out: Annotated[str, typer.Option(help="Folder for the report.")] = "build/report-rays",
) -> None:
    """Validation and numerical stability of the ray model: Markdown with figures."""
    from plenofir.rays.report import write_report

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
    from plenofir.precision.report import write_report

    with progress_bar("measuring") as show:
        path = write_report(Path(out), show)
    typer.echo(f"report: {path}")


@report.command("stability")
def report_stability(
    out: Annotated[str, typer.Option(help="Folder for the report.")] = "build/report-stability",
) -> None:
    """Extreme inputs, and how errors of floating point grow: Markdown with figures."""
    from plenofir.precision.stability import write_report

    with progress_bar("measuring") as show:
        path = write_report(Path(out), show)
    typer.echo(f"report: {path}")


def main() -> None:
    """Run the command line; user errors become one line on standard error."""
    try:
        app()
    except InputError as error:
        typer.echo(f"plenofir: {error}", err=True)
        sys.exit(EXIT_BAD_INPUT)
    except SimulationError as error:
        typer.echo(f"plenofir: simulation failed: {error}", err=True)
        sys.exit(EXIT_TOOL_FAILED)
    except KeyboardInterrupt:
        sys.exit(130)
