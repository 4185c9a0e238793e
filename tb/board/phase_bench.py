# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of phase_detector_control, with delay lines that hang, do not react or are slow."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()
# Clocks within which a calibration begins in any case.
LONGEST_INTERVAL = 100_000


class DelayLine:
    """BUSY of a delay line, which may hang, not react, or take its time.

    With the `fault` "hangs" a calibration never ends, with "ignores" it never begins. `heals`: a
    reset of the delay line clears either fault. `clocks` are those until a calibration begins, and
    its duration.
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
    """Both delay lines of a channel, with checks of what the control must never do."""

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

    async def reset(self, clocks: int = 3) -> None:
        """Reset the control; only its counts stay."""
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, clocks)
        await FallingEdge(self.dut.clk)
        self.dut.reset.value = 0
        self.steps.clear()
        self.resets = self.hung = 0
        assert not int(self.dut.tracking.value)

    async def clocks(self, count: int, *, until_tracking: int | None = None) -> int:
        """Let clocks pass, at most until the channel starts or stops tracking; return how many."""
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
        return int(self.dut.taps.value.to_signed())

    async def follow(self, edge: int, intervals: int) -> None:
        """Send edges of one kind during some calibrations."""
        for _ in range(intervals):
            count = len(self.begun)
            for _ in range(LONGEST_INTERVAL):
                if len(self.begun) > count:
                    break
                self.edges = [edge]
                await self.clocks(1)
            assert len(self.begun) > count, "no calibration"


@for_entity("phase_detector_control")
async def steps_and_calibrations(dut: Any) -> None:
    """Both lines are calibrated and reset, then the slave is recalibrated, with a step for each."""
    Clock(dut.clk, 10, "ns").start()
    channel = Channel(dut)
    await channel.reset()
    assert await channel.clocks(200, until_tracking=1) < 150
    assert channel.calibrated == [1, 1]
    assert channel.resets == 1
    assert channel.taps() == channel.hung == 0
    # No steps without edges, or with equally many of both kinds.
    await channel.clocks(1000)
    assert channel.calibrated[0] == 1
    periods = {b - a for a, b in zip(channel.begun[2:], channel.begun[3:], strict=False)}
    assert len(periods) == 1
    assert 0 < periods.pop() - CASE["interval"] < 20
    channel.edges = [0, 1] * 1000
    await channel.clocks(2000)
    assert channel.steps == []
    # An excess of FILTER edges of one kind makes a step, one less does not.
    for edge, step in ((1, 1), (0, -1)):
        for surplus in (CASE["filter"] - 1, CASE["filter"]):
            channel.steps.clear()
            begun = len(channel.begun)
            for _ in range(LONGEST_INTERVAL):
                if len(channel.begun) > begun:
                    break
                await channel.clocks(1)
            assert len(channel.begun) > begun, "no calibration"
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
    # A reset in each clock from the first calibration to the one after the edges.
    first = await begin_anew(channel, 200)
    for clocks in range(2 * CASE["quiet"], first + 1):
        await begin_anew(channel, clocks)
        assert await begin_anew(channel, 200) == first, clocks
        assert channel.calibrated == [1, 1]
        assert channel.resets == 1


async def begin_anew(channel: Channel, clocks: int) -> int:
    """Reset for a clock; result: clocks until the channel tracks, within a limit."""
    channel.repair()
    channel.dut.busy.value = 0
    channel.calibrated = [0, 0]
    await channel.reset(1)
    assert not int(channel.dut.delay_reset.value)
    channel.before = (0, 0, 0)
    return await channel.clocks(clocks, until_tracking=1)


@for_entity("phase_detector_control")
async def delay_lines_that_hang(dut: Any) -> None:
    """A delay line that hangs or ignores commands is reset; slow ones are waited for."""
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
            # No step before the slave is calibrated again.
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
        # The reset after the time-out, and the one after the calibration.
        assert channel.resets == 2, fault
        assert channel.taps() == 0
        channel.steps.clear()
        await channel.follow(0, 3)
        assert channel.taps() == -2
        assert channel.hung == 1
    # A line that stays faulty after a reset is retried endlessly, and reported each time.
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
    # Any fault at any time: the channel always tracks again.
    for _ in range(CASE["faults"]):
        line = rng.choice(channel.lines)
        line.fault = rng.choice(("hangs", "ignores"))
        line.clocks = (rng.randrange(1, 20), rng.randrange(1, 40))
        channel.edges = [rng.randrange(2) for _ in range(rng.randrange(400))]
        await channel.clocks(rng.randrange(patience))
        await channel.clocks(2 * patience, until_tracking=1)
        assert int(dut.tracking.value)
