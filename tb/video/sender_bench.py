# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``stream_to_parallel``: gaps, resets inside of frames, frames cut short."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir_tb.case import read_case


@cocotb.test()
async def lines_without_gaps(dut: Any) -> None:
    """After each reset: whole frames, each line without gaps, nothing from before."""
    rng = random.Random(cocotb.RANDOM_SEED)
    rows, columns = read_case()["rows"], read_case()["columns"]
    Clock(dut.clk, 10, "ns").start()
    runs: list[list[int]] = []
    line_before = 0

    async def clock() -> bool:
        """Run for a clock; result: whether an offered pixel was taken."""
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
        # At the reset a line is being sent, waits, or has not come in.
        await send(frames[0][: rng.randint(columns, rows * columns - 1)])
        for _ in range(rng.randint(0, 6)):
            await clock()
        dut.reset.value = 1
        await clock()


@cocotb.test()
async def frames_cut_short_stay_apart(dut: Any) -> None:
    """A frame ends with the next one's start, or in silence; its whole lines come out."""
    rng = random.Random(cocotb.RANDOM_SEED)
    case = read_case()
    rows, columns, stall = case["rows"], case["columns"], case["stall"]
    Clock(dut.clk, 10, "ns").start()
    frames: list[list[list[int]]] = []
    before = (0, 0)

    async def clocks(count: int) -> bool:
        """Go on for some clocks; whether a pixel on offer was taken in the last one."""
        nonlocal before
        for _ in range(count):
            taken = str(dut.s_axis_tready.value) == "1"
            await FallingEdge(dut.clk)
            frame, line = now = int(dut.frame_valid.value), int(dut.line_valid.value)
            assert frame or not line, "pixels outside of a frame"
            if frame > before[0]:
                frames.append([])
            if line > before[1]:
                frames[-1].append([])
            if line:
                frames[-1][-1].append(int(dut.data.value))
            before = now
        return taken

    async def send(lines: list[list[int]], *, starts: bool = True, ends: bool = True) -> None:
        for y, line in enumerate(lines):
            for x, pixel in enumerate(line):
                dut.s_axis_tdata.value = pixel
                dut.s_axis_tuser.value = int(starts and (y, x) == (0, 0))
                last = x == len(line) - 1
                dut.s_axis_tlast.value = int(last and (ends or y < len(lines) - 1))
                dut.s_axis_tvalid.value = 1
                for _ in range(4 * stall):
                    if await clocks(1):
                        break
                else:
                    raise AssertionError("a stream that is not taken")
                dut.s_axis_tvalid.value = 0

    def picture(count: int, width: int = columns) -> list[list[int]]:
        return [[rng.getrandbits(8) for _ in range(width)] for _ in range(count)]

    dut.s_axis_tvalid.value = 0
    dut.reset.value = 1
    await clocks(3)
    dut.reset.value = 0
    whole, short, other, torn = picture(rows), picture(1), picture(rows), picture(2, columns - 2)
    # One line, then the next frame; cut in its second line; a line too many, which is left out.
    for sent in (whole, short, other):
        await send(sent)
    await send(torn, ends=False)
    await send([*whole, *short])
    await clocks(8 * columns)
    assert frames == [whole, short, other, torn, whole]
    assert not int(dut.frame_valid.value)
    frames.clear()
    # Silence, then the rest: it belongs to no frame. A stall does not end a frame.
    await send(whole[:2])
    await clocks(stall + 4 * columns)
    assert not int(dut.frame_valid.value)
    await send(whole[2:], starts=False)
    await send(whole[:2])
    await clocks(stall - 4 * columns)
    assert int(dut.frame_valid.value)
    await send(whole[2:], starts=False)
    # All pixels have come, but not the last mark: the frame is whole.
    await send(other, ends=False)
    await clocks(8 * columns)
    assert frames == [whole[:2], whole, other]
    assert not int(dut.frame_valid.value)
    frames.clear()
    # Lines without an end are cut, and do not stop the stream.
    long = picture(1, 5 * columns)
    await send(long, ends=False)
    await send(whole)
    await clocks(8 * columns)
    assert frames == [[long[0][:columns]], whole]
