# SPDX-License-Identifier: Apache-2.0
"""An EDID memory on I2C, from the I2C specification (UM10204), E-DDC 1.2, EDID 1.3 (E-EDID A.2)."""

from collections.abc import Sequence

DEVICE = 0x50


def edid_faults(block: Sequence[int], columns: int) -> list[str]:
    """Faults of a block of 128 bytes, for lines with a largest number of columns."""
    faults = []
    if list(block[:8]) != [0, *[255] * 6, 0]:
        faults.append("header")
    if sum(block) % 256:
        faults.append("checksum")
    if tuple(block[18:20]) != (1, 3) or block[126]:
        faults.append("version, extensions")
    if not block[20] & 0x80:
        faults.append("not digital")
    # The first detailed timing, the preferred one.
    if not block[54] | block[55] << 8 or not 0 < block[56] | block[58] >> 4 << 8 <= columns:
        faults.append("preferred timing")
    return faults


class Device:
    """A device's side of the lines: `low` says whether it pulls the data line.

    `content` is sent from the written address on, then 0xFF; None: no answer. `refuse` is the
    number of a byte in a transfer that is not acknowledged; 2: the address to read.
    """

    def __init__(self, content: Sequence[int] | None) -> None:
        self.content = content
        self.refuse = -1
        self.pointer = 0
        self.lines = (1, 1)
        self.mode, self.bits, self.byte, self.number = "idle", 0, 0, 0
        self.low = False
        # Received bytes, sent bytes with the master's acknowledge, starts and stops.
        self.log: list[tuple[str, int, int]] = []

    def sends(self, byte: int) -> None:
        """Start in the middle of a byte."""
        self.mode, self.byte, self.bits, self.low = "send", byte, 1, not byte >> 7

    def follow(self, scl: int, sda: int) -> None:
        """Follow the levels of the lines."""
        before, self.lines = self.lines, (scl, sda)
        if before == (1, 1) and self.lines == (1, 0):
            self.log.append(("start", 0, 0))
            self.mode, self.bits, self.byte, self.number, self.low = "take", 0, 0, 0, False
        elif before == (1, 0) and self.lines == (1, 1):
            self.log.append(("stop", 0, 0))
            self.mode, self.low = "idle", False
        elif scl > before[0]:
            if self.mode == "take" and self.bits < 8:
                self.byte, self.bits = self.byte << 1 | sda, self.bits + 1
            elif self.mode == "wait":
                self.log.append(("sent", self.byte, 1 - sda))
                self.mode = "idle" if sda else "next"
        elif scl < before[0]:
            self._fall()

    def _fall(self) -> None:
        self.low = False
        if self.mode == "take" and self.bits == 8:
            addressed = self.number > 0 or self.byte >> 1 == DEVICE
            number = 2 if self.number == 0 and self.byte & 1 else self.number
            answers = self.content is not None and addressed and number != self.refuse
            self.log.append(("taken", self.byte, int(answers)))
            self.mode, self.low = ("answered", True) if answers else ("idle", False)
        elif self.mode == "answered":
            self.mode = "take"
            if self.number == 0 and self.byte & 1:
                self._load()
            elif self.number == 1:
                self.pointer = self.byte
            self.number += 1
            if self.mode == "take":
                self.bits = self.byte = 0
        elif self.mode == "send" and self.bits < 8:
            self.low = not self.byte >> (7 - self.bits) & 1
            self.bits += 1
        elif self.mode == "send":
            self.mode = "wait"
        elif self.mode == "next":
            self._load()

    def _load(self) -> None:
        content = self.content or ()
        self.sends(content[self.pointer] if self.pointer < len(content) else 0xFF)
        self.pointer = (self.pointer + 1) % 256
