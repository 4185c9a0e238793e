# SPDX-License-Identifier: Apache-2.0
"""A sensor behind AXI4-Lite: frames as in `hunt.sensors`; calibrations go through the registers.

The registers are modelled as in `hunt.axi_cores`.
"""

import random

from hunt.axi_cores import AT, Gate, Registers
from hunt.bench import Bench
from hunt.buses import Write
from hunt.grids import grid_for
from hunt.references.frames import Frames
from hunt.sensors import MORE, Loader, SensorHunt, Word
from hunt.streams import Beat, FaultError, Sink, Source, stalls
from plenofir_tb.register_map import MAP


class RegisterLoader(Loader):
    """Writes words of calibrations into the registers, between other accesses."""

    def __init__(self, bench: Bench, source: Source, bus: Registers) -> None:
        self.bus = bus
        super().__init__(bench, source)

    def connect(self) -> None:
        self.bus.loaded = self.took
        # `load_place` and `load_high` behind the writes that are queued.
        self.place, self.high = 0, 0

    def restart(self) -> None:
        super().restart()
        self.place, self.high = 0, 0

    def step(self, clock: int) -> None:
        if self.silence:
            self.silence -= 1
        elif self.queue and len(self.bus.master.writing) < 3:
            item = self.queue.popleft()
            if isinstance(item, int):
                self.silence = item
            else:
                self.write(item)

    def write(self, word: Word) -> None:
        """Write a word: where it goes and its high bits only if needed, or by chance."""
        rng, master = self.bus.rng, self.bus.master
        kind, address, data = word
        if kind == 3:
            master.write(
                Write(AT["command"], MAP["command"].word_of(commit=1), rng.choice([1, 15]))
            )
            return
        place = MAP["load_place"].word_of(kind=kind, address=address)
        if place != self.place or rng.random() < 0.1:
            master.write(Write(AT["load_place"] + rng.randrange(4), place))
        if data >> 32 != self.high or rng.random() < 0.1:
            high = rng.getrandbits(24) << 8 | data >> 32
            master.write(Write(AT["load_high"], high, rng.randrange(16) | 1))
        master.write(Write(AT["load_word"] + rng.randrange(4), data & 0xFFFFFFFF))
        following = (address + 1) % (1 << 20)
        self.place = MAP["load_place"].word_of(kind=kind, address=following)
        self.high = data >> 32

    @property
    def idle(self) -> bool:
        return not (self.queue or self.silence or self.bus.master.writing)


class SensorAxiHunt(SensorHunt):
    """Segments between restarts: size, calibration, frames, accesses to registers all the time."""

    def __init__(self, bench: Bench, rng: random.Random, *, mosaic: bool) -> None:
        super().__init__(bench, rng, mosaic=mosaic)
        self.bus: Registers = bench.ports[3]
        self.bus.hunt = self
        self.parts = {"resampler", *(["mosaic"] if mosaic else [])}
        self.pending: list[Beat] = []
        self.source.on_taken = self.pending.append

    def connect(self) -> None:
        bench = self.bench
        source, sink, bus = Source(bench.dut, "s_axis"), Sink(bench.dut, "m_axis"), Registers(bench)
        for port in (source, sink, RegisterLoader(bench, source, bus), bus):
            bench.add(port)

    # What the core does with the written values.

    def begin(self) -> None:
        """Expect the state behind a reset or restart; the calibration stays."""
        size = self.bus.model.kept["frame_size"]
        self.columns, self.rows = (size & 0xFFFF) or 1, (size >> 16) or 1
        self.gate = Gate(size & 0xFFFF, size >> 16)
        self.supported = size > 0
        self.frames = Frames()
        self.begins, self.shapes, self.starts, self.ends = [], [], [], []
        self.sent = 0
        self.rasters, self.loose = {}, 0
        self.loader.taken, self.loader.incomplete = [], 0
        self.sink.received.clear()
        self.sink.refused = None
        self.pending.clear()

    def takes(self, kept: dict[str, int]) -> set[str]:
        """Take the beats of this clock; the counters that count them."""
        told: set[str] = set()
        for beat in self.pending:
            reaches, counts = self.gate.take(beat, bool(kept["control"] & 1))
            told |= counts
            if reaches:
                self.loader.taken.append(self.bus.clock)
                self.note(beat, supported=self.supported)
        self.pending.clear()
        return told

    def flags(self) -> tuple[int, int]:
        """Faults when all is over, and those that may or may not be there."""
        self.judge_grids()
        return self.frames.flags, self.loose

    # A stream.

    async def run(self) -> None:
        bench, rng, bus = self.bench, self.rng, self.bus
        self.source.stalls, self.sink.stalls = stalls(rng), stalls(rng)
        self.sink.shy = rng.random() < 0.1
        bus.draw(rng)
        await bench.reset(rng.choice([1, 1, 2, 9]))
        bus.begin()
        for _ in range(rng.randint(1, 3)):
            await self.part()
            if rng.random() < 0.2:
                return

    async def sends(self, beats: list[Beat | int]) -> None:
        """Send beats, and wait until they are taken."""
        self.source.send(beats)
        limit = 200 * (self.columns + 20) * (self.rows + 20) + 100 * len(self.source.queue)
        await self.bench.until(lambda: self.source.idle, limit, "the source is refused")

    async def part(self) -> None:
        """A size, a calibration, frames that go in or not, accesses at any time; then what came."""
        bench, rng, bus, loader = self.bench, self.rng, self.bus, self.loader
        bus.share = 0.0
        await bus.set("control")
        # Beats that were on offer belong to no frame of the new size.
        await self.sends([])
        grid = self.size()
        kind = rng.choice(["fitting"] * 6 + ["tall", "single"])
        tall = None
        if kind == "tall":
            tall = grid_for(rng, self.g, self.rows, self.columns, tall=True)
            bench.counts["frames: more lines than the ring"] += tall is not None
        self.load(tall or grid)
        if kind == "single":
            self.single()
        self.refused_from = 0 if tall or kind == "single" else 1 << 30
        if self.mosaic:
            await bus.set("red_place", column=self.red & 1, row=self.red >> 1)
        await bus.set("frame_size", columns=self.columns, rows=self.rows)
        await bench.until(lambda: loader.idle, 10**5, "the load")
        await bus.set("control", enable=1)
        bus.switches = rng.random() < 0.3
        bus.share = 1 if bus.focus else rng.choice([0.02, 0.2, 1])
        if not tall and kind == "fitting":
            self.some_loads()
        for items in self.segment():
            self.source.send(items)
        end = rng.choice(["whole", "whole", "whole", "restart", "reset"])
        bench.counts[f"segments: {end}"] += 1
        if end == "whole":
            await self.whole()
        else:
            await bench.clocks(rng.randint(1, 3 * self.columns * self.rows + 60))
            if end == "reset":
                self.source.queue.clear()
            bus.share = 0.0
            await bench.until(lambda: loader.idle and bus.master.idle, 10**5, "the load")
            if end == "restart":
                await bus.set("command", restart=1)
            else:
                await bench.reset()
                bus.begin()
        self.partial = bool(loader.written)

    async def whole(self) -> None:
        """Let all frames come out; then every register tells what has happened."""
        bench, bus, loader = self.bench, self.bus, self.loader
        await self.sends([])
        bus.switches = False
        await bus.set("control", enable=1)
        await self.sends(list(self.beats()))
        if self.frames.is_open:
            await self.sends([Beat(0, False, n % self.columns == self.columns - 1)
                              for n in range(self.columns * self.rows)])  # fmt: skip
        await self.come_out()
        bus.share = 0.0
        await bench.until(lambda: loader.idle and bus.master.idle, 10**5, "the last accesses")
        await bench.clocks(200)
        wrong = self.outcome()
        if wrong:
            raise FaultError("beats are missing" if wrong == MORE else wrong)
        bus.exact = True
        bus.sweep_over()
        await bench.until(lambda: bus.master.idle, 10**5, "the last reads")
        bus.exact = False

    def raster_words(self) -> set[int]:
        """What `raster_size` may read as when all is over."""
        return {MAP["raster_size"].word_of(columns=c, rows=r) for r, c in self.sizes()}
