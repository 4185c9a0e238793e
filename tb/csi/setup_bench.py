# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of sensor_setup: a sensor that acknowledges registers, or does not."""

import random
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir_tb.case import read_case

CASE = read_case()
# Address, value, bytes of the value.
ENTRIES = [tuple(entry) for entry in CASE["entries"]]
WRITTEN = [entry for entry in ENTRIES if entry[0] != 0xFFFF]
# In front of a pause: the sensor may be reset by it.
RESETS = [one for one, other in pairwise(ENTRIES) if other[0] == 0xFFFF]
DEVICE = 0x10
NONE, LINE_LOW, REFUSED, DISTURBED = range(4)


class Sensor:
    """Two open-drain lines with a sensor, and the words written to it."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.written: list[tuple[int, int, int]] = []
        self.starts = self.clocks = 0
        # Clocks of the master until now, and the longest time without a clock on the line between a
        # transfer that was refused and the next one.
        self.now = self._rose = self._quiet = 0
        self.pauses: list[int] = []
        self._was_refused = False
        # Faults: transfers without acknowledge; clocks of stretching; lines that stay low; a data
        # line held for a number of clocks; registers that reset the sensor, which does not
        # acknowledge them and is busy for clocks.
        self.refuses = 0
        self.resets: dict[tuple[int, int, int], int] = {}
        self.busy = 0
        self.stretch = 0
        self.scl_low = self.sda_low = False
        self.holds = 0
        self._before = (1, 1)
        self._bits: list[int] | None = None
        self._pulls = False
        self._stretched = 0
        Clock(dut.clk, 10, "ns").start()
        dut.scl.value = dut.sda.value = 1

    async def clock(self) -> None:
        """A clock of the master."""
        dut = self.dut
        await FallingEdge(dut.clk)
        self.now += 1
        low = [str(port.value) == "1" for port in (dut.scl_low, dut.sda_low)]
        scl = int(not (low[0] or self.scl_low or self._stretched > 0))
        sda = int(not (low[1] or self.sda_low or self.holds > 0 or self._pulls))
        self._stretched -= self._stretched > 0
        self.busy -= self.busy > 0
        before, self._before = self._before, (scl, sda)
        if before[0] and scl and before[1] != sda:
            if sda:
                self._stop()
            elif self._was_refused:
                self.pauses.append(self._quiet)
                self._was_refused = False
            self._bits = None if sda or self.busy else []
            self.starts += not sda
            self._pulls = False
        elif scl and not before[0]:
            self.clocks += 1
            self._quiet, self._rose = max(self._quiet, self.now - self._rose), self.now
            self.holds -= self.holds > 0
            if self._bits is not None:
                self._bits.append(sda)
        elif before[0] and not scl:
            self._fall()
        dut.scl.value, dut.sda.value = scl, sda

    def _fall(self) -> None:
        if self.stretch and self.rng.random() < 0.2:
            self._stretched = self.rng.randint(1, self.stretch)
        bits, self._pulls = self._bits, False
        if bits is None:
            return
        if len(bits) == 8 and sum(b << 7 - n for n, b in enumerate(bits)) != DEVICE << 1:
            self._bits = None
        elif len(bits) % 9 == 8:
            self._pulls = not (self.refuses and len(bits) == 26)
            now = self._register([*bits, 1])
            if len(bits) >= 35 and now in self.resets:
                # It is reset before it has acknowledged.
                self.written.append(now)
                self.busy, self._bits, self._pulls = self.resets[now], None, False
        elif len(bits) == 27 and self.refuses:
            self.refuses -= 1
            self._bits, self._was_refused, self._quiet = None, True, 0

    def _register(self, bits: list[int]) -> tuple[int, int, int]:
        """Address, value and bytes of the value in the bits of a transfer."""
        size = len(bits) // 9
        octets = [int("".join(map(str, bits[9 * n : 9 * n + 8])), 2) for n in range(size)]
        value = int.from_bytes(octets[3:])
        return int.from_bytes(octets[1:3]), value, size - 3

    def _stop(self) -> None:
        """A transfer counts when it ends with its last acknowledge bit."""
        bits = self._bits
        if bits is not None and len(bits) in (37, 46):
            self.written.append(self._register(bits[:-1]))

    async def clocks_pass(self, count: int) -> None:
        for _ in range(count):
            await self.clock()

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition holds."""
        for _ in range(100_000):
            if condition():
                return
            await self.clock()
        raise AssertionError("the condition does not come")

    async def begin(self, limit: int = 100_000) -> None:
        """Reset, start, and wait for the end."""
        dut = self.dut
        dut.start.value, dut.reset.value = 0, 1
        await self.clocks_pass(4)
        dut.reset.value = 0
        await self.start(limit)

    async def start(self, limit: int = 100_000) -> None:
        """Start, and wait for the end."""
        dut = self.dut
        self.written.clear()
        dut.start.value = 1
        await self.clock()
        dut.start.value = 0
        for _ in range(limit):
            await self.clock()
            if dut.busy.value == 0:
                await self.clocks_pass(50)
                assert self._before == (1, 1) or self.scl_low or self.sda_low
                return
        raise AssertionError("it does not end")

    def told(self) -> tuple[int, int, int]:
        """Done, fault, transfers repeated."""
        dut = self.dut
        return int(dut.done.value), int(dut.fault.value), int(dut.retried.value)


@cocotb.test()
async def registers_are_written(dut: Any) -> None:
    """All registers in order, with a pause; again; with a sensor that stretches the clock."""
    sensor = Sensor(dut)
    for stretch in (0, CASE["quarter"], 3 * CASE["quarter"]):
        sensor.stretch = stretch
        await sensor.begin()
        assert sensor.written == WRITTEN
        assert sensor.told() == (1, NONE, 0)
        await sensor.start()
        assert sensor.written == WRITTEN
    assert int(dut.entry.value) == len(ENTRIES) - 1


@cocotb.test()
async def transfers_are_repeated(dut: Any) -> None:
    """A transfer is repeated RETRIES times; then the set-up ends there, and can be restarted."""
    sensor = Sensor(dut)
    for refuses in (1, CASE["retries"]):
        sensor.refuses = refuses
        await sensor.begin()
        assert sensor.written == WRITTEN
        assert sensor.told() == (1, REFUSED, refuses)
    # The first millisecond may have begun before.
    assert len(sensor.pauses) == 1 + CASE["retries"]
    assert min(sensor.pauses) >= CASE["retry_pause"]
    sensor.refuses = CASE["retries"] + 1
    await sensor.start()
    assert sensor.written == []
    assert sensor.told() == (0, REFUSED, CASE["retries"])
    assert int(dut.entry.value) == next(n for n, e in enumerate(ENTRIES) if e in WRITTEN)
    await sensor.start()
    assert sensor.written == WRITTEN
    assert sensor.told() == (1, NONE, 0)


@cocotb.test()
async def a_sensor_that_a_register_resets(dut: Any) -> None:
    """The value is not acknowledged, and the sensor is busy: what follows waits for it."""
    sensor = Sensor(dut)
    # Longer than the list's pause and a repeat, shorter than all repeats.
    bit = 4 * CASE["quarter"] + 8
    sensor.resets = {RESETS[0]: CASE["pause"] + 30 * bit}
    await sensor.begin()
    assert sensor.written == WRITTEN
    done, fault, retried = sensor.told()
    assert (done, fault) == (1, REFUSED)
    assert 0 < retried <= CASE["retries"]
    # A register without a pause behind it is no reset.
    sensor.resets = {WRITTEN[-1]: 0}
    await sensor.start()
    assert sensor.told() == (0, REFUSED, CASE["retries"])


@cocotb.test()
async def lines_that_stay_low_are_told(dut: Any) -> None:
    """Either line stuck low is reported; a data line held for some clocks is freed."""
    sensor = Sensor(dut)
    for name in ("scl_low", "sda_low"):
        setattr(sensor, name, True)
        await sensor.begin()
        assert sensor.written == []
        assert sensor.told() == (0, LINE_LOW, CASE["retries"])
        setattr(sensor, name, False)
    await sensor.clocks_pass(10)
    for holds in (1, 8):
        sensor.holds = holds
        await sensor.start()
        assert sensor.written == WRITTEN
        assert sensor.told() == (1, NONE, 0)


@cocotb.test()
async def a_disturbed_line_is_told(dut: Any) -> None:
    """A data line pulled low during a one is reported, and the transfer repeated."""
    sensor = Sensor(dut)
    dut.start.value, dut.reset.value = 0, 1
    await sensor.clocks_pass(4)
    dut.reset.value = 0
    dut.start.value = 1
    await sensor.clock()
    dut.start.value = 0
    # During a one in the sensor's address.
    await sensor.until(lambda: sensor.starts > 0)
    await sensor.until(lambda: len(sensor._bits or ()) >= 2)
    sensor.sda_low = True
    await sensor.clocks_pass(8 * CASE["quarter"])
    sensor.sda_low = False
    await sensor.until(lambda: dut.busy.value == 0)
    assert sensor.written == WRITTEN
    assert sensor.told() == (1, DISTURBED, 1)
