"""cocotb tests of the parts of the video path; each is for the entity that it names."""

from typing import Any

from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir_tb.entities import for_entity

COLUMNS, LINE, ROWS, LINES = 4, 8, 3, 6
COUNT_BITS = 12


async def play(dut: Any, lines: int) -> None:
    """Lines of a small mode from the first of a frame on, both syncs positive."""
    for number in range(lines):
        y = number % LINES
        for x in range(LINE):
            dut.active.value = int(x < COLUMNS and y < ROWS)
            dut.h_sync.value = int(COLUMNS < x < LINE - 1)
            dut.v_sync.value = int(y == ROWS + 1)
            await FallingEdge(dut.clk)


@for_entity("video_timing_meter")
async def timings_are_measured_and_end(dut: Any) -> None:
    """A timing is known after two frames; it ends with a line or a frame longer than any."""
    Clock(dut.clk, 10, "ns").start()
    for name in ("active", "h_sync", "v_sync"):
        getattr(dut, name).value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    await play(dut, 2 * LINES + 1)
    # The first frame of all begins without a vertical sync before it.
    assert not int(dut.stable.value)
    await play(dut, LINES - 1)
    await play(dut, 2 * LINES + 2)
    assert int(dut.stable.value)
    timing = int(dut.timing.value)
    counts = [timing >> (COUNT_BITS * i) & (2**COUNT_BITS - 1) for i in range(10)]
    assert counts == [
        *(COLUMNS, LINE, COLUMNS + 1, LINE - 1),
        *(ROWS, LINES, ROWS + 1, 0, ROWS + 2, 0),
    ]
    # Two lines of this frame have come; nothing more does, so lines are counted on.
    dut.active.value = 0
    longest = 2**COUNT_BITS - 1
    await ClockCycles(dut.clk, (longest - 2) * LINE - 2)
    await FallingEdge(dut.clk)
    assert int(dut.stable.value)
    await ClockCycles(dut.clk, LINE)
    await FallingEdge(dut.clk)
    assert not int(dut.stable.value)
    # A line without end: the first of a frame.
    dut.reset.value = 1
    await ClockCycles(dut.clk, 2)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    await play(dut, 4 * LINES)
    await play(dut, 1)
    assert int(dut.stable.value)
    dut.active.value = 0
    await ClockCycles(dut.clk, longest - LINE - 2)
    await FallingEdge(dut.clk)
    assert int(dut.stable.value)
    await ClockCycles(dut.clk, 4)
    await FallingEdge(dut.clk)
    assert not int(dut.stable.value)
