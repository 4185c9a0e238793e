"""Compiled loops of the fast refocuser: moving sums of whole lines, several lines to a word.

A block of the output is made in three steps, all of it in the processor's cache:

1. Columns: each line of sums is the line above, plus the input line that enters the box, minus the
   one that leaves it (`plenofir.refocus.operator.moving_sums`); whole lines, so it vectorises.
2. Rows: the same along a line is a chain of single additions. Sums of several lines are
   packed into one 64-bit word, so that one addition serves them all: a packed word is the number
   sum of S_i 2^(b i), and whatever carries between its fields cancels in the end.
3. The fields are unpacked, divided and rounded; lines that repeat are copied.

No sum can overflow its field: `plenofir.refocus.fast.plan` derives b from M, order and depth.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

Work = TypeVar("Work", bound=Callable[..., Any])
Integers = npt.NDArray[Any]


def compiled(work: Work) -> Work:
    """Compile for this machine at the first call; kept on disk where that is possible.

    Parameters
    ----------
    work
        Function in the part of Python that numba compiles.

    Returns
    -------
    Callable
        The same; it lets other threads run meanwhile.
    """
    try:
        return cast("Work", numba.njit(cache=True, nogil=True)(work))
    except RuntimeError:  # no folder that numba could write to
        return cast("Work", numba.njit(nogil=True)(work))


class Axis(NamedTuple):
    """What one dimension needs, all in whole numbers.

    Attributes
    ----------
    length
        Pixels of the input.
    outputs
        Pixels of the output.
    start
        Pixel of the image that output 0 is (0 without a region of interest).
    base, scale
        Output o takes the sum number floor((o + base) / scale).
    """

    length: int
    outputs: int
    start: int
    base: int
    scale: int


class Plan(NamedTuple):
    """One slice of one image, all in whole numbers.

    Attributes
    ----------
    micro_image_size, shift, order, channels
        M, a', order of the interpolation, channels.
    common
        gcd(a', M): S changes at its multiples only.
    step
        Sum number t is S[step t].
    box_offset
        Offset of the moving sums that interpolation appends.
    rows, columns
        The two dimensions.
    half, divisor
        The result is floor((S2 + half) / divisor).
    multiplier, drop
        The same division as (n * multiplier) >> drop, if multiplier is not 0.
    """

    micro_image_size: int
    shift: int
    order: int
    channels: int
    common: int
    step: int
    box_offset: int
    rows: Axis
    columns: Axis
    half: int
    divisor: int
    multiplier: int
    drop: int


@compiled
def _add_line(target: Integers, base: Integers, plus: Integers, minus: Integers) -> None:
    for k in range(target.size):
        target[k] = base[k] + plus[k] - minus[k]


@compiled
def _add(target: Integers, line: Integers) -> None:
    for k in range(target.size):
        target[k] += line[k]


@compiled
def _subtract(target: Integers, line: Integers) -> None:
    for k in range(target.size):
        target[k] -= line[k]


@compiled
def _first_pixels(plan: Plan) -> Integers:
    """For each p mod M the first pixel u with u a' = p modulo M; -1 if there is none.

    The others follow at distances of M / gcd(a', M).
    """
    m = plan.micro_image_size
    first = np.full(m, -1, np.int64)
    for u in range(m // plan.common):
        first[u * plan.shift % m] = u
    return first


@compiled
def _column_sums(
    x: Integers, sums: Integers, plan: Plan, first: Integers, t: int, low: int, high: int
) -> None:
    """S[step t], S[step (t+1)], ... of the columns low to high (channels counted)."""
    m, shift, common = plan.micro_image_size, plan.shift, plan.common
    rows, width = x.shape[0], high - low
    nothing = np.zeros(width, x.dtype)
    for number in range(sums.shape[0]):
        p = plan.step * (t + number)
        line = sums[number]
        u = first[p % m]
        if number == 0 or (common == m and u >= 0):
            line[:] = 0
            for v in range(m):
                row = m * ((p - v * shift) // m) + v
                if 0 <= row < rows:
                    _add(line, x[row, low:high])
            continue
        before = sums[number - 1]
        if u < 0:
            line[:] = before
        while 0 <= u < m:
            row = p - u * (shift - 1)
            enters = x[row, low:high] if 0 <= row < rows else nothing
            leaves = x[row - m, low:high] if 0 <= row - m < rows else nothing
            _add_line(line, before, enters, leaves)
            before = line
            u += m // common


@compiled
def _box_columns(sums: Integers, target: Integers, m: int, offset: int) -> None:
    """Moving sum over M lines; there is nothing outside of them."""
    count = sums.shape[0]
    for number in range(count):
        line = target[number]
        if number == 0:
            line[:] = 0
            for other in range(max(0, offset - m + 1), min(count, offset + 1)):
                _add(line, sums[other])
            continue
        line[:] = target[number - 1]
        if number + offset < count:
            _add(line, sums[number + offset])
        if number + offset - m >= 0:
            _subtract(line, sums[number + offset - m])


@compiled
def _pack(sums: Integers, fields: Integers) -> None:
    """Interleave up to 4, 2 or 1 lines, so that 64 bits hold the same pixel of all of them."""
    lanes = 8 // fields.itemsize
    if lanes == 4 and sums.shape[0] == 4:
        one, two, three, four = sums[0], sums[1], sums[2], sums[3]
        for k in range(one.size):
            fields[4 * k] = one[k]
            fields[4 * k + 1] = two[k]
            fields[4 * k + 2] = three[k]
            fields[4 * k + 3] = four[k]
    elif lanes == 2 and sums.shape[0] == 2:
        one, two = sums[0], sums[1]
        for k in range(one.size):
            fields[2 * k] = one[k]
            fields[2 * k + 1] = two[k]
    else:
        for lane in range(sums.shape[0]):
            line = sums[lane]
            for k in range(line.size):
                fields[lanes * k + lane] = line[k]


@compiled
def _differences(words: Integers, result: Integers, back: int) -> None:
    for k in range(back, words.size):
        result[k] = words[k] - words[k - back]


@compiled
def _row_sums(
    words: Integers,
    entering: Integers,
    sums: Integers,
    plan: Plan,
    first: Integers,
    start: int,
    origin: int,
) -> None:
    """Sums along a line of words, outputs `start`, `start` + 1, ...

    Parameters
    ----------
    words
        Words of the pixels from `origin` on, 0 where there is no pixel.
    entering
        Each word less the one M pixels before.
    sums
        Result.
    plan, first
        The slice.
    start, origin
        See above.
    """
    m, shift, common, channels = plan.micro_image_size, plan.shift, plan.common, plan.channels
    outputs = sums.size // channels
    base, scale, step = plan.columns.base + start, plan.columns.scale, plan.step
    stride = m // common
    t = base // scale
    # Output 0 may be amidst a run of equal ones.
    left = min(scale * (t + 1) - base, outputs)
    # Places of the words that enter at each phase, from the pixel's own on.
    moves = np.empty(m, np.int64)
    for phase in range(m):
        moves[phase] = -first[phase] * (shift - 1) * channels
    for channel in range(channels):
        p = step * t
        total = np.uint64(0)
        for u in range(m):
            k = m * ((p - u * shift) // m) + u
            total += words[(k - origin) * channels + channel]
        for k in range(left):
            sums[k * channels + channel] = total
        done = left
        phase = (p + step) % m
        place = (p + step - origin) * channels + channel
        if common == 1:
            target = done * channels + channel
            while done < outputs:
                run = min(m - phase, outputs - done)
                for r in range(phase, phase + run):
                    total += entering[place + moves[r]]
                    sums[target] = total
                    place += channels
                    target += channels
                done += run
                phase = 0
            continue
        across = stride * (shift - 1) * channels
        while done < outputs:
            if first[phase] >= 0:
                k = place + moves[phase]
                for _ in range(common):
                    total += entering[k]
                    k -= across
            until = min(done + scale, outputs)
            while done < until:
                sums[done * channels + channel] = total
                done += 1
            place += step * channels
            phase += step
            if phase >= m:
                phase -= m


@compiled
def _box_rows(sums: Integers, target: Integers, channels: int, m: int, offset: int) -> None:
    """Moving sum over M pixels of a line of words; there is nothing outside of it."""
    count = sums.size // channels
    for channel in range(channels):
        total = np.uint64(0)
        for k in range(max(0, offset - m), min(count, offset)):
            total += sums[k * channels + channel]
        for k in range(count):
            if k + offset < count:
                total += sums[(k + offset) * channels + channel]
            if k + offset - m >= 0:
                total -= sums[(k + offset - m) * channels + channel]
            target[k * channels + channel] = total


@compiled
def _divide(fields: Integers, result: Integers, plan: Plan) -> None:
    """Divide and round halves up, all lines of a word at once."""
    if plan.multiplier > 0 and fields.itemsize == 2:
        # In 16 bits each, whatever the sums are: the processor multiplies many at once.
        half, multiplier = np.uint16(plan.half), np.uint32(plan.multiplier)
        drop = np.uint16(plan.drop - 16)
        for k in range(fields.size):
            product = np.uint32(np.uint16(fields[k] + half)) * multiplier
            result[k] = np.uint16(product >> np.uint32(16)) >> drop
        return
    if plan.multiplier > 0:
        half32, multiplier64 = np.uint32(plan.half), np.uint64(np.uint32(plan.multiplier))
        drop64 = np.uint64(plan.drop)
        for k in range(fields.size):
            result[k] = (np.uint64(np.uint32(fields[k] + half32)) * multiplier64) >> drop64
        return
    inverse = 1.0 / plan.divisor
    for k in range(fields.size):
        numerator = np.int64(fields[k]) + plan.half
        # Off by one at most, because the quotient is small.
        quotient = np.int64(np.float64(numerator) * inverse)
        rest = numerator - quotient * plan.divisor
        quotient += np.int64(rest >= plan.divisor) - np.int64(rest < 0)
        result[k] = quotient


@compiled
def _unpack(values: Integers, lanes: int, lane: int, line: Integers) -> None:
    if lanes == 4:
        for k in range(line.size):
            line[k] = values[4 * k + lane]
    elif lanes == 2:
        for k in range(line.size):
            line[k] = values[2 * k + lane]
    else:
        line[:] = values


@compiled
def refocus_blocks(
    x: Integers, out: Integers, plan: Plan, blocks: Integers, column: Integers, field: Integers
) -> None:
    """Make blocks of a refocused image.

    Parameters
    ----------
    x
        Raw image, shape (rows, columns * channels), uint8 or uint16.
    out
        Result, shape (output rows, output columns * channels), type of `x`.
    plan
        The slice.
    blocks
        Shape (blocks, 4): first and last + 1 row and column of each block of outputs.
    column, field
        Any arrays of the types that hold the sums of columns, and the final ones.
    """
    m, order, channels = plan.micro_image_size, plan.order, plan.channels
    rows, columns = plan.rows, plan.columns
    lanes = 8 // field.itemsize
    first = _first_pixels(plan)
    # How far interpolation reaches up and down.
    back, ahead = order * (m - 1 - plan.box_offset), order * plan.box_offset
    reach = -(m - 1) * (plan.shift - 1)
    for block in range(blocks.shape[0]):
        row0, row1, column0, column1 = blocks[block]
        top, bottom, left, right = row0, row1, column0, column1
        if order > 0:
            top, left = max(-rows.start, row0 - back), max(-columns.start, column0 - back)
            bottom = min(rows.length - rows.start, row1 + ahead)
            right = min(columns.length - columns.start, column1 + ahead)
        # The part of the input's lines that these outputs take, and what of it there is.
        origin = plan.step * ((left + columns.base) // columns.scale) - m + min(0, reach)
        end = plan.step * ((right - 1 + columns.base) // columns.scale) + 1 + max(0, reach)
        low = min(columns.length, max(0, origin))
        high = max(low, min(columns.length, end))
        t0 = (top + rows.base) // rows.scale
        t1 = (bottom - 1 + rows.base) // rows.scale + 1
        sums = np.empty((t1 - t0, (high - low) * channels), column.dtype)
        other = np.empty((t1 - t0 if order > 0 else 0, (high - low) * channels), column.dtype)
        _column_sums(x, sums, plan, first, t0, low * channels, high * channels)
        for _ in range(order):
            _box_columns(sums, other, m, plan.box_offset)
            sums, other = other, sums
        # Interpolation made more lines than are wanted.
        begin = row0 - top
        stop = begin + row1 - row0 if order > 0 else t1 - t0
        words = np.zeros((end - origin) * channels, np.uint64)
        entering = np.zeros((end - origin) * channels, np.uint64)
        there = words[(low - origin) * channels : (high - origin) * channels].view(field.dtype)
        totals = np.empty((right - left) * channels, np.uint64)
        others = np.empty(totals.size if order > 0 else 0, np.uint64)
        values = np.empty((column1 - column0) * channels * lanes, out.dtype)
        for number in range(begin, stop, lanes):
            count = min(lanes, stop - number)
            _pack(sums[number : number + count], there)
            _differences(words, entering, m * channels)
            _row_sums(words, entering, totals, plan, first, left, origin)
            for _ in range(order):
                _box_rows(totals, others, channels, m, plan.box_offset)
                totals, others = others, totals
            wanted = totals[(column0 - left) * channels : (column1 - left) * channels]
            _divide(wanted.view(field.dtype), values, plan)
            for lane in range(count):
                start = rows.scale * (t0 + number + lane) - rows.base
                until = min(start + rows.scale, row1)
                start = max(start, row0)
                line = out[start, column0 * channels : column1 * channels]
                _unpack(values, lanes, lane, line)
                for copy in range(start + 1, until):
                    out[copy, column0 * channels : column1 * channels] = line
