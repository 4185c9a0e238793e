# SPDX-License-Identifier: Apache-2.0
"""The operator as a re-ordering and a moving sum: schedule of the moving_sum engine.

Pixel i = M j + v (phase v) contributes to the M outputs from J = i + v (a'-1) on, a multiple of
g = gcd(a', M). Giving the g pixels with the same J places of their own, p = J + r with r = 0..g-1,
makes i -> p a re-ordering, and

    S[J + r] = sum of the pixels at the B places up to J + g - 1, B the box.

S changes at multiples of g only, and from one such place to the next g pixels enter the sum and g
leave it: one enters and one leaves at each step, at ages that depend on their phase alone. The
pixel that leaves is the one that entered B steps before; B is a multiple of g. The VHDL
(``hdl/moving_sum/sum_schedule_pkg.vhd``) has the same functions.
"""

import math
from dataclasses import dataclass
from functools import cached_property

from plenofir.refocus.operator import Align
from plenofir.refocus.switches import FilterLayout


@dataclass(frozen=True)
class SumLayout:
    """Schedule of a moving sum for a set of shifts."""

    micro_image_size: int  # M in pixels
    shifts: tuple[int, ...]  # the set of a' in pixels; a slice is an index into it
    align: Align = "centred"  # see `plenofir.refocus.operator.output_offset`
    # Columns of any length, not only multiples of M, follow each other without a gap.
    any_length: bool = False
    boxes: tuple[int, ...] = ()  # samples B of each slice's box; empty: M for all

    @cached_property
    def _filter(self) -> FilterLayout:
        """The switched filter that does the same."""
        return FilterLayout(self.micro_image_size, self.shifts, self.align, boxes=self.boxes)

    @cached_property
    def delay(self) -> int:
        """Steps from a pixel to the output of the same index, as in the switched filter."""
        return self._filter.delay

    def box(self, slice_: int) -> int:
        """Samples B of a slice's box."""
        return self._filter.box(slice_)

    def group_size(self, slice_: int) -> int:
        """Neighbouring outputs that are equal: g = gcd(a', M)."""
        return math.gcd(self.shifts[slice_], self.micro_image_size)

    def place_in_group(self, slice_: int, phase: int) -> int:
        """Place r of a phase among the pixels with the same J, in the order in which they come."""
        group = self.group_size(slice_)
        index = phase // (self.micro_image_size // group)
        return group - 1 - index if self.shifts[slice_] >= 1 else index

    def offset(self, slice_: int) -> int:
        """Replica of an input pixel that lands on the output of the same index."""
        return self._filter.offset(slice_)

    def entering_phase(self, slice_: int, output: int) -> int:
        """Phase of the pixel that enters the sum with an output."""
        m = self.micro_image_size
        place = output + self.offset(slice_) + self.group_size(slice_) - 1
        phases = [
            v
            for v in range(m)
            if (v * self.shifts[slice_] + self.place_in_group(slice_, v) - place) % m == 0
        ]
        assert len(phases) == 1
        return phases[0]

    def entering_age(self, slice_: int, phase: int) -> int:
        """Steps from a pixel of a phase to its entering the sum; it leaves B steps later."""
        return (
            self.delay
            - self.offset(slice_)
            - self.group_size(slice_)
            + 1
            + phase * (self.shifts[slice_] - 1)
            + self.place_in_group(slice_, phase)
        )

    def begins_group(self, slice_: int, output: int) -> bool:
        """Whether an output is the first of a group of equal ones."""
        return (output + self.offset(slice_)) % self.group_size(slice_) == 0

    @property
    def holds_outputs(self) -> bool:
        """Whether a slice has groups of more than one output."""
        return any(self.group_size(s) > 1 for s in range(len(self.shifts)))

    @property
    def pixels_leave(self) -> bool:
        """Whether pixels leave the sum: not if all slices begin a new sum with each group."""
        return any(self.group_size(s) != self.box(s) for s in range(len(self.shifts)))

    @property
    def alternates(self) -> bool:
        """Whether pixels enter and leave that are of the same phase, a lens apart: a box of M."""
        m = self.micro_image_size
        return self.pixels_leave and any(self.box(s) == m for s in range(len(self.shifts)))

    @property
    def begins_within_group(self) -> bool:
        """Whether output 0 of a slice is not the first of its group (even M only)."""
        return any(not self.begins_group(s, 0) for s in range(len(self.shifts)))

    def leaving_phase(self, slice_: int, output: int) -> int:
        """Phase of the pixel that leaves the sum with an output."""
        return self.entering_phase(slice_, output - self.box(slice_))

    def leaving_age(self, slice_: int, phase: int) -> int:
        """Steps from a pixel of a phase to its leaving the sum."""
        return self.entering_age(slice_, phase) + self.box(slice_)

    def oldest(self, phase: int) -> int:
        """Largest age at which a pixel of a phase enters or leaves, in any slice."""
        age = self.leaving_age if self.pixels_leave else self.entering_age
        return max(age(s, phase) for s in range(len(self.shifts)))

    @cached_property
    def reach(self) -> int:
        """Largest age of a pixel in a sum."""
        phases, slices = range(self.micro_image_size), range(len(self.shifts))
        return max(self.leaving_age(s, v) for s in slices for v in phases)

    @cached_property
    def bank_groups(self) -> tuple[int, ...]:
        """Group of banks of each phase: another one than of phases that leave as it enters.

        Each phase takes the first group that is free of the phases before it. In a group with
        `alternates` the lines of a phase alternate between two banks.
        """
        m = self.micro_image_size
        together = [set[int]() for _ in range(m)]
        for slice_ in range(len(self.shifts)) if self.pixels_leave else ():
            for output in range(m):
                phases = self.entering_phase(slice_, output), self.leaving_phase(slice_, output)
                together[max(phases)].add(min(phases))
        groups: list[int] = []
        for phase in range(m):
            others = {groups[other] for other in together[phase] if other < phase}
            groups.append(min(set(range(m)) - others))
        return tuple(groups)

    @cached_property
    def bank_lines(self) -> tuple[int, ...]:
        """Lines of each bank of the column memory."""
        lines = [0] * (max(self.bank_groups) + 1)
        for group, ring in zip(self.bank_groups, self.ring_lines, strict=True):
            lines[group] += ring
        each = 1 + self.alternates
        return tuple(count // each for count in lines for _ in range(each))

    @cached_property
    def ring_lines(self) -> tuple[int, ...]:
        """Lines of each phase that the column memory keeps; even if they alternate.

        A line of the phase comes every M lines. With columns of any length the first one of a frame
        may come up to M-1-v lines early (a frame of n M + v + 1 lines), but only one in `reach`
        lines does.
        """
        m = self.micro_image_size
        lines = []
        for phase in range(m):
            oldest = self.oldest(phase)
            if self.any_length and oldest > 0:
                oldest += m - 1 - phase
            ring = -(-oldest // m)
            lines.append(ring + ring % 2 if self.alternates else ring)
        return tuple(lines)

    @property
    def sum_words(self) -> int:
        """Sums that are stored for each column: running, first, and if needed held ones."""
        return 2 + self.holds_outputs + self.begins_within_group

    def least_steps(self, length: int, *, columns: bool) -> int:
        """Least steps from a line's beginning to the next one's, `length` or more.

        A column's memory is a ring for each phase.
        """
        steps = max(length, self.delay + 1)
        m = self.micro_image_size
        if not columns:
            return steps
        return max(steps, self.reach) if self.any_length else max(steps, -(-length // m) * m)
