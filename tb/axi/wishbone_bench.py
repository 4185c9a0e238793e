# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the registers behind ``wishbone_bridge``: any cycle, aborted cycles, resets."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir_tb.case import read_case
from plenofir_tb.register_map import MAP, Model
from plenofir_tb.wishbone import ACK, ERR, Master

CASE = read_case()
# Registers that only software sets; writing to others has side effects.
QUIET = ("asked_slice", "slice", "sweep_frames", "interrupt_mask")


class Bench:
    """The registers, and what they have to answer."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start()
        dut.s_axis_tvalid.value = 0
        dut.m_axis_tready.value = 1
        self.bus = Master(dut)
        self.bus.pause(self.rng, 0.3)

    async def reset(self, clocks: int = 1) -> None:
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, clocks)
        self.dut.reset.value = 0
        self.model = Model({"refocuser"})
        await RisingEdge(self.dut.clk)

    async def access(self) -> None:
        """Write or read any word, and check the answer."""
        address = 4 * self.rng.randrange(self.rng.choice([len(MAP) + 4, 1 << 10]))
        register = self.model.present.get(address)
        if register is not None and register.name in QUIET and self.rng.random() < 0.7:
            word, strobes = self.rng.getrandbits(32), self.rng.randrange(16)
            assert await self.bus.access(address, word, strobes) == (0, ACK)
            self.model.write(address, word, strobes)
        elif self.rng.random() < 0.2 and not self.model.writable(address):
            assert await self.bus.access(address, 0xFFFFFFFF) == (0, ERR)
        else:
            word, answer = await self.bus.access(address)
            assert answer == (ACK if self.model.readable(address) else ERR)
            if answer == ERR:
                assert word == 0
            elif register is not None and register.name in self.model.kept:
                assert word == self.model.kept[register.name]

    async def give_up(self) -> None:
        """Abort a write to a register: it keeps the old word or has the new one."""
        dut, name = self.dut, self.rng.choice(QUIET)
        word, address = self.rng.getrandbits(32), MAP[name].address
        dut.s_wb_cyc.value = dut.s_wb_stb.value = dut.s_wb_we.value = 1
        dut.s_wb_adr.value, dut.s_wb_sel.value = address // 4, 15
        dut.s_wb_dat_w.value = word
        answered = False
        for _ in range(self.rng.randrange(1, 6)):
            await RisingEdge(dut.clk)
            answered = answered or str(dut.s_wb_ack.value) == "1"
            if answered:
                break
        dut.s_wb_cyc.value = dut.s_wb_stb.value = dut.s_wb_we.value = 0
        await FallingEdge(dut.clk)
        assert not int(dut.s_wb_ack.value)
        assert not int(dut.s_wb_err.value)
        found, answer = await self.bus.access(address)
        old = self.model.kept[name]
        self.model.write(address, word, 15)
        new = self.model.kept[name]
        assert answer == ACK
        assert found == new or (found == old and not answered)
        self.model.kept[name] = found


@cocotb.test()
async def any_cycle(dut: Any) -> None:
    """Reads and writes anywhere, with any bytes; some are aborted; occasional resets."""
    bench = Bench(dut)
    await bench.reset(3)
    for _ in range(CASE["accesses"]):
        draw = bench.rng.random()
        if draw < 0.85:
            await bench.access()
        elif draw < 0.98:
            await bench.give_up()
        else:
            await bench.reset()
