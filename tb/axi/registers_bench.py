# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``refocuser_registers``: any access, and resets anywhere."""

import itertools
import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, ReadOnly, RisingEdge

from plenofir_tb.axi_lite import OKAY, SLVERR, Channels
from plenofir_tb.axi_video import stall_pattern
from plenofir_tb.case import read_case
from plenofir_tb.register_map import MAP, PARTS, Model

CASE = read_case()
WORDS = CASE["words"]  # values of constant registers
SHIFTS, WEIGHTS, BOXES = CASE["shifts"], CASE["weights"], CASE["boxes"]
MAX_COLUMNS = MAP["limits"].fields_of(WORDS["limits"])["max_columns"]
ERRORS, STATUS = MAP["errors"].fields, MAP["interrupt_status"].fields
REFUSED = 1 << ERRORS["refused"][0]
ERROR = 1 << STATUS["error"][0]
INPUTS = (
    *("faults", "raster_columns", "raster_rows", "core_tready"),
    *("s_axis_tvalid", "s_axis_tuser", "s_axis_tlast"),
    *("m_axis_tvalid", "m_axis_tready", "m_axis_tuser", "m_axis_tid", "m_axis_tlast"),
)


class Bench:
    """The registers, their expected answers, and their outputs."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        # Not at an edge, where the outputs of the registers have not changed yet.
        Clock(dut.clk, 10, "ns").start(start_high=False)
        for name in INPUTS:
            getattr(dut, name).value = 0
        self.bus = Channels(dut)
        self.parts = {n for i, n in enumerate(PARTS) if WORDS["parts"] >> i & 1}
        self.loads: list[tuple[int, int, int]] = []
        self.restarts = 0
        self.begin()
        cocotb.start_soon(self._watch())

    def begin(self) -> None:
        """Expect the state after a reset."""
        self.model = Model(self.parts)
        self.errors = self.status = self.place = 0
        self.want_loads: list[tuple[int, int, int]] = []
        self.want_restarts = 0
        self.loads.clear()
        self.restarts = 0

    def pause(self) -> None:
        names = ("none", "none", "some", "many", "bursts")
        draw = (
            stall_pattern(self.rng.choice(names), random.Random(self.rng.random()))
            for _ in itertools.count()
        )
        self.bus.pause(draw)

    async def reset(self, clocks: int = 1) -> None:
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, clocks)
        self.bus.clear()
        self.dut.reset.value = 0
        await RisingEdge(self.dut.clk)
        self.begin()

    async def _watch(self) -> None:
        """Record the words of the load port, and restarts."""
        dut = self.dut
        while True:
            await RisingEdge(dut.clk)
            await ReadOnly()
            if str(dut.reset.value) == "0":
                self.restarts += int(dut.restart.value)
                if int(dut.load_write.value):
                    ports = dut.load_kind, dut.load_address, dut.load_data
                    self.loads.append(tuple(int(p.value) for p in ports))  # type: ignore[arg-type]

    def address(self) -> int:
        """Draw an address: mostly of a register, sometimes beside or beyond all."""
        kind = self.rng.random()
        if kind < 0.85:
            return self.rng.randrange(len(MAP)) * 4
        if kind < 0.95:
            return self.rng.randrange(4 * len(MAP) + 16)
        return self.rng.randrange(1 << 12)

    def word(self, address: int) -> int:
        """Draw a word; that of a frame size often fits."""
        word = self.rng.getrandbits(32) & self.rng.choice([0xFFFFFFFF, 0xF, 0xFF])
        if address == MAP["frame_size"].address:
            columns = self.rng.choice([0, 1, MAX_COLUMNS, MAX_COLUMNS + 1, word % MAX_COLUMNS])
            return self.rng.choice([0, 1, 65535]) << 16 | columns
        return word

    def expected(self, address: int) -> int:
        """Expected value of the word that has a byte; 0 if it cannot be read."""
        if not self.model.reads(address & ~3):
            return 0
        name = self.model.present[address & ~3].name
        if name in self.model.kept:
            return self.model.kept[name]
        if name == "slice_shift":
            number = self.model.kept["asked_slice"]
            if number >= len(SHIFTS):
                return 0
            return BOXES[number] << 19 | WEIGHTS[number] << 14 | SHIFTS[number] & 0x3FFF
        changing = {
            "errors": self.errors,
            "interrupt_status": self.status,
            "load_place": self.place,
            "raster_size": int(self.dut.raster_rows.value) << 16
            | int(self.dut.raster_columns.value),
        }
        return WORDS.get(name, changing.get(name, 0))

    def refuse(self) -> None:
        """Expect that a word was refused."""
        self.errors |= REFUSED
        self.status |= ERROR

    def wrote(self, address: int, word: int, strobes: int) -> None:
        """Expect the effect of a write that is answered with OKAY."""
        if not strobes:
            return
        name = self.model.present[address & ~3].name
        ones = sum(word & 0xFF << 8 * i for i in range(4) if strobes >> i & 1)
        whole = strobes == 15
        restart = False
        if name == "frame_size":
            good = whole and not self.model.kept["control"] & 1
            good = good and 0 < word & 0xFFFF <= MAX_COLUMNS and word >> 16 > 0
            if good:
                self.model.kept[name] = word
                restart = True
            else:
                self.refuse()
        elif name == "command":
            restart = bool(ones & 1)
            if ones & 2 and "resampler" in self.parts:
                self.want_loads.append((3, -1, -1))
        elif name == "errors":
            self.errors &= ~ones
        elif name == "interrupt_status":
            self.status &= ~ones
        elif name == "load_place":
            if whole and word >> 20 & 3 != 3:
                self.place = word & 0x3FFFFF
            else:
                self.refuse()
        elif name == "load_word":
            if whole:
                kind, place = divmod(self.place, 1 << 20)
                high = self.model.kept["load_high"]
                self.want_loads.append((kind, place, high << 32 | word))
                self.place = kind << 20 | (place + 1) % (1 << 20)
            else:
                self.refuse()
        else:
            self.model.write(address, word, strobes)
        if restart:
            self.want_restarts += 1
            self.errors = self.status = 0

    async def access(self, alone: bool = True) -> None:
        """Write or read anywhere, and check the answer; values if nothing else writes."""
        address = self.address()
        if self.rng.random() < 0.5:
            word = self.word(address)
            strobes = self.rng.choice([15, 15, 0, self.rng.randrange(16)])
            answer = await self.bus.write(address, word, strobes)
            good = self.model.writable(address, strobes)
            assert answer == (OKAY if good else SLVERR), f"write to {address:#x}: {answer}"
            if good:
                self.wrote(address, word, strobes)
        else:
            word, answer = await self.bus.read(address)
            good = self.model.readable(address)
            assert answer == (OKAY if good else SLVERR), f"read of {address:#x}: {answer}"
            want = self.expected(address)
            assert word == want or not alone, f"read of {address:#x}: {word:#x}, want {want:#x}"

    async def fault(self) -> None:
        faults = self.rng.randrange(1, 64)
        self.dut.faults.value = faults
        await RisingEdge(self.dut.clk)
        self.dut.faults.value = 0
        await RisingEdge(self.dut.clk)
        self.errors |= faults
        self.status |= ERROR

    async def check(self) -> None:
        """Compare the outputs of the registers with the written values."""
        dut, kept = self.dut, self.model.kept
        await ClockCycles(dut.clk, 4)
        found = [
            load if load[0] != 3 else (3, -1, -1)
            for load in self.loads
            if "resampler" in self.parts
        ]
        assert found == self.want_loads
        assert self.restarts == self.want_restarts
        assert int(dut.interrupt.value) == bool(self.status & kept["interrupt_mask"])
        assert int(dut.columns.value) == kept["frame_size"] & 0xFFFF
        assert int(dut.rows.value) == kept["frame_size"] >> 16
        assert int(dut.sweep.value) == kept["control"] >> 1
        for name, port in (
            ("slice", dut.slice),
            ("sweep_frames", dut.sweep_frames),
            ("red_place", dut.red_place),
        ):
            assert int(port.value) == kept.get(name, 0), name


@cocotb.test()
async def any_access(dut: Any) -> None:
    """Reads and writes anywhere, with any strobes, pauses and faults between them."""
    bench = Bench(dut)
    await bench.reset(3)
    for number in range(CASE["accesses"]):
        if number % 50 == 0:
            bench.pause()
            dut.raster_columns.value = bench.rng.randrange(1 << 16)
            dut.raster_rows.value = bench.rng.randrange(1 << 16)
        await bench.access()
        if bench.rng.random() < 0.1:
            await ClockCycles(dut.clk, 3)
            await bench.fault()
        if bench.rng.random() < 0.2:
            await bench.check()
    await bench.check()


@cocotb.test()
async def events_beside_their_clearing(dut: Any) -> None:
    """A fault and a frame in every clock around the write that clears its bit: none is lost."""
    bench = Bench(dut)
    await bench.reset()
    edge, now, written = RisingEdge(dut.clk), 0, 0

    async def count() -> None:
        nonlocal now, written
        before = 0
        while True:
            await edge
            now += 1
            answers = int(dut.s_axi_ctrl_bvalid.value)
            if answers and not before:
                # The registers saw the write in the clock before its answer.
                written = now - 1
            before = answers

    cocotb.start_soon(count())
    signals = (
        ("errors", "faults", 1, 0),
        ("interrupt_status", "faults", ERROR, 0),
        # A frame that comes out is told a clock later.
        ("interrupt_status", "m_axis_tvalid", 1 << STATUS["frame_out"][0], 1),
    )
    dut.m_axis_tready.value = dut.m_axis_tuser.value = 1
    for (name, signal, bit, late), offset in itertools.product(signals, range(10)):
        address = MAP[name].address
        assert await bench.bus.write(address, 0x7F) == OKAY
        write = cocotb.start_soon(bench.bus.write(address, bit))
        await ClockCycles(dut.clk, offset)
        getattr(dut, signal).value = 1
        await edge
        getattr(dut, signal).value = 0
        await edge
        happened = now - 1 + late
        await write
        await ClockCycles(dut.clk, 3)
        word, _ = await bench.bus.read(address)
        assert bool(word & bit) == (happened >= written), (name, signal, offset)


@cocotb.test()
async def both_ways_at_once(dut: Any) -> None:
    """Reads during writes have the same answers as without, in order."""
    bench = Bench(dut)
    await bench.reset()
    bench.pause()
    rng, bus = bench.rng, bench.bus
    constant = [r.address for r in bench.model.present.values() if r.name in WORDS]

    async def reads() -> None:
        for _ in range(CASE["accesses"] // 4):
            address = rng.choice(constant)
            assert await bus.read(address) == (WORDS[bench.model.present[address].name], OKAY)

    reader = cocotb.start_soon(reads())
    for _ in range(CASE["accesses"] // 4):
        address = bench.address()
        word, strobes = bench.word(address), rng.randrange(16)
        good = bench.model.writable(address, strobes)
        assert await bus.write(address, word, strobes) == (OKAY if good else SLVERR)
        if good:
            bench.wrote(address, word, strobes)
    await reader
    await bench.check()


@cocotb.test()
async def reset_anywhere(dut: Any) -> None:
    """A reset of one clock in the middle of accesses restores the initial state."""
    bench = Bench(dut)
    await bench.reset(3)
    for _ in range(CASE["resets"]):
        bench.pause()
        for _ in range(bench.rng.randrange(8)):
            await bench.access()
        if bench.rng.random() < 0.5:
            await bench.fault()
        under_way = [cocotb.start_soon(bench.access(alone=False)) for _ in range(2)]
        await ClockCycles(dut.clk, bench.rng.randrange(1, 12))
        for task in under_way:
            task.cancel()
        await bench.reset()
        await ReadOnly()
        assert not int(dut.s_axi_ctrl_bvalid.value)
        assert not int(dut.s_axi_ctrl_rvalid.value)
        await RisingEdge(dut.clk)
        for address in bench.model.present:
            if bench.model.reads(address):
                assert await bench.bus.read(address) == (bench.expected(address), OKAY)
        await bench.check()
