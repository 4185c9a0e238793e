# SPDX-License-Identifier: Apache-2.0
"""The command ``view``: a light field, or the pictures of a simulation, in the browser."""

import threading
import webbrowser
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import options
from plenofir.commands.console import progress_bar
from plenofir.commands.results import check_file
from plenofir.ground.errors import InputError
from plenofir.ground.files import as_text, write_file

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.camera.rays import RayModel
    from plenofir.ground.images import Image, Picture
    from plenofir.view import Page

app = typer.Typer()

# Of what Lytro's files hold in linear light.
_GAMMA = 2.2


@app.command()
def view(
    raster: Annotated[
        str | None,
        typer.Argument(
            help="Aligned raw image: micro images of exactly M x M pixels; a Lytro's file; or a "
            "folder that make sim has left, whose pictures are shown two at a time."
        ),
    ] = None,
    micro_image: options.MicroImageIfGiven = None,
    camera: options.CameraIfGiven = None,
    focus: options.Focus = inf,
    calib: Annotated[
        str | None,
        typer.Option(help="Calibration file (plenofir calibrate): pictures are raw captures."),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(help="Instead of a picture: a folder that grows, a video, or /dev/video0."),
    ] = None,
    rate: Annotated[
        float, typer.Option(help="Frames a second of a folder's old frames.", min=0.1, max=1000)
    ] = 25.0,
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
    if (raster is None) == (source is None):
        raise InputError("give either a raw image or a folder of pictures, or --source")
    if source is not None and export is not None:
        raise InputError("--export cannot be combined with --source; it is for a picture")
    out = check_file(export, (".html", ".htm"), raster, calib) if export is not None else None
    settings = _Settings(micro_image, camera, focus, calib, a)
    with progress_bar("searching depth") as show:
        if source is not None:
            page = settings.live(source, rate)
        elif raster is not None and Path(raster).is_dir():
            page = settings.pictures(Path(raster))
        else:
            page = settings.light_field(Path(str(raster)), show if out is not None else None)
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


@dataclass(frozen=True)
class _Settings:
    """Options of a light field."""

    micro_image: int | None
    camera: str | None
    focus: float
    calib: str | None
    a: str

    def pictures(self, folder: Path) -> "Page":
        """The page of a folder of pictures, for which there are no such options."""
        from plenofir.view import pictures_page

        for name in ("micro_image", "camera", "calib"):
            if getattr(self, name) is not None:
                raise InputError(f"{options.typed(name)} is for a light field, not for a folder")
        return pictures_page(folder)

    def light_field(self, path: Path, show: "Callable[[int, int], None] | None") -> "Page":
        """The page of a raw image, or of a Lytro's file."""
        from plenofir.camera.lytro import is_lytro
        from plenofir.ground.images import read_picture
        from plenofir.view import light_field_page

        if is_lytro(path):
            m, picture = self._of_lytro(path)
            _, search, model = self._checked(m)
        else:
            m, search, model = self._checked(self.micro_image)
            prepare = self._preparation(str(path))
            stored = read_picture(path)
            picture = stored._replace(pixels=prepare(stored))
        return light_field_page(
            picture.pixels,
            m,
            full_scale=picture.full_scale,
            title=as_text(path.name),
            search=search,
            model=model,
            progress=show,
        )

    def _of_lytro(self, path: Path) -> "tuple[int, Picture]":
        """M and the aligned raw image of a Lytro's file, brightened to look at."""
        from plenofir.camera.calibration import decode, largest_odd_size, load_calibration
        from plenofir.camera.lytro import read_lytro
        from plenofir.camera.lytro.sensor import FULL_SCALE, with_gamma
        from plenofir.ground.images import Picture

        taken = read_lytro(path)
        calibration = load_calibration(self.calib) if self.calib else taken.calibration
        m = self.micro_image or largest_odd_size(calibration)
        raw = decode(taken.image, calibration, m, full_scale=FULL_SCALE, where=str(path))
        return m, Picture(with_gamma(raw, _GAMMA, FULL_SCALE), FULL_SCALE)

    def live(self, source: str, rate: float) -> "Page":
        """The page of a source of frames."""
        from plenofir.view import Live, folder_frames, live_page, video_frames

        m, search, model = self._checked(self.micro_image)
        prepare = self._preparation(source)
        folder = Path(source)
        frames = folder_frames(folder, rate) if folder.is_dir() else video_frames(source)
        live = Live(frames, prepare, m, source)
        return live_page(live, title=as_text(folder.name), search=search, model=model)

    def _checked(self, m: int | None) -> "tuple[int, tuple[float, float], RayModel | None]":
        """M, the range of focus settings, the camera."""
        if m is None:
            raise InputError("is missing; give M as in -M 5", where="micro_image")
        options.require("focus", "camera", self.focus != inf and self.camera is None)
        parts = [options.focus_settings([part], m) for part in self.a.split(":")]
        if len(parts) != 2 or any(len(part) != 1 for part in parts):
            raise InputError(f"{self.a!r} is no range FIRST:LAST, such as -1:2", where="a")
        model = None
        if self.camera is not None:
            from plenofir.camera.rays import RayModel, load_camera

            model = RayModel.focused(load_camera(self.camera), self.focus, m)
        return m, (float(parts[0][0]), float(parts[1][0])), model

    def _preparation(self, where: str) -> "Callable[[Picture], Image]":
        """What makes a picture an aligned raw image."""
        from plenofir.refocus import check_raw

        m = self.micro_image or 1
        if self.calib is None:
            return lambda picture: check_raw(picture.pixels, m, where=where)
        from plenofir.camera.calibration import decode, load_calibration

        calibration = load_calibration(self.calib)
        return lambda picture: decode(
            picture.pixels, calibration, m, full_scale=picture.full_scale, where=where
        )
