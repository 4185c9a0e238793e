# SPDX-License-Identifier: Apache-2.0
"""Hunt of `i2c_reader`: devices that stretch, refuse, fall silent or hold lines; noise, resets."""

import random
from typing import Any

from hunt.references.i2c import DEVICE, Device
from hunt.streams import FaultError

ENTITY = "i2c_reader"
FAULTS = [
    ("i2c_reader.vhd", "not (result.disturbed or result.bits(0))", "not result.disturbed"),
    ("i2c_master.vhd", "x\"FF\" & not order.more;", "x\"FF\" & '0';"),
]  # fmt: skip

# Random start values of these counters could overflow in simulation.
KEEP = ("i2c_lines.vhd", "i2c_master.vhd")


def draw(rng: random.Random) -> dict[str, Any]:
    quarter = rng.choice([4, 4, 5, 8])
    return {"generics": {"QUARTER": quarter, "STRETCH": rng.choice([60, 200, 500])}}


class Bus:
    """The lines, the device, and the consumer of bytes; checks the rules of I2C."""

    def __init__(self, dut: Any, quarter: int) -> None:
        self.dut, self.quarter = dut, quarter
        self.rng = random.Random(0)
        self.device = Device(None)
        # The current clock, and the one in which a read ended.
        self.clock = self.over = 0
        self.restart()

    def restart(self) -> None:
        self.got: list[int] = []
        # Bytes to read; clocks until the next one may be read.
        self.wanted = self.pause = 0
        self.ended: tuple[int, int] | None = None
        self.stretch = self.hold = 0
        self.stuck = {"scl": False, "sda": False}
        self.noise = 0.0
        self.master = (0, 0)
        self.since = {"scl": 99, "sda": 99}
        self.clean = True

    def step(self, clock: int) -> None:
        dut = self.dut
        names = ("scl_low", "sda_low", "valid", "done")
        texts = [str(getattr(dut, name).value) for name in names]
        if "".join(texts).strip("01"):
            raise FaultError(f"{names} are {texts}")
        scl_low, sda_low, valid, done = map(int, texts)
        self._rules(scl_low, sda_low)
        if self.ended is not None and (valid or done):
            raise FaultError("something is told behind the end")
        if valid:
            self.got.append(int(str(dut.data.value), 2))
            self.pause = self.rng.choice([0, 0, 3, 60])
        self.clock = clock
        if done:
            self.ended, self.over = (int(dut.complete.value), int(dut.stuck.value)), clock
        self.pause -= self.pause > 0
        dut.next_byte.value = int(self.pause == 0)
        dut.more.value = int(len(self.got) + 1 < self.wanted)
        self._lines(scl_low, sda_low)

    def _rules(self, scl_low: int, sda_low: int) -> None:
        """Check that data change a quarter of a bit from clock edges, half a bit apart."""
        for name, now, before in (
            ("scl", scl_low, self.master[0]),
            ("sda", sda_low, self.master[1]),
        ):
            self.since[name] += 1
            if now == before:
                continue
            other = "sda" if name == "scl" else "scl"
            # Released at the end of a read.
            free = self.clean and not (now == 0 and name == "sda" and not scl_low)
            if free and self.since[other] < self.quarter - 1 and self.ended is None:
                raise FaultError(f"{name} changes {self.since[other]} clocks behind {other}")
            self.since[name] = 0
        self.master = (scl_low, sda_low)

    def _lines(self, scl_low: int, sda_low: int) -> None:
        if self.hold:
            self.hold -= 1
        scl = int(not (scl_low or self.hold or self.stuck["scl"]))
        sda = int(not (sda_low or self.device.low or self.stuck["sda"]))
        before = self.device.lines
        self.device.follow(scl, sda)
        if before[0] and not scl and self.stretch and self.rng.random() < 0.2:
            self.hold = self.rng.randint(1, self.stretch)
        # The device's level in the same clock.
        sda = int(not (sda_low or self.device.low or self.stuck["sda"]))
        self.device.lines = (scl, sda)
        if self.rng.random() < self.noise:
            scl ^= self.rng.randrange(2)
            sda ^= self.rng.randrange(2)
        self.dut.scl.value, self.dut.sda.value = scl, sda


class Hunt:
    """Reads and their expected ends."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng, self.bus = bench, rng, bench.ports[0]
        g = bench.design["generics"]
        self.quarter, self.stretch = g["QUARTER"], g["STRETCH"]

    async def begin(self, count: int, content: list[int] | None) -> None:
        bus, rng = self.bus, self.rng
        now = bus.device
        bus.device = Device(content)
        # A device continues what it was doing.
        bus.device.__dict__.update({**now.__dict__, "content": content, "log": [], "refuse": -1})
        bus.got, bus.ended, bus.wanted = [], None, count
        bus.pause = rng.choice([0, 0, 100])
        bus.clean = True
        # Lines released because one was low are not checked in the next clock.
        bus.since = {"scl": 99, "sda": 99}
        self.bench.set(start=1)
        await self.bench.clocks(1)
        self.bench.set(start=0)

    async def end(self) -> tuple[int, int]:
        """Results `complete` and `stuck`; checks that both lines are free and stay so."""
        bus = self.bus
        bits = 9 * (bus.wanted + 6) + 12
        limit = bits * (4 * self.quarter + 4 + bus.stretch) + 110 * bus.wanted + 4 * self.stretch
        await self.bench.until(lambda: bus.ended is not None, limit + 500, "no end of a read")
        await self.bench.clocks(self.rng.choice([1, 4 * self.quarter]))
        if bus.master != (0, 0):
            raise FaultError("a line is not let go")
        return bus.ended

    async def good(self) -> None:
        """All bytes come, with the transfers of I2C."""
        rng, bus = self.rng, self.bus
        count = rng.choice([1, 2, rng.randint(1, 9)])
        content = [
            rng.choice([0, 255, rng.randrange(256)]) for _ in range(count + rng.randrange(3))
        ]
        bus.stretch = rng.choice([0, 0, self.stretch - 20])
        await self.begin(count, content)
        if await self.end() != (1, 0) or bus.got != content[:count]:
            raise FaultError(
                f"got {bus.got}, complete and stuck {bus.ended}, want {content[:count]}"
            )
        log = bus.device.log
        starts = [n for n, entry in enumerate(log) if entry[0] == "start"]
        sent = [("sent", byte, int(n < count - 1)) for n, byte in enumerate(content[:count])]
        want = [
            ("start", 0, 0),
            *(("taken", DEVICE << 1, 1), ("taken", 0, 1), ("start", 0, 0)),
            *(("taken", DEVICE << 1 | 1, 1), *sent, ("stop", 0, 0)),
        ]
        if log[starts[-2] :] != want:
            raise FaultError(f"on the lines was {log}, want {want}")

    async def act(self, kind: str) -> None:
        rng, bus, bench = self.rng, self.bus, self.bench
        bench.counts[f"reads: {kind}"] += 1
        content = [rng.randrange(256) for _ in range(8)]
        bus.stretch = 0
        if kind == "good":
            await self.good()
        elif kind == "absent":
            await self.begin(4, None)
            self.expect(await self.end(), (0, 0), [])
        elif kind == "refused":
            await self.begin(4, content)
            bus.device.refuse = rng.randrange(3)
            self.expect(await self.end(), (0, 0), [])
        elif kind in ("clock line low", "data line low"):
            name = "scl" if kind.startswith("clock") else "sda"
            late = rng.random() < 0.6
            bus.stuck[name] = not late
            await self.begin(4, content)
            await bench.clocks(rng.randint(1, 100 * 4 * self.quarter) if late else 1)
            was_over, bus.stuck[name], since = bus.ended is not None, True, bus.clock
            ended = await self.end()
            # If the stop cannot be sent, all bytes may have come; a clock line that was high for
            # the stop and falls again is no fault any more.
            stopped = ended == (1, 0) and bus.over - since < 2 * self.quarter + 8
            if not (was_over or stopped) and (name == "scl" or not late) and not ended[1]:
                raise FaultError(f"a line that stays low ends a read with {ended}")
            bus.stuck[name] = False
        elif kind == "in the middle":
            # A device whose master stopped in the middle of a byte.
            bus.device.content = content
            bus.device.sends(rng.choice([0, 0, rng.randrange(256)]))
            await bench.clocks(8)
            await self.good()
        elif kind == "noise":
            await self.begin(rng.randint(1, 5), content)
            bus.clean = False
            bus.noise = rng.choice([0.002, 0.05, 1])
            await self.end()
            bus.noise = 0
        elif kind == "reset":
            await self.begin(5, content)
            await bench.clocks(rng.randint(1, 100 * 4 * self.quarter))
            device = bus.device
            await bench.reset(1)
            bus.device = device
            bus.clean = False
            await bench.clocks(2)
            if bus.master != (0, 0):
                raise FaultError("a line is not let go by a reset")
            await bench.clocks(rng.randint(1, 60))
            if bus.ended is not None:
                raise FaultError("a read that a reset ended is told")

    def expect(self, ended: tuple[int, int], want: tuple[int, int], got: list[int]) -> None:
        if ended != want or self.bus.got != got:
            raise FaultError(f"got {self.bus.got}, complete and stuck {ended}, want {got}, {want}")


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(scl=1, sda=1, start=0, next_byte=0, more=0)
        await bench.clocks(2)
        bench.add(Bus(bench.dut, bench.design["generics"]["QUARTER"]))
    bus = bench.ports[0]
    bus.rng, bus.device = rng, Device(None)
    await bench.reset(rng.choice([1, 1, 3]))
    await bench.clocks(4)
    hunt = Hunt(bench, rng)
    kinds = ["good", "absent", "refused", "clock line low", "data line low", "in the middle"]
    for _ in range(rng.randint(2, 5)):
        await hunt.act(rng.choice([*kinds, "noise", "reset"]))
    await hunt.act("good")
