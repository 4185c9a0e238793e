# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the fast refocuser: moving sums of whole lines, then along several lines.

A block of the output is made in three steps, all of it in the processor's cache:

1. Columns: each line of sums is the line above, plus the input line that enters the box, minus the
   one that leaves it (`plenofir.refocus.operator.moving_sums`); whole lines, so it vectorises.
2. Rows: along one line this is a chain of single additions. So the block is transposed: a vector
   (`plenofir.refocus.vectors`) holds a pixel of 16 or 32 lines, and one addition serves them all.
3. The sums are divided and rounded, transposed back and written; lines that repeat are copied.

No sum can overflow: `plenofir.refocus.fast.plan` derives its width from M, order and depth.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

from plenofir.refocus import vectors
from plenofir.refocus.kept_code import KeptCode
from plenofir.refocus.vectors import (
    LINE_BYTES,
    TILE_BYTES,
    divide_vector,
    prefetch,
    running_sum,
    transpose_tile,
)

PIECE_SAMPLES = 480
"""Samples of a line that are summed, divided and written in one go."""

# Their functions become part of the code of others.
_SHARED = (Path(__file__), Path(vectors.__file__))

Work = TypeVar("Work", bound=Callable[..., Any])
Integers = npt.NDArray[Any]


def compiled(work: Work) -> Work:
    """Compile for this machine at the first call; kept on disk where that is possible."""
    dispatcher: Any = numba.njit(nogil=True)(work)
    with suppress(RuntimeError, OSError):  # no folder that could be written
        dispatcher._cache = KeptCode(work, _SHARED)
    return cast("Work", dispatcher)


class Axis(NamedTuple):
    """What one dimension needs, all in whole numbers."""

    length: int  # pixels of the input
    outputs: int  # pixels of the output
    start: int  # pixel of the image that output 0 is (0 without a region of interest)
    # output o takes the sum number floor((o + base) / scale)
    base: int
    scale: int


class Plan(NamedTuple):
    """One slice of one image, all in whole numbers."""

    micro_image_size: int  # M
    shift: int  # a'
    order: int  # of the interpolation
    channels: int
    common: int  # gcd(a', M): S changes at its multiples only
    step: int  # sum number t is S[step t]
    box_offset: int  # offset of the moving sums that interpolation appends
    rows: Axis
    columns: Axis
    # the result is floor((S2 + half) / divisor)
    half: int
    divisor: int
    # the same division as (n * multiplier) >> drop, if multiplier is not 0
    multiplier: int
    drop: int


@compiled
def _add_line(target: Integers, base: Integers, plus: Integers, minus: Integers) -> None:
    for k in range(target.size):
        target[k] = base[k] + plus[k] - minus[k]


@compiled
def _copy(target: Integers, line: Integers) -> None:
    for k in range(target.size):
        target[k] = line[k]


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
    """For each p mod M the first pixel u with u a' = p modulo M; -1 if there is none."""
    # The others follow at distances of M / gcd(a', M).
    m = plan.micro_image_size
    first = np.full(m, -1, np.int64)
    for u in range(m // plan.common):
        first[u * plan.shift % m] = u
    return first


@compiled
def _terms(plan: Plan, p: int, low: int, high: int) -> tuple[int, int]:
    """First and last + 1 term u of S[p] whose pixel may be one of `low` to `high`."""
    m, shift = plan.micro_image_size, plan.shift
    # It is less than m away from p - u a'.
    below, above = p - high - m, p - low + m
    if shift > 0:
        return max(0, below // shift), min(m, above // shift + 1)
    if shift < 0:
        return max(0, -above // -shift), min(m, -below // -shift + 1)
    return 0, m


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
        # The line that enters next is fetched meanwhile.
        soon = p + plan.step - first[(p + plan.step) % m] * (shift - 1)
        if 0 <= soon < rows:
            for k in range(low, high, LINE_BYTES // x.itemsize):
                prefetch(x, soon, k)
        u = first[p % m]
        if number == 0 or (common == m and u >= 0):
            line[:] = 0
            v0, v1 = _terms(plan, p, 0, rows)
            for v in range(v0, v1):
                row = m * ((p - v * shift) // m) + v
                if 0 <= row < rows:
                    _add(line, x[row, low:high])
            continue
        before = sums[number - 1]
        if u < 0:
            _copy(line, before)
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
    nothing = np.zeros(sums.shape[1], sums.dtype)
    for number in range(count):
        line = target[number]
        if number == 0:
            line[:] = 0
            for other in range(max(0, offset - m + 1), min(count, offset + 1)):
                _add(line, sums[other])
            continue
        enters, leaves = number + offset, number + offset - m
        _add_line(
            line,
            target[number - 1],
            sums[enters] if enters < count else nothing,
            sums[leaves] if leaves >= 0 else nothing,
        )


@compiled
def _transpose(source: Integers, lines: int, width: int, target: Integers) -> None:
    """From shape (lines, width) to (width, lines), both given flat."""
    size = TILE_BYTES // source.itemsize
    whole = width // size * size
    for line in range(0, lines // size * size, size):
        for k in range(0, whole, size):
            transpose_tile(source, line * width + k, width, target, k * lines + line, lines)
    for line in range(lines):
        for k in range(whole if line < lines // size * size else 0, width):
            target[k * lines + line] = source[line * width + k]


@compiled
def _moves(plan: Plan, first: Integers, pixel: int) -> Integers:
    """How far from a pixel's own place that is which enters at each phase, and the next of them."""
    return -first * (plan.shift - 1) * pixel


@compiled
def _row_sums(
    words: Integers,
    sums: Integers,
    plan: Plan,
    moves: Integers,
    start: int,
    origin: int,
    whole: bool,
    goes_on: bool,
) -> None:
    """Sums along several lines at once, outputs `start`, `start` + 1, ..."""
    # `words`: column sums of the pixels from `origin` on, 0 where there is no pixel; flat, shape
    # (pixels, channels, lines), as are the results in `sums`, behind the sum before
    # them, from which it `goes_on`. Words are the `whole` reach of the outputs, or else the pixels
    # that there are and M on both sides.
    m, shift, common, channels = plan.micro_image_size, plan.shift, plan.common, plan.channels
    lines = LINE_BYTES // words.itemsize
    # Elements of a pixel.
    pixel = channels * lines
    outputs = sums.size // pixel - 1
    base, scale, step_pixels = plan.columns.base + start, plan.columns.scale, plan.step
    t = (base - 1 if goes_on else base) // scale
    p = step_pixels * t
    if not goes_on:
        sums[:pixel] = 0
        pixels = words.size // pixel
        u0, u1 = _terms(plan, p, origin, origin + pixels)
        for u in range(u0, u1):
            k = m * ((p - u * shift) // m) + u - origin
            if 0 <= k < pixels:
                _add(sums[:pixel], words[k * pixel : (k + 1) * pixel])
    # Output 0 may be amidst a run of equal ones, or behind its end.
    left = min(scale * (t + 1) - base, outputs)
    for k in range(1, left + 1):
        _copy(sums[k * pixel : (k + 1) * pixel], sums[:pixel])
    across = m // common * (shift - 1) * pixel
    behind = m * pixel
    done = left
    phase = (p + step_pixels) % m
    place = (p + step_pixels - origin) * pixel
    while whole and common == 1 and done < outputs:
        run = min(m - phase, outputs - done)
        target = (done + 1) * pixel
        for c in range(0, pixel, lines):
            running_sum(sums, target + c, pixel, words, place + c, moves, phase, run, pixel, behind)
        place += run * pixel
        done += run
        phase = 0
    while done < outputs:
        target = (done + 1) * pixel
        back = pixel
        for n in range(common if phase % common == 0 else 0):
            enters = place - n * across
            if whole or behind <= enters + moves[phase] < words.size:
                for c in range(0, pixel, lines):
                    running_sum(
                        sums, target + c, back, words, enters + c, moves, phase, 1, pixel, behind
                    )
                back = 0
        if back > 0:
            _copy(sums[target : target + pixel], sums[target - pixel : target])
        until = min(done + scale, outputs)
        for k in range(done + 1, until):
            _copy(sums[(k + 1) * pixel : (k + 2) * pixel], sums[target : target + pixel])
        done = until
        place += step_pixels * pixel
        phase += step_pixels
        if phase >= m:
            phase -= m


@compiled
def _box_rows(sums: Integers, target: Integers, pixel: int, m: int, offset: int) -> None:
    """Moving sum over M pixels along several lines; there is nothing outside of them."""
    count = sums.size // pixel
    lines = LINE_BYTES // sums.itemsize
    still = np.zeros(max(count, 1), np.int64)
    for k in range(count):
        part = target[k * pixel : (k + 1) * pixel]
        enters, leaves = k + offset, k + offset - m
        if k == 0:
            part[:] = 0
            for other in range(max(0, leaves + 1), min(count, enters + 1)):
                _add(part, sums[other * pixel : (other + 1) * pixel])
        elif leaves == 0 and enters < count:
            # From here on there is a pixel that enters and one that leaves, up to the end.
            for c in range(0, pixel, lines):
                running_sum(
                    target,
                    k * pixel + c,
                    pixel,
                    sums,
                    enters * pixel + c,
                    still,
                    0,
                    count - enters,
                    pixel,
                    m * pixel,
                )
        elif leaves < 0 or enters >= count:
            _copy(part, target[(k - 1) * pixel : k * pixel])
            if enters < count:
                _add(part, sums[enters * pixel : (enters + 1) * pixel])
            if leaves >= 0:
                _subtract(part, sums[leaves * pixel : (leaves + 1) * pixel])


@compiled
def _divide(fields: Integers, result: Integers, plan: Plan) -> None:
    """Divide and round halves up, sums of any layout."""
    if plan.multiplier > 0:
        for k in range(0, fields.size, LINE_BYTES // fields.itemsize):
            divide_vector(fields, result, k, plan.half, plan.multiplier, plan.drop)
        return
    inverse = 1.0 / plan.divisor
    for k in range(fields.size):
        numerator = np.int64(fields[k]) + plan.half
        # Off by one at most, because the quotient is small.
        quotient = np.int64(np.float64(numerator) * inverse)
        rest = numerator - quotient * plan.divisor
        quotient += np.int64(rest >= plan.divisor) - np.int64(rest < 0)
        result[k] = quotient


class Extent(NamedTuple):
    """What a block of outputs takes."""

    # outputs of the first sums: more than wanted if interpolation follows
    top: int
    bottom: int
    left: int
    right: int
    # pixels of the lines that they take
    origin: int
    end: int
    # those of them that the image has
    low: int
    high: int
    # whether they are all, or those of the image and M on both sides: most of them lie outside
    whole: bool
    # number of the first line of sums, and how many there are, up to a whole number of vectors
    first_line: int
    lines: int


@compiled
def _extent(plan: Plan, block: Integers, vector_lines: int) -> Extent:
    m, rows, columns = plan.micro_image_size, plan.rows, plan.columns
    top, bottom, left, right = block[0], block[1], block[2], block[3]
    if plan.order > 0:
        # How far interpolation reaches up and down.
        back, ahead = plan.order * (m - 1 - plan.box_offset), plan.order * plan.box_offset
        top, left = max(-rows.start, top - back), max(-columns.start, left - back)
        bottom = min(rows.length - rows.start, bottom + ahead)
        right = min(columns.length - columns.start, right + ahead)
    reach = -(m - 1) * (plan.shift - 1)
    origin = plan.step * ((left + columns.base) // columns.scale) - m + min(0, reach)
    end = plan.step * ((right - 1 + columns.base) // columns.scale) + 1 + max(0, reach)
    low = min(columns.length, max(0, origin))
    high = max(low, min(columns.length, end))
    whole = end - origin <= 2 * (high - low + 2 * m)
    if not whole:
        origin, end = low - m, high + m
    first_line = (top + rows.base) // rows.scale
    count = (bottom - 1 + rows.base) // rows.scale + 1 - first_line
    # Whole vectors, from the first line that is wanted on.
    skipped = block[0] - top
    lines = skipped + -(-(count - skipped) // vector_lines) * vector_lines
    return Extent(top, bottom, left, right, origin, end, low, high, whole, first_line, lines)


@compiled
def refocus_blocks(
    x: Integers, out: Integers, plan: Plan, blocks: Integers, like: Integers
) -> None:
    """Make blocks of a refocused image."""
    # `x` and `out` have the shape (rows, columns * channels). A line of `blocks` is the first and
    # last + 1 row and column of a block of outputs. `like` has the type that holds sums.
    m, order, channels = plan.micro_image_size, plan.order, plan.channels
    rows = plan.rows
    lines = LINE_BYTES // like.itemsize
    pixel = channels * lines
    first = _first_pixels(plan)
    moves = _moves(plan, first, pixel)
    # Memory for the largest block.
    most_sums, most_words, most_totals = 0, 0, 0
    for block in range(blocks.shape[0]):
        extent = _extent(plan, blocks[block], lines)
        most_sums = max(most_sums, extent.lines * (extent.high - extent.low) * channels)
        most_words = max(most_words, (extent.end - extent.origin) * pixel)
        most_totals = max(most_totals, (extent.right - extent.left) * pixel)
    if order == 0:
        # Interpolation takes whole lines; else what is at hand stays in the first-level cache.
        most_totals = min(most_totals, PIECE_SAMPLES // channels * pixel)
    all_sums = np.empty(most_sums, like.dtype)
    all_others = np.empty(most_sums if order > 0 else 0, like.dtype)
    all_words = np.empty(most_words, like.dtype)
    all_totals = np.empty(pixel + most_totals, like.dtype)
    other_totals = np.empty(most_totals if order > 0 else 0, like.dtype)
    values = np.empty(most_totals, out.dtype)
    picture = np.empty(most_totals, out.dtype)
    for block in range(blocks.shape[0]):
        row0, row1, column0, column1 = blocks[block]
        extent = _extent(plan, blocks[block], lines)
        left, right, origin, t0 = extent.left, extent.right, extent.origin, extent.first_line
        low, high = extent.low, extent.high
        width = (high - low) * channels
        t1 = (extent.bottom - 1 + rows.base) // rows.scale + 1
        begin = row0 - extent.top
        stop = begin + row1 - row0 if order > 0 else t1 - t0
        count = extent.lines
        sums = all_sums[: count * width].reshape(count, width)
        other = all_others[: count * width if order > 0 else 0].reshape(
            count if order > 0 else 0, width
        )
        for number in range(t1 - t0, count):
            sums[number] = 0
        _column_sums(x, sums[: t1 - t0], plan, first, t0, low * channels, high * channels)
        for _ in range(order):
            _box_columns(sums[: t1 - t0], other[: t1 - t0], m, plan.box_offset)
            sums, other = other, sums
        words = all_words[: (extent.end - origin) * pixel]
        words[: (low - origin) * pixel] = 0
        words[(high - origin) * pixel :] = 0
        there = words[(low - origin) * pixel : (high - origin) * pixel]
        piece = right - left if order > 0 else min(right - left, PIECE_SAMPLES // channels)
        for number in range(begin, stop, lines):
            _transpose(sums[number : number + lines].reshape(-1), lines, width, there)
            for start in range(left, right, piece):
                outputs = min(piece, right - start)
                goes_on = start > left
                if goes_on:
                    _copy(all_totals[:pixel], all_totals[piece * pixel : (piece + 1) * pixel])
                totals = all_totals[: (outputs + 1) * pixel]
                _row_sums(words, totals, plan, moves, start, origin, extent.whole, goes_on)
                totals, others = totals[pixel:], other_totals[: outputs * pixel]
                for _ in range(order):
                    _box_rows(totals, others, pixel, m, plan.box_offset)
                    totals, others = others, totals
                place = max(start, column0)
                samples = (min(start + outputs, column1) - place) * channels
                wanted = totals[(place - start) * pixel : (place - start) * pixel + samples * lines]
                if plan.divisor == 1:
                    # Sums are wanted, in an array of their own type.
                    _transpose(wanted, samples, lines, picture)
                else:
                    _divide(wanted, values[: samples * lines], plan)
                    _transpose(values[: samples * lines], samples, lines, picture)
                for line in range(min(lines, stop - number)):
                    row = rows.scale * (t0 + number + line) - rows.base
                    until = min(row + rows.scale, row1)
                    for target in range(max(row, row0), until):
                        _copy(
                            out[target, place * channels : place * channels + samples],
                            picture[line * samples : (line + 1) * samples],
                        )
