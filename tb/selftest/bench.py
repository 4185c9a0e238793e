"""The design that tests itself: passes with the golden model's signature, fails with another."""

from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir_tb.case import read_case


@cocotb.test()
async def result_of_three_frames(dut: Any) -> None:
    case = read_case()
    Clock(dut.clk, 10, "ns").start()
    dut.reset.value = 1
    await ClockCycles(dut.clk, 4)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    await ClockCycles(dut.clk, 2)
    await FallingEdge(dut.clk)
    assert (int(dut.tested.value), int(dut.passed.value)) == (0, 1)
    await ClockCycles(dut.clk, case["clocks"])
    await FallingEdge(dut.clk)
    assert int(dut.tested.value) == 1
    assert int(dut.passed.value) == case["passes"]
    assert int(dut.under_test.frames.value) >= 3
