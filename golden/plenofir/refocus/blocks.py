# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the fast refocuser: from sums of columns to blocks of the picture.

Transposed sums of columns are summed along lines, divided, transposed back and written, in pieces;
interpolation and sharpening need whole lines of sums in between.
"""

from typing import NamedTuple

import numpy as np

from plenofir.refocus.kernels import (
    PAD,
    ZERO,
    Integers,
    Plan,
    Steps,
    Taps,
    aligned,
    column_lines,
    column_sums,
    compiled,
    inner,
)
from plenofir.refocus.row_vectors import (
    copy_line,
    finished_lines,
    quotients,
    take_number,
    transpose_back,
)
from plenofir.refocus.rows import row_of, sharpened_values, whole_lines
from plenofir.refocus.vector_code import LINE_BYTES
from plenofir.refocus.vectors import fill, narrow, sum_lines

PIECE = 512
"""Samples of a line that are summed, divided and written in one go."""


class Weights(NamedTuple):
    """Divisors of sums: the weight of the row times that of the column times `twice`."""

    rows: Integers
    # for each column the index of its weight in the next, which has each weight once
    places: Integers
    columns: Integers
    twice: int  # a factor of the divisor
    bits: int  # of pixels


@inner
def weights_table(weights: Weights, rows: Integers, bits: int, table: Integers) -> None:
    """Constants for division by weights: half, scale and multiplier for each weight of a column."""
    # table: shape (columns' weights, 3, lanes), flat
    lanes = rows.size
    # floor((n scale) multiplier / 2^drop) is the quotient; scaled weights are most / 2 to most.
    one = np.uint64(1)
    most = one << np.uint64(bits - weights.bits)
    drop = 2 * bits - weights.bits - 1
    for c in range(weights.columns.size):
        for line in range(lanes):
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
            place = 3 * lanes * c + line
            table[place] = half
            table[place + lanes] = scale
            table[place + 2 * lanes] = multiplier


@inner
def inverse_bits(weight: int, largest: int) -> int:
    """Bits of a 32 bit floating point 1 / weight, if floor(n inverse) is right for all n; else 0.

    For n of up to weight (largest + 1).
    """
    # Rounded up, by e <= 2^-23 of it, so that it is right where n is a multiple. Below a multiple
    # q weight it is, if e and the rounding of the product, 2^-24, are less than 1 / (q weight).
    if weight <= 0 or weight * (largest + 1) > 1 << 22:
        return 0
    power = 0
    while 1 << power < weight:
        power += 1
    # 1 / weight is 2^-power times 1 to 2, of which 23 bits behind the point are kept.
    return (126 - power << 23) + -(-(1 << power + 23) // weight)


@compiled
def refocus_blocks(
    x: Integers,
    out: Integers,
    plan: Plan,
    taps: Taps,
    weights: Weights,
    first: Integers,
    blocks: Integers,
    counter: Integers,
    past: int,
    steps: Steps,
) -> None:
    """Make the blocks of a refocused image that no other thread has taken.

    `past` 1: written past the caches.
    """
    # `x` and `out` are the bytes of the pictures. `first` has for each p mod M the first pixel u
    # with u a' = p modulo M, or -1. A line of `blocks` is the first and last + 1 row and column of
    # a block of outputs; `counter` has the number of the next one, and threads share it.
    m, channels, rows, columns = plan.micro_image_size, plan.channels, plan.rows, plan.columns
    lanes, bits = LINE_BYTES // steps.word_bytes, 8 * steps.sum_bytes
    pixel, out_pitch = channels * lanes, columns.outputs * channels
    plain = plan.positions == 1
    sharpened = taps.side > 0
    piece = max(1, PIECE // channels // columns.scale)
    piece -= piece % PAD if piece > PAD else 0
    values = aligned((piece * channels + PAD) * lanes, steps.word_bytes)
    room = aligned(int(sharpened) * (piece * channels + PAD) * lanes, steps.sum_bytes)
    factors = np.empty(weights.columns.size * 3 * lanes, np.uint64)
    table, reached = aligned(factors.size, steps.sum_bytes), np.empty(lanes, np.int64)
    for line in range(lanes):
        reached[line] = -1
    multiplier = aligned(lanes, steps.word_bytes)
    fill(steps.fill_words, multiplier, 0, lanes, taps.multiplier)
    claimed = np.empty(1, np.int64)
    take_number(steps.take_number, counter, claimed)
    block = claimed[0]
    while block < blocks.shape[0]:
        column0, column1 = blocks[block, 2], blocks[block, 3]
        s0 = (column0 + columns.base) // columns.scale
        s1 = (column1 - 1 + columns.base) // columns.scale + 1
        row = row_of(plan, taps, first, s0, s1, steps)
        width = (column1 - column0) * channels
        pitch = (width + 5 * PAD) // LINE_BYTES * LINE_BYTES
        picture = aligned(lanes * pitch, steps.pixel_bytes)
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
        entries = np.empty((s1 - s0) * channels, np.int64)
        # Pieces of one weight.
        alike = np.empty((s1 - s0) // piece + 1, np.int64)
        for k in range(alike.size):
            alike[k] = 1
        for k in range(entries.size):
            entries[k] = 0
            if weights.columns.size > 1:
                o = max((s0 + k // channels) * columns.scale - columns.base, 0)
                entries[k] = weights.places[min(o, columns.outputs - 1)] * 3 * lanes
                part = k // channels // piece
                alike[part] &= int(entries[k] == entries[part * piece * channels])
        runs = np.empty((s1 - s0 if sharpened else 0, 2), np.int64)
        for k in range(runs.shape[0] - 1, -1, -1):
            runs[k, 0], runs[k, 1] = taps.columns[s0 + k - columns.base], s1 - s0
            if k + 1 < s1 - s0:
                runs[k, 1] = runs[k + 1, 1] if runs[k, 0] == runs[k + 1, 0] else k + 1
        boxes = np.empty(s1 - s0 + PAD if plan.order > 0 else 0, np.int64)
        ahead = s0 - row.ranges[plan.order, 0]
        before = row.ranges[plan.order, 0] - row.ranges[max(plan.order - 1, 0), 0]
        for k in range(boxes.size):
            boxes[k] = (ahead + before + plan.box_offset + k) * pixel + row.margin
        # Sums that are pixels each, a single one that enters with each of them.
        direct = columns.scale == 1 and not sharpened and (not plain or row.several == 0)
        while block < blocks.shape[0] and column0 == blocks[block, 2]:
            row0, row1 = blocks[block, 0], blocks[block, 1]
            t0, t1 = (row0 + rows.base) // rows.scale, (row1 - 1 + rows.base) // rows.scale + 1
            lines = column_lines(plan, taps, steps.word_bytes, t0, t1, row.low, row.high)
            # Sums of lines above the first begin with 0.
            begin = lines.ranges[0, 0] - int(sharpened) * m - plan.order * plan.box_offset
            for t in range(begin, t0, lanes):
                count = min(lanes, t0 - t)
                into = ZERO - 1
                column_sums(x, plan, taps, first, lines, t, count, row.words, into, steps)
            for t in range(t0, t1, lanes):
                count = min(lanes, t1 - t)
                column_sums(x, plan, taps, first, lines, t, count, row.words, row.margin, steps)
                after = (row.high - row.low) * pixel + row.margin
                fill(steps.fill_words, row.words, after, PAD * lanes, taps.zero)
                fill(steps.fill_sums, row.carry, 0, pixel, 0)
                sum_lines(
                    steps.sum_words,
                    row.words,
                    row.start,
                    0,
                    row.starts,
                    row.starts,
                    0,
                    row.carry,
                    0,
                    0,
                    pixel,
                )
                # What the last moving sum is made of.
                summed, places, several, number = row.words, row.places, row.several, ZERO
                if plan.order > 0:
                    summed, places, several = whole_lines(plan, row, steps), boxes, ZERO
                elif sharpened:
                    number = ahead
                others = 0
                for line in range(lanes):
                    o = max((t + line) * rows.scale - rows.base, 0)
                    weight = weights.rows[min(o, rows.outputs - 1)]
                    others += int(weight != reached[line])
                    reached[line] = weight
                if others > 0:
                    weights_table(weights, reached, bits, factors)
                    narrow(steps.narrow, factors, table, factors.size)
                even = True
                for line in range(lanes):
                    even &= reached[line] == reached[0]
                full = even and reached[0] == m
                even &= direct
                for s in range(0, s1 - s0, piece):
                    run = min(piece, s1 - s0 - s)
                    drop = 2 * bits - weights.bits - 1
                    o0 = max(column0, (s0 + s) * columns.scale - columns.base)
                    o1 = min(column1, (s0 + s + run) * columns.scale - columns.base)
                    left, right = o0 * channels, o1 * channels
                    done, until = left - column0 * channels, right - column0 * channels
                    # With one weight, of more than 1, the scale is a part of what is dropped.
                    which = entries[s * channels]
                    scaled, rest = np.int64(factors[which + lanes]), drop - bits
                    while scaled > 1:
                        scaled, rest = scaled // 2, rest - 1
                    at_once = even and alike[s // piece] == 1 and rest >= 0
                    if sharpened:
                        sharpened_values(
                            plan,
                            taps,
                            weights.bits,
                            row,
                            summed,
                            places,
                            several,
                            number,
                            s0,
                            s,
                            s + run,
                            runs,
                            full,
                            entries,
                            table,
                            room,
                            values,
                            multiplier,
                            steps,
                        )
                    elif at_once:
                        weight = reached[0] * weights.columns[which // (3 * lanes)] * weights.twice
                        inverse = inverse_bits(weight, plan.most)
                        finished_lines(
                            steps.finished_lines,
                            summed,
                            places,
                            s,
                            run,
                            m * pixel,
                            row.carry,
                            table,
                            which,
                            rest,
                            plan.most,
                            weight // 2,
                            inverse,
                            picture,
                            done,
                            pitch,
                            values,
                        )
                    else:
                        quotients(
                            steps.quotients,
                            summed,
                            places,
                            row.ends,
                            several,
                            s,
                            run,
                            m * pixel,
                            values,
                            pixel,
                            row.carry,
                            entries,
                            s * channels,
                            alike[s // piece],
                            table,
                            drop,
                            plan.most,
                        )
                    if not at_once:
                        transpose_back(
                            steps.transpose_back,
                            values,
                            index,
                            done,
                            s * pixel,
                            picture,
                            done,
                            pitch,
                            until - done,
                        )
                for line in range(count):
                    goal = rows.scale * (t + line) - rows.base
                    for to in range(max(goal, row0), min(goal + rows.scale, row1)):
                        here = to * out_pitch + column0 * channels
                        copy_line(steps.copy_line, out, here, picture, line * pitch, width, past)
            take_number(steps.take_number, counter, claimed)
            block = claimed[0]
