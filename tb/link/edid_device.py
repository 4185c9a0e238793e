# SPDX-License-Identifier: Apache-2.0
"""A monitor's EDID memory on the display data channel: an I2C device with faults."""

import random
from collections.abc import Sequence
from typing import Any

import cocotb
from cocotb.triggers import Timer
from cocotb.utils import get_sim_time

from plenofir_tb.levels import levels

DEVICE = 0x50


class EdidDevice:
    """A device at 0x50 on two open-drain lines, whose master has ``scl_low`` and ``sda_low``.

    It sends `content` and then 0xFF; with None it does not answer. It stretches the clock for up to
    `stretch_ns` at random bits, releases the data line for good after `silent_after` bytes, and
    does not acknowledge byte `refuse` of a transfer (0: the first one). `scl_stuck` and `sda_stuck`
    hold the lines low; call `update` after a change.
    """

    def __init__(self, dut: Any, rng: random.Random) -> None:
        self.dut = dut
        self.rng = rng
        self.content: Sequence[int] | None = None
        self.stretch_ns = 0
        self.scl_stuck = self.sda_stuck = False
        self.silent_after: int | None = None
        self.refuse: int | None = None
        self.starts = self.stops = self.clocks = 0
        self.written: list[int] = []
        self._hold = False
        self._low = False
        self._lines = (1, 1)
        self._mode = "idle"
        self._bits = self._byte = self._place = self._sent = self._taken = 0
        self._mine = False
        self._scl_low, self._sda_low = levels(dut.scl_low), levels(dut.sda_low)
        # When the master last moved the clock line, in ns.
        self.clock_moved = 0.0
        dut.scl.value = dut.sda.value = 1
        self.update()
        cocotb.start_soon(self._follow(dut.scl_low))
        cocotb.start_soon(self._follow(dut.sda_low))

    def send_from_reset(self, byte: int) -> None:
        """Start in the middle of sending a byte, as after an aborted read."""
        self._mode, self._byte, self._bits, self._sent = "send", byte, 1, 0
        self._low = not byte >> 7
        self.update()

    async def _follow(self, line: Any) -> None:
        change = line.value_change
        while True:
            await change
            if line is self.dut.scl_low:
                self.clock_moved = get_sim_time("ns")
            self.update()

    def update(self) -> None:
        """Drive the lines, and react to their changes."""
        scl = int(not (self._scl_low() == "1" or self._hold or self.scl_stuck))
        sda = int(not (self._sda_low() == "1" or self._low or self.sda_stuck))
        before, self._lines = self._lines, (scl, sda)
        if scl != before[0]:
            self.dut.scl.value = scl
        if sda != before[1]:
            self.dut.sda.value = sda
        if before == (1, 1) and (scl, sda) == (1, 0):
            self.starts += 1
            self._mode, self._bits, self._taken, self._low = "take", 0, 0, False
        elif before == (1, 0) and (scl, sda) == (1, 1):
            self.stops += 1
            self._mode = "idle"
        elif not before[0] and scl:
            self.clocks += 1
            self._rising(sda)
        elif before[0] and not scl:
            self._falling()
            if self.stretch_ns and self.rng.random() < 0.1:
                self._hold = True
                cocotb.start_soon(self._let_go())
            self.update()

    async def _let_go(self) -> None:
        await Timer(self.rng.randrange(1, self.stretch_ns), "ns")
        self._hold = False
        self.update()

    def _rising(self, sda: int) -> None:
        """Take a bit."""
        if self._mode == "take":
            self._byte = (self._byte << 1 | sda) & 0xFF
            self._bits += 1
        elif self._mode == "acknowledged" and sda:
            self._mode = "idle"

    def _falling(self) -> None:
        """Put the next bit on the line."""
        self._low = False
        if self._mode == "take" and self._bits == 8:
            self._mode = "acknowledge"
            self.written.append(self._byte)
            refused = self._taken == self.refuse or self.content is None
            if refused or (not self._taken and self._byte >> 1 != DEVICE):
                self._mode = "idle"
            else:
                self._low = True
        elif self._mode == "acknowledge":
            self._mode = "take"
            if self._taken == 0 and self._byte & 1:
                self._load()
            elif self._taken == 1:
                self._place = self._byte
            self._taken += 1
            self._bits = 0 if self._mode == "take" else 1
        elif self._mode == "send":
            if self._bits == 8:
                self._mode = "acknowledged"
            else:
                self._low = not self._byte >> (7 - self._bits) & 1
                self._bits += 1
        elif self._mode == "acknowledged":
            self._load()

    def _load(self) -> None:
        """Begin to send the next byte."""
        content = self.content or ()
        self._byte = content[self._place] if self._place < len(content) else 0xFF
        if self.silent_after is not None and self._sent >= self.silent_after:
            self._byte = 0xFF
        self._place += 1
        self._sent += 1
        self._mode, self._bits = "send", 1
        self._low = not self._byte >> 7
