# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``load_crossing`` in a build with a sensor."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, ReadOnly, RisingEdge

from plenofir_tb.case import read_case


@cocotb.test()
async def words_built_in_then_words_written(dut: Any) -> None:
    """After each reset all built-in words come in order; then those of the port, one at a time."""
    rng = random.Random(cocotb.RANDOM_SEED)
    built_in = [int(word, 16) for word in read_case()["words"]]
    arrived: list[int] = []
    dut.port_write.value = dut.port_word.value = dut.seen.value = 0
    dut.reset.value = 1
    Clock(dut.clk, 10, "ns").start()

    async def watch() -> None:
        """Record words in the pixel clock; the toggle is returned a few clocks later."""
        toggle = "0"
        while True:
            await FallingEdge(dut.pixel_clk)
            now = str(dut.load_toggle.value)
            if now != toggle:
                arrived.append(int(dut.load_word.value))
                toggle = now
                await ClockCycles(dut.clk, rng.randint(1, 9))
                dut.seen.value = int(now)

    async def idle() -> None:
        quiet = 0
        for _ in range(10_000):
            await RisingEdge(dut.clk)
            await ReadOnly()
            quiet = 0 if int(dut.port_busy.value) else quiet + 1
            if quiet == 60:
                break
        assert quiet == 60, "the port stays busy"
        await FallingEdge(dut.clk)

    cocotb.start_soon(watch())
    await ClockCycles(dut.clk, 4)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    # Without a pixel clock they wait.
    await ClockCycles(dut.clk, 300)
    assert int(dut.port_busy.value)
    assert not arrived
    Clock(dut.pixel_clk, rng.choice([4, 14, 26]), "ns").start()
    for _ in range(4):
        # A word that came between two of them would be lost.
        await FallingEdge(dut.clk)
        while len(arrived) < len(built_in):
            assert int(dut.port_busy.value)
            await FallingEdge(dut.clk)
        await idle()
        # The first one may be sent in the reset and after it.
        if arrived[:2] == [built_in[0]] * 2:
            arrived.pop(0)
        assert arrived == built_in
        for number in range(3):
            word = rng.getrandbits(62)
            dut.port_word.value = word
            dut.port_write.value = 1
            await FallingEdge(dut.clk)
            dut.port_write.value = dut.port_word.value = 0
            assert int(dut.port_busy.value)
            await idle()
            assert arrived[len(built_in) + number :] == [word]
        arrived.clear()
        dut.reset.value = 1
        await FallingEdge(dut.clk)
        arrived.clear()
        dut.reset.value = 0
