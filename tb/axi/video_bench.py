# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``refocuser_axi``: video, with control and status by the registers."""

import itertools
import random
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir_tb.axi_lite import OKAY, SLVERR, Channels
from plenofir_tb.axi_video import AxiVideoSink, AxiVideoSource, Beat, frame_beats, stall_pattern
from plenofir_tb.case import read_case
from plenofir_tb.frames import damaged, make_frame, repaired_frames
from plenofir_tb.register_map import MAP, Model
from plenofir_tb.slices import SliceModel

CASE = read_case()
CORE = CoreConfiguration.model_validate(CASE["core"])
P = CORE.pixels_per_clock
COUNTERS = ("frames_in", "frames_out", "lines_in", "lines_out", "dropped")
FLAGS = {
    "line early": "line_early",
    "line late": "line_late",
    "frame early": "frame_early",
    "frame late": "frame_late",
}


@dataclass
class Gate:
    """Model of which beats of a stream enter the core, by the rules of the registers."""

    tokens: int
    rows: int
    let_in: bool = False
    column: int = 0
    row: int = 0
    open: bool = False
    excess: bool = False
    lasting: bool = False

    def take(self, beat: Beat, enable: bool, counts: dict[str, int]) -> bool:
        """Count a beat; whether it reaches the core."""
        if beat.start_of_frame and not self.lasting:
            self.let_in = enable
            self.open, self.excess, self.column, self.row = enable, False, 0, 0
            counts["frames_in"] += enable
        self.column += 1
        line_ends = self.column == self.tokens or beat.end_of_line
        self.lasting = beat.start_of_frame and not line_ends
        if not self.open or self.excess:
            self.column *= not line_ends
            counts["dropped"] += 1
            self.excess = self.excess and not beat.end_of_line
            return self.let_in
        counts["lines_in"] += self.column == 1
        if line_ends:
            self.excess = not beat.end_of_line
            self.column = 0
            self.row += 1
            self.open = self.row < self.rows
        return self.let_in


class Bench:
    """Video through the core, and its registers."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start(start_high=False)
        self.bus = Channels(dut)
        self.source = AxiVideoSource(dut, "s_axis", dut.clk)
        # True while a reset or a restart may withdraw an offered beat.
        self.restarts = SimpleNamespace(value="1")
        self.sink = AxiVideoSink(dut, "m_axis", dut.clk, reset=self.restarts)
        self.frames: list[list[Beat]] = []
        self.sink.add_callback(self._take)
        self.stalls_out = 0
        # The registers, writes to them without an answer, and the slice that each frame gets.
        self.model = Model({"refocuser"})
        self.writes: deque[tuple[int, int, int]] = deque()
        self.slices: list[int] = []
        cocotb.start_soon(self._watch())

    def _take(self, beat: Beat) -> None:
        if beat.start_of_frame:
            self.frames.append([])
        self.frames[-1].append(beat)

    async def _watch(self) -> None:
        """Count stalls, and follow the slice that a frame gets with its first pixel.

        A write acts from the clock on in which its answer is offered.
        """
        dut = self.dut
        slices = SliceModel(len(CORE.shifts))
        answered = False
        while True:
            await RisingEdge(dut.clk)
            if str(dut.m_axis_tvalid.value) == "1" and str(dut.m_axis_tready.value) == "0":
                self.stalls_out += 1
            if str(dut.s_axi_ctrl_bvalid.value) == "1":
                if not answered and self.writes:
                    self.model.write(*self.writes.popleft())
                answered = str(dut.s_axi_ctrl_bready.value) == "0"
            if (
                "".join(str(dut[f"s_axis_{s}"].value) for s in ("tvalid", "tready", "tuser"))
                == "111"
            ):
                kept = self.model.kept
                self.slices.append(
                    slices.next_frame(kept["slice"], kept["control"] >> 1, kept["sweep_frames"])
                )

    async def reset(self) -> None:
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, 3)
        self.dut.reset.value = 0
        await RisingEdge(self.dut.clk)
        self.restarts.value = "0"

    def stall(self) -> None:
        """Draw stalls of all sides."""
        draw = (
            stall_pattern(self.rng.choice(["none", "some"]), random.Random(self.rng.random()))
            for _ in itertools.count()
        )
        self.bus.pause(draw)
        self.source.stalls, self.sink.stalls = next(draw), next(draw)

    async def write(self, name: str, **fields: int) -> None:
        """Write a register, by its fields."""
        register = MAP[name]
        assert await self.bus.write(register.address, register.word_of(**fields)) == OKAY

    async def read(self, name: str) -> dict[str, int]:
        word, answer = await self.bus.read(MAP[name].address)
        assert answer == OKAY
        return MAP[name].fields_of(word)

    async def counters(self) -> dict[str, int]:
        """Read the counters of what went through."""
        return {name: (await self.read(name))["count"] for name in COUNTERS}

    async def errors(self) -> set[str]:
        return {name for name, value in (await self.read("errors")).items() if value}

    async def start(self, columns: int, rows: int) -> None:
        """Set the frame size and enable the core."""
        await self.write("control")
        await self.write("frame_size", columns=columns, rows=rows)
        assert await self.read("frame_size") == {"columns": columns, "rows": rows}
        await self.write("control", enable=1)
        self.size = columns, rows

    def frame(self) -> Any:
        columns, rows = self.size
        return make_frame("random", rows, columns, CORE.channels, CORE.pixel_bits, self.rng)

    def beats(self, frame: Any) -> list[Beat]:
        return frame_beats(frame, CORE.pixel_bits, P)

    async def send(self, beats: Sequence[Beat]) -> None:
        """Send transfers, and wait until they were taken."""
        await self.source.send(beats)

    async def settle(self) -> None:
        """Wait until nothing has come out for a while."""
        quiet, before = 0, -1
        # Stalls double the latency.
        while quiet < 50 + 2 * CORE.latency_clocks(*self.size):
            await ClockCycles(self.dut.clk, 20)
            now = sum(map(len, self.frames))
            quiet = 0 if now != before else quiet + 20
            before = now

    def check_frame(self, got: Sequence[Beat], frame: Any) -> None:
        """Compare a frame of the output with the model of its slice."""
        want = CORE.golden_slice(frame, got[0].slice)
        wanted = self.beats(want)
        assert [b.data for b in got] == [b.data for b in wanted]
        assert [b.end_of_line for b in got] == [b.end_of_line for b in wanted]


def frame_of(lines: Sequence[Sequence[int]], columns: int) -> Any:
    """Turn packed pixels into a frame."""
    width = CORE.channels * CORE.pixel_bits
    mask = (1 << CORE.pixel_bits) - 1
    pixels = [
        [
            [word >> j * width + c * CORE.pixel_bits & mask for c in range(CORE.channels)]
            for word in line
            for j in range(P)
        ][:columns]
        for line in lines
    ]
    frame = np.array(pixels, np.uint8 if CORE.pixel_bits <= 8 else np.uint16)
    return frame[..., 0] if CORE.channels == 1 else frame


def draw_size(bench: Bench, rows: int = 0) -> tuple[int, int]:
    return bench.rng.randint(2, CORE.max_columns), rows or bench.rng.randint(1, 9)


@cocotb.test()
async def capabilities(dut: Any) -> None:
    """The core's description; and frames are dropped until there is a size."""
    bench = Bench(dut)
    await bench.reset()
    assert await bench.read("parts") == {
        **dict.fromkeys(MAP["parts"].fields, 0),
        "refocuser": 1,
    }
    assert await bench.read("geometry") == {
        "micro_image_size": CORE.micro_image_size,
        "slices": len(CORE.shifts),
        "channels": CORE.channels,
        "pixel_bits": CORE.pixel_bits,
        "pixels_per_clock": P,
    }
    generics = CORE.generics()
    assert await bench.read("limits") == {
        "max_columns": CORE.max_columns,
        "parallel_rows": CORE.parallel_rows,
    }
    engine = await bench.read("engine")
    names = {"order": "INTERPOLATION_ORDER"}
    for name in ("exact", "centred", "hold", "order", "fraction_bits", "guard_bits"):
        assert engine[name] == generics.get(names.get(name, name.upper()), 0), name
    assert engine["border_normalised"] == (CORE.border == "normalise")
    assert engine["moving_sum"] == (CORE.engine.kind == "moving_sum")
    for number, shift in enumerate(CORE.shifts):
        await bench.write("asked_slice", number=number)
        described = await bench.read("slice_shift")
        assert described["shift"] == shift & 0x3FFF
        assert (described["box"] or CORE.micro_image_size) == CORE.slice_boxes[number]
    bench.size = draw_size(bench)
    await bench.write("control", enable=1)
    await bench.send(bench.beats(bench.frame()))
    await ClockCycles(dut.clk, 10)
    assert await bench.errors() == {"frame_size"}
    counts = await bench.counters()
    assert counts == {**dict.fromkeys(COUNTERS, 0), "dropped": len(bench.beats(bench.frame()))}
    assert not bench.frames


@cocotb.test()
async def video_beside_accesses(dut: Any) -> None:
    """Any harmless access while frames run: frames are right, with the slice of their start."""
    bench = Bench(dut)
    await bench.reset()
    await bench.start(*draw_size(bench))
    rng = bench.rng
    frames = [bench.frame() for _ in range(CASE["frames"])]
    bench.model.kept["control"] = 1
    bench.slices.clear()
    running = True

    async def accesses() -> None:
        model, control = bench.model, MAP["control"].address
        spared = range(control, MAP["command"].address + 4)
        near = [MAP[name].address for name in ("control", "slice", "sweep_frames")]
        while running:
            # Registers, beside them, beyond them.
            address = rng.choice(
                [rng.choice(near), rng.randrange(4 * len(MAP)), rng.randrange(1 << 12)]
            )
            if rng.random() < 0.6 and (address == control or address not in spared):
                word, strobes = rng.getrandbits(32) >> rng.choice([0, 29]), rng.randrange(16)
                word |= address == control
                good = model.writable(address, strobes)
                bench.writes.append((address, word, strobes))
                answer = await bench.bus.write(address, word, strobes)
            else:
                good = model.readable(address)
                _, answer = await bench.bus.read(address)
            assert answer == (OKAY if good else SLVERR), f"{address:#x}: {answer}"

    task = cocotb.start_soon(accesses())
    for frame in frames:
        bench.stall()
        await bench.send(bench.beats(frame))
    await bench.settle()
    running = False
    await task
    assert len(bench.frames) == len(frames)
    for got, frame, slice_ in zip(bench.frames, frames, bench.slices, strict=True):
        assert {beat.slice for beat in got} == {slice_}
        bench.check_frame(got, frame)
    # Frame sizes written meanwhile were refused.
    assert await bench.read("frame_size") == dict(zip(("columns", "rows"), bench.size, strict=True))
    assert await bench.errors() <= {"refused"}
    counts = await bench.counters()
    assert counts["frames_out"] == len(frames)
    assert counts["lines_in"] == counts["lines_out"] == len(frames) * bench.size[1]
    assert counts["dropped"] == 0


@cocotb.test()
async def slices_and_sweeps(dut: Any) -> None:
    """Slice and sweep take effect with the next frame, and `status` has the slice of the output."""
    bench = Bench(dut)
    await bench.reset()
    await bench.start(*draw_size(bench))
    model = SliceModel(len(CORE.shifts))
    for _ in range(12):
        slice_, sweep = bench.rng.randrange(256), bench.rng.randrange(2)
        count = bench.rng.randrange(4)
        await bench.write("slice", number=slice_)
        await bench.write("sweep_frames", count=count)
        await bench.write("control", enable=1, sweep=sweep)
        for _ in range(bench.rng.randrange(1, 4)):
            await bench.send(bench.beats(bench.frame()))
            await bench.settle()
            want = model.next_frame(slice_, sweep, count)
            assert bench.frames[-1][0].slice == want
            assert (await bench.read("status")) == {"slice": want, "inside": 0}


@cocotb.test()
async def whole_frames_or_none(dut: Any) -> None:
    """Frames, broken ones too, while the core is switched on and off: all counters, all frames."""
    bench = Bench(dut)
    await bench.reset()
    for _ in range(CASE["frames"] // 2):
        columns, rows = draw_size(bench)
        await bench.start(columns, rows)
        bench.stall()
        tokens = -(-columns // P)
        gate = Gate(tokens, rows)
        counts = dict.fromkeys(COUNTERS, 0)
        reached: list[Beat] = []
        bench.frames.clear()
        before = bench.source.refused_clocks, bench.stalls_out
        enable = True
        for _ in range(6):
            beats = bench.beats(bench.frame())
            if bench.rng.random() < 0.4:
                beats = damaged(beats, tokens, bench.rng)
            cut = bench.rng.randrange(len(beats) + 1)
            for part in (beats[:cut], beats[cut:]):
                if part:
                    await bench.send(part)
                reached += [beat for beat in part if gate.take(beat, enable, counts)]
                assert (await bench.read("status"))["inside"] == gate.open
                enable = bench.rng.random() < 0.7
                await bench.write("control", enable=enable)
        # A frame that was cut short is held back until the next one comes.
        await bench.write("control", enable=1)
        beats = bench.beats(bench.frame())
        await bench.send(beats)
        reached += [beat for beat in beats if gate.take(beat, True, counts)]
        await bench.settle()
        frames, faults = repaired_frames(reached, tokens, rows)
        assert len(bench.frames) == len(frames)
        for got, lines in zip(bench.frames, frames, strict=True):
            bench.check_frame(got, frame_of(lines, columns))
        counts["frames_out"], counts["lines_out"] = len(frames), sum(map(len, frames))
        assert await bench.counters() == counts
        assert counts["lines_in"] == counts["lines_out"]
        flags = {FLAGS[fault] for fault in faults}
        assert await bench.errors() == flags
        stalls = [(await bench.read(name))["count"] for name in ("stalls_in", "stalls_out")]
        now = bench.source.refused_clocks, bench.stalls_out
        assert stalls == [b - a for a, b in zip(before, now, strict=True)]
        if flags:
            one = bench.rng.choice(sorted(flags))
            await bench.write("errors", **{one: 1})
            assert await bench.errors() == flags - {one}
        await bench.write("errors", **dict.fromkeys(flags, 1))
        assert not await bench.errors()


@cocotb.test()
async def size_and_restart(dut: Any) -> None:
    """A size is accepted only while the core is off; a restart at any time resets the core."""
    bench = Bench(dut)
    await bench.reset()
    for _ in range(CASE["frames"] // 2):
        await bench.start(*draw_size(bench))
        await bench.write("frame_size", columns=bench.size[0], rows=bench.size[1] + 1)
        assert await bench.errors() == {"refused"}
        await bench.write("control")
        for columns, rows in ((0, 5), (5, 0), (CORE.max_columns + 1, 5)):
            await bench.write("frame_size", columns=columns, rows=rows)
        assert await bench.read("frame_size") == dict(
            zip(("columns", "rows"), bench.size, strict=True)
        )
        await bench.write("control", enable=1)
        bench.stall()
        beats = bench.beats(bench.frame())
        await bench.send(beats[: bench.rng.randint(1, len(beats))])
        await ClockCycles(dut.clk, bench.rng.randrange(200))
        bench.restarts.value = "1"
        await bench.write("command", restart=1)
        await ClockCycles(dut.clk, 2)
        bench.restarts.value = "0"
        await bench.settle()
        bench.frames.clear()
        await bench.settle()
        assert not bench.frames
        assert not any((await bench.counters()).values())
        assert not await bench.errors()
        frame = bench.frame()
        # The rest of the frame before is dropped, without a fault.
        await bench.send([Beat(1, False, True), *bench.beats(frame)])
        await bench.settle()
        bench.check_frame(bench.frames[0], frame)
        assert (await bench.counters())["dropped"] == 1
        assert not await bench.errors()
        bench.frames.clear()


@cocotb.test()
async def reset_in_video(dut: Any) -> None:
    """A reset of one clock in a frame and between accesses resets registers and core."""
    bench = Bench(dut)
    await bench.reset()
    for _ in range(CASE["frames"] // 2):
        await bench.start(*draw_size(bench))
        bench.stall()
        beats = bench.beats(bench.frame())
        await bench.send(beats[: bench.rng.randint(1, len(beats))])
        under_way = cocotb.start_soon(bench.read("geometry"))
        await ClockCycles(dut.clk, bench.rng.randrange(1, 40))
        under_way.cancel()
        bench.restarts.value = "1"
        dut.reset.value = 1
        await RisingEdge(dut.clk)
        bench.bus.clear()
        dut.reset.value = 0
        await ClockCycles(dut.clk, 2)
        bench.restarts.value = "0"
        bench.frames.clear()
        await bench.settle()
        assert not bench.frames
        assert await bench.read("frame_size") == {"columns": 0, "rows": 0}
        assert await bench.read("control") == {"enable": 0, "sweep": 0}
        assert not any((await bench.counters()).values())
        assert not await bench.errors()
        await bench.start(*bench.size)
        frame = bench.frame()
        await bench.send(bench.beats(frame))
        await bench.settle()
        bench.check_frame(bench.frames[0], frame)
        bench.frames.clear()


@cocotb.test()
async def interrupts(dut: Any) -> None:
    """Each event sets its bit, and raises the interrupt if the mask allows it."""
    bench = Bench(dut)
    await bench.reset()
    await bench.start(*draw_size(bench))
    beats = bench.beats(bench.frame())
    for mask in range(8):
        names = [n for i, n in enumerate(MAP["interrupt_mask"].fields) if mask >> i & 1]
        await bench.write("interrupt_mask", **dict.fromkeys(names, 1))
        await bench.write("interrupt_status", frame_in=1, frame_out=1, error=1)
        await ClockCycles(dut.clk, 2)
        assert not int(dut.interrupt.value)
        await bench.send(beats)
        await bench.settle()
        status = await bench.read("interrupt_status")
        assert status == {"frame_in": 1, "frame_out": 1, "error": 0}
        assert int(dut.interrupt.value) == bool(mask & 3)
        await bench.send([Beat(0, False, True)])
        await ClockCycles(dut.clk, 20)
        assert (await bench.read("interrupt_status"))["error"] == 1
        assert int(dut.interrupt.value) == bool(mask)
        await bench.write("errors", frame_late=1)
