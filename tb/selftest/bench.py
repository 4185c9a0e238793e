# SPDX-License-Identifier: Apache-2.0
"""The self test passes with the golden model's signature, and fails with another."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir_tb.case import read_case


@cocotb.test()
async def result_of_three_frames(dut: Any) -> None:
    """The result after any reset, also in the middle of a frame; `blink` counts frames."""
    case = read_case()
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    runs = []
    every = case["clocks"]
    # At any point, and after some frames.
    parts = rng.randrange(every), every - 2 * case["pixels"] - rng.randrange(case["pixels"])
    for clocks in (every, *parts, every):
        dut.reset.value = 1
        await ClockCycles(dut.clk, 4)
        await FallingEdge(dut.clk)
        dut.reset.value = 0
        shown = []
        for _ in range(clocks):
            await FallingEdge(dut.clk)
            shown.append(tuple(int(port.value) for port in (dut.tested, dut.passed, dut.blink)))
        assert shown[0] == (0, 1, 0)
        runs.append(shown)
    for shown in runs:
        assert shown == runs[0][: len(shown)]
    tested, passed, blink = zip(*runs[0], strict=True)
    assert (tested[-1], passed[-1]) == (1, case["passes"])
    # The result comes at the end of the first frame and does not change.
    first = tested.index(1)
    # The source begins a clock after the reset, and the last pixel is judged a clock later.
    assert first == case["latency"] + case["pixels"] + 1
    assert all(tested[first:])
    assert set(passed[:first]) == {1}
    assert set(passed[first:]) == {case["passes"]}
    # The bit of the frame count that toggles every two frames.
    assert blink.index(1) == first + case["pixels"]
    assert blink.index(0, first + case["pixels"]) == first + 3 * case["pixels"]
