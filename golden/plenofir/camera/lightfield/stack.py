# SPDX-License-Identifier: Apache-2.0
"""Focal stacks, how sharp their parts are, and the picture that is sharp everywhere."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.disparity import search_disparity
from plenofir.camera.lightfield.indexing import sub_aperture
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
from plenofir.refocus.operator import Image
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
# Differences up to this many times the lower quartile are noise of the central view. (The median is
# too large where most lenses see borders of objects.)
_USUAL = 2.0


class FocalStack:
    """Focal stack whose slices are made when they are needed, and not kept.

    `settings`, `border`, `interpolation`, `sharpen`: as `plenofir.refocus.refocus` takes them.
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
        for a in self.settings:
            focus_to_shift(a, micro_image_size)

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
        for number, a in enumerate(self.settings, 1):
            yield refocus(
                self.raw,
                self.micro_image_size,
                a,
                border=self.border,
                interpolation=self.interpolation,
                sharpen=self.sharpen,
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
    # Of the spectrum along the lines only what counts is kept.
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
) -> Image:
    """Picture that is sharp everywhere: each pixel refocused to its own depth.

    Slices are 1/M apart, made as `PICTURE` says, and blended between. Where they differ from the
    central view by more than its noise (beside an object some views see what is behind it) the
    central view is taken, enlarged by cubic splines. No pixel leaves the range of the lenses around
    in the central view. Result: type and size of `raw`.

    `settings`: focus setting of each micro lens, shape (t, s), as `search_disparity` finds them if
    None.
    """
    m = micro_image_size
    raw = check_raw(raw, m)
    if settings is None:
        settings = search_disparity(raw, m).disparity.pixels_per_view
    view = _CentralView(raw, m, np.asarray(settings, np.float64))
    lenses = view.settings.shape
    picture = np.empty_like(raw)
    # For each micro lens, how far its mean differs from the central view's.
    off = np.zeros(lenses)
    for part in _parts(raw.shape[0], m):
        blended = _blended_slices(raw, m, view.focus(part), part)
        picture[part] = np.floor(blended + 0.5)
        error = (blended - view.enlarged(part))[: (blended.shape[0] // m) * m, : lenses[1] * m]
        of_lenses = error.reshape(-1, m, lenses[1], m, *raw.shape[2:]).mean((1, 3))
        first = part.start // m
        off[first : first + len(of_lenses)] = (
            np.abs(of_lenses).reshape(*of_lenses.shape[:2], -1).mean(-1)
        )
        if progress is not None:
            progress(min(part.stop, raw.shape[0]), raw.shape[0])
    most = int(np.iinfo(raw.dtype).max)
    view.doubt = _doubt(off)
    for part in _parts(raw.shape[0], m):
        share = view.interpolated(view.doubt, part)
        share = share.reshape(*share.shape, *[1] * (raw.ndim - 2))
        mixed = picture[part] + share * (view.enlarged(part) - picture[part])
        picture[part] = np.clip(np.floor(view.limited(mixed, part) + 0.5), 0, most)
    return picture


def _doubt(off: Floats) -> Floats:
    """Share of the central view in the mixture, from the differences of micro lenses' means."""
    # Noise of the view contributes `usual`; the rest of the square is the slices' error. These
    # shares minimise the mean squared error.
    usual = max(_USUAL * float(np.quantile(off, 0.25)), 1.0)
    return np.asarray(1 - (usual / np.maximum(off, usual)) ** 2)


def _parts(rows: int, m: int) -> list[slice]:
    """Bands of whole micro images; the last one has the lines left."""
    lines = m * max(1, _BAND // m)
    starts = list(range(0, max(rows // m * m, 1), lines))
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], rows], strict=True)]


class _CentralView:
    """The view through the middle of the lens and its depth, at the raw image's pixels."""

    def __init__(self, raw: Image, m: int, settings: Floats) -> None:
        self.m, self.shape, self.settings = m, raw.shape, settings
        self.doubt: Floats = np.zeros(settings.shape)
        view = seen = sub_aperture(raw, m, m // 2, m // 2).astype(np.float64)
        for axis in (0, 1):
            before, after = (
                np.take(
                    view, np.clip(np.arange(view.shape[axis]) + k, 0, view.shape[axis] - 1), axis
                )
                for k in (-1, 1)
            )
            view = view + _VIEW_SHARPENING * (2 * view - before - after)
        self.limits = [
            np.atleast_3d(of_neighbours(seen, (3, 3, 1)[: seen.ndim], mode="nearest"))
            for of_neighbours in (ndimage.minimum_filter, ndimage.maximum_filter)
        ]
        colours = np.atleast_3d(view)
        self.splines = [
            ndimage.spline_filter(colours[..., k], 3, np.float64, "nearest")
            for k in range(colours.shape[2])
        ]

    def places(self, part: slice) -> Floats:
        """Where pixels of lines are in the array of micro lenses, shape (2, lines, columns)."""
        lines, columns = (
            (np.arange(n) - (self.m - 1) / 2) / self.m for n in (part.stop, self.shape[1])
        )
        return np.stack(np.meshgrid(lines[part.start :], columns, indexing="ij"))

    def interpolated(self, values: Floats, part: slice) -> Floats:
        """Values of the micro lenses, at the pixels of lines."""
        places = self.places(part)
        return np.asarray(ndimage.map_coordinates(values, places, order=1, mode="nearest"))

    def focus(self, part: slice) -> Floats:
        """Focus settings of pixels."""
        return self.interpolated(self.settings, part)

    def enlarged(self, part: slice) -> Floats:
        """Lines of the view; shape of the picture's."""
        places = self.places(part)
        colours = [
            ndimage.map_coordinates(s, places, order=3, mode="nearest", prefilter=False)
            for s in self.splines
        ]
        return np.stack(colours, axis=-1).reshape(*places.shape[1:], *self.shape[2:])

    def limited(self, values: Floats, part: slice) -> Floats:
        """Lines limited to the range of the lenses around, so that edges get no halos."""
        low, high = (
            np.stack(
                [self.interpolated(limit[..., k], part) for k in range(limit.shape[2])], axis=-1
            ).reshape(values.shape)
            for limit in self.limits
        )
        return np.clip(values, low, high)


def _blended_slices(raw: Image, m: int, focus: Floats, part: slice) -> Floats32:
    """Lines refocused to a setting for each pixel: blended from the slices before and after."""
    picture = np.zeros((*focus.shape, *raw.shape[2:]), np.float32)
    shifts = (focus * m).astype(np.float32)
    whole = np.floor(shifts).astype(np.int64)
    for shift in np.unique([whole, whole + 1]).tolist():
        share = np.maximum(0, 1 - np.abs(shifts - shift))
        there = np.flatnonzero(share.any(0))
        if there.size:
            # Only the columns that need this slice.
            across = slice(int(there[0]), int(there[-1]) + 1)
            lines = part, across
            image = _slice_of_central_view(raw, m, shift, lines)
            share = share[:, across].reshape(*image.shape[:2], *[1] * (raw.ndim - 2))
            picture[:, across] += share * image
    return picture


def _slice_of_central_view(
    raw: Image, m: int, shift: int, region: tuple[slice, slice]
) -> Image | Floats32:
    """A region of a slice as the central view sees it, which for even M is half a view aside.

    What is in focus is `shift / 2` pixels beside its place in the slice then.
    """
    if m % 2:
        return refocus(raw, m, Fraction(shift, m), border="normalise", region=region, **PICTURE)
    whole, half = divmod(shift, 2)
    first = [part.start + whole - half for part in region]
    last = [part.stop + whole + 2 * half for part in region]
    down, across = (
        slice(min(max(a, 0), n - 1), max(min(b, n), 1))
        for a, b, n in zip(first, last, raw.shape, strict=False)
    )
    image: Floats32 = refocus(
        raw, m, Fraction(shift, m), border="normalise", region=(down, across), **PICTURE
    ).astype(np.float32)
    for axis, part in enumerate((down, across)):
        places = np.arange(first[axis], last[axis]) - part.start
        image = image.take(np.clip(places, 0, part.stop - part.start - 1), axis)
        if half:
            # Half way between pixels, by cubic interpolation.
            image = image.swapaxes(0, axis)
            image = 9 / 16 * (image[1:-2] + image[2:-1]) - 1 / 16 * (image[:-3] + image[3:])
            image = image.swapaxes(0, axis)
    return image
