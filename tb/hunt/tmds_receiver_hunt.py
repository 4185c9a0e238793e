# SPDX-License-Identifier: Apache-2.0
"""Hunt of `tmds_receiver`: sources of DVI and HDMI with all that the standards leave to them.

Skew, slips, swapped pairs, wrong bits, cables pulled out, garbage, other sources, resets.
"""

import random
from typing import Any

from hunt.references.tmds import Signal
from hunt.streams import FaultError
from hunt.video_sources import CHANGES, Source, draw_source

ENTITY = "tmds_receiver"
FAULTS = [
    ("tmds_word_align.vhd", "phase    <= run_phase;", "phase    <= 0;"),
    ("tmds_periods.vhd", 'active_1 = "000" or active_1 = "001" or', 'active_1 = "000" or'),
    ("tmds_polarity.vhd", 'channels_t := "101"', 'channels_t := "100"'),
    ("tmds_periods.vhd", "whole_video  := run = PREAMBLE_WORDS and", "whole_video  :="),
]  # fmt: skip
LATENCIES = range(2, 60)
# Lines and islands until a source that had guard bands counts as one of DVI.
PLAIN = 16
# The order to find the polarity.
FIND = 8


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {"RUN": rng.randint(4, 12), "ALIGN_TIMEOUT": rng.randint(150, 400)}}


class Cable:
    """Three channels of bits with different delays, and their output."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.ports = [
            getattr(dut, n)
            for n in (
                *("active", "h_sync", "v_sync", "pixel", "errors", "locked"),
                *("packet_error", "hdmi", "inverted"),
            )
        ]
        self.restart()

    def restart(self) -> None:
        # Bits under way in each channel, the first one lowest, and their number.
        self.bits = [0, 0, 0]
        self.counts = [0, 0, 0]
        self.queue: list[int] = []
        self.got: list[tuple[int, ...]] = []

    def put(self, channel: int, bits: int, count: int) -> None:
        self.bits[channel] |= bits << self.counts[channel]
        self.counts[channel] += count

    def play(self, row: tuple[int, int, int]) -> None:
        """Feed one word per channel, take ten bits of each."""
        packed = 0
        for c, word in enumerate(row):
            self.put(c, word, 10)
            packed |= (self.bits[c] & 0x3FF) << 10 * c
            self.bits[c] >>= 10
            self.counts[c] -= 10
        self.queue.append(packed)

    def step(self, clock: int) -> None:
        texts = [str(port.value) for port in self.ports]
        if "".join(texts).strip("01"):
            raise FaultError(f"undefined: {texts}")
        self.got.append(tuple(int(text, 2) for text in texts))
        if self.queue:
            self.dut.bits.value = self.queue.pop(0)


class Hunt:
    """Segments of video, each after a disturbance."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng = bench, rng
        self.cable: Cable = bench.ports[0]
        # Pairs swapped between source and receiver, and channels that the receiver takes for that.
        self.swapped = self.known = 0
        for c in range(3):
            self.cable.put(c, rng.getrandbits(60), rng.randint(10, 60))
        self.another()

    def another(self) -> None:
        """Another source; of DVI with swapped pairs the receiver must be told."""
        rng = self.rng
        change = rng.choice((*CHANGES, *("",) * 6))
        self.source: Source = draw_source(
            rng, blank=self.bench.design["generics"]["RUN"] + 14, change=change
        )
        if rng.random() < 0.5:
            self.swapped = rng.choice((0, 7, rng.randrange(8)))
        self.source.swapped = self.swapped
        # What an HDMI source has shown holds until the lock is lost, which it may be or not.
        self.order = self.swapped
        if self.source.hdmi or (self.swapped == 0 and self.known == 0):
            self.order = rng.choice((FIND, FIND, self.swapped))
        if self.source.hdmi and self.order == FIND:
            self.known = self.swapped
        self.bench.set(polarity=self.order)
        kind = "HDMI" if self.source.hdmi else f"DVI, control bits: {self.source.control}"
        self.bench.counts[f"source: {kind}"] += 1
        if change:
            self.bench.counts[f"frames: {change}"] += 1
        if self.swapped:
            self.bench.counts["pairs swapped"] += 1

    async def send(self, rows: list[tuple[int, int, int]]) -> None:
        for row in rows:
            self.cable.play(row)
        self.cable.got.clear()
        await self.bench.clocks(len(rows))

    async def check(self, kind: str) -> None:
        """After two frames the output equals the input, except for damaged words.

        Longer behind a source of HDMI, for one of DVI: it must have sent lines without guard bands.
        """
        source = self.source
        first = 2 if source.hdmi else 2 + -(-(PLAIN + 1) // source.v[0])
        lead, lead_rows = source.send(first)
        sent, rows = source.send(3)
        begin, line = len(lead), sum(source.h)
        sent, rows = lead + sent, lead_rows + rows
        hits: dict[int, int] = {}
        at = begin
        while kind == "wrong bits":
            at += 3 * line + self.rng.randrange(line)
            if at >= len(rows):
                break
            channel = self.rng.randrange(3)
            row = list(rows[at])
            row[channel] ^= 1 << self.rng.randrange(10)
            # In an island it may hit a packet or a sync, in a guard band nothing.
            if not (source.hdmi and not sent[at][0]):
                rows[at], hits[at] = (row[0], row[1], row[2]), channel
        await self.send(rows)
        got = self.cable.got
        for late in LATENCIES:
            if not self.differences(sent, got, hits, begin, late):
                return
        fewest = min(
            LATENCIES, key=lambda late: len(self.differences(sent, got, hits, begin, late))
        )
        places = self.differences(sent, got, hits, begin, fewest)
        n = places[0]
        raise FaultError(
            f"{kind}: {len(places)} of {len(sent) - begin} clocks are wrong, first {n}: "
            f"got {got[n + fewest]}, want {sent[n]}; hit are {sorted(hits)[:5]}; "
            f"{source.control}, edge {source.edge}, {source.hdmi}, {source.h}, {source.v}, "
            f"order {self.order}, swapped {self.swapped}, {source.change}"
        )

    def differences(
        self,
        sent: list[Signal],
        got: list[tuple[int, ...]],
        hits: dict[int, int],
        begin: int,
        late: int,
    ) -> list[int]:
        """Clocks in which the output differs from the delayed input."""
        wrong = []
        # A wrong tenth bit makes another token, which holds until the next one.
        token_hit = False
        for n in range(begin, len(sent) - late):
            *signal, errors, locked, packet_error, hdmi, inverted = got[n + late]
            if n in hits:
                # At most the byte of one channel.
                signal[3] |= 0xFF0000 >> 8 * hits[n]
                errors &= ~(1 << hits[n])
            want = list(sent[n])
            if n in hits:
                want[3] |= 0xFF0000 >> 8 * hits[n]
                signal[3] = signal[3] if want[0] else want[3]
            if not want[0]:
                token_hit = hits.get(n) == 0
            if token_hit:
                signal[1:3] = want[1:3]
            told = (hdmi, inverted) == (self.source.hdmi, self.swapped)
            if signal != want or errors or not locked or packet_error or not told:
                wrong.append(n)
        return wrong

    async def disturb(self, kind: str) -> None:
        rng, cable, timeout = self.rng, self.cable, self.bench.design["generics"]["ALIGN_TIMEOUT"]
        self.bench.counts[f"cable: {kind}"] += 1
        if kind == "slip":
            for c in rng.sample(range(3), rng.randint(1, 3)):
                if cable.counts[c] > 20 and rng.random() < 0.5:
                    count = rng.randint(1, 9)
                    cable.bits[c] >>= count
                    cable.counts[c] -= count
                elif cable.counts[c] < 60:
                    cable.put(c, rng.getrandbits(9), rng.randint(1, 9))
                # An extra bit shifts all bits after it.
                cable.bits[c] &= (1 << cable.counts[c]) - 1
        elif kind == "pulled out":
            level = rng.choice([0, 0x3FF])
            await self.send([(level, level, level)] * (timeout + 60))
            if cable.got[-1][5]:
                raise FaultError("a cable that is pulled out is locked")
        elif kind == "garbage":
            count = rng.randint(1, 2 * timeout)
            await self.send([tuple(rng.getrandbits(10) for _ in range(3)) for _ in range(count)])
        elif kind == "another source":
            # It goes on, stops in the middle of a frame, and another one begins, anywhere in one.
            await self.send(self.source.send(1)[1][: rng.randrange(1, self.source.total)])
            if rng.random() < 0.5:
                self.bench.counts["source: stops"] += 1
                await self.send([(0, 0, 0)] * (timeout + 60))
                self.known = 0
            self.another()
            await self.send(self.source.send(1)[1][rng.randrange(self.source.total - 1) :])
        elif kind == "reset":
            bits, counts = cable.bits, cable.counts
            self.known = 0
            await self.bench.reset(1)
            cable.bits, cable.counts = bits, counts
            await self.bench.clocks(1)
            if cable.got[-1][0] or cable.got[-1][5]:
                raise FaultError("active or locked behind a reset")


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(bits=0, polarity=FIND, reset=1)
        await bench.clocks(6)
        bench.add(Cable(bench.dut))
    await bench.reset(rng.choice([1, 1, 5]))
    hunt = Hunt(bench, rng)
    await hunt.check("start")
    kinds = ["slip", "wrong bits", "pulled out", "garbage", "another source", "reset"]
    for _ in range(rng.randint(1, 3)):
        kind = rng.choice(kinds)
        await hunt.disturb(kind)
        await hunt.check(kind)
