# SPDX-License-Identifier: Apache-2.0
"""AXI4-Stream video: driver, monitor and stall patterns on cocotb-bus classes."""

import random
from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt
from cocotb.triggers import RisingEdge
from cocotb_bus.drivers import BusDriver
from cocotb_bus.monitors import BusMonitor

from plenofir_tb.levels import levels

SIGNALS = ["tvalid", "tready", "tdata", "tuser", "tlast"]
StallPattern = Iterator[bool]
Frame = npt.NDArray[np.integer]


class Beat(NamedTuple):
    """One transfer: a pixel and its side band; only outputs have a slice."""

    data: int
    start_of_frame: bool
    end_of_line: bool
    slice: int = 0


def no_stalls() -> StallPattern:
    while True:
        yield False


def random_stalls(rng: random.Random, share: float) -> StallPattern:
    """Stall each clock with a probability."""
    while True:
        yield rng.random() < share


def bursty_stalls(rng: random.Random, longest: int) -> StallPattern:
    """Alternate between runs of stalls and runs of transfers of random lengths."""
    while True:
        for stalled in (True, False):
            for _ in range(rng.randint(1, longest)):
                yield stalled


def stall_pattern(name: str, rng: random.Random) -> StallPattern:
    """Stall pattern by name: none, some, many or bursts."""
    patterns: dict[str, Callable[[], StallPattern]] = {
        "none": no_stalls,
        "some": lambda: random_stalls(rng, 0.2),
        "many": lambda: random_stalls(rng, 0.7),
        "bursts": lambda: bursty_stalls(rng, 25),
    }
    return patterns[name]()


def pack_pixels(frame: Frame, pixel_bits: int) -> npt.NDArray[np.object_]:
    """Pack channels into one number a pixel, channel 0 in the low bits."""
    channels = frame.reshape(*frame.shape[:2], -1).astype(object)
    return sum(channels[:, :, c] << (c * pixel_bits) for c in range(channels.shape[2]))


def frame_beats(frame: Frame, pixel_bits: int, pixels_per_beat: int = 1) -> list[Beat]:
    """Transfers of a well-formed frame, neighbouring pixels together, zeros after a line."""
    pixels = pack_pixels(frame, pixel_bits)
    rows, columns = pixels.shape
    width = pixel_bits * (1 if frame.ndim == 2 else frame.shape[2])
    return [
        Beat(
            sum(int(pixels[y, x + j]) << (j * width) for j in range(min(p, columns - x))),
            y == 0 and x == 0,
            x + p >= columns,
        )
        for p in [pixels_per_beat]
        for y in range(rows)
        for x in range(0, columns, p)
    ]


class AxiVideoSource(BusDriver):
    """Drives transfers, with stalls between them; counts the clocks in which it had to wait."""

    _signals = SIGNALS

    def __init__(self, entity: Any, name: str, clock: Any) -> None:
        super().__init__(entity, name, clock)
        self.stalls: StallPattern = no_stalls()
        self.refused_clocks = 0
        self.bus.tvalid.value = 0
        self.bus.tdata.value = 0
        self.bus.tuser.value = 0
        self.bus.tlast.value = 0

    async def _driver_send(self, transaction: Iterable[Beat], sync: bool = True) -> None:
        """Send transfers, one each clock unless a side stalls."""
        edge = RisingEdge(self.clock)
        bus = self.bus
        ready = levels(bus.tready)
        # Signals are only written when they change: a write costs more than a clock of the
        # simulator.
        held: Beat | None = None
        offered = False
        if sync:
            await edge
        for beat in transaction:
            while next(self.stalls):
                if offered:
                    bus.tvalid.value = 0
                    offered = False
                await edge
            if not offered:
                bus.tvalid.value = 1
                offered = True
            if held is None or held.data != beat.data:
                bus.tdata.value = beat.data
            if held is None or held.start_of_frame != beat.start_of_frame:
                bus.tuser.value = int(beat.start_of_frame)
            if held is None or held.end_of_line != beat.end_of_line:
                bus.tlast.value = int(beat.end_of_line)
            held = beat
            await edge
            while not int(ready()):
                self.refused_clocks += 1
                await edge
        if offered:
            bus.tvalid.value = 0


class AxiVideoSink(BusMonitor):
    """Takes transfers with random stalls, and passes them on one by one.

    Checks that an offered transfer stays unchanged until it is taken.
    """

    _signals = SIGNALS
    _optional_signals: ClassVar = ["tid"]

    def __init__(self, entity: Any, name: str, clock: Any, reset: Any) -> None:
        self.stalls: StallPattern = no_stalls()
        self.reset = reset
        super().__init__(entity, name, clock)

    async def _monitor_recv(self) -> None:
        edge = RisingEdge(self.clock)
        bus = self.bus
        offers = levels(bus.tvalid)
        readers = [levels(bus.tdata), levels(bus.tuser), levels(bus.tlast)]
        if hasattr(bus, "tid"):
            readers.append(levels(bus.tid))
        ready = False
        refused: Beat | None = None
        bus.tready.value = 0
        while True:
            await edge
            offer = None
            # Before the first reset signals may be undefined.
            if offers() == "1":
                data, start, end, *slices = [int(read(), 2) for read in readers]
                offer = Beat(data, bool(start), bool(end), *slices)
            if refused is not None or (offer is not None and not ready):
                running = str(self.reset.value) == "0"
                assert not running or refused in (None, offer), f"{refused} became {offer}"
                refused = offer if running and not ready else None
            if ready and offer is not None:
                self._recv(offer)
            was_ready, ready = ready, not next(self.stalls)
            if ready != was_ready:
                bus.tready.value = int(ready)
