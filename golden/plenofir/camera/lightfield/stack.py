# SPDX-License-Identifier: Apache-2.0
"""Focal stacks, how sharp their parts are, and the picture that is sharp everywhere."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import count

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.ground.errors import InputError
from plenofir.refocus import (
    Border,
    Interpolation,
    check_raw,
    focus_to_shift,
    interpolation_order,
    refocus,
)
from plenofir.refocus.border import check_border
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import Slices, bands

Floats = npt.NDArray[np.float64]
Focus = int | str | Fraction
# Lines that are worked on at once, where a whole picture of numbers would fill the memory.
_LINES = 64


class FocalStack:
    """Focal stack whose slices are made when they are asked for, and not kept.

    `settings`, `border`, `interpolation`: as `plenofir.refocus.refocus` takes them. Raises
    `InputError` if the raw image or a setting cannot be used, or there is none.
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
    ) -> None:
        check_border(border)
        self.border: Border = border
        self.interpolation = interpolation_order(interpolation)
        self.raw, self.micro_image_size = check_raw(raw, micro_image_size), micro_image_size
        self.settings = tuple(settings)
        self.progress = progress
        if not self.settings:
            raise InputError("no focus settings", where="a", expected="one or more")
        for a in self.settings:
            focus_to_shift(a, micro_image_size)

    def __len__(self) -> int:
        """Number of slices."""
        return len(self.settings)

    def __iter__(self) -> Iterator[Image]:
        """Slices in the order of the settings, each of shape (rows, columns[, 3])."""
        yield from self.lines(0, self.raw.shape[0])

    def lines(self, first: int, last: int) -> Iterator[Image]:
        """Lines `first` to `last` - 1 of each slice."""
        part = slice(first, last), slice(None)
        rows, slices = self.raw.shape[0], len(self)
        for number, a in enumerate(self.settings, 1):
            yield refocus(
                self.raw,
                self.micro_image_size,
                a,
                border=self.border,
                interpolation=self.interpolation,
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
        two); the text takes 1/100.
    """
    m = micro_image_size
    if min(region.shape[:2]) < 4 * m:
        raise InputError(
            f"{region.shape[1]} x {region.shape[0]} pixels",
            where="region",
            expected=f"at least {4 * m} x {4 * m} pixels",
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

    `positions`: equally spaced positions of the samples. Result: position; that of the sample if
    the highest one is the first or the last.
    """
    places = np.asarray(positions, dtype=np.float64)
    k = int(np.argmax(curve))
    if k in (0, len(curve) - 1):
        return float(places[k])
    before, here, after = curve[k - 1 : k + 2]
    bend = before - 2 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float(places[k] + shift * (places[k + 1] - places[k]))


@dataclass(frozen=True)
class AllInFocus:
    """Picture that is sharp everywhere.

    `image`: type and size of the stack's slices. `slices`: slice that each micro lens was taken
    from, fractions between slices, shape (t, s).
    """

    image: Image
    slices: Floats


def all_in_focus(stack: Slices, micro_image_size: int, window: float = 2.0) -> AllInFocus:
    """Take every part of a picture from the slice in which it is sharpest.

    `stack`: focal stack: array of shape (slices, rows, columns[, 3]), or a `FocalStack`.
    `micro_image_size`: M: sharpness is judged between micro lenses, of which each fills M pixels.
    `window`: standard deviation of the window that sharpness is averaged over, in micro lenses.
    """
    slices, shape, dtype = _sharpest_slices(stack, micro_image_size, window)
    places = [(np.arange(n) - (micro_image_size - 1) / 2) / micro_image_size for n in shape[:2]]
    picture = np.empty(shape, dtype)
    for part, images in bands(stack, shape[0]):
        place = np.stack(np.meshgrid(places[0][part], places[1], indexing="ij"))
        depth = ndimage.map_coordinates(slices, place, np.float32, order=1, mode="nearest")
        whole = depth.astype(np.int32)
        before: Image | None = None
        for number, image in enumerate(images):
            # Pixels between the slice before and this one, or on the last one.
            if before is not None:
                here = whole == number - 1
                share = depth[here].astype(np.float64) - (number - 1)
                share = share.reshape(-1, *[1] * (len(shape) - 2))
                mixed = (1 - share) * before[here] + share * image[here]
                picture[part][here] = np.floor(mixed + 0.5).astype(dtype)
            before = image
        here = whole == len(stack) - 1
        picture[part][here] = image[here]
    return AllInFocus(picture, slices)


def _sharpest_slices(
    stack: Slices, m: int, window: float
) -> tuple[Floats, tuple[int, ...], npt.DTypeLike]:
    """Sharpest slice for each micro lens, smoothed; shape and type of the slices."""
    best = strength = None
    numbers = count()
    # Not enumerate, which keeps a slice until it has the next one.
    for image in stack:
        number = next(numbers)
        rows, columns = (n // m for n in image.shape[:2])
        if min(rows, columns) < 1:
            raise InputError("less than one micro image", where="stack", expected="a larger image")
        # Frequencies of more than a cycle a micro lens are replicas, not detail.
        smooth = np.empty((rows, image.shape[1]), np.float32)
        for k in range(0, image.shape[1], _LINES):
            part = ndimage.gaussian_filter1d(
                grey(image[:, k : k + _LINES]), m / 2, 0, mode="nearest"
            )
            smooth[:, k : k + _LINES] = part[m // 2 :: m][:rows]
        smooth = ndimage.gaussian_filter1d(smooth, m / 2, 1, mode="nearest")
        lenses = smooth[:, m // 2 :: m][:, :columns]
        detail = ndimage.laplace(lenses.astype(np.float64), mode="nearest") ** 2
        energy = ndimage.gaussian_filter(detail, window, mode="nearest")
        if best is None or strength is None:
            best, strength = np.zeros(energy.shape), energy
        best[energy > strength] = number
        strength = np.maximum(energy, strength)
        shape, kind = image.shape, image.dtype
        del image
    if best is None or strength is None:
        raise InputError("no slices", where="stack", expected="one or more")
    # Even parts have no sharpest slice: what is around them decides.
    weight = strength / (strength + np.median(strength) + 1e-12)
    votes = ndimage.gaussian_filter(best * weight, window, mode="nearest")
    slices = votes / np.maximum(ndimage.gaussian_filter(weight, window, mode="nearest"), 1e-12)
    return np.clip(slices, 0, len(stack) - 1), shape, kind
