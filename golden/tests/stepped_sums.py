# SPDX-License-Identifier: Apache-2.0
"""The engines' sums step by step, by their schedules, with what their memories hold and no more."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from plenofir.refocus.focal_stack import StackLayout
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.sum_lanes import LaneLayout


def initial_index(layout: SumLayout, slice_: int, phase: int, *, held: bool) -> int | None:
    """Index of the pixel of a phase that entered last with output 0, or None.

    With `held` output 0 counts as the first of its group; otherwise pixels of the next group may
    have entered already.
    """
    m, group = layout.micro_image_size, layout.group_size(slice_)
    first = layout.offset(slice_)
    if held:
        first -= first % group
    last = first + group - 1
    index = last - phase * (layout.shifts[slice_] - 1) - layout.place_in_group(slice_, phase)
    index -= (index - phase) % m
    return index if index >= 0 else None


def is_initial(layout: SumLayout, slice_: int, phase: int, *, held: bool) -> bool:
    """Whether the pixel of `initial_index` is added to the first sum.

    That sum is, with `held`, the one that output 0 shows, otherwise the running sum. If each group
    begins a new sum, the running sum at output 0 holds no pixel of the group before.
    """
    index = initial_index(layout, slice_, phase, held=held)
    if index is None:
        return False
    place = index + phase * (layout.shifts[slice_] - 1) + layout.place_in_group(slice_, phase)
    group = layout.group_size(slice_)
    last = layout.offset(slice_) + group - 1
    if held:
        last -= layout.offset(slice_) % group
    if held or layout.pixels_leave:
        return place > last - layout.box(slice_)
    return place >= last - last % group


def lane_is_initial(layout: LaneLayout, slice_: int, index: int, *, held: bool) -> bool:
    """Whether a pixel is in the sum before output 0; with `held`, in that of its group."""
    sums = layout.sums
    last = -1
    if held:
        groups = range(sums.micro_image_size)
        last = -next(back for back in groups if sums.begins_group(slice_, -back))
    enters_with = index - sums.delay
    enters_with += sums.entering_age(slice_, index % sums.micro_image_size)
    return last - sums.box(slice_) < enters_with <= last


def first_index(layout: SumLayout, slice_: int, phase: int, *, held: bool) -> int | None:
    """Index of a phase's pixel that a line's first sums take up; None for none."""
    initial = is_initial(layout, slice_, phase, held=held)
    return initial_index(layout, slice_, phase, held=held) if initial else None


def history_place(layout: StackLayout, slice_: int, phase: int) -> int:
    """Place, among the lines of its phase, of the pixel that enters the sum of a slice.

    0 is the newest line in memory; -1 is the line that is just coming in.
    """
    return -(-layout.entering_age(slice_, phase) // layout.micro_image_size) - 1


def leaving_place(layout: StackLayout, slice_: int, phase: int) -> int:
    """Place, among the lines of its phase, of the pixel that leaves the sum of a slice."""
    return -(-layout.leaving_age(slice_, phase) // layout.micro_image_size) - 1


def steps_of(
    lines: Sequence[npt.NDArray[np.int64]], layout: SumLayout
) -> list[tuple[int | None, int, int | None]]:
    """The line that begins in each step, the index in it, and the sample.

    Empty steps fill up lines that are too short, and flush the last one.
    """
    steps: list[tuple[int | None, int, int | None]] = []
    for number, line in enumerate(lines):
        for k in range(layout.least_steps(len(line), columns=True)):
            sample = int(line[k]) if k < len(line) else None
            steps.append((number if k == 0 else None, k, sample))
    return steps + [(None, k, None) for k in range(layout.delay + 1)]


def moving_sum_lines(
    lines: Iterable[npt.NDArray[np.integer]],
    layout: SumLayout,
    slices: Sequence[int] | None = None,
) -> Iterator[npt.NDArray[np.int64]]:
    """Run lines through the moving sum, one after the other without a gap where that is possible.

    This models the engine step by step, with its rings of pixels for each phase: a pixel that they
    no longer hold cannot be used. Empty steps fill up lines that are too short, and flush the last
    line. Lines have any length K, S of each has the same shape; `slices` has one for each line, the
    first of the set for all if None.
    """
    m, delay = layout.micro_image_size, layout.delay
    queue = [np.asarray(line, np.int64) for line in lines]
    order = [0] * len(queue) if slices is None else list(slices)
    rings = [np.zeros(max(ring, 1), np.int64) for ring in layout.ring_lines]
    write = [0] * m

    steps = steps_of(queue, layout)
    due = -1
    results: list[list[int]] = [[] for _ in queue]
    for now, (begins, index, sample) in enumerate(steps):
        if begins is not None:
            current = begins
            base = list(write)
            first_sum = held_sum = 0
        phase = index % m
        if sample is not None:
            first_sum += sample * (index == first_index(layout, order[current], phase, held=False))
            held_sum += sample * (index == first_index(layout, order[current], phase, held=True))
        due_begins = steps[now - delay][0] if now >= delay else None
        if due_begins is not None:
            due, output = due_begins, 0
            total, result = first_sum, held_sum
            enter = []
            for v in range(m):
                initial = initial_index(layout, order[due], v, held=False)
                skipped = 0 if initial is None else initial // m + 1
                enter.append(base[v] + skipped)
        elif due >= 0:
            output += 1
            slice_ = order[due]
            v = layout.entering_phase(slice_, output)
            i = output + delay - layout.entering_age(slice_, v)
            ring = rings[v]
            if not layout.pixels_leave and layout.begins_group(slice_, output - 1):
                total = 0
            if 0 <= i < len(queue[due]):
                total += (
                    sample
                    if i == index and sample is not None and due == current
                    else int(ring[enter[v] % len(ring)])
                )
            left = layout.leaving_phase(slice_, output)
            i_left = output + delay - layout.leaving_age(slice_, left)
            if layout.pixels_leave and 0 <= i_left < len(queue[due]):
                total -= int(rings[left][(enter[left] - 1) % len(rings[left])])
            if i >= 0:
                enter[v] += 1
            if layout.begins_group(slice_, output):
                result = total
        if sample is not None:
            # Reads of this step come before its write.
            rings[phase][write[phase] % len(rings[phase])] = sample
            write[phase] += 1
        if due >= 0 and output < len(queue[due]):
            results[due].append(result)
            if len(results[due]) == len(queue[due]):
                yield np.array(results[due], np.int64)


def lane_sums(
    lines: Iterable[npt.NDArray[np.integer]],
    layout: LaneLayout,
    slices: Sequence[int] | None = None,
) -> Iterator[npt.NDArray[np.int64]]:
    """Run lines through the moving sum with P pixels a token, without a gap where that is possible.

    As `moving_sum_lines`.
    """
    sums, p, banks = layout.sums, layout.pixels, layout.banks
    delay = layout.delay
    queue = [np.asarray(line, np.int64) for line in lines]
    order = [0] * len(queue) if slices is None else list(slices)
    memory = np.zeros((banks, layout.rows), np.int64)

    # Tokens: the line that begins, and the pixels.
    tokens: list[tuple[int | None, npt.NDArray[np.int64] | None]] = []
    for number, line in enumerate(queue):
        words = np.pad(line, (0, -len(line) % p)).reshape(-1, p)
        for k in range(max(len(words), delay + 1)):
            tokens.append((number if k == 0 else None, words[k] if k < len(words) else None))
    tokens += [(None, None)] * (delay + 1)

    due = -1
    next_row = next_place = 0
    results: list[list[int]] = [[] for _ in queue]
    for now, (begins, word) in enumerate(tokens):
        due_begins = tokens[now - delay][0] if now >= delay else None
        if begins is not None:
            frozen = (next_row, next_place)
            current, count = begins, 0
            next_row, next_place = next_row + 1, 0
            base = next_row
            first = held_first = 0
            same = False
        else:
            count += 1
        if word is not None:
            for j in range(p):
                wraps, bank = divmod(next_place + j, banks)
                memory[bank, (next_row + wraps) % layout.rows] = word[j]
                index = count * p + j
                first += word[j] * lane_is_initial(layout, order[current], index, held=False)
                held_first += word[j] * lane_is_initial(layout, order[current], index, held=True)
            wraps, next_place = divmod(next_place + p, banks)
            next_row += wraps
        if due_begins is not None:
            due, row, place, steps, same = due_begins, base, 0, 0, True
            total, held = first, held_first
        elif due >= 0:
            wraps, place = divmod(place + p, banks)
            row += wraps
            steps += wraps
        if due < 0:
            continue
        slice_ = order[due]
        end_row, end_place = (next_row, next_place) if same else frozen

        def pixel(rows: int, bank: int) -> int:
            live = steps + rows >= 0 and (row + rows, bank) < (end_row, end_place)  # noqa: B023
            return int(memory[bank, (row + rows) % layout.rows]) if live else 0  # noqa: B023

        for j in range(p):
            wraps, here = divmod(place + j, banks)
            left = here - sums.box(slice_)
            total += pixel(wraps + layout.row(slice_, here), layout.bank(slice_, here))
            total -= pixel(wraps + layout.row(slice_, left), layout.bank(slice_, left))
            output = steps * banks + place + j
            if sums.begins_group(slice_, output):
                held = total
            if len(results[due]) < len(queue[due]):
                results[due].append(held)
                if len(results[due]) == len(queue[due]):
                    yield np.array(results[due], np.int64)


def focal_stack_lines(
    lines: Iterable[npt.NDArray[np.integer]], layout: StackLayout
) -> Iterator[npt.NDArray[np.int64]]:
    """Run lines through the moving sums of all slices, one after the other without a gap.

    This models the engine step by step: a pixel that the memory no longer holds cannot be used.
    Lines have any length K (for columns: one column of each frame); S of each has the shape
    (slices, K).
    """
    m, delay = layout.micro_image_size, layout.delay
    queue = [np.asarray(line, np.int64) for line in lines]
    slices = range(len(layout.shifts))
    history = [[0] * count for count in layout.history_lines]

    steps = steps_of(queue, layout)
    due = -1
    total = [0] * len(slices)
    first_sum, held_sum, result = list(total), list(total), list(total)
    results: list[list[list[int]]] = [[[] for _ in slices] for _ in queue]
    for now, (begins, index, sample) in enumerate(steps):
        phase = index % m
        value = sample or 0
        due_begins = steps[now - delay][0] if now >= delay else None
        if due_begins is not None:
            due, output = due_begins, 0
        elif due >= 0:
            output += 1
        for s in slices:
            if begins is not None:
                first_sum[s] = held_sum[s] = 0
            for sums, held in ((first_sum, False), (held_sum, True)):
                sums[s] += value * (index == first_index(layout, s, phase, held=held))
            if due_begins is not None:
                total[s], result[s] = first_sum[s], held_sum[s]
            elif due >= 0:
                v = layout.entering_phase(s, output)
                i = output + delay - layout.entering_age(s, v)
                place = history_place(layout, s, v)
                if not layout.pixels_leave and layout.begins_group(s, output - 1):
                    total[s] = 0
                if 0 <= i < len(queue[due]):
                    total[s] += value if place < 0 else history[v][place]
                left = layout.leaving_phase(s, output)
                i_left = output + delay - layout.leaving_age(s, left)
                if layout.pixels_leave and 0 <= i_left < len(queue[due]):
                    total[s] -= history[left][leaving_place(layout, s, left)]
                if layout.begins_group(s, output):
                    result[s] = total[s]
            if due >= 0 and output < len(queue[due]):
                results[due][s].append(result[s])
        # Reads of this step come before its write.
        history[phase] = [value, *history[phase]][: len(history[phase])]
        if due >= 0 and output == len(queue[due]) - 1:
            yield np.array(results[due], np.int64)
