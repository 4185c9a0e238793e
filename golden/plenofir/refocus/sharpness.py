# SPDX-License-Identifier: Apache-2.0
"""Depth index and all-in-focus picture of a focal stack, in integers: what the VHDL computes.

Sharpness is judged between micro lenses, as in `plenofir.camera.lightfield.stack.all_in_focus`:
finer detail is only replicas. Each step is a sum or a comparison, so that hardware and model agree
in every bit.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import Protocol

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Integers = npt.NDArray[np.int64]

# Lines that are put together at once.
_BAND = 128

MAX_SHARPNESS_RADIUS = 8
MAX_VOTE_RADIUS = 4
MAX_CONFIDENCE = (1 << 30) - 1
MAX_STACK = 256
"""Slices that an index of 8 bits tells apart."""


class Slices(Protocol):
    """Slices of a focal stack, which may be made one by one each time they are gone through.

    If it has a method `lines(first, last)`, that makes these lines of each slice and no others.
    """

    def __len__(self) -> int:
        """Number of slices."""

    def __iter__(self) -> Iterator[Image]:
        """Slices of equal shape, (rows, columns[, 3]), and type."""


def bands(stack: Slices, rows: int) -> Iterator[tuple[slice, Iterator[Image]]]:
    """Neighbouring lines, and these lines of each slice.

    A picture that is put together from slices needs no whole slice beside it.
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


def lens_sums(image: Image, m: int) -> Integers:
    """Luma of each micro image, summed over its pixels; pixels beyond the edges count as 0."""
    edges = [(0, -length % m) for length in image.shape[:2]] + [(0, 0)] * (image.ndim - 2)
    padded = np.pad(image, edges) if any(after for _, after in edges) else image
    rows, columns = padded.shape[0] // m, padded.shape[1] // m
    lenses = padded.reshape(rows, m, columns, m, *image.shape[2:])
    sums: Integers = lenses.sum((1, 3), dtype=np.int64)
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

    `levels`: how far the sharpness of the sharpest and the dullest slice are apart, in grey levels
    of 8 bits: of the Laplacian's mean absolute value in the window, between means of micro images.
    """
    weight = 1 if channels == 1 else 4
    window = (2 * radius + 1) ** 2
    return round(levels * 2.0 ** (pixel_bits - 8) * weight * micro_image_size**2 * window)


def vote(
    index: npt.NDArray[np.uint8], sure: npt.NDArray[np.bool_], slices: int, vote_radius: int
) -> npt.NDArray[np.uint8]:
    """Give micro images without texture the slice of their neighbours.

    Those that are `sure` keep their `index`, both of shape (t, s). Others get the slice most
    frequent among the neighbours with texture in the window, `vote_radius` micro images from its
    middle to its edge, the first of equal ones; without any, what the micro image above has got,
    in the first row the one to the left.
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
    known = sure | (most > 0)
    for t in range(len(index)):
        if t:
            voted[t] = np.where(known[t], voted[t], voted[t - 1])
            continue
        for s in range(index.shape[1]):
            if not known[t, s]:
                voted[t, s] = voted[t, s - 1] if s else index[t, s]
    return voted


def depth_index(
    stack: Slices,
    micro_image_size: int,
    radius: int = 1,
    *,
    confidence: int = 0,
    vote_radius: int = 0,
) -> DepthIndex:
    """Find the slice in which each micro image is sharpest, and take it from there.

    The stack (slices, rows, columns[, 3]) has at most 256. A micro image has texture where the
    sharpness (`local_sharpness`) of its sharpest slice is `confidence` above that of its dullest
    one (`confidence_level`). Those without take their neighbours' slice (`vote`), unless
    `vote_radius` is 0.
    """
    if not 1 <= len(stack) <= MAX_STACK:
        raise InputError(f"{len(stack)} slices are not possible; use 1 to {MAX_STACK}")
    if not 0 <= radius <= MAX_SHARPNESS_RADIUS:
        raise InputError(f"a radius of {radius} is not possible; use 0 to {MAX_SHARPNESS_RADIUS}")
    if not 0 <= confidence <= MAX_CONFIDENCE:
        raise InputError(f"a confidence of {confidence} is not possible; use 0 to {MAX_CONFIDENCE}")
    if not 0 <= vote_radius <= MAX_VOTE_RADIUS:
        raise InputError(
            f"a vote_radius of {vote_radius} is not possible; use 0 to {MAX_VOTE_RADIUS}"
        )
    best = most = least = None
    numbers = count()
    # Not enumerate, which keeps a slice until it has the next one.
    for image in stack:
        number = next(numbers)
        energy = local_sharpness(image, micro_image_size, radius)
        if best is None or most is None or least is None:
            best, most, least = np.zeros(energy.shape, np.uint8), energy, energy
        best[energy > most] = number
        most, least = np.maximum(energy, most), np.minimum(energy, least)
        shape, kind = image.shape, image.dtype
        del image
    assert best is not None, "one slice at least"
    assert most is not None
    assert least is not None
    if vote_radius:
        best = vote(best, most - least >= confidence, len(stack), vote_radius)
    picture = np.empty(shape, kind)
    columns = np.arange(shape[1]) // micro_image_size
    for part, slices in bands(stack, shape[0]):
        of_pixels = best[np.ix_(np.arange(part.start, part.stop) // micro_image_size, columns)]
        for number, image in enumerate(slices):
            here = of_pixels == number
            picture[part][here] = image[here]
    return DepthIndex(best, picture)


def depth_index_picture(index: npt.NDArray[np.uint8], slices: int) -> npt.NDArray[np.uint8]:
    """Depth index as grey levels, the first slice black, the last one white."""
    return (index.astype(np.uint16) * 255 // max(slices - 1, 1)).astype(np.uint8)
