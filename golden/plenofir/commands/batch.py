# SPDX-License-Identifier: Apache-2.0
"""The command ``batch``: many frames through Dask."""

from pathlib import Path
from typing import Annotated

import typer

from plenofir.commands import options
from plenofir.commands.console import progress_bar
from plenofir.commands.rasters import check_raster
from plenofir.ground.errors import InputError

app = typer.Typer()


def _check_first(frame: Path, micro_image: int) -> None:
    """Refuse frames that are no aligned raw images of M, as the first of them shows."""
    from plenofir.ground.images import read_picture

    try:
        first = read_picture(frame)
    except InputError:
        # One that cannot be read is a failed frame.
        return
    check_raster(first, micro_image, str(frame))


@app.command()
def batch(
    frames: Annotated[
        list[str], typer.Argument(help="Aligned raw images: names, or patterns in quotes.")
    ],
    micro_image: options.MicroImage,
    a: options.FocusSettings,
    out: options.OutFolder = "batch",
    scheduler: Annotated[
        str, typer.Option(help="local: processes on this machine; or tcp://HOST:PORT.")
    ] = "local",
    workers: Annotated[
        int | None,
        typer.Option(help="Number of local processes. Without it one for each processor.", min=1),
    ] = None,
    interpolation: options.Interpolation = "nearest",
    sharpen: options.Sharpen = "off",
    upsample: options.Upsample = True,
) -> None:
    """Refocus many frames; a run that was cut off goes on where it stopped."""
    from plenofir.refocus import interpolation_order
    from plenofir.refocus.batch import Settings, find_frames, run_batch

    chosen = options.focus_settings(a, micro_image)
    options.shifts_of(chosen, micro_image)
    order = interpolation_order(interpolation)
    settings = Settings(micro_image, chosen, order, upsample, sharpen)
    sources = find_frames(frames)
    _check_first(sources[0], micro_image)
    try:
        with progress_bar("refocusing") as show:
            done = run_batch(
                sources, settings, Path(out), scheduler=scheduler, workers=workers, progress=show
            )
    except KeyboardInterrupt:
        typer.echo("plenofir: stopped; the same command goes on from here", err=True)
        raise typer.Exit(130) from None
    failed = [frame for frame in done if frame.state == "failed"]
    for frame in failed:
        typer.echo(f"failed: {frame.reason}", err=True)
    kept = sum(frame.state == "kept" for frame in done)
    typer.echo(
        f"{out}: {len(done) - kept - len(failed)} frames refocused, {kept} there already, "
        f"{len(failed)} failed"
    )
    if failed:
        raise typer.Exit(1)
