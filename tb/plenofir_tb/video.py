# SPDX-License-Identifier: Apache-2.0
"""Raster signals into and out of a design, one pixel each clock."""

import random
from contextlib import suppress
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir.fpga.hdmi.link import RasterSignals, ReceivedFrame, raster_signals, split_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.levels import levels

COUNT_BITS = 12
"""Bits of a count of ``video_pkg``."""


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


def timing_vector(mode: VideoMode) -> int:
    """A mode as a vector of ``video_pkg``."""
    h_sync, v_sync = mode.h_active + mode.h_front, mode.v_active + mode.v_front
    counts = (
        *(mode.h_active, mode.h_total, h_sync, h_sync + mode.h_sync),
        *(mode.v_active, mode.v_total, v_sync, h_sync, v_sync + mode.v_sync, h_sync),
    )
    levels = mode.h_positive | mode.v_positive << 1
    return sum(n << COUNT_BITS * i for i, n in enumerate([*counts, levels]))


def light_field(
    mode: VideoMode, m: int, depths: tuple[int, ...], begins: tuple[int, int]
) -> np.ndarray:
    """The test pattern from its equation: its three bands, and the beginnings of the last two."""
    light = np.array([[0xFF, 0xC0, 0x40], [0x60, 0xFF, 0x60], [0x60, 0xA0, 0xFF]], np.uint8)
    dark = np.array([[0x40, 0x08, 0x20], [0x08, 0x40, 0x08], [0x08, 0x10, 0x40]], np.uint8)
    x, y = np.arange(mode.h_active), np.arange(mode.v_active)
    band = np.searchsorted(begins, x, side="right")
    depth = np.array(depths)[band]
    place_x = x // m * m + x % m * depth
    place_y = (y // m * m)[:, None] + (y % m)[:, None] * depth[None, :]
    lit = ((place_x[None, :] >> 3) ^ (place_y >> 3)) & 1
    return np.where(lit[:, :, None] == 1, light[band][None], dark[band][None])


def in_the_middle(raster: np.ndarray, m: int, mode: VideoMode) -> np.ndarray:
    """A stored light field in the middle of a frame, at a whole micro image, cropped to it."""
    out = np.zeros((mode.v_active, mode.h_active, 3), np.uint8)
    top, left = (
        max(there - side, 0) // 2 // m * m
        for there, side in zip(out.shape, raster.shape[:2], strict=False)
    )
    part = out[top : top + raster.shape[0], left : left + raster.shape[1]]
    part[...] = raster[: part.shape[0], : part.shape[1]]
    return out


def random_mode(rng: random.Random) -> VideoMode:
    """A mode of some hundred pixels, both polarities of both syncs."""
    parts = {
        f"{d}_{part}": rng.randint(1, most)
        for d in "hv"
        for part, most in (("active", 9), ("front", 3), ("sync", 3), ("back", 3))
    }
    return shrunken(
        "random",
        **{**parts, "h_active": rng.randint(2, 16), "v_active": rng.randint(2, 9)},
        h_positive=rng.random() < 0.5,
        v_positive=rng.random() < 0.5,
    )


def blank_frames(mode: VideoMode, count: int) -> RasterSignals:
    return raster_signals(mode, [np.zeros((mode.v_active, mode.h_active, 3), np.uint8)] * count)


async def reset(dut: Any, clocks: int = 2) -> None:
    """Reset, up to a falling clock."""
    dut.reset.value = 1
    await ClockCycles(dut.clk, clocks)
    await FallingEdge(dut.clk)
    dut.reset.value = 0


class VideoTap:
    """Drives and watches the ports ``<prefix>_active``, ``_h_sync``, ``_v_sync``, ``_pixel``."""

    def __init__(self, dut: Any, source: str = "in", sink: str = "out") -> None:
        names = ("active", "h_sync", "v_sync", "pixel")
        self.clk = dut.clk
        self.source = [getattr(dut, f"{source}_{name}") for name in names]
        self.sink = [getattr(dut, f"{sink}_{name}") for name in names]
        self.taken: list[tuple[int, int, int, int]] = []
        for port in self.source:
            port.value = 0

    async def drive(self, signals: RasterSignals) -> None:
        """Send a signal; the output meanwhile is added to `taken`."""
        rgb = signals.pixels.astype(np.uint32)
        packed = rgb[:, 0] | rgb[:, 1] << 8 | rgb[:, 2] << 16
        columns = (signals.active, signals.h_sync, signals.v_sync, packed)
        before: tuple[int | None, ...] = (None,) * len(columns)
        edge = FallingEdge(self.clk)
        sink = [levels(port) for port in self.sink]
        for values in zip(*(column.tolist() for column in columns), strict=True):
            for port, value, last in zip(self.source, values, before, strict=True):
                if value != last:
                    port.value = int(value)
            before = values
            await edge
            with suppress(ValueError):  # Undefined before the first reset.
                active, h_sync, v_sync, pixel = [int(read(), 2) for read in sink]
                self.taken.append((active, h_sync, v_sync, pixel))

    def frames(self, *, from_start: bool = False) -> list[ReceivedFrame]:
        """Whole frames in what was taken since the last call (see `split_frames`)."""
        words = np.array(self.taken, np.uint32).reshape(-1, 4)
        self.taken = []
        pixels = np.stack([words[:, 3] >> (8 * c) & 255 for c in range(3)], axis=1)
        flags = words[:, :3].astype(bool)
        signals = RasterSignals(flags[:, 0], flags[:, 1], flags[:, 2], pixels.astype(np.uint8))
        return split_frames(signals, from_start=from_start)


ERRORS = ("overflow", "underflow", "miss", "core")


class VideoBench:
    """Video source, ``refocus_video``, video sink; all settings are 0 at first.

    `errors` are the names of those that were flagged so far.
    """

    LOADED_BY_PORT = True
    """Whether the load port is among the design's ports."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = np.random.default_rng(cocotb.RANDOM_SEED)
        self.random = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start()
        self.tap = VideoTap(dut)
        self.errors: set[str] = set()
        chosen = ("pass_through", "slice", "sweep", "sweep_frames", "shown")
        load = ("load_write", "load_kind", "load_address", "load_data")
        for name in (*chosen, *load) if self.LOADED_BY_PORT else chosen:
            getattr(dut, name).value = 0
        cocotb.start_soon(self._watch())

    async def _watch(self) -> None:
        edge, read = FallingEdge(self.dut.clk), levels(self.dut.errors)
        while True:
            await edge
            flags = read()
            if "1" in flags:
                self.errors |= {
                    name for name, flag in zip(ERRORS, flags[::-1], strict=True) if flag == "1"
                }

    async def reset(self) -> None:
        self.dut.reset.value = 1
        for _ in range(3):
            await FallingEdge(self.dut.clk)
        self.dut.reset.value = 0

    def pictures(self, mode: VideoMode, count: int) -> list[np.ndarray]:
        """Random RGB pictures for a mode."""
        shape = (count, mode.v_active, mode.h_active, 3)
        return list(self.rng.integers(0, 256, shape, np.uint8))


def part(signals: RasterSignals, begin: int, end: int | None = None) -> RasterSignals:
    return RasterSignals(*(values[begin:end] for values in vars(signals).values()))
