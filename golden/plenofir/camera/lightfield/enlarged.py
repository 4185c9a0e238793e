# SPDX-License-Identifier: Apache-2.0
"""Maps of the micro lenses at the sensor's pixels, their steps where the picture has its edges."""

import numpy as np
import numpy.typing as npt
from scipy import ndimage, sparse

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.disparity import Disparity
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

# Neighbours whose disparities differ by more than this, in pixels per view, are of two things.
_STEP = 0.1
# Micro lenses beyond the border that a spline of the third order can tell from its end, and so many
# apart that no place sees two of them.
_BESIDE, _APART = 12, 8
# Lines processed at once.
_LINES = 512
# Swings of splines count from half of the range of four lenses on, in full from all of it; those
# beyond 16 lenses count in full from a fortieth of their range on.
_SWINGS, _BEYOND = 2.0, 40.0
# Steps from a place in the picture to that in the central view, for even M.
_STEPS = 3


def places_in_view(
    disparity: Floats, micro_image_size: int, lines: npt.ArrayLike, columns: npt.ArrayLike
) -> Floats:
    """Where the central view sees pixels of a picture, in micro lenses, shape (2, lines, columns).

    Pictures are seen from the middle of the pupil. For even M the central view, whose disparity is
    known, is half a view beside it: what it sees at place s lies at s + disparity(s) / 2. The
    nearest thing hides others.
    """
    c = (micro_image_size - 1) / 2
    straight = [(np.asarray(k) - c) / micro_image_size for k in (lines, columns)]
    places = np.stack(np.meshgrid(*straight, indexing="ij"))
    beside = micro_image_size // 2 - c
    if beside:
        there = places
        around = 2 * int(np.ceil(beside * np.abs(disparity).max(initial=0))) + 1
        nearest = ndimage.maximum_filter(disparity, around, mode="nearest")
        for _ in range(_STEPS):
            here = ndimage.map_coordinates(nearest, places, order=1, mode="nearest")
            places, nearest = there - beside * here, disparity
    return np.asarray(places)


def at_sensor(
    view_map: Disparity, view: Image, micro_image_size: int, shape: tuple[int, int]
) -> Disparity:
    """A disparity map of the central view at the pixels of the raw image.

    Between micro lenses that see one thing it is linear. Between those that see two a pixel takes
    that of the lens which is likest to it in the central view, enlarged by cubic splines.

    `view_map`: map of the central view, shape (t, s). `view`: the central view, shape (t, s[, 3]).
    `micro_image_size`: M in pixels. `shape`: rows and columns of the raw image.
    """
    m = micro_image_size
    disparity = view_map.pixels_per_view
    view_grey = grey(view).astype(np.float64)
    spline = ndimage.spline_filter(view_grey, 3, np.float64, "nearest")
    values, confidence = np.empty(shape), np.empty(shape)
    for first in range(0, shape[0], _LINES):
        part = slice(first, min(first + _LINES, shape[0]))
        lines = np.arange(part.start, part.stop)
        places = places_in_view(disparity, m, lines, np.arange(shape[1]))
        large = ndimage.map_coordinates(spline, places, order=3, mode="nearest", prefilter=False)
        values[part] = _between(disparity, view_grey, large, places)
        confidence[part] = ndimage.map_coordinates(
            view_map.confidence, places, order=1, mode="nearest"
        )
    return Disparity(values, confidence)


def _between(disparity: Floats, view: Floats, large: Floats, places: Floats) -> Floats:
    """Disparity at places, from the four micro lenses around each."""
    corners = np.floor(places).astype(np.int64)
    mean = np.zeros(large.shape)
    low, high = np.full(large.shape, np.inf), np.full(large.shape, -np.inf)
    least, likest = np.full(large.shape, np.inf), np.zeros(large.shape)
    for down, right in np.ndindex(2, 2):
        place = corners + np.array([down, right])[:, np.newaxis, np.newaxis]
        shares = 1 - np.abs(places - place)
        y, x = (np.clip(k, 0, n - 1) for k, n in zip(place, view.shape, strict=True))
        value, share = disparity[y, x], shares[0] * shares[1]
        mean += share * value
        low, high = np.minimum(low, value), np.maximum(high, value)
        # The nearest of the lenses that are equally like the pixel.
        unlike = np.abs(view[y, x] - large) + 1 - share
        better = unlike < least
        least, likest = np.where(better, unlike, least), np.where(better, value, likest)
    return np.where(high - low <= _STEP, mean, likest)


def enlarged_view(view: Image, times: int) -> Image:
    """A view, a pixel for each micro lens, as large as the raw image, by cubic splines."""
    if times == 1:
        return view
    # Splines reach far: beyond the border they continue the pixels there.
    rows, columns = (
        lens_shares(times * lenses, lenses, times, 3)[times * _BESIDE : -times * _BESIDE]
        for lenses in (length + 2 * _BESIDE for length in view.shape[:2])
    )
    most = np.iinfo(view.dtype).max
    large = np.empty((rows.shape[0], columns.shape[0], *view.shape[2:]), view.dtype)
    for k, channel in enumerate(np.moveaxis(np.atleast_3d(view), 2, 0)):
        splines = ndimage.spline_filter(np.pad(channel, _BESIDE, mode="edge"), 3, np.float64)
        values = rows @ np.ascontiguousarray((columns @ splines.T).T)
        large.reshape(*large.shape[:2], -1)[..., k] = np.clip(np.rint(values), 0, most)
    return large


def lens_shares(pixels: int, lenses: int, m: int, order: int) -> sparse.csr_array:
    """Share of each micro lens in each pixel of a line, by splines; shape (pixels, lenses)."""
    places = (np.arange(pixels) - (m - 1) / 2) / m
    parts = []
    for first in range(min(_APART, lenses)):
        # Several lenses at once, so far apart that each pixel sees one of them at most.
        comb = np.zeros(lenses)
        comb[first::_APART] = 1
        shares = ndimage.map_coordinates(
            comb, [places], order=order, mode="nearest", prefilter=False
        )
        last = (lenses - 1 - first) // _APART
        used = first + _APART * np.clip(np.rint((places - first) / _APART), 0, last)
        there = np.flatnonzero(shares)
        parts.append((shares[there], there, used[there].astype(np.int64)))
    values, rows, columns = (np.concatenate(each) for each in zip(*parts, strict=True))
    return sparse.csr_array((values, (rows, columns)), (pixels, lenses))


class Cubics:
    """Cubics between the lines of a view: splines, or even ones, which never overshoot.

    Even ones have the slopes of the cubic spline, but not where that would leave the range of the
    two lines around (Hyman, SIAM J. Sci. Stat. Comput. 4, 1983).
    """

    def __init__(self, lines: Floats, *, even: bool) -> None:
        flat = lines.reshape(len(lines), -1)
        spline = ndimage.spline_filter1d(flat, 3, 0, np.float64, "nearest")
        beside = np.pad(spline, ((1, 1), (0, 0)), mode="edge")
        slopes = (beside[2:] - beside[:-2]) / 2
        steps = np.diff(flat, axis=0)
        if even:
            before, after = (np.pad(steps, ends) for ends in (((1, 0), (0, 0)), ((0, 1), (0, 0))))
            steepest = 3 * np.minimum(np.abs(before), np.abs(after)) * (before * after > 0)
            slopes = np.sign(before) * np.clip(np.sign(before) * slopes, 0, steepest)
        first, second = slopes[:-1], slopes[1:]
        bends = (3 * steps - 2 * first - second, first + second - 2 * steps)
        # The coefficients of the cubic from each line to the next.
        self._terms = [np.zeros_like(flat) for _ in range(4)]
        for term, values in zip(self._terms, (flat, first, *bends), strict=True):
            term[: len(values)] = values
        self._shape = lines.shape

    def at(self, places: Floats) -> Floats:
        """Lines at places; beyond the first and the last line is what they have."""
        places = np.clip(places, 0, self._shape[0] - 1)
        line = places.astype(np.int64)
        share = (places - line)[:, np.newaxis]
        result = self._terms[3][line]
        for term in self._terms[2::-1]:
            result *= share
            result += term[line]
        return np.asarray(result.reshape(len(places), *self._shape[1:]))


def ringing(view: Floats) -> Floats:
    """How far splines through a view, shape (t, s, channels), ring beside each lens: 0 to 1.

    After a step nearby splines still swing between four lenses: by more than half of the range of
    these lenses where the result is above 0, or beyond all 16 lenses around.
    """
    down, right = (np.arange(n - 1) + 0.5 for n in view.shape[:2])
    between = Cubics(view, even=False).at(down).swapaxes(0, 1)
    between = Cubics(between, even=False).at(right).swapaxes(0, 1)
    corners = [view[:-1, :-1], view[:-1, 1:], view[1:, :-1], view[1:, 1:]]
    low, high = np.minimum.reduce(corners), np.maximum.reduce(corners)
    shares = np.full(between.shape[:2], -1.0)
    for around, times, least in ((1, _SWINGS, 1.0), (3, _BEYOND, 0.0)):
        size = around, around, 1
        ends = ndimage.minimum_filter(low, size), ndimage.maximum_filter(high, size)
        beyond = np.abs(between - np.clip(between, *ends)).max(axis=2)
        span = np.maximum((ends[1] - ends[0]).max(axis=2), 1)
        shares = np.maximum(shares, times * beyond / span - least)
    cells = np.pad(np.clip(shares, 0, 1), 1)
    of_lenses = [cells[:-1, :-1], cells[:-1, 1:], cells[1:, :-1], cells[1:, 1:]]
    return np.asarray(np.maximum.reduce(of_lenses))
