# SPDX-License-Identifier: Apache-2.0
"""Video modes: sizes, blanking, polarities, pixel clocks."""

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
        """Frames a second."""
        return 1000 * self.pixel_clock / (self.h_total * self.v_total)

    def as_measured(self) -> "VideoMode":
        """Make the mode that a sink finds: the timing alone, with a pixel clock of 1."""
        return self.model_copy(update={"name": "measured", "pixel_clock": 1, "vic": 0})


VGA = VideoMode(
    name="640x480p60",
    pixel_clock=25_175,
    h_active=640,
    h_front=16,
    h_sync=96,
    h_back=48,
    v_active=480,
    v_front=10,
    v_sync=2,
    v_back=33,
    h_positive=False,
    v_positive=False,
    vic=1,
)
"""VESA DMT and CEA-861, 640 x 480 at 60 Hz."""

SVGA = VideoMode(
    name="800x600p60",
    pixel_clock=40_000,
    h_active=800,
    h_front=40,
    h_sync=128,
    h_back=88,
    v_active=600,
    v_front=1,
    v_sync=4,
    v_back=23,
    h_positive=True,
    v_positive=True,
)
"""VESA DMT 800 x 600 at 60 Hz."""

XGA = VideoMode(
    name="1024x768p60",
    pixel_clock=65_000,
    h_active=1024,
    h_front=24,
    h_sync=136,
    h_back=160,
    v_active=768,
    v_front=3,
    v_sync=6,
    v_back=29,
    h_positive=False,
    v_positive=False,
)
"""VESA DMT 1024 x 768 at 60 Hz."""

HD720 = VideoMode(
    name="1280x720p60",
    pixel_clock=74_250,
    h_active=1280,
    h_front=110,
    h_sync=40,
    h_back=220,
    v_active=720,
    v_front=5,
    v_sync=5,
    v_back=20,
    h_positive=True,
    v_positive=True,
    vic=4,
)
"""CEA-861, 1280 x 720 at 60 Hz."""

HD720_50 = HD720.model_copy(update={"name": "1280x720p50", "h_front": 440, "vic": 19})
"""CEA-861, 1280 x 720 at 50 Hz: longer lines."""

HD720_30 = HD720.model_copy(update={"name": "1280x720p30", "pixel_clock": 37_125, "vic": 0})
"""1280 x 720 at 30 Hz with the blanking of 60 Hz: half its clock; of no standard."""

MODES = (VGA, SVGA, XGA, HD720_50, HD720)
"""The modes that the EDID of a board without limits offers, smallest first."""

SVGA_72 = SVGA.model_copy(
    update={
        **{"name": "800x600p72", "pixel_clock": 50_000},
        **{"h_front": 56, "h_sync": 120, "h_back": 64},
        **{"v_front": 37, "v_sync": 6, "v_back": 23},
    }
)
"""VESA DMT 800 x 600 at 72 Hz."""

_FIXED_MODES = (VGA, SVGA, HD720_30, XGA, HD720_50, HD720)
_FASTEST = 74_300

OWN_CLOCKS = {4: (24, VGA), 3: (15, SVGA), 2: (12, SVGA_72)}
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
    return 82_000 / clock_range, min(158_000 / clock_range, _FASTEST)


def modes_of_range(clock_range: int) -> tuple[VideoMode, ...]:
    """Modes that a build with a fixed PLL takes (see `range_limits`), smallest first."""
    if clock_range == 0:
        return MODES
    low, high = range_limits(clock_range)
    return tuple(mode for mode in _FIXED_MODES if low <= mode.pixel_clock <= high)


def find_mode(columns: int, rows: int, rate_hz: float) -> VideoMode | None:
    """Mode of `MODES`, or 1280x720p30, of a size and a rate within 1 %."""
    for mode in (*MODES, HD720_30):
        if (mode.h_active, mode.v_active) == (columns, rows) and (
            abs(mode.frame_rate / rate_hz - 1) < 0.01
        ):
            return mode
    return None
