# SPDX-License-Identifier: Apache-2.0
"""Sums along several lines at once: which places they take, and whole lines of them."""

from typing import NamedTuple

import numpy as np

from plenofir.ground.kept_code import borrowing, inner
from plenofir.refocus.compiled.column_vectors import fill
from plenofir.refocus.compiled.parameters import PAD, ZERO, Frame, Integers
from plenofir.refocus.compiled.places import ANYWHERE, aligned, entering, ranges_of, whole
from plenofir.refocus.compiled.row_vectors import running_sum, sharpened_start
from plenofir.refocus.compiled.vector_code import LINE_BYTES


class Row(NamedTuple):
    """Sums along several lines at once."""

    ranges: Integers
    low: int  # pixels of a line that are taken
    high: int
    margin: int  # zeros on both sides of sums: of 3 M pixels with sharpening, of M without
    words: Integers  # sums of columns
    starts: int
    start: Integers  # places of so many pixels in the sum before the first
    # places of pixels that enter: for sum t those from ends[t] on; `several` 0: one for each sum;
    # places of nothing lie in the margin
    places: Integers
    leaving: Integers  # for each of them the place of the one that leaves, B samples behind it
    ends: Integers
    several: int
    pixel: int  # samples of all lines in a pixel
    carry: Integers
    totals: Integers  # whole lines of sums, for interpolation
    other: Integers
    in_order: Integers  # places of sums one after the other in these
    in_order_leaving: Integers  # and places of those that leave with them
    before: Integers  # places of pixels in a sharpened sum


class Summands(NamedTuple):
    """What the last moving sum along lines is made of."""

    sums: Integers
    places: Integers  # of what enters, from number `first` on
    leaving: Integers  # and of what leaves
    several: int  # as in `Row`
    first: int


@inner
def row_of(frame: Frame, s0: int, s1: int) -> Row:
    """Plan sums s0 to s1 - 1 of a line, and allocate memory for them."""
    plan, first, columns = frame.plan, frame.first, frame.plan.columns
    m = plan.micro_image_size
    pixel = plan.channels * LINE_BYTES // frame.loops.word_bytes
    # Sharpened sums take in pixels from one lens before them to one behind them.
    beside = m * int(frame.taps.side > 0)
    ranges = ranges_of(plan, columns, beside, s0, s1)
    reach = -(m - 1) * (plan.shift - 1)
    t0, count = ranges[0, 0], ranges[0, 1] - ranges[0, 0]
    low, high = plan.step * (t0 - 1) - plan.box + 1, plan.step * (t0 + count - 1) + 1
    low = min(columns.length, max(0, low + min(0, reach)))
    high = max(low, min(columns.length, high + max(0, reach)))
    margin = m + 2 * beside
    start, ends = np.empty(m, np.int64), np.empty(count + 1, np.int64)
    leaving = np.empty(plan.box + count * plan.step + m + PAD, np.int64)
    places = leaving[plan.box :]
    starts = whole(plan, first, plan.step * (t0 - 1), low, high, start, ZERO)
    for k in range(starts):
        start[k] = (start[k] - low + margin) * pixel
    n = ZERO
    for t in range(-(plan.box // plan.step), count):
        # In sums that follow each other as many pixels enter, B of them before the first.
        ends[max(0, t)] = n - plan.box
        n = entering(plan, first, plan.step * (t0 + t), -ANYWHERE, ANYWHERE, leaving, n)
    ends[count] = n - plan.box
    for k in range(leaving.size):
        inside = k < n and low - beside <= leaving[k] < high + beside
        leaving[k] = (leaving[k] - low + margin if inside else beside) * pixel
    memory = (count + 2 * m + 2 * margin + PAD) * pixel * int(plan.order > 0)
    size = (high - low + 2 * margin + PAD) * pixel
    sums = count + 2 * m
    in_order, in_order_leaving = np.empty(sums, np.int64), np.empty(sums, np.int64)
    for k in range(in_order.size):
        in_order[k] = (k + margin) * pixel
        in_order_leaving[k] = (k - plan.box + margin) * pixel
    words = aligned(size, frame.loops.word_bytes)
    if frame.taps.zero > 0:
        fill(frame.loops.fill_words, words, 0, size, frame.taps.zero)
    return Row(
        ranges,
        low,
        high,
        margin * pixel,
        words,
        starts,
        start,
        places,
        leaving,
        ends,
        int(plan.common > 1),
        pixel,
        aligned(pixel, frame.loops.sum_bytes),
        aligned(memory, frame.loops.sum_bytes),
        aligned(memory, frame.loops.sum_bytes),
        in_order,
        in_order_leaving,
        np.empty(m, np.int64),
    )


@borrowing
def whole_lines(frame: Frame, row: Row) -> None:
    """Write sums of whole lines, the input of the last moving sum, after `margin` zeros.

    With one or three orders they are in `totals`, with two in `other`. Without sharpening `carry`
    has the sum before the first that is wanted.
    """
    loops, totals, other, margin = frame.loops, row.totals, row.other, row.margin
    pixel, ranges = row.pixel, row.ranges
    count = ranges[0, 1] - ranges[0, 0]
    running_sum(
        loops.running_words,
        row.words,
        row.places,
        row.leaving,
        row.ends,
        row.several,
        0,
        count,
        totals,
        margin,
        pixel,
        row.carry,
        row.words,
    )
    for level in range(1, frame.plan.order + 1):
        # The sums below are 0 outside of their range.
        fill(loops.fill_sums, totals, 0, margin, 0)
        fill(loops.fill_sums, totals, count * pixel + margin, margin, 0)
        fill(loops.fill_sums, row.carry, 0, pixel, 0)
        runs = ranges[level, 1] - ranges[level - 1, 0] + frame.plan.box_offset
        count = ranges[level, 1] - ranges[level, 0]
        target = (count - runs) * pixel + margin
        last = level == frame.plan.order
        runs -= count * int(last)
        running_sum(
            loops.running_sums,
            totals,
            row.in_order,
            row.in_order_leaving,
            row.in_order,
            0,
            0,
            runs,
            other,
            target,
            pixel,
            row.carry,
            row.words,
        )
        if not last:
            totals, other = other, totals


@borrowing
def begin_sharpened(frame: Frame, row: Row, sums: Integers, t: int, flags: int) -> None:
    """Set `carry` to the sharpened sum before number t, from its pixels in `sums`."""
    plan, taps, m = frame.plan, frame.taps, frame.plan.micro_image_size
    starts, count = row.before, plan.box
    if plan.order == 0:
        count = whole(plan, frame.first, t - 1, row.low - m, row.high + m, starts, ZERO)
        for k in range(count):
            starts[k] -= row.low
    else:
        for k in range(count):
            starts[k] = k + t - count + plan.box_offset - row.ranges[plan.order - 1, 0]
    before, behind = taps.side * (flags & 1), taps.side * (flags >> 1)
    middle = taps.centre - 2 * taps.side + before + behind
    bias = taps.zero * (middle - before - behind) * count
    sharpened_start(
        frame.loops.sharpened_start,
        sums,
        starts,
        count,
        row.margin,
        m * row.pixel,
        row.pixel,
        row.carry,
        middle,
        before,
        behind,
        bias,
        row.words,
    )
