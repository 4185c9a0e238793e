# SPDX-License-Identifier: Apache-2.0
"""A source of DVI (DVI 1.0) or HDMI (HDMI 1.4), with what the standards leave to it.

DVI: the control bits of channels 1 and 2 hold anything. HDMI: preambles, guard bands, islands with
packets. Both: syncs of any polarity, frames that are not all alike, swapped pairs.
"""

import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from hunt.references.tmds import TOKENS, Signal, encode

# HDMI 1.4, section 5.4.3.
TERC4 = (
    *(0b1010011100, 0b1001100011, 0b1011100100, 0b1011100010),
    *(0b0101110001, 0b0100011110, 0b0110001110, 0b0100111100),
    *(0b1011001100, 0b0100111001, 0b0110011100, 0b1011000110),
    *(0b1010001110, 0b1001110001, 0b0101100011, 0b1011000011),
)
# Sections 5.2.2.1 and 5.2.3.3.
VIDEO_GUARD = (0b1011001100, 0b0100110011, 0b1011001100)
ISLAND_GUARD = 0b0100110011
PREAMBLE, GUARD, PACKET = 8, 2, 32
# Words of a control period; four of them in front of a preamble (section 5.2.3.1: 12).
LEAST_CONTROL = 12
# What DVI leaves free: CTL0 to CTL3 over time.
CONTROLS = ("zero", "constant", "syncs", "hsync", "by period", "switched", "noise")
# How frames differ from each other.
CHANGES = ("shorter line", "longer line", "a line more", "refresh", "interlaced", "blanking")
# Colours (red in the low bits) whose words are those of guard bands, the last one of an island's.
EDGES = (0x555555, 0xAB55AB, 0x5555AB, 0xABABAB, 0x6D5555)
Words = tuple[int, int, int]


def check_bits(bits: list[int]) -> list[int]:
    """Check bits of a header or subpacket (section 5.2.3.4: x^8 + x^7 + x^6 + 1, lowest first)."""
    register = 0
    for bit in bits:
        feedback = register & 1 ^ bit
        register = register >> 1 ^ (0b10000011 if feedback else 0)
    return [register >> i & 1 for i in range(8)]


def packet(rng: random.Random) -> list[tuple[int, int, int]]:
    """Header bit, even and odd bits of the subpackets of each word of an audio or null packet."""
    header = [int(c) for c in f"{rng.choice((0, 1, 2, 3)):08b}"[::-1]]
    header += [rng.randrange(2) for _ in range(16)]
    header += check_bits(header)
    parts = []
    for _ in range(4):
        bits = [rng.randrange(2) for _ in range(56)]
        parts.append(bits + check_bits(bits))
    return [
        (
            header[i],
            sum(part[2 * i] << k for k, part in enumerate(parts)),
            sum(part[2 * i + 1] << k for k, part in enumerate(parts)),
        )
        for i in range(PACKET)
    ]


@dataclass
class Source:
    """A source and its state."""

    rng: random.Random
    # Active, front porch, sync, back porch of lines and frames; levels of the sync pulses.
    h: tuple[int, int, int, int]
    v: tuple[int, int, int, int]
    h_level: int
    v_level: int
    hdmi: bool = False
    control: str = "zero"
    # CTL3 to CTL0 where they are constant.
    constant: int = 0
    # How frames differ: "" if they are all alike.
    change: str = ""
    # The colour of the first pixels of all lines, if not random.
    edge: int | None = None
    # Channels with swapped wires, a sum of 1, 2, 4.
    swapped: int = 0
    number: int = 0
    counts: Counter[str] = field(default_factory=Counter)

    @property
    def total(self) -> int:
        return sum(self.h) * sum(self.v)

    def frame(self) -> Iterator[Signal]:
        """Signals of the next frame."""
        rng, odd = self.rng, self.number % 2
        lines = sum(self.v) + {
            "a line more": odd,
            "refresh": self.number * 2 % 5,
            "interlaced": odd,
        }.get(self.change, 0)
        at = rng.randrange(self.v[0], sum(self.v))
        half = sum(self.h) // 2 if self.change == "interlaced" and odd else 0
        begin = self.h[0] + self.h[1]
        sync = (self.v[0] + self.v[1]) * sum(self.h) + begin + half
        place = 0
        for y in range(lines):
            length = sum(self.h)
            if odd and y == at:
                length += {"shorter line": -1, "longer line": 3}.get(self.change, 0)
            if self.change == "blanking":
                length += self.number % 3
            for x in range(length):
                active = x < self.h[0] and y < self.v[0]
                in_h = begin <= x < begin + self.h[2]
                in_v = sync <= place < sync + self.v[2] * sum(self.h)
                pixel = rng.getrandbits(24) if active else 0
                if active and x < 2 and self.edge is not None:
                    pixel = self.edge
                yield (
                    int(active),
                    int(in_h == bool(self.h_level)),
                    int(in_v == bool(self.v_level)),
                    pixel,
                )
                place += 1
        self.number += 1

    def send(self, count: int) -> tuple[list[Signal], list[Words]]:
        """Signals and words of frames; a further one follows."""
        signals: list[Signal] = []
        for _ in range(count):
            signals += self.frame()
        words = self._words(signals)
        mask = sum(0x3FF << 10 * c for c in range(3) if self.swapped >> c & 1)
        return signals, [
            (w[0] ^ mask & 0x3FF, w[1] ^ mask >> 10 & 0x3FF, w[2] ^ mask >> 20 & 0x3FF)
            for w in words
        ]

    def _words(self, signals: list[Signal]) -> list[Words]:
        words: list[Words] = []
        blank: list[Signal] = []
        disparity = [0, 0, 0]
        for signal in [*signals, (1, 0, 0, 0)]:
            if not signal[0]:
                blank.append(signal)
                continue
            if blank:
                words += self._hdmi_blanking(blank) if self.hdmi else self._dvi_blanking(blank)
                blank, disparity = [], [0, 0, 0]
            row = []
            for c in range(3):
                word, disparity[c] = encode(signal[3] >> (16 - 8 * c) & 0xFF, disparity[c])
                row.append(word)
            words.append((row[0], row[1], row[2]))
        return words[:-1]

    def _dvi_blanking(self, blank: list[Signal]) -> Iterator[Words]:
        rng = self.rng
        now, at = rng.randrange(16), rng.randrange(len(blank))
        for i, (_, h_sync, v_sync, _) in enumerate(blank):
            syncs = v_sync << 1 | h_sync
            control = {
                "zero": 0,
                "constant": self.constant,
                "syncs": syncs * 5,
                "hsync": h_sync,
                "by period": now,
                "switched": now if i < at else self.constant,
                "noise": rng.randrange(16),
            }[self.control]
            yield TOKENS[syncs], TOKENS[control & 3], TOKENS[control >> 2]

    def _hdmi_blanking(self, blank: list[Signal]) -> list[Words]:
        rng = self.rng
        syncs = [v_sync << 1 | h_sync for _, h_sync, v_sync, _ in blank]
        words = [(TOKENS[s], TOKENS[0], TOKENS[0]) for s in syncs]
        end = len(blank) - PREAMBLE - GUARD
        for i in range(end, end + PREAMBLE):
            words[i] = (TOKENS[syncs[i]], TOKENS[1], TOKENS[0])
        words[-GUARD:] = [VIDEO_GUARD] * GUARD
        at = LEAST_CONTROL - PREAMBLE
        while rng.random() < 0.8:
            # As long as there is room for another control period behind the island.
            at += rng.choice((0, 0, 1, rng.randrange(20)))
            packets = rng.choice((1, 1, 2))
            length = PREAMBLE + 2 * GUARD + PACKET * packets
            if at + length + LEAST_CONTROL - PREAMBLE > end:
                break
            words[at : at + length] = self._island(syncs[at : at + length], packets)
            self.counts["islands"] += 1
            at += length + LEAST_CONTROL - PREAMBLE
        return words

    def _island(self, syncs: list[int], packets: int) -> list[Words]:
        rows = [(TOKENS[s], TOKENS[1], TOKENS[1]) for s in syncs[:PREAMBLE]]
        bits = [word for _ in range(packets) for word in packet(self.rng)]
        for i, s in enumerate(syncs[PREAMBLE:]):
            if GUARD <= i < GUARD + len(bits):
                header, even, odd = bits[i - GUARD]
                low = s | header << 2 | (i != GUARD) << 3
                rows.append((TERC4[low], TERC4[even], TERC4[odd]))
            else:
                rows.append((TERC4[12 | s], ISLAND_GUARD, ISLAND_GUARD))
        return rows


def draw_source(rng: random.Random, *, blank: int, change: str = "") -> Source:
    """A source with at least `blank` words of blanking a line."""
    hdmi = rng.random() < 0.5
    least = max(blank, LEAST_CONTROL + GUARD + 4)
    if hdmi and rng.random() < 0.7:
        least = max(least, 2 * LEAST_CONTROL + PACKET + 3 * GUARD + rng.randrange(12))
    front, sync = rng.randint(1, 6), rng.randint(1, 8)
    # No sync changes while a guard band carries none.
    back = max(least - front - sync, PREAMBLE + GUARD + 1 if hdmi else 2)
    if not hdmi and rng.random() < 0.3:
        # Control bits that follow the syncs then look like a preamble.
        front, back = max(least - PREAMBLE - sync, 1), PREAMBLE
    columns, rows = rng.randint(6, 18), rng.randint(3, 8)
    source = Source(
        rng,
        (columns, front, sync, back),
        (rows, rng.randint(1, 3), rng.randint(1, 2), rng.randint(2, 4)),
        rng.randrange(2),
        rng.randrange(2),
        hdmi=hdmi,
        control=rng.choice(CONTROLS),
        constant=rng.choice((1, 5, rng.randrange(16))),
        change=change,
        # Pixels whose words are those of guard bands.
        edge=rng.choice((None, None, *EDGES)),
    )
    if looks_like_hdmi(source):
        source.edge = None
    return source


def looks_like_hdmi(source: Source) -> bool:
    """Whether a DVI source cannot be told from one of HDMI: its control bits are preambles.

    Its first pixels must then be no guard bands.
    """
    short = source.h[3] == PREAMBLE
    imitates = {
        "hsync": short,
        "syncs": short and source.edge == EDGES[-1],
        "switched": True,
    }.get(source.control, False)
    return not source.hdmi and imitates
