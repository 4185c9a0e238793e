# SPDX-License-Identifier: Apache-2.0
"""Both engines side by side: designs, measured resources and clocks, the widest frame that fits.

The record holds the results of Yosys and nextpnr for the measured cells (`make compare`); for all
others there is the estimate, whose block RAM and multipliers are exact.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from plenofir.fpga.core.configuration import (
    MAX_COLUMNS,
    SLICE_ENGINES,
    CoreConfiguration,
)
from plenofir.fpga.core.engine import PixelsPerClock
from plenofir.fpga.devices import Device
from plenofir.fpga.names import SliceEngineName
from plenofir.fpga.resources.estimate import estimate

SIZES = (3, 5, 7, 11, 15)
COLUMNS = 1280
ENGINES: tuple[SliceEngineName, ...] = tuple(SLICE_ENGINES)
# Sets of slices to select from at run time: M, a' and channels.
SETS = ((5, tuple(range(-5, 11)), 3), (11, tuple(range(-11, 12)), 1))
# Several pixels a clock: M, a', channels, and P.
LANES: tuple[tuple[int, tuple[int, ...], int, PixelsPerClock], ...] = (
    (11, (2,), 1, 8),
    (5, (2,), 3, 8),
)
# Larger cells (estimated look-up tables) are not synthesised: each would take hours.
_MOST_LUTS = 4000


@dataclass(frozen=True)
class Cell:
    """A cell of the comparison."""

    micro_image_size: int  # M in pixels
    shifts: tuple[int, ...]  # a' in pixels; several are selected from at run time
    channels: int  # 1 (grey) or 3 (RGB)
    engine: SliceEngineName
    pixels_per_clock: PixelsPerClock = 1  # P of moving sums

    @property
    def name(self) -> str:
        """Name in the record."""
        first, last = self.shifts[0], self.shifts[-1]
        shifts = f"{first}" if first == last else f"{first}..{last}"
        colour = "RGB" if self.channels == 3 else "grey"
        at_once = f" P={self.pixels_per_clock}" if self.pixels_per_clock > 1 else ""
        return f"{self.engine} M={self.micro_image_size} a'={shifts} {colour}{at_once}"

    def core(self, columns: int = COLUMNS) -> CoreConfiguration:
        """Raster core of the cell: 8 bit, exact arithmetic, nearest neighbour."""
        more = {"pixels_per_clock": self.pixels_per_clock} if self.pixels_per_clock > 1 else {}
        return CoreConfiguration(
            micro_image_size=self.micro_image_size,
            shifts=self.shifts,
            max_columns=columns,
            channels=self.channels,
            engine=SLICE_ENGINES[self.engine].model_validate(more),
        )

    def other(self, engine: SliceEngineName) -> "Cell":
        return replace(self, engine=engine)


def all_shifts(micro_image_size: int) -> range:
    """Shifts of the comparison: -M to 3 M."""
    return range(-micro_image_size, 3 * micro_image_size + 1)


def shown_shifts(micro_image_size: int) -> tuple[int, ...]:
    """Shifts that the table shows and that are synthesised."""
    m = micro_image_size
    return tuple(sorted({-m, -1, 0, 1, 2, m, 2 * m, 3 * m}))


def measured_cells() -> Iterator[Cell]:
    """Cells that are synthesised, the most informative first.

    Grey cells with few taps come first, sets and several pixels a clock last; cells that would take
    hours are left out.
    """
    cells = [
        Cell(m, (shift,), channels, engine)
        for m in SIZES
        for shift in shown_shifts(m)
        for channels in (1, 3)
        for engine in ENGINES
        if channels == 1 or shift in (2, m)
    ]
    small = [cell for cell in cells if estimate(cell.core().blocks).lut <= _MOST_LUTS]
    yield from sorted(small, key=lambda cell: (cell.channels, cell.core().taps, cell.engine))
    yield from (Cell(*part, "moving_sum") for part in SETS)
    yield from lane_cells()


def lane_cells() -> Iterator[Cell]:
    """Cells with several pixels a clock, those of ``LANES``."""
    for m, shifts, channels, pixels in LANES:
        yield Cell(m, shifts, channels, "moving_sum", pixels)


def placed_cells() -> Iterator[Cell]:
    """Cells that are placed for the clock: the sets, a' = 2 and M for each M, then all others."""
    cells = list(measured_cells())
    yield from sorted(
        cells, key=lambda c: (len(c.shifts) == 1, c.shifts[0] not in (2, c.micro_image_size))
    )


def widest(cell: Cell, device: Device) -> int:
    """Longest line (columns) with which a cell fits a device, by the estimate; 0 if none fits.

    A multiple of M, at most the core's limit.
    """
    m = cell.micro_image_size
    low, high = 0, MAX_COLUMNS // m
    while low < high:
        middle = (low + high + 1) // 2
        if device.overflow(estimate(cell.core(middle * m).blocks)):
            high = middle - 1
        else:
            low = middle
    return low * m
