# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of parallel_top: a camera with parallel output, refocused parallel video out."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir.refocus import ExactArithmetic
from plenofir_tb.case import read_case

CASE = read_case()


class Camera:
    """Sends frames with blanking, and collects the output."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.frames: list[list[list[int]]] = []
        self.frame_before = self.line_before = 0

    async def clocks(self, count: int) -> None:
        dut = self.dut
        for _ in range(count):
            await FallingEdge(dut.clk)
            frame, line = int(dut.out_frame_valid.value), int(dut.out_line_valid.value)
            assert frame or not line, "pixels outside of a frame"
            if frame and not self.frame_before:
                self.frames.append([])
            if line and not self.line_before:
                self.frames[-1].append([])
            if line:
                self.frames[-1][-1].append(int(dut.out_data.value))
            self.frame_before, self.line_before = frame, line

    async def send(self, picture: np.ndarray) -> None:
        """Send a frame with random gaps between its lines, and noise where no pixels are."""
        dut = self.dut
        dut.in_frame_valid.value = 1
        await self.clocks(self.rng.randrange(1, 5))
        for row in picture.tolist():
            for pixel in row:
                dut.in_line_valid.value = 1
                dut.in_data.value = pixel
                await self.clocks(1)
            dut.in_line_valid.value = 0
            dut.in_data.value = self.rng.randrange(1 << CASE["pixel_bits"])
            await self.clocks(CASE["blank_pixels"] + self.rng.randrange(8))
        dut.in_frame_valid.value = 0
        # Pixels outside of a frame are none.
        dut.in_line_valid.value = self.rng.randrange(2)
        await self.clocks(CASE["blank_lines"] * (len(picture[0]) + CASE["blank_pixels"]))
        dut.in_line_valid.value = 0
        await self.clocks(3)


@cocotb.test()
async def frames_are_refocused(dut: Any) -> None:
    """Each slice in turn: every pixel of every frame, whole lines, a frame for each frame."""
    Clock(dut.clk, 10, "ns").start()
    camera = Camera(dut)
    for name in ("reset_n", "in_frame_valid", "in_line_valid", "in_data", "slice"):
        getattr(dut, name).value = 0
    for _ in range(8):
        await FallingEdge(dut.clk)
    dut.reset_n.value = 1
    await camera.clocks(20)
    pixels = np.random.default_rng(cocotb.RANDOM_SEED)
    shape = (CASE["rows"], CASE["columns"])
    want = []
    for number in range(5):
        picture = pixels.integers(0, 1 << CASE["pixel_bits"], shape, np.uint16)
        chosen = number % len(CASE["shifts"])
        dut.slice.value = chosen
        await camera.send(picture)
        want.append(ExactArithmetic().refocus(picture, CASE["m"], shift=CASE["shifts"][chosen]))
    await camera.clocks(40 * sum(shape))
    assert not int(dut.error.value)
    assert len(camera.frames) == len(want)
    for got, golden in zip(camera.frames, want, strict=True):
        assert [len(line) for line in got] == [shape[1]] * shape[0]
        assert np.array_equal(np.array(got), golden)


@cocotb.test()
async def resets_in_frames(dut: Any) -> None:
    """The rest of a frame with a reset is dropped without an error; the next frame is whole."""
    Clock(dut.clk, 10, "ns").start()
    camera = Camera(dut)
    for name in ("in_frame_valid", "in_line_valid", "in_data", "slice"):
        getattr(dut, name).value = 0
    pixels = np.random.default_rng(cocotb.RANDOM_SEED)
    shape = (CASE["rows"], CASE["columns"])
    line = shape[1] + CASE["blank_pixels"]
    before = 0

    async def pulse(clocks: int) -> None:
        nonlocal before
        await ClockCycles(dut.clk, clocks)
        dut.reset_n.value = 0
        await ClockCycles(dut.clk, 4)
        before = len(camera.frames)
        dut.reset_n.value = 1

    await pulse(4)
    await camera.clocks(20)
    for _ in range(4):
        picture = pixels.integers(0, 1 << CASE["pixel_bits"], shape, np.uint16)
        cocotb.start_soon(pulse(camera.rng.randrange(line, shape[0] * line)))
        await camera.send(picture)
        assert len(camera.frames) == before, "a frame of the rest of one"
        await camera.send(picture)
        await camera.clocks(40 * sum(shape))
        assert not int(dut.error.value)
        (got,) = camera.frames[before:]
        golden = ExactArithmetic().refocus(picture, CASE["m"], shift=CASE["shifts"][0])
        assert np.array_equal(np.array(got), golden)


@cocotb.test()
async def torn_frames_are_told(dut: Any) -> None:
    """A line that is too short raises the error; a reset clears it."""
    Clock(dut.clk, 10, "ns").start()
    camera = Camera(dut)
    dut.reset_n.value = 0
    await camera.clocks(8)
    dut.reset_n.value = 1
    await camera.clocks(20)
    assert not int(dut.error.value)
    picture = np.ones((CASE["rows"], CASE["columns"] - 3), np.uint16)
    await camera.send(picture)
    assert int(dut.error.value)
    dut.reset_n.value = 0
    await camera.clocks(8)
    assert not int(dut.error.value)
