# SPDX-License-Identifier: Apache-2.0
"""Depth index and all-in-focus picture of a focal stack, bit-true to the VHDL.

Sharpness is measured between micro lenses, as in `plenofir.camera.lightfield.stack.all_in_focus`:
finer detail is only replicas. All arithmetic is in integers.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import gcd
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image
from plenofir.refocus.slices import Slice

Integers = npt.NDArray[np.int64]

# Lines that are composed at once.
_BAND = 128

MAX_SHARPNESS_RADIUS = 8
MAX_VOTE_RADIUS = 4
MAX_CONFIDENCE = (1 << 30) - 1
MAX_STACK = 256
"""Slices that an index of 8 bits tells apart."""
TEXTURE = 6.0
"""Grey levels of 8 bits that count as texture, see `confidence_level`."""
SURE = 16
"""Confidence of depth between slices whose sharpness bends by that much."""
FRACTION_BITS = 8
"""Bits of the place between two slices."""
# Value for unknown depth between slices: the middle, which is the slice itself.
_MIDDLE = 1 << (FRACTION_BITS - 1)


class Slices(Protocol):
    """Slices of a focal stack, which may be computed one by one at each iteration.

    A method `lines(first, last)`, if there is one, computes only these lines of each slice.
    """

    def __len__(self) -> int:
        """Number of slices."""

    def __iter__(self) -> Iterator[Image]:
        """Slices of equal shape, (rows, columns[, 3]), and type."""


@dataclass(frozen=True)
class LazySlices:
    """Slices of whole pictures that `make` makes when they are needed."""

    slices: Sequence[Slice]
    make: Callable[[Slice], Image]

    def __len__(self) -> int:
        """Number of slices."""
        return len(self.slices)

    def __iter__(self) -> Iterator[Image]:
        """The slices, each of shape (rows, columns[, 3])."""
        return map(self.make, self.slices)

    def lines(self, first: int, last: int) -> Iterator[Image]:
        """Lines `first` to `last` - 1 of each slice."""
        rows = range(first, last)
        return (self.make(replace(one, region=(rows, one.region[1]))) for one in self.slices)


def bands(stack: Slices, rows: int) -> Iterator[tuple[slice, Iterator[Image]]]:
    """Bands of lines, and these lines of each slice.

    So a picture can be composed without a whole slice in memory.
    """
    make = getattr(stack, "lines", None)
    for first in range(0, rows, _BAND):
        part = slice(first, min(first + _BAND, rows))
        yield part, make(part.start, part.stop) if make else (image[part] for image in stack)


@dataclass(frozen=True)
class DepthIndex:
    """Where each micro image is sharpest."""

    # Slice for each micro image, the first of equally sharp ones, shape (t, s).
    index: npt.NDArray[np.uint8]
    # All-in-focus picture: each micro image from its slice; type and size of the slices.
    image: Image
    # Whether the sharpest slice is that much sharper than the least sharp one, shape (t, s).
    textured: npt.NDArray[np.bool_]
    # Depth between slices: position between the middles of the two neighbouring intervals, in
    # 256ths, and confidence, 0 if unknown; shape (t, s), see `between_slices`.
    fraction: npt.NDArray[np.uint8] | None = None
    confidence: npt.NDArray[np.uint8] | None = None

    def sharp_in(self, number: int) -> npt.NDArray[np.bool_]:
        """Micro images with texture that are sharpest in slice `number`, shape (t, s)."""
        return np.asarray(self.textured & (self.index == number))

    def focus(self, shifts: Sequence[int], micro_image_size: int) -> npt.NDArray[np.float64]:
        """Focus setting a of each micro image, of slices a' = `shifts`; shape (t, s)."""
        settings = np.array(shifts, np.float64) / micro_image_size
        if self.fraction is None:
            return np.asarray(settings[self.index])
        middles = (settings[1:] + settings[:-1]) / 2
        borders = np.concatenate([settings[:1], middles, settings[-1:]])
        place = (self.fraction + 0.5) / (1 << FRACTION_BITS)
        low, high = borders[self.index], borders[self.index.astype(int) + 1]
        return np.where(self.confidence == 0, settings[self.index], low + (high - low) * place)


def lens_sums(image: Image, m: int) -> Integers:
    """Luma of each micro image, summed over its pixels; pixels beyond the edges count as 0."""
    edges = [(0, -length % m) for length in image.shape[:2]] + [(0, 0)] * (image.ndim - 2)
    padded = np.pad(image, edges) if any(after for _, after in edges) else image
    rows, columns = padded.shape[0] // m, padded.shape[1] // m
    lenses = padded.reshape(rows, m, columns, m, *image.shape[2:])
    sums: Integers = lenses.sum((1, 3), dtype=np.int64)
    # Luma with weights that a chip adds by shifting.
    return sums if image.ndim == 2 else np.asarray(sums @ np.array([1, 2, 1]))


def local_sharpness(image: Image, micro_image_size: int, radius: int) -> Integers:
    """Sharpness around each micro image: absolute Laplacian between micro images in a window.

    Shape (t, s). The window has 2 radius + 1 micro images in each dimension. Absolute values of
    the four differences to the neighbours are added; neighbours beyond the edges are skipped.
    """
    sums = lens_sums(image, micro_image_size)
    laplacian = np.zeros_like(sums)
    for axis in (0, 1):
        difference = np.diff(sums, axis=axis)
        ahead = [(0, 0), (0, 0)]
        ahead[axis] = (0, 1)
        behind = [(0, 0), (0, 0)]
        behind[axis] = (1, 0)
        laplacian += np.pad(difference, behind) - np.pad(difference, ahead)
    window = np.pad(np.abs(laplacian), radius)
    for axis in (0, 1):
        window = np.lib.stride_tricks.sliding_window_view(window, 2 * radius + 1, axis).sum(-1)
    return window


def confidence_level(
    levels: float, micro_image_size: int, radius: int, channels: int = 1, pixel_bits: int = 8
) -> int:
    """Confidence in units of the sharpness, for `depth_index`.

    `levels`: least difference in sharpness between the sharpest and the least sharp slice, in grey
    levels of 8 bits of the Laplacian's mean absolute value in the window, between means of micro
    images.
    """
    weight = 1 if channels == 1 else 4
    window = (2 * radius + 1) ** 2
    return round(levels * 2.0 ** (pixel_bits - 8) * weight * micro_image_size**2 * window)


def vote(
    index: npt.NDArray[np.uint8], sure: npt.NDArray[np.bool_], slices: int, vote_radius: int
) -> npt.NDArray[np.uint8]:
    """Give micro images without texture the slice of their neighbours.

    Those that are `sure` keep their `index`, both of shape (t, s). Others get the most frequent
    slice among the neighbours with texture in the window, `vote_radius` micro images from its
    middle to its edge, the first of equally frequent ones; without such neighbours, the slice given
    to the micro image above, in the first row to the left.
    """
    counts = []
    for number in range(slices):
        window = np.pad(((index == number) & sure).astype(np.int64), vote_radius)
        for axis in (0, 1):
            window = np.lib.stride_tricks.sliding_window_view(
                window, 2 * vote_radius + 1, axis
            ).sum(-1)
        counts.append(window)
    most = np.max(counts, axis=0)
    voted = np.where(sure, index, np.argmax(counts, axis=0)).astype(np.uint8)
    decided = sure | (most > 0)
    for t in range(len(index)):
        if t:
            voted[t] = np.where(decided[t], voted[t], voted[t - 1])
            continue
        for s in range(index.shape[1]):
            if not decided[t, s]:
                voted[t, s] = voted[t, s - 1] if s else index[t, s]
    return voted


def slice_weight(shift: int, micro_image_size: int) -> int:
    """Weight in sixteenths of the sharpness of slice a' in comparison with other slices.

    Sums over whole micro images interpolate each view linearly between micro images, at n = M /
    gcd(a', M) different fractions. For an integer a nothing is interpolated, which makes the slice
    sharper than its neighbours.
    """
    fractions = micro_image_size // gcd(shift, micro_image_size)
    return 16 - round(4 / fractions**2)


def has_order(shifts: Sequence[int]) -> bool:
    """Whether slices are in ascending or descending order, so that depth between them exists."""
    steps = np.diff(np.array(shifts))
    return bool((steps > 0).all() or (steps < 0).all())


def curvature_bits(confidence: int) -> int:
    """Bits of the curvature that `between_slices` leaves out of its confidence."""
    return max(confidence.bit_length() - 5, 0)


def between_slices(
    index: npt.NDArray[np.uint8],
    peak: tuple[Integers, Integers, Integers],
    textured: npt.NDArray[np.bool_],
    shifts: Sequence[int],
    confidence: int,
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """Find the vertex of the parabola through a sharpest slice and its neighbours.

    `peak`: sharpness of the slice before, of the sharpest one, of the one after it. Their a' lie l
    and r apart (`shifts`). The parabola falls to them by slopes that are equal and opposite at the
    vertex, and change evenly between the middles of both intervals: from one middle to the other
    the vertex lies at p / (p + q), p = r (sharpest - before), q = l (sharpest - after). So it never
    leaves the slice's half of either interval.

    Returns floor(256 p / (p + q)), at most 255; and the confidence, the curvature 2 sharpest -
    before - after over the power of two for which `confidence` becomes 16 to 31, limited to 1 to
    255. The first and the last slice, and those not `textured`, have 128 and 0.
    """
    before, sharpest, after = peak
    inner = textured & (index > 0) & (index < len(shifts) - 1)
    # The ends have one interval only, and no depth between slices: 1 is never used.
    steps = np.pad(np.abs(np.diff(np.array(shifts, np.int64))), 1, constant_values=1)
    p = np.where(inner, (sharpest - before) * steps[index.astype(int) + 1], 0)
    whole = p + np.where(inner, (sharpest - after) * steps[index], 1)
    fraction = np.zeros_like(p)
    for _ in range(FRACTION_BITS):
        # Bit by bit, as 256 p may have more than 64 bits.
        p *= 2
        bit = p >= whole
        p -= np.where(bit, whole, 0)
        fraction = 2 * fraction + bit
    curvature = (2 * sharpest - before - after) >> curvature_bits(confidence)
    return (
        np.where(inner, fraction, _MIDDLE).astype(np.uint8),
        np.where(inner, np.clip(curvature, 1, 255), 0).astype(np.uint8),
    )


class Search(NamedTuple):
    """How `depth_index` looks for the sharpest slice; its parameters have these names."""

    radius: int
    confidence: int
    vote_radius: int
    shifts: tuple[int, ...]

    def check(self, slices: int) -> None:
        """Refuse what is not possible with so many slices."""
        radius, confidence, vote_radius, shifts = self
        if not 1 <= slices <= MAX_STACK:
            raise InputError(f"{slices} slices are not possible; use 1 to {MAX_STACK}")
        if not 0 <= radius <= MAX_SHARPNESS_RADIUS:
            raise InputError(
                f"a radius of {radius} is not possible; use 0 to {MAX_SHARPNESS_RADIUS}"
            )
        if not 0 <= confidence <= MAX_CONFIDENCE:
            raise InputError(
                f"a confidence of {confidence} is not possible; use 0 to {MAX_CONFIDENCE}"
            )
        if not 0 <= vote_radius <= MAX_VOTE_RADIUS:
            raise InputError(
                f"a vote_radius of {vote_radius} is not possible; use 0 to {MAX_VOTE_RADIUS}"
            )
        if shifts and not (len(shifts) == slices and has_order(shifts)):
            raise InputError(
                f"depth between slices needs a' of each of {slices} slices, going up or down, not "
                + " ".join(map(str, shifts))
            )


class _Peaks:
    """For each micro image the sharpest slice so far, and the sharpness of its neighbours."""

    def __init__(self, first: Integers) -> None:
        self.index = np.zeros(first.shape, np.uint8)
        # The first and the last slice have only one neighbour.
        self.most = self.least = self.before = self.after = self._last = first
        self._slices = 1

    def add(self, energy: Integers) -> None:
        """Take the sharpness of the next slice."""
        better = energy > self.most
        # What follows the sharpest slice is known one slice later.
        self.after = np.where(self.index == self._slices - 1, energy, self.after)
        self.before = np.where(better, self._last, self.before)
        self.index[better] = self._slices
        self.most, self.least = np.maximum(energy, self.most), np.minimum(energy, self.least)
        self._last, self._slices = energy, self._slices + 1


def depth_index(
    stack: Slices,
    micro_image_size: int,
    radius: int = 1,
    *,
    confidence: int = 0,
    vote_radius: int = 0,
    shifts: Sequence[int] = (),
    sharp: Slices | None = None,
) -> DepthIndex:
    """Find the slice in which each micro image is sharpest, and compose the picture in focus.

    The stack (slices, rows, columns[, 3]) has at most 256 slices. A micro image has texture if the
    sharpness (`local_sharpness`) of its sharpest slice is `confidence` above that of its least
    sharp one (`confidence_level`). Those without take their neighbours' slice (`vote`), unless
    `vote_radius` is 0. With `shifts`, a' of each slice in ascending or descending order, sharpness
    is weighted (`slice_weight`) and depth between slices is found too (`between_slices`); it is
    unknown for micro images that took their neighbours' slice.

    `sharp`: the same slices with smaller boxes (`plenofir.refocus.by_place`); the picture takes
    micro images with texture from these, and those without from `stack`.
    """
    Search(radius, confidence, vote_radius, tuple(shifts)).check(len(stack))
    peaks: _Peaks | None = None
    numbers = count()
    # Not enumerate, which keeps a slice in memory until it has the next one.
    for image in stack:
        number = next(numbers)
        energy = local_sharpness(image, micro_image_size, radius)
        if shifts:
            energy = energy * slice_weight(shifts[number], micro_image_size) >> 4
        if peaks is None:
            peaks = _Peaks(energy)
        else:
            peaks.add(energy)
        shape, kind = image.shape, image.dtype
        del image
    assert peaks is not None, "one slice at least"
    best, textured = peaks.index, peaks.most - peaks.least >= confidence
    if vote_radius:
        best = vote(best, textured, len(stack), vote_radius)
    fraction = certainty = None
    if shifts:
        peak, sure = (peaks.before, peaks.most, peaks.after), textured | (vote_radius == 0)
        fraction, certainty = between_slices(peaks.index, peak, sure, shifts, confidence)
    picture = np.empty(shape, kind)
    columns = np.arange(shape[1]) // micro_image_size
    # Numbers of slices in the micro images that a stack gives; none has this one.
    for source, from_it in ((stack, np.ones_like(textured)), (sharp, textured)):
        of_lenses = np.where(from_it, best, -1)
        for part, slices in bands(source, shape[0]) if source is not None else ():
            of_pixels = of_lenses[
                np.ix_(np.arange(part.start, part.stop) // micro_image_size, columns)
            ]
            for number, image in enumerate(slices):
                here = of_pixels == number
                picture[part][here] = image[here]
    return DepthIndex(best, picture, textured, fraction, certainty)


def depth_index_picture(index: npt.NDArray[np.uint8], slices: int) -> npt.NDArray[np.uint8]:
    """Depth index as grey levels, the first slice black, the last one white."""
    return (index.astype(np.uint16) * 255 // max(slices - 1, 1)).astype(np.uint8)


def depth_between_picture(
    index: npt.NDArray[np.uint8], fraction: npt.NDArray[np.uint8], slices: int
) -> npt.NDArray[np.uint16]:
    """Depth between slices as grey levels of 16 bits, the first slice black, the last one white."""
    whole = (max(slices - 1, 1)) << FRACTION_BITS
    place = (index.astype(np.int64) << FRACTION_BITS) + fraction - _MIDDLE
    return (place.clip(0, whole) * 65535 // whole).astype(np.uint16)
