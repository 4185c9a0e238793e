"""The command ``batch``: many frames through Dask."""

from pathlib import Path
from typing import Annotated

import typer

from plenofir.commands.lightfield import progress_bar
from plenofir.commands.rays import integer
from plenofir.errors import InputError
from plenofir.files import check_folder
from plenofir.refocus import focus_to_shift, interpolation_order, parse_focus


def batch(
    frames: Annotated[str, typer.Argument(help="Pattern of aligned raw images, in quotes.")],
    micro_image: Annotated[
        str, typer.Option("--micro-image", "-M", help="M: micro image size in pixels.")
    ],
    a: Annotated[
        str, typer.Option("--a", "-a", help="Focus setting, or several separated by spaces.")
    ],
    out: Annotated[str, typer.Option(help="Folder for the results.")] = "batch",
    scheduler: Annotated[
        str, typer.Option(help="local: processes on this machine; or tcp://HOST:PORT.")
    ] = "local",
    workers: Annotated[
        str, typer.Option(help="Local processes; as many as processors if not given.")
    ] = "",
    interpolation: Annotated[
        str, typer.Option(help="nearest, linear, or the order of a B-spline, 0 to 3.")
    ] = "nearest",
    upsample: Annotated[
        bool,
        typer.Option(
            "--upsample/--no-upsample", help="The raw image's size, or a pixel for each micro lens."
        ),
    ] = True,
) -> None:
    """Refocus many frames; a run that was cut off goes on where it stopped."""
    from plenofir.refocus.batch import Settings, find_frames, run_batch

    m = integer(micro_image, "--micro-image")
    if m < 1:
        raise InputError(f"M = {m}", where="--micro-image", expected="an integer, 1 or more")
    chosen = tuple(parse_focus(text, where="--a") for text in a.replace(",", " ").split())
    if not chosen or len(set(chosen)) < len(chosen):
        raise InputError(repr(a), where="--a", expected="one or more settings, each a once")
    for setting in chosen:
        focus_to_shift(setting, m, where="--a")
    count = integer(workers, "--workers") if workers else None
    if count is not None and count < 1:
        raise InputError(workers, where="--workers", expected="1 or more")
    settings = Settings(m, chosen, interpolation_order(interpolation), upsample)
    sources = find_frames(frames)
    check_folder(Path(out), out)
    with progress_bar("refocusing") as show:
        done = run_batch(
            sources, settings, Path(out), scheduler=scheduler, workers=count, progress=show
        )
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


def register(app: typer.Typer) -> None:
    """Add the command.

    Parameters
    ----------
    app
        The command line.
    """
    app.command()(batch)
