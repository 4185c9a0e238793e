# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``colour_mosaic``: every pixel of every frame against the bit-true model."""

import logging
import random
from pathlib import Path
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir.camera.resampling import BAYER_ORDERS, interpolate_mosaic, red_place
from plenofir_tb.axi_video import (
    AxiVideoSink,
    AxiVideoSource,
    Beat,
    Frame,
    frame_beats,
    stall_pattern,
)
from plenofir_tb.case import read_case
from plenofir_tb.frames import make_frame, repaired_frames
from plenofir_tb.scoreboard import FrameScoreboard

BITS = read_case()["pixel_bits"]
ERROR_NAMES = ("line early", "line late", "frame early", "frame late", "size")


class Bench:
    """Source, mosaic, sink and scoreboard."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start()
        logging.getLogger(f"cocotb.{dut._name}.m_axis").setLevel(logging.WARNING)
        self.source = AxiVideoSource(dut, "s_axis", dut.clk)
        self.sink = AxiVideoSink(dut, "m_axis", dut.clk, reset=dut.reset)
        self.scoreboard = FrameScoreboard(self.sink, BITS, Path(read_case()["pictures"]))

    async def begin(self, columns: int | None = None) -> None:
        """Draw a size and an order; reset."""
        dut, rng = self.dut, self.rng
        self.shape = (
            rng.randint(1, 7),
            (columns or rng.choice([1, 2, 3, 4, read_case()["max_columns"]])),
        )
        self.order = rng.choice(BAYER_ORDERS)
        line, column = red_place(self.order)
        dut.red_place.value = 2 * line + column
        dut.rows.value, dut.columns.value = self.shape
        dut.error_clear.value = 0
        dut.reset.value = 1
        await ClockCycles(dut.clk, 4)
        dut.reset.value = 0
        await ClockCycles(dut.clk, 4)

    def golden(self, frame: Frame) -> Frame:
        """Three channels of a frame; of a single line or column those of three equal ones."""
        if not len(frame):
            return frame
        # The other line or column of filters is not there.
        wide = frame
        for axis in (0, 1):
            if wide.shape[axis] == 1:
                wide = np.repeat(wide, 3, axis)
        return interpolate_mosaic(wide, self.order)[: len(frame), : frame.shape[1]]

    def stall(self, source: str, sink: str) -> None:
        """Choose the stall patterns of both sides."""
        self.source.stalls = stall_pattern(source, random.Random(self.rng.random()))
        self.sink.stalls = stall_pattern(sink, random.Random(self.rng.random()))

    async def drain(self) -> None:
        """Wait until all expected frames are out."""
        quiet = 0
        while self.scoreboard.waiting and quiet < 3000:
            before = len(self.scoreboard.received), self.scoreboard.frames_done
            await ClockCycles(self.dut.clk, 10)
            same = before == (len(self.scoreboard.received), self.scoreboard.frames_done)
            quiet = quiet + 10 if same else 0
        await ClockCycles(self.dut.clk, 60)
        self.scoreboard.result  # noqa: B018  (raises)

    def errors(self) -> set[str]:
        """Names of the error flags that are set."""
        flags = int(self.dut.error_flags.value)
        return {name for i, name in enumerate(ERROR_NAMES) if flags >> i & 1}


@cocotb.test()
async def frames(dut: Any) -> None:
    """Frames of several sizes in all orders, back to back, with gaps, with stalls."""
    bench = Bench(dut)
    for number in range(8):
        await bench.begin((None, 1)[number == 7])
        bench.stall(*[("none", "none"), ("some", "some"), ("none", "bursts")][number % 3])
        for _ in range(3):
            frame = make_frame("random", *bench.shape, 1, BITS, bench.rng)
            bench.scoreboard.expect(bench.golden(frame))
            bench.source.append(frame_beats(frame, BITS))
            if bench.rng.random() < 0.5:
                await ClockCycles(dut.clk, bench.rng.randint(1, 4 * frame.size))
        refused = bench.source.refused_clocks
        await bench.drain()
        assert not bench.errors()
        if number == 0 and min(bench.shape) > 3:
            assert bench.source.refused_clocks - refused <= bench.shape[1]


@cocotb.test()
async def frames_behind_resets(dut: Any) -> None:
    """A clock of reset anywhere in a frame: the next frames are right, and nothing else comes."""
    bench = Bench(dut)
    rng = bench.rng
    await bench.begin()
    for number in range(16):
        if number:
            bench.scoreboard.listening = False
            frame = make_frame("random", *bench.shape, 1, BITS, rng)
            await bench.source.send(frame_beats(frame, BITS)[: rng.randint(1, frame.size)])
            await ClockCycles(dut.clk, rng.randint(1, 12))
            dut.reset.value = 1
            await RisingEdge(dut.clk)
            dut.reset.value = 0
            await FallingEdge(dut.clk)
            bench.scoreboard.listening = True
        bench.stall(*[("none", "none"), ("some", "some"), ("none", "many")][number % 3])
        for _ in range(2):
            frame = make_frame("random", *bench.shape, 1, BITS, rng)
            bench.scoreboard.expect(bench.golden(frame))
            bench.source.append(frame_beats(frame, BITS))
        await bench.drain()
        assert not bench.errors()


@cocotb.test()
async def broken_frames(dut: Any) -> None:
    """Lines and frames that end anywhere, and a whole frame after."""
    bench = Bench(dut)
    rng = bench.rng
    for share in (0.01, 0.1):
        await bench.begin()
        beats: list[Beat] = []
        for _ in range(5):
            whole = frame_beats(make_frame("random", *bench.shape, 1, BITS, rng), BITS)
            beats += [
                Beat(
                    b.data,
                    b.start_of_frame != (rng.random() < share / 4),
                    b.end_of_line != (rng.random() < share),
                )
                for b in whole
            ][: rng.choice([len(whole), rng.randint(1, len(whole))])]
        beats += frame_beats(make_frame("random", *bench.shape, 1, BITS, rng), BITS)
        frames, faults = repaired_frames(beats, bench.shape[1], bench.shape[0])
        for lines in frames:
            frame = np.array(lines, np.uint8 if BITS <= 8 else np.uint16)
            bench.scoreboard.expect(bench.golden(frame.reshape(-1, bench.shape[1])))
        bench.stall(*rng.choice([("none", "none"), ("some", "some"), ("none", "many")]))
        await bench.source.send(beats)
        await bench.drain()
        assert bench.errors() == faults
