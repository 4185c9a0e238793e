# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of phase_search: a channel behind a delay line, with uncertain bits at edges."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir.fpga.hdmi import tmds
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()
TAPS, STEP = 128, 4
# Of a line.
BLANK, ACTIVE = 24, 40


class Channel:
    """Bits of a channel as they are sampled behind the delay line, which is at `tap`.

    A bit is `bit_taps` taps long; within `unsure` taps of its ends the neighbouring bit may be
    sampled instead. The bits are `late` taps late, or absent (`silent`).
    """

    def __init__(self, rng: random.Random, bit_taps: int, unsure: int) -> None:
        self.rng = rng
        self.bit_taps, self.unsure = bit_taps, unsure
        self.late = rng.randrange(10 * bit_taps)
        self.silent = False
        self.tap = 0
        self.moved = 0
        lines = 30
        active = np.array(([False] * BLANK + [True] * ACTIVE) * lines)
        data = np.array([rng.randrange(256) for _ in active], np.uint8)
        control = np.repeat([rng.randrange(4) for _ in range(lines)], BLANK + ACTIVE)
        words = tmds.encode_channel(data, active, control.astype(np.uint8))
        self.bits = [int(word) >> i & 1 for word in words for i in range(10)]
        self.at = 0

    def drive(self, load_n: int, move: int) -> None:
        """Follow the control's outputs: a falling edge of MOVE moves the delay by a tap."""
        if not load_n:
            self.tap = 0
        elif self.moved and not move:
            assert self.tap < TAPS - 1, "moved beyond the end"
            self.tap += 1
        self.moved = move

    def inside(self) -> int:
        """Taps from the sampling instant to the nearer end of its bit."""
        place = (self.late - self.tap) % self.bit_taps
        return min(place, self.bit_taps - 1 - place)

    def word(self) -> int:
        """Ten bits."""
        begin = self.at + (self.late - self.tap) // self.bit_taps
        place = (self.late - self.tap) % self.bit_taps
        self.at += 10
        word = 0
        for i in range(10):
            taken = begin + i
            if place < self.unsure and self.rng.random() < 0.5:
                taken -= 1
            elif place >= self.bit_taps - self.unsure and self.rng.random() < 0.5:
                taken += 1
            word |= self.bits[taken % len(self.bits)] << i
        return 0 if self.silent else word


class Bench:
    """The entity and its channel."""

    def __init__(self, dut: Any, channel: Channel) -> None:
        self.dut, self.channel = dut, channel

    async def clocks(self, count: int, until: int | None = None) -> None:
        """Run for some clocks, or until the search has ended (1) or restarted (0)."""
        for _ in range(count):
            if until is not None and int(self.dut.tracking.value) == until:
                return
            self.dut.bits.value = self.channel.word()
            await FallingEdge(self.dut.clk)
            if not int(self.dut.reset.value):
                self.channel.drive(int(self.dut.load_n.value), int(self.dut.move.value))
        assert until is None, f"not tracking={until} after {count} clocks"

    def check(self) -> None:
        """The delay is in the middle of the part of a bit that the delay line reaches."""
        channel = self.channel
        assert int(self.dut.taps.value) == channel.tap
        # At least half of the line's taps are within one bit, less the uncertain ones.
        reached = min(channel.bit_taps, TAPS // 2)
        least = reached // 2 - channel.unsure // 2 - STEP - 1
        assert channel.inside() >= max(least, 0), (channel.tap, channel.late, channel.bit_taps)


@for_entity("phase_search")
async def the_middle_is_found(dut: Any) -> None:
    """Bits of many lengths with uncertain ends; slips, silence and resets in between."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    look = 2 * CASE["timeout"] + 100
    for bit_taps in CASE["bit_taps"]:
        channel = Channel(rng, bit_taps, rng.randrange(bit_taps // 5))
        bench = Bench(dut, channel)
        dut.reset.value = 1
        await bench.clocks(5)
        channel.tap = 0
        dut.reset.value = 0
        hung = int(dut.hung_toggle.value)
        await bench.clocks(40 * look, until=1)
        bench.check()
        # Noise in the picture and occasional wrong tokens change nothing.
        before = channel.tap
        await bench.clocks(3000)
        assert (channel.tap, int(dut.hung_toggle.value)) == (before, hung)
        # The line slips by half a bit or more, or to any position.
        channel.late += rng.choice((1, -1)) * (bit_taps // 2 + bit_taps // 3)
        await bench.clocks(3 * look, until=0)
        await bench.clocks(80 * look, until=1)
        bench.check()
        assert int(dut.tracking.value)
        channel.silent = True
        hung = int(dut.hung_toggle.value)
        await bench.clocks(CASE["timeout"] + 100, until=0)
        assert int(dut.hung_toggle.value) != hung
        await bench.clocks(3000)
        assert not int(dut.tracking.value)
        channel.silent = False
        await bench.clocks(80 * look, until=1)
        bench.check()


@for_entity("phase_search")
async def every_place_of_a_bit(dut: Any) -> None:
    """For any position of bits in the delay line, one search is enough and its result stays."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    bit_taps = CASE["bit_taps"][0]
    for late in range(0, bit_taps, CASE["late_step"]):
        channel = Channel(rng, bit_taps, 0)
        channel.late = late
        bench = Bench(dut, channel)
        dut.reset.value = 1
        await bench.clocks(5)
        channel.tap = 0
        dut.reset.value = 0
        hung = int(dut.hung_toggle.value)
        await bench.clocks(40 * (2 * CASE["timeout"] + 100), until=1)
        bench.check()
        await bench.clocks(3 * (BLANK + ACTIVE))
        assert int(dut.tracking.value), f"late by {late} taps: the delay was given up"
        assert int(dut.hung_toggle.value) == hung


@for_entity("phase_search")
async def wrong_words_begin_a_search(dut: Any) -> None:
    """A number of wrong words in a window starts one search in it; fewer start none."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    channel = Channel(rng, CASE["bit_taps"][0], 0)
    bench = Bench(dut, channel)
    limit, window = CASE["error_limit"], CASE["error_window"]
    search = 40 * (2 * CASE["timeout"] + 100)
    dut.wrong.value = 0
    dut.reset.value = 1
    await bench.clocks(5)
    channel.tap = 0
    dut.reset.value = 0
    await bench.clocks(search, until=1)

    async def wrong(words: int) -> None:
        for _ in range(words):
            dut.wrong.value = 1
            await bench.clocks(1)
            dut.wrong.value = 0
            await bench.clocks(rng.randrange(5))

    hung = int(dut.hung_toggle.value)
    # Fewer than that in each window.
    for _ in range(3):
        await wrong(limit // 2)
        await bench.clocks(window)
    assert (int(dut.tracking.value), int(dut.hung_toggle.value)) == (1, hung)
    await wrong(limit)
    await bench.clocks(10, until=0)
    assert int(dut.hung_toggle.value) != hung
    await bench.clocks(search, until=1)
    bench.check()
    # No second search in this window, but in one of the next.
    await wrong(2 * limit)
    assert int(dut.tracking.value)
    await bench.clocks(window)
    await wrong(2 * limit)
    await bench.clocks(10, until=0)
