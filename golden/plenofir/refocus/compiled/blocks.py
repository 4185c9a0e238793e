# SPDX-License-Identifier: Apache-2.0
"""Blocks of a refocused image, computed from top to bottom, as many lines at once as lanes.

1. Columns: each line of sums is the line above, plus the input line that enters the box, minus the
   one that leaves it (`columns`, after `plenofir.refocus.operator.moving_sums`).
2. Rows: along one line this is a chain of dependent additions. So lines are transposed: a vector
   (`column_vectors`) holds one sample of each line, and one addition serves all lines.
3. The sums are divided and rounded, transposed back and written (`pieces`); lines that repeat are
   copied. Interpolation and sharpening need whole lines of sums in between.

No sum can overflow: `plans` derives its width from M, order and depth.
"""

from functools import partial
from pathlib import Path

import numpy as np

from plenofir.ground.kept_code import borrowing, compiled
from plenofir.refocus.compiled.column_vectors import fill, narrow, sum_lines
from plenofir.refocus.compiled.columns import Lines, column_lines, column_sums
from plenofir.refocus.compiled.parameters import PAD, ZERO, Frame, Integers
from plenofir.refocus.compiled.pieces import write_pieces
from plenofir.refocus.compiled.row_vectors import copy_line, take_number
from plenofir.refocus.compiled.rows import whole_lines
from plenofir.refocus.compiled.strips import Memory, Strip, memory_of, strip_of
from plenofir.refocus.compiled.weights import weights_table

# Modules whose functions and numbers become part of the code.
INLINED = tuple(
    Path(__file__).with_name(f"{name}.py")
    for name in (
        *("columns", "machine_code", "parameters", "pieces", "places", "rows"),
        *("strips", "vector_code", "weights"),
    )
)


@borrowing
def _begin_row(frame: Frame, strip: Strip) -> None:
    """Begin the sums along lines, whose sums of columns are there."""
    plan, loops, row = frame.plan, frame.loops, strip.row
    lanes = row.pixel // plan.channels
    after = (row.high - row.low) * row.pixel + row.margin
    fill(loops.fill_words, row.words, after, PAD * lanes, frame.taps.zero)
    fill(loops.fill_sums, row.carry, 0, row.pixel, 0)
    sum_lines(
        loops.sum_words,
        row.words,
        row.start,
        0,
        row.starts,
        row.starts,
        0,
        row.carry,
        0,
        0,
        row.pixel,
    )
    if plan.order > 0:
        whole_lines(frame, row)


@borrowing
def _update_weights(frame: Frame, memory: Memory, t: int) -> None:
    """Compute the divisors of lines t, t + 1, ... anew if they are others than before."""
    rows, loops, others = frame.plan.rows, frame.loops, 0
    reached, weights = memory.reached, frame.weights.rows
    for line in range(reached.size):
        o = max((t + line) * rows.scale - rows.base, 0)
        weight = weights[min(o, rows.outputs - 1)]
        others += int(weight != reached[line])
        reached[line] = weight
    if others > 0:
        weights_table(frame.weights, reached, 8 * loops.sum_bytes, memory.factors)
        narrow(loops.narrow, memory.factors, memory.table, memory.factors.size)


@borrowing
def _write_block(
    frame: Frame,
    strip: Strip,
    memory: Memory,
    lines: Lines,
    block: Integers,
    out: Integers,
    past: int,
) -> None:
    """Write a block of a strip to the result."""
    plan, rows, row = frame.plan, frame.plan.rows, strip.row
    lanes, picture = memory.reached.size, strip.picture
    out_pitch, left = plan.columns.outputs * plan.channels, strip.column0 * plan.channels
    # Sums of lines above the first begin with 0.
    begin = lines.ranges[0, 0] - plan.order * plan.box_offset
    begin -= int(frame.taps.side > 0) * plan.micro_image_size
    for t in range(begin, lines.t0, lanes):
        column_sums(frame, lines, t, min(lanes, lines.t0 - t), row.words, ZERO - 1)
    for t in range(lines.t0, lines.t1, lanes):
        count = min(lanes, lines.t1 - t)
        column_sums(frame, lines, t, count, row.words, row.margin)
        _begin_row(frame, strip)
        _update_weights(frame, memory, t)
        write_pieces(frame, strip, memory)
        for line in range(count):
            goal = rows.scale * (t + line) - rows.base
            for to in range(max(goal, block[0]), min(goal + rows.scale, block[1])):
                copy_line(
                    frame.loops.copy_line,
                    out,
                    to * out_pitch + left,
                    picture,
                    line * strip.pitch,
                    strip.width,
                    past,
                )


@partial(compiled, inlined=INLINED)
def refocus_blocks(
    frame: Frame, out: Integers, blocks: Integers, counter: Integers, past: int
) -> None:
    """Write the blocks of a refocused image that no other thread has taken.

    `out`: bytes of the result. A line of `blocks` is the first and last + 1 row and column of a
    block of outputs; `counter` has the number of the next one, and threads share it. `past` 1:
    written past the caches.
    """
    memory = memory_of(frame)
    claimed = np.empty(1, np.int64)
    take_number(frame.loops.take_number, counter, claimed)
    block = claimed[0]
    while block < blocks.shape[0]:
        column0 = blocks[block, 2]
        strip = strip_of(frame, memory, column0, blocks[block, 3])
        while block < blocks.shape[0] and column0 == blocks[block, 2]:
            row0, row1 = blocks[block, 0], blocks[block, 1]
            lines = column_lines(frame, row0, row1, strip.row.low, strip.row.high)
            _write_block(frame, strip, memory, lines, blocks[block], out, past)
            take_number(frame.loops.take_number, counter, claimed)
            block = claimed[0]
