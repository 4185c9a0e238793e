# SPDX-License-Identifier: Apache-2.0
"""Refocusing in plain NumPy, a line at a time: the oracle of the compiled code, to the bit.

Nothing is compiled, so the first picture of a machine comes from here
(`plenofir.refocus.first_calls`). The cost depends on neither M nor a': a line of sums is the line
before, plus the lines that enter the box, minus those that leave it. Columns are lines of the
transposed sums.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.refocus.border import arrived
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpening import Taps
from plenofir.refocus.slices import Slice
from plenofir.refocus.threads import in_threads, processors

# Lines of a picture in one go: all arrays in between are bounded by it, and a column is still long
# enough that NumPy adds it in no more time than it takes to call NumPy.
_BAND = 512

Integers = npt.NDArray[Any]


class _Words(NamedTuple):
    """The narrowest types for sums: of lines, of both dimensions, of sharpened lines."""

    lines: Any
    sums: Any
    sharpened: Any


def _word(largest: int, *, signed: bool = False) -> Any:
    """The narrowest type for sums."""
    return np.promote_types(np.min_scalar_type(-largest if signed else largest), np.uint8)


def _words(slice_: Slice) -> _Words:
    """Types for the sums of a slice; half of the divisor is added before a division."""
    full, gain, sums = slice_.full, slice_.taps.gain, slice_.white * slice_.divisor * 3 // 2
    lines = _word(slice_.white * full + full)
    if slice_.units == 0:
        return _Words(lines, _word(sums), lines)
    return _Words(
        lines,
        _word(gain**2 * slice_.white * slice_.divisor * 3 // 2, signed=True),
        _word(gain * slice_.white * full, signed=True),
    )


def _line_sums(x: Integers, m: int, shift: int, box: int, places: range, word: Any) -> Integers:
    """Sums S[p] of B lines of x for places p, shape (places, ...); lines outside of x are zero."""
    sums = np.zeros((len(places), *x.shape[1:]), word)
    # How far back the lines lie that enter at places of each rest modulo M.
    entering: list[list[int]] = [[] for _ in range(m)]
    for u in range(m):
        entering[u * shift % m].append(u * (shift - 1))
    total = sums[:1].reshape(x.shape[1:])
    for place in range(places[0] - box + 1, places[0] + 1) if len(places) else ():
        for back in entering[place % m]:
            if 0 <= place - back < len(x):
                total += x[place - back]
    for n in range(1, len(places)):
        before, total = total, sums[n]
        for place in range(places[n - 1] + 1, places[n] + 1):
            for back in entering[place % m]:
                enters = place - back
                # Unsigned words wrap around in between; the sum itself fits.
                if 0 <= enters < len(x):
                    before = np.add(before, x[enters], out=total)
            for back in entering[(place - box) % m]:
                leaves = place - box - back
                if 0 <= leaves < len(x):
                    before = np.subtract(before, x[leaves], out=total)
        if before is not total:
            total[...] = before
    return sums


def _sums(x: Integers, slice_: Slice, outputs: range, word: Any) -> Integers:
    """Sums of lines for each output, with moving sums for the interpolation."""
    first, further = slice_.passes(outputs, len(x))
    x = _line_sums(x, slice_.micro_image_size, slice_.shift, slice_.box, first, word)
    for indices in further:
        # Further moving sums, those of the interpolation, have the focus setting 1 / M.
        x = _line_sums(x, slice_.micro_image_size, 1, slice_.box, indices, word)
    return x


def _sharpened(
    x: Integers,
    filter_: Taps,
    m: int,
    outputs: range,
    start: int,
    inside: npt.NDArray[np.bool_],
    word: Any,
) -> Integers:
    """The filter along lines; x begins with line `start`, and a tap outside is the line itself."""
    sharp = np.empty((len(outputs), *x.shape[1:]), word)
    around = np.empty(x.shape[1:], word)
    for target, line in zip(sharp, outputs, strict=True):
        before, behind = (
            k if 0 <= k < inside.size and inside[line] and inside[k] else line
            for k in (line - m, line + m)
        )
        np.add(x[before - start], x[behind - start], out=around, dtype=word)
        around *= filter_.side
        np.multiply(x[line - start], filter_.centre, out=target, dtype=word)
        target -= around
    return sharp


def _wider(outputs: range, slice_: Slice, axis: int) -> range:
    """Outputs that sharpening needs: its taps reach a lens farther."""
    if slice_.units == 0:
        return outputs
    m, length = slice_.micro_image_size, slice_.shape[axis]
    return range(max(0, outputs.start - m), min(length, outputs.stop + m))


def _both_sums(
    pixels: Integers, slice_: Slice, reached: list[Integers], rows: range, words: _Words
) -> Integers:
    """Sums of both dimensions for rows of the picture, shape (columns, rows, channels)."""
    m, filter_, columns = slice_.micro_image_size, slice_.taps, slice_.region[1]
    lines, wider = _wider(rows, slice_, 0), _wider(columns, slice_, 1)
    x = _sums(pixels, slice_, lines, words.lines)
    if slice_.units:
        inside = reached[0] == slice_.full
        x = _sharpened(x, filter_, m, rows, lines.start, inside, words.sharpened)
    # Columns become lines.
    x = np.ascontiguousarray(x.transpose(1, 0, 2))
    x = _sums(x, slice_, wider, words.sums)
    if slice_.units:
        inside = reached[1] == slice_.full
        x = _sharpened(x, filter_, m, columns, wider.start, inside, words.sums)
    return x


def _quotients(x: Integers, weights: tuple[Integers, Integers], slice_: Slice) -> Integers:
    """Sums over the product of their weights, halves rounded up, limited to the pixels' range."""
    white, scale = slice_.white, slice_.taps.scale**2
    if slice_.normalise:
        divisors = scale * np.outer(*weights)[..., None]
        x = (x.astype(np.int64) + divisors // 2) // np.maximum(divisors, 1)
        return np.where(divisors > 0, np.clip(x, 0, white), 0)
    divisor = scale * slice_.divisor
    x += x.dtype.type(divisor // 2)
    if scale > 1:
        np.clip(x, 0, (white + 1) * divisor - 1, out=x)
    # NumPy divides numbers without a sign in less time.
    x = x.view(f"u{x.itemsize}")
    x //= x.dtype.type(divisor)
    return x


def plain_refocus(
    raw: Image, slice_: Slice, *, out: Image | None = None, threads: int | None = None
) -> Image:
    """Refocus an image, as `plenofir.refocus.compiled.compiled_refocus`."""
    lengths, shape = slice_.shape[:2], slice_.result_shape
    image: Image = np.empty(shape, raw.dtype) if out is None else out
    if image.size == 0:
        return image
    words, reached = _words(slice_), [np.full(length, slice_.full) for length in lengths]
    if slice_.normalise:
        m, shift, box = slice_.micro_image_size, slice_.shift, slice_.box
        reached = [arrived(n, m, shift, slice_.order, slice_.align, box) for n in lengths]
    down, across = (
        weights[:: slice_.step][part.start : part.stop]
        for weights, part in zip(reached, slice_.region, strict=True)
    )
    pixels, picture = raw.reshape(*lengths, -1), image.reshape(*shape[:2], -1)
    bands = iter(range(0, shape[0], _BAND))

    def some() -> None:
        for first in bands:
            last, top = min(first + _BAND, shape[0]), slice_.region[0].start
            x = _both_sums(pixels, slice_, reached, range(top + first, top + last), words)
            x = _quotients(x, (across, down[first:last]), slice_)
            picture[first:last] = x.transpose(1, 0, 2)

    count = processors() if threads is None else threads
    in_threads(some, min(count, -(-shape[0] // _BAND)))
    return image
