# SPDX-License-Identifier: Apache-2.0
"""CSI-2 from the standard and the header of `csi_receiver`: packets and their reception."""

from collections import Counter
from collections.abc import Iterable, Sequence

# The data bits that each check bit of a header covers (CSI-2, error correction code).
PARITY = (
    "0 1 2 4 5 7 10 11 13 16 20 21 22 23",
    "0 1 3 4 6 8 10 12 14 17 20 21 22 23",
    "0 2 3 5 6 9 11 12 15 18 20 21 22",
    "1 2 3 7 8 9 13 14 15 19 20 21 23",
    "4 5 6 7 8 9 16 17 18 19 20 22 23",
    "10 11 12 13 14 15 16 17 18 19 21 22 23",
)
KINDS = {8: 0x2A, 10: 0x2B, 12: 0x2C}


def check_byte(data: int) -> int:
    """Check bits of the 24 bits of a header."""
    bits = (sum(data >> int(d) & 1 for d in row.split()) & 1 for row in PARITY)
    return sum(bit << n for n, bit in enumerate(bits))


def checksum(payload: Iterable[int]) -> int:
    """CRC-16: x^16 + x^12 + x^5 + 1, low bits first, from all ones on."""
    crc = 0xFFFF
    for byte in payload:
        for n in range(8):
            bit = (crc ^ byte >> n) & 1
            crc = crc >> 1 ^ (0x8408 if bit else 0)
    return crc


def packet(channel: int, kind: int, value: int, payload: Sequence[int] | None = None) -> list[int]:
    """Bytes of a short packet, or of a long one."""
    data = channel << 6 | kind | value << 8
    head = [data & 255, data >> 8 & 255, data >> 16, check_byte(data)]
    if payload is None:
        return head
    crc = checksum(payload)
    return [*head, *payload, crc & 255, crc >> 8]


def packed(pixels: Sequence[int], bits: int) -> list[int]:
    """Bytes of raw pixels: the high bits of some, then the low bits of the same."""
    together = {8: 1, 10: 4, 12: 2}[bits]
    found = []
    for n in range(0, len(pixels), together):
        group = pixels[n : n + together]
        found += [pixel >> (bits - 8) for pixel in group]
        if bits > 8:
            low = [pixel & (1 << bits - 8) - 1 for pixel in group]
            found.append(sum(value << i * (bits - 8) for i, value in enumerate(low)))
    return found


def unpacked(payload: Sequence[int], bits: int) -> list[int]:
    """Pixels of whole groups of bytes."""
    together = {8: 1, 10: 4, 12: 2}[bits]
    size = together * bits // 8
    found = []
    for n in range(0, len(payload) - size + 1, size):
        for i in range(together):
            low = payload[n + size - 1] >> i * (bits - 8) & (1 << bits - 8) - 1
            found.append(payload[n + i] << bits - 8 | low)
    return found


def mended(head: Sequence[int]) -> tuple[int, str]:
    """The 24 bits of a header, and the report about it."""

    def sound(word: int) -> bool:
        return word >> 24 == check_byte(word & 0xFFFFFF)

    word = sum(byte << 8 * n for n, byte in enumerate(head))
    if sound(word):
        return word & 0xFFFFFF, ""
    for bit in range(32):
        if sound(word ^ 1 << bit):
            return (word ^ 1 << bit) & 0xFFFFFF, "corrected"
    return 0, "damaged"


class Receiver:
    """Receives bursts: frames as lists of lines, and counts of reports."""

    def __init__(self, lanes: int, bits: int, channel: int, columns: int, rows: int) -> None:
        self.lanes, self.bits, self.channel = lanes, bits, channel
        self.columns, self.rows = columns, rows
        self.open = self.running = self.starts = self.has_lines = False
        self.identifier = 0
        self.lines = 0
        self.frames: list[list[list[int]]] = []
        self.told: Counter[str] = Counter()

    def burst(self, data: Sequence[int]) -> None:
        """Receive a burst of all lanes."""
        if len(data) < 4:
            self.told["cut"] += 1
            return
        head, told = mended(data[:4])
        if told:
            self.told[told] += 1
        if told == "damaged":
            return
        kind, value = head & 63, head >> 8
        ours = head >> 6 & 3 == self.channel
        self._left_out(kind, ours=ours, identifier=head & 255)
        if kind < 16:
            if ours and kind == 0:
                self.told["order"] += self.open
                self.open = self.starts = True
                self.has_lines = False
            elif ours and kind == 1:
                self.told["order"] += not self.open
                if self.open:
                    self.told["no lines"] += not self.has_lines
                    wrong = self.running and self.lines != self.rows
                    self.told["size"] += wrong or not self.has_lines
                    self.lines = 0
                self.open = False
            return
        body = list(data[4 : 6 + value])
        whole = len(body) == value + 2
        if not whole:
            self.told["cut"] += 1
            # A word counts only if all lanes have it.
            body = body[: len(body) // self.lanes * self.lanes]
        elif checksum(body[:-2]) != body[-2] | body[-1] << 8:
            self.told["payload"] += 1
        if ours and kind == KINDS[self.bits]:
            self.told["order"] += not self.open
            self.has_lines = True
            if self.open:
                self._line(unpacked(body[:value], self.bits))

    def _left_out(self, kind: int, *, ours: bool, identifier: int) -> None:
        """Count a packet that does not belong to the frames; pixels are named."""
        pixels = kind >= 0x18
        if not pixels:
            self.told["no pixels"] += not ours or kind >= 8
        elif not ours or kind != KINDS[self.bits]:
            self.told["type" if ours else "channel"] += 1
            self.identifier = identifier

    def _line(self, pixels: list[int]) -> None:
        if not pixels:
            return
        if self.starts:
            self.frames.append([])
            self.running, self.starts, self.lines = True, False, 0
        if self.running:
            self.frames[-1].append(pixels)
            self.lines += 1
            self.told["size"] += len(pixels) != self.columns
