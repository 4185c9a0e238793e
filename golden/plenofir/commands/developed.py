# SPDX-License-Identifier: Apache-2.0
"""From one capture to all pictures that it holds, and a page that shows them."""

import base64
import html
import io
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from hashlib import sha256
from importlib.metadata import version
from itertools import chain
from math import ceil, floor, inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from plenofir.commands.looks import look_of
from plenofir.commands.rasters import doubt_of_depth, read_field
from plenofir.commands.results import save
from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, as_text, checksum, publish_run

if TYPE_CHECKING:
    from plenofir.camera.exposure import Exposure
    from plenofir.camera.lightfield.disparity import Disparity
    from plenofir.camera.rays import RayModel
    from plenofir.camera.recognise import Field, Hints
    from plenofir.commands.looks import Look
    from plenofir.ground.images import Image, Picture
    from plenofir.refocus import Aperture

Show = Callable[[str, int, int], None]

_REPORT = "develop.json"
# Least probability of a depth that counts.
_SURE = 0.5
# Share of a step by which a depth may lie beyond the first or last picture.
_ASIDE = 0.3
_VIEWER_BYTES = 8_000_000
# Pixels of an animation along its longer side, and how long a picture of it stays, in ms.
_ANIMATION_PIXELS, _STAYS = 640, 120
# Captures of a run that its exposure is taken from, evenly from the first to the last.
_EXPOSED = 9
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;margin:1.5rem auto;max-width:76rem;padding:0 1rem;"
    "background:#fff;color:#222}main{display:grid;gap:1rem;"
    "grid-template-columns:repeat(auto-fill,minmax(17rem,1fr))}figure{margin:0}img{width:100%}"
    "figcaption{font-size:.9rem}"
)


class Job(NamedTuple):
    """How captures are developed."""

    hints: "Hints"
    camera: str | None = None
    focus: float = inf  # of the camera, in mm
    slices: int = 9  # most refocused pictures
    exposure: str = "auto"
    gamma: float | None = None
    aperture: "Aperture | None" = None
    tilt: tuple[float, float] = (0.0, 0.0)
    run: "Exposure | None" = None  # that of the run, instead of the capture's own

    def mark(self, capture: Path) -> str:
        """What changes when the capture, the job or one of its files changes."""
        files = [self.hints.white, self.hints.calib, self.hints.dark, self.camera]
        named = [Path(file) for file in files if file is not None]
        sums = [checksum(file) for file in [capture, *named] if file.is_file()]
        text = repr((version("plenofir"), str(capture.absolute()), self, sums))
        return sha256(text.encode()).hexdigest()


class Developed(NamedTuple):
    """What became of a capture."""

    lines: list[str]  # for a summary
    pictures: int
    model: "RayModel | None"
    notes: tuple[str, ...]  # what changes the result beyond what was asked for


def develop_capture(capture: Path, job: Job, folder: Path, show: Show) -> Developed:
    """Make all pictures of a capture and their page in a folder, all or none."""
    from plenofir.camera.exposure import exposure
    from plenofir.camera.lightfield.any_field import is_rectangle
    from plenofir.camera.rays import RayModel, load_camera

    known = None if job.camera is None else load_camera(job.camera)
    field, told = _read(capture, job, show)
    if known is not None and is_rectangle(field.picture.pixels):
        raise InputError(
            "is for a plenoptic camera's square of views; leave it out", where="camera"
        )
    m = field.micro_image_size
    model = None if known is None else RayModel.focused(known, job.focus, m)
    exposed = job.run or exposure(field.picture, m, job.exposure, job.gamma)
    look = look_of(field.picture, exposed)
    lines = [*told, f"shown: {exposed.words()}"]
    title, mark = as_text(capture.name), job.mark(capture)
    with TemporaryDirectory(prefix="plenofir-") as temporary:
        with Results(Path(temporary)) as results:
            pictures = _Pictures(results, field, model, look, show)
            lines += pictures.make(job)
            pictures.viewer(title, exposed)
            results.write("index.html", _page(title, pictures, lines))
            report = {"capture": title, "micro_image_size": m, "summary": lines, "mark": mark}
            results.write(_REPORT, json.dumps(report))
        publish_run(Path(temporary), folder, _REPORT)
    notes = tuple(f"{one.heading}: {one.text}" for one in field.lines if one.notable)
    return Developed(lines, len(pictures.shown), model, notes)


def run_exposure(captures: Sequence[Path], job: Job, kept: Path) -> "Exposure | None":
    """One exposure for all captures of a run, from some of them; kept in a file for its next run.

    None if none of them can be read: that is told where they are developed.
    """
    from plenofir.camera.exposure import Exposure, one_exposure
    from plenofir.ground.files import publish

    asked = [job.exposure, job.gamma]
    with suppress(OSError, ValueError, KeyError, TypeError):
        known = json.loads(kept.read_bytes())
        if known["asked"] == asked:
            return Exposure(**known["exposure"])
    last = len(captures) - 1
    places = sorted({last * n // max(_EXPOSED - 1, 1) for n in range(_EXPOSED)})

    def fields() -> "Iterator[tuple[Picture, int]]":
        first: tuple[object, ...] = ()
        for place in places:
            try:
                field, _ = _read(captures[place], job, lambda *_: None)
            except (InputError, MemoryError):
                continue
            picture = field.picture
            meaning = picture.full_scale, picture.gamma, picture.pixels.dtype
            if first not in ((), meaning):
                raise InputError(
                    "its white, gamma or bits are not those of the other captures; give "
                    "--exposure-per-frame, or develop it by itself",
                    where=str(captures[place]),
                )
            first = meaning
            yield picture, field.micro_image_size

    readable = fields()
    first = next(readable, None)
    if first is None:
        return None
    exposed = one_exposure(chain([first], readable), job.exposure, job.gamma)
    content = json.dumps({"asked": asked, "exposure": exposed._asdict()})
    publish({kept.name: content}, kept.parent)
    return exposed


def summary_there(capture: Path, job: Job, folder: Path) -> list[str] | None:
    """The summary of a folder that has what this job made of a file, unchanged; else None."""
    if not capture.is_file() or not is_developed(capture, job, folder):
        return None
    return [str(line) for line in json.loads((folder / _REPORT).read_bytes())["summary"]]


def is_developed(capture: Path, job: Job, folder: Path) -> bool:
    """Whether a folder has what this job made of the capture, unchanged."""
    try:
        report = json.loads((folder / _REPORT).read_bytes())
        return report["mark"] == job.mark(capture) and all(
            checksum(folder / Path(name).name) == known for name, known in report["sha256"].items()
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def _read(path: Path, job: Job, show: Show) -> "tuple[Field, list[str]]":
    """The light field of a source, whatever it is, and what was found."""
    from plenofir.camera.exposure import to_srgb
    from plenofir.camera.lightfield.any_field import is_rectangle

    field = read_field(
        path,
        job.hints,
        lambda done, total: show("reading", done, total),
        notes=False,
        rectangles=True,
    )
    picture, m = to_srgb(field.picture, str(path)), field.micro_image_size
    lines = [f"{one.heading}: {one.text}" for one in field.lines]
    if is_rectangle(picture.pixels):
        lines.append("no square of views: refocused view by view, along what there is")
    else:
        rows, columns = (length // m for length in picture.pixels.shape[:2])
        lines.append(f"{columns} x {rows} micro images of {m} x {m} pixels")
    return field._replace(picture=picture), lines


class _Pictures:
    """Makes and writes the pictures of a light field; keeps their names and captions."""

    def __init__(
        self,
        results: Results,
        field: "Field",
        model: "RayModel | None",
        look: "Look",
        show: Show,
    ) -> None:
        self.results, self.field, self.model = results, field, model
        self.look, self.show = look, show
        self.disparity: Disparity | None = None  # once it was searched
        # Of each picture its name, its caption, and what the page shows.
        self.shown: list[tuple[str, str, str]] = []
        self.films: set[str] = set()

    def make(self, job: Job) -> list[str]:
        """All of them; lines for the summary."""
        from plenofir.camera.lightfield.any_field import (
            central_view,
            is_rectangle,
            pictures_of,
            search_depth,
            sharp_everywhere,
            view_at,
        )
        from plenofir.camera.lightfield.exports import mosaic
        from plenofir.refocus import setting_names

        picture, m = self.field.picture, self.field.micro_image_size
        pixels, counts, large = picture.pixels, (m, m), m
        source = self.look.source
        if is_rectangle(pixels):
            counts, large = pixels.shape[:2], 1
            save(self.results, "mosaic.png", picture._replace(pixels=mosaic(pixels)))
        else:
            save(self.results, "aligned.png", picture)
        if self.field.calibration is not None:
            self.results.write("calib.json", self.field.calibration)
        central = central_view(pixels, m)
        enlarged = _enlarged(self.look(central_view(source, m)).pixels, large)
        self.add("central_view.png", enlarged, "The view in the middle")
        found = search_depth(
            pixels, m, progress=lambda done, total: self.show("searching depth", done, total)
        )
        self.disparity = found.disparity
        low, high = _range(found.disparity, central)
        settings = _settings(low, high, m, job.slices)
        stack = pictures_of(
            source,
            m,
            settings,
            lambda done, total: self.show("refocusing", done, total),
            aperture=job.aperture,
            tilt=job.tilt,
        )
        frames = []
        for a, name, image in zip(settings, setting_names(settings, m), stack, strict=True):
            shown = self.look(image).pixels
            frames.append(self.add(f"refocused_{name}.png", shown, f"a = {a}", a))
        nearest = found.disparity.limited(low, high)
        sharp = self.look(sharp_everywhere(source, m, nearest)).pixels
        self.add("all_in_focus.png", sharp, "Sharp everywhere")
        self.animation("focus", frames + frames[-2:0:-1], "Through the focus")
        views = [_small(self.look(view_at(source, m, v, u)).pixels) for v, u in _around(*counts)]
        self.animation("views", views, "Around the lens")
        lines = [
            f"range: a = {settings[0]} to {settings[-1]} by its own depths, {len(settings)} "
            "pictures",
            *self.depth(found.disparity),
        ]
        if not self.films:
            lines.append("no WebM: OpenCV writes it: pip install opencv-python-headless")
        return lines

    def depth(self, disparity: "Disparity") -> list[str]:
        """The map of depths, in mm where the camera is known; lines for the summary."""
        import numpy as np

        from plenofir.camera.lightfield.disparity import sure_distances
        from plenofir.camera.plots import depth_picture

        save(self.results, "disparity.npy", disparity.pixels_per_view)
        sure = disparity.confidence >= _SURE
        if self.model is None:
            values = np.where(sure, disparity.pixels_per_view, np.nan)
            caption = "Depth in units of a; give --camera for mm"
        else:
            values = sure_distances(disparity, self.model, _SURE)
            save(self.results, "distance_mm.npy", values)
            caption = "Distance from the micro lenses"
        self.add("depth.png", depth_picture(values, in_mm=self.model is not None), caption)
        share = float(sure.mean())
        text = f"depth: known of {100 * share:.0f} % of the micro lenses"
        return [line for line in (text, doubt_of_depth(share, self.field)) if line]

    def viewer(self, title: str, exposed: "Exposure") -> None:
        """The viewer with the light field in it, one file."""
        from plenofir.view import export, light_field_page

        self.show("making the viewer", 0, 1)
        picture = self.field.picture
        page = light_field_page(
            picture.pixels,
            self.field.micro_image_size,
            full_scale=picture.full_scale,
            title=title,
            model=self.model,
            gamma=picture.gamma,
            look=exposed,
            disparity=self.disparity,
        )
        self.results.write("viewer.html", export(page, _VIEWER_BYTES))

    def add(self, name: str, image: "Image", caption: str, a: Fraction | None = None) -> "Image":
        """A picture as it is shown; result: a small one."""
        from plenofir.camera.described import described
        from plenofir.ground.images import bare

        about = described(self.field.micro_image_size, a, self.model)
        save(self.results, name, bare(image)._replace(xmp=about))
        small = _small(image)
        self.shown.append((name, caption, _data_uri(small)))
        return small

    def animation(self, name: str, frames: Sequence["Image"], caption: str) -> None:
        """An endless GIF, and a WebM if OpenCV is installed."""
        from PIL import Image as Pillow

        from plenofir.ground.films import write_webm

        first, *others = [Pillow.fromarray(frame) for frame in frames]
        content = io.BytesIO()
        first.save(content, "GIF", save_all=True, append_images=others, duration=_STAYS, loop=0)
        self.results.write(f"{name}.gif", content.getvalue())
        self.show("animating", 1, 2)
        if write_webm(self.results.path(f"{name}.webm"), frames, 1000 / _STAYS):
            self.films.add(f"{name}.webm")
        self.shown.append((f"{name}.gif", caption, f"{name}.gif"))


def _range(disparity: "Disparity", view: "Image") -> tuple[float, float]:
    """Range of depths that has the middle 96 % of what a view shows.

    What has no contrast counts little: noise can be matched at any depth.
    """
    import numpy as np
    from scipy import ndimage

    from plenofir.camera.calibration.frames import grey

    values = disparity.pixels_per_view.ravel()
    contrast = ndimage.gaussian_gradient_magnitude(grey(view).astype(np.float64), 1.0).ravel() ** 2
    weights = contrast * (disparity.confidence.ravel() >= _SURE)
    if not weights.any():
        weights = np.ones(len(values))
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    first, last = np.searchsorted(below, np.array([0.02, 0.98]) * below[-1])
    return float(values[order][first]), float(values[order][last])


def _settings(low: float, high: float, m: int, most: int) -> list[Fraction]:
    """Focus settings over a range of depths: multiples of 1/M, evenly apart."""
    first, last = floor(low * m + _ASIDE), ceil(high * m - _ASIDE)
    step = max(1, ceil((last - first) / max(most - 1, 1)))
    return [Fraction(shift, m) for shift in range(first, last + 1, step)]


def _around(rows: int, columns: int) -> list[tuple[int, int]]:
    """Views on an ellipse about the middle one, (v, u), once around."""
    from math import cos, pi, sin

    down, right = (rows - 1) / 2, (columns - 1) / 2
    turns = [2 * pi * n / 24 for n in range(24)]
    places = [
        (round(down + 0.8 * down * sin(t)), round(right + 0.8 * right * cos(t))) for t in turns
    ]
    return [place for n, place in enumerate(places) if place != places[n - 1]] or places[:1]


def _enlarged(image: "Image", times: int) -> "Image":
    """A view, a pixel for each micro lens, as large as the other pictures."""
    import numpy as np
    from scipy import ndimage

    zoom = (times, times, 1)[: image.ndim]
    large = ndimage.zoom(image.astype(np.float32), zoom, order=3, mode="nearest", grid_mode=True)
    most = np.iinfo(image.dtype).max
    return np.asarray(np.clip(np.rint(large), 0, most).astype(image.dtype))


def _small(image: "Image") -> "Image":
    """A frame of an animation: 8 bit, its longer side always the same."""
    import numpy as np
    from PIL import Image as Pillow

    from plenofir.ground.images import eight_bits

    eight = eight_bits(image)
    rows, columns = image.shape[:2]
    scale = _ANIMATION_PIXELS / max(rows, columns)
    size = max(1, round(columns * scale)), max(1, round(rows * scale))
    return np.asarray(Pillow.fromarray(eight).resize(size, Pillow.Resampling.BICUBIC))


def _data_uri(image: "Image") -> str:
    """A small picture within a page."""
    from plenofir.ground.images import encode_picture

    return "data:image/jpeg;base64," + base64.b64encode(encode_picture(".jpg", image)).decode()


def _page(title: str, pictures: _Pictures, lines: Sequence[str]) -> str:
    """A page of the pictures, which lie beside it."""

    def figure(name: str, caption: str, small: str) -> str:
        film = f"{Path(name).stem}.webm"
        also = f' (<a href="{film}">WebM</a>)' if film in pictures.films else ""
        return (
            f'<figure><a href="{name}"><img src="{small}" alt="{caption}"></a>'
            f"<figcaption>{caption}{also}</figcaption></figure>"
        )

    # Slices last: they are many.
    order = sorted(pictures.shown, key=lambda one: one[0].startswith("refocused"))
    figures = "\n".join(figure(*map(html.escape, one)) for one in order)
    said = "\n".join(f"<li>{html.escape(line)}</li>" for line in lines)
    return (
        f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n<h1>{html.escape(title)}</h1>\n"
        f'<p><a href="viewer.html">Refocus it by hand</a></p>\n'
        f"<ul>\n{said}\n</ul>\n<main>\n{figures}\n</main>\n</body>\n</html>\n"
    )
