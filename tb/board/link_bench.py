"""cocotb tests of what brings the link up and watches it; each is for the entity that it names."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir.fpga.hdmi.pll import HIGH, LOW
from plenofir.fpga.hdmi.pll import registers as registers_of
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()


class Plls:
    """Settings and locks as the supervisor sees them.

    Parameters
    ----------
    dut
        The supervisor.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.settings: list[int] = []
        self.restarts = 0
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
        """Measure the TMDS clock, tenths of a MHz, each time for long enough that all settles."""
        for measured in tenths:
            self.dut.rate.value = measured * CASE["counts_10_mhz"] // 100
            self.dut.rate_updated.value = 1
            await self.clocks(1)
            self.dut.rate_updated.value = 0
            await self.clocks(clocks - 1)

    async def steady(self, tenths: int) -> None:
        """Measure a clock until it counts: not before the fourth time."""
        for _ in range(3):
            await self.measure(tenths)
            self.expect(runs=0, present=0)
        await self.measure(tenths)

    def expect(self, *, runs: int, present: int) -> None:
        """Check what the supervisor drives."""
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
    # No rate and no restart of a test before.
    await plls.measure(0)
    plls.restarts = 0
    return plls


@for_entity("link_supervisor")
async def rates_and_settings(dut: Any) -> None:
    """Limits, the middle, settings kept while the clock drifts, restarts when it jumps."""
    rng = random.Random(cocotb.RANDOM_SEED)
    plls = await supervised(dut)
    # Tenths of MHz, whether it runs, and the settings that were written on the way.
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
    # Drift, a count a measurement: each setting is kept as far as it reaches.
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
    # The limits of the whole range are found while drifting too.
    await plls.steady(746)
    await plls.measure(747)
    plls.expect(runs=1, present=1)
    await plls.measure(748)
    plls.expect(runs=0, present=0)
    # A clock that flickers by a count is steady; one that jumps by two is a new one.
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
    # An open input: any rate, never the same one four times.
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
    # A reset begins anew.
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
        # It is tried again and again, and never runs.
        plls.settings.clear()
        for _ in range(5 * CASE["timeout"] // 2):
            await plls.clocks(1)
            assert not int(dut.run.value)
        assert len(plls.settings) in (2, 3)
        assert int(dut.transmit_reset.value) or lost
        plls.locks[lost] = True
        await plls.clocks(CASE["timeout"] + 100)
        assert int(dut.run.value)
        assert plls.restarts == restarts + 1
    # The board's own clock: chosen in reset, always the low setting; no restart is counted.
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
    """Restarts after so many measurements in a row without data, not before, not by itself."""
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
    """Every register is read, changed where it may be, and written; a dead port is given up."""
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
    alive = False
    assert abs(await write(1) - CASE["timeout"]) < 8
    alive = True
    await write(1)
    assert len(writes) == 2 * len(wanted)


@for_entity("event_counter")
async def events_are_counted(dut: Any) -> None:
    """Up to the limit and no further, from 0 after each clearing."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    limit = 2 ** CASE["width"] - 1
    count = 0
    for i in range(200):
        add, clear = int(rng.random() < 0.7), int(i % 40 == 0)
        dut.add.value = add
        dut.clear.value = clear
        await FallingEdge(dut.clk)
        count = 0 if clear else min(count + add, limit)
        assert int(dut.count.value) == count


@for_entity("frame_rate_meter")
async def frame_rates(dut: Any) -> None:
    """Rates are rounded, at their limit, follow each frame, and are 0 when frames stop."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    tick = CASE["tick"]

    async def frames(units: int, count: int) -> None:
        for _ in range(count):
            for level, clocks in ((1, tick * units // 3), (0, tick * units - tick * units // 3)):
                dut.v_sync.value = level
                await ClockCycles(dut.clk, clocks)

    dut.v_sync.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    await frames(1000, 1)
    # An edge alone is no frame.
    assert int(dut.rate.value) == 0
    for units in (16683, 16667, 20000, 333, 305, 304, 100, rng.randrange(400, 30000)):
        # A frame, the division, and for short frames the one that it was busy with.
        await frames(units, 3 + 2 * (1 << 15) // (tick * units))
        assert int(dut.rate.value) in {
            min(int(1e7 / exact + 0.5), (1 << 15) - 1) for exact in (units, units - 1)
        }, units
    await ClockCycles(dut.clk, tick * (65535 - units) - 200)
    assert int(dut.rate.value) != 0
    await ClockCycles(dut.clk, 400)
    assert int(dut.rate.value) == 0
    # The first edge behind the silence is no frame.
    await frames(30000, 1)
    dut.v_sync.value = 1
    await ClockCycles(dut.clk, 4)
    assert int(dut.rate.value) == 0
    await ClockCycles(dut.clk, 400)
    assert int(dut.rate.value) == 333
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    assert int(dut.rate.value) == 0


class DelayLine:
    """BUSY of a delay line, which may hang, not react, or take its time.

    Attributes
    ----------
    fault
        "hangs": the next calibration never ends; "ignores": nothing is done, not even that;
        empty: it works.
    heals
        Whether a reset of the delay ends either.
    clocks
        Until a calibration begins, and how long it lasts.
    """

    def __init__(self) -> None:
        self.fault = ""
        self.heals = True
        self.clocks = (1, 12)
        self.under_way = self.clocks
        self.passed: int | None = None

    def busy(self, calibrate: int, reset: int) -> int:
        """Take what the control drives in a clock, return BUSY of the next."""
        if reset and self.heals:
            self.fault = ""
            self.passed = None
        if calibrate and self.fault != "ignores":
            assert self.passed is None, "calibrated while it is busy"
            self.passed = 0
            self.under_way = self.clocks
        if self.passed is None:
            return 0
        self.passed += 1
        begin, length = self.under_way
        if self.passed >= begin + length and self.fault != "hangs":
            self.passed = None
        return int(self.passed is not None and self.passed >= begin)


class Channel:
    """Both delay lines of a channel, and what the control may never do.

    Parameters
    ----------
    dut
        The control.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.lines = (DelayLine(), DelayLine())
        self.edges: list[int] = []
        self.steps: list[int] = []
        self.calibrated = [0, 0]
        self.resets = self.hung = 0
        self.since_step = self.now = 0
        self.begun: list[int] = []
        self.before = (0, 0, 0)
        for name in ("busy", "valid", "increase"):
            getattr(dut, name).value = 0

    async def reset(self) -> None:
        """Reset the control; it forgets all but what it has counted."""
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, 3)
        await FallingEdge(self.dut.clk)
        self.dut.reset.value = 0
        self.steps.clear()
        self.resets = self.hung = 0
        assert not int(self.dut.tracking.value)

    async def clocks(self, count: int, *, until_tracking: int | None = None) -> int:
        """Let clocks pass, at most until the channel tracks or not; return how many."""
        dut = self.dut
        for passed in range(count):
            if until_tracking is not None and int(dut.tracking.value) == until_tracking:
                return passed
            edge = self.edges.pop(0) if self.edges else None
            dut.valid.value = int(edge is not None)
            dut.increase.value = int(edge == 1)
            hung = str(dut.hung_toggle.value)
            await FallingEdge(dut.clk)
            self.now += 1
            self.hung += str(dut.hung_toggle.value) != hung
            calibrate = (int(dut.calibrate_master.value), int(dut.calibrate_slave.value))
            reset, step = int(dut.delay_reset.value), int(dut.step.value)
            busy = int(dut.busy.value)
            self.since_step += 1
            if step:
                assert not busy, "a step while a line is busy"
                self.steps.append(1 if int(dut.step_up.value) else -1)
                self.since_step = 0
            if any(calibrate):
                assert not busy, "a calibration while a line is busy"
                assert not step
                assert self.since_step > CASE["quiet"], "a calibration too soon behind a step"
                self.begun.append(self.now)
            for now, before in zip((*calibrate, reset), self.before, strict=True):
                assert not (now and before), "longer than a clock"
            self.before = (*calibrate, reset)
            self.resets += reset
            busy = 0
            for i, line in enumerate(self.lines):
                self.calibrated[i] += calibrate[i]
                busy |= line.busy(calibrate[i], reset)
            dut.busy.value = busy
        return count

    def repair(self) -> None:
        """Make both lines work."""
        self.lines = (DelayLine(), DelayLine())

    def taps(self) -> int:
        """Position that is reported."""
        return int(self.dut.taps.value.to_signed())

    async def follow(self, edge: int, intervals: int) -> None:
        """Give edges of one kind for so many calibrations."""
        for _ in range(intervals):
            count = len(self.begun)
            while len(self.begun) == count:
                self.edges = [edge]
                await self.clocks(1)


@for_entity("phase_detector_control")
async def steps_and_calibrations(dut: Any) -> None:
    """Both lines are calibrated, then reset, the slave again and again; a step for each."""
    Clock(dut.clk, 10, "ns").start()
    channel = Channel(dut)
    await channel.reset()
    assert await channel.clocks(200, until_tracking=1) < 150
    assert channel.calibrated == [1, 1]
    assert channel.resets == 1
    assert channel.taps() == channel.hung == 0
    # No edges, no steps, and edges of both kinds neither.
    await channel.clocks(1000)
    assert channel.calibrated[0] == 1
    periods = {b - a for a, b in zip(channel.begun[2:], channel.begun[3:], strict=False)}
    assert len(periods) == 1
    assert 0 < periods.pop() - CASE["interval"] < 20
    channel.edges = [0, 1] * 1000
    await channel.clocks(2000)
    assert channel.steps == []
    # FILTER edges more of one kind make a step, one less does not.
    for edge, step in ((1, 1), (0, -1)):
        for surplus in (CASE["filter"] - 1, CASE["filter"]):
            channel.steps.clear()
            begun = len(channel.begun)
            while len(channel.begun) == begun:
                await channel.clocks(1)
            # The calibration is over then.
            await channel.clocks(18)
            channel.edges = [edge] * surplus
            await channel.clocks(CASE["interval"])
            assert channel.steps == [step] * (surplus == CASE["filter"])
    # One step for each calibration, up to the limit of what is reported, and back.
    channel.steps.clear()
    await channel.follow(1, 5)
    assert channel.steps == [1] * 5
    assert channel.taps() == 5
    for edge, limit in ((1, 127), (0, -127)):
        await channel.follow(edge, limit - channel.taps() if edge else channel.taps() - limit)
        assert channel.taps() == limit
        await channel.follow(edge, 2)
        assert channel.taps() == limit
        await channel.follow(1 - edge, 1)
        assert channel.taps() == limit + (-1 if edge else 1)
    assert channel.hung == 0
    assert channel.resets == 1
    await channel.reset()
    await channel.clocks(200, until_tracking=1)
    assert channel.taps() == 0


@for_entity("phase_detector_control")
async def delay_lines_that_hang(dut: Any) -> None:
    """A line that hangs or ignores its commands is reset; lines that are slow are waited for."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    channel = Channel(dut)
    timeout = CASE["timeout"]
    # Long enough for the interval, the time-out, and calibrations anew.
    patience = 2 * (CASE["interval"] + 100) + timeout
    for fault, number, first in (
        ("hangs", 0, True),
        ("hangs", 1, True),
        ("hangs", 1, False),
        ("ignores", 0, True),
        ("ignores", 1, True),
        ("ignores", 1, False),
    ):
        channel.repair()
        await channel.reset()
        if not first:
            await channel.clocks(200, until_tracking=1)
            # No step before the slave has been calibrated again.
            await channel.follow(1, 3)
            assert channel.taps() == 2
            assert channel.resets == 1
        channel.resets = 0
        channel.lines[number].fault = fault
        if not first:
            lost = await channel.clocks(patience, until_tracking=0)
            assert timeout < lost < patience
        await channel.clocks(patience, until_tracking=1)
        assert int(dut.tracking.value), fault
        assert channel.hung == 1, fault
        # That of the time-out, and that behind the calibration.
        assert channel.resets == 2, fault
        assert channel.taps() == 0
        channel.steps.clear()
        await channel.follow(0, 3)
        assert channel.taps() == -2
        assert channel.hung == 1
    # A line that no reset of the delay brings back: it is tried for ever, and told each time.
    for fault in ("hangs", "ignores"):
        await channel.reset()
        for line in channel.lines:
            line.fault, line.heals = fault, False
        await channel.clocks(6 * timeout)
        assert not int(dut.tracking.value)
        assert channel.hung in (4, 5, 6)
        assert channel.resets == channel.hung
        # The receiver's clocks were restarted.
        toggle = int(dut.hung_toggle.value)
        channel.repair()
        await channel.reset()
        assert int(dut.hung_toggle.value) == toggle, "no reset may look like a hung line"
        await channel.clocks(200, until_tracking=1)
        assert int(dut.tracking.value)
        assert channel.hung == 0
    # Slow lines, within the time-out.
    for _ in range(10):
        for line in channel.lines:
            line.clocks = (rng.randrange(1, timeout - 4), rng.randrange(1, timeout - 4))
        await channel.clocks(3 * timeout)
        assert int(dut.tracking.value)
        assert channel.hung == 0
    # Any of it, at any time: it always tracks again.
    for _ in range(CASE["faults"]):
        line = rng.choice(channel.lines)
        line.fault = rng.choice(("hangs", "ignores"))
        line.clocks = (rng.randrange(1, 20), rng.randrange(1, 40))
        channel.edges = [rng.randrange(2) for _ in range(rng.randrange(400))]
        await channel.clocks(rng.randrange(patience))
        await channel.clocks(2 * patience, until_tracking=1)
        assert int(dut.tracking.value)


@for_entity("clock_meter")
async def clocks_are_measured(dut: Any) -> None:
    """Counts of several clocks, one for each window, and of a clock that stands still."""
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
        # The first window has another clock in it.
        assert all(abs(count - want) <= 1 for count in counts[1:]), (period, counts)
        assert abs(sum(counts[2:]) - want * len(counts[2:])) <= 1
        if clock is not None:
            clock.stop()
