# SPDX-License-Identifier: Apache-2.0
"""Commands that write reports of studies."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from plenofir.commands.console import progress_bar, steps_bar
from plenofir.commands.options import OutFolder

app = typer.Typer(no_args_is_help=True, help="Write reports.")


def _write(writer: Callable[..., Path], out: str) -> None:
    with progress_bar("measuring") as show:
        path = writer(Path(out), show)
    typer.echo(f"report: {path}")


@app.command()
def rays(out: OutFolder = "build/report-rays") -> None:
    """Validation and numerical stability of the ray model: Markdown with figures."""
    from plenofir.studies.ray_report import write_report

    with steps_bar("report") as show:
        path = write_report(Path(out), show)
    typer.echo(f"report: {path}")


@app.command()
def precision(out: OutFolder = "build/report-precision") -> None:
    """Error against run time of every way to refocus: Markdown with figures."""
    from plenofir.studies.precision_report import write_report

    _write(write_report, out)


@app.command()
def sharpening(out: OutFolder = "build/report-sharpening") -> None:
    """Weights of sharpening, nearness to the object, noise and harm: Markdown with pictures."""
    from plenofir.studies.sharpening_report import write_report

    _write(write_report, out)


@app.command()
def stability(out: OutFolder = "build/report-stability") -> None:
    """Extreme inputs, and how errors of floating point grow: Markdown with figures."""
    from plenofir.studies.refocus_stability import write_report

    _write(write_report, out)


@app.command()
def numbers(out: OutFolder = "build/report-numbers") -> None:
    """Noise, resolution, rounded centres, ways to depth: Markdown with figures."""
    from plenofir.studies.numbers_report import write_report

    _write(write_report, out)


@app.command()
def energy(out: OutFolder = "build/report-energy") -> None:
    """Energy of a frame, estimated from what switches in netlists: Markdown; takes minutes."""
    from plenofir.studies.energy import write_report

    _write(write_report, out)


@app.command()
def resampling(out: OutFolder = "build/report-resampling") -> None:
    """The chip's resampler beside decode, over bits, pitch, rotation: Markdown."""
    from plenofir.studies.resampling_report import write_report

    _write(write_report, out)


@app.command()
def calibration(
    out: OutFolder = "build/report-calibration",
    spots: Annotated[
        Path | None,
        typer.Option(help="Folder of other spot images NAME.png with centres NAME.txt (y x)."),
    ] = None,
) -> None:
    """Accuracy and time of the calibration, and section 5.3's experiments: Markdown, figures."""
    from plenofir.studies.calibration_report import write_report

    _write(lambda folder, show: write_report(folder, spots, show), out)
