# SPDX-License-Identifier: Apache-2.0
"""Lanes of a D-PHY: from lists of clocks, or from the pins of cocotbext-mipi-csi2's transmitter."""

import random
from collections import deque
from collections.abc import Sequence
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge, Timer

from plenofir.fpga.csi import lane_clocks


class Lanes:
    """The clock of the lanes; sends the clocks of `plenofir.fpga.csi.lane_clocks`."""

    def __init__(self, dut: Any, lanes: int, period_ps: int) -> None:
        self.dut, self.lanes = dut, lanes
        self.queue: deque[tuple[int, int, int]] = deque()
        Clock(dut.byte_clk, period_ps, "ps").start()
        cocotb.start_soon(self._run())

    async def _run(self) -> None:
        ports = (self.dut.lane_valid, self.dut.lane_sync, self.dut.lane_data)
        shown: tuple[int, int, int] | None = None
        while True:
            await RisingEdge(self.dut.byte_clk)
            now = self.queue.popleft() if self.queue else (0, 0, 0)
            if now != shown:
                for port, value in zip(ports, now, strict=True):
                    port.value = value
                shown = now

    def clock(self, entries: Sequence[int]) -> None:
        """Send one clock: an entry for each lane."""
        valid = sum((e >> 8 & 1) << n for n, e in enumerate(entries))
        sync = sum((e >> 9 & 1) << n for n, e in enumerate(entries))
        self.queue.append((valid, sync, sum((e & 255) << 8 * n for n, e in enumerate(entries))))

    def send(self, packets: Sequence[bytes], **options: Any) -> None:
        """Send a burst for each packet; options as for `lane_clocks`."""
        for entries in lane_clocks(packets, self.lanes, **options).tolist():
            self.clock(entries)

    async def sent(self) -> None:
        """Wait until everything has been sent and has passed the receiver."""
        while self.queue:
            await RisingEdge(self.dut.byte_clk)
        for _ in range(60):
            await RisingEdge(self.dut.byte_clk)
        for _ in range(60):
            await RisingEdge(self.dut.clk)


class Pin:
    """A pin that the transmitter sets."""

    def __init__(self) -> None:
        self.value = 1


class TransmitterOnPins:
    """The transmitter of cocotbext-mipi-csi2 with pins, and a D-PHY that reads them.

    It is independent of this project in the layout of packets, the packing of raw pixels, their
    distribution to lanes and serialisation, and the steps from low power to high speed. Its
    deficiencies (0.2.0): the header code has another bit order than the standard, the checksum is a
    sum, lanes have no skew, and cocotb 2.1 no longer accepts its Timer's `units`. So a packet's
    code and checksum are replaced by this project's, which other tests compare with public
    receivers.
    """

    SYNC = 0xB8

    def __init__(self, lanes: int, bit_rate_mbps: float) -> None:
        from cocotbext.mipi_csi2.bus import Csi2DPhyBus
        from cocotbext.mipi_csi2.config import Csi2Config
        from cocotbext.mipi_csi2.phy import dphy

        class Pins(Csi2DPhyBus):
            def __init__(self) -> None:
                for name in ("clk", *(f"data{n}" for n in range(lanes))):
                    setattr(self, f"{name}_p", Pin())
                    setattr(self, f"{name}_n", Pin())

        def timer(time: float, units: Any = "step") -> Timer:
            return Timer(time, unit=units, round_mode="round")

        dphy.Timer = timer
        self.pins = Pins()
        config = Csi2Config(lane_count=lanes, bit_rate_mbps=bit_rate_mbps)
        config.t_hs_prepare_ns = 40 + 5 * config.get_bit_period_ns()
        config.t_hs_zero_ns = 105 + 7 * config.get_bit_period_ns()
        self.phy = dphy.DPhyTxModel(self.pins, config)
        self.lanes = lanes
        # Both edges of a clock of the bit rate carry a bit.
        self.bit_ps = round(self.phy.ddr_bit_period_ns * 1000)

    async def send(self, packet: bytes, into: Lanes, skews: Sequence[int]) -> None:
        """Send a packet over the pins; their bytes go to the lanes, with a skew in clocks."""
        bits: list[list[int]] = [[] for _ in range(self.lanes)]
        reader = cocotb.start_soon(self._read(bits))
        await self.phy.start_packet_transmission()
        await self.phy.send_packet_data(packet)
        await self.phy.stop_packet_transmission()
        reader.cancel()
        found = [self._bytes(lane) for lane in bits]
        length = max(map(len, found)) + max(skews)
        clocks = np.zeros((length + 8, self.lanes), np.uint16)
        for n, data in enumerate(found):
            clocks[skews[n] : skews[n] + len(data), n] = np.frombuffer(data, np.uint8) + np.uint16(
                0x100
            )
            clocks[skews[n], n] |= 0x200
        for entries in clocks.tolist():
            into.clock(entries)

    async def samples(self, packet: bytes, rng: random.Random) -> list[tuple[int, int]]:
        """For each bit of lane 0 the levels at the low-power receivers, and the bit."""
        found: list[tuple[int, int]] = []

        async def watch() -> None:
            await Timer(self.bit_ps // 2, "ps")
            fast = 0
            while True:
                now = self.pins.data0_p.value, self.pins.data0_n.value
                fast = 0 if now == (1, 1) else 1 if now == (0, 0) else 2 * min(fast, 1)
                # In high speed both lines are low for the low-power receivers.
                level = 0 if fast else now[0] << 1 | now[1]
                found.append((level, now[0] if fast == 2 else rng.randrange(2)))
                await Timer(self.bit_ps, "ps")

        watcher = cocotb.start_soon(watch())
        await self.phy.start_packet_transmission()
        await self.phy.send_packet_data(packet)
        await self.phy.stop_packet_transmission()
        watcher.cancel()
        return found

    async def _read(self, bits: list[list[int]]) -> None:
        """High-speed bits, from LP-11, LP-01, LP-00 up to the next LP-11."""
        steps = [0] * self.lanes
        low_power = ((1, 1), (0, 1), (0, 0))
        await Timer(self.bit_ps // 2, "ps")
        while True:
            for n in range(self.lanes):
                now = getattr(self.pins, f"data{n}_p").value, getattr(self.pins, f"data{n}_n").value
                if now == (1, 1):
                    steps[n] = 1
                elif steps[n] < 3:
                    steps[n] += now == low_power[steps[n]]
                elif now != (0, 0):
                    bits[n].append(now[0])
            await Timer(self.bit_ps, "ps")

    def _bytes(self, bits: list[int]) -> bytes:
        """Bytes after the sync."""
        text = "".join(map(str, bits))
        begin = text.index(f"{self.SYNC:08b}"[::-1]) + 8
        return bytes(int(text[n : n + 8][::-1], 2) for n in range(begin, len(text) - 7, 8))
