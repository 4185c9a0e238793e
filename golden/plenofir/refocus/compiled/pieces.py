# SPDX-License-Identifier: Apache-2.0
"""Pieces of lines: sums along lines, divided, rounded and transposed back."""

import numpy as np

from plenofir.ground.kept_code import borrowing
from plenofir.refocus.compiled.parameters import Frame
from plenofir.refocus.compiled.row_vectors import (
    divide,
    finished_lines,
    quotients,
    sharpened_quotients,
    sharpened_sums,
    transpose_back,
)
from plenofir.refocus.compiled.rows import begin_sharpened
from plenofir.refocus.compiled.strips import Memory, Strip
from plenofir.refocus.compiled.weights import inverse_bits


@borrowing
def _narrow_quotients(
    frame: Frame, strip: Strip, memory: Memory, s: int, count: int, goal: int
) -> None:
    """Write quotients of `count` sharpened sums where sums of columns have 16 bits."""
    taps, row, summands = frame.taps, strip.row, strip.summands
    sharpened_quotients(
        frame.loops.sharpened_quotients,
        summands.sums,
        summands.places,
        summands.leaving,
        summands.first + s,
        count,
        frame.plan.micro_image_size * row.pixel,
        row.pixel,
        row.carry,
        taps.centre,
        taps.bias + taps.half,
        taps.drop + 1,
        taps.bias >> taps.drop + 1,
        taps.limit,
        memory.multiplier,
        taps.rest,
        memory.values,
        goal,
    )


@borrowing
def _wide_quotients(
    frame: Frame, strip: Strip, memory: Memory, s: int, count: int, goal: int
) -> None:
    """Write quotients of `count` sharpened sums, which all have the flags of the first."""
    taps, row, summands, channels = frame.taps, strip.row, strip.summands, frame.plan.channels
    flags = strip.runs[s, 0]
    before, behind = taps.side * (flags & 1), taps.side * (flags >> 1)
    sharpened_sums(
        frame.loops.sharpened_sums,
        summands.sums,
        summands.places,
        summands.leaving,
        row.ends,
        summands.several,
        summands.first + s,
        count,
        frame.plan.micro_image_size * row.pixel,
        row.pixel,
        row.carry,
        taps.centre - 2 * taps.side + before + behind,
        before,
        behind,
        taps.bias,
        taps.drop,
        memory.totals,
        memory.values,
    )
    divide(
        frame.loops.divide,
        memory.totals,
        0,
        memory.values,
        goal,
        count * channels,
        strip.entries,
        s * channels,
        memory.table,
        16 * frame.loops.sum_bytes - frame.weights.bits - 1,
        frame.plan.most,
    )


@borrowing
def _sharpened(frame: Frame, strip: Strip, memory: Memory, s: int, end: int, full: bool) -> None:
    """Write quotients of the sharpened sums s to end - 1, counted from s0.

    `full`: the lines have all of their weight.
    """
    row, runs, goal = strip.row, strip.runs, 0
    while s < end:
        flags, count = runs[s, 0], min(end, runs[s, 1]) - s
        if s == 0 or runs[s - 1, 1] == s:
            begin_sharpened(frame, row, strip.summands.sums, strip.s0 + s, flags)
        if full and flags == 3 and frame.taps.zero > 0 and strip.summands.several == 0:
            _narrow_quotients(frame, strip, memory, s, count, goal)
        else:
            _wide_quotients(frame, strip, memory, s, count, goal)
        s, goal = s + count, goal + count * row.pixel


@borrowing
def _different_weights(frame: Frame, strip: Strip, memory: Memory, s: int, count: int) -> None:
    """Write quotients of sums s to s + count - 1, each with the weight of its place."""
    row, loops, channels = strip.row, frame.loops, frame.plan.channels
    quotients(
        loops.quotients,
        strip.summands.sums,
        strip.summands.places,
        strip.summands.leaving,
        row.ends,
        strip.summands.several,
        s,
        count,
        memory.values,
        row.pixel,
        row.carry,
        strip.entries,
        s * channels,
        strip.alike[s // memory.piece],
        memory.table,
        16 * loops.sum_bytes - frame.weights.bits - 1,
        frame.plan.most,
    )


@borrowing
def _one_weight(frame: Frame, strip: Strip, memory: Memory, s: int, count: int, rest: int) -> None:
    """Write pixels of sums s to s + count - 1, which have one weight."""
    row, loops, channels, weights = strip.row, frame.loops, frame.plan.channels, frame.weights
    lanes, entry = memory.reached.size, strip.entries[s * channels]
    weight = memory.reached[0] * weights.columns[entry // (3 * lanes)] * weights.twice
    finished_lines(
        loops.finished_lines,
        strip.summands.sums,
        strip.summands.places,
        strip.summands.leaving,
        s,
        count,
        row.carry,
        memory.table,
        entry,
        rest,
        frame.plan.most,
        weight // 2,
        inverse_bits(weight, frame.plan.most),
        strip.picture,
        s * channels,
        strip.pitch,
        memory.values,
    )


@borrowing
def _transpose_back(frame: Frame, strip: Strip, memory: Memory, s: int, count: int) -> None:
    """Write the quotients of sums s to s + count - 1 as samples of lines, repeated if need be."""
    columns, channels = frame.plan.columns, frame.plan.channels
    # Sums at the edges of the strip are not repeated as often.
    o0 = max(strip.column0, (strip.s0 + s) * columns.scale - columns.base)
    o1 = min(strip.column1, (strip.s0 + s + count) * columns.scale - columns.base)
    first = (o0 - strip.column0) * channels
    transpose_back(
        frame.loops.transpose_back,
        memory.values,
        strip.sample_places,
        first,
        s * strip.row.pixel,
        strip.picture,
        first,
        strip.pitch,
        (o1 - o0) * channels,
    )


@borrowing
def write_pieces(frame: Frame, strip: Strip, memory: Memory) -> None:
    """Write `picture`, the results of the lines that are summed together."""
    reached, sharpened = memory.reached, frame.taps.side > 0
    even = True
    for line in range(reached.size):
        even &= reached[line] == reached[0]
    full = even and reached[0] == frame.plan.box
    # Sums that are pixels each, a single one that enters with each of them.
    simple = (
        even and not sharpened and strip.summands.several == 0 and frame.plan.columns.scale == 1
    )
    for s in range(0, strip.s1 - strip.s0, memory.piece):
        count = min(memory.piece, strip.s1 - strip.s0 - s)
        # With one weight, of more than 1, the scale is a part of what is dropped.
        entry = strip.entries[s * frame.plan.channels]
        scale = np.int64(memory.factors[entry + reached.size])
        rest = 8 * frame.loops.sum_bytes - frame.weights.bits - 1
        while scale > 1:
            scale, rest = scale // 2, rest - 1
        if simple and strip.alike[s // memory.piece] == 1 and rest >= 0:
            _one_weight(frame, strip, memory, s, count, rest)
            continue
        if sharpened:
            _sharpened(frame, strip, memory, s, s + count, full)
        else:
            _different_weights(frame, strip, memory, s, count)
        _transpose_back(frame, strip, memory, s, count)
