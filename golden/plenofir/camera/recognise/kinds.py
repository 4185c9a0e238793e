# SPDX-License-Identifier: Apache-2.0
"""Kinds: what stored pixels are, by hints, names and the pixels themselves.

`CLASSIFIERS` has a row for each kind of evidence: the axes that it looks at, and what decides. The
first that gives an answer is right.
"""

import re
from collections.abc import Callable
from dataclasses import replace
from glob import escape
from math import isqrt, prod
from pathlib import Path

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.patterns.elemental import find_elemental
from plenofir.camera.patterns.rasters import find_mosaic, find_raster
from plenofir.camera.recognise.answers import mosaic_source, raster_source, views_source
from plenofir.camera.recognise.captures import capture_source
from plenofir.camera.recognise.doubts import doubt, joints
from plenofir.camera.recognise.picture import is_mosaic, recognise_picture
from plenofir.camera.recognise.sequences import SequenceLayout, sequence_layout
from plenofir.camera.recognise.source import (
    Finding,
    Hints,
    Kind,
    LightFieldSource,
    Progress,
    quiet,
)
from plenofir.camera.recognise.storage import (
    LONGER,
    RUNNING,
    Stored,
    check_sizes,
    of_array,
    picture_findings,
)
from plenofir.ground.errors import InputError
from plenofir.ground.films import FILMS
from plenofir.ground.images import Picture
from plenofir.ground.shell import command
from plenofir.refocus import check_raw

ESLF = 14
# A quilt's aspect has few digits in its name.
_ASPECT = 0.02
# Share of a round picture's radius that its rim does not reach.
_WITHIN = 0.95

Classifier = Callable[[Stored, Hints], LightFieldSource | None]


def _is_jpeg(stored: Stored) -> bool:
    return stored.whole is not None and stored.whole.is_jpeg


# Pictures.


def _calibrated(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """A picture for which a calibration is named."""
    if hints.calib is None and hints.white is None:
        return None
    return capture_source(stored.load(), stored.where, hints)


def _by_hints(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """A picture whose layout is told, by a person or by its name."""
    layout, m = hints.layout, hints.micro_image
    if layout == "auto" and "eslf" in stored.path.stem.lower():
        layout, m = "raster", m or ESLF
    if layout == "auto":
        return None
    picture = stored.load()
    if m is None:
        levels = grey(picture.pixels)
        if layout == "mosaic":
            mosaic = find_mosaic(levels)
            m = mosaic.rows if mosaic and mosaic.rows == mosaic.columns else None
        else:
            raster = find_raster(levels, is_jpeg=_is_jpeg(stored))
            m = raster.micro_image_size if raster else None
    if m is None:
        raise InputError(
            f"it is not clear how many views {stored.where} has; give the number along a side",
            where="micro_image",
        )
    rows, columns = picture.pixels.shape[:2]
    if m > min(rows, columns):
        raise InputError(
            f"{m} is more than the picture has pixels; use at most {min(rows, columns)}",
            where="micro_image",
        )
    if layout == "mosaic":
        return mosaic_source(stored, hints, (m, m))
    text = f"{m} x {m} pixels for each of {columns // m} x {rows // m} lenses"
    return raster_source(stored, hints, m, Finding("raster", text, "told"))


def _by_micro_image_size(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """A picture whose M is told: micro images, unless its pixels contradict."""
    m = hints.micro_image
    if m is None:
        return None
    picture = stored.load()
    check_raw(picture.pixels, m, where=stored.where)
    is_jpeg = _is_jpeg(stored)
    raster = joints(picture.pixels, is_jpeg=is_jpeg)
    mosaic = is_mosaic(picture.pixels, m) if raster is None else None
    if mosaic is not None:
        return mosaic_source(stored, hints, mosaic)
    against = doubt(picture, m, stored.where, raster, is_jpeg=is_jpeg)
    if against is not None and against.certain:
        raise InputError(against.text, where=stored.where)
    source = raster_source(
        stored, hints, m, Finding("raster", f"taken as aligned, M = {m} as given", "told")
    )
    return replace(source, warnings=() if against is None else (against.text,))


def _by_pixels(stored: Stored, hints: Hints) -> LightFieldSource:
    """A picture of which nothing is told."""
    picture = stored.load()
    source = recognise_picture(picture, stored.where, is_jpeg=_is_jpeg(stored))
    if stored.orientation != 1 and source.kind in ("aligned raster", "mosaic of views"):
        return _by_pixels(stored.upright, hints)
    if source.kind == "aligned raster" and source.micro_image_size is not None:
        finding = Finding(
            "raster", f"taken as aligned, M = {source.micro_image_size} by its joints"
        )
        return raster_source(
            stored,
            hints,
            source.micro_image_size,
            *source.findings,
            finding,
            advice=source.advice,
        )
    if source.kind == "mosaic of views" and source.counts is not None:
        return _quilt_by_motion(stored, hints, source) or mosaic_source(
            stored, hints, source.counts, source.findings, source.advice
        )
    findings = [*source.findings[:1], *stored.findings, *source.findings[1:]]
    if stored.orientation != 1:
        text = (
            f"as the sensor lies; what is made of it is turned (EXIF orientation "
            f"{stored.orientation})"
        )
        findings.insert(1, Finding("orientation", text, "told"))
    return replace(source, findings=tuple(findings), where=stored.where)


_QUILT = re.compile(r"_qs(\d+)x(\d+)(?:a(\d+(?:\.\d+)?))?")


def _quilt_by_name(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """A quilt of a Looking Glass, whose name tells columns, rows and aspect: _qs8x6a0.75."""
    match = _QUILT.search(stored.path.stem)
    if match is None or hints.layout == "raster":
        return None
    columns, rows = int(match[1]), int(match[2])
    findings = [Finding("quilt", f"{columns} x {rows} views by its name", "told")]
    height, width = stored.load().pixels.shape[:2]
    if match[3] and columns * rows:
        named, aspect = float(match[3]), width * rows / (height * columns)
        if abs(named / aspect - 1) > _ASPECT:
            text = (
                f"views are shown {named:g} times as wide as high, their pixels make {aspect:.3g}"
            )
            findings.append(Finding("aspect", text, "told", notable=True))
    return quilt_source(stored, hints, columns, rows, tuple(findings))


def _quilt_by_motion(
    stored: Stored, hints: Hints, mosaic: LightFieldSource
) -> LightFieldSource | None:
    """A mosaic whose views are one line, row after row from below, as in a quilt."""
    rows, columns = mosaic.counts or (0, 0)
    if min(rows, columns) < 2 or stored.load().pixels.shape[0] % rows:
        return None
    quilt = quilt_source(stored, hints, columns, rows, mosaic.findings)
    assert quilt.views is not None
    layout = sequence_layout(list(quilt.views(quiet).pixels[0]))
    if layout is None or layout.rows != 1:
        return None
    text = "one line of views by their motion, row after row from below, as in a quilt"
    return replace(quilt, findings=(*quilt.findings, Finding("sequence", text)))


def quilt_source(
    stored: Stored, hints: Hints, columns: int, rows: int, findings: tuple[Finding, ...]
) -> LightFieldSource:
    """One line of views from left to right: the tiles of a picture, from the bottom left on."""
    picture = stored.load()
    height, width = picture.pixels.shape[:2]
    if columns * rows < 2 or height // rows < 1 or width // columns < 1:
        raise InputError(f"no quilt has {columns} x {rows} views", where=stored.where)
    # Quilts of a round size may have some pixels more above and to the right.
    view = height // rows, width // columns
    whole = picture.pixels[height - rows * view[0] :, : columns * view[1]]
    tiles = whole.reshape(rows, view[0], columns, view[1], *whole.shape[2:])
    line = np.moveaxis(tiles, 2, 1)[::-1].reshape(1, rows * columns, *view, *whole.shape[2:])
    text = f"{columns * rows} views of {view[1]} x {view[0]} pixels in a line, from the left"
    return views_source(
        "quilt of views",
        stored,
        hints,
        (1, columns * rows),
        (*findings, Finding("views", text)),
        (command("develop", stored.path),),
        view=lambda v, u: picture._replace(pixels=line[v, u]),
        load=lambda progress: picture._replace(pixels=line),
    )


def _elemental(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """A capture of a Fourier light-field microscope, whose elemental images are views."""
    if hints.micro_image is not None or hints.layout != "auto":
        return None
    picture = stored.load()
    elemental = find_elemental(picture.pixels)
    if elemental is None:
        return None
    rows, columns = elemental.centres.shape[:2]
    # The largest square within a round picture.
    side = int(np.sqrt(2) * elemental.radius * _WITHIN)
    offsets = np.arange(side) - (side - 1) / 2

    def view(v: int, u: int) -> Picture:
        y, x = elemental.centres[v, u]
        places = np.stack(np.meshgrid(y + offsets, x + offsets, indexing="ij"))
        most = np.iinfo(picture.pixels.dtype).max
        colours = [
            ndimage.map_coordinates(colour.astype(np.float32), places, order=3, mode="nearest")
            for colour in np.moveaxis(np.atleast_3d(picture.pixels), 2, 0)
        ]
        values = np.stack(colours, axis=-1).reshape(side, side, *picture.pixels.shape[2:])
        cut = np.clip(np.rint(values), 0, most).astype(picture.pixels.dtype)
        return picture._replace(pixels=cut)

    def load(progress: Progress) -> Picture:
        views = [[view(v, u).pixels for u in range(columns)] for v in range(rows)]
        return picture._replace(pixels=np.array(views))

    text = (
        f"{elemental.number} round pictures of {2 * elemental.radius:.0f} pixels with dark "
        "between: a Fourier light-field microscope, each is a view"
    )
    findings = [Finding("evidence", text)]
    if rows * columns < elemental.number:
        text = f"the {columns} in the fullest row are taken: the others stand between columns"
        findings.append(Finding("views", text, notable=True))
    return views_source(
        "elemental images",
        stored,
        hints,
        (rows, columns),
        tuple(findings),
        (command("develop", stored.path),),
        view=view,
        load=load,
    )


# Views by row and column.


def _views(stored: Stored, hints: Hints) -> LightFieldSource:
    """Views whose rows and columns are known by their names or their array."""
    rows, columns = stored.counts
    if hints.micro_image not in (None, rows) and hints.micro_image != columns:
        raise InputError(
            f"{hints.micro_image} is not right: there are {columns} x {rows} views",
            where="micro_image",
        )
    check_sizes(stored)
    first = stored.at((0, 0))
    shape = first.pixels.shape
    text = f"{columns} x {rows} views of {shape[1]} x {shape[0]} pixels"
    kind: Kind = "array of views"
    if stored.whole is None:
        kind = "folder of views"
    elif stored.path.suffix.lower() == ".mat":
        kind = "light field in a MATLAB file"
    advice = command("develop", stored.path)
    findings = (Finding("evidence", text), *picture_findings(first))
    source = views_source(kind, stored, hints, (rows, columns), findings, (advice,))
    if any(finding.confidence == "unknown" for finding in source.findings):
        # Numbered frames of a camera are as many as views by chance.
        return _frames(stored, hints) or source
    return source


# Series.


def _film_of_quilts(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """A film whose name says that its frames are quilts."""
    match = _QUILT.search(stored.path.stem)
    if match is None or not _is_film(stored):
        return None
    text = (
        f"a film whose frames are quilts of {match[1]} x {match[2]} views, by its name: films of "
        "quilts are not read"
    )
    advice = f"save a frame as a picture named NAME{match[0]}.png"
    return LightFieldSource(
        "can't tell", (Finding("evidence", text, "told"),), (advice,), where=stored.where
    )


def _frames(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """Pictures that are captures or rasters themselves: frames of a camera."""
    start = next(iter(stored.places()))
    frame = stored.at(start)
    is_jpeg = frame.is_jpeg or _is_film(stored)
    first = recognise_picture(frame, stored.name_at(start), is_jpeg=is_jpeg)
    if first.kind not in ("aligned raster", "raw capture", "white image"):
        return None
    axes: tuple[Finding, ...] = ()
    if first.micro_image_size is not None:
        alone = of_array(stored.path, "yx", frame)
        axes = raster_source(alone, hints, first.micro_image_size).findings
    name = Path(stored.name_at(start))
    is_folder = stored.path.is_dir()
    text = f"{prod(stored.counts)} pictures; the first of them, {name.name}: {first.kind}"
    frames = stored.path
    if is_folder:
        frames = Path(escape(str(stored.path))) / f"*{name.suffix}"
    go_on = command("batch", frames, "-M", str(first.micro_image_size), "-a", 0)
    if first.micro_image_size is None:
        go_on = f"{command('batch', frames)} --white WHITE_IMAGE"
    return LightFieldSource(
        "folder of pictures" if is_folder else "film of frames",
        (
            Finding("evidence", text),
            *(one for one in stored.findings if one.notable),
            *first.findings[1:],
            *axes,
        ),
        (go_on,),
        first.micro_image_size,
        first.pitch_px,
        where=stored.where,
    )


def _is_film(stored: Stored) -> bool:
    """Whether pictures are compressed in blocks, as JPEG's are."""
    return stored.path.suffix.lower() in FILMS


def _sequence_of_views(stored: Stored, hints: Hints) -> LightFieldSource | None:
    """Pictures that are views one after the other, as their motion shows, or a person says."""
    count = stored.counts[0]
    if stored.kind == LONGER or (stored.path.is_dir() and stored.kind != RUNNING):
        return None
    layout = sequence_layout([stored.at((n,)).pixels for n in range(count)])
    finding = Finding("sequence", "")
    if layout is None:
        m = isqrt(count)
        is_square = m * m == count and m > 1
        if not is_square or (hints.micro_image != m and stored.kind != RUNNING):
            return None
        layout = SequenceLayout(m, m, "rows", serpentine=False)
        text = f"{m} x {m} views line by line by their number; their motion does not tell it"
        finding = Finding("sequence", text, "assumed", notable=hints.micro_image is None)
    else:
        # How lines lie and run is found as for views by any name.
        length = layout.columns if layout.order == "rows" else layout.rows
        if length < count:
            layout = SequenceLayout(count // length, length, "rows", serpentine=False)
        text = f"{count} views in one line, by their motion"
        if length < count:
            text = f"{count // length} lines of {length} views, by their motion"
        finding = Finding("sequence", text)
    if hints.micro_image not in (None, layout.rows) and hints.micro_image != layout.columns:
        raise InputError(
            f"{hints.micro_image} is not right: there are {layout.columns} x {layout.rows} views",
            where="micro_image",
        )
    numbers = {layout.place(n): n for n in range(count)}

    def load(progress: Progress) -> Picture:
        whole = stored.load(progress)
        views = np.empty((layout.rows, layout.columns, *whole.pixels.shape[1:]), whole.pixels.dtype)
        for place, n in numbers.items():
            views[place] = whole.pixels[n]
        return whole._replace(pixels=views)

    first = stored.at((0,))
    shape = first.pixels.shape
    text = f"{count} pictures of {shape[1]} x {shape[0]} pixels"
    kind: Kind = "folder of views" if stored.path.is_dir() else "sequence of views"
    return views_source(
        "video of views" if _is_film(stored) else kind,
        stored,
        hints,
        (layout.rows, layout.columns),
        (Finding("evidence", text), *picture_findings(first), finding),
        (command("develop", stored.path),),
        view=lambda v, u: stored.at((numbers[v, u],)),
        load=load,
    )


def _unknown_series(stored: Stored, hints: Hints) -> LightFieldSource:
    """Pictures that nothing is known of."""
    reasons = "; ".join(finding.text for finding in stored.findings)
    text = reasons or (
        f"{stored.counts[0]} pictures that are no captures, and no views, which would move along a "
        "line or in rows"
    )
    text = f"pictures, but no light field: {text}"
    return LightFieldSource(
        "can't tell", (Finding("evidence", text, "unknown"),), where=stored.where
    )


def _turned(decide: Classifier) -> Classifier:
    """What looks at a picture as its orientation says; captures stay as their sensor lies."""
    return lambda stored, hints: decide(stored.upright, hints)


CLASSIFIERS: dict[str, tuple[Classifier, ...]] = {
    "yx": (
        _calibrated,
        *map(_turned, (_by_hints, _quilt_by_name, _by_micro_image_size, _elemental)),
        _by_pixels,
    ),
    "vuyx": (_views,),
    "nyx": (_film_of_quilts, _frames, _sequence_of_views, _unknown_series),
}
"""What decides, by the axes of what is stored."""


def classify(stored: Stored, hints: Hints) -> LightFieldSource:
    """Tell the kind of stored pixels."""
    for name, value in (("white", hints.white), ("calib", hints.calib)):
        if value is not None and stored.axes != "yx":
            raise InputError(f"is not used for {stored.where}", where=name)
    if hints.dark is not None and (stored.axes != "yx" or not (hints.white or hints.calib)):
        raise InputError(f"is not used for {stored.where}", where="dark")
    # What a person or a name says goes before what pixels show: the order of CLASSIFIERS.
    for decide in CLASSIFIERS[stored.axes]:
        source = decide(stored, hints)
        if source is not None:
            return source
    raise AssertionError(f"no classifier for {stored.axes}")
