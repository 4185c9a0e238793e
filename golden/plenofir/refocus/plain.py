# SPDX-License-Identifier: Apache-2.0
"""The moving sums of `plenofir.refocus.fast` in plain NumPy, a line at a time.

Nothing is compiled, so the first picture of a machine comes from here
(`plenofir.refocus.first_calls`). The cost depends on neither M nor a': a line of sums is the line
before, plus the lines that enter the box, minus those that leave it. Columns are lines of the
transposed sums.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from plenofir.refocus.border import arrived
from plenofir.refocus.operator import Align, Image, check_sums, output_offset
from plenofir.refocus.sharpening import Taps, taps
from plenofir.refocus.threads import in_threads, processors

# Lines of a picture in one go: all arrays in between are bounded by it, and a column is still long
# enough that NumPy adds it in no more time than it takes to call NumPy.
_BAND = 512

Integers = npt.NDArray[Any]


def _word(largest: int, *, signed: bool) -> Any:
    """The narrowest type for sums."""
    return np.promote_types(np.min_scalar_type(-largest if signed else largest), np.uint8)


def _line_sums(x: Integers, m: int, shift: int, places: range, word: Any) -> Integers:
    """Sums S[p] of M lines of x for places p, shape (places, ...); lines outside of x are zero."""
    sums = np.zeros((len(places), *x.shape[1:]), word)
    # How far back the lines lie that enter at places of each rest modulo M.
    entering: list[list[int]] = [[] for _ in range(m)]
    for u in range(m):
        entering[u * shift % m].append(u * (shift - 1))
    total = sums[:1].reshape(x.shape[1:])
    for u in range(m) if len(places) else ():
        line = m * ((places[0] - u * shift) // m) + u
        if 0 <= line < len(x):
            total += x[line]
    for n in range(1, len(places)):
        before, total = total, sums[n]
        for place in range(places[n - 1] + 1, places[n] + 1):
            for back in entering[place % m]:
                enters = place - back
                # Unsigned words wrap around in between; the sum itself fits.
                if 0 <= enters < len(x):
                    before = np.add(before, x[enters], out=total)
                if 0 <= enters - m < len(x):
                    before = np.subtract(before, x[enters - m], out=total)
        if before is not total:
            total[...] = before
    return sums


def _sums(
    x: Integers, m: int, shift: int, align: Align, order: int, wanted: range, step: int, word: Any
) -> Integers:
    """Sums of lines for each wanted output, with moving sums for the interpolation."""
    box, length = output_offset(m, 1, align), len(x)
    low, high = wanted.start * step, (wanted.stop - 1) * step + 1
    # Ranges that each of the interpolation's moving sums needs, the last one first.
    ranges = [(low, high)]
    for _ in range(order):
        low, high = max(0, low + box - m + 1), min(length, high + box)
        ranges.append((low, high))
    low, high = ranges.pop()
    offset = output_offset(m, shift, align)
    x = _line_sums(x, m, shift, range(low + offset, high + offset, step), word)
    for first, last in reversed(ranges):
        # Further moving sums, those of the interpolation, have the focus setting 1 / M.
        x = _line_sums(x, m, 1, range(first + box - low, last + box - low), word)
        low = first
    return x


def _sharpened(
    x: Integers,
    filter_: Taps,
    m: int,
    wanted: range,
    start: int,
    inside: npt.NDArray[np.bool_],
    word: Any,
) -> Integers:
    """The filter along lines; x begins with line `start`, and a tap outside is the line itself."""
    sharp = np.empty((len(wanted), *x.shape[1:]), word)
    around = np.empty(x.shape[1:], word)
    for target, line in zip(sharp, wanted, strict=True):
        taken = [
            k if 0 <= k < inside.size and inside[line] and inside[k] else line
            for k in (line - m, line + m)
        ]
        np.add(x[taken[0] - start], x[taken[1] - start], out=around, dtype=word)
        around *= filter_.side
        np.multiply(x[line - start], filter_.centre, out=target, dtype=word)
        target -= around
    return sharp


def _check(white: int, divisor: int, filter_: Taps, units: int) -> None:
    """Refuse what `plenofir.refocus.fast.plan` refuses."""
    check_sums(white * divisor)
    if units:
        gain, drop = (filter_.centre + 2 * filter_.side) ** 2, 2 * filter_.bits - 1
        most = -(-white * gain >> 2 * filter_.bits)
        check_sums(max(2 * most * divisor, gain * white * divisor + (2 << drop)))


def plain_refocus(
    raw: Image,
    micro_image_size: int,
    shift: int,
    *,
    align: Align = "centred",
    order: int = 0,
    units: int = 0,
    region: tuple[range, range],
    upsample: bool = True,
    normalise: bool = False,
    out: Image | None = None,
    threads: int | None = None,
) -> Image:
    """`plenofir.refocus.fast.fast_refocus`, equal to the bit."""
    m, lengths = micro_image_size, raw.shape[:2]
    shape = (len(region[0]), len(region[1]), *raw.shape[2:])
    image: Image = np.empty(shape, raw.dtype) if out is None else out
    if image.size == 0:
        return image
    filter_, full, white = taps(units), m ** (1 + order), int(np.iinfo(raw.dtype).max)
    _check(white, full**2, filter_, units)
    step = 1 if upsample else m
    reached = [np.full(length, full) for length in lengths]
    if normalise:
        reached = [arrived(length, m, shift, order, align) for length in lengths]
    down, across = (
        weights[::step][part.start : part.stop]
        for weights, part in zip(reached, region, strict=True)
    )
    # Half of the divisor is added before a division.
    words = [
        _word(white * full + full, signed=False),
        _word(3 * white * full**2 // 2, signed=False),
    ]
    if units:
        gain = filter_.centre + 2 * filter_.side
        words += [_word(gain * white * full, signed=True)]
        words[1] = _word(gain**2 * white * full**2 * 3 // 2, signed=True)
    # Taps of sharpening reach a lens farther.
    wider = region[1]
    if units:
        wider = range(max(0, wider.start - m), min(lengths[1], wider.stop + m))
    pixels, picture = raw.reshape(*lengths, -1), image.reshape(*shape[:2], -1)
    bands = iter(range(0, shape[0], _BAND))

    def some() -> None:
        for first in bands:
            last = min(first + _BAND, shape[0])
            rows = range(region[0].start + first, region[0].start + last)
            lines = range(max(0, rows.start - m), min(lengths[0], rows.stop + m)) if units else rows
            x = _sums(pixels, m, shift, align, order, lines, step, words[0])
            if units:
                x = _sharpened(x, filter_, m, rows, lines.start, reached[0] == full, words[2])
            # Columns become lines.
            x = np.ascontiguousarray(x.transpose(1, 0, 2))
            x = _sums(x, m, shift, align, order, wider, step, words[1])
            if units:
                columns = region[1], wider.start
                x = _sharpened(x, filter_, m, *columns, reached[1] == full, words[1])
            weights = across, down[first:last]
            x = _quotients(x, weights, filter_.scale**2, white, normalise)
            picture[first:last] = x.transpose(1, 0, 2)

    count = processors() if threads is None else threads
    in_threads(some, min(count, -(-shape[0] // _BAND)))
    return image


def _quotients(
    x: Integers, weights: tuple[Integers, Integers], scale: int, white: int, normalise: bool
) -> Integers:
    """Sums over the product of their weights, halves rounded up, limited to 0 .. `white`."""
    if normalise:
        divisors = scale * np.outer(*weights)[..., None]
        x = (x.astype(np.int64) + divisors // 2) // np.maximum(divisors, 1)
        return np.where(divisors > 0, np.clip(x, 0, white), 0)
    divisor = scale * int(weights[0][0] * weights[1][0])
    x += x.dtype.type(divisor // 2)
    if scale > 1:
        np.clip(x, 0, (white + 1) * divisor - 1, out=x)
    # NumPy divides numbers without a sign in less time.
    x = x.view(f"u{x.itemsize}")
    x //= x.dtype.type(divisor)
    return x
