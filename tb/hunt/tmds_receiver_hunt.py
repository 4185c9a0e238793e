# SPDX-License-Identifier: Apache-2.0
"""Hunt of `tmds_receiver`: skew, slips, wrong bits, cables pulled out, garbage, resets."""

import random
from typing import Any

from hunt.rasters import Mode, draw_mode, frames
from hunt.references.tmds import Signal, words
from hunt.streams import FaultError

ENTITY = "tmds_receiver"
FAULTS = [
    ("tmds_word_align.vhd", "phase    <= run_phase;", "phase    <= 0;"),
    ("tmds_periods.vhd", 'active_1 = "000" or active_1 = "001" or', 'active_1 = "000" or'),
]  # fmt: skip
LATENCIES = range(2, 60)


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {"RUN": rng.randint(4, 12), "ALIGN_TIMEOUT": rng.randint(150, 400)}}


class Cable:
    """Three channels of bits with different delays, and their output."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.ports = [
            getattr(dut, n) for n in ("active", "h_sync", "v_sync", "pixel", "errors", "locked")
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
        self.mode: Mode = draw_mode(rng, (6, 18), blank=bench.design["generics"]["RUN"] + 14)
        for c in range(3):
            self.cable.put(c, rng.getrandbits(60), rng.randint(10, 60))

    async def send(self, rows: list[tuple[int, int, int]]) -> None:
        for row in rows:
            self.cable.play(row)
        self.cable.got.clear()
        await self.bench.clocks(len(rows))

    async def check(self, kind: str) -> None:
        """After two frames the output equals the input, except for damaged words."""
        sent = frames(self.mode, 5, self.rng)
        rows = words(sent)
        begin = 2 * self.mode.total
        hits: dict[int, int] = {}
        at = begin
        while kind == "wrong bits":
            at += 3 * self.mode.line + self.rng.randrange(self.mode.line)
            if at >= len(rows):
                break
            channel = self.rng.randrange(3)
            row = list(rows[at])
            row[channel] ^= 1 << self.rng.randrange(10)
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
            f"got {got[n + fewest]}, want {sent[n]}; hit are {sorted(hits)[:5]}"
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
            *signal, errors, locked = got[n + late]
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
            if signal != want or errors or not locked:
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
        elif kind == "another mode":
            await self.send(words(frames(self.mode, 1, rng)[: rng.randrange(self.mode.total)]))
            self.mode = draw_mode(rng, (6, 18), blank=self.bench.design["generics"]["RUN"] + 14)
        elif kind == "reset":
            bits, counts = cable.bits, cable.counts
            await self.bench.reset(1)
            cable.bits, cable.counts = bits, counts
            await self.bench.clocks(1)
            if cable.got[-1][0] or cable.got[-1][5]:
                raise FaultError("active or locked behind a reset")


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(bits=0, reset=1)
        await bench.clocks(6)
        bench.add(Cable(bench.dut))
    await bench.reset(rng.choice([1, 1, 5]))
    hunt = Hunt(bench, rng)
    await hunt.check("start")
    kinds = ["slip", "wrong bits", "pulled out", "garbage", "another mode", "reset"]
    for _ in range(rng.randint(1, 3)):
        kind = rng.choice(kinds)
        await hunt.disturb(kind)
        await hunt.check(kind)
