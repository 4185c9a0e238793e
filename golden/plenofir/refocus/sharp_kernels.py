# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the fast refocuser with sharpening: sums, three taps, one division.

A strip of the output is made from top to bottom, some lines at a time. Sums come from
`plenofir.refocus.kernels`, undivided; those of the last 2 M lines stay at hand, so none is made
twice. The taps of three lines go into a line of wider words, from which the taps along the line and
the division make the pixels.

No number can overflow: `plenofir.refocus.fast` derives the width of words from that of sums and the
weights.
"""

from typing import NamedTuple

import numpy as np

from plenofir.refocus.kernels import Axis, Integers, Plan, _copy, compiled, refocus_blocks
from plenofir.refocus.vectors import LINE_BYTES, three_lines, three_pixels

LINES = 64
"""Lines of sums that are made at once."""


class Filter(NamedTuple):
    """The taps, all in whole numbers; the plan has the division."""

    side: int
    bits: int  # of the scale of a dimension
    half: int  # of all that is divided by
    most: int  # largest quotient times the divisor, and its half


@compiled
def _part(axis: Axis, start: int, stop: int) -> Axis:
    """Outputs `start` to `stop`, pixels of the image."""
    base = start + axis.base - axis.start
    return Axis(axis.length, stop - start, start, base, axis.scale)


@compiled
def sharpened_blocks(
    x: Integers,
    out: Integers,
    plan: Plan,
    taps: Filter,
    blocks: Integers,
    like: Integers,
    wide: Integers,
) -> None:
    """Make blocks of a sharpened image; arguments as of `refocus_blocks`."""
    # `wide` has the type of the words, signed.
    m, channels, rows, columns = plan.micro_image_size, plan.channels, plan.rows, plan.columns
    lanes = LINE_BYTES // wide.itemsize
    lens, stride = m * channels, out.shape[1]
    # Sums are made a chunk at a time; the chunk before has all the lines that are needed still.
    chunk = max(LINES, -(-2 * m // LINES) * LINES)
    whole = np.zeros((1, 4), np.int64)
    for block in range(blocks.shape[0]):
        row0, row1, column0, column1 = blocks[block]
        # From here on rows and columns are those of the image.
        goal, last = rows.start + row0, rows.start + row1
        left = max(0, columns.start + column0 - m)
        right = min(columns.length, columns.start + column1 + m)
        top, end = max(0, goal - m), min(rows.length, last + m)
        made = top
        width = (right - left) * channels
        kept = np.empty(2 * chunk * width + lanes, like.dtype)
        lines = kept[: 2 * chunk * width].reshape(2 * chunk, width)
        words = np.empty(width + 2 * lens + lanes, wide.dtype)
        samples = (column1 - column0) * channels
        begin = lens + (columns.start + column0 - left) * channels
        direct = samples // lanes * lanes
        rest = np.empty(lanes, out.dtype)
        while goal < last:
            until = min(made + chunk, end)
            whole[0, 1], whole[0, 3] = until - made, right - left
            part = Plan(
                m,
                plan.shift,
                plan.order,
                channels,
                plan.common,
                plan.step,
                plan.box_offset,
                _part(rows, made, until),
                _part(columns, left, right),
                0,
                1,
                0,
                0,
            )
            place = (made - top) % (2 * chunk)
            refocus_blocks(x, lines[place : place + until - made], part, whole, like)
            made = until
            ready = last if made == end else min(last, made - m)
            for row in range(goal, ready):
                above = row - m if row >= m else row
                below = row + m if row + m < rows.length else row
                above = (above - top) % (2 * chunk) * width
                below = (below - top) % (2 * chunk) * width
                own = (row - top) % (2 * chunk) * width
                for k in range(0, width, lanes):
                    three_lines(
                        kept,
                        above + k,
                        own + k,
                        below + k,
                        words,
                        lens + k,
                        taps.bits,
                        taps.side,
                    )
                # A tap outside the image counts as the pixel itself.
                if left == 0:
                    _copy(words[:lens], words[lens : 2 * lens])
                if right == columns.length:
                    _copy(words[lens + width : 2 * lens + width], words[width : lens + width])
                target = (row - rows.start) * stride + column0 * channels
                for k in range(0, direct, lanes):
                    three_pixels(
                        words,
                        begin + k,
                        lens,
                        out,
                        target + k,
                        like,
                        taps.bits,
                        taps.side,
                        taps.half,
                        taps.most,
                        plan.multiplier,
                        plan.drop,
                    )
                if direct < samples:
                    three_pixels(
                        words,
                        begin + direct,
                        lens,
                        rest,
                        0,
                        like,
                        taps.bits,
                        taps.side,
                        taps.half,
                        taps.most,
                        plan.multiplier,
                        plan.drop,
                    )
                    _copy(
                        out[row - rows.start, column0 * channels + direct : column1 * channels],
                        rest[: samples - direct],
                    )
            goal = max(goal, ready)
