# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``fir_array`` by itself: parallel rows in and out, clocks counted."""

import random
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir_studies.clock_counts import (
    array_first_frame_clocks,
    array_frame_clocks,
    array_latency_clocks,
)
from plenofir_tb.axi_video import Frame, pack_pixels
from plenofir_tb.case import read_case
from plenofir_tb.frames import make_frame

CASE = read_case()


@dataclass
class Pixel:
    """A row's output: a pixel, or that it has no image line in this band."""

    clock: int
    skip: bool
    start: bool
    last: bool
    slice_: int
    data: int


class Bench:
    """Drives bands and collects rows."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.core = CoreConfiguration.model_validate(CASE["core"])
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.rows: list[deque[Pixel]] = [deque() for _ in range(self.core.parallel_rows)]
        self.clock = 0
        self.first_in: int | None = None
        self.first_out: int | None = None
        Clock(dut.clk, 10, "ns").start()

    async def step(self, **inputs: int) -> None:
        """One clock with the given inputs, others 0; collects the outputs."""
        dut, n = self.dut, self.core.parallel_rows
        await FallingEdge(dut.clk)
        for name in ("strobe", "pixel", "band_first", "band_last", "frame_first", "slice", "image"):
            getattr(dut, f"in_{name}").value = inputs.get(name, 0)
        dut.in_data.value = inputs.get("data", 0)
        await RisingEdge(dut.clk)
        self.clock += 1
        if inputs.get("pixel") and self.first_in is None:
            self.first_in = self.clock
        valid, skip = (
            int(port.value) if port.value.is_resolvable else 0
            for port in (dut.out_valid, dut.out_skip)
        )
        if not (valid or skip):
            return
        # Rows without output may be undefined.
        data, start, last, slices = (
            str(port.value) for port in (dut.out_data, dut.out_start, dut.out_last, dut.out_slice)
        )

        def part(text: str, row: int) -> int:
            width = len(text) // n
            return int(text[len(text) - (row + 1) * width : len(text) - row * width], 2)

        for r in range(n):
            if skip >> r & 1:
                self.rows[r].append(Pixel(self.clock, True, False, False, 0, 0))
            elif valid >> r & 1:
                self.rows[r].append(
                    Pixel(
                        self.clock,
                        False,
                        bool(part(start, r)),
                        bool(part(last, r)),
                        part(slices, r),
                        part(data, r),
                    )
                )
                if self.first_out is None:
                    self.first_out = self.clock

    async def reset(self) -> None:
        self.dut.reset.value = 1
        for _ in range(3):
            await self.step()
        self.dut.reset.value = 0
        await self.step()

    async def band(
        self, lines: np.ndarray, columns: int, *, first: bool, slice_: int, idle: float
    ) -> None:
        """Send a band of up to N lines (packed pixels), with the necessary empty tokens."""
        n, bits = self.core.parallel_rows, self.core.channels * self.core.pixel_bits
        for k in range(self.core.band_steps(columns)):
            while self.rng.random() < idle:
                await self.step()
            if k >= columns:
                await self.step(strobe=1)
                continue
            await self.step(
                strobe=1,
                pixel=1,
                band_first=int(k == 0),
                band_last=int(k == columns - 1),
                frame_first=int(first),
                slice=slice_,
                image=(1 << len(lines)) - 1,
                data=sum(int(line[k]) << r * bits for r, line in enumerate(lines)),
            )
        if idle and self.rng.random() < 0.3:
            for _ in range(self.rng.randint(1, 2 * n)):
                await self.step(strobe=1)

    async def frame(self, frame: Frame, slice_: int = 0, idle: float = 0.0) -> None:
        """Send a frame, band by band."""
        pixels = pack_pixels(frame, self.core.pixel_bits)
        n = self.core.parallel_rows
        for row in range(0, len(pixels), n):
            band = pixels[row : row + n]
            await self.band(band, pixels.shape[1], first=row == 0, slice_=slice_, idle=idle)

    async def flush(self, columns: int, idle: float = 0.0) -> None:
        nothing = np.zeros((0, columns), dtype=object)
        for _ in range(-(-self.core.delay // self.core.parallel_rows)):
            await self.band(nothing, columns, first=False, slice_=0, idle=idle)
        for _ in range(self.core.delay + 2 * self.core.parallel_rows):
            await self.step(strobe=1)
        for _ in range(self.core.array_clocks + 2):
            await self.step()

    def frames_out(self, columns: int, rows: int) -> list[tuple[np.ndarray, int, int]]:
        """Join the rows of each frame: packed pixels, slice, and clock of the last pixel."""
        lines: list[list[Pixel]] = []
        row = 0
        while self.rows[row]:
            pixel = self.rows[row].popleft()
            if not pixel.skip:
                line = [pixel]
                while not line[-1].last:
                    line.append(self.rows[row].popleft())
                assert len(line) == columns
                lines.append(line)
            row = (row + 1) % self.core.parallel_rows
        assert not any(self.rows)
        assert len(lines) % rows == 0
        frames = []
        for start in range(0, len(lines), rows):
            frame = lines[start : start + rows]
            starts = [[pixel.start for pixel in line] for line in frame]
            assert starts[0][0]
            assert sum(map(sum, starts)) == 1
            slices = {pixel.slice_ for line in frame for pixel in line}
            assert len(slices) == 1
            data = np.array([[pixel.data for pixel in line] for line in frame], dtype=object)
            frames.append(
                (data, slices.pop(), max(pixel.clock for line in frame for pixel in line))
            )
        return frames


async def run_frames(bench: Bench, columns: int, rows: int, count: int, idle: float) -> list[int]:
    """Send frames with random slices and compare them; return the clocks of their last pixels."""
    core, rng = bench.core, bench.rng
    await bench.reset()
    sent = []
    for _ in range(count):
        frame = make_frame("random", rows, columns, core.channels, core.pixel_bits, rng)
        slice_ = rng.randrange(len(core.shifts))
        sent.append((frame, slice_))
        await bench.frame(frame, slice_, idle)
    await bench.flush(columns, idle)
    got = bench.frames_out(columns, rows)
    assert len(got) == count
    for (frame, slice_), (data, got_slice, _) in zip(sent, got, strict=True):
        assert got_slice == slice_
        want = core.golden_slice(frame, slice_)
        assert (data == pack_pixels(want, core.pixel_bits)).all()
    return [clock for _, _, clock in got]


@cocotb.test()
async def clocks_as_the_formulas_say(dut: Any) -> None:
    """Frames back to back: every pixel is right, and each clock count equals its formula."""
    bench = Bench(dut)
    core, columns, rows = bench.core, CASE["columns"], CASE["rows"]
    ends = await run_frames(bench, columns, rows, 3, 0.0)
    assert bench.first_in is not None
    assert bench.first_out is not None
    latency = bench.first_out - bench.first_in
    assert latency == array_latency_clocks(core, columns)
    assert ends[0] - bench.first_in + 1 == array_first_frame_clocks(core, columns, rows)
    steps = [b - a for a, b in pairwise(ends)]
    # The last frame ends in empty bands, as early as those of a further frame would come.
    assert steps == [array_frame_clocks(core, columns, rows)] * 2


@cocotb.test()
async def idle_clocks_and_empty_tokens(dut: Any) -> None:
    """Tokens with idle clocks between them, bands with empty tokens between them."""
    bench = Bench(dut)
    for idle in (0.2, 0.7):
        rows = bench.rng.randint(1, CASE["rows"])
        columns = bench.rng.randint(1, CASE["columns"])
        await run_frames(bench, columns, rows, 3, idle)
