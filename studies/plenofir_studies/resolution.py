# SPDX-License-Identifier: Apache-2.0
"""Resolution of refocused pictures (Figs. 6.12 and 6.13 of the thesis).

A slanted edge is placed where the ray model has it in focus. The refocused picture's edge spread
function, gathered from all lines, gives the modulation transfer function (the method of ISO 12233).
Frequencies are in cycles per micro lens: 0.5 is the Nyquist frequency of one sample per micro lens.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.lightfield import views
from plenofir.camera.rays import RayModel, load_camera
from plenofir.refocus import gather_sums, output_offset, refocus
from plenofir.refocus.operator import Image
from plenofir_studies.experiments import CAMERA
from plenofir_studies.synthetic.render import TexturedPlane, field_of_view, render, with_pitch

Floats = npt.NDArray[np.float64]
Pixels = TypeVar("Pixels", Image, Floats)

INTERPOLATIONS = {"nearest": 0, "linear": 1, "cubic": 3}
"""Ways to interpolate pictures of one value for each micro lens, and their spline's order."""
EDGE_DEGREES = 5.0
"""Slant of the edge against the columns."""
_LENSES = 41
_TEXTURE = 1212
# Texture on both sides of what the camera sees, in micro lenses.
_SPARE = 30
_BINS = 16


def aligned_model(m: int) -> RayModel:
    """The thesis's camera with micro images of exactly M pixels: raw captures need no decoding."""
    return with_pitch(RayModel.focused(load_camera(CAMERA), inf, m), float(m))


def capture(m: int, a: Fraction, texture: Image | Floats, lenses: int = _LENSES) -> Image:
    """Raw image, 16 bit, of a plane that is in focus at a: an aligned raster.

    `lenses` in each dimension are an odd number. The middle of the square texture is on the
    optical axis; it is `_SPARE` micro lenses larger on each side.
    """
    model = aligned_model(m)
    distance = float(model.distance(float(a)).mm)
    width = field_of_view(model, distance, lenses + 2 * _SPARE)
    plane = TexturedPlane(texture, distance, width)
    return render(
        model, [plane], (lenses, lenses), form="square", radius=1.0, level=0.8, bits=16
    ).raw


def slanted_edge(degrees: float = EDGE_DEGREES) -> Floats:
    """Dark left of a line through the middle, bright right of it; its edge is one pixel wide."""
    place = np.arange(_TEXTURE) - (_TEXTURE - 1) / 2
    y, x = np.meshgrid(place, place, indexing="ij")
    angle = np.radians(degrees)
    across = x * np.cos(angle) + y * np.sin(angle)
    return np.asarray(np.clip(across + 0.5, 0, 1) * 0.6 + 0.2)


@dataclass(frozen=True)
class Transfer:
    """Modulation transfer of a picture across its edge."""

    frequency: npt.NDArray[np.floating[Any]]  # cycles a micro lens
    contrast: Floats  # 1 at frequency 0

    @property
    def half(self) -> float:
        """Lowest frequency at which half of the contrast is left."""
        low = int(np.argmax(self.contrast < 0.5))
        if self.contrast[low] >= 0.5:
            return float("nan")
        x, y = self.frequency[low - 1 : low + 1], self.contrast[low - 1 : low + 1]
        return float(x[0] + (y[0] - 0.5) / (y[0] - y[1]) * (x[1] - x[0]))

    def at(self, frequency: float) -> float:
        return float(np.interp(frequency, self.frequency, self.contrast))


def edge_places(picture: Image | Floats) -> Floats:
    """Position of the edge in each line, with sub-pixel accuracy.

    The picture is dark on the left. The position is the centroid of the line's rise, which is least
    affected by noise.
    """
    lines = np.asarray(picture, dtype=np.float64)
    rise = np.diff(lines, axis=1)
    columns = np.arange(rise.shape[1]) + 0.5
    # Far from the edge there is only noise.
    coarse = ndimage.uniform_filter1d(rise, 9, axis=1)
    middle = columns[np.argmax(coarse, axis=1)]
    reach = rise.shape[1] / 4
    weight = np.where(np.abs(columns - middle[:, np.newaxis]) < reach, rise, 0.0)
    return np.asarray((weight * columns).sum(axis=1) / weight.sum(axis=1))


def transfer(picture: Image | Floats, pixels_a_lens: float) -> Transfer:
    """Modulation transfer function by a slanted, nearly vertical edge, to two cycles a lens."""
    lines = np.asarray(picture, dtype=np.float64)
    rows = np.arange(lines.shape[0])
    slope, start = np.polyfit(rows, edge_places(lines), 1)
    across = (np.arange(lines.shape[1]) - (start + slope * rows)[:, np.newaxis]) * np.cos(
        np.arctan(slope)
    )
    across = across / pixels_a_lens
    reach = min(-float(across[:, 0].max()), float(across[:, -1].min()))
    bins = np.round(across * _BINS).astype(int)
    last = int(reach * _BINS) - 1
    used = np.abs(bins) <= last
    places = bins[used] + last
    count = np.bincount(places, minlength=2 * last + 1)
    total = np.bincount(places, lines[used], minlength=2 * last + 1)
    filled = count > 0
    spread = np.interp(
        np.arange(2 * last + 1), np.flatnonzero(filled), total[filled] / count[filled]
    )
    line = np.diff(spread) * np.hanning(2 * last)
    spectrum = np.abs(np.fft.rfft(line))
    frequency = np.fft.rfftfreq(len(line), 1 / _BINS)
    # Corrects for the filter that differences of neighbouring bins are.
    sampling = np.sinc(frequency / _BINS)
    passband = frequency <= 2
    contrast = spectrum[passband] / spectrum[0] / sampling[passband]
    return Transfer(frequency[passband], np.asarray(contrast))


def inside(picture: Pixels, border: int) -> Pixels:
    """A picture without its borders."""
    return picture[border : picture.shape[0] - border, border : picture.shape[1] - border]


def enlarged(picture: Floats, factor: int, order: int) -> Floats:
    """Interpolate a picture to `factor` times its size by splines, pixel centres kept.

    Orders are 0 (repeats), 1 (linear) or 3 (cubic).
    """
    places = [(np.arange(factor * n) - (factor - 1) / 2) / factor for n in picture.shape]
    if order == 0:
        return np.asarray(picture.repeat(factor, 0).repeat(factor, 1))
    grid = np.stack(np.meshgrid(*places, indexing="ij"))
    return np.asarray(ndimage.map_coordinates(picture, grid, order=order, mode="nearest"))


def interpolated_before(raw: Image, m: int, shift: int, order: int) -> Floats:
    """Views enlarged M times (M odd), then shifted by a' (u - c) pixels and averaged."""
    images, c = views(raw, m), (m - 1) // 2
    total = np.zeros(raw.shape)
    for v in range(m):
        for u in range(m):
            large = enlarged(images[v, u].astype(np.float64), m, order)
            total += ndimage.shift(large, (shift * (v - c), shift * (u - c)), order=0)
    return total / (m * m)


def interpolated_after(raw: Image, m: int, shift: int, order: int) -> Floats:
    """One value for each micro lens, for integer a the refocused one, then enlarged M times.

    Parameters and result as `interpolated_before`. For other a a micro lens gets the mean of its
    refocused pixels.
    """
    fine = interpolated_before(raw, m, shift, 0)
    rows, columns = (n // m for n in raw.shape)
    lenses = fine.reshape(rows, m, columns, m).mean(axis=(1, 3))
    return enlarged(lenses, m, order)


def row_stage(raw: Image, m: int, shift: int) -> Image:
    """Output of the row stage (Figs. 6.12 a and b): refocused along rows only, rounded."""
    offset = output_offset(m, shift, "centred")
    sums = gather_sums(raw, m, shift, axis=1, offset=offset)
    return ((2 * sums + m) // (2 * m)).astype(raw.dtype)


def values_a_lens(picture: Image, m: int) -> float:
    """Share of neighbours in a row, inside M x M blocks, that differ; 0 if all blocks are even."""
    rows, columns = (n // m * m for n in picture.shape[:2])
    lenses = picture[:rows, :columns].reshape(rows, columns // m, m)
    return float((np.diff(lenses.astype(np.int64), axis=2) != 0).mean())


def edge_jaggedness(picture: Image | Floats, pixels_a_lens: float) -> float:
    """Distance of a straight edge's lines from a straight line, root mean square, in micro lenses.

    An edge that each line rounds to whole micro lenses has 1 / sqrt(12).
    """
    places = edge_places(picture)
    rows = np.arange(len(places))
    off = places - np.polyval(np.polyfit(rows, places, 1), rows)
    return float(np.sqrt(np.mean(off**2))) / pixels_a_lens


def grating(frequency: float, lenses: int = _LENSES) -> Floats:
    """Vertical stripes of a number of cycles a micro lens, seen by `capture`."""
    step = (lenses + 2 * _SPARE) / _TEXTURE
    x = (np.arange(_TEXTURE) - (_TEXTURE - 1) / 2) * step
    return np.asarray(np.tile(0.5 + 0.3 * np.cos(2 * np.pi * frequency * x), (_TEXTURE, 1)))


def alias(m: int, shift: int, frequency: float = 0.7) -> float:
    """Aliasing of stripes above the Nyquist frequency of one sample per micro lens.

    The stripes, of more than half a cycle per micro lens, are in focus at a'. Result: the amplitude
    at the alias frequency, 1 - frequency, over that at the frequency itself.
    """
    a = Fraction(shift, m)
    picture = refocus(capture(m, a, grating(frequency)), m, a)
    part = inside(picture, _border(m, shift)).astype(np.float64)
    x = (np.arange(part.shape[1]) - (part.shape[1] - 1) / 2) / m
    line = (part.mean(axis=0) - part.mean()) * np.hanning(len(x))
    right, wrong = (
        abs(np.sum(line * np.exp(-2j * np.pi * f * x))) for f in (frequency, 1 - frequency)
    )
    return float(wrong / right)


@dataclass(frozen=True)
class Detail:
    """Detail of an edge that is in focus at a."""

    m: int
    shift: int  # a'
    differing: float  # share of neighbouring pixels inside micro images that differ
    transfer: Transfer
    jaggedness: float  # of the edge, micro lenses
    alias: float  # see `alias`


def _border(m: int, shift: int) -> int:
    """Pixels at each border with missing views, and some more, a multiple of M."""
    return m * (-(-abs(shift) * (m - 1) // (2 * m)) + 3)


def edge_detail(m: int, shift: int) -> Detail:
    """Capture a slanted edge in focus at a'/M, and refocus to it by nearest neighbour."""
    a = Fraction(shift, m)
    picture = refocus(capture(m, a, slanted_edge()), m, a)
    part = inside(picture, _border(m, shift))
    return Detail(
        m,
        shift,
        values_a_lens(part, m),
        transfer(part, m),
        edge_jaggedness(part, m),
        alias(m, shift),
    )


@dataclass(frozen=True)
class BeforeAfter:
    """Interpolation of whole micro images before refocusing, and of the refocused picture."""

    shift: int  # a'
    order: int
    difference: float  # largest, in grey levels of 255
    before: float  # frequency at which half of the contrast is left, cycles a micro lens
    after: float


def before_and_after(m: int, shift: int, order: int) -> BeforeAfter:
    """Refocus a slanted edge in focus at a'/M both ways."""
    raw = capture(m, Fraction(shift, m), slanted_edge())
    both = [way(raw, m, shift, order) for way in (interpolated_before, interpolated_after)]
    border = _border(m, shift) + 3 * m
    before, after = (inside(picture, border) for picture in both)
    difference = float(np.abs(before - after).max()) / np.iinfo(raw.dtype).max * 255
    return BeforeAfter(shift, order, difference, transfer(before, m).half, transfer(after, m).half)


def central_directions(raw: Image, m: int, keep: int) -> Image:
    """Keep the central `keep` x `keep` pixels of each micro image."""
    rows, columns = (length // m for length in raw.shape[:2])
    lenses = raw[: rows * m, : columns * m].reshape(rows, m, columns, m, *raw.shape[2:])
    low = (m - keep) // 2
    kept = lenses[:, low : low + keep, :, low : low + keep]
    return kept.reshape(rows * keep, columns * keep, *raw.shape[2:])
