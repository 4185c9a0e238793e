# SPDX-License-Identifier: Apache-2.0
"""The command ``view``: a light field, or the pictures of a simulation, in the browser."""

import threading
import webbrowser
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plenofir.commands import file_options, options
from plenofir.commands.console import print_notes, progress_bar
from plenofir.commands.focused import CalibOfCapture, opened
from plenofir.commands.groups import CameraData, LookOptions
from plenofir.commands.rasters import model_of, read_field, recognised, warn_of_camera
from plenofir.commands.results import check_file
from plenofir.ground.errors import InputError
from plenofir.ground.files import as_text, write_file

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.camera.exposure import Exposure
    from plenofir.camera.rays import MicroscopeModel, RayModel
    from plenofir.camera.recognise import Hints
    from plenofir.commands.focused import FocusedField
    from plenofir.ground.images import Picture
    from plenofir.view import Page

app = typer.Typer()

# Fewer pictures whose names count are no views of a light field.
_LEAST_VIEWS = 9


@dataclass(frozen=True)
class _Where:
    """Where the page goes: into a file, or to the browser."""

    export: Annotated[
        str | None,
        typer.Option(help="Write the page and its data into this HTML file instead of serving it."),
    ] = None
    limit: Annotated[
        float, typer.Option(help="Largest size of the exported file in MB.", min=0.2, max=500)
    ] = 8.0
    port: Annotated[
        int, typer.Option(help="Port on this machine; 0 for any free one.", min=0, max=65535)
    ] = 0
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True


@app.command()
@file_options.takes_light_fields
def view(
    hints: "Hints",
    *,
    raster: Annotated[
        str | None,
        typer.Argument(
            help="Aligned raw image (micro images of exactly M x M pixels), Lytro file, folder of "
            "views or .mat file; or the output folder of sim, whose pictures are shown two at a "
            "time."
        ),
    ] = None,
    camera: CameraData,
    calib: CalibOfCapture = None,
    source: Annotated[
        str | None,
        typer.Option(
            help="Live frames instead of a picture: a folder that grows, a video, or /dev/video0."
        ),
    ] = None,
    rate: Annotated[
        float,
        typer.Option(
            help="Frames per second at which frames already in the folder are shown.",
            min=0.1,
            max=1000,
        ),
    ] = 25.0,
    a: Annotated[
        str | None,
        typer.Option(
            "--a",
            "-a",
            metavar="FIRST:LAST",
            help="Range of the focus slider and of the depth; by default -1 to 2, more if needed.",
        ),
    ] = None,
    look: LookOptions,
    where: _Where,
) -> None:
    """Refocus a light field in the browser: click to focus, distances in mm.

    The page is served on this machine alone, at an address with a random token, until Ctrl-C. Of a
    focused camera's capture, with --calib, it refocuses to a virtual depth; --export writes planes,
    all in focus and depth, two at a time.
    """
    if (raster is None) == (source is None):
        raise InputError("give either a raw image or a folder of pictures, or --source")
    if source is not None and where.export is not None:
        raise InputError("--export cannot be combined with --source; it is for a picture")
    out = None
    if where.export is not None:
        out = check_file(where.export, (".html", ".htm"), raster, calib)
    settings = _Settings(hints._replace(calib=calib), camera, a, look)
    compared = raster is not None and hints.micro_image is None and _has_pictures(Path(raster))
    if calib is not None and raster is not None and a is None and not compared:
        focal = opened(Path(raster), settings.hints, camera, look.exposure, look.gamma)
        if focal is not None:
            _view_focused(focal, Path(raster), out, where)
            return
    with progress_bar("searching depth") as show:
        if source is not None:
            page = settings.live(source, rate)
        elif compared:
            page = settings.pictures(Path(str(raster)))
        elif (film := settings.film(Path(str(raster)))) is not None:
            if out is not None:
                raise InputError("--export is for a picture, not for a film", where=str(raster))
            page = film.live(str(raster), rate, is_file=True)
        else:
            page = settings.light_field(Path(str(raster)), show if out is not None else None)
        if out is not None:
            _export(page, out, where)
            return
    print_notes()
    serve_page(page, where.port, where.browser)


def _view_focused(focal: "FocusedField", path: Path, out: Path | None, where: _Where) -> None:
    """Show a focused camera's capture; in a file its pictures, two at a time."""
    from tempfile import TemporaryDirectory

    from plenofir.commands.focused import page_of, picture_folder
    from plenofir.view import pictures_page

    if out is None:
        print_notes()
        serve_page(page_of(focal, as_text(path.name)), where.port, where.browser)
        return
    with TemporaryDirectory(prefix="plenofir-") as folder:
        with progress_bar("refocusing") as show:
            picture_folder(focal, Path(folder), show)
        _export(pictures_page(Path(folder), as_text(path.name)), out, where)


def _export(page: "Page", out: Path, where: _Where) -> None:
    """Write a page into a file."""
    from plenofir.view import export as exported

    content = exported(page, int(where.limit * 1e6))
    write_file(out, content)
    typer.echo(f"{where.export}: {len(content) / 1e6:.1f} MB")


def serve_page(page: "Page", port: int, browser: bool) -> None:
    """Serve a page until Ctrl-C, in the browser if wanted."""
    from plenofir.view.server import serve

    def ready(address: str) -> None:
        typer.echo(f"{address} (Ctrl-C ends it)")
        if browser:
            # Some browsers end only with their last window.
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    serve(page, port, ready)


def _has_pictures(folder: Path) -> bool:
    """Whether a folder has pictures to be compared; views of a light field otherwise."""
    from plenofir.camera.recognise.benchmark import hci_views
    from plenofir.camera.recognise.names import named_views, picture_files

    if not folder.is_dir() or hci_views(folder):
        return False
    names = picture_files(folder)
    # Pictures that commands wrote are there to be compared.
    results = ("refocused", "golden", "all_in_focus")
    if (folder / "report.json").exists() or any(p.stem.startswith(results) for p in names):
        return True
    try:
        return len(named_views(names, folder).places) < _LEAST_VIEWS
    except InputError:
        return True


@dataclass(frozen=True)
class _Settings:
    """Options of a light field."""

    hints: "Hints"
    camera: CameraData
    a: str | None
    look: LookOptions

    def pictures(self, folder: Path) -> "Page":
        """The page of a folder of pictures, for which there are no such options."""
        from plenofir.view import pictures_page

        for name, value in (
            ("camera", self.camera.camera),
            ("calib", self.hints.calib),
            ("a", self.a),
            ("gamma", self.look.gamma),
        ):
            if value is not None:
                raise InputError(f"{options.typed(name)} is for a light field, not for a folder")
        return pictures_page(folder)

    def film(self, path: Path) -> "_Settings | None":
        """These options with the M of a film of aligned raw images; None for anything else."""
        from plenofir.ground.films import FILMS
        from plenofir.ground.pages import has_pages

        if path.suffix.lower() not in FILMS and not has_pages(path):
            return None
        source = recognised(path, self.hints._replace(calib=None))
        if source.kind != "film of frames":
            return None
        as_told = self.hints.order or self.hints.flip not in (None, "none")
        turned = [one.text for one in source.findings if one.heading == "axes" and one.notable]
        if turned or as_told:
            reason = turned[0].partition(":")[0] if turned else "--order and --flip are for one"
            raise InputError(
                f"{reason}; the frames of a film are shown as they lie: plenofir batch takes them "
                "apart, plenofir compose puts one right",
                where=str(path),
            )
        size = self.hints.micro_image or source.micro_image_size
        return replace(self, hints=self.hints._replace(micro_image=size))

    def light_field(self, path: Path, show: "Callable[[int, int], None] | None") -> "Page":
        """The page of a raw image, of views, or of a Lytro's file."""
        from plenofir.camera.exposure import to_srgb
        from plenofir.view import light_field_page

        picture, m, *_ = read_field(path, self.hints, rectangles=True)
        picture = to_srgb(picture, str(path))
        search, model = self._checked(m)
        return light_field_page(
            picture.pixels,
            m,
            full_scale=picture.full_scale,
            title=as_text(path.name),
            search=search,
            model=model,
            progress=show,
            gamma=picture.gamma,
            look=self._look(picture, m),
        )

    def live(self, source: str, rate: float, *, is_file: bool = False) -> "Page":
        """The page of a source of frames; `is_file`: of a film that is played over and over."""
        from plenofir.view import Live, film_file_frames, folder_frames, live_page, video_frames

        m = self._size()
        search, model = self._checked(m)
        prepare = self._preparation(source)
        folder = Path(source)
        if is_file:
            frames = film_file_frames(folder, rate)
        else:
            frames = folder_frames(folder, rate) if folder.is_dir() else video_frames(source)
        live = Live(frames, prepare, m, source)
        look = self._look(live.first.picture, m)
        return live_page(live, title=as_text(folder.name), search=search, model=model, look=look)

    def _size(self) -> int:
        """M of what does not tell it."""
        if self.hints.micro_image is None:
            raise InputError("is missing; give M as in -M 5", where="micro_image")
        return self.hints.micro_image

    def _look(self, picture: "Picture", m: int) -> "Exposure":
        """The exposure that the page starts with."""
        from plenofir.camera.exposure import exposure

        return exposure(picture, m, self.look.exposure, self.look.gamma)

    def _checked(
        self, m: int
    ) -> "tuple[tuple[float, float] | None, RayModel | MicroscopeModel | None]":
        """The range of focus settings, if one is given, and the camera."""
        model = model_of(self.camera.camera, self.camera.focus, m)
        search = None
        if self.a is not None:
            parts = [options.focus_settings([part], m) for part in self.a.split(":")]
            if len(parts) != 2 or any(len(part) != 1 for part in parts):
                raise InputError(f"{self.a!r} is not a range FIRST:LAST, such as -1:2", where="a")
            search = float(parts[0][0]), float(parts[1][0])
        warn_of_camera(model)
        return search, model

    def _preparation(self, where: str) -> "Callable[[Picture], Picture]":
        """Way from a picture to an aligned raw image."""
        from plenofir.camera.recognise.request import as_asked
        from plenofir.ground.images import upright
        from plenofir.refocus import check_raw

        m = self.hints.micro_image or 1
        if self.hints.calib is None:

            def aligned(picture: "Picture") -> "Picture":
                raster = upright(picture)
                raster = raster.like(check_raw(raster.pixels, m, where=where))
                return as_asked(raster, m, self.hints, where)

            return aligned
        from plenofir.camera.calibration import load_calibration
        from plenofir.camera.captures.prepare import CaptureHints, Prepared, prepared

        calibration = load_calibration(self.hints.calib)
        facts = CaptureHints(self.hints.bayer, self.hints.white_balance, self.hints.roi)
        # Frames are balanced as captures, before they are decoded.
        part = self.hints._replace(white_balance="auto")
        first: list[Prepared] = []

        def decoded(picture: "Picture") -> "Picture":
            if first:
                aligned = first[0].of(picture).decoded(m, where)[0]
                return as_asked(aligned, m, part, where)
            # The first frame tells for all of them whether the calibration fits.
            first.append(prepared(picture, calibration, facts, where=where))
            for note in first[0].notes:
                typer.echo(f"note: {where}: {note}", err=True)
            return as_asked(first[0].decoded(m, where)[0], m, part, where)

        return decoded
