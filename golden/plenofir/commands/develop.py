# SPDX-License-Identifier: Apache-2.0
"""The command develop: from a capture to all pictures that it holds, and a page that shows them."""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import file_options
from plenofir.commands.capture import Dark
from plenofir.commands.console import steps_bar
from plenofir.commands.groups import CameraData, LookOptions, Pupil
from plenofir.commands.rasters import warn_of_camera
from plenofir.ground.files import check_folder

if TYPE_CHECKING:
    from plenofir.camera.recognise import Hints

app = typer.Typer()


@app.command()
@file_options.takes_light_fields
def develop(
    capture: Annotated[
        str,
        typer.Argument(
            help="Raw capture with --white or --calib, Lytro file, folder or video of views, or "
            "aligned raw image."
        ),
    ],
    hints: "Hints",
    *,
    white: Annotated[
        Path | None, typer.Option(help="White image of the camera, from which it is calibrated.")
    ] = None,
    calib: Annotated[
        str | None, typer.Option(help="Calibration file (plenofir calibrate) instead of --white.")
    ] = None,
    dark: Dark = None,
    camera: CameraData,
    out: Annotated[str, typer.Option(help="Folder for pictures and page.")] = "developed",
    slices: Annotated[
        int,
        typer.Option(help="Refocused pictures over the range of depths, at most.", min=1, max=99),
    ] = 9,
    pupil: Pupil,
    look: LookOptions,
) -> None:
    """Make all pictures of a capture: refocused, all in focus, depth, animations, and a page.

    Data are kept beside them: aligned.png is linear, disparity.npy are numbers. What an earlier run
    left in the folder is reused where nothing that it was made from has changed.
    """
    from plenofir.commands.development import Job, develop_capture, summary_there

    start, folder = perf_counter(), Path(out)
    hints = hints._replace(white=white, calib=calib, dark=dark)
    hints.check()
    check_folder(folder, out)
    camera.check()
    job = Job(
        hints,
        camera.camera,
        camera.focus,
        slices,
        look.exposure,
        look.gamma,
        **pupil.how(),
    )
    there = summary_there(Path(capture), job, folder)
    if there is not None:
        for line in there:
            typer.echo(line)
        typer.echo(
            f"{out}: there already, from the same files and options; remove it to begin anew"
        )
        return
    with steps_bar("reading") as show:
        developed = develop_capture(Path(capture), job, folder, show)
    for line in developed.lines:
        typer.echo(line)
    typer.echo(
        f"{out}: {developed.pictures} pictures in {perf_counter() - start:.0f} s; open "
        f"{folder / 'index.html'}"
    )
    if developed.reused:
        typer.echo(f"unchanged since the run before: {', '.join(developed.reused)}")
    warn_of_camera(developed.model)
