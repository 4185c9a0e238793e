# SPDX-License-Identifier: Apache-2.0
"""Loops of `plenofir.refocus.compiled.picture_lines` in NumPy, equal to the bit.

The first pictures of a machine come from here, while those are compiled
(`plenofir.refocus.first_calls`). Arguments are as there.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

# Lines in one go: all arrays in between stay small, and NumPy is called seldom.
_BAND = 64


def _bands(lines: int) -> Iterator[tuple[int, int]]:
    for first in range(0, lines, _BAND):
        yield first, min(first + _BAND, lines)


def _neighbours(r: npt.NDArray[np.int64], step: int, lines: int) -> list[npt.NDArray[np.int64]]:
    """Places of the five taps; one outside the picture counts as the pixel itself."""
    places = (r + distance for distance in (-step, -(step // 2), 0, step // 2, step))
    return [np.where((place >= 0) & (place < lines), place, r) for place in places]


def _corrected(taps: list[Any], more: Any) -> Any:
    """The middle one of five taps, sharpened by `more` within the bounds of the others."""
    one, half, x, second, other = taps
    large, small = np.maximum(one, other), np.minimum(one, other)
    peak, hollow = x - large, x - small
    large = np.maximum(large, np.maximum(half, second))
    small = np.minimum(small, np.minimum(half, second))
    more = np.minimum(more, np.maximum(large - x, peak + peak))
    return x + np.maximum(more, np.minimum(small - x, hollow + hollow))


def _second_difference(taps: list[Any]) -> Any:
    one, _, x, _, other = taps
    return (x - one) + (x - other)


def _along(line: Any, rows: int, samples: int) -> list[Any]:
    """Taps along lines, for all pixels that have one on both sides."""
    half, last = samples // rows * (rows // 2), line.shape[1] - samples
    starts = (0, samples - half, samples, samples + half, 2 * samples)
    return [line[:, start : start + last - samples] for start in starts]


def sharpened_bytes(picture: Any, rows: int, samples: int, start: int, out: Any) -> None:
    """`sharpened_lines` of a single picture of 8 bits, in 16 bits."""

    def sharpened(taps: list[Any]) -> Any:
        both = _second_difference(taps)
        return _corrected(taps, (both >> 3) - (both >> 6))

    height, width = picture.shape
    for first, last in _bands(len(out)):
        r = np.arange(start + first, start + last)
        taps = [picture[place].astype(np.int16) * 32 for place in _neighbours(r, rows, height)]
        across = down = sharpened(taps)
        if width > 2 * samples:
            across = down.copy()
            across[:, samples:-samples] = sharpened(_along(down, rows, samples))
        out[first:last] = np.clip((across + 16) >> 5, 0, 255)


def sharpened_lines(
    low: Any,
    high: Any,
    share: float,
    rows: int,
    samples: int,
    start: int,
    weight: float,
    most: float,
    out: Any,
) -> None:
    """Mix two pictures, sharpen the mixture and round it, from line `start` on."""
    part, gain, half = np.float32(share), np.float32(weight), np.float32(0.5)

    def mixed(place: npt.NDArray[np.int64]) -> Any:
        one = low[place].astype(np.float32)
        return one + part * (high[place].astype(np.float32) - one) if part else one

    def sharpened(taps: list[Any]) -> Any:
        return _corrected(taps, gain * _second_difference(taps))

    height, width = low.shape
    for first, last in _bands(len(out)):
        r = np.arange(start + first, start + last)
        across = down = sharpened([mixed(place) for place in _neighbours(r, rows, height)])
        if width > 2 * samples:
            across = down.copy()
            across[:, samples:-samples] = sharpened(_along(down, rows, samples))
        out[first:last] = np.clip(across + half, 0, np.float32(most))


def means_of_four(picture: Any, samples: int, out: Any) -> None:
    """Means of each pixel, the next ones right and below, and the one between these."""
    for first, last in _bands(len(out)):
        lines = picture[first : last + 1].astype(np.int32)
        both = lines[:, :-samples] + lines[:, samples:]
        out[first:last] = np.float32(0.25) * (both[:-1] + both[1:]).astype(np.float32)


def _views(cube: Any, m: int, plane: Any, views: Any, y: Any, x: Any, out: Any) -> None:
    """Means of the views at some lines y and columns x."""
    height, width = cube.shape[:2]
    a, right, down = plane
    here = a + right * (2 * x + 1 - width) / width + down * (2 * y + 1 - height) / height
    c = (m - 1) / 2
    whole = np.zeros(out.shape[:2])
    sums = np.zeros(out.shape)
    for v, u, share in zip(*views, strict=True):
        # The lens through which view (v, u) sees the object at these pixels.
        t, s = (y - c) / m - here * (v - c), (x - c) / m - here * (u - c)
        t_first, s_first = np.floor(t).astype(np.int64), np.floor(s).astype(np.int64)
        t_rest, s_rest = t - t_first, s - s_first
        for j in range(2):
            row = (t_first + j) * m + v
            down_share = np.where((row >= 0) & (row < height), share, 0)
            down_share = down_share * (t_rest if j else 1 - t_rest)
            row = np.clip(row, 0, height - 1)
            for i in range(2):
                column = (s_first + i) * m + u
                there = (column >= 0) & (column < width)
                weight = np.where(there, down_share * (s_rest if i else 1 - s_rest), 0)
                whole += weight
                sums += weight[..., None] * cube[row, np.clip(column, 0, width - 1)]
    reached = whole[..., None]
    np.divide(sums, reached, out=sums, where=reached > 0)
    out[...] = sums


def views_of_lines(
    raw: Any,
    m: int,
    a: float,
    right: float,
    down: float,
    rows_of: Any,
    columns_of: Any,
    shares: Any,
    top: int,
    left: int,
    out: Any,
) -> None:
    """A region of the picture that begins at a place, from the views that count."""
    x = left + np.arange(out.shape[1])
    for first, last in _bands(len(out)):
        y = top + np.arange(first, last)[:, None]
        views = rows_of, columns_of, shares
        _views(raw, m, (a, right, down), views, y, x, out[first:last])
