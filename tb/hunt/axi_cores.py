# SPDX-License-Identifier: Apache-2.0
"""Cores behind AXI4-Lite: streams as in `hunt.cores`, beside them any access to the registers.

The registers are modelled clock by clock (docs/registers.md): an access acts in the clock before
its answer is first offered; what happens at the streams is seen 2 clocks later.
"""

import random
from collections.abc import Callable
from typing import Any

from hunt.buses import OKAY, SLVERR, LiteMaster, Write
from hunt.cores import CoreHunt
from hunt.references.frames import Frames
from hunt.references.raster_refocuser import Slices
from hunt.streams import Beat, FaultError, stalls
from plenofir_tb.register_map import MAP, Model, Register

COUNTERS = (
    *("frames_in", "frames_out", "lines_in", "lines_out", "stalls_in", "stalls_out", "dropped"),
)
FRAME_IN, FRAME_OUT, ERROR = (1 << n for n in range(3))
REFUSED = 1 << MAP["errors"].fields["refused"][0]
AT = {name: register.address for name, register in MAP.items()}
CONTROL = AT["control"]


class Gate:
    """Which beats go in, by docs/registers.md, and what they count as."""

    def __init__(self, tokens: int, rows: int) -> None:
        self.tokens, self.rows = tokens, rows
        self.let_in = self.open = self.excess = self.lasting = False
        self.column = self.row = 0

    def take(self, beat: Beat, enable: bool) -> tuple[bool, set[str]]:
        """Whether a beat reaches the core; the counters that count it."""
        told = set()
        if beat.start and not self.lasting:
            self.let_in = enable
            # Without a size the core drops frames.
            self.open, self.excess, self.column, self.row = enable and self.tokens > 0, False, 0, 0
            if self.open:
                told.add("frames_in")
        begins = self.column == 0
        self.column += 1
        ends = self.column >= self.tokens or beat.last
        self.lasting = beat.start and not ends
        if ends:
            self.column = 0
        if not self.open or self.excess:
            self.excess = self.excess and not beat.last
            return self.let_in, {*told, "dropped"}
        if begins:
            told.add("lines_in")
        if ends:
            self.excess = not beat.last
            self.row += 1
            self.open = self.row < self.rows
        return self.let_in, told


class AxiHunt(CoreHunt):
    """Segments between restarts: size, enable, frames, accesses to registers all the time.

    `parts` are those of the core.
    """

    def __init__(self, bench: Any, rng: random.Random, picture: Any, parts: set[str], **o: Any):
        super().__init__(bench, rng, picture, **o)
        if len(bench.ports) < 3:
            bench.add(Registers(bench))
        self.bus: Registers = bench.ports[2]
        self.bus.hunt = self
        self.parts = parts
        self.pending: list[Beat] = []
        self.source.on_taken = self.pending.append

    # What the core does with the written values.

    def begin(self) -> None:
        """Expect the state behind a reset or restart."""
        bus = self.bus
        self.frames, self.slices = Frames(), Slices(max(self.count, 1))
        self.begun, self.lasting, self.widths = [], False, []
        self.checked = self.at = 0
        size = bus.model.kept["frame_size"]
        self.columns, self.rows = (size & 0xFFFF) or 1, (size >> 16) or 1
        self.gate = Gate(self.tokens if size else 0, size >> 16)
        self.supported = size > 0
        self.sink.received.clear()
        self.sink.refused = None
        self.pending.clear()

    def takes(self, kept: dict[str, int]) -> set[str]:
        """Take the beats of this clock; the counters that count them."""
        told: set[str] = set()
        for beat in self.pending:
            self.order = kept.get("slice", 0), kept["control"] >> 1, kept.get("sweep_frames", 0)
            reaches, counts = self.gate.take(beat, bool(kept["control"] & 1))
            told |= counts
            if reaches:
                self.taken(beat)
                self.frames.take([beat], self.tokens, self.rows, supported=self.supported)
                self.widths += [self.columns] * (len(self.frames.frames) - len(self.widths))
        self.pending.clear()
        return told

    def flags(self) -> tuple[int, int]:
        """Faults of the stream when all is over, and those that may or may not be there."""
        return self.frames.flags, 0

    # A stream.

    async def run(self) -> None:
        bench, rng, bus = self.bench, self.rng, self.bus
        self.source.stalls, self.sink.stalls = stalls(rng), stalls(rng)
        self.sink.shy = rng.random() < 0.1
        bus.draw(rng)
        self.source.queue.clear()
        await bench.reset(rng.choice([1, 1, 2, 9]))
        bus.begin()
        if rng.random() < 0.2:
            await self.without_size()
        for _ in range(rng.randint(1, 3)):
            await self.segment()
            if rng.random() < 0.2:
                return

    async def without_size(self) -> None:
        self.bench.counts["frames: without a size"] += 1
        await self.bus.set("control", enable=1)
        self.columns, self.rows = 3, 2
        self.source.send(self.words())
        await self.bench.until(lambda: self.source.idle, 10**5, "the source is refused")

    async def segment(self) -> None:
        """A size, frames that go in or not, accesses at any time; then the output and registers."""
        bench, rng, bus = self.bench, self.rng, self.bus
        bus.share = 0.0
        await self.bus.set("control")
        # Beats that were on offer belong to no frame of the new size.
        await bench.until(lambda: self.source.idle, 10**5, "the source is refused")
        columns, rows = self.size(rng)
        await self.bus.set("frame_size", columns=columns, rows=rows)
        await self.bus.set("control", enable=1, sweep=rng.randrange(2))
        bus.switches = rng.random() < 0.3
        bus.share = 1 if bus.focus else rng.choice([0.02, 0.2, 1])
        for items in self.start_frames():
            self.source.send(items)
        kind = rng.choice(["whole", "whole", "whole", "restart", "reset"])
        bench.counts[f"segments: {kind}"] += 1
        if kind != "whole":
            await bench.clocks(rng.randint(1, self.limit(columns, rows)))
            bus.share = 0.0
            if kind == "restart":
                await self.bus.set("command", restart=1)
            else:
                self.source.queue.clear()
                await bench.reset()
                bus.begin()
            return
        limit = 40 * (self.limit(columns, rows) + 4 * len(self.source.queue) + 400)
        await bench.until(lambda: self.source.idle, limit, "the source is refused")
        bus.switches = False
        await self.bus.set("control", enable=1)
        self.source.send(self.words())
        await bench.until(lambda: self.source.idle, limit, "the source is refused")
        if self.frames.is_open:
            self.source.send([Beat(0, False, n % self.tokens == self.tokens - 1)
                              for n in range(self.tokens * self.rows)])  # fmt: skip
        await self.come_out()
        await bench.clocks(60)
        bus.share = 0.0
        await bench.until(lambda: bus.master.idle, 10**5, "the last accesses")
        if self.frames.is_open or len(self.sink.received) != self.at:
            raise FaultError(f"{len(self.sink.received)} beats came, {self.at} were expected")
        bus.exact = True
        bus.sweep_over()
        await bench.until(lambda: bus.master.idle, 10**5, "the last reads")
        bus.exact = False


class Registers:
    """The registers' bus, and the model of all that they tell."""

    def __init__(self, bench: Any) -> None:
        self.bench, self.dut = bench, bench.dut
        self.master = LiteMaster(bench.dut)
        self.master.wrote, self.master.read = self.wrote, self.found
        self.hunt: Any = None
        self.rng = random.Random(0)
        self.share, self.switches, self.exact = 0.0, False, False
        self.model = Model(set())
        self.shown: int | None = None
        self.interrupt = 0
        # Where the next word of a calibration goes, and what is called with each.
        self.load_place = 0
        self.loaded: Callable[[tuple[int, int, int], int], None] = lambda word, clock: None
        self.clock = 0

    async def set(self, name: str, **fields: int) -> None:
        """Write a register, and wait for the answer."""
        master = self.master
        master.write(Write(AT[name], MAP[name].word_of(**fields)))
        due = master.answered + len(master.writing)
        await self.bench.until(
            lambda: master.answered >= due, 10**5, f"a write to {name} is not answered"
        )
        await self.bench.clocks(2)

    def draw(self, rng: random.Random) -> None:
        self.rng = random.Random(rng.random())
        # A register that is written again and again.
        self.focus = rng.choice([0, *(AT[n] for n in ("slice", "interrupt_status", "errors"))])
        if self.focus == 0 or rng.random() < 0.5:
            self.master.draw_stalls(rng)
        self.bench.counts[f"accesses: {'anywhere' if not self.focus else 'one register'}"] += 1

    def restart(self) -> None:
        """A reset of the entity."""
        self.master.restart()

    def begin(self) -> None:
        """Expect the state behind a reset."""
        self.model = Model(self.hunt.parts)
        self.share, self.switches, self.exact, self.restarting = 0.0, False, False, False
        self.shown, self.load_place = None, 0
        self.begin_core()
        self.before = self.now()

    def begin_core(self) -> None:
        """Expect the state behind a reset or restart of the core."""
        self.happened = self.errors = 0
        # Faults of the stream come some clocks behind it, and are cleared at any time.
        self.cleared = 0
        self.counts = dict.fromkeys(COUNTERS, 0)
        # Of the streams: what was counted in this clock and the one before.
        self.coming: list[set[str]] = [set(), set()]
        self.inside, self.interrupt = False, 0
        self.hunt.begin()

    def now(self) -> dict[str, int | None]:
        """Values of registers in this clock, as far as they are known."""
        shown = self.shown
        return {
            **self.model.kept,
            **self.counts,
            "interrupt_status": self.happened,
            "errors": self.errors,
            "load_place": self.load_place,
            "status": None if shown is None else shown | self.inside << 8,
        }

    def wrote(self, write: Write, answer: int) -> None:
        """A write that acted in the clock before."""
        if answer != (OKAY if self.model.writable(write.address, write.strobes) else SLVERR):
            raise FaultError(f"{write}: answer {answer}")
        register = self.model.present.get(write.address & ~3)
        if answer != OKAY or not write.strobes or register is None:
            return
        ones = sum(write.word & 0xFF << 8 * i for i in range(4) if write.strobes >> i & 1)
        kept = self.model.kept
        if register.name == "frame_size":
            columns, rows = write.word & 0xFFFF, write.word >> 16
            good = write.strobes == 15 and not kept["control"] & 1 and columns > 0 and rows > 0
            if good and columns <= self.hunt.g["MAX_COLUMNS"]:
                kept["frame_size"] = write.word
                self.restarting = True
            else:
                self.refuse()
        elif register.name == "command":
            self.restarting = bool(ones & 1)
            if ones & 2:
                self.loaded((3, 0, 0), self.clock)
        elif register.name in ("load_place", "load_word"):
            self.load(register, write)
        elif register.name == "errors":
            self.errors &= ~ones
            self.cleared |= ones
        elif register.name == "interrupt_status":
            self.happened &= ~ones
            self.cleared |= ones << 8
        else:
            self.model.write(write.address, write.word, write.strobes)

    def refuse(self) -> None:
        """A write that changed nothing."""
        self.errors |= REFUSED
        self.happened |= ERROR

    def load(self, register: Register, write: Write) -> None:
        """A word of a calibration, or where it goes: whole or not at all."""
        fields = register.fields_of(write.word)
        if write.strobes != 15 or fields.get("kind") == 3:
            self.refuse()
        elif register.name == "load_place":
            self.load_place = write.word & register.mask
        else:
            place = MAP["load_place"].fields_of(self.load_place)
            word = self.model.kept["load_high"] << 32 | write.word
            self.loaded((place["kind"], place["address"], word), self.clock)
            place["address"] = (place["address"] + 1) % (1 << 20)
            self.load_place = MAP["load_place"].word_of(**place)

    def found(self, address: int, word: int, answer: int) -> None:
        """An answer to a read, of what was there in the clock before."""
        if answer != (OKAY if self.model.readable(address) else SLVERR):
            raise FaultError(f"read of {address:#x}: answer {answer}")
        register = self.model.present.get(address & ~3)
        if register is None or not self.model.reads(address & ~3):
            want: int | None = 0
        else:
            want = self.before.get(register.name)
        name = register.name if register else ""
        if self.exact and name == "raster_size":
            sizes = self.hunt.raster_words()
            if sizes and word not in sizes:
                raise FaultError(f"raster_size reads {word:#x}, want one of {sizes}")
        if want is None:
            return
        loose = 0
        if name == "errors":
            loose = 0x3F
        elif name == "interrupt_status":
            loose = ERROR
        if self.exact and name == "errors" and not self.cleared & 0x3F:
            flags, loose = self.hunt.flags()
            want = want & REFUSED | flags
        if (word ^ want) & ~loose:
            raise FaultError(f"{name} ({address:#x}) reads {word:#x}, want {want:#x}")

    def step(self, clock: int) -> None:
        if self.hunt is None or not hasattr(self, "before"):
            return
        hunt, dut, self.clock = self.hunt, self.dut, clock
        mask = self.before["interrupt_mask"] or 0
        if not mask & ERROR and str(dut.interrupt.value) != str(self.interrupt):
            raise FaultError(f"the interrupt is {dut.interrupt.value}, want {self.interrupt}")
        # Reads saw the clock before; writes are seen from this one on.
        self.master.step_reads()
        self.master.step_writes()
        told = self.coming.pop(0)
        for name in told:
            self.counts[name] += 1
        self.happened |= FRAME_IN * ("frames_in" in told) | FRAME_OUT * ("frames_out" in told)
        self.inside = hunt.gate.open
        self.before = self.now()
        self.interrupt = int(self.happened & self.model.kept["interrupt_mask"] > 0)
        signals = ("s_axis_tvalid", "s_axis_tready", "m_axis_tvalid", "m_axis_tready")
        signals += ("m_axis_tuser", "m_axis_tlast")
        offered, taken, given, free, start, last = (
            str(getattr(dut, name).value) == "1" for name in signals
        )
        if given:
            self.shown = int(str(dut.m_axis_tid.value), 2) if "refocuser" in hunt.parts else 0
        if self.restarting:
            # Of what goes through in this clock nothing is left.
            self.restarting = False
            self.begin_core()
            self.access()
            return
        new = hunt.takes(self.model.kept)
        new |= {"stalls_in"} if offered and not taken else set()
        new |= {"stalls_out"} if given and not free else set()
        if given and free:
            new |= {"frames_out"} if start else set()
            new |= {"lines_out"} if last else set()
        self.coming.append(new)
        self.access()

    def access(self) -> None:
        """Draw a read and a write, if few are under way."""
        rng, master = self.rng, self.master
        if len(master.reading) < 3 and rng.random() < self.share:
            master.ask(self.address(), rng.randrange(8))
        if len(master.writing) < 3 and rng.random() < self.share:
            self.draw_write(self.address())

    def address(self) -> int:
        """Draw the address of a byte."""
        rng = self.rng
        if self.focus and rng.random() < 0.9:
            return self.focus + rng.randrange(4)
        near = [CONTROL, *(AT[n] for n in ("slice", "sweep_frames", "interrupt_status", "errors"))]
        return rng.choice([rng.choice(near), rng.randrange(4 * len(MAP)), rng.randrange(1 << 12)])

    def draw_write(self, address: int) -> None:
        rng = self.rng
        strobes = rng.choice([0, 15, rng.randrange(16), 1 << (address & 3)])
        word = rng.getrandbits(32) >> rng.choice([0, 28])
        if address & ~3 == self.focus:
            strobes, word = rng.choice([15, strobes]), rng.choice([0xFF, word])
        place = address & ~3
        if place == AT["command"] or (place == AT["frame_size"] and self.switches):
            return
        # What would spoil a picture that is expected.
        if place == AT["red_place"]:
            strobes &= 0xE
        elif place in (AT["load_place"], AT["load_word"]) and strobes == 15:
            strobes = rng.randrange(15)
        elif place == AT["load_high"]:
            strobes &= 0xE
        if address & ~3 == CONTROL and not self.switches:
            word |= 1
        self.master.write(Write(address, word, strobes), rng.randrange(8))

    def sweep_over(self) -> None:
        """Read every register."""
        for register in self.model.present.values():
            self.master.ask(register.address + self.rng.randrange(4))
