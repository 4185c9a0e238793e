# SPDX-License-Identifier: Apache-2.0
"""Video modes: sizes, blanking, polarities, pixel clocks."""

from collections.abc import Iterable
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[int, Field(ge=1)]


class VideoMode(BaseModel):
    """Timing of a progressive video mode.

    A line is made of the active pixels, front porch, sync and back porch, in this order; a frame of
    lines likewise. Vertical sync changes with the leading edge of horizontal sync.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    pixel_clock: Positive  # kHz
    h_active: Positive  # parts of a line in pixels
    h_front: Positive
    h_sync: Positive
    h_back: Positive
    v_active: Positive  # parts of a frame in lines
    v_front: Positive
    v_sync: Positive
    v_back: Positive
    h_positive: bool  # sync pulses are high
    v_positive: bool
    vic: Annotated[int, Field(ge=0)] = 0  # code of the mode in CEA-861, 0 for none

    @property
    def h_total(self) -> int:
        """Pixels of a line with its blanking."""
        return self.h_active + self.h_front + self.h_sync + self.h_back

    @property
    def v_total(self) -> int:
        """Lines of a frame with their blanking."""
        return self.v_active + self.v_front + self.v_sync + self.v_back

    @property
    def frame_rate(self) -> float:
        return 1000 * self.pixel_clock / (self.h_total * self.v_total)

    def as_measured(self) -> "VideoMode":
        """Make the mode that a sink finds: the timing alone, with a pixel clock of 1."""
        return self.model_copy(update={"name": "measured", "pixel_clock": 1, "vic": 0})


def _mode(
    name: str, pixel_clock: int, line: str, frame: str, sync: bool, vic: int = 0
) -> VideoMode:
    """Mode from its parts of a line and of a frame: active, front porch, sync, back porch."""
    keys = [f"{d}_{part}" for d in "hv" for part in ("active", "front", "sync", "back")]
    parts = dict(zip(keys, map(int, f"{line} {frame}".split()), strict=True))
    polarity = {"h_positive": sync, "v_positive": sync}
    return VideoMode.model_validate(
        {"name": name, "pixel_clock": pixel_clock, "vic": vic, **parts, **polarity}
    )


# VESA DMT; 640 x 480 and 1280 x 720 also in CEA-861.
VGA = _mode("640x480p60", 25_175, "640 16 96 48", "480 10 2 33", False, vic=1)
SVGA = _mode("800x600p60", 40_000, "800 40 128 88", "600 1 4 23", True)
SVGA_72 = _mode("800x600p72", 50_000, "800 56 120 64", "600 37 6 23", True)
XGA = _mode("1024x768p60", 65_000, "1024 24 136 160", "768 3 6 29", False)
HD720 = _mode("1280x720p60", 74_250, "1280 110 40 220", "720 5 5 20", True, vic=4)

HD720_50 = HD720.model_copy(update={"name": "1280x720p50", "h_front": 440, "vic": 19})
"""CEA-861, 1280 x 720 at 50 Hz: longer lines."""

HD720_30 = HD720.model_copy(update={"name": "1280x720p30", "pixel_clock": 37_125, "vic": 0})
"""1280 x 720 at 30 Hz with the blanking of 60 Hz: half its clock; of no standard."""

VGA_MIDDLE = _mode("480x480p60 in 640x480p60", 25_200, "480 96 96 128", "480 10 2 33", False)
"""The middle of 640 x 480 at 60 Hz: 80 columns on either side count as blanking."""

MODES = (VGA, SVGA, XGA, HD720_50, HD720)
"""The modes that the EDID of a board without limits offers, smallest first."""

# CEA-861, for cores that take several pixels a clock.
_SOURCE_MODES = (
    _mode("1920x1080p60", 148_500, "1920 88 44 148", "1080 4 5 36", True, vic=16),
    _mode("1920x1080p50", 148_500, "1920 528 44 148", "1080 4 5 36", True, vic=31),
    _mode("1920x1080p30", 74_250, "1920 88 44 148", "1080 4 5 36", True, vic=34),
    _mode("3840x2160p60", 594_000, "3840 176 88 296", "2160 8 10 72", True, vic=97),
    _mode("3840x2160p30", 297_000, "3840 176 88 296", "2160 8 10 72", True, vic=95),
)

_FIXED_MODES = (VGA, SVGA, HD720_30, XGA, HD720_50, HD720)
_FASTEST = 74_300
# Limit by the lanes' 500 Mb/s (`plenofir.fpga.bitstream.ecp5_limits`), below the PLL's.
_FASTEST_LANES = {3: 50_000}

PLL_CLOCKS = {4: (24, VGA), 3: (15, SVGA), 2: (12, SVGA_72)}
"""For each range of pixel clocks what 600 MHz are divided by for the board's own, and the timing of
the test pattern with it: 25 MHz, which is 640x480 at 59.5 Hz, 40 MHz, 50 MHz."""

CLOCK_RANGES = (4, 3, 2)
"""Ranges of pixel clocks that a fixed PLL can be built for, see `range_limits`."""


def range_limits(clock_range: int) -> tuple[float, float]:
    """Slowest and fastest pixel clock (kHz) of a build with a fixed PLL, as in ``hdmi_control``.

    `clock_range` is one of `CLOCK_RANGES`: cycles of the PLL's oscillator (400 to 800 MHz) in a
    fifth of a pixel; 0: a PLL that is set as the source wants it.
    """
    if clock_range == 0:
        return 24_000, _FASTEST
    return 82_000 / clock_range, min(
        158_000 / clock_range, _FASTEST_LANES.get(clock_range, _FASTEST)
    )


def modes_of_range(clock_range: int) -> tuple[VideoMode, ...]:
    """Modes that a build with a fixed PLL takes (see `range_limits`), smallest first."""
    if clock_range == 0:
        return MODES
    low, high = range_limits(clock_range)
    return tuple(mode for mode in _FIXED_MODES if low <= mode.pixel_clock <= high)


def find_mode(columns: int, rows: int, rate_hz: float) -> VideoMode | None:
    """Mode of `MODES`, 1280x720p30 or `VGA_MIDDLE`, of a size and a rate within 1 %."""
    return _of_size((*MODES, HD720_30, VGA_MIDDLE), columns, rows, rate_hz)


def find_source_mode(columns: int, rows: int, rate_hz: float) -> VideoMode | None:
    """A mode that a source outside sends: those of `find_mode`, and some too fast for a board."""
    return find_mode(columns, rows, rate_hz) or _of_size(_SOURCE_MODES, columns, rows, rate_hz)


def _of_size(
    modes: Iterable[VideoMode], columns: int, rows: int, rate_hz: float
) -> VideoMode | None:
    for mode in modes:
        if (mode.h_active, mode.v_active) == (columns, rows) and (
            abs(mode.frame_rate / rate_hz - 1) < 0.01
        ):
            return mode
    return None
