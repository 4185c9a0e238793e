# SPDX-License-Identifier: Apache-2.0
"""Sums along several lines at once: which places they take, whole lines, sharpened ones."""

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
    entering,
    inner,
    ranges_of,
    whole,
)
from plenofir.refocus.row_vectors import (
    divide,
    running_sum,
    sharpened_quotients,
    sharpened_start,
    sharpened_sums,
)
from plenofir.refocus.vector_code import LINE_BYTES
from plenofir.refocus.vectors import fill


class Row(NamedTuple):
    """Sums along several lines at once."""

    ranges: Integers
    low: int  # pixels of a line that are taken
    high: int
    margin: int  # zeros on both sides of sums: of 3 M pixels with sharpening, of M without
    words: Integers  # sums of columns
    starts: int
    start: Integers  # places of so many pixels in the sum before the first
    # places of pixels that enter: for sum t those from ends[t] on; `several` 0: one for each sum
    places: Integers
    ends: Integers
    several: int
    pixel: int  # samples of all lines in a pixel
    carry: Integers
    totals: Integers
    other: Integers


@inner
def row_of(plan: Plan, taps: Taps, first: Integers, s0: int, s1: int, steps: Steps) -> Row:
    """Plan sums s0 to s1 - 1 of a line, and allocate memory for them."""
    m, columns = plan.micro_image_size, plan.columns
    pixel = plan.channels * LINE_BYTES // steps.word_bytes
    ranges = ranges_of(plan, columns, taps, s0, s1)
    reach = -(m - 1) * (plan.shift - 1)
    t0, count = ranges[0, 0], ranges[0, 1] - ranges[0, 0]
    low, high = plan.step * (t0 - 1) - m + 1, plan.step * (t0 + count - 1) + 1
    low = min(columns.length, max(0, low + min(0, reach)))
    high = max(low, min(columns.length, high + max(0, reach)))
    # Sharpened sums take in pixels from one lens before them to one behind them.
    beside = m * int(taps.side > 0)
    margin = m + 2 * beside
    start, ends = np.empty(m, np.int64), np.empty(count + 1, np.int64)
    places = np.empty(count * plan.step + 2 * margin + PAD, np.int64)
    starts = whole(plan, plan.step * (t0 - 1), low, high, start, ZERO)
    for k in range(starts):
        start[k] = (start[k] - low + margin) * pixel
    n, single = ZERO, plan.common == 1
    ends[0] = 0
    for t in range(count):
        at = plan.step * (t0 + t)
        n = entering(plan, first, at, low - beside, high + m + beside, places, n)
        if single and n == t:
            # No pixel enters or leaves.
            places[n] = high + m + margin
            n += 1
        ends[t + 1] = n
    for k in range(places.size):
        places[k] = (places[k] - low + margin) * pixel if k < n else margin * pixel
    memory = (count + 2 * m + 2 * margin + PAD) * pixel * int(plan.order > 0)
    size = (high - low + 2 * margin + (1 + int(single)) * m + PAD) * pixel
    words = aligned(size, steps.word_bytes)
    if taps.zero > 0:
        fill(steps.fill_words, words, 0, size, taps.zero)
    return Row(
        ranges,
        low,
        high,
        margin * pixel,
        words,
        starts,
        start,
        places,
        ends,
        int(not single),
        pixel,
        aligned(pixel, steps.sum_bytes),
        aligned(memory, steps.sum_bytes),
        aligned(memory, steps.sum_bytes),
    )


@inner
def whole_lines(plan: Plan, row: Row, steps: Steps) -> Integers:
    """Sums of whole lines: the input of the last moving sum, after `margin` zeros.

    Without sharpening `carry` has the sum before the first that is wanted.
    """
    words, margin, totals, other = row.words, row.margin, row.totals, row.other
    m, pixel, ranges = plan.micro_image_size, row.pixel, row.ranges
    count = ranges[0, 1] - ranges[0, 0]
    box = m * pixel
    running_sum(
        steps.running_words,
        words,
        row.places,
        row.ends,
        row.several,
        0,
        count,
        box,
        totals,
        margin,
        pixel,
        row.carry,
        words,
    )
    places = np.empty(count + 2 * m, np.int64)
    for k in range(places.size):
        places[k] = k * pixel + margin
    for level in range(1, plan.order + 1):
        # The sums below are 0 outside of their range.
        fill(steps.fill_sums, totals, 0, margin, 0)
        fill(steps.fill_sums, totals, count * pixel + margin, margin, 0)
        fill(steps.fill_sums, row.carry, 0, pixel, 0)
        runs = ranges[level, 1] - ranges[level - 1, 0] + plan.box_offset
        count = ranges[level, 1] - ranges[level, 0]
        target = (count - runs) * pixel + margin
        last = level == plan.order
        runs -= count * int(last)
        running_sum(
            steps.running_sums,
            totals,
            places,
            places,
            0,
            0,
            runs,
            box,
            other,
            target,
            pixel,
            row.carry,
            words,
        )
        if not last:
            totals, other = other, totals
    return totals


@inner
def _begin_sharpened(
    plan: Plan, taps: Taps, row: Row, sums: Integers, t: int, flags: int, steps: Steps
) -> None:
    """Set `carry` to the sharpened sum before number t, from its pixels in `sums`."""
    m, pixel = plan.micro_image_size, row.pixel
    starts, count = np.empty(m, np.int64), m
    if plan.order == 0:
        count = whole(plan, t - 1, row.low - m, row.high + m, starts, ZERO)
        for k in range(count):
            starts[k] -= row.low
    else:
        for k in range(m):
            starts[k] = k + t - m + plan.box_offset - row.ranges[plan.order - 1, 0]
    before, behind = taps.side * (flags & 1), taps.side * (flags >> 1)
    middle = taps.centre - 2 * taps.side + before + behind
    bias = taps.zero * (middle - before - behind) * count
    sharpened_start(
        steps.sharpened_start,
        sums,
        starts,
        count,
        row.margin,
        m * pixel,
        pixel,
        row.carry,
        middle,
        before,
        behind,
        bias,
        row.words,
    )


@inner
def sharpened_values(
    plan: Plan,
    taps: Taps,
    pixel_bits: int,
    row: Row,
    sums: Integers,
    places: Integers,
    several: int,
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
    multiplier: Integers,
    steps: Steps,
) -> None:
    """Values of the sharpened sums s to end - 1, counted from s0."""
    # Places, or their ends, are those from number `first` on. `runs` has for each sum its flags
    # (`Taps.columns`), and the next one with others. `full`: lines have all of their weight.
    channels, pixel = plan.channels, row.pixel
    box, shift = plan.micro_image_size * pixel, 16 * steps.sum_bytes - pixel_bits - 1
    goal, floor = 0, taps.bias >> taps.drop + 1
    while s < end:
        flags, until = runs[s, 0], min(end, runs[s, 1])
        if s == 0 or runs[s - 1, 1] == s:
            _begin_sharpened(plan, taps, row, sums, s0 + s, flags, steps)
        count, number = until - s, first + s
        if full and flags == 3 and taps.zero > 0 and several == 0:
            sharpened_quotients(
                steps.sharpened_quotients,
                sums,
                places,
                number,
                count,
                box,
                pixel,
                row.carry,
                taps.centre + taps.side,
                taps.bias + taps.half,
                taps.drop + 1,
                floor,
                taps.limit,
                multiplier,
                taps.rest,
                values,
                goal,
            )
        else:
            before, behind = taps.side * (flags & 1), taps.side * (flags >> 1)
            middle = taps.centre - 2 * taps.side + before + behind
            sharpened_sums(
                steps.sharpened_sums,
                sums,
                places,
                row.ends,
                several,
                number,
                count,
                box,
                pixel,
                row.carry,
                middle,
                before,
                behind,
                taps.bias,
                taps.drop,
                totals,
                values,
            )
            divide(
                steps.divide,
                totals,
                0,
                values,
                goal,
                count * channels,
                entries,
                s * channels,
                table,
                shift,
                plan.most,
            )
        s, goal = until, goal + count * pixel
