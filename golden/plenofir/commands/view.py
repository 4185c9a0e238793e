"""The command ``view``: a light field, or the pictures of a simulation, in the browser."""

import threading
import webbrowser
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import options
from plenofir.commands.console import progress_bar
from plenofir.commands.results import check_file
from plenofir.errors import InputError
from plenofir.files import write_file

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.view import Page

app = typer.Typer()


@app.command()
def view(
    raster: Annotated[
        str,
        typer.Argument(
            help="Aligned raw image: micro images of exactly M x M pixels; or a folder that "
            "make sim has left, whose pictures are shown two at a time."
        ),
    ],
    micro_image: options.MicroImageIfGiven = None,
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
    a: Annotated[
        str, typer.Option("--a", "-a", metavar="FIRST:LAST", help="Range of the focus slider.")
    ] = "-1:2",
    export: Annotated[
        str | None,
        typer.Option(help="Write the page with its data into this HTML file, and don't serve it."),
    ] = None,
    limit: Annotated[
        float, typer.Option(help="Largest size of the exported file in MB.", min=0.2, max=500)
    ] = 8.0,
    port: Annotated[
        int, typer.Option(help="Port on this machine; 0 for any free one.", min=0, max=65535)
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
) -> None:
    """Refocus a light field in the browser: click to focus, distances in mm.

    The page is served on this machine alone, at an address with a random token, until Ctrl-C.
    """
    out = check_file(export, (".html", ".htm"), raster) if export is not None else None
    path = Path(raster)
    with progress_bar("searching depth") as show:
        if path.is_dir():
            page = _pictures(path, {"micro_image": micro_image, "camera": camera})
        else:
            page = _light_field(
                path, micro_image, camera, focus, a, show if out is not None else None
            )
        if out is not None:
            from plenofir.view import export as exported

            content = exported(page, int(limit * 1e6))
            write_file(out, content)
            typer.echo(f"{export}: {len(content) / 1e6:.1f} MB")
            return
    from plenofir.view import serve

    def ready(address: str) -> None:
        typer.echo(f"{address} (Ctrl-C ends it)")
        if browser:
            # Some browsers end only with their last window.
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    serve(page, port, ready)


def _pictures(folder: Path, of_light_field: dict[str, object]) -> "Page":
    from plenofir.view import pictures_page

    for name, value in of_light_field.items():
        if value is not None:
            raise InputError(
                "is for a light field", where=options.typed(name), expected="none for a folder"
            )
    return pictures_page(folder)


def _light_field(
    path: Path,
    m: int | None,
    camera: str | None,
    focus: float,
    a: str,
    show: "Callable[[int, int], None] | None",
) -> "Page":
    from plenofir.images import read_picture
    from plenofir.refocus import check_raw
    from plenofir.view import light_field_page

    if m is None:
        raise InputError("is missing", where="micro_image", expected="M, as in -M 5")
    options.require("focus", "camera", focus != inf and camera is None)
    picture = read_picture(path)
    raw = check_raw(picture.pixels, m, where=str(path))
    parts = [options.focus_settings([part], m) for part in a.split(":")]
    if len(parts) != 2 or any(len(part) != 1 for part in parts):
        raise InputError(f"{a!r}", where="a", expected="FIRST:LAST, such as -1:2")
    model = None
    if camera is not None:
        from plenofir.camera.rays import RayModel, load_camera

        model = RayModel.focused(load_camera(camera), focus, m)
    return light_field_page(
        raw,
        m,
        full_scale=picture.full_scale,
        title=path.name,
        search=(float(parts[0][0]), float(parts[1][0])),
        model=model,
        progress=show,
    )
