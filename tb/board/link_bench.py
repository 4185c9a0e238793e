# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of link start-up and supervision; each is for the entity that it names."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, Timer

from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity
from plenofir_tb.hdmi.pll import HIGH, LOW
from plenofir_tb.hdmi.pll import registers as registers_of

CASE = read_case()


class Plls:
    """Settings and locks as the supervisor sees them."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.settings: list[int] = []
        self.restarts = 0
        self.failed = 0
        self.locks = [True, True]
        dut.want_own.value = 0
        dut.own_ready.value = 0
        dut.rate.value = 0
        dut.rate_updated.value = 0
        dut.data.value = 1
        dut.configured.value = 1
        dut.receive_locked.value = 0
        dut.transmit_locked.value = 0

    async def clocks(self, count: int) -> None:
        """Let the PLLs follow for some clocks."""
        busy = 0
        dut = self.dut
        for _ in range(count):
            await FallingEdge(dut.clk)
            self.restarts += str(dut.restarted.value) == "1"
            self.failed += str(dut.lock_failed.value) == "1"
            if str(dut.configure.value) == "1":
                self.settings.append(int(dut.high.value))
                assert int(dut.receive_reset.value), "settings change in reset only"
                busy = 4
            dut.configured.value = int(busy == 0)
            busy = max(busy - 1, 0)
            for reset, locked, can in zip(
                (dut.receive_reset, dut.transmit_reset),
                (dut.receive_locked, dut.transmit_locked),
                self.locks,
                strict=True,
            ):
                locked.value = int(str(reset.value) == "0" and can)

    async def measure(self, *tenths: int, clocks: int = 60) -> None:
        """Measure TMDS clocks, in tenths of a MHz, each for long enough to settle."""
        for measured in tenths:
            self.dut.rate.value = measured * CASE["counts_10_mhz"] // 100
            self.dut.rate_updated.value = 1
            await self.clocks(1)
            self.dut.rate_updated.value = 0
            await self.clocks(clocks - 1)

    async def steady(self, tenths: int) -> None:
        """Measure a clock until it is accepted: not before the fourth time."""
        for _ in range(3):
            await self.measure(tenths)
            self.expect(runs=0, present=0)
        await self.measure(tenths)

    def expect(self, *, runs: int, present: int) -> None:
        dut = self.dut
        assert (int(dut.run.value), int(dut.present.value)) == (runs, present)
        assert int(dut.receive_reset.value) == int(dut.transmit_reset.value) == 1 - runs


async def supervised(dut: Any) -> Plls:
    """Reset the supervisor."""
    Clock(dut.clk, 10, "ns").start()
    plls = Plls(dut)
    dut.reset.value = 1
    await plls.clocks(4)
    plls.expect(runs=0, present=0)
    dut.reset.value = 0
    # Nothing remains from the test before.
    await plls.measure(0)
    plls.restarts = 0
    return plls


@for_entity("link_supervisor")
async def rates_and_settings(dut: Any) -> None:
    """Limits, the middle, settings kept while the clock drifts, restarts when it jumps."""
    rng = random.Random(cocotb.RANDOM_SEED)
    plls = await supervised(dut)
    # Tenths of MHz, whether the link runs, and the settings written until then.
    for tenths, settings in (
        (239, []),
        (748, []),
        (240, [0]),
        (747, [1]),
        (450, [0]),
        (743, [1]),
        (253, [0]),
        (453, [1]),
    ):
        plls.settings.clear()
        await plls.steady(tenths)
        plls.expect(runs=len(settings), present=len(settings))
        assert plls.settings == settings, tenths
    assert plls.restarts == 5, "each jump but the first ones takes a running link down"
    # Drift by one count a measurement: each setting is kept to the end of its range.
    for begin, last, setting in ((453, 400, 0), (450, 500, 1)):
        await plls.steady(begin + 10)
        await plls.steady(begin)
        plls.settings.clear()
        step = 1 if last > begin else -1
        await plls.measure(*range(begin + step, last + step, step), clocks=10)
        plls.expect(runs=1, present=1)
        assert plls.settings == []
        await plls.measure(last + step)
        assert plls.settings == [setting]
        plls.expect(runs=1, present=1)
    # The limits of the whole range apply to a drifting clock too.
    await plls.steady(746)
    await plls.measure(747)
    plls.expect(runs=1, present=1)
    await plls.measure(748)
    plls.expect(runs=0, present=0)
    # A clock that varies by one count is steady; a jump by two counts is a new clock.
    await plls.measure(742, 743, 742, 743, 742)
    plls.expect(runs=1, present=1)
    restarts = plls.restarts
    for step in (2, -2):
        await plls.measure(742 + step, clocks=4)
        plls.expect(runs=0, present=0)
        await plls.measure(742 + step, 742 + step)
        plls.expect(runs=0, present=0)
        await plls.measure(742 + step)
        plls.expect(runs=1, present=1)
        await plls.measure(0, 742, 742, 742, 742)
    assert plls.restarts == restarts + 4
    # An open input: any rate, but never four times the same.
    await plls.measure(0)
    plls.settings.clear()
    last = 0
    for _ in range(200):
        now = rng.choice([n for n in range(0, 4095, rng.choice((3, 50))) if abs(n - last) > 1])
        await plls.measure(*[now] * rng.randrange(1, 4), clocks=3)
        plls.expect(runs=0, present=0)
        last = now
    await plls.measure(*[4095] * 5)
    assert plls.settings == []
    # A reset starts from the beginning.
    await plls.steady(742)
    dut.reset.value = 1
    await plls.clocks(4)
    plls.expect(runs=0, present=0)
    dut.reset.value = 0
    await plls.clocks(100)
    plls.expect(runs=0, present=0)
    await plls.measure(742, 742)
    plls.expect(runs=0, present=0)
    await plls.measure(742)
    plls.expect(runs=1, present=1)
    # So does a reset of one clock, immediately.
    dut.reset.value = 1
    await plls.clocks(1)
    plls.expect(runs=0, present=0)
    dut.reset.value = 0
    # Also while waiting for a lock: the source is not switched before the resets.
    plls.locks[0] = False
    await plls.measure(742, 742, 742)
    dut.reset.value = 1
    await plls.clocks(1)
    dut.reset.value = 0
    dut.want_own.value = 1
    for _ in range(15):
        assert not int(dut.use_own.value)
        await plls.clocks(1)
    await plls.clocks(5)
    assert int(dut.use_own.value)


@for_entity("link_supervisor")
async def lost_locks_and_the_own_clock(dut: Any) -> None:
    """Lost locks, locks that never come, the board's own clock."""
    plls = await supervised(dut)
    await plls.steady(742)
    for lost in (0, 1):
        restarts = plls.restarts
        plls.locks[lost] = False
        await plls.clocks(4)
        assert not int(dut.run.value)
        # It is retried repeatedly, and never runs.
        plls.settings.clear()
        failed = plls.failed
        for _ in range(5 * CASE["timeout"] // 2):
            await plls.clocks(1)
            assert not int(dut.run.value)
        assert len(plls.settings) in (2, 3)
        assert 0 <= len(plls.settings) - (plls.failed - failed) <= 1, "each is counted"
        assert int(dut.transmit_reset.value) or lost
        plls.locks[lost] = True
        await plls.clocks(CASE["timeout"] + 100)
        assert int(dut.run.value)
        assert plls.restarts == restarts + 1
    # A lock just within the time-out does not count as failed.
    failed = plls.failed
    plls.locks = [False, True]
    dut.receive_locked.value = 0
    await plls.clocks(CASE["timeout"] - 10)
    plls.locks = [True, True]
    await plls.clocks(20)
    assert (int(dut.run.value), plls.failed) == (1, failed)
    # The board's own clock: selected during reset, always the low setting; no restart is counted.
    plls.settings.clear()
    restarts = plls.restarts
    dut.want_own.value = 1
    await plls.clocks(100)
    assert (int(dut.run.value), int(dut.use_own.value)) == (0, 1)
    dut.own_ready.value = 1
    await plls.clocks(100)
    assert (int(dut.run.value), int(dut.use_own.value)) == (1, 1)
    assert plls.settings == [0]
    assert plls.restarts == restarts
    dut.own_ready.value = 0
    await plls.clocks(4)
    assert not int(dut.run.value)
    assert plls.restarts == restarts + 1
    dut.own_ready.value = 1
    await plls.clocks(100)
    dut.want_own.value = 0
    await plls.clocks(100)
    assert (int(dut.run.value), int(dut.use_own.value)) == (1, 0)
    assert plls.settings == [0, 0, 1]
    assert plls.restarts == restarts + 1


@for_entity("link_supervisor")
async def clock_without_data(dut: Any) -> None:
    """Restarts after a number of measurements in a row without data, and at no other time."""
    plls = await supervised(dut)
    patience = CASE["patience"]
    await plls.steady(742)
    await plls.measure(*[742] * (2 * patience))
    assert plls.restarts == 0
    dut.data.value = 0
    for _ in range(3):
        await plls.measure(*[742] * (patience - 1))
        dut.data.value = 1
        await plls.clocks(1)
        dut.data.value = 0
    assert plls.restarts == 0
    for count in range(1, 4):
        await plls.measure(*[742] * (patience - 1))
        assert plls.restarts == count - 1
        plls.settings.clear()
        await plls.measure(742)
        assert plls.restarts == count
        assert plls.settings == [1], "the PLLs are set anew"
        plls.expect(runs=1, present=1)
    # The test pattern needs no data.
    dut.own_ready.value = 1
    dut.want_own.value = 1
    await plls.clocks(60)
    await plls.measure(*[742] * (3 * patience))
    assert plls.restarts == 3
    assert int(dut.run.value)


@for_entity("pll_configure")
async def settings_are_written(dut: Any) -> None:
    """Every register is read, changed within its mask, and written; a dead port times out."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    registers: dict[int, int] = {}
    writes: list[int] = []
    alive = True

    async def port() -> None:
        while True:
            dut.drp_ready.value = 0
            await FallingEdge(dut.clk)
            if not alive or str(dut.drp_enable.value) != "1":
                continue
            address = int(dut.drp_address.value)
            if int(dut.drp_write.value):
                registers[address] = int(dut.drp_in.value)
                writes.append(address)
            await ClockCycles(dut.clk, rng.randrange(1, 5))
            await FallingEdge(dut.clk)
            dut.drp_out.value = registers[address]
            dut.drp_ready.value = 1
            await FallingEdge(dut.clk)

    async def write(high: int) -> int:
        """Start, and clocks until it is done."""
        await FallingEdge(dut.clk)
        dut.high.value = high
        dut.start.value = 1
        await FallingEdge(dut.clk)
        dut.start.value = 0
        for clocks in range(1, 2000):
            if int(dut.done.value):
                return clocks
            await FallingEdge(dut.clk)
        raise AssertionError("never done")

    dut.start.value = 0
    dut.drp_out.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    await ClockCycles(dut.clk, 3)
    assert int(dut.done.value)
    assert str(dut.drp_enable.value) == "0"
    cocotb.start_soon(port())
    for high, setting in ((0, LOW), (1, HIGH), (0, LOW)):
        before = {address: rng.randrange(1 << 16) for address in range(32)}
        registers |= before
        writes.clear()
        await write(high)
        wanted = registers_of(setting)
        assert sorted(writes) == sorted(wanted)
        for address, (mask, value) in wanted.items():
            assert registers[address] == before[address] & ~mask | value, hex(address)
    # A reset at any time: it ends at once, and nothing more is written.
    for clocks in range(1, 9):
        await FallingEdge(dut.clk)
        dut.start.value = 1
        await FallingEdge(dut.clk)
        dut.start.value = 0
        await ClockCycles(dut.clk, clocks)
        await FallingEdge(dut.clk)
        dut.reset.value = 1
        await FallingEdge(dut.clk)
        dut.reset.value = 0
        assert int(dut.done.value)
        for _ in range(12):
            await FallingEdge(dut.clk)
            assert int(dut.done.value)
            assert not int(dut.drp_enable.value)
        writes.clear()
        await write(1)
        assert len(writes) == len(wanted)
    writes.clear()
    alive = False
    assert abs(await write(1) - CASE["timeout"]) < 8
    alive = True
    await write(1)
    assert len(writes) == len(wanted)


@for_entity("frame_rate_meter")
async def frame_rates(dut: Any) -> None:
    """Rates are rounded and limited, change with each frame, and are 0 when frames stop."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    tick = CASE["tick"]

    async def frames(units: int, count: int) -> None:
        for _ in range(count):
            for level, clocks in ((1, tick * units // 3), (0, tick * units - tick * units // 3)):
                dut.v_sync.value = level
                # As many rising edges, of which only the last one wakes the bench.
                await Timer(10_000 * (clocks - 1) + 1, "ps")
                await RisingEdge(dut.clk)

    dut.v_sync.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    await frames(1000, 1)
    # An edge alone is no frame.
    assert int(dut.rate.value) == 0
    for units in (16683, 16667, 20000, 333, 305, 304, 100, rng.randrange(400, 30000)):
        # A frame, the division, and for short frames one more division under way.
        await frames(units, 3 + 2 * (1 << 15) // (tick * units))
        assert int(dut.rate.value) in {
            min(int(1e7 / exact + 0.5), (1 << 15) - 1) for exact in (units, units - 1)
        }, units
    # Silence: the rate is 0 when the counter of the time since the last edge is full.
    dut.v_sync.value = 1
    await Timer(10_000 * (tick * 65536 - 1) + 1, "ps")
    await RisingEdge(dut.clk)
    assert int(dut.rate.value) != 0
    await ClockCycles(dut.clk, 2)
    assert int(dut.rate.value) == 0
    dut.v_sync.value = 0
    await ClockCycles(dut.clk, 2)
    # The first edge after the silence is no frame.
    await frames(30000, 1)
    dut.v_sync.value = 1
    await ClockCycles(dut.clk, 4)
    assert int(dut.rate.value) == 0
    await ClockCycles(dut.clk, 400)
    assert int(dut.rate.value) == 333

    async def begin_division(units: int) -> None:
        """Start a division, with no result shown so far."""
        dut.v_sync.value = 0
        dut.reset.value = 1
        await ClockCycles(dut.clk, 3)
        dut.reset.value = 0
        await frames(units, 1)
        dut.v_sync.value = 1

    # A reset of an even or an odd number of clocks ends a division, even just before its end.
    for units in (2000, 1999):
        await begin_division(units)
        division = 0
        while int(dut.rate.value) == 0:
            await ClockCycles(dut.clk, 1)
            division += 1
            assert division < 10000
        for clocks in range(division - 3, division):
            await begin_division(units)
            await ClockCycles(dut.clk, clocks)
            dut.reset.value = 1
            await ClockCycles(dut.clk, 1)
            dut.reset.value = 0
            for _ in range(8):
                await ClockCycles(dut.clk, 1)
                assert int(dut.rate.value) == 0


@for_entity("clock_meter")
async def clocks_are_measured(dut: Any) -> None:
    """Counts of several clocks, one for each window, and of a stopped clock."""
    window = CASE["window"]
    Clock(dut.clk, 10, "ns").start()
    dut.measured_clk.value = 0
    await ClockCycles(dut.clk, 2)
    # In ns; one clock in 16 is counted.
    for period in (0, 3, 27, 125):
        clock = Clock(dut.measured_clk, period, "ns") if period else None
        if clock is not None:
            clock.start()
        counts: list[int] = []
        since = 0
        for _ in range(5 * window):
            await FallingEdge(dut.clk)
            since += 1
            if int(dut.updated.value):
                assert not counts or since == window
                since = 0
                counts.append(int(dut.count.value))
            elif counts:
                assert int(dut.count.value) == counts[-1]
        assert len(counts) in (4, 5)
        want = 10 * window / (16 * period) if period else 0
        # The first window contains a part of the clock before.
        assert all(abs(count - want) <= 1 for count in counts[1:]), (period, counts)
        assert abs(sum(counts[2:]) - want * len(counts[2:])) <= 1
        if clock is not None:
            clock.stop()
