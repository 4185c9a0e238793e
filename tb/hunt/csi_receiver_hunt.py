# SPDX-License-Identifier: Apache-2.0
"""Hunt of `csi_receiver`: lanes in any skew, packets damaged, lost, doubled, cut; stalls."""

import random
from collections import Counter, deque
from itertools import chain
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge

from hunt.references.csi import KINDS, Receiver, packed, packet
from hunt.streams import Beat, FaultError, Sink, stalls

ENTITY = "csi_receiver"
FAULTS = [
    ("lane_merge.vhd", "place   := place + taps_now(i);", "place   := place;"),
    ("header_ecc.vhd", "corrected <= '1';", "corrected <= '0';"),
    ("payload_crc.vhd", "if restart = '1' then", "if false then"),
    ("word_sender.vhd", "write_word.ends <= held_ends or nearly_full;",
     "write_word.ends <= held_ends;", 120),
    ("pixel_stream.vhd", "word_valid and word.has_pixels and (running or word.first);",
     "word_valid and word.has_pixels;"),
]  # fmt: skip
# Pointers between the clocks have no reset, so random start values would be invalid.
KEEP = ("crossing_fifo.vhd", "word_sender.vhd", "raw_unpacker.vhd", "packet_parser.vhd")
NAMES = ("corrected", "damaged", "payload", "cut", "lanes", "order", "size", "lost")
LEFT = ("type", "channel", "no lines", "no pixels")
UNITS = {8: 1, 10: 4, 12: 2}
CLOCK_PS = 10_000
COUNT_BITS = 8


def draw(rng: random.Random) -> dict[str, Any]:
    generics = {
        "LANES": rng.choice([1, 2, 4]),
        "PIXEL_BITS": rng.choice([8, 10, 12]),
        "PIXELS_PER_CLOCK": rng.choice([1, 2, 4, 8]),
        "MAX_SKEW": rng.choice([0, 1, 2, 3, 7]),
        "BUFFER_BITS": rng.choice([4, 4, 5, 7]),
        "COUNT_BITS": COUNT_BITS,
    }
    # Not faster than pixels can leave.
    pixels = 8 * generics["LANES"] / generics["PIXEL_BITS"] / generics["PIXELS_PER_CLOCK"]
    period = CLOCK_PS * max(0.4, 1.4 * pixels) * rng.uniform(1, 3)
    return {"generics": generics, "period": 2 * int(period / 2)}


class Lanes:
    """The lanes' clock, and in each clock masks of valid and sync, and bytes."""

    def __init__(self, dut: Any, period: int) -> None:
        self.dut = dut
        self.queue: deque[tuple[int, int, int] | int] = deque()
        self.passed = 0
        Clock(dut.byte_clk, period, "ps").start()
        cocotb.start_soon(self.run())

    async def run(self) -> None:
        ports = (self.dut.lane_valid, self.dut.lane_sync, self.dut.lane_data)
        shown: tuple[int, int, int] | None = None
        while True:
            await RisingEdge(self.dut.byte_clk)
            now = (0, 0, 0)
            # A number marks the end of a burst.
            while self.queue and isinstance(self.queue[0], int):
                self.passed = self.queue.popleft()  # type: ignore[assignment]
            if self.queue:
                now = self.queue.popleft()  # type: ignore[assignment]
            if now != shown:
                for port, value in zip(ports, now, strict=True):
                    port.value = value
                shown = now


class Hunt:
    """Frames as packets, their damage, and the skews of lanes."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        generics = bench.design["generics"]
        self.bench, self.rng = bench, rng
        self.lanes, self.bits = generics["LANES"], generics["PIXEL_BITS"]
        self.skew, self.pixels = generics["MAX_SKEW"], generics["PIXELS_PER_CLOCK"]
        self.channel = rng.randrange(4)
        self.columns = UNITS[self.bits] * rng.randint(1, 24 // UNITS[self.bits])
        self.rows = rng.randint(1, 5)
        self.model = Receiver(self.lanes, self.bits, self.channel, self.columns, self.rows)

    def line(self, columns: int) -> list[int]:
        pixels = [self.rng.getrandbits(self.bits) for _ in range(columns)]
        payload = packed(pixels, self.bits)
        return packet(self.channel, KINDS[self.bits], len(payload), payload)

    def noise(self) -> list[int]:
        """A packet that does not belong to the frame."""
        rng = self.rng
        if rng.random() < 0.4:
            return packet(self.channel, rng.randint(2, 15), rng.getrandbits(16))
        payload = [rng.getrandbits(8) for _ in range(rng.randint(0, 9))]
        kind = rng.choice([k for k in range(16, 64) if k != KINDS[self.bits]])
        channel = self.channel
        if rng.random() < 0.4:
            kind = rng.choice([kind, 0, 1, KINDS[self.bits]])
            channel = (channel + rng.randint(1, 3)) % 4
        return packet(channel, kind, len(payload), None if kind < 16 else payload)

    def frame(self, noise: float) -> list[list[int]]:
        rng, found = self.rng, []
        number = rng.getrandbits(16)
        found.append(packet(self.channel, 0, number))
        for _ in range(self.rows):
            found.append(self.line(self.columns))
        found.append(packet(self.channel, 1, number))
        return [p for q in found for p in ([self.noise(), q] if rng.random() < noise else [q])]

    def damage(self, packets: list[list[int]]) -> list[tuple[list[int], str]]:
        """Damage some packets; result: each with the damage of its burst."""
        rng, found = self.rng, []
        share = rng.choice([0.1, 0.3])
        for data in packets:
            kind = ""
            if rng.random() < share:
                kind = rng.choice(
                    [
                        *("bit", "header bit", "two header bits", "burst", "lost", "doubled"),
                        *("cut", "lane", "late", "length", "random"),
                    ]
                )
                self.bench.counts[f"packets: {kind}"] += 1
            data = list(data)
            if kind == "bit":
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
            elif "header" in kind:
                for bit in rng.sample(range(32), 1 + ("two" in kind)):
                    data[bit // 8] ^= 1 << bit % 8
            elif kind == "burst":
                at, length = rng.randrange(8 * len(data)), rng.randint(2, 20)
                for bit in range(at, min(at + length, 8 * len(data))):
                    data[bit // 8] ^= rng.randrange(2) << bit % 8
            elif kind == "lost":
                continue
            elif kind == "doubled":
                found.append((list(data), ""))
            elif kind == "length":
                data = self.line(UNITS[self.bits] * rng.randint(0, 24 // UNITS[self.bits]))
            elif kind == "random":
                payload = [rng.getrandbits(8) for _ in range(rng.randint(0, 40))]
                data = packet(self.channel, KINDS[self.bits], len(payload), payload)
            found.append((data, kind))
        return found

    def others(self) -> list[list[int]]:
        """Frames that another setting of the sensor sends: none of their lines is shown."""
        rng = self.rng
        kind = rng.choice(["type", "channel", "no lines", "no frames"])
        self.bench.counts[f"frames: {kind}"] += 1
        channel, sent = self.channel, KINDS[self.bits]
        if kind == "channel":
            channel = (channel + rng.randint(1, 3)) % 4
        elif kind == "type":
            sent = rng.choice([k for k in range(0x18, 0x40) if k != sent])
        lines = [] if kind == "no lines" else range(self.rows)
        payload = [rng.getrandbits(8) for _ in range(rng.randint(1, 40))]
        body = [packet(channel, sent, len(payload), payload) for _ in lines]
        if kind == "no frames":
            return body
        return [packet(channel, 0, 1), *body, packet(channel, 1, 1)]

    def send(self, lanes: Lanes, bursts: list[tuple[list[int], str]]) -> None:
        """Send bursts to the lanes and to the model."""
        rng, count = self.rng, self.lanes
        for number, (data, kind) in enumerate(bursts, 1):
            skews = [rng.randint(0, self.skew) for _ in range(count)]
            trail = [rng.getrandbits(8) for _ in range(count * rng.randint(0, 4))]
            if kind == "cut":
                data, trail = data[: rng.randint(count, max(count, len(data) - 1))], []
            missing = -1
            if kind == "lane":
                missing = rng.randrange(count)
            elif kind == "late" and count > 1:
                missing = rng.randrange(count)
                others = [s for n, s in enumerate(skews) if n != missing]
                skews[missing] = min(others) + self.skew + rng.randint(1, 3)
            faulty = count > 1 and (missing >= 0 or max(skews) - min(skews) > self.skew)
            # A D-PHY's trail; each lane ends when its own is over.
            fill = [] if kind == "cut" else [rng.getrandbits(8)] * (-len(data) % count)
            data_sent = [*data, *fill, *trail]
            clocks = max(skews) + -(-len(data_sent) // count)
            rows = [[0, 0, rng.getrandbits(8 * count)] for _ in range(clocks)]
            syncs = 0
            for lane in range(count):
                for n, byte in enumerate(data_sent[lane::count]):
                    row = rows[skews[lane] + n]
                    row[0] |= 1 << lane
                    if n == 0 and (lane != missing or kind == "late"):
                        row[1] |= 1 << lane
                        syncs += 1
                    row[2] = row[2] & ~(255 << 8 * lane) | byte << 8 * lane
            if syncs == count and not faulty:
                self.model.burst(data_sent)
            else:
                self.model.told["lanes"] += syncs > 0
            # Each lane rests for a clock or more, and longer behind a burst that fails: then it
            # costs no other one.
            ends = [skew + len(data_sent[lane::count]) for lane, skew in enumerate(skews)]
            rest = max(ends) + 1 + (rng.randint(16, 20) + self.skew if faulty else self.gap())
            rows += [[0, 0, rng.getrandbits(8 * count)] for _ in range(rest - len(rows))]
            lanes.queue.extend((r[0], r[1], r[2]) for r in rows)
            lanes.queue.append(number)

    def gap(self) -> int:
        """Clocks of rest on all lanes beyond the one that each needs."""
        return self.rng.choice([0, 0, 1, self.rng.randint(0, 20)])

    def beats(self, frames: list[list[list[int]]]) -> list[tuple[Beat, int]]:
        """Beats of frames, each with a mask of the bits to compare."""
        found = []
        for lines in frames:
            for y, line in enumerate(lines):
                for x in range(0, len(line), self.pixels):
                    part = line[x : x + self.pixels]
                    data = sum(p << self.bits * n for n, p in enumerate(part))
                    beat = Beat(data, x == y == 0, x + self.pixels >= len(line))
                    found.append((beat, (1 << self.bits * len(part)) - 1))
        return found

    async def settle(self, lanes: Lanes) -> None:
        bench = self.bench
        await bench.until(lambda: not lanes.queue, 200_000, "bursts pass")
        await bench.clocks(60 * bench.design["period"] // CLOCK_PS + 60)

    def told(self) -> Counter[str]:
        value = self.bench.number("fault_counts")
        value |= self.bench.number("left_counts") << COUNT_BITS * len(NAMES)
        return +Counter(
            {n: value >> COUNT_BITS * i & (1 << COUNT_BITS) - 1 for i, n in enumerate(NAMES + LEFT)}
        )


def same(got: list[Beat], want: list[tuple[Beat, int]]) -> str:
    """The first difference; empty if there is none."""
    for n, (one, (other, mask)) in enumerate(zip(got, want, strict=False)):
        if (one.data & mask, one.start, one.last) != (other.data, other.start, other.last):
            return f"beat {n}: got {one}, want {other}"
    return "" if len(got) == len(want) else f"{len(got)} beats came, {len(want)} were expected"


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(lane_valid=0, lane_sync=0, lane_data=0, lane_missed=0, fault_clear=0)
        bench.add(Sink(bench.dut, "m_axis"))
        bench.lanes = Lanes(bench.dut, bench.design["period"])
        # Effects of start values in the lanes' clock, which has no reset, are over.
        await bench.clocks(100)
    sink, lanes = bench.ports[0], bench.lanes
    hunt = Hunt(bench, rng)
    bench.set(virtual_channel=hunt.channel, columns=hunt.columns, rows=hunt.rows)
    sink.stalls = iter(())
    # An extra frame end, so that no frame is open.
    lanes.queue.append(0)
    hunt.send(lanes, [(packet(hunt.channel, 1, 0), "")])
    await hunt.settle(lanes)
    await bench.reset(rng.choice([1, 1, 4]))
    bench.set(fault_clear=1)
    await bench.clocks(2)
    bench.set(fault_clear=0)
    hunt.model.told.clear()
    hunt.model.identifier = 0
    kind = rng.choice(["clean", "damaged", "damaged", "damaged", "reset", "stalls"])
    bench.counts[f"stream: {kind}"] += 1
    packets = [p for _ in range(rng.randint(1, 4)) for p in hunt.frame(rng.choice([0, 0.3]))]
    for _ in range(rng.choice([0, 0, 1, 3])):
        packets += hunt.others()
    bursts = hunt.damage(packets) if kind == "damaged" else [(p, "") for p in packets]
    model = hunt.model
    if kind in ("clean", "damaged"):
        # Whatever came before, the last two frames are whole; the first may end an open one.
        bursts += [(p, "") for _ in range(2) for p in hunt.frame(0)]
        hunt.send(lanes, bursts)
        await hunt.settle(lanes)
        fault = same(sink.received, hunt.beats(model.frames))
        if not fault and hunt.told() != +model.told:
            fault = f"told {dict(hunt.told())}, expected {dict(+model.told)}"
        if not fault and bench.number("left_identifier") != model.identifier:
            fault = f"left_identifier is {bench.number('left_identifier')}, not {model.identifier}"
        if not fault and [len(line) for line in model.frames[-1]] != [hunt.columns] * hunt.rows:
            fault = "the last frame is not whole"
        if fault:
            raise FaultError(f"{kind}: {fault}")
    elif kind == "reset":
        starts = [n for n, p in enumerate(packets, 1) if p[0] == hunt.channel << 6]
        hunt.send(lanes, bursts)
        at = rng.randint(0, len(packets) - 1)
        await bench.until(lambda: lanes.passed >= at, 200_000, "bursts pass")
        await bench.clocks(rng.randint(0, 30))
        await bench.reset(rng.choice([1, 3]))
        first = lanes.passed
        await hunt.settle(lanes)
        # Frames that start later are whole; one under way may be, if none of it had come.
        last = sum(start <= first + 1 for start in starts)
        wants = [hunt.beats(model.frames[n:]) for n in range(last + 1)]
        if all(same(sink.received, want) for want in wants):
            raise FaultError(f"reset: {same(sink.received, wants[-1])}")
    else:
        held = rng.choice([0, 0, 200, 800])
        sink.stalls = chain([True] * rng.randint(0, held), stalls(rng))
        hunt.send(lanes, bursts)
        await hunt.settle(lanes)
        sink.stalls = iter(())
        await bench.clocks(1500)
        hunt.send(lanes, [(p, "") for p in hunt.frame(0)])
        await hunt.settle(lanes)
        check_stalled(hunt, sink.received)


def check_stalled(hunt: Hunt, got: list[Beat]) -> None:
    """Check that frames are whole or cut, missing beats are reported, and the last one is whole."""
    found: list[list[list[Beat]]] = []
    for beat in got:
        if beat.start:
            found.append([[]])
        found[-1][-1].append(beat)
        if beat.last:
            found[-1].append([])
    wants = [hunt.beats([frame]) for frame in hunt.model.frames]
    if found and found[-1][-1]:
        raise FaultError("stalls: the last line has no end")
    place = 0
    whole = 0
    for frame in found:
        beats = [beat for line in frame for beat in line]
        while place < len(wants) and not prefix(beats, wants[place]):
            place += 1
        if place == len(wants):
            raise FaultError("stalls: a frame that was not sent")
        whole += len(beats) == len(wants[place]) and not same(beats, wants[place])
        place += 1
    if same([b for line in found[-1] for b in line], wants[-1]):
        raise FaultError("stalls: the last frame is not whole")
    told = hunt.told()
    if (whole < len(wants)) != bool(told["lost"]):
        raise FaultError(f"stalls: {len(wants) - whole} frames are not whole, told {dict(told)}")


def prefix(beats: list[Beat], want: list[tuple[Beat, int]]) -> bool:
    """Whether beats are the first ones of a frame; the last one may have become a line's end."""
    for n, beat in enumerate(beats):
        if n >= len(want):
            return False
        other, mask = want[n]
        ends = other.last or n == len(beats) - 1
        if (beat.data & mask, beat.start, beat.last) != (other.data, other.start, ends):
            return False
    return True
