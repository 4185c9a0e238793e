# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of dphy_lane: bursts at any phase of the bits, and from another project's pins."""

import random
from collections.abc import Iterable
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from csi.transmitter import TransmitterOnPins
from plenofir.fpga.csi import header
from plenofir_tb.case import read_case

SETTLE = read_case()["settle"]
STOP, REQUEST, BRIDGE, ESCAPE = 0b11, 0b01, 0b00, 0b10
PERIOD_PS = 40_000
Samples = list[tuple[int, int]]
"""For each bit: the levels for low power, and the bit (drawn where there is none)."""


class Lane:
    """Feeds samples, eight a clock; takes bursts."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.bursts: list[list[int]] = []
        self.missed = 0
        Clock(dut.clk, PERIOD_PS, "ps").start()

    def noise(self, level: int, count: int) -> Samples:
        """Random bits at a low-power level."""
        return [(level, self.rng.randrange(2)) for _ in range(count)]

    def burst(self, data: Iterable[int], zeros: int) -> Samples:
        """A whole burst: the steps to high speed, settling bits, zeros, the sync, bytes."""
        found = [*self.noise(STOP, 40), *self.noise(REQUEST, 40)]
        # The lines settle within SETTLE clocks.
        found += self.noise(BRIDGE, self.rng.randint(0, 8 * SETTLE))
        found += [(BRIDGE, 0)] * (zeros + 8 * (SETTLE + 4))
        for byte in (0xB8, *data):
            found += [(BRIDGE, byte >> n & 1) for n in range(8)]
        return [*found, *[(BRIDGE, 1 - found[-1][1])] * 24, *self.noise(STOP, 40)]

    async def play(self, samples: Samples) -> None:
        """Let samples pass."""
        dut = self.dut
        samples = [*samples, *self.noise(STOP, 64 + -len(samples) % 8)]
        for n in range(0, len(samples) - 7, 8):
            part = samples[n : n + 8]
            await FallingEdge(dut.clk)
            self.missed += str(dut.lane_missed.value) == "1"
            if str(dut.lane_valid.value) == "1":
                if dut.lane_sync.value == 1:
                    self.bursts.append([])
                self.bursts[-1].append(int(dut.lane_data.value))
            # The levels are asynchronous; a clock sees one of them.
            dut.low_power.value = self.rng.choice(part)[0]
            dut.bits.value = sum(bit << i for i, (_, bit) in enumerate(part))

    def check(self, sent: list[list[int]], missed: int = 0) -> None:
        """Bursts begin with what was sent; a few bytes of the trail follow."""
        assert (len(self.bursts), self.missed) == (len(sent), missed)
        for got, want in zip(self.bursts, sent, strict=True):
            assert got[: len(want)] == want
            assert len(got) <= len(want) + 8
        self.bursts.clear()
        self.missed = 0


@cocotb.test()
async def bursts_at_any_phase(dut: Any) -> None:
    """Bytes begin at each of the eight bits; with noise while the lines settle."""
    lane = Lane(dut)
    rng = lane.rng
    await lane.play(lane.noise(STOP, 32))
    for phase in range(24):
        # Data after the sync may look like a sync.
        data = [rng.choice([0xB8, rng.getrandbits(8)]) for _ in range(rng.randint(1, 9))]
        await lane.play(lane.burst(data, phase))
        lane.check([data])


@cocotb.test()
async def other_states_are_passed_over(dut: Any) -> None:
    """An escape, a burst without a sync, levels before the first idle state: no bytes."""
    lane = Lane(dut)
    await lane.play(lane.noise(STOP, 32))
    escape = [*lane.noise(ESCAPE, 32), *lane.noise(BRIDGE, 32), *lane.noise(REQUEST, 32)]
    sync = [(BRIDGE, 0xB8 >> n & 1) for n in range(8)]
    await lane.play([*escape, *[(BRIDGE, 0)] * 160, *sync, *[(BRIDGE, 1)] * 80])
    lane.check([])
    # The line stays low until the levels have come in: noise may look like a sync.
    await lane.play([*lane.noise(REQUEST, 32), *[(BRIDGE, 0)] * 400, *[(STOP, 0)] * 64])
    lane.check([], missed=1)
    # The lines are exchanged: LP-01 looks like LP-10.
    await lane.play([*lane.noise(ESCAPE, 32), *[(BRIDGE, 0)] * 400, *[(STOP, 0)] * 64])
    lane.check([], missed=1)
    data = [1, 2, 3]
    await lane.play(lane.burst(data, 3))
    lane.check([data])


# Its lines settle in nine bits, which are random and may look like a sync.
@cocotb.test(skip=SETTLE == 0)
async def pins_of_others(dut: Any) -> None:
    """Packets from the pins of cocotbext-mipi-csi2."""
    lane = Lane(dut)
    transmitter = TransmitterOnPins(1, 100)
    await lane.play(lane.noise(STOP, 32))
    for number in range(8):
        packet = header(0, 0, number)
        samples: Samples = lane.noise(STOP, 16 + number)
        samples += await transmitter.samples(packet, lane.rng)
        await lane.play(samples)
        lane.check([list(packet)])
