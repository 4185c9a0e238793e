# SPDX-License-Identifier: Apache-2.0
"""Kind of a picture: a white image, a raw capture, a raster, a mosaic of views, or none of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.frames import grey as grey_levels
from plenofir.camera.calibration.inspection import LARGEST_UNEVENNESS, inspect_white
from plenofir.camera.calibration.lattice import Lattice, lattices
from plenofir.camera.calibration.resample import odd_size_within
from plenofir.camera.captures.colours import even_mosaic, noticed_mosaic
from plenofir.camera.patterns.lenslets import (
    SURE,
    Lenslets,
    find_lenslets,
    repetition,
    unevenness_of_light,
    unevenness_of_neighbours,
)
from plenofir.camera.patterns.rasters import find_mosaic, find_raster
from plenofir.camera.recognise.source import Finding, LightFieldSource
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir.ground.shell import command
from plenofir.refocus.operator import Image

# A part bounds time and memory: what repeats in the picture repeats there, too.
LARGEST_SIDE = 8192
# Vignetting is least in the middle, and the size bounds the time of the transforms.
_MIDDLE = 768
_SMALLEST_SIDE = 32
# Noise of an even picture repeats somewhere: without contrast no lattice is believed.
_LEAST_CONTRAST = 0.01
# Lattice scores: below the first, repetitions are ignored; from the second on, as in a white image.
_LEAST_SCORE, _LIKE_WHITE = 0.15, 0.35
# Pitch in pixels from which on lattices are looked for without a finer version of the picture.
_LARGE_PITCH = 8.0
# Largest relative difference of neighbouring micro images in a white image.
_EVEN = 0.04
_LEAST_STRENGTH = 0.05
_SAME_LEVEL = 0.9


def recognise_picture(picture: Picture, name: str, *, is_jpeg: bool = False) -> LightFieldSource:
    """Recognise a picture; "can't tell" where the evidence is thin."""
    image = picture.pixels
    rows, columns = image.shape[:2]
    size = Finding("size", f"{columns} x {rows} pixels", "told")
    part = image[:LARGEST_SIDE, :LARGEST_SIDE]
    if part.shape != image.shape:
        size = Finding(
            "size", f"{size.text}; looked at the first {part.shape[1]} x {part.shape[0]}"
        )
    if min(rows, columns) < _SMALLEST_SIDE:
        return LightFieldSource(
            "can't tell", (size, Finding("evidence", "too small to see a pattern in"))
        )
    levels = grey_levels(part)
    contrast = float(levels.std() / max(picture.full_scale, 1))
    if contrast < _LEAST_CONTRAST and levels.std() < 0.2 * max(float(levels.mean()), 1.0):
        text = f"hardly any contrast ({100 * contrast:.2f} % of full scale): a dark frame?"
        return LightFieldSource("can't tell", (size, Finding("evidence", text)))
    raster = find_raster(levels, is_jpeg=is_jpeg)
    if raster is not None:
        return _raster(part, raster.micro_image_size, raster.by, raster.clarity, size, name)
    orders = (picture.mosaic,) if picture.mosaic else noticed_mosaic(part)
    if not orders:
        return _by_lenses(picture, levels, size, name)
    even = even_mosaic(image, picture.full_scale)
    levels = grey_levels(even[:LARGEST_SIDE, :LARGEST_SIDE])
    source = _by_lenses(picture._replace(pixels=even), levels, size, name)
    text = f"a mosaic, {orders[0].upper()} by its file"
    if not picture.mosaic:
        text = (
            f"a mosaic, noticed in its pixels; its order is told by --bayer {' or '.join(orders)}"
        )
    colours = Finding("colours", text, notable=not picture.mosaic)
    return replace(source, findings=(source.findings[0], colours, *source.findings[1:]))


def _by_lenses(picture: Picture, levels: Image32, size: Finding, name: str) -> LightFieldSource:
    """Recognise a picture that is no raster, by what repeats in its grey levels."""
    whole = levels.shape == picture.pixels.shape[:2]
    # Lenses show everywhere, so the middle is enough for them.
    inner = levels[middle(levels.shape)]
    guesses = _lattices(inner)
    if not guesses or guesses[0].score < _LEAST_SCORE:
        return _mosaic(levels, whole, size, name) or _none(size)
    lenses = find_lenslets(inner, guesses)
    few = guesses[0].score > _LIKE_WHITE and 4 * _pitch(guesses[0]) < min(inner.shape)
    even = lenses is None or (
        unevenness_of_neighbours(inner, lenses.grid) < _EVEN
        and unevenness_of_light(inner, lenses.grid) < 2 * LARGEST_UNEVENNESS
    )
    if (few or lenses is not None) and even:
        white = _white(picture, name, size)
        if white is not None:
            return white
    is_sure = lenses is not None and lenses.match.agreement > SURE
    repeated = repetition(levels, guesses[0], lenses.grid if lenses and is_sure else None)
    if lenses is not None and lenses.match.strength > _LEAST_STRENGTH:
        agrees = is_sure and repeated is not None and repeated.of_lenses(lenses.grid)
        if repeated is None or repeated.even or not repeated.all_over or agrees:
            return _capture(lenses, size, name)
        return _focused(repeated.smallest, repeated.largest, lenses.match.agreement, size, name)
    if repeated is not None and repeated.all_over and not repeated.even:
        return _focused(repeated.smallest, repeated.largest, None, size, name)
    mosaic = _mosaic(levels, whole, size, name)
    if mosaic is not None:
        return mosaic
    if (repeated is not None and repeated.all_over) or few:
        pitch = _pitch(guesses[0])
        pitches = (repeated.smallest, repeated.largest) if repeated is not None else (pitch, pitch)
        text = (
            f"it repeats every {pitches[0]:.1f} to {pitches[1]:.1f} pixels, but too little speaks "
            "for a regular grid of micro images"
        )
        return LightFieldSource("can't tell", (size, Finding("evidence", text)))
    return _none(size)


def _lattices(inner: Image32) -> list[Lattice]:
    """Lattices of a picture; those of small pitches only where no clear one is large.

    A lattice of some pixels would have been seen beside its sublattices; to look for smaller ones
    takes most of the time.
    """
    coarse = lattices(inner, smallest_pitch=_LARGE_PITCH)
    if coarse and coarse[0].score > _LIKE_WHITE and _pitch(coarse[0]) > _LARGE_PITCH:
        return coarse
    return lattices(inner)


def middle(shape: tuple[int, ...]) -> tuple[slice, slice]:
    """The middle of a picture, where lenses are looked for."""
    rows, columns = (slice(max(0, n - _MIDDLE) // 2, (n + _MIDDLE + 1) // 2) for n in shape[:2])
    return rows, columns


def _none(size: Finding) -> LightFieldSource:
    """A picture without any sign of a light field."""
    text = (
        "no joints with a period of 3 to 64 pixels, no micro images of 2.8 pixels or more, no "
        "alike parts side by side"
    )
    return LightFieldSource("no light field", (size, Finding("evidence", text)))


def _mosaic(levels: Image32, whole: bool, size: Finding, name: str) -> LightFieldSource | None:
    """A mosaic of views; None for something else, or for a part of a picture."""
    mosaic = find_mosaic(levels) if whole else None
    if mosaic is None:
        return None
    rows, columns = levels.shape
    view = f"{columns // mosaic.columns} x {rows // mosaic.rows} pixels"
    text = (
        f"{mosaic.columns} x {mosaic.rows} parts of {view}, neighbours alike (correlation "
        f"{mosaic.alike:.2f}), with joints between them ({mosaic.joints:.1f} times the "
        "differences elsewhere)"
    )
    m = mosaic.rows if mosaic.rows == mosaic.columns else None
    advice = command("develop", Path(name))
    if m is not None:
        advice = command(
            "compose", Path(name), "--layout", "mosaic", "-M", m, "--out", "aligned.png"
        )
    return LightFieldSource(
        "mosaic of views",
        (size, Finding("evidence", text)),
        (advice,),
        m,
        counts=(mosaic.rows, mosaic.columns),
    )


def is_mosaic(image: Image, m: int) -> tuple[int, int] | None:
    """Rows and columns of a mosaic of views, if they are M; the image has no micro images."""
    levels = grey_levels(image[:LARGEST_SIDE, :LARGEST_SIDE])
    if levels.shape != image.shape[:2]:
        return None
    mosaic = find_mosaic(levels)
    if mosaic is None or m not in (mosaic.rows, mosaic.columns):
        return None
    return mosaic.rows, mosaic.columns


def _pitch(lattice: Lattice) -> float:
    """Side of a square as large as a lattice's cell."""
    return float(np.sqrt(abs(np.linalg.det(lattice.vectors))))


def is_flat(image: Image, m: int) -> bool:
    """Whether a picture consists of blocks of M x M equal pixels, as refocusing makes them."""
    rows, columns = image.shape[0] // m, image.shape[1] // m
    # One line of each row of blocks tells.
    lines = image[m // 2 : rows * m : m, : columns * m]
    equal = lines[:, 1:] == lines[:, :-1]
    return float(equal[:, np.arange(1, columns * m) % m != 0].mean()) > _SAME_LEVEL


def _raster(
    image: Image, m: int, by: str, clarity: tuple[float, float], size: Finding, name: str
) -> LightFieldSource:
    """An aligned raster, or what refocusing left of one."""
    rows, columns = image.shape[0] // m, image.shape[1] // m
    if is_flat(image, m):
        text = f"blocks of {m} x {m} equal pixels: a slice that was refocused, or scaled up"
        return LightFieldSource("refocused picture", (size, Finding("evidence", text)))
    text = (
        f"period of exactly {m} pixels in both directions, by the {by} "
        f"({min(clarity):.0f} times what chance gives): {columns} x {rows} micro images"
    )
    advice = (
        command("refocus", Path(name), "-M", m, "-a", 0),
        command("stack", Path(name), "-M", m, "-a", "-1:1", "--all-in-focus"),
    )
    return LightFieldSource("aligned raster", (size, Finding("evidence", text)), advice, m)


def _white(picture: Picture, name: str, size: Finding) -> LightFieldSource | None:
    """A white image, or None."""
    part = picture.like(picture.pixels[middle(picture.pixels.shape)])
    try:
        if part.pixels.shape != picture.pixels.shape:
            # Only what is white there is looked at as a whole, which takes longer.
            inspect_white(part.pixels, full_scale=picture.full_scale, where=name)
        inspection = inspect_white(picture.pixels, full_scale=picture.full_scale, where=name)
    except InputError:
        return None
    pitch = inspection.calibration.grid.lens_pitch
    text = f"a regular grid, evenly lit: lenses differ by {100 * inspection.unevenness:.1f} %"
    advice = command("calibrate", Path(name), "--out", "calib.json")
    evidence = (size, Finding("evidence", text))
    return LightFieldSource("white image", evidence, (advice,), pitch_px=pitch, white=inspection)


def _capture(lenses: Lenslets, size: Finding, name: str) -> LightFieldSource:
    """A raw capture of a standard camera."""
    text = (
        f"micro images brighter in their middle, {lenses.pitch:.2f} pixels apart, {lenses.layout}, "
        f"rotated by {lenses.rotation_degrees:.2f} degrees, all over the picture (agreement "
        f"{lenses.evidence:.2f}, contrast {100 * lenses.match.strength:.0f} %)"
    )
    m = max(3, odd_size_within(lenses.pitch))
    advice = (
        command("calibrate", "WHITE_IMAGE", "--out", "calib.json"),
        command(*("decode", Path(name), "--calib", "calib.json", "-M", m, "--out", "aligned.png")),
    )
    return LightFieldSource(
        "raw capture", (size, Finding("evidence", text)), advice, pitch_px=lenses.pitch
    )


def _focused(
    smallest: float, largest: float, agreement: float | None, size: Finding, name: str
) -> LightFieldSource:
    """A raw capture whose content repeats at pitches of its own."""
    text = (
        f"it repeats all over, every {smallest:.1f} to {largest:.1f} pixels: content that lenses "
        "see with parallax, not the lenses themselves"
    )
    if agreement is not None:
        text += f" (agreement with one grid {agreement:.2f})"
    advice = (
        command("calibrate", "WHITE_IMAGE", "--lens-types", Path(name), "--out", "calib.json"),
        command("develop", Path(name), "--calib", "calib.json"),
    )
    return LightFieldSource(
        "raw capture of a focused (2.0) camera", (size, Finding("evidence", text)), advice
    )
