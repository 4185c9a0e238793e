# SPDX-License-Identifier: Apache-2.0
"""A strip of columns, which a thread goes down: what stays the same in all of its lines."""

from typing import NamedTuple

import numpy as np

from plenofir.ground.kept_code import inner
from plenofir.refocus.compiled.column_vectors import fill
from plenofir.refocus.compiled.parameters import PAD, ZERO, Frame, Integers
from plenofir.refocus.compiled.places import aligned
from plenofir.refocus.compiled.rows import Row, Summands, row_of
from plenofir.refocus.compiled.vector_code import LINE_BYTES

PIECE = 512
"""Samples of a line that are summed, divided and written in one go."""


class Memory(NamedTuple):
    """Working memory of a thread."""

    piece: int  # sums of a line that are divided and written in one go
    values: Integers
    totals: Integers  # sharpened sums
    factors: Integers  # `weights_table` in 64 bits
    table: Integers  # and as wide as sums
    reached: Integers  # weight of each of the lines that are summed together
    multiplier: Integers  # `Taps.multiplier`, in a vector


class Strip(NamedTuple):
    """Columns of the result from `column0` to `column1` - 1, as sums s0 to s1 - 1."""

    column0: int
    column1: int
    s0: int
    s1: int
    row: Row
    width: int  # samples of a line
    pitch: int  # samples from a line of `picture` to the next
    picture: Integers  # results of the lines that are summed together
    sample_places: Integers  # for each sample where its sum lies
    entries: Integers  # for each sample of sums where its weight lies in the table
    alike: Integers  # for each piece whether all of its sums have one weight
    # for each sharpened sum its flags (`Taps.columns`), and the next one with others
    runs: Integers
    summands: Summands


@inner
def memory_of(frame: Frame) -> Memory:
    """Memory for any strip."""
    channels, loops = frame.plan.channels, frame.loops
    lanes = LINE_BYTES // loops.word_bytes
    piece = max(1, PIECE // channels // frame.plan.columns.scale)
    piece -= piece % PAD if piece > PAD else 0
    size = (piece * channels + PAD) * lanes
    factors = np.empty(frame.weights.columns.size * 3 * lanes, np.uint64)
    reached = np.empty(lanes, np.int64)
    for line in range(lanes):
        reached[line] = -1
    multiplier = aligned(lanes, loops.word_bytes)
    fill(loops.fill_words, multiplier, 0, lanes, frame.taps.multiplier)
    return Memory(
        piece,
        aligned(size, loops.word_bytes),
        aligned(int(frame.taps.side > 0) * size, loops.sum_bytes),
        factors,
        aligned(factors.size, loops.sum_bytes),
        reached,
        multiplier,
    )


@inner
def _sample_index(frame: Frame, column0: int, width: int, pixel: int) -> Integers:
    """For each sample of a line, repeated ones included, where its sum lies."""
    columns, channels = frame.plan.columns, frame.plan.channels
    lanes = LINE_BYTES // frame.loops.word_bytes
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
    return index


@inner
def _weight_entries(frame: Frame, s0: int, entries: Integers, alike: Integers, piece: int) -> None:
    """Write where the weight of each sample lies, and which pieces have one weight."""
    columns, channels = frame.plan.columns, frame.plan.channels
    places, different = frame.weights.places, frame.weights.columns.size
    lanes = LINE_BYTES // frame.loops.word_bytes
    for k in range(alike.size):
        alike[k] = 1
    for k in range(entries.size):
        entries[k] = 0
        if different > 1:
            o = max((s0 + k // channels) * columns.scale - columns.base, 0)
            entries[k] = places[min(o, columns.outputs - 1)] * 3 * lanes
            part = k // channels // piece
            alike[part] &= int(entries[k] == entries[part * piece * channels])


@inner
def _summands(frame: Frame, row: Row, s0: int, s1: int) -> Summands:
    """What the last moving sum of a line is made of: sums of columns, or such of whole lines."""
    order = frame.plan.order
    if order == 0:
        first = s0 - row.ranges[0, 0] if frame.taps.side > 0 else ZERO
        return Summands(row.words, row.places, row.leaving, row.several, first)
    places = np.empty(s1 - s0 + PAD, np.int64)
    leaving = np.empty(places.size, np.int64)
    begin = s0 - row.ranges[order - 1, 0] + frame.plan.box_offset
    for k in range(places.size):
        places[k] = (begin + k) * row.pixel + row.margin
        leaving[k] = places[k] - frame.plan.box * row.pixel
    return Summands(row.totals if order % 2 else row.other, places, leaving, ZERO, ZERO)


@inner
def strip_of(frame: Frame, memory: Memory, column0: int, column1: int) -> Strip:
    """Plan a strip, and allocate memory for it."""
    plan, columns = frame.plan, frame.plan.columns
    s0 = (column0 + columns.base) // columns.scale
    s1 = (column1 - 1 + columns.base) // columns.scale + 1
    row = row_of(frame, s0, s1)
    width = (column1 - column0) * plan.channels
    pitch = (width + 5 * PAD) // LINE_BYTES * LINE_BYTES
    lanes = LINE_BYTES // frame.loops.word_bytes
    entries = np.empty((s1 - s0) * plan.channels, np.int64)
    alike = np.empty((s1 - s0) // memory.piece + 1, np.int64)
    _weight_entries(frame, s0, entries, alike, memory.piece)
    flags = frame.taps.columns
    runs = np.empty((s1 - s0 if frame.taps.side > 0 else 0, 2), np.int64)
    for k in range(runs.shape[0] - 1, -1, -1):
        runs[k, 0], runs[k, 1] = flags[s0 + k - columns.base], s1 - s0
        if k + 1 < s1 - s0:
            runs[k, 1] = runs[k + 1, 1] if runs[k, 0] == runs[k + 1, 0] else k + 1
    return Strip(
        column0,
        column1,
        s0,
        s1,
        row,
        width,
        pitch,
        aligned(lanes * pitch, frame.loops.pixel_bytes),
        _sample_index(frame, column0, width, row.pixel),
        entries,
        alike,
        runs,
        _summands(frame, row, s0, s1),
    )
