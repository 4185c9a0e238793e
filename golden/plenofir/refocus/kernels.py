# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the fast refocuser: moving sums of whole lines, then along several lines.

A block of the output is computed from top to bottom, as many lines at once as a vector has lanes:

1. Columns: each line of sums is the line above, plus the input line that enters the box, minus the
   one that leaves it (`plenofir.refocus.operator.moving_sums`). Interpolation takes moving sums of
   such sums, and sharpening three of them, M lines apart: each follows from the line above it, so
   only a few lines are kept, whatever M is.
2. Rows: along one line this is a chain of dependent additions. So lines are transposed: a vector
   (`plenofir.refocus.vectors`) holds one sample of each line, and one addition serves all lines.
3. The sums are divided and rounded, transposed back and written; lines that repeat are copied.

Arrays are filled element by element: assignments of whole arrays take seconds more to compile,
because of their error messages about shapes.

No sum can overflow: `plenofir.refocus.fast.plan` derives its width from M, order and depth.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

from plenofir.refocus.kept_code import KeptCode, Unkept
from plenofir.refocus.vector_code import LINE_BYTES
from plenofir.refocus.vectors import (
    add_line,
    next_line,
    next_words,
    sum_lines,
    three_lines,
    transpose,
)

CHUNK = 512
"""Samples of a line whose sums are made and transposed in one go, in the nearest cache."""
PAD = 32
"""Samples behind a line that may be read, and written over."""
_PITCH = CHUNK + PAD
# numba compiles a function anew for a literal argument.
ZERO = cast("int", np.int64(0))

# Modules whose functions and numbers become part of others' code.
_SHARED = tuple(
    Path(__file__).with_name(f"{name}.py")
    for name in ("kernels", "rows", "machine_code", "vector_code")
)

Work = TypeVar("Work", bound=Callable[..., Any])
Integers = npt.NDArray[Any]


def compiled(work: Work, fastmath: bool | set[str] = False) -> Work:
    """Compile for this machine at the first call; cached on disk if possible."""
    dispatcher: Any = numba.njit(nogil=True, fastmath=fastmath)(work)
    try:
        dispatcher._cache = KeptCode(work, _SHARED)
    except (RuntimeError, OSError):
        dispatcher._cache = Unkept(work)
    return cast("Work", dispatcher)


def inner(work: Work) -> Work:
    """Compile for compiled functions only: without the way from Python, which takes longer."""
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast("Work", numba.njit(nogil=True, **options)(work))


class Axis(NamedTuple):
    """Parameters of one dimension, all integers."""

    length: int  # pixels of the input
    outputs: int  # pixels of the output
    # output o takes the sum number floor((o + base) / scale)
    base: int
    scale: int
    offset: int  # sum number of the picture's pixel 0


class Plan(NamedTuple):
    """Parameters of one slice of one image, all integers."""

    micro_image_size: int  # M
    shift: int  # a'
    order: int  # of the interpolation
    channels: int
    common: int  # gcd(a', M): S changes at its multiples only
    positions: int  # how many sums S, M apart, an output takes in a dimension
    step: int  # sum number t is S[step t]
    box_offset: int  # offset of the moving sums that interpolation appends
    rows: Axis
    columns: Axis
    most: int  # largest result


@inner
def whole(plan: Plan, p: int, low: int, high: int, found: Integers, n: int) -> int:
    """Write the pixels low to high - 1 in the sum S[p] to found[n ...]; result: their end."""
    m, shift = plan.micro_image_size, plan.shift
    # Pixel u of its micro image is less than M away from p - u a'.
    first, last = 0, m
    if shift > 0:
        first, last = max(0, (p - high - m) // shift), min(m, (p - low + m) // shift + 1)
    elif shift < 0:
        first, last = max(0, (low - p - m) // -shift), min(m, (high - p + m) // -shift + 1)
    for u in range(first, last):
        k = m * ((p - u * shift) // m) + u
        if low <= k < high:
            found[n] = k
            n += 1
    return n


@inner
def entering(
    plan: Plan, first: Integers, p: int, low: int, high: int, found: Integers, n: int
) -> int:
    """Write the pixels in S[p] that are not in S[p - step] to found[n ...]; result: their end."""
    u = first[p % plan.micro_image_size]
    while 0 <= u < plan.micro_image_size:
        k = p - u * (plan.shift - 1)
        if low <= k < high:
            found[n] = k
            n += 1
        u += plan.micro_image_size // plan.common
    return n


class Taps(NamedTuple):
    """Sharpening; without it `side` is 0."""

    centre: int
    side: int
    # added to sums of columns, so that none is negative: if they have 16 bits, with a side of 1
    zero: int
    # the result is (sharpened sum + bias) >> drop, less as much for the bias
    bias: int
    drop: int
    # with 16 bits: min((sharpened sum + half) >> drop + 1, limit) multiplier / 2^16 >> rest
    half: int
    limit: int
    multiplier: int
    rest: int
    # for each output, 1 if the tap before it counts, + 2 if that after it does
    rows: Integers
    columns: Integers


class Steps(NamedTuple):
    """Bytes of numbers, and addresses of the loops for them; 0 where a picture does not take it.

    Words are sums of columns. The last moving sum of a line is one of words, or with interpolation
    one of sums.
    """

    pixel_bytes: int
    word_bytes: int
    sum_bytes: int
    take_number: int
    sum_pixels: int
    next_line: int
    next_words: int
    add_line: int
    three_lines: int
    transpose: int
    fill_words: int
    fill_sums: int
    sum_words: int
    running_words: int
    running_sums: int
    narrow: int
    quotients: int
    finished_lines: int
    transpose_back: int
    copy_line: int
    divide: int
    sharpened_start: int
    sharpened_sums: int
    sharpened_quotients: int


@inner
def ranges_of(plan: Plan, axis: Axis, taps: Taps, t0: int, t1: int) -> Integers:
    """First and last + 1 sum that outputs t0 to t1 - 1 need; line j: after j more moving sums."""
    ranges = np.empty((plan.order + 1, 2), np.int64)
    ranges[plan.order, 0], ranges[plan.order, 1] = t0, t1
    if plan.positions > 1:
        # Limited to the picture.
        low, high = axis.offset, axis.offset + axis.length
        reach = int(taps.side > 0) * plan.micro_image_size
        for level in range(plan.order, -1, -1):
            t0, t1 = max(low, t0 - reach), min(high, t1 + reach)
            ranges[level, 0], ranges[level, 1] = t0, t1
            reach = 0
            t0, t1 = t0 + plan.box_offset - plan.micro_image_size + 1, t1 + plan.box_offset
    return ranges


@inner
def aligned(count: int, size: int) -> Integers:
    """Zeros of `size` bytes, the first of them at a line of the cache: no vector lies in two."""
    memory = np.zeros(count * size + LINE_BYTES, np.uint8)
    return memory[(LINE_BYTES - memory.ctypes.data % LINE_BYTES) :]


class Lines(NamedTuple):
    """Working memory for sums of columns."""

    ranges: Integers
    left: int  # first sample within a line of the image
    width: int  # samples of a line
    sums: Integers  # a line of zeros, lines of a chunk, the last sums of each position
    found: Integers  # beginnings of lines in the image
    ends: Integers


@inner
def _span(width: int) -> int:
    """Samples from a line of sums to the next."""
    return (width + 2 * PAD - 1) // PAD * PAD


@inner
def column_lines(
    plan: Plan, taps: Taps, word_bytes: int, t0: int, t1: int, low: int, high: int
) -> Lines:
    """Memory for sums t0 to t1 - 1 of the columns `low` to `high` - 1."""
    lanes = LINE_BYTES // word_bytes
    width = (high - low) * plan.channels
    positions = plan.positions
    sums = _PITCH * (1 + lanes) + positions * (positions + 1) // 2 * _span(width)
    return Lines(
        # Plain sums need one line more, from which the first that is wanted follows.
        ranges_of(plan, plan.rows, taps, t0 - int(positions == 1), t1),
        low * plan.channels,
        width,
        aligned(sums, word_bytes),
        np.empty((positions * lanes + 1) * max(plan.micro_image_size, 2 * plan.common), np.int64),
        np.empty(2 * positions * lanes + 1, np.int64),
    )


@inner
def column_sums(
    x: Integers,
    plan: Plan,
    taps: Taps,
    first: Integers,
    lines: Lines,
    t: int,
    count: int,
    words: Integers,
    into: int,
    steps: Steps,
) -> None:
    """Sums of columns for lines t, t + 1, ...; transposed to words[into ...] if `into` >= 0."""
    m, order, box = plan.micro_image_size, plan.order, plan.box_offset
    lanes, height = LINE_BYTES // steps.word_bytes, plan.rows.length
    pitch = plan.columns.length * plan.channels
    sums, found, ends, ranges = lines.sums, lines.found, lines.ends, lines.ranges
    width, span, made = lines.width, _span(lines.width), into >= 0
    sharpened, positions = int(taps.side > 0), plan.positions
    plain = positions == 1
    # If a step replaces half of the M pixels or more, S is summed anew instead of updated.
    few = 2 * plan.step >= m and plan.step > 1
    anew = plain and few
    n = ZERO
    for position in range(positions):
        for line in range(count):
            here = 2 * (position * lanes + line)
            ends[here] = n
            at = t + line + (sharpened - position) * m + order * box
            if anew or at == ranges[0, 0]:
                n = whole(plan, plan.step * at, ZERO, height, found, n)
                ends[here + 1] = n
            elif ranges[0, 0] < at < ranges[0, 1]:
                n = entering(plan, first, plan.step * at, ZERO, height, found, n)
                ends[here + 1] = n
                n = entering(plan, first, plan.step * at, m, height + m, found, n)
                for k in range(ends[here + 1], n):
                    found[k] -= m
            else:
                ends[here + 1] = n
            for k in range(ends[here], n):
                found[k] *= pitch
            ends[here + 2] = n
    # Prefetch what the next lines will need.
    coming = np.empty(lanes, np.int64)
    for line in range(0 if anew else count):
        coming[line] = found[ends[2 * line]]
        at = t + lanes + line + sharpened * m + order * box
        if entering(plan, first, plan.step * at, ZERO, height, found, n) > n:
            coming[line] = found[n] * pitch
    states = _PITCH * (1 + lanes)
    # Where one enters and one leaves with each of many lines, all is done in registers.
    tiles = 0
    if made and not anew and count == lanes and order + sharpened < 2:
        tiles = width // (2 * lanes)
    for end in range(ends.size if tiles > 0 else 0):
        if ends[end] != end:
            tiles = 0
    for line in range(count if tiles > 0 else 0):
        at = t + line + box
        if order == 1 and not (ranges[0, 0] <= at - m and at < ranges[0, 1]):
            tiles = 0
        if sharpened and taps.rows[t + line - plan.rows.base] != 3:
            tiles = 0
    if tiles > 0:
        next_words(
            steps.next_words,
            x,
            found,
            coming,
            lines.left,
            sums,
            states,
            span,
            taps.centre,
            taps.side,
            taps.zero,
            tiles,
            words,
            into,
        )
    for done in range(2 * lanes * tiles, width, CHUNK):
        samples = min(CHUNK, width - done)
        for line in range(count):
            row = _PITCH * (1 + line)
            for position in range(positions):
                here = 2 * (position * lanes + line)
                begin, middle, end = ends[here], ends[here + 1], ends[here + 2]
                goal = base = states + position * span + done
                if plain:
                    goal, base = row, base if line == 0 else row - _PITCH
                if anew:
                    base = 0
                if middle - begin == 1 and end - middle == 1:
                    at = lines.left + done
                    ahead = (coming[line] if position == 0 else found[begin]) + at
                    enters, leaves = found[begin] + at, found[middle] + at
                    next_line(steps.next_line, x, enters, leaves, ahead, sums, base, goal, samples)
                elif plain or end > begin:
                    left = lines.left + done
                    sum_lines(
                        steps.sum_pixels,
                        x,
                        found,
                        begin,
                        middle,
                        end,
                        left,
                        sums,
                        base,
                        goal,
                        samples,
                    )
            own = states + done
            for level in range(1, order + 1):
                below, own = own, own + (positions - level + 1) * span
                for position in range(positions - level):
                    at = t + line + (sharpened - position) * m + (order - level + 1) * box
                    low, high = ranges[level - 1]
                    a, b = own + position * span, below + position * span
                    if low <= at < high:
                        add_line(steps.add_line, sums, a, b, samples, 0)
                    if low <= at - m < high:
                        add_line(steps.add_line, sums, a, b + span, samples, 1)
            if made and sharpened:
                flags = taps.rows[t + line - plan.rows.base]
                behind = own if flags & 2 else own + span
                before = own + 2 * span if flags & 1 else own + span
                three_lines(
                    steps.three_lines,
                    sums,
                    own + span,
                    before,
                    behind,
                    row,
                    samples,
                    taps.centre,
                    taps.side,
                    taps.zero,
                )
            elif made and not plain:
                # Without lines that enter or leave: a copy.
                sum_lines(steps.sum_pixels, x, found, 0, 0, 0, 0, sums, own, row, samples)
        if plain:
            row = _PITCH * count
            goal = states + done
            sum_lines(steps.sum_pixels, x, found, 0, 0, 0, 0, sums, row, goal, samples)
        if made:
            goal = into + done * lanes
            transpose(steps.transpose, sums, _PITCH, _PITCH, words, goal, samples)
