# SPDX-License-Identifier: Apache-2.0
"""Which raw lines the chip needs for each line of the raster, and how many its ring must hold.

Line v of lens row t needs the raw lines from the highest lens of the row to the lowest, with their
neighbours below; where a micro image reaches beyond the frame, mirrored ones. Lines are kept from
the first one on that this or a later line of the raster needs.
"""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.resampling.grid_resampler import Tables
from plenofir.camera.resampling.registers import GridRegisters, Integers

LATENCY = 48
"""Clocks, rounded up, until a line that is complete is seen, and until one is given up."""
_LINES_TO_LEAVE = 2
"""Lines of video until a line of the raster that is due has left the ring.

Its raw lines stay while it is shown, those of the last one until its last pixel is out.
"""


@dataclass(frozen=True)
class RingNeeds:
    """Lines that the ring must hold."""

    least: int  # fewer lines cannot resample a frame
    # Enough for a source that sends without gaps; None if no number is, because the raster has more
    # pixels than the raw frame.
    full_rate: int | None


def _first_lens(registers: GridRegisters) -> tuple[Integers, Integers]:
    """Raw line of each line of the raster in its row's first lens, (rows, M), and exact offsets."""
    lines = registers.samples()[:, 0, 0]
    corners = registers.positions()[:, :1, 0]
    return (corners + lines) >> registers.precision.fraction_bits, lines


def reach(registers: GridRegisters, tables: Tables) -> tuple[int, int]:
    """Lines from the first lens of a row, by the registers alone, to its highest and lowest."""
    bits = registers.precision
    first, lines = _first_lens(registers)
    places = registers.positions()[:, np.newaxis, :, 0] + lines[:, np.newaxis]
    places = places >> (bits.fraction_bits - bits.weight_bits)
    if tables.moves is not None:
        places = places + tables.moves[:, np.newaxis, :, 0]
    apart = (places >> bits.weight_bits) - first[..., np.newaxis]
    return int(apart.min()), int(apart.max())


def line_needs(registers: GridRegisters, tables: Tables) -> tuple[Integers, Integers]:
    """For each line of the raster the last raw line it needs, and the first that is kept for it.

    Both have the shape (lens rows M,), as `lens_rows.vhd` computes them; moves of the tables
    count.
    """
    bits = registers.precision
    up, down = reach(registers, tables)
    last = registers.image_shape[0] - 1
    first, _ = _first_lens(registers)
    top, bottom = first + up, first + 1 + down
    needed = np.minimum(np.maximum(bottom, -top), last)
    gap, stride = (n >> bits.fraction_bits for n in sorted(y for y, _ in registers.down))
    height = gap + 2 if registers.layout == "skewed" else registers.micro_image_size
    # At the bottom border lines are mirrored, for the next row of lenses farther than for this one.
    mirror = first[:, :1] + height + down
    mirror[:-1] += stride + 1
    kept = np.minimum(np.minimum(first, first[:, :1] + gap) + up, 2 * last - mirror)
    return needed.ravel(), np.maximum(kept, 0).ravel()


def ring_needs(registers: GridRegisters, tables: Tables | None = None) -> RingNeeds:
    """How many raw lines the ring must hold; moves of the tables count."""
    needed, kept = line_needs(registers, tables or Tables())
    least = int((needed - kept).max()) + 1
    rows, columns = registers.image_shape
    clocks = max(registers.lenses[1], registers.outputs) * registers.micro_image_size
    # The clock at which each line of the raster is done, for two frames back to back.
    needs = np.concatenate([needed, needed + rows])
    keeps = np.concatenate([kept, kept + rows])
    ready = (needs + 1) * columns + LATENCY
    # done(i) = max(done(i - 1), ready(i)) + clocks.
    steps = np.arange(len(ready)) * clocks
    ends = np.maximum.accumulate(ready - steps) + steps + clocks
    if ends[-1] - ends[len(needed) - 1] > rows * columns:
        return RingNeeds(least, None)
    # Raw line n is written from clock n * columns on: the first line that must be kept then.
    line = np.arange(2 * rows)
    current = np.searchsorted(ends, line * columns - LATENCY, side="right")
    # After the last line of the second frame, nothing of it is kept.
    held = np.append(keeps, 2 * rows)[current]
    return RingNeeds(least, max(least, int((line - np.minimum(held, line)).max()) + 1))


def ring_needs_shown(
    registers: GridRegisters,
    tables: Tables | None = None,
    *,
    delay_lines: int,
    blank_lines: int,
) -> int:
    """How many raw lines the ring must hold if the raster is shown under the raw frames' timing.

    Line i is then taken at the raw line i + spare + `delay_lines`, spare the lines that the raster
    has fewer than the raw frame: they are shown without gaps, and wait in the ring until then. The
    raster is shown `delay_lines` later than its last line could be at the soonest; `blank_lines`
    are at least between raw frames. Moves of the tables count.
    """
    needed, kept = line_needs(registers, tables or Tables())
    rows = registers.image_shape[0]
    number = np.arange(len(needed))
    due = number + rows - len(needed) + delay_lines
    period = rows + blank_lines
    # Two frames. A line of the raster has left the ring two lines after it was taken.
    gone = np.concatenate([due, due + period]) + _LINES_TO_LEAVE
    keeps = np.append(np.concatenate([kept, kept + rows]), 2 * rows)
    line = np.arange(2 * rows)
    held = keeps[np.searchsorted(gone, line + line // rows * blank_lines, side="right")]
    least = int((needed - kept).max()) + 1
    return max(least, int((line - np.minimum(held, line)).max()) + 1)
