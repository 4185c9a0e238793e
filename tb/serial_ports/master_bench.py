# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of i2c_master against a device and the times of UM10204."""

import random
from collections.abc import Callable
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer
from cocotb.utils import get_sim_time

from plenofir_tb.case import read_case
from plenofir_tb.levels import levels
from serial_ports.um10204 import SU_STA, Device, Lines

CASE = read_case()
QUARTER, STRETCH = CASE["quarter"], CASE["stretch"]
# A quarter is just as long as the longest time that UM10204 asks for.
CLOCK_NS = SU_STA // QUARTER
ORDERS = ("start", "stop", "send", "receive")


class Master:
    """The entity with its lines and a device; gives it orders."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.lines = Lines(self.rng, lambda: round(get_sim_time("ns")), self._later)
        self.device = Device(self.lines, self.rng)
        self._ports = [("scl", levels(dut.scl_low)), ("sda", levels(dut.sda_low))]
        self._over, self._stuck = levels(dut.result_over), levels(dut.result_stuck)
        Clock(dut.clk, CLOCK_NS, "ns").start()
        self._order(None)
        cocotb.start_soon(self._drive())

    def _later(self, ns: float, call: Callable[..., None], *arguments: Any) -> None:
        async def wait() -> None:
            await Timer(round(ns), "ns")
            call(*arguments)

        if ns > 0:
            cocotb.start_soon(wait())
        else:
            call(*arguments)

    async def _drive(self) -> None:
        """Carry the master's pulls to the lines, and the lines' levels to the master."""
        while True:
            for name, port in self._ports:
                self.lines.pull(name, 0, port() == "1")
            self.dut.scl.value, self.dut.sda.value = self.lines.level.values()
            await FallingEdge(self.dut.clk)

    def _order(self, name: str | None, value: int = 0, more: bool = False) -> None:
        for one in ORDERS:
            getattr(self.dut, f"order_{one}").value = int(one == name)
        self.dut.order_value.value, self.dut.order_more.value = value, int(more)

    async def reset(self) -> None:
        self.dut.reset.value = 1
        await FallingEdge(self.dut.clk)
        self.dut.reset.value = 0
        self.lines.gaps.clear()

    async def order(self, name: str, value: int = 0, more: bool = False) -> int | None:
        """Carry an order out: the bits of a byte and its acknowledge bit; None: stuck."""
        self._order(name, value, more)
        for _ in range(10 * (4 * QUARTER + 8 + STRETCH)):
            await FallingEdge(self.dut.clk)
            over, stuck = self._over(), self._stuck()
            if over == "1" or stuck == "1":
                break
        else:
            raise AssertionError(f"the order {name} has no end")
        bits = int(self.dut.result_bits.value)
        disturbed = int(self.dut.result_disturbed.value)
        # The next order comes in the clock behind, or some clocks later.
        await Timer(CLOCK_NS / 2 + 1, "ns", round_mode="round")
        self._order(None)
        await FallingEdge(self.dut.clk)
        if stuck == "1":
            return None
        self.disturbed = bool(disturbed)
        assert name == "send" or not disturbed
        return bits

    async def rest(self, clocks: int) -> None:
        for _ in range(clocks):
            await FallingEdge(self.dut.clk)

    async def transfers(self, count: int) -> list[tuple[str, int]]:
        """Random transfers; checks what the master understood, returns what the device must."""
        rng, device = self.rng, self.device
        log: list[tuple[str, int]] = []
        for number in range(count):
            await self.order("start")
            log.append(("start", 0))
            reads = rng.random() < 0.5
            values = [rng.randrange(128) << 1 | reads]
            values += [] if reads else [rng.choice([0, 255, rng.randrange(256)]) for _ in range(2)]
            sends = [rng.choice([0, 255, rng.randrange(256)]) for _ in range(3)]
            device.sends = list(sends)
            for value in values:
                answer = rng.random() < 0.8 or reads
                device.answers.append(answer)
                bits = await self.order("send", value)
                assert (bits, self.disturbed) == (value << 1 | (not answer), False)
                log.append((f"byte, {'' if answer else 'no '}acknowledge", value))
                await self.rest(rng.choice([0, 0, 3 * QUARTER]))
            if reads:
                for left, value in zip((2, 1, 0), sends, strict=True):
                    assert await self.order("receive", more=left > 0) == value << 1 | (left == 0)
                    log.append((f"byte, {'' if left else 'no '}acknowledge", value))
                    await self.rest(rng.choice([0, 0, 3 * QUARTER]))
            # A repeated start, or a stop.
            if number == count - 1 or rng.random() < 0.5:
                await self.order("stop", more=rng.random() < 0.5 and number < count - 1)
                log.append(("stop", 1))
                await self.rest(rng.choice([0, 0, 3 * QUARTER]))
        return log

    def check_quarters(self) -> None:
        """Between two moves of the lines by the master there is a quarter of a bit."""
        assert min(self.lines.gaps) >= QUARTER * CLOCK_NS
        self.lines.gaps.clear()

    def is_free(self) -> bool:
        return not any(pull[0] for pull in self.lines.pulls.values())


@cocotb.test()
async def transfers_keep_the_times(dut: Any) -> None:
    """Bytes in both directions, repeated starts, waits between orders; a device that stretches."""
    master = Master(dut)
    await master.reset()
    for stretch in (0, (STRETCH - 8) * CLOCK_NS):
        master.device.stretch = stretch
        master.device.log.clear()
        log = await master.transfers(5)
        # A start or a stop comes behind a first bit at most.
        assert [(kind, value) for kind, value in master.device.log if "byte" in kind] == [
            one for one in log if "byte" in one[0]
        ]
        assert [kind for kind, _ in master.device.log] == [kind for kind, _ in log]
        assert all(value <= 1 for kind, value in master.device.log if "byte" not in kind)
        assert master.is_free()
        master.check_quarters()


@cocotb.test()
async def a_disturbed_byte_ends_at_once(dut: Any) -> None:
    """A one that a device pulls low: no further bit is sent, and a stop follows."""
    master = Master(dut)
    await master.reset()
    for place in (0, 3, 6):
        master.device.log.clear()
        master.device.disturbs = place
        await master.order("start")
        assert await master.order("send", 0xFF) is not None
        assert master.disturbed
        await master.order("stop")
        assert master.device.log == [("start", 0), ("stop", place + 2)]
        await master.rest(4 * QUARTER)
        master.check_quarters()
    assert await master.transfers(1)


@cocotb.test()
async def a_device_in_a_byte_is_freed(dut: Any) -> None:
    """Nine ones and a stop: a device that holds the data line low shifts the rest of its byte."""
    master = Master(dut)
    await master.reset()
    device = master.device
    for left in (1, 5, 7):
        master.lines.pull("sda", 1, True)
        device.bits, device.present, device.sending = [0] * (8 - left), 0, True
        assert await master.order("receive") is not None
        await master.order("stop")
        assert device.bits is None
        await master.rest(4 * QUARTER)
    device.log.clear()
    assert await master.transfers(1)


@cocotb.test()
async def a_clock_that_stays_low_is_told(dut: Any) -> None:
    """After STRETCH clocks, and both lines are let go; a reset lets them go in any bit."""
    master = Master(dut)
    lines, rng = master.lines, master.rng
    await master.reset()
    for name in ("start", "send"):
        if name == "send":
            await master.order("start")
        lines.pull("scl", 1, True)
        assert await master.order(name, 0) is None
        # The clock line was let go a quarter behind the data line's last move.
        waited = (lines.now() - lines.moved["scl"]) / CLOCK_NS
        assert STRETCH <= waited <= STRETCH + 2, waited
        await master.rest(2)
        assert master.is_free()
        # The master has given up, so an edge of the device at any time belongs to no bit.
        lines.strict = False
        lines.pull("scl", 1, False)
        await master.rest(4 * QUARTER)
        lines.strict = True
        lines.gaps.clear()
    await master.order("start")
    for _ in range(3):
        master._order("send", 0)
        await master.rest(rng.randrange(3, 36 * QUARTER))
        master._order(None)
        # A reset lets both lines go at once.
        lines.strict = False
        await master.reset()
        await master.rest(4 * QUARTER)
        lines.strict = True
        assert master.is_free()
        # The device may hold the line in its acknowledge bit.
        await master.order("receive")
        await master.order("stop")
        await master.order("start")
    await master.order("stop")
    master.device.log.clear()
    assert await master.transfers(2)
