# SPDX-License-Identifier: Apache-2.0
"""Register settings of sensors: the generic REGISTERS of `sensor_setup`.

Addresses and values of the IMX219 are facts of the driver that Linux has for it
(drivers/media/i2c/imx219.c, commit 0050c97941353219e000275707ccade7e1f91ec6), whose comments name
Raspberry Pi's firmware as their source; the names of the registers are Sony's. Two differ from
older versions of the driver: the manufacturer's registers are unlocked by 0x05, 0x0c (until commit
3cdc776e0a5f, "fix msr access command sequence", it was 0x0c, 0x05, against the data sheet); and for
640 x 480, too, the window of the test pattern is as large as the frame, where the driver's tables
had 1640 x 1232.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from plenofir.fpga.csi import word_pixels
from plenofir.ground.errors import InputError

PAUSE = 0xFFFF
"""Address of an entry that is a pause; its value is milliseconds."""


class WideEntry(NamedTuple):
    """A register whose value has 16 bits, both bytes in one transfer."""

    address: int
    value: int


Entry = WideEntry | tuple[int, int]
"""Address (16 bits) and value (8 bits, of a `WideEntry` 16) of a register."""


@dataclass(frozen=True)
class SensorMode:
    """A size in which a sensor sends frames."""

    columns: int
    rows: int
    left: int  # of the pixel array, as the next three: where reading begins
    top: int
    width: int  # what is read
    height: int
    binning: int  # value of the binning registers: 0 none, 1 two by two
    frame_lines: int  # with blanking
    line_pixels: int = 3448  # with blanking
    pixel_rate: float = 182.4e6  # on two lanes of 912 Mb/s

    @property
    def line_rate(self) -> float:
        """Pixels a second over a whole line, its blanking included."""
        return self.pixel_rate * self.columns / self.line_pixels

    def pixels_per_clock(self, core_hz: float) -> int:
        """The fewest pixels a clock, 1 to 8, with which a core follows."""
        return next(n for n in (1, 2, 4, 8) if n * core_hz >= self.line_rate)

    def buffer_bits(self, core_hz: float, bits: int = 10) -> int:
        """BUFFER_BITS of `csi_receiver` for a core that takes one or more pixels each clock.

        A line arrives at `pixel_rate` and leaves at the core's rate; the difference is buffered.
        """
        together = self.pixels_per_clock(core_hz)
        word = word_pixels(2, bits, together)
        waiting = self.columns * max(1 - together * core_hz / self.pixel_rate, 0)
        # Each side sees the other's pointer a few words late.
        return max((math.ceil(waiting / word) + 6).bit_length(), 5)

    @property
    def frames_per_second(self) -> float:
        return self.pixel_rate / (self.line_pixels * self.frame_lines)


IMX219_MODES = (
    SensorMode(640, 480, 1000, 752, 1280, 960, 1, 1763),
    SensorMode(1640, 1232, 0, 0, 3280, 2464, 1, 1763),
    SensorMode(3280, 2464, 0, 0, 3280, 2464, 0, 3526),
)
SensorPattern = Literal["off", "solid", "bars", "grey-bars", "noise"]
PATTERNS: dict[SensorPattern, int] = {"off": 0, "solid": 1, "bars": 2, "grey-bars": 3, "noise": 4}
"""The sensor's own pictures; "bars" are eight colours, "noise" is a PN9 sequence."""

# Undocumented registers of the manufacturer that the driver writes.
_UNLOCK = ((0x30EB, 5), (0x30EB, 0x0C), (0x300A, 0xFF), (0x300B, 0xFF), (0x30EB, 5), (0x30EB, 9))
_OWN = (
    *((0x455E, 0x00), (0x471E, 0x4B), (0x4767, 0x0F), (0x4750, 0x14), (0x4540, 0x00)),
    *((0x47B4, 0x14), (0x4713, 0x30), (0x478B, 0x10), (0x478F, 0x10), (0x4793, 0x10)),
    *((0x4797, 0x0E), (0x479B, 0x0E)),
)


def _word(address: int, value: int) -> tuple[Entry, Entry]:
    return (address, value >> 8), (address + 1, value & 0xFF)


IMX219_LANE_MBITS = (456, 912)
"""Rates of a lane: that of the pixels' own PLL, and the driver's."""


def imx219_mode(
    columns: int, rows: int, *, line_pixels: int | None = None, frame_lines: int | None = None
) -> SensorMode:
    """Mode of an IMX219 with frames of columns x rows, with its own blanking or another one.

    InputError for a size that is none of `IMX219_MODES`, or for less blanking than Linux' driver
    has (3448 pixels a line, 32 lines).
    """
    mode = next((m for m in IMX219_MODES if (m.columns, m.rows) == (columns, rows)), None)
    if mode is None:
        sizes = ", ".join(f"{m.columns} x {m.rows}" for m in IMX219_MODES)
        raise InputError(f"has no mode of {columns} x {rows}; use one of {sizes}", where="IMX219")
    changed = replace(
        mode,
        line_pixels=line_pixels or mode.line_pixels,
        frame_lines=frame_lines or mode.frame_lines,
    )
    least = {"line_pixels": mode.line_pixels, "frame_lines": rows + 32}
    for name, low in least.items():
        value = getattr(changed, name)
        if not low <= value <= 0xFFFF:
            raise InputError(f"{value} is not possible; use {low} to 65535", where=name)
    return changed


def imx219(
    columns: int,
    rows: int,
    *,
    bits: int = 10,
    pattern: SensorPattern = "off",
    exposure_lines: int = 1600,
    gain: int = 0,
    lane_mbits: int = 912,
    mode: SensorMode | None = None,
) -> list[Entry]:
    """Registers of an IMX219 with a clock of 24 MHz, two lanes, frames of columns x rows.

    `bits` are 8 or 10 (RAW8, RAW10), `pattern` a key of `PATTERNS`, `gain` 0 to 232: the sensor
    amplifies by 256 / (256 - gain); `lane_mbits` a lane's rate, a multiple of 8 from that of the
    pixels' PLL (456) to that of the driver (912); `mode` one of `imx219_mode` instead of the size's
    own. The sensor starts sending with the last entry. InputError for a size that is none of
    `IMX219_MODES`, or values that do not fit the registers.
    """
    mode = mode or imx219_mode(columns, rows)
    longest = mode.frame_lines - 4
    slowest, fastest = IMX219_LANE_MBITS
    if lane_mbits % 8 or not slowest <= lane_mbits <= fastest:
        raise InputError(
            f"{lane_mbits} is not possible; use a multiple of 8 from {slowest} to {fastest}",
            where="lane_mbits",
        )
    for value, name, low, high in (
        (bits, "bits", 8, 10),
        (exposure_lines, "exposure_lines", 4, longest),
        (gain, "gain", 0, 232),
    ):
        if not low <= value <= high or (name == "bits" and value == 9):
            allowed = "8 or 10" if name == "bits" else f"{low} to {high}"
            raise InputError(f"{value} is not possible; use {allowed}", where=name)
    if pattern not in PATTERNS:
        raise InputError(
            f"there is no {pattern!r}; use one of {', '.join(PATTERNS)}", where="pattern"
        )
    return [
        # After its reset the sensor needs 6.2 ms.
        *((PAUSE, 7), (0x0100, 0), *_UNLOCK),
        # Two lanes, automatic lane timing, the external clock in 1/256 MHz.
        *((0x0114, 1), (0x0128, 0), *_word(0x012A, 24 << 8)),
        *(*_word(0x0160, mode.frame_lines), *_word(0x0162, mode.line_pixels)),
        *(*_word(0x0164, mode.left), *_word(0x0166, mode.left + mode.width - 1)),
        *(*_word(0x0168, mode.top), *_word(0x016A, mode.top + mode.height - 1)),
        *(*_word(0x016C, columns), *_word(0x016E, rows), (0x0170, 1), (0x0171, 1)),
        *((0x0174, mode.binning), (0x0175, mode.binning)),
        # Clocks: 24 MHz / 3 * 57 / 5 for the pixels, 24 MHz / 3 * 114 for 912 Mb/s a lane.
        *((0x0301, 5), (0x0303, 1), (0x0304, 3), (0x0305, 3), *_word(0x0306, 57)),
        *((0x030B, 1), *_word(0x030C, lane_mbits // 8), (0x0309, bits)),
        *((0x018C, bits), (0x018D, bits), *_OWN),
        *((0x0157, gain), *_word(0x015A, exposure_lines)),
        # The window of the test pattern, as large as the frame.
        *(*_word(0x0624, columns), *_word(0x0626, rows), *_word(0x0600, PATTERNS[pattern])),
        (0x0100, 1),
    ]


def registers_text(entries: Sequence[Entry]) -> str:
    """Generic REGISTERS of `sensor_setup`: six or eight hexadecimal digits for each entry."""
    return " ".join(
        f"{entry[0]:04x}{entry[1]:0{4 if isinstance(entry, WideEntry) else 2}x}"
        for entry in entries
    )
