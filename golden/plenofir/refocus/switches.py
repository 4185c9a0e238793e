# SPDX-License-Identifier: Apache-2.0
"""The operator as the switch-controlled semi-systolic FIR filter (section 6.1.1 of the thesis).

The pixel is broadcast to W taps; tap w delays it by W-1-w steps. A pixel of phase p = k mod M is
added by the B neighbouring taps whose delay lies in p (a'-1) + o .. p (a'-1) + o + B-1, B the box
(`plenofir.refocus.operator`), M in the thesis.

One filter serves a set of shifts, one of which is selected at run time. All slices have the largest
of their output delays, so that the position of a tap determines the output of its partial sum for
every slice.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from plenofir.refocus.operator import Align, output_offset

SwitchMatrix = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class FilterLayout:
    """Taps and switches of a filter for a set of shifts.

    `shifts`: the set of a' in pixels; a slice is an index into it. `hold`: whether the first output
    of each micro image is computed and held for the others (the write enable of Eq. 6.7). A phase
    then closes one switch instead of B. `boxes`: the box B of each slice; empty: M for all.
    """

    micro_image_size: int
    shifts: tuple[int, ...]
    align: Align = "centred"
    hold: bool = False
    boxes: tuple[int, ...] = ()

    def box(self, slice_: int) -> int:
        """Samples B of a slice's box."""
        return self.boxes[slice_] if self.boxes else self.micro_image_size

    def offset(self, slice_: int) -> int:
        """Index of S that output 0 of a slice takes."""
        shift, box = self.shifts[slice_], self.box(slice_)
        return output_offset(self.micro_image_size, shift, self.align, box)

    @cached_property
    def _delays(self) -> tuple[int, ...]:
        """Output delay of a filter for each slice alone: S[k] leaves tap o at step k."""
        m = self.micro_image_size
        return tuple(
            (m - 1) * max(1 - shift, 0) + self.offset(s) for s, shift in enumerate(self.shifts)
        )

    @cached_property
    def _widths(self) -> tuple[int, ...]:
        """Switches that a phase closes, for each slice."""
        return tuple(1 if self.hold else self.box(s) for s in range(len(self.shifts)))

    @property
    def delay(self) -> int:
        """Steps from a pixel to the output of the same index (rows: pixels, columns: lines)."""
        return max(self._delays)

    @property
    def taps(self) -> int:
        """Number of taps W, for one shift B + (M-1) |a'-1|; with hold B-1 less."""
        slices = zip(self.shifts, self._delays, self._widths, strict=True)
        m = self.micro_image_size
        behind = max(width + (m - 1) * abs(shift - 1) - delay for shift, delay, width in slices)
        return self.delay + behind

    @property
    def can_hold(self) -> bool:
        """Whether the M outputs of every micro image are equal in all slices."""
        m = self.micro_image_size
        slices = enumerate(self.shifts)
        return all(shift % m == 0 and self.offset(s) % m == 0 for s, shift in slices)

    @cached_property
    def switches(self) -> SwitchMatrix:
        """Switch states S(a, w, p), Eqs. (6.7) to (6.9): shape (slices, M, W), true is closed."""
        m = self.micro_image_size
        phase = np.arange(m)[None, :, None]
        shift = np.array(self.shifts)[:, None, None]
        origin = [self.delay - self.offset(s) for s in range(len(self.shifts))]
        width = np.array(self._widths)[:, None, None]
        first = phase * (shift - 1) + np.array(origin)[:, None, None]
        delay = self.taps - 1 - np.arange(self.taps)[None, None, :]
        closed: SwitchMatrix = (delay >= first) & (delay < first + width)
        return closed

    @property
    def switched(self) -> npt.NDArray[np.bool_]:
        """Taps that some slice closes, shape (W,); the others have neither switch nor adder."""
        used: npt.NDArray[np.bool_] = np.any(self.switches, axis=(0, 1))
        return used


def filter_lines(
    lines: Iterable[npt.NDArray[np.integer]],
    layout: FilterLayout,
    slices: Sequence[int] | None = None,
) -> Iterator[npt.NDArray[np.int64]]:
    """Run lines through one FIR filter, one after the other without a gap.

    This models the filter register by register, with the moving mask that separates neighbouring
    lines. Empty steps after the last line flush it.

    `lines`: lines of samples, each of shape (K,), lengths may differ. `layout`: taps and switches.
    `slices`: slice of each line; the first of the set if None. Yields one line of sums for each
    line in, same length.
    """
    taps, delay = layout.taps, layout.delay
    own_at_first_step = np.arange(taps) <= taps - 1 - delay

    held = np.zeros(taps, dtype=np.int64)
    lengths: list[int] = []
    updates: list[bool] = []
    outputs: list[int] = []

    def step(sample: int, closed: npt.NDArray[np.bool_], restart: bool, update: bool) -> None:
        nonlocal held
        carried = np.concatenate(([0], held[:-1]))
        if restart:
            carried[own_at_first_step] = 0
        updates.append(update)
        result = carried + np.where(closed, sample, 0)
        if layout.hold and len(updates) > delay and not updates[-1 - delay]:
            result[-1] = held[-1]
        held = result
        outputs.append(int(held[-1]))

    for number, line in enumerate(lines):
        lengths.append(len(line))
        switches = layout.switches[0 if slices is None else slices[number]]
        mask = own_at_first_step.copy()
        for position, sample in enumerate(line):
            phase = position % layout.micro_image_size
            step(int(sample), switches[phase] & mask, position == 0, phase == 0)
            mask = np.concatenate(([True], mask[:-1]))
    for _ in range(delay):
        step(0, np.zeros(taps, dtype=bool), False, False)

    start = delay
    for length in lengths:
        yield np.array(outputs[start : start + length], dtype=np.int64)
        start += length
