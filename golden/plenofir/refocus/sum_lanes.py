# SPDX-License-Identifier: Apache-2.0
"""Many pixels a clock: the moving sum of a row for P neighbouring outputs at once.

Output o takes in pixel e(o) = o + offset(o mod M), whose offset depends on o mod M alone
(`plenofir.refocus.moving_sum`), and gives back l(o) = e(o - B), B the box, which is e(o) - M for a
box of M. So the P outputs of a token are the sum after the previous token plus the prefix sums of

    d(o) = x[e(o)] - x[e(o - B)],    x = 0 outside the line.

Pixels lie in N banks, N the smallest multiple of M that is not less than P: pixel i in bank
i mod N, row i div N. P neighbouring pixels lie in different banks, and so do the pixels that enter
with P neighbouring outputs, because e(o + M) = e(o) + M. The bank of the pixel that enters with
output o depends only on o mod N: a fixed permutation for each slice, and a rotation by the token's
position in the N outputs.

The VHDL (``hdl/moving_sum/sum_lanes_pkg.vhd``) has the same functions.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from plenofir.refocus.moving_sum import SumLayout


@dataclass(frozen=True)
class LaneLayout:
    """Schedule of a row's moving sum with several pixels a token."""

    sums: SumLayout  # schedule with one pixel a token
    pixels: int  # P, pixels of a token

    @cached_property
    def delay(self) -> int:
        """Tokens from a token to the outputs of the same pixels."""
        return -(-self.sums.delay // self.pixels)

    @cached_property
    def banks(self) -> int:
        """N, a multiple of M."""
        m = self.sums.micro_image_size
        return -(-self.pixels // m) * m

    def offset(self, slice_: int, output: int) -> int:
        """Index of the pixel that enters with an output, counted from the output."""
        phase = self.sums.entering_phase(slice_, output % self.sums.micro_image_size)
        return self.sums.delay - self.sums.entering_age(slice_, phase)

    def bank(self, slice_: int, place: int) -> int:
        """Bank of the pixel that enters with outputs of the same o mod N."""
        return (place + self.offset(slice_, place)) % self.banks

    def row(self, slice_: int, place: int) -> int:
        """Row of that pixel, relative to the output's o div N."""
        return (place + self.offset(slice_, place)) // self.banks

    def first_output(self, slice_: int, index: int) -> int:
        """Output with which a pixel enters."""
        phase = index % self.sums.micro_image_size
        return index + self.sums.entering_age(slice_, phase) - self.sums.delay

    def is_initial(self, slice_: int, index: int, *, held: bool) -> bool:
        """Whether a pixel is in the sum before output 0; with `held`, in that of its group."""
        m, box = self.sums.micro_image_size, self.sums.box(slice_)
        last = -1
        if held:
            last = -next(back for back in range(m) if self.sums.begins_group(slice_, -back))
        return last - box < self.first_output(slice_, index) <= last

    @property
    def clocks(self) -> int:
        """Clocks of the stage, besides the delay in tokens."""
        several = len(self.sums.shifts) > 1
        return 7 + (self.pixels - 1).bit_length() + several + self.sums.holds_outputs

    @cached_property
    def rows(self) -> int:
        """Rows of a bank, a power of two.

        They hold pixels from the newest back to the oldest that leaves, with incomplete rows at
        ends of lines.
        """
        oldest = self.delay * self.pixels - self.sums.delay + self.pixels - 1 + self.sums.reach
        rows = -(-oldest // self.banks) + 3
        return 1 << (rows - 1).bit_length()


def lane_sums(
    lines: Iterable[npt.NDArray[np.integer]],
    layout: LaneLayout,
    slices: Sequence[int] | None = None,
) -> Iterator[npt.NDArray[np.int64]]:
    """Run lines through the moving sum with P pixels a token, without a gap where that is possible.

    As `plenofir.refocus.moving_sum.moving_sum_lines`.
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
                first += word[j] * layout.is_initial(order[current], index, held=False)
                held_first += word[j] * layout.is_initial(order[current], index, held=True)
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
