# SPDX-License-Identifier: Apache-2.0
"""Several slices at once from one column memory, step by step.

The slices of a stack share their pixels and their delay; each has its own sums. Ages of pixels
depend only on phase and slice (`plenofir.refocus.moving_sum`). So if the lines of each phase form a
shift register, which advances with each line of the phase, each slice finds its pixels at fixed
places, and the column is the only address. For that, frames must begin a multiple of M lines apart.
The VHDL (``hdl/stack/focal_stack_pkg.vhd``) has the same functions.
"""

from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
import numpy.typing as npt

from plenofir.refocus.moving_sum import SumLayout, steps_of


class StackLayout(SumLayout):
    """Schedule of the moving sums of a stack: slice n is number n of `shifts`."""

    def history_place(self, slice_: int, phase: int) -> int:
        """Place, among the lines of its phase, of the pixel that enters the sum of a slice.

        0 is the newest line in memory; -1 is the line that is just coming in.
        """
        return -(-self.entering_age(slice_, phase) // self.micro_image_size) - 1

    def leaving_place(self, slice_: int, phase: int) -> int:
        """Place, among the lines of its phase, of the pixel that leaves the sum of a slice."""
        return -(-self.leaving_age(slice_, phase) // self.micro_image_size) - 1

    @cached_property
    def history_lines(self) -> tuple[int, ...]:
        """Lines of each phase that the column memory keeps, for all slices together."""
        m = self.micro_image_size
        return tuple(-(-self.oldest(v) // m) for v in range(m))

    def slice_words(self, slice_: int) -> int:
        """Sums that a slice keeps of each column: running, first, and where needed held ones."""
        return 2 + (self.group_size(slice_) > 1) + (not self.begins_group(slice_, 0))

    def least_steps(self, length: int, *, columns: bool) -> int:
        """Least steps between line starts, see `SumLayout`; for columns a multiple of M."""
        steps = max(length, self.delay + 1)
        m = self.micro_image_size
        return -(-steps // m) * m if columns else steps


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
                sums[s] += value * (index == layout.first_index(s, phase, held=held))
            if due_begins is not None:
                total[s], result[s] = first_sum[s], held_sum[s]
            elif due >= 0:
                v = layout.entering_phase(s, output)
                i = output + delay - layout.entering_age(s, v)
                place = layout.history_place(s, v)
                if not layout.pixels_leave and layout.begins_group(s, output - 1):
                    total[s] = 0
                if 0 <= i < len(queue[due]):
                    total[s] += value if place < 0 else history[v][place]
                left = layout.leaving_phase(s, output)
                i_left = output + delay - layout.leaving_age(s, left)
                if layout.pixels_leave and 0 <= i_left < len(queue[due]):
                    total[s] -= history[left][layout.leaving_place(s, left)]
                if layout.begins_group(s, output):
                    result[s] = total[s]
            if due >= 0 and output < len(queue[due]):
                results[due][s].append(result[s])
        # Reads of this step come before its write.
        history[phase] = [value, *history[phase]][: len(history[phase])]
        if due >= 0 and output == len(queue[due]) - 1:
            yield np.array(results[due], np.int64)
