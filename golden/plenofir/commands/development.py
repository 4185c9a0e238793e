# SPDX-License-Identifier: Apache-2.0
"""From one capture to all pictures that it holds, and a page that shows them."""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from plenofir.commands.album import Album, Show, page
from plenofir.commands.focused import FocusedField, opened
from plenofir.commands.focused_album import FocusedAlbum, field_of
from plenofir.commands.groups import CameraData
from plenofir.commands.last_run import Earlier, content_mark, key_of
from plenofir.commands.looks import look_of
from plenofir.commands.rasters import model_of, read_field
from plenofir.commands.results import save
from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, as_text, checksum, publish_run

if TYPE_CHECKING:
    from plenofir.camera.exposure import Exposure
    from plenofir.camera.rays import MicroscopeModel, RayModel
    from plenofir.camera.recognise import Field, Hints
    from plenofir.ground.images import Picture
    from plenofir.refocus import Aperture

_REPORT = "develop.json"
# Captures of a run that its exposure is taken from, evenly from the first to the last.
_EXPOSED = 9


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
    box: int | None = None
    run: "Exposure | None" = None  # that of the run, instead of the capture's own

    def marks(self, capture: Path) -> "Marks":
        """Digest that differs when a result's part of the capture, the job or its files differ."""
        hints, name = self.hints, str(capture.absolute())
        source, white, calib, dark = (
            None if path is None else content_mark(Path(path))
            for path in (capture, hints.white, hints.calib, hints.dark)
        )
        camera = self.camera
        if camera is not None and Path(camera).exists():
            camera = content_mark(Path(camera))
        of_field = name, source, white, calib, dark
        # Each picture's own mark has these: others stay as they are when one of them changes.
        plain = self._replace(slices=0, aperture=None, tilt=(0.0, 0.0), box=None)
        return Marks(
            key_of("calibration", white, dark, hints.bayer),
            key_of("field", of_field, hints),
            key_of("pictures", of_field, camera, plain),
            key_of("all", of_field, camera, self),
        )


class Marks(NamedTuple):
    """What changes with each part of a run's results."""

    calibration: str
    field: str
    pictures: str  # besides what each picture alone is made from
    whole: str


class Developed(NamedTuple):
    """Outcome of a capture."""

    lines: list[str]  # for a summary
    pictures: int
    model: "RayModel | MicroscopeModel | None"
    notes: tuple[str, ...]  # what changes the result beyond what was asked for
    reused: tuple[str, ...]  # files of an earlier run


def develop_capture(capture: Path, job: Job, folder: Path, show: Show) -> Developed:
    """Make all pictures of a capture and their page in a folder, all or none."""
    from plenofir.camera.exposure import exposure
    from plenofir.camera.lightfield.any_field import is_rectangle

    # A camera that is not there is told before anything is read.
    model_of(job.camera, job.focus, 2)
    title, earlier = as_text(capture.name), Earlier(folder, _REPORT)
    # Before the capture is read: what changes later is made again next time.
    marks = job.marks(capture)
    # Made elsewhere, so an interrupted run leaves the folder as it was.
    with TemporaryDirectory(prefix="plenofir-") as temporary:
        with Results(Path(temporary)) as results:
            focal = None if job.hints.calib is None else _focal(capture, job)
            if focal is None:
                field = _field(capture, job, earlier, marks, results, show)
            else:
                field = field_of(focal)
            lines_told = _told(field) if focal is None else _found(field)
            for name, value in (("camera", job.camera), ("box", job.box)):
                if value is not None and is_rectangle(field.picture.pixels):
                    raise InputError(
                        "is for a plenoptic camera's square of views; leave it out", where=name
                    )
            m = field.micro_image_size
            model = model_of(job.camera, job.focus, m)
            size = m if focal is None else 1
            exposed = job.run or exposure(field.picture, size, job.exposure, job.gamma)
            look = look_of(field.picture, exposed)
            lines = [*lines_told, f"shown: {exposed.words()}"]
            pictures: Album
            if focal is None:
                pictures = Album(results, field, model, look, show, earlier, marks.pictures)
            else:
                pictures = FocusedAlbum(results, field, model, look, show, earlier, marks.pictures)
                pictures.focal = replace(focal, look=look)
            how = {"aperture": job.aperture, "tilt": job.tilt, "box": job.box}
            lines += pictures.make(job.slices, how)
            pictures.viewer(title, exposed)
            results.write("index.html", page(title, pictures, lines))
            report = {
                "capture": title,
                "micro_image_size": m,
                "summary": lines,
                "mark": marks.whole,
                "keys": earlier.keys,
                "gamma": field.picture.gamma,
                "findings": field.lines,
            }
            results.write(_REPORT, json.dumps(report))
        publish_run(Path(temporary), folder, _REPORT)
    notes = tuple(f"{one.heading}: {one.text}" for one in field.lines if one.notable)
    return Developed(lines, len(pictures.shown), model, notes, tuple(earlier.reused))


def _field(
    capture: Path, job: Job, earlier: Earlier, marks: Marks, results: Results, show: Show
) -> "Field":
    """The light field of a capture, written into the results; of an earlier run where it is its."""
    from plenofir.camera.lightfield.any_field import is_rectangle
    from plenofir.camera.lightfield.exports import mosaic
    from plenofir.camera.recognise import Field, Finding
    from plenofir.ground.images import read_picture

    hints, calibrated = job.hints, earlier.take("calib.json", marks.calibration, results)
    # A raster counts only beside the calibration that it was made by.
    complete = calibrated or "calib.json" not in earlier.names.values()
    if complete and earlier.take("aligned.png", marks.field, results):
        if not calibrated:
            earlier.forget("calib.json", results)
        picture = read_picture(results.path("aligned.png"))
        report = earlier.report
        findings = tuple(Finding(*one) for one in report["findings"])
        picture = picture._replace(gamma=report["gamma"])
        return Field(picture, report["micro_image_size"], findings)
    if calibrated:
        hints = hints._replace(white_calib=results.path("calib.json"))
    field = _read(capture, hints, show)
    picture = field.picture
    if is_rectangle(picture.pixels):
        save(results, "mosaic.png", picture._replace(pixels=mosaic(picture.pixels)))
        earlier.forget("aligned.png", results)
    else:
        save(results, "aligned.png", picture)
        earlier.keys["aligned.png"] = marks.field
    if field.calibration is None:
        # A Lytro's white image gives no calibration, and one of --calib is not new.
        earlier.forget("calib.json", results)
    elif not calibrated:
        results.write("calib.json", field.calibration)
    return field


def run_exposure(captures: Sequence[Path], job: Job, kept: Path) -> "Exposure | None":
    """One exposure for all captures of a run, from some of them; kept in a file for its next run.

    None if none of them can be read: that is told where they are developed.
    """
    from plenofir.camera.exposure import Exposure, one_exposure
    from plenofir.ground.files import publish

    asked = [job.exposure, job.gamma]
    with suppress(OSError, ValueError, KeyError, TypeError):
        stored = json.loads(kept.read_bytes())
        if stored["asked"] == asked:
            return Exposure(**stored["exposure"])
    last = len(captures) - 1
    places = sorted({last * n // max(_EXPOSED - 1, 1) for n in range(_EXPOSED)})

    def fields() -> "Iterator[tuple[Picture, int]]":
        first: tuple[object, ...] = ()
        for place in places:
            try:
                field = _read(captures[place], job.hints, lambda *_: None)
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
    """The summary of a folder that has what this job made of a source, unchanged; else None."""
    if not is_developed(capture, job, folder):
        return None
    return [str(line) for line in json.loads((folder / _REPORT).read_bytes())["summary"]]


def is_developed(capture: Path, job: Job, folder: Path) -> bool:
    """Whether a folder has what this job made of the capture, unchanged."""
    try:
        report = json.loads((folder / _REPORT).read_bytes())
        return report["mark"] == job.marks(capture).whole and all(
            checksum(folder / Path(name).name) == written
            for name, written in report["sha256"].items()
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def _read(path: Path, hints: "Hints", show: Show) -> "Field":
    """The light field of a source, whatever it is."""
    from plenofir.camera.exposure import to_srgb

    field = read_field(
        path,
        hints,
        lambda done, total: show("reading", done, total),
        notes=False,
        rectangles=True,
    )
    return field._replace(picture=to_srgb(field.picture, str(path)))


def _focal(capture: Path, job: Job) -> FocusedField | None:
    """The capture of a focused camera; None for another source."""
    camera = CameraData(job.camera, job.focus)
    return opened(capture, job.hints, camera, job.exposure, job.gamma)


def _found(field: "Field") -> list[str]:
    """Lines of the summary about what was told and measured."""
    return [f"{one.heading}: {one.text}" for one in field.lines]


def _told(field: "Field") -> list[str]:
    """Lines of the summary about a source."""
    from plenofir.camera.lightfield.any_field import is_rectangle

    lines = _found(field)
    pixels, m = field.picture.pixels, field.micro_image_size
    if is_rectangle(pixels):
        lines.append("no square of views: refocused view by view, along what there is")
    else:
        rows, columns = (length // m for length in pixels.shape[:2])
        lines.append(f"{columns} x {rows} micro images of {m} x {m} pixels")
    return lines
