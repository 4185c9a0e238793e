"""Raster signals into and out of a design, one pixel each clock."""

from contextlib import suppress
from typing import Any

import numpy as np
from cocotb.triggers import FallingEdge

from plenofir.fpga.hdmi.link import RasterSignals, ReceivedFrame, split_frames
from plenofir.fpga.hdmi.modes import VideoMode

MEASURED = {"name": "measured", "pixel_clock": 1}


def shrunken(name: str, **changes: int | bool) -> VideoMode:
    """Make a small mode of 720p60's proportions, or with some of its parts changed."""
    parts: dict[str, Any] = {
        "name": name,
        "pixel_clock": 74_250,
        "h_active": 64,
        "h_front": 6,
        "h_sync": 4,
        "h_back": 11,
        "v_active": 36,
        "v_front": 1,
        "v_sync": 2,
        "v_back": 4,
        "h_positive": True,
        "v_positive": True,
    }
    return VideoMode.model_validate({**parts, **changes})


# A thirty-second of 720p60, blanking included.
MODE_720 = shrunken(
    "720",
    h_active=40,
    h_front=3,
    h_sync=2,
    h_back=7,
    v_active=22,
    v_front=1,
    v_sync=1,
    v_back=2,
)


def measured(mode: VideoMode) -> VideoMode:
    """The mode as a sink measures it."""
    return mode.model_copy(update=MEASURED)


class VideoTap:
    """Drives and watches the ports ``<prefix>_active``, ``_h_sync``, ``_v_sync``, ``_pixel``.

    Parameters
    ----------
    dut
        Design with ``clk``.
    source, sink
        Prefixes of the two sets of ports.
    """

    def __init__(self, dut: Any, source: str = "in", sink: str = "out") -> None:
        names = ("active", "h_sync", "v_sync", "pixel")
        self.clk = dut.clk
        self.source = [getattr(dut, f"{source}_{name}") for name in names]
        self.sink = [getattr(dut, f"{sink}_{name}") for name in names]
        self.taken: list[tuple[int, int, int, int]] = []
        for port in self.source:
            port.value = 0

    async def drive(self, signals: RasterSignals) -> None:
        """Send a signal; what comes out meanwhile is added to `taken`."""
        rgb = signals.pixels.astype(np.uint32)
        packed = rgb[:, 0] | rgb[:, 1] << 8 | rgb[:, 2] << 16
        columns = (signals.active, signals.h_sync, signals.v_sync, packed)
        before: tuple[int | None, ...] = (None,) * len(columns)
        for values in zip(*(column.tolist() for column in columns), strict=True):
            for port, value, last in zip(self.source, values, before, strict=True):
                if value != last:
                    port.value = int(value)
            before = values
            await FallingEdge(self.clk)
            with suppress(ValueError):  # Undefined before the first reset.
                self.taken.append(tuple(int(port.value) for port in self.sink))

    def frames(self, *, from_start: bool = False) -> list[ReceivedFrame]:
        """Whole frames in what was taken since the last call (see `split_frames`)."""
        taken = np.array(self.taken, np.uint32).reshape(-1, 4)
        self.taken = []
        pixels = np.stack([taken[:, 3] >> (8 * c) & 255 for c in range(3)], axis=1)
        flags = taken[:, :3].astype(bool)
        signals = RasterSignals(flags[:, 0], flags[:, 1], flags[:, 2], pixels.astype(np.uint8))
        return split_frames(signals, from_start=from_start)
