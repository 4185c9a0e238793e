# SPDX-License-Identifier: Apache-2.0
"""Recognise aligned rasters and mosaics of views by the borders between their parts.

In an aligned raster, differences between neighbouring pixels are different inside a micro image and
across a joint of two. So the differences of neighbouring columns have a period of exactly M, and so
have those of rows. In a mosaic of views, the parts look alike and meet in joints.
"""

from dataclasses import dataclass
from math import gcd

import numpy as np
from scipy import fft, ndimage

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.lattice import lattices

# Longer periods are rather content than micro images: windows of a house, tiles.
MAX_MICRO_IMAGE = 64
# How many times more of the differences a period explains than chance does.
_VERY_CLEAR, _CLEAR, _VISIBLE = 100.0, 20.0, 8.0
# With fewer repetitions chance looks like a period.
_FEWEST_PERIODS = 6
# Coherence of period M (1 if all phases are equal) from which the whole picture has that period.
COHERENT = 0.75
# Lenses along each side of the parts whose phases are compared.
_PART = 4
# A raster has a micro image's middle in the middle of its square; a crop of a capture may not.
_CENTRED_PX = 0.75
# A fractional period is nearly as clear at the neighbouring whole numbers; a true one is clearer by
# this factor.
_CLEARER = 1.5
# JPEG's blocks of 8 (16 with halved colours), their parts and multiples leave joints of their own.
_BLOCKS_OF_JPEG = {2, 4, 8, 16, 24, 32, 40, 48, 56, 64}
# Stanford's light fields have 17 x 17 views; more equal parts are rather a pattern.
_MOST_VIEWS = 21
_ALIKE = 0.7
_JOINT = 1.5
_MOST_DISPARITY = 0.12
_MOSAIC_SIDE = 1024
_SMALLEST_VIEW = 12
# Two equal halves are any picture that repeats once; a line of views needs a third.
_FEWEST_IN_LINE = 3

# Content repeats near the micro images' pitch: relative tolerance, least autocorrelation.
_NEAR_PITCH, _REPEATS = 0.15, 0.25


@dataclass(frozen=True)
class Period:
    """Period of the differences of neighbouring lines of a picture."""

    pixels: int
    clarity: float  # how many times more it explains than chance
    phase: int  # where in the period the differences are largest


@dataclass(frozen=True)
class Raster:
    """An aligned raster: M and how clearly both axes show it."""

    micro_image_size: int
    clarity: tuple[float, float]
    by: str


@dataclass(frozen=True)
class Mosaic:
    """Views side by side."""

    rows: int
    columns: int
    alike: float
    joints: float  # differences at the joints, as a multiple of those elsewhere


def _differences(grey: Image32, axis: int) -> Floats:
    """Mean difference of each line from the next, outliers cut."""
    step = np.diff(grey, axis=axis)
    np.abs(step, out=step)
    few = step[:: max(1, step.shape[0] // 1000), :: max(1, step.shape[1] // 1000)]
    np.minimum(step, np.percentile(few, 98), out=step)
    return np.asarray(step.mean(axis=1 - axis), np.float64)


def periods(grey: Image32, axis: int) -> list[Period]:
    """Periods of a picture's joints along an axis, the clearest first."""
    if min(grey.shape) < 2:
        return []
    lines = _differences(grey, axis)
    lines = np.log(lines + 1e-3 * lines.mean() + 1e-9)
    candidates = []
    for m in range(2, min(MAX_MICRO_IMAGE, len(lines) // _FEWEST_PERIODS) + 1):
        rows = len(lines) // m
        folded = lines[: rows * m].reshape(rows, m)
        folded = folded - folded.mean(axis=1, keepdims=True)
        mean = folded.mean(axis=0)
        explained = (mean**2).sum() * rows / (m - 1)
        noise = ((folded - mean) ** 2).sum() / ((rows - 1) * (m - 1))
        candidates.append(Period(m, float(explained / max(noise, 1e-30)), int(np.argmax(mean))))
    return sorted(candidates, key=lambda period: -period.clarity)


def find_raster(grey: Image32, *, is_jpeg: bool = False) -> Raster | None:
    """Tell whether a picture consists of micro images of exactly M x M pixels, on both axes.

    A JPEG has blocks of 8 x 8 pixels of its own.
    """
    along = [periods(grey, axis) for axis in (0, 1)]
    if not all(along):
        return None
    first, second = along[0][0], along[1][0]
    m = first.pixels
    if m != second.pixels or m == 2 or (is_jpeg and m in _BLOCKS_OF_JPEG):
        return None
    clarity = first.clarity, second.clarity
    if min(clarity) > _CLEAR and first.phase == second.phase == m - 1:
        return Raster(m, clarity, "joints between micro images")
    near = [period for line in along for period in line if abs(period.pixels - m) == 1]
    whole = min(clarity) > _CLEARER * max((period.clarity for period in near), default=0.0)
    # With stray light, rims of micro images may be brighter than their middle.
    edges = {0, m - 2, m - 1}
    rims = {first.phase, second.phase} <= edges and min(clarity) > _VERY_CLEAR
    even = rims or (_centred(grey, m) and coherence(grey, m) > COHERENT)
    if min(clarity) > _VISIBLE and whole and even and _repeats(grey, m):
        return Raster(m, clarity, "rims of micro images")
    return None


def coherence(levels: Image32, micro_image_size: int) -> float:
    """How well phases at period M agree all over a picture, 0 to 1; the lower of both axes.

    They are constant in an aligned raw image, and drift if the micro images have another pitch.
    """
    m = micro_image_size
    side = _PART * m
    rows, columns = (n // side for n in levels.shape)
    if min(rows, columns) < 2:
        return 1.0
    parts = levels[: rows * side, : columns * side].reshape(rows, side, columns, side)
    wave = np.exp(-2j * np.pi * np.arange(side) / m).astype(np.complex64)
    coherences = []
    for axis in (1, 3):
        lines = parts.mean(axis=4 - axis, dtype=np.float32)
        waves = lines.transpose(0, 2, 1) @ wave if axis == 1 else lines @ wave
        coherences.append(float(np.abs(waves.sum()) / max(float(np.abs(waves).sum()), 1e-30)))
    return min(coherences)


def _centred(grey: Image32, m: int) -> bool:
    """Whether the mean micro image is brightest about its middle."""
    rows, columns = (n // m for n in grey.shape)
    mean = grey[: rows * m, : columns * m].reshape(rows, m, columns, m).mean(axis=(0, 2))
    light = mean - mean.min()
    if light.max() < 0.02 * mean.max():
        return False
    places = np.arange(m) - (m - 1) / 2
    centre = np.array([light.sum(axis=1) @ places, light.sum(axis=0) @ places]) / light.sum()
    return bool(np.abs(centre).max() < _CENTRED_PX)


def _repeats(grey: Image32, m: int) -> bool:
    """Whether the picture repeats at about this pitch in both directions."""
    for lattice in lattices(grey)[:3]:
        pitch = float(np.sqrt(abs(np.linalg.det(lattice.vectors))))
        if lattice.score > _REPEATS and abs(pitch / m - 1) < _NEAR_PITCH:
            return True
    return False


def find_mosaic(grey: Image32) -> Mosaic | None:
    """Whether a picture consists of similar pictures side by side, above each other, or both.

    There are 2 rows and columns of them or more, or one line of 3 or more.
    """
    scale = max(1, max(grey.shape) // _MOSAIC_SIDE)
    rows, columns = (n // scale * scale for n in grey.shape)
    small = grey[:rows, :columns].reshape(rows // scale, scale, -1, scale).mean(axis=(1, 3))
    small = small - ndimage.gaussian_filter(small, max(small.shape) / 30)
    power = np.abs(fft.rfft2(small, s=[2 * n for n in small.shape])) ** 2
    whole = fft.irfft2(power)
    if whole[0, 0] <= 0:
        return None
    counts, alike = [], []
    for axis in (0, 1):
        # Groups of several parts are alike too, so only numbers with joints between parts count.
        parts = _alike_parts(whole, small.shape, grey.shape[axis], scale, axis)
        count = max((n for n in parts if _joints(grey, n, axis) > _JOINT), default=None)
        counts.append(count or 1)
        if count is not None:
            alike.append(parts[count])
    if max(counts) < (2 if min(counts) > 1 else _FEWEST_IN_LINE) or _has_tiles(grey, counts):
        return None
    joints = [_joints(grey, count, axis) for axis, count in enumerate(counts) if count > 1]
    return Mosaic(counts[0], counts[1], min(alike), min(joints))


def _has_tiles(grey: Image32, counts: list[int]) -> bool:
    """Whether joints divide the parts of a picture too, alike on both axes: micro images.

    Blocks of a JPEG divide parts too, and do not count.
    """
    sides = [n // count for n, count in zip(grey.shape, counts, strict=True) if count > 1]
    common = gcd(*grey.shape, *sides)
    most = min(common, min(sides) - 1, MAX_MICRO_IMAGE)
    tiles = {tile for tile in range(3, most + 1) if common % tile == 0}
    return any(
        all(_joints(grey, grey.shape[k] // tile, k, counts[k]) > _JOINT for k in (0, 1))
        for tile in tiles - _BLOCKS_OF_JPEG
    )


def _alike_parts(
    whole: Floats, shape: tuple[int, ...], length: int, scale: int, axis: int
) -> dict[int, float]:
    """Possible numbers of similar parts along an axis, and the similarity of neighbours."""
    shares = {}
    for count in range(2, _MOST_VIEWS + 1):
        if length % count or length // count < _SMALLEST_VIEW:
            continue
        side = length / count / scale
        reach = int(max(1, _MOST_DISPARITY * side))
        lags = np.arange(int(side) - reach, int(side) + reach + 1)
        across = np.arange(-reach, reach + 1)
        part = whole[np.ix_(lags, across)] if axis == 0 else whole[np.ix_(across, lags)]
        overlap = 1 - lags / shape[axis]
        share = part / whole[0, 0] / (overlap[:, np.newaxis] if axis == 0 else overlap)
        if share.max() > _ALIKE:
            shares[count] = float(share.max())
    return shares


def _joints(grey: Image32, count: int, axis: int, within: int = 1) -> float:
    """Differences at the joints of parts, as a multiple of those elsewhere.

    `within`: a number of larger parts, the joints of which count as neither.
    """
    lines = _differences(grey, axis)
    at, larger = (np.arange(1, n) * (grey.shape[axis] // n) - 1 for n in (count, within))
    others = np.delete(lines, np.union1d(at, larger))
    at = np.setdiff1d(at, larger)
    return float(np.median(lines[at]) / max(float(np.median(others)), 1e-9))
