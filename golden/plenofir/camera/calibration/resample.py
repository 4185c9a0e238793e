# SPDX-License-Identifier: Apache-2.0
"""From a raw capture to an aligned raster of M x M pixels for each micro lens.

One interpolation corrects rotation, pitch and the fractional part of each centre: pixel (v, u) of
lens (t, s) is the raw capture at

    centre(t, s) + (v - c) e_v + (u - c) e_u,    c = (M - 1) / 2

with e_v and e_u along the grid's axes. They are one pixel long, so micro images are cropped to M
pixels and the pixel pitch of the ray model stays what it is; or M steps to a pitch (scale "fit").
"""

from collections.abc import Callable
from typing import Literal, TypeVar

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.calibrate import unit_vectors
from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.frames import check_same_size, grey
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.record import PROFILE_REACH, Calibration
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Interpolation = Literal["nearest", "bilinear", "cubic"]
Scale = Literal["native", "fit"]

FloatType = TypeVar("FloatType", np.float32, np.float64)

_ORDERS = {"nearest": 0, "bilinear": 1, "cubic": 3}
DARKEST = 0.1
"""Darker parts of micro images than this share of the brightest are not brightened further."""

_BLOCK_PIXELS = 1 << 21
_LIT = 0.5
# Width in pixels of the border between micro images where the light of two lenses mixes.
_BETWEEN = 0.7


def raster_window(calibration: Calibration) -> tuple[slice, slice]:
    """Rows and columns of lenses that make up the raster: the grid without its ragged border.

    Result: largest part found (greedily, from the borders) in which every lens is in the image.
    """
    inside = calibration.inside
    top, bottom, left, right = 0, inside.shape[0], 0, inside.shape[1]
    while bottom - top > 1 and right - left > 1:
        part = inside[top:bottom, left:right]
        if part.all():
            break
        ends = (part[0], part[-1], part[:, 0], part[:, -1])
        worst = int(np.argmin([end.mean() for end in ends]))
        top, bottom = top + (worst == 0), bottom - (worst == 1)
        left, right = left + (worst == 2), right - (worst == 3)
    return slice(top, bottom), slice(left, right)


def _positions(
    calibration: Calibration, rows: slice, columns: slice, m: int, scale: Scale
) -> Floats:
    """Where the pixels of lenses lie in the raw capture, shape (2, rows, M, columns, M)."""
    grid = calibration.grid
    t, s = np.meshgrid(np.arange(rows.start, rows.stop), np.arange(columns.start, columns.stop))
    lattice = grid.lattice(t.T, s.T)
    vectors = grid.jacobian(lattice)
    down, right = unit_vectors(vectors)
    if scale == "fit":
        # In hexagonal grids the lenses' distance is that along the straight rows (columns).
        straight = {"hexagonal-rows": (1, 1), "hexagonal-columns": (0, 0)}
        axes = straight.get(grid.layout, (0, 1))
        lengths = np.linalg.norm(vectors, axis=-1) / m
        down = down * lengths[..., axes[0], np.newaxis]
        right = right * lengths[..., axes[1], np.newaxis]
    steps = np.arange(m) - (m - 1) / 2
    centres = grid.positions(lattice)[:, np.newaxis, :, np.newaxis]
    places = (
        centres
        + steps[:, np.newaxis, np.newaxis, np.newaxis] * down[:, np.newaxis, :, np.newaxis]
        + steps[:, np.newaxis] * right[:, np.newaxis, :, np.newaxis]
    )
    return np.moveaxis(places, -1, 0)


def profile_at(calibration: Calibration, m: int, scale: Scale) -> Floats:
    """Brightness of the M x M pixels of a micro image relative to its middle."""
    pitch = max(calibration.grid.pitch)
    step = 1 / m if scale == "fit" else 1 / pitch
    samples = len(calibration.profile)
    offsets = (np.arange(m) - (m - 1) / 2) * step / PROFILE_REACH
    place = (np.clip(offsets, -1, 1) + 1) / 2 * (samples - 1)
    grid = np.stack(np.meshgrid(place, place, indexing="ij"))
    return np.asarray(ndimage.map_coordinates(np.array(calibration.profile), grid, order=1))


def profile_around(calibration: Calibration, away: Floats) -> Floats:
    """Brightness at vectors (y, x) from the centre of a micro image, relative to its middle.

    `away`: in pixels, shape (..., 2).
    """
    down, right = unit_vectors(calibration.grid.vectors)
    profile = np.array(calibration.profile)
    along = np.stack([away @ down, away @ right]) / max(calibration.grid.pitch) / PROFILE_REACH
    size = np.array(profile.shape).reshape(2, *(1,) * (along.ndim - 1))
    place = (np.clip(along, -1, 1) + 1) / 2 * (size - 1)
    return np.asarray(ndimage.map_coordinates(profile, place, order=1))


def odd_size_within(pitch: float) -> int:
    """Largest odd number of pixels that receive the light of one lens only, from the pitch."""
    return max(1, int((pitch - _BETWEEN - 1) // 2 * 2 + 1))


def largest_odd_size(calibration: Calibration) -> int:
    """Largest odd number of pixels that a micro image has, 1 or more.

    Those along its middle row and column are lit at least half as brightly as its middle. Result: M
    in pixels.
    """
    m = odd_size_within(calibration.grid.lens_pitch)
    while m > 1:
        profile = profile_at(calibration, m, "native")
        c = m // 2
        if min(profile[c, 0], profile[c, -1], profile[0, c], profile[-1, c]) >= _LIT:
            break
        m -= 2
    return m


def check_micro_image_size(calibration: Calibration, m: int, scale: Scale) -> None:
    """Refuse micro image sizes that the calibration's grid cannot give."""
    if m < 1:
        raise InputError(f"M = {m}, but a micro image has at least 1 pixel")
    if scale not in ("native", "fit"):
        raise InputError(f"there is no scale {scale!r}; use native or fit")
    largest = int(np.ceil(max(calibration.grid.pitch)))
    if scale == "native" and m > largest:
        raise InputError(
            f"M = {m} is more than the micro images' pitch of "
            f"{max(calibration.grid.pitch):.3f} pixels; use at most {largest}, or scale "
            "fit"
        )
    if m > 4 * largest:
        raise InputError(f"M = {m} is too large for this calibration; use at most {4 * largest}")


def decode(
    raw: Image,
    calibration: Calibration,
    micro_image_size: int,
    *,
    dark: Image | None = None,
    white: Image | None = None,
    interpolation: Interpolation = "bilinear",
    scale: Scale = "native",
    devignette: bool = True,
    gains: tuple[float, float, float] | None = None,
    full_scale: int | None = None,
    where: str = "raw capture",
    progress: Callable[[int, int], None] | None = None,
) -> Image:
    """Resample a raw capture to micro images of M x M pixels.

    Result: raster of micro images, type and channels of `raw`, rows and columns multiples of M. A
    hexagonal grid is made rectangular (`hexagonal_to_rectangular`). Raises `InputError` if an image
    has another size than the calibration's, or M is too large.

    Parameters
    ----------
    raw
        Raw capture, grey or RGB, uint8 or uint16.
    micro_image_size
        M, odd or even.
    dark
        Dark frame; without one the calibration's dark level is subtracted.
    white
        White image, to divide by it pixel by pixel; without one the calibration's model of it is
        used. Each channel counts from its own brightest parts: vignetting goes, colours stay.
    interpolation
        "bilinear", "cubic" (B-splines), or "nearest": the nearest pixel, which rounds the centres
        of micro images (Fig. 4.12 a).
    scale
        "native": steps of one pixel, micro images are cropped. "fit": M steps to a pitch.
    devignette
        Whether to divide by the white image or its model at all.
    gains
        Factors of red, green and blue above black: white balance.
    full_scale
        Largest value of the capture, where results saturate; its type's largest if None.
    """
    m = micro_image_size
    check_micro_image_size(calibration, m, scale)
    if interpolation not in _ORDERS:
        raise InputError(
            f"there is no interpolation {interpolation!r}; use nearest, bilinear or cubic"
        )
    shape = calibration.image_shape
    check_same_size(raw, shape, where, "the calibration's white image")
    for image, name in ((dark, "dark frame"), (white, "white image")):
        if image is not None:
            check_same_size(image, shape, name, "the calibration's white image")
    rows, columns = raster_window(calibration)
    order = _ORDERS[interpolation]
    count = 1 if raw.ndim == 2 else raw.shape[2]
    levels = [np.array(calibration.dark_level, dtype=np.float32)] * count
    if dark is not None:
        levels = _channels(dark, count)
    sources = [_channels(raw, count), []]
    if white is not None and devignette:
        sources[1] = _channels(white, count)
    # Without a white image there is one brightness for all channels.
    sources = [
        [image - level for image, level in zip(images, levels, strict=False)] for images in sources
    ]
    tops = [max(float(np.percentile(image, 99.5)), 1.0) for image in sources[1]]
    if order > 1:
        sources = [
            [ndimage.spline_filter(image, order, np.float32, "mirror") for image in images]
            for images in sources
        ]
    height, width = rows.stop - rows.start, columns.stop - columns.start
    result = np.empty((height, m, width, m, len(sources[0])), dtype=np.float32)
    profile = profile_at(calibration, m, scale)[:, np.newaxis]
    brightness = calibration.lens_brightness[rows, columns]
    block = max(1, _BLOCK_PIXELS // (m * m * width))
    for start in range(0, height, block):
        part = slice(start, min(start + block, height))
        lens_rows = slice(rows.start + part.start, rows.start + part.stop)
        places = _positions(calibration, lens_rows, columns, m, scale)
        values, whites = (
            [
                ndimage.map_coordinates(image, places, order=order, mode="mirror", prefilter=False)
                for image in images
            ]
            for images in sources
        )
        for channel, value in enumerate(values):
            if devignette:
                if whites:
                    light = whites[channel] / tops[channel]
                else:
                    light = profile * brightness[part, np.newaxis, :, np.newaxis]
                value = value / np.maximum(light, DARKEST)
            if gains is not None and count == len(gains):
                value = value * np.float32(gains[channel])
            result[part, :, :, :, channel] = value
        if progress is not None:
            progress(part.stop, height)
    raster = _rectangular(result, calibration, rows, columns, order)
    limit = full_scale or np.iinfo(raw.dtype).max
    rounded = np.clip(np.floor(raster + 0.5), 0, limit).astype(raw.dtype)
    flat = rounded.reshape(rounded.shape[0] * m, rounded.shape[2] * m, -1)
    return np.asarray(flat if raw.ndim == 3 else flat[:, :, 0])


def _channels(image: Image, count: int) -> list[Image32]:
    """An image's channels, repeated for an RGB capture if it is grey."""
    if count == 1 or image.ndim == 2:
        return [grey(image)] * count
    return [image[:, :, k].astype(np.float32) for k in range(count)]


def _rectangular(
    samples: Image32, calibration: Calibration, rows: slice, columns: slice, order: int
) -> Image32:
    """Rectangular raster from the samples of any layout, shape (t, v, s, u, channels)."""
    grid = calibration.grid
    down, right = grid.pitch
    if grid.layout == "hexagonal-rows":
        first = (rows.start + grid.stagger) % 2
        return hexagonal_to_rectangular(samples, first, down / right, axis=2, order=order)
    if grid.layout == "hexagonal-columns":
        first = (columns.start + grid.stagger) % 2
        swapped = np.swapaxes(samples, 0, 2)
        swapped = hexagonal_to_rectangular(swapped, first, right / down, axis=2, order=order)
        return np.swapaxes(swapped, 0, 2)
    return samples


def hexagonal_to_rectangular(
    samples: npt.NDArray[FloatType],
    first_moved: int,
    step: float = np.sqrt(3) / 2,
    *,
    axis: int = 1,
    order: int = 1,
) -> npt.NDArray[FloatType]:
    """Resample the lenses of a hexagonal grid to a rectangular one (Eqs. 4.12, 4.13).

    Eq. (4.13) puts lens s of row t at 2 s + (t mod 2) of a raster twice as wide, and Eq. (4.12)
    makes that narrower by sqrt(3). Both happen in one interpolation along each row: column n of the
    result lies at n `step` of the row, and all its rows line up.

    Result: shape of `samples` with another length of that axis; column 0 lies half a pitch to the
    right of the rows that are not moved. Raises `InputError` if a row has fewer lenses than the
    interpolation takes.

    Parameters
    ----------
    samples
        Rows on axis 0, lenses of a row on another, shape (rows, ..., lenses, ...).
    first_moved
        Whether row 0 (1) or row 1 (0) begins half a pitch farther to the right.
    step
        Distance of rows over distance of lenses in a row: sqrt(3)/2 (Eq. 4.12).
    axis
        Axis of the lenses of a row.
    order
        0 for the nearest lens, 1 for linear interpolation, 3 for cubic splines.
    """
    # SciPy's splines take half a second to load.
    from scipy.interpolate import make_interp_spline

    lenses, fewest = samples.shape[axis], max(2, order + 1)
    if lenses < fewest:
        raise InputError(
            f"a hexagonal grid needs at least {fewest} lenses in a row for interpolation of order "
            f"{order}, this one has {lenses}"
        )
    # All rows cover the range from half a pitch to the last lens of the rows that are not moved.
    count = int(np.floor((lenses - 1.5) / step)) + 1
    places = 0.5 + step * np.arange(count)
    parts = []
    for parity in (0, 1):
        own = samples[parity::2]
        at = places - 0.5 * ((parity + first_moved) % 2)
        if order == 0:
            parts.append(own.take(np.floor(at + 0.5).astype(int), axis))
            continue
        spline = make_interp_spline(np.arange(lenses), own, k=order, axis=axis)
        parts.append(spline(at))
    shape = list(samples.shape)
    shape[axis] = count
    result = np.empty(shape, dtype=samples.dtype)
    result[0::2], result[1::2] = parts
    return result
