# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the fast refocuser: from sums of columns to blocks of the picture.

Transposed sums of columns are summed along lines, divided, transposed back and written, in pieces;
interpolation and sharpening need whole lines of sums in between.
"""

from typing import NamedTuple

import numpy as np

from plenofir.refocus.kernels import (
    PAD,
    Integers,
    Plan,
    Taps,
    aligned,
    column_lines,
    column_sums,
    compiled,
    entering,
    first_pixels,
    positions_of,
    ranges_of,
    whole,
)
from plenofir.refocus.row_vectors import (
    copy_line,
    divide,
    finished_lines,
    quotients,
    running_sum,
    sharpened_quotients,
    sharpened_sums,
    take_number,
    transpose_back,
)
from plenofir.refocus.vector_code import LINE_BYTES
from plenofir.refocus.vectors import sum_lines

PIECE = 512  # unseen
"""Samples of a line that are summed, divided and written in one go."""


class Weights(NamedTuple):
    """Divisors of sums: the weight of the row times that of the column times `twice`."""

    rows: Integers
    # for each column the index of its weight in the next, which has each weight once
    places: Integers
    columns: Integers
    twice: int  # a factor of the divisor
    bits: int  # of pixels


@compiled
def weights_table(weights: Weights, rows: Integers, table: Integers) -> None:
    """Constants for division by weights: half, scale and multiplier for each weight of a column."""
    # table: shape (columns' weights, 3, lanes)
    bits = 8 * table.itemsize
    # floor((n scale) multiplier / 2^drop) is the quotient; scaled weights are most / 2 to most.
    one = np.uint64(1)
    most = one << np.uint64(bits - weights.bits)
    drop = 2 * bits - weights.bits - 1
    for c in range(table.shape[0]):
        for line in range(table.shape[2]):
            weight = np.uint64(weights.twice * rows[line] * weights.columns[c])
            half, scale, multiplier = weight >> one, one, np.uint64(0)
            if weight > 0:
                while weight * (scale + scale) <= most:
                    scale += scale
                scaled = weight * scale
                power = one << np.uint64(min(drop, 63))
                multiplier, rest = power // scaled, power % scaled
                for _ in range(63, drop):
                    above = np.uint64(rest + rest >= scaled)
                    multiplier = multiplier + multiplier + above
                    rest = rest + rest - above * scaled
                if rest + rest >= scaled:
                    # The next multiplier is nearer, and not too small.
                    multiplier += one
                elif rest > 0:
                    half += one
            table[c, 0, line] = half
            table[c, 1, line] = scale
            table[c, 2, line] = multiplier


@compiled
def inverse_bits(weight: int, largest: int) -> int:
    """Bits of a 32 bit floating point 1 / weight, if floor(n inverse) is right for all n; else 0.

    For n of up to weight (largest + 1).
    """
    # Rounded up, by e <= 2^-23 of it, so that it is right where n is a multiple. Below a multiple
    # q weight it is, if e and the rounding of the product, 2^-24, are less than 1 / (q weight).
    if weight <= 0 or weight * (largest + 1) > 1 << 22:
        return 0
    near = np.full(1, np.float32(1 / weight))
    return near.view(np.int32).item() + int(np.float64(near.item()) < 1 / weight)


class Row(NamedTuple):
    """Sums along several lines at once."""

    ranges: Integers
    low: int  # pixels of a line that are taken
    high: int
    margin: int  # zeros on both sides of sums: of 3 M pixels with sharpening, of M without
    words: Integers  # sums of columns
    start: Integers  # places of the pixels in the sum before the first
    # places of pixels that enter: for sum t those from ends[t] on; without ends, one for each sum
    places: Integers
    ends: Integers
    carry: Integers
    totals: Integers
    other: Integers


@compiled
def _row(
    plan: Plan, taps: Taps, first: Integers, s0: int, s1: int, word: Integers, like: Integers
) -> Row:
    """Plan sums s0 to s1 - 1 of a line, and allocate memory for them."""
    m, columns = plan.micro_image_size, plan.columns
    pixel = plan.channels * LINE_BYTES // word.itemsize
    ranges = ranges_of(plan, columns, taps, s0, s1)
    reach = -(m - 1) * (plan.shift - 1)
    t0, steps = ranges[0, 0], ranges[0, 1] - ranges[0, 0]
    low, high = plan.step * (t0 - 1) - m + 1, plan.step * (t0 + steps - 1) + 1
    low = min(columns.length, max(0, low + min(0, reach)))
    high = max(low, min(columns.length, high + max(0, reach)))
    # Sharpened sums take in pixels from one lens before them to one behind them.
    beside = m * int(taps.side > 0)
    margin = m + 2 * beside
    start, places = np.empty(m, np.int64), np.full(steps * plan.step + 2 * margin + PAD, low)
    ends = np.zeros(steps + 1, np.int64)
    start = start[: whole(plan, plan.step * (t0 - 1), low, high, start, 0)]
    n, single = 0, plan.common == 1
    for t in range(steps):
        at = plan.step * (t0 + t)
        n = entering(plan, first, at, low - beside, high + m + beside, places, n)
        if single and n == t:
            # No pixel enters or leaves.
            places[n] = high + m + margin
            n += 1
        ends[t + 1] = n
    made = (steps + 2 * m + 2 * margin + PAD) * plan.channels * LINE_BYTES // word.itemsize
    memory = made * int(plan.order > 0)
    words = aligned((high - low + 2 * margin + (1 + int(single)) * m + PAD) * pixel, word)
    for k in range(words.size if taps.zero > 0 else 0):
        words[k] = taps.zero
    return Row(
        ranges,
        low,
        high,
        margin * pixel,
        words,
        (start - low + margin) * pixel,
        (places[: n + PAD] - low + margin) * pixel,
        ends[: 0 if single else ends.size],
        aligned(pixel, like),
        aligned(memory, like),
        aligned(memory, like),
    )


@compiled
def _whole_lines(plan: Plan, row: Row) -> Integers:
    """Sums of whole lines: the input of the last moving sum, after `margin` zeros.

    Without sharpening `carry` has the sum before the first that is wanted.
    """
    words, margin, totals, other = row.words, row.margin, row.totals, row.other
    m, pixel, ranges = plan.micro_image_size, row.carry.size, row.ranges
    made = ranges[0, 1] - ranges[0, 0]
    box = m * pixel
    running_sum(words, row.places, row.ends, 0, made, box, totals, margin, pixel, row.carry, words)
    one_each = np.empty(0, np.int64)
    numbers = np.arange(made + 2 * m)
    for level in range(1, plan.order + 1):
        # The sums below are 0 outside of their range.
        totals[:margin] = 0
        totals[made * pixel + margin : made * pixel + 2 * margin] = 0
        row.carry[:] = 0
        runs = ranges[level, 1] - ranges[level - 1, 0] + plan.box_offset
        made = ranges[level, 1] - ranges[level, 0]
        target = (made - runs) * pixel + margin
        last = level == plan.order
        runs -= made * int(last)
        places = numbers[:runs] * pixel + margin
        running_sum(totals, places, one_each, 0, runs, box, other, target, pixel, row.carry, words)
        if not last:
            totals, other = other, totals
    return totals


@compiled
def _begin_sharpened(plan: Plan, taps: Taps, row: Row, sums: Integers, t: int, flags: int) -> None:
    """Set `carry` to the sharpened sum before number t, from its pixels in `sums`."""
    m, pixel = plan.micro_image_size, row.carry.size
    starts = np.empty(m, np.int64)
    if plan.order == 0:
        starts = starts[: whole(plan, t - 1, row.low - m, row.high + m, starts, 0)] - row.low
    else:
        starts[:] = np.arange(m) + (t - m + plan.box_offset - row.ranges[plan.order - 1, 0])
    before, behind = taps.side * (flags & 1), taps.side * (flags >> 1)
    own = taps.centre - 2 * taps.side + before + behind
    for k in range(pixel):
        total = np.int64(-taps.zero * (own - before - behind) * starts.size)
        for start in starts:
            place = start * pixel + row.margin + k
            total += own * np.int64(sums[place])
            total -= before * np.int64(sums[place - m * pixel])
            total -= behind * np.int64(sums[place + m * pixel])
        row.carry[k] = total


@compiled
def _sharpened(
    plan: Plan,
    taps: Taps,
    weights: Weights,
    row: Row,
    sums: Integers,
    places: Integers,
    ends: Integers,
    first: int,
    s0: int,
    s: int,
    end: int,
    runs: Integers,
    full: bool,
    entries: Integers,
    table: Integers,
    totals: Integers,
    values: Integers,
) -> None:
    """Values of the sharpened sums s to end - 1, counted from s0."""
    # Places, or their ends, are those from number `first` on. `runs` has for each sum its flags
    # (`Taps.columns`), and the next one with others. `full`: lines have all of their weight.
    channels, pixel = plan.channels, row.carry.size
    box, shift = plan.micro_image_size * pixel, 16 * table.itemsize - weights.bits - 1
    multiplier = np.full(LINE_BYTES // values.itemsize, taps.multiplier, values.dtype)
    goal, floor = 0, taps.bias >> taps.drop + 1
    while s < end:
        flags, until = runs[s, 0], min(end, runs[s, 1])
        if s == 0 or runs[s - 1, 1] == s:
            _begin_sharpened(plan, taps, row, sums, s0 + s, flags)
        count, number = until - s, first + s
        if full and flags == 3 and taps.zero > 0 and ends.size == 0:
            sharpened_quotients(
                *(sums, places, number, count, box, pixel, row.carry, taps.centre + taps.side),
                *(taps.bias + taps.half, taps.drop + 1, floor, taps.limit),
                *(multiplier, taps.rest, values, goal),
            )
        else:
            before, behind = taps.side * (flags & 1), taps.side * (flags >> 1)
            own = taps.centre - 2 * taps.side + before + behind
            sharpened_sums(
                *(sums, places, ends, number, count, box, pixel, row.carry),
                *(own, before, behind, taps.bias, taps.drop, totals, values),
            )
            part, samples = values[goal:], count * channels
            divide(totals, 0, part, samples, entries, s * channels, table, shift, plan.most)
        s, goal = until, goal + count * pixel


@compiled
def _next_block(counter: Integers, taken: Integers) -> int:
    """Number of a block that no other thread has taken, by way of `taken`."""
    take_number(counter, taken)
    number: int = taken[0]
    return number


@compiled
def refocus_blocks(
    x: Integers,
    out: Integers,
    plan: Plan,
    taps: Taps,
    weights: Weights,
    blocks: Integers,
    counter: Integers,
    past: int,
    word: Integers,
    like: Integers,
    sharp: Integers | None,
) -> None:
    """Make the blocks of a refocused image that no other thread has taken.

    `past` 1: written past the caches.
    """
    # `x` and `out` have the shape (rows, columns * channels). A line of `blocks` is the first and
    # last + 1 row and column of a block of outputs; `counter` has the number of the next one, and
    # threads share it. `like` has the type that holds sums, `word` that of columns' sums; `sharp`
    # that of sums, too, or it is None: each has only its own steps compiled.
    m, channels, rows, columns = plan.micro_image_size, plan.channels, plan.rows, plan.columns
    lanes = LINE_BYTES // word.itemsize
    pixel = channels * lanes
    plain = positions_of(plan, taps) == 1
    first, flat = first_pixels(plan), out.reshape(-1)
    piece = max(1, PIECE // channels // columns.scale)  # unseen
    piece -= piece % PAD if piece > PAD else 0
    values = aligned((piece * channels + PAD) * lanes, word)
    room = aligned(int(taps.side > 0) * values.size, like)
    numbers = aligned(weights.columns.size * 3 * lanes, like)
    table, reached = numbers.reshape((weights.columns.size, 3, lanes)), np.full(lanes, -1, np.int64)
    taken = np.empty_like(counter)
    block = _next_block(counter, taken)
    while block < blocks.shape[0]:
        column0, column1 = blocks[block, 2], blocks[block, 3]
        s0 = (column0 + columns.base) // columns.scale
        s1 = (column1 - 1 + columns.base) // columns.scale + 1
        row = _row(plan, taps, first, s0, s1, word, like)
        width = (column1 - column0) * channels
        pitch = (width + 5 * PAD) // LINE_BYTES * LINE_BYTES
        picture = aligned(lanes * pitch, out[0])
        # The sum of each sample, and the weight of each sum.
        index = np.empty(width + PAD, np.int64)
        place, rest, sample = 0, (column0 + columns.base) % columns.scale, 0
        for k in range(index.size):
            index[k] = place + sample * lanes
            sample += 1
            if sample == channels and k < width - 1:
                sample, rest = 0, rest + 1
                if rest == columns.scale:
                    place, rest = place + pixel, 0
            sample = min(sample, channels - 1)
        entries = np.zeros((s1 - s0) * channels, np.int64)
        # Pieces of one weight.
        alike = np.ones((s1 - s0) // piece + 1, np.int64)
        if weights.columns.size > 1:
            for k in range(entries.size):
                o = max((s0 + k // channels) * columns.scale - columns.base, 0)
                entries[k] = weights.places[min(o, columns.outputs - 1)] * 3 * lanes
                part = k // channels // piece
                alike[part] &= int(entries[k] == entries[part * piece * channels])
        runs = np.full((s1 - s0 if taps.side > 0 else 0, 2), s1 - s0)
        for k in range(runs.shape[0] - 1, -1, -1):
            runs[k, 0] = taps.columns[s0 + k - columns.base]
            if k + 1 < s1 - s0:
                runs[k, 1] = runs[k + 1, 1] if runs[k, 0] == runs[k + 1, 0] else k + 1
        one_each, boxes = np.empty(0, np.int64), np.empty(0, np.int64)
        if plan.order > 0:
            boxes = np.empty(s1 - s0 + PAD, np.int64)
        ahead = s0 - row.ranges[plan.order, 0]
        steps = row.ranges[plan.order, 0] - row.ranges[max(plan.order - 1, 0), 0]
        for k in range(boxes.size):
            boxes[k] = (ahead + steps + plan.box_offset + k) * pixel + row.margin
        # Sums that are pixels each, a single one that enters with each of them.
        direct = columns.scale == 1 and taps.side == 0 and (not plain or row.ends.size == 0)
        while block < blocks.shape[0] and column0 == blocks[block, 2]:
            row0, row1 = blocks[block, 0], blocks[block, 1]
            t0, t1 = (row0 + rows.base) // rows.scale, (row1 - 1 + rows.base) // rows.scale + 1
            lines = column_lines(plan, taps, word, t0, t1, row.low, row.high)
            # Sums of lines above the first begin with 0.
            begin = lines.ranges[0, 0] - int(taps.side > 0) * m - plan.order * plan.box_offset
            for t in range(begin, t0, lanes):
                column_sums(x, plan, taps, first, lines, t, min(lanes, t0 - t), row.words[:0])
            for t in range(t0, t1, lanes):
                count = min(lanes, t1 - t)
                column_sums(x, plan, taps, first, lines, t, count, row.words[row.margin :])
                after = (row.high - row.low) * pixel + row.margin
                row.words[after : after + PAD * lanes] = taps.zero
                row.carry[:] = 0
                starts = row.start.size
                sum_lines(row.words, row.start, 0, starts, starts, 0, row.carry, 0, 0, pixel)
                totals = _whole_lines(plan, row) if plan.order > 0 else row.totals
                others = 0
                for line in range(lanes):
                    o = max((t + line) * rows.scale - rows.base, 0)
                    weight = weights.rows[min(o, rows.outputs - 1)]
                    others += int(weight != reached[line])
                    reached[line] = weight
                if others > 0:
                    weights_table(weights, reached, table)
                even = True
                for line in range(lanes):
                    even &= reached[line] == reached[0]
                full = even and reached[0] == m
                even &= direct
                for s in range(0, s1 - s0, piece):
                    run = min(piece, s1 - s0 - s)
                    drop = 16 * table.itemsize - weights.bits - 1
                    o0 = max(column0, (s0 + s) * columns.scale - columns.base)
                    o1 = min(column1, (s0 + s + run) * columns.scale - columns.base)
                    left, right = o0 * channels, o1 * channels
                    done, until = left - column0 * channels, right - column0 * channels
                    # With one weight, of more than 1, the scale is a part of what is dropped.
                    which = entries[s * channels]
                    scaled, rest = np.int64(numbers[which + lanes]), drop - 8 * table.itemsize
                    while scaled > 1:
                        scaled, rest = scaled // 2, rest - 1
                    at_once = even and alike[s // piece] == 1 and rest >= 0
                    if sharp is not None:
                        wanted = s0, s, s + run, runs, full, entries, numbers, room, values
                        if plan.order == 0:
                            words, places, ends = row.words, row.places, row.ends
                            _sharpened(
                                plan, taps, weights, row, words, places, ends, ahead, *wanted
                            )
                        else:
                            _sharpened(
                                plan, taps, weights, row, totals, boxes, one_each, 0, *wanted
                            )
                    elif at_once:
                        weight = reached[0] * weights.columns[which // (3 * lanes)] * weights.twice
                        inverse = inverse_bits(weight, plan.most)
                        known = table, which, rest, plan.most, weight // 2, inverse
                        goal_of = picture, done, pitch, values
                        if plain:
                            taken_from = row.words, row.places, s, run, m * pixel, row.carry
                            finished_lines(*taken_from, *known, *goal_of)
                        else:
                            above = totals, boxes, s, run, m * pixel, row.carry
                            finished_lines(*above, *known, *goal_of)
                    elif plain:
                        quotients(
                            *(row.words, row.places, row.ends, s, run, m * pixel, values, pixel),
                            *(row.carry, entries, alike[s // piece], table, drop, plan.most),
                        )
                    else:
                        quotients(
                            *(totals, boxes, one_each, s, run, m * pixel, values, pixel),
                            *(row.carry, entries, alike[s // piece], table, drop, plan.most),
                        )
                    if not at_once:
                        transpose_back(
                            values, index, done, s * pixel, picture, done, pitch, until - done
                        )
                for line in range(count):
                    goal = rows.scale * (t + line) - rows.base
                    for to in range(max(goal, row0), min(goal + rows.scale, row1)):
                        here = to * out.shape[1] + column0 * channels
                        copy_line(flat, here, picture, line * pitch, width, past)
            block = _next_block(counter, taken)
