# SPDX-License-Identifier: Apache-2.0
"""Focal stacks, how sharp their parts are, and the picture that is sharp everywhere."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.disparity import Disparity, search_disparity
from plenofir.camera.lightfield.enlarged import Cubics, lens_shares, places_in_view, ringing
from plenofir.camera.lightfield.indexing import sub_aperture
from plenofir.camera.lightfield.small_boxes import even, lattice, smaller
from plenofir.ground.errors import InputError
from plenofir.refocus import (
    Border,
    Interpolation,
    Sharpen,
    check_raw,
    focus_to_shift,
    interpolation_order,
    refocus,
)
from plenofir.refocus.border import check_border
from plenofir.refocus.operator import Image, least_box
from plenofir.refocus.pictures import registered_slice
from plenofir.refocus.sharpening import derived_moment
from plenofir.refocus.sharpness import Slices

Floats = npt.NDArray[np.float64]
Floats32 = npt.NDArray[np.float32]
Focus = int | str | Fraction
# Lines processed at once, where floats for a whole picture would fill the memory.
_LINES = 64
# Lines of `all_in_focus` made at once: each band costs M additional lines.
_BAND = 256

PICTURE: dict[str, Any] = {"interpolation": "linear", "sharpen": Fraction(3, 16)}
"""How pictures for people are refocused (options of `plenofir.refocus.refocus`): without blocks
where a is a whole number, and not softer than the central view."""

# `all_in_focus`: weight b of the taps, a micro lens apart, that sharpen the central view.
_VIEW_SHARPENING = 1 / 16
# `all_in_focus`, sigmas in micro lenses: where means are those of the central view, and where its
# share is decided.
_MEAN_SIGMA, _DOUBT_SIGMA = 0.7, 1.0
# Medians by which the noise of the central view scatters about that of small boxes.
_SCATTER = 3.0
# Noise of the central view, from the lower quartile of the energy of differences in groups of like
# brightness: its factor, groups at most, lenses in each at least; energy of rounding.
_USUAL, _GROUPS, _GROUP, _ROUNDING = 1.4, 6, 50, 0.3


class FocalStack:
    """Focal stack whose slices are made when they are needed, and not kept.

    `settings`, `border`, `interpolation`, `sharpen`: as `plenofir.refocus.refocus` takes them.
    `box`: B samples, or in a slice that cannot have B the next larger box that it can have.
    Raises `InputError` if the raw image or a setting cannot be used, or there is none.
    """

    def __init__(
        self,
        raw: Image,
        micro_image_size: int,
        settings: Iterable[Focus],
        progress: Callable[[int, int], None] | None = None,
        *,
        border: Border = "zero",
        interpolation: Interpolation = "nearest",
        sharpen: Sharpen = "off",
        box: int | None = None,
    ) -> None:
        check_border(border)
        self.border: Border = border
        self.sharpen: Sharpen = sharpen
        self.interpolation = interpolation_order(interpolation)
        self.raw, self.micro_image_size = check_raw(raw, micro_image_size), micro_image_size
        self.settings = tuple(settings)
        self.progress = progress
        if not self.settings:
            raise InputError("no focus settings were given; give one or more")
        self.boxes = [
            least_box(micro_image_size, focus_to_shift(a, micro_image_size), box)
            for a in self.settings
        ]

    def __len__(self) -> int:
        """Number of slices."""
        return len(self.settings)

    def __iter__(self) -> Iterator[Image]:
        """Slices in the order of the settings, each of shape (rows, columns[, 3])."""
        yield from self.lines(0, self.raw.shape[0])

    def lines(self, first: int, last: int) -> Iterator[Image]:
        """Lines `first` to `last` - 1 of each slice, shape (last - first, columns[, 3])."""
        part = slice(first, last), slice(None)
        rows, slices = self.raw.shape[0], len(self)
        for number, (a, box) in enumerate(zip(self.settings, self.boxes, strict=True), 1):
            yield refocus(
                self.raw,
                self.micro_image_size,
                a,
                border=self.border,
                interpolation=self.interpolation,
                sharpen=self.sharpen,
                box=box,
                region=part,
            )
            if self.progress is not None:
                if last - first == rows:
                    self.progress(number, slices)
                else:
                    self.progress(first * slices + number * (last - first), rows * slices)


def focal_stack(
    raw: Image,
    micro_image_size: int,
    settings: Iterable[Focus],
    progress: Callable[[int, int], None] | None = None,
) -> Image:
    """Refocus a raw image to several planes, all in memory; `FocalStack` makes one by one.

    `settings`: focus settings a, as `plenofir.refocus.refocus` takes them. Result: shape (slices,
    rows, columns[, 3]).
    """
    stack = FocalStack(raw, micro_image_size, settings, progress)
    slices = np.empty((len(stack), *stack.raw.shape), stack.raw.dtype)
    for number, image in enumerate(stack):
        slices[number] = image
    return slices


def sharpness(region: Image | Floats, micro_image_size: int = 1, low: float = 0.01) -> float:
    """Sharpness of a region of interest (Eqs. 5.20-5.23): energy of high frequencies over all.

    Result: HE / TE, 0 for an even region. Raises `InputError` if the region has less than 4 x 4
    micro lenses.

    Parameters
    ----------
    region
        Grey or RGB image.
    micro_image_size
        Pixels for each micro lens: M for pictures of the raw image's size. Frequencies above half a
        cycle a micro lens are left out; there are only replicas of lower ones, more or less of them
        depending on how the views' samples fall, not on the focus.
    low
        Q / Omega: share of the frequencies, from zero on, that count as low (at least the first
        two); the thesis takes 1/100.
    """
    m = micro_image_size
    if min(region.shape[:2]) < 4 * m:
        raise InputError(
            f"the region of {region.shape[1]} x {region.shape[0]} pixels is too small; "
            f"take at least {4 * m} x {4 * m}"
        )
    ends = [-(-n // (2 * m)) for n in region.shape[:2]]
    # Only the part of the spectrum along the lines that counts is kept.
    lines = [
        np.fft.rfft(grey(region[k : k + _LINES]).astype(np.float64))[:, : ends[1]].copy()
        for k in range(0, region.shape[0], _LINES)
    ]
    quarter = np.abs(np.fft.fft(np.concatenate(lines), axis=0)[: ends[0]]) ** 2
    limits = [min(max(1, round(n * low)), n - 1) for n in ends]
    total = float(quarter.sum())
    lows = float(quarter[: limits[0] + 1, : limits[1] + 1].sum())
    return (total - lows) / total if total > 0 else 0.0


def sharpness_curve(
    stack: Slices,
    region: tuple[slice, slice] = (slice(None), slice(None)),
    micro_image_size: int = 1,
    low: float = 0.01,
) -> Floats:
    """Sharpness of a region in each slice of a focal stack.

    `stack`: array of shape (slices, rows, columns[, 3]), or a `FocalStack`. `region`: rows and
    columns of the region of interest. `micro_image_size`, `low`: see `sharpness`. Result: shape
    (slices,), divided by its largest value as in Fig. 5.16.
    """
    values = []
    for image in stack:
        values.append(sharpness(image[region], micro_image_size, low))
        # Before the next one is made.
        del image
    curve = np.array(values)
    return np.asarray(curve / curve.max() if curve.max() > 0 else curve)


def peak(positions: Sequence[float] | Floats, curve: Floats) -> float:
    """Position of a curve's maximum, between samples: a parabola through the highest three.

    `positions`: equally spaced positions of the samples, shape (n,). `curve`: its values, same
    shape. Result: position; that of the sample if the highest one is the first or the last.
    """
    places = np.asarray(positions, dtype=np.float64)
    k = int(np.argmax(curve))
    if k in (0, len(curve) - 1):
        return float(places[k])
    before, here, after = curve[k - 1 : k + 2]
    bend = before - 2 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float(places[k] + shift * (places[k + 1] - places[k]))


def all_in_focus(
    raw: Image,
    micro_image_size: int,
    settings: npt.ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
    *,
    confidence: npt.ArrayLike | None = None,
    box: int | None = None,
) -> Image:
    """Picture that is sharp everywhere: each pixel refocused to its own depth.

    Slices are 1/M apart, blended between, and sharpened as `PICTURE` says. Means of neighbouring
    lenses are drawn to those of the central view, so light from behind an object leaves no halo.
    Where slices differ from the central view by more than its noise (beside an object some views
    see what is behind it), the central view is mixed in, enlarged by cubics. Result: type
    and size of `raw`.

    `settings`: focus setting of each micro lens, shape (t, s), as `search_disparity` finds them if
    None. `confidence`: probability of each, 1 if None; improbable ones take the mean setting of the
    surroundings, so that one slice is seen there. `box`: samples B that a pixel averages in place
    of M (None), by place: as far as the setting is probable, not at whole settings, whose views all
    meet, nor beside steps of depth, nor where views that differ leave a lattice.
    """
    m = micro_image_size
    raw = check_raw(raw, m)
    if settings is None:
        disparity = search_disparity(raw, m).disparity
        settings, confidence = disparity.pixels_per_view, disparity.confidence
    settings = np.asarray(settings, np.float64)
    sure = np.ones(settings.shape)
    if confidence is not None:
        sure = np.asarray(confidence, np.float64)
        settings = Disparity(settings, sure).settled()
    view = _CentralView(raw, m, settings)
    # Shares of the small boxes' picture are 0 beside steps of depth, where views see two things.
    shares = sure * even(settings) * smaller(settings * m, m, box)
    fine = np.empty_like(raw) if shares.any() else None
    lenses = view.settings.shape
    picture, most = np.empty_like(raw), int(np.iinfo(raw.dtype).max)
    # Means of each micro lens: how much higher those of the enlarged view are than the slices'.
    more = np.zeros((*lenses, *raw.shape[2:]))
    for part in _parts(raw.shape[0], m):
        enlarged = view.enlarged(part)
        sharp = _sharpened(raw, m, view, part, enlarged)
        picture[part] = np.clip(np.floor(sharp + 0.5), 0, most)
        if fine is not None:
            finer = _sharpened(raw, m, view, part, enlarged, box)
            fine[part] = np.clip(np.floor(finer + 0.5), 0, most)
        of_lenses = _of_lenses(enlarged - sharp, m)
        first = part.start // m
        more[first : first + len(of_lenses)] = of_lenses
        if progress is not None:
            progress(min(part.stop, raw.shape[0]), raw.shape[0])
    off = more - _blurred(more, _MEAN_SIGMA)
    if fine is not None:
        shares *= 1 - lattice(fine, picture, m, lenses)
        # What the view has in a micro lens, a small box has somewhere in it, but for noise.
        c = m // 2
        share = shares.reshape(*lenses, *[1] * (raw.ndim - 2))
        low, high = _extremes(fine, m)
        noise = _SCATTER * np.median(np.abs(view.seen - fine[c::m, c::m][: lenses[0], : lenses[1]]))
        beyond = view.seen - np.clip(view.seen, low - noise, high + noise)
        off, more = (each + share * (beyond - each) for each in (off, more))
    doubt = _doubt(off, view.seen)
    lift = _blurred((1 - doubt.reshape(*lenses, *[1] * (raw.ndim - 2))) * more, _MEAN_SIGMA)
    for part in _parts(raw.shape[0], m):
        share = view.share(doubt, part)
        sharp, enlarged = picture[part].astype(np.float64), view.enlarged(part)
        finest = sharp
        if fine is not None:
            finest = sharp + view.share(shares, part) * (fine[part] - sharp)
        mixed = finest + share * (enlarged - finest)
        for k, channel in enumerate(np.moveaxis(np.atleast_3d(lift), 2, 0)):
            mixed.reshape(*mixed.shape[:2], -1)[..., k] += view.interpolated(channel, part)
        # No ring is darker than all of them.
        least = np.minimum(np.minimum(sharp, finest), enlarged)
        picture[part] = np.clip(mixed + 0.5, np.maximum(least, 0), most)
    return picture


def _of_lenses(values: Floats, m: int) -> Floats:
    """Means of whole micro lenses."""
    rows, columns = (length // m for length in values.shape[:2])
    whole = values[: rows * m, : columns * m]
    return np.asarray(whole.reshape(rows, m, columns, m, *values.shape[2:]).mean((1, 3)))


def _extremes(picture: Image, m: int) -> tuple[Image, Image]:
    """Least and largest pixels of whole micro lenses."""
    rows, columns = (length // m for length in picture.shape[:2])
    whole = picture[: rows * m, : columns * m].reshape(rows, m, columns, m, *picture.shape[2:])
    return whole.min((1, 3)), whole.max((1, 3))


def _blurred(values: Floats, sigma: float) -> Floats:
    """Means over some micro lenses around."""
    sigmas = (sigma, sigma, 0)[: values.ndim]
    return np.asarray(ndimage.gaussian_filter(values, sigmas, mode="nearest"))


def _doubt(off: Floats, view: Floats) -> Floats:
    """Share of the central view in the mixture, from the differences of micro lenses' means."""
    lenses = off.shape[:2]
    energy = _blurred((off.reshape(*lenses, -1) ** 2).mean(2), _DOUBT_SIGMA)
    # Noise grows with the brightness: that of a group of like brightness is what its calmest part
    # has.
    level = view.reshape(*lenses, -1).mean(2)
    order = np.argsort(level, axis=None)
    groups = np.array_split(order, max(1, min(_GROUPS, order.size // _GROUP)))
    levels = [float(np.median(level.flat[group])) for group in groups]
    calm = [_USUAL * float(np.quantile(energy.flat[group], 0.25)) for group in groups]
    noise = np.maximum(np.interp(level, levels, calm), _ROUNDING)
    # Noise of the view contributes `noise`; the rest of the square is the slices' error. These
    # shares minimise the mean squared error.
    return np.asarray(1 - noise / np.maximum(energy, noise))


def _parts(rows: int, m: int) -> list[slice]:
    """Bands of whole micro images; the last one has the lines left."""
    lines = m * max(1, _BAND // m)
    starts = list(range(0, max(rows // m * m, 1), lines))
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], rows], strict=True)]


class _CentralView:
    """The view through the middle of the lens and its depth, at the raw image's pixels."""

    def __init__(self, raw: Image, m: int, settings: Floats) -> None:
        self.m, self.shape, self.settings = m, raw.shape, settings
        view = self.seen = sub_aperture(raw, m, m // 2, m // 2).astype(np.float64)
        for axis in (0, 1):
            before, after = (
                np.take(
                    view, np.clip(np.arange(view.shape[axis]) + k, 0, view.shape[axis] - 1), axis
                )
                for k in (-1, 1)
            )
            view = view + _VIEW_SHARPENING * (2 * view - before - after)
        # Sharpening does not leave the range of the lenses around.
        sizes = (3, 3, 1)[: view.ndim]
        low, high = (
            extreme(self.seen, sizes, mode="nearest")
            for extreme in (ndimage.minimum_filter, ndimage.maximum_filter)
        )
        lenses = self.settings.shape
        self.rows, self.columns = (
            lens_shares(length, count, m, 1)
            for length, count in zip(self.shape, lenses, strict=False)
        )
        # What follows from a pixel's column is computed once: by splines, and by even cubics for
        # where these would ring. Cutting splines off lens by lens would leave squares.
        view = np.atleast_3d(np.clip(view, low, high))
        self.ringing, places = ringing(view), self.straight(0, self.shape[1])
        self.splines, self.even = (
            Cubics(Cubics(view.swapaxes(0, 1), even=even).at(places).swapaxes(0, 1), even=even)
            for even in (False, True)
        )

    def straight(self, first: int, last: int) -> Floats:
        """Places of pixels `first` to `last` - 1 of a line or column, in micro lenses."""
        return (np.arange(first, last) - (self.m - 1) / 2) / self.m

    def places(self, part: slice) -> Floats:
        """Where the view sees pixels of lines, see `places_in_view`."""
        lines = np.arange(part.start, part.stop)
        return places_in_view(self.settings, self.m, lines, np.arange(self.shape[1]))

    def interpolated(self, values: Floats, part: slice) -> Floats:
        """Values of the micro lenses, at the pixels of lines."""
        return np.asarray(self.rows[part] @ (self.columns @ values.T).T)

    def share(self, shares: Floats, part: slice) -> Floats:
        """Shares of the micro lenses, at the samples of lines."""
        share = self.interpolated(shares, part)
        return share.reshape(*share.shape, *[1] * (len(self.shape) - 2))

    def focus(self, part: slice) -> Floats:
        """Focus settings of pixels."""
        if self.m % 2:
            return self.interpolated(self.settings, part)
        places = self.places(part)
        return np.asarray(ndimage.map_coordinates(self.settings, places, order=1, mode="nearest"))

    def enlarged(self, part: slice) -> Floats:
        """Lines of the view without rings; shape of the picture's."""
        if self.m % 2:
            return self._enlarged(part).reshape(-1, *self.shape[1:])
        # Pixels are seen from beside the view: between its enlarged pixels.
        places = self.places(part) * self.m + (self.m - 1) / 2
        np.clip(places[0], 0, self.shape[0] - 1, out=places[0])
        first, last = int(places[0].min()), min(int(places[0].max()) + 2, self.shape[0])
        places[0] -= first
        colours = np.moveaxis(self._enlarged(slice(first, last)), 2, 0)
        each = [ndimage.map_coordinates(k, places, order=1, mode="nearest") for k in colours]
        return np.stack(each, axis=-1).reshape(-1, *self.shape[1:])

    def _enlarged(self, part: slice) -> Floats:
        """Lines of the view at places of its own, shape (lines, columns, channels)."""
        places = self.straight(part.start, part.stop)
        splines, even = self.splines.at(places), self.even.at(places)
        return splines + self.interpolated(self.ringing, part)[..., np.newaxis] * (even - splines)


def _sharpened(
    raw: Image, m: int, view: _CentralView, part: slice, enlarged: Floats, box: int | None = None
) -> Floats:
    """Lines at their depth, sharpened to the range of the pixels a lens around and of the view.

    Without that limit a bright object has a dark ring.
    """
    # Compiled code is loaded only when needed.
    from plenofir.camera.lightfield.focus_loops import sharpened_in_range

    lines = slice(max(0, part.start - m), min(len(raw), part.stop + m))
    soft = _blended_slices(raw, m, view.focus(lines), lines, box)
    sharp = np.empty(enlarged.shape)
    flat, weights, out = (each.reshape(len(each), -1) for each in (soft, enlarged, sharp))
    samples, weight = m * (out.shape[1] // raw.shape[1]), float(PICTURE["sharpen"])
    if box is not None:
        # As much less as it blurs less.
        weight *= float(derived_moment(m, 1, 1, box) / derived_moment(m, 1, 1))
    sharpened_in_range(flat, weights, part.start - lines.start, m, samples, weight, out)
    return sharp


def _blended_slices(
    raw: Image, m: int, focus: Floats, part: slice, box: int | None = None
) -> Floats32:
    """Lines refocused to a setting for each pixel: blended from the slices before and after."""
    from plenofir.camera.lightfield.focus_loops import add_slice

    picture = np.zeros((*focus.shape, *raw.shape[2:]), np.float32)
    flat = picture.reshape(len(picture), -1)
    channels = flat.shape[1] // raw.shape[1]
    shifts = (focus * m).astype(np.float32)
    whole = np.floor(shifts).astype(np.int64)
    # Whole shifts of each line and of each column: lines and columns that need a slice.
    ends = [(whole.min(axis), whole.max(axis)) for axis in (1, 0)]
    shifts = shifts.repeat(channels, axis=1)
    least = int(whole.min())
    there = np.flatnonzero(np.bincount((whole - least).ravel())) + least
    for shift in sorted({*there.tolist(), *(there + 1).tolist()}):
        rows, columns = (np.flatnonzero((low <= shift) & (shift <= high + 1)) for low, high in ends)
        top, left = part.start + int(rows[0]), int(columns[0])
        lines = slice(top, part.start + int(rows[-1]) + 1), slice(left, int(columns[-1]) + 1)
        image = registered_slice(raw, m, shift, lines, box=box)
        image = np.ascontiguousarray(image).reshape(len(image), -1)
        add_slice(image, shifts, shift, int(rows[0]), channels * left, flat)
    return picture
