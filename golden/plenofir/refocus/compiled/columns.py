# SPDX-License-Identifier: Apache-2.0
"""Sums of columns: each line of sums is the line above, plus a line that enters, minus one.

Interpolation takes moving sums of such sums, B lines apart, and sharpening three of those, M lines
apart: each follows from the line above it, so only a few lines are kept, whatever M and B are.
Where B is M, all of them are M apart and in one group.
"""

from typing import NamedTuple

import numpy as np

from plenofir.ground.kept_code import borrowing, inner
from plenofir.refocus.compiled.column_vectors import (
    add_line,
    next_line,
    next_words,
    sum_lines,
    three_lines,
    transpose,
)
from plenofir.refocus.compiled.parameters import PAD, ZERO, Frame, Integers, Loops, Plan
from plenofir.refocus.compiled.places import aligned, entering, ranges_of, whole
from plenofir.refocus.compiled.vector_code import LINE_BYTES

CHUNK = 512
"""Samples of a line whose sums are made and transposed in one go, in the nearest cache."""
_PITCH = CHUNK + PAD


class Lines(NamedTuple):
    """Working memory for sums of columns."""

    t0: int  # first sum of a line that the block takes
    t1: int  # and the last + 1
    ranges: Integers
    left: int  # first sample within a line of the image
    width: int  # samples of a line
    span: int  # samples from a line of sums to the next
    lanes: int  # lines whose sums are made in one go
    states: int  # place of the last sums of the first position
    anew: bool  # whether S is summed anew for each line instead of updated
    # a line of zeros, lines of a chunk, the last sums of each position
    sums: Integers
    starts: Integers  # beginnings of lines in the image
    # Number 2 (position lanes + line), positions of all groups counted: in `starts` where the lines
    # that enter a sum begin; the next number: where those that leave it begin.
    ends: Integers
    coming: Integers  # for each line where one begins in the image that a later sum will need


@inner
def column_lines(frame: Frame, row0: int, row1: int, low: int, high: int) -> Lines:
    """Memory for the sums that rows row0 to row1 - 1 take, of the columns `low` to `high` - 1."""
    plan, rows, each = frame.plan, frame.plan.rows, frame.plan.positions
    positions = plan.groups * each
    t0, t1 = (row0 + rows.base) // rows.scale, (row1 - 1 + rows.base) // rows.scale + 1
    lanes = LINE_BYTES // frame.loops.word_bytes
    width = (high - low) * plan.channels
    span = (width + 2 * PAD - 1) // PAD * PAD
    states = _PITCH * (1 + lanes)
    reach = int(frame.taps.side > 0) * plan.micro_image_size
    # If a step replaces half of the box or more, adding all of it anew takes no longer.
    few = 2 * plan.step >= plan.box and plan.step > 1
    return Lines(
        t0,
        t1,
        # Plain sums need one line more, from which the first that is wanted follows.
        ranges_of(plan, rows, reach, t0 - int(positions == 1), t1),
        low * plan.channels,
        width,
        span,
        lanes,
        states,
        positions == 1 and few,
        aligned(states + positions * (each + 1) // 2 * span, frame.loops.word_bytes),
        np.empty((positions * lanes + 1) * max(plan.micro_image_size, 2 * plan.common), np.int64),
        np.empty(2 * positions * lanes + 1, np.int64),
        np.empty(lanes, np.int64),
    )


@borrowing
def _find_lines(frame: Frame, lines: Lines, t: int, count: int) -> None:
    """Write which lines enter and leave sums t, t + 1, ..., and which later ones will need."""
    plan, first, height = frame.plan, frame.first, frame.plan.rows.length
    starts, ends, coming = lines.starts, lines.ends, lines.coming
    low, high = lines.ranges[0, 0], lines.ranges[0, 1]
    below = int(frame.taps.side > 0) * plan.micro_image_size + plan.order * plan.box_offset
    pitch = plan.columns.length * plan.channels
    n = ZERO
    behind = number = ZERO
    for position in range(plan.groups * plan.positions):
        if number == plan.positions:
            # The next group.
            behind += plan.micro_image_size - number * plan.box
            number = ZERO
        for line in range(count):
            here = 2 * (position * lines.lanes + line)
            at = t + line + below - behind
            p = plan.step * at
            ends[here] = ends[here + 1] = n
            if lines.anew or at == low:
                n = whole(plan, first, p, ZERO, height, starts, n)
                ends[here + 1] = n
            elif low < at < high:
                n = entering(plan, first, p, ZERO, height, starts, n)
                ends[here + 1] = n
                n = entering(plan, first, p - plan.box, ZERO, height, starts, n)
            for k in range(ends[here], n):
                starts[k] *= pitch
            ends[here + 2] = n
        behind += plan.box
        number += 1
    for line in range(0 if lines.anew else count):
        coming[line] = starts[ends[2 * line]]
        p = plan.step * (t + lines.lanes + line + below)
        if entering(plan, first, p, ZERO, height, starts, n) > n:
            coming[line] = starts[n] * pitch


@borrowing
def _whole_tiles(frame: Frame, lines: Lines, t: int, count: int) -> int:
    """Tiles that `next_words` can make: none unless one line enters and leaves each sum."""
    plan, sharpened = frame.plan, int(frame.taps.side > 0)
    if lines.anew or count < lines.lanes or plan.order + sharpened >= 2:
        return 0
    ends, flags = lines.ends, frame.taps.rows
    low, high = lines.ranges[0, 0], lines.ranges[0, 1]
    for end in range(ends.size):
        if ends[end] != end:
            return 0
    for line in range(count):
        at = t + line + plan.box_offset
        inside = low <= at - plan.box and at < high
        if plan.order == 1 and not inside:
            return 0
        if sharpened and flags[t + line - plan.rows.base] != 3:
            return 0
    return lines.width // (2 * lines.lanes)


@borrowing
def _update_sums(frame: Frame, lines: Lines, line: int, start: int, samples: int) -> None:
    """Sums of all positions for a line, `samples` of them from number `start` on."""
    loops, starts = frame.loops, lines.starts
    positions = frame.plan.groups * frame.plan.positions
    plain = positions == 1
    row, left = _PITCH * (1 + line), lines.left + start
    for position in range(positions):
        here = 2 * (position * lines.lanes + line)
        begin, middle, end = lines.ends[here], lines.ends[here + 1], lines.ends[here + 2]
        target = base = lines.states + position * lines.span + start
        if plain:
            target, base = row, base if line == 0 else row - _PITCH
        if lines.anew:
            base = 0
        if middle - begin == 1 and end - middle == 1:
            ahead = (lines.coming[line] if position == 0 else starts[begin]) + left
            next_line(
                loops.next_line,
                frame.pixels,
                starts[begin] + left,
                starts[middle] + left,
                ahead,
                lines.sums,
                base,
                target,
                samples,
            )
        elif plain or end > begin:
            sum_lines(
                loops.sum_pixels,
                frame.pixels,
                starts,
                begin,
                middle,
                end,
                left,
                lines.sums,
                base,
                target,
                samples,
            )


@borrowing
def _interpolate(plan: Plan, loops: Loops, lines: Lines, at: int, start: int, samples: int) -> int:
    """Moving sums of sums, for the line whose first position is sum `at`; where the last are."""
    place = lines.states + start
    for level in range(1, plan.order + 1):
        count = plan.positions - level
        below, place = place, place + plan.groups * (count + 1) * lines.span
        low, high = lines.ranges[level - 1, 0], lines.ranges[level - 1, 1]
        enters, number, a, b = at, ZERO, place, below
        for _ in range(plan.groups * count):
            if number == count:
                # The next group.
                enters += count * plan.box - plan.micro_image_size
                b += lines.span
                number = ZERO
            if low <= enters < high:
                add_line(loops.add_line, lines.sums, a, b, samples, 0)
            if low <= enters - plan.box < high:
                add_line(loops.add_line, lines.sums, a, b + lines.span, samples, 1)
            enters -= plan.box
            a, b = a + lines.span, b + lines.span
            number += 1
        at -= plan.box_offset
    return place


@borrowing
def _copy(frame: Frame, lines: Lines, place: int, target: int, samples: int) -> None:
    """Copy sums: those of no line that enters or leaves."""
    sum_lines(
        frame.loops.sum_pixels,
        frame.pixels,
        lines.starts,
        0,
        0,
        0,
        0,
        lines.sums,
        place,
        target,
        samples,
    )


@borrowing
def _finish_line(frame: Frame, lines: Lines, t: int, row: int, place: int, samples: int) -> None:
    """Sums of a line from those of its positions, sharpened if asked for."""
    if frame.taps.side == 0:
        _copy(frame, lines, place, row, samples)
        return
    flags = frame.taps.rows[t - frame.plan.rows.base]
    behind = place if flags & 2 else place + lines.span
    before = place + 2 * lines.span if flags & 1 else place + lines.span
    three_lines(
        frame.loops.three_lines,
        lines.sums,
        place + lines.span,
        before,
        behind,
        row,
        samples,
        frame.taps.centre,
        frame.taps.side,
        frame.taps.zero,
    )


@borrowing
def column_sums(frame: Frame, lines: Lines, t: int, count: int, words: Integers, into: int) -> None:
    """Sums of columns for lines t, t + 1, ...; transposed to words[into ...] if `into` >= 0."""
    plan, loops, taps = frame.plan, frame.loops, frame.taps
    sums, lanes, plain = lines.sums, lines.lanes, plan.groups * plan.positions == 1
    _find_lines(frame, lines, t, count)
    tiles = _whole_tiles(frame, lines, t, count) if into >= 0 else 0
    if tiles > 0:
        next_words(
            loops.next_words,
            frame.pixels,
            lines.starts,
            lines.coming,
            lines.left,
            sums,
            lines.states,
            lines.span,
            taps.centre,
            taps.side,
            taps.zero,
            tiles,
            words,
            into,
        )
    below = int(taps.side > 0) * plan.micro_image_size + plan.order * plan.box_offset
    for start in range(2 * lanes * tiles, lines.width, CHUNK):
        samples = min(CHUNK, lines.width - start)
        for line in range(count):
            row = _PITCH * (1 + line)
            _update_sums(frame, lines, line, start, samples)
            place = _interpolate(plan, loops, lines, t + line + below, start, samples)
            if into >= 0 and not plain:
                _finish_line(frame, lines, t + line, row, place, samples)
        if plain:
            _copy(frame, lines, _PITCH * count, lines.states + start, samples)
        if into >= 0:
            goal = into + start * lanes
            transpose(loops.transpose, sums, _PITCH, _PITCH, words, goal, samples)
