# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``stream_to_parallel``: a stream with gaps, resets in the middle of frames."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir_tb.case import read_case


@cocotb.test()
async def lines_without_gaps(dut: Any) -> None:
    """Behind each reset: whole frames, each line in one go, nothing of what was before."""
    rng = random.Random(cocotb.RANDOM_SEED)
    rows, columns = read_case()["rows"], read_case()["columns"]
    Clock(dut.clk, 10, "ns").start()
    runs: list[list[int]] = []
    line_before = 0

    async def clock() -> bool:
        """Go on for a clock; whether a pixel on offer was taken."""
        nonlocal line_before
        taken = str(dut.s_axis_tready.value) == "1"
        await FallingEdge(dut.clk)
        frame, line = int(dut.frame_valid.value), int(dut.line_valid.value)
        assert frame or not line, "pixels outside of a frame"
        if line and not line_before:
            runs.append([])
        if line:
            runs[-1].append(int(dut.data.value))
        line_before = line
        return taken

    async def send(pixels: list[int]) -> None:
        for place, pixel in enumerate(pixels):
            while rng.random() < 0.4:
                await clock()
            dut.s_axis_tvalid.value = 1
            dut.s_axis_tdata.value = pixel
            dut.s_axis_tuser.value = int(place == 0)
            dut.s_axis_tlast.value = int(place % columns == columns - 1)
            while not await clock():
                pass
            dut.s_axis_tvalid.value = 0

    dut.s_axis_tvalid.value = 0
    dut.reset.value = 1
    for _ in range(3):
        await FallingEdge(dut.clk)
    for _ in range(12):
        dut.reset.value = 0
        runs.clear()
        frames = [[rng.getrandbits(8) for _ in range(rows * columns)] for _ in range(2)]
        for frame in frames:
            await send(frame)
        for _ in range(4 * columns):
            await clock()
        sent = [*frames[0], *frames[1]]
        assert runs == [sent[i : i + columns] for i in range(0, len(sent), columns)]
        assert not int(dut.frame_valid.value)
        # A line goes out while the reset comes, or waits, or has not come in.
        await send(frames[0][: rng.randint(columns, rows * columns - 1)])
        for _ in range(rng.randint(0, 6)):
            await clock()
        dut.reset.value = 1
        await clock()
