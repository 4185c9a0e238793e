# SPDX-License-Identifier: Apache-2.0
"""A sensor's registers on I2C, from UM10204 and the drivers of sensors: resets, busy times."""

DEVICE = 0x10


class Sensor:
    """The sensor's side of the lines: `low` says whether it pulls the data line.

    A register is written by the stop behind its last acknowledged byte. `resets` has registers
    whose value is not acknowledged any more from a byte on (the first or the last one), as the
    sensor starts anew, and clocks for which it then says nothing.
    """

    def __init__(self) -> None:
        self.written: list[tuple[int, bytes]] = []
        self.resets: dict[int, tuple[bool, int]] = {}
        self.busy = 0
        self.lines = (1, 1)
        self.bits: list[int] | None = None
        self.low = False

    def clock(self) -> None:
        self.busy -= self.busy > 0

    def octets(self) -> bytes:
        """Whole bytes since the start, each with its acknowledge bit."""
        assert self.bits is not None
        count = (len(self.bits) + 1) // 9
        parts = (self.bits[9 * n : 9 * n + 8] for n in range(count))
        return bytes(int("".join(map(str, part)), 2) for part in parts)

    def follow(self, scl: int, sda: int) -> None:
        """Follow the levels of the lines."""
        before, self.lines = self.lines, (scl, sda)
        if before == (1, 1) and self.lines == (1, 0):
            self.bits, self.low = (None if self.busy else []), False
        elif before == (1, 0) and self.lines == (1, 1):
            if self.bits is not None and len(self.bits) % 9 == 1 and len(self.bits) > 28:
                octets = self.octets()
                self.written.append((int.from_bytes(octets[1:3]), octets[3:]))
            self.bits, self.low = None, False
        elif scl > before[0] and self.bits is not None:
            self.bits.append(sda)
        elif scl < before[0]:
            self.low = self.bits is not None and len(self.bits) % 9 == 8 and self._answers()

    def _answers(self) -> bool:
        octets = self.octets()
        if octets[0] != DEVICE << 1:
            self.bits = None
            return False
        if len(octets) < 4:
            return True
        address = int.from_bytes(octets[1:3])
        if address in self.resets:
            at_once, busy = self.resets[address]
            if at_once or len(octets) == 5:
                self.written.append((address, octets[3:]))
                self.busy, self.bits = busy, None
                return False
        return True
