# SPDX-License-Identifier: Apache-2.0
"""Hunt of `i2c_rom_slave`: data that change with the clock, glitches, noise, lost masters."""

import random
from typing import Any

from hunt.references.i2c import DEVICE, edid_faults
from hunt.streams import FaultError
from plenofir_tb.i2c import I2cMaster

ENTITY = "i2c_rom_slave"
FAULTS = [
    ("i2c_lines.vhd", "scl_count = SPIKE - 1", "scl_count >= 0"),
    ("i2c_rom_slave.vhd", "      HOLD  => HOLD\n", "      HOLD  => 0\n"),
    ("i2c_rom_slave.vhd", "waited = HOLD - 1 then", "waited >= HOLD - 2 then"),
    ("i2c_rom_slave.vhd", "if refused = '1' then", "if false then"),
]  # fmt: skip
# The shortest lines of an offered mode: with any pixel clock, and with those of a range.
LEAST_COLUMNS = (640, 1280)
# Random start values of these counters could overflow in simulation.
KEEP = ("i2c_rom_slave.vhd", "i2c_lines.vhd")


def draw(rng: random.Random) -> dict[str, Any]:
    generics = {
        "FILTER": rng.choice([1, 2, 3, 4]),
        "HOLD": rng.choice([3, 6, 12]),
        "MAX_COLUMNS": rng.choice([64, 640, 800, 1279, 1280, 4000]),
        "CLOCK_RANGE": rng.randrange(5),
    }
    return {"generics": generics}


class Lines:
    """Two open-drain lines with glitches of less than FILTER clocks.

    The slave may change the data line only while the clock line is low, or after a start or stop.
    """

    def __init__(self, dut: Any, filter_: int, hold: int) -> None:
        self.dut, self.filter, self.hold = dut, filter_, hold
        self.rng: random.Random | None = None
        self.scl = self.sda = 1
        self.shown: dict[str, int] = {}
        self.restart()

    def restart(self) -> None:
        self.slave = self.reads = 0
        self.glitch = {"scl": 0, "sda": 0}
        self.pause = 0
        self.high_for = self.low_for = self.still_for = 0
        # Clocks from falls of the clock line to changes of the data line by the slave.
        self.delays: set[int] = set()
        self.before = (1, 1)

    @property
    def line(self) -> int:
        return int(self.sda and not self.slave)

    def step(self, clock: int) -> None:
        texts = [str(p.value) for p in (self.dut.sda_low, self.dut.read_byte)]
        if "".join(texts).strip("01"):
            raise FaultError(f"sda_low, read_byte are {texts}")
        slave = int(texts[0])
        self.reads += int(texts[1])
        self.high_for = self.high_for + 1 if self.scl else 0
        self.low_for = 0 if self.scl else self.low_for + 1
        self.still_for = 0 if self.sda != self.before[1] else self.still_for + 1
        self.before = (self.scl, self.sda)
        late = 4 * self.filter + 2 * self.hold + 12
        if slave != self.slave and self.high_for > late and self.still_for > late:
            raise FaultError("the data line moves while the clock line is high")
        if slave != self.slave:
            self.delays.add(self.low_for)
        self.slave = slave
        levels = {"scl": self.scl, "sda": self.line}
        if self.rng is not None and self.filter > 1:
            self.pause -= 1
            if self.pause < 0 and self.rng.random() < 0.03:
                # A single sample between two glitches is enough, but each glitch may delay an edge.
                self.glitch[self.rng.choice(["scl", "sda"])] = self.rng.randrange(1, self.filter)
                self.pause = 4 * self.filter
        for name, level in levels.items():
            if self.glitch[name]:
                self.glitch[name] -= 1
                level = 1 - level
            if self.shown.get(name) != level:
                getattr(self.dut, name).value = self.shown[name] = level


class Master(I2cMaster):
    """A master with random, slow timing."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng, self.lines = bench, rng, bench.ports[0]
        self.quarter = 4 * self.lines.filter + 2 * self.lines.hold + rng.choice([7, 8, 11])
        # The data line changes with the falling clock line, up to the hold time before or behind
        # it (see `earliest`): UM10204 lets it, and edges of a long cable do it.
        self.at_once = rng.random() < 0.5

    async def wait(self) -> None:
        await self.bench.clocks(self.quarter * (1 if self.rng.random() < 0.97 else 3))

    async def clock(self, level: int) -> None:
        self.lines.scl = level
        await self.wait()

    async def data(self, level: int) -> None:
        self.lines.sda = level
        await self.wait()

    @property
    def earliest(self) -> int:
        """Clocks from the clock line's fall to the earliest change that is no start or stop.

        A glitch as the clock line falls makes the filter count anew, and takes of the hold time.
        """
        filter_, glitches = self.lines.filter, self.lines.rng is not None
        return 1 - self.lines.hold + (2 * (filter_ - 1) if glitches else 0)

    async def write(self, byte: int) -> bool:
        if not self.at_once or self.earliest > 0:
            return await super().write(byte)
        for i in range(7, -1, -1):
            await self.bit_at_once(byte >> i & 1, byte >> max(i - 1, 0) & 1 if i else 1)
        return not await self.bit(1)

    async def bit_at_once(self, level: int, following: int) -> None:
        """Send a bit, and the next one's level around the clock line's fall."""
        rng, lines = self.rng, self.lines
        await self.data(level)
        await self.clock(1)
        assert self.seen() == level, "the slave pulls the line while the master sends"
        skew = rng.randint(self.earliest, lines.hold - 1)
        first, second = (("sda", following), ("scl", 0))[:: 1 if skew < 0 else -1]
        setattr(lines, *first)
        await self.bench.clocks(abs(skew))
        setattr(lines, *second)
        await self.wait()

    def seen(self) -> int:
        return self.lines.line

    async def recover(self) -> None:
        """Nine clocks, as UM10204 3.1.16 has it, until the data line is high; a stop."""
        await self.clock(0)
        for _ in range(3):
            if all([await self.bit(1) for _ in range(9)]):
                break
        await self.data(1)
        if not self.lines.line:
            raise FaultError("27 clocks do not free the data line")
        await self.stop()


class Hunt:
    """Transfers and their expected bytes."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng = bench, rng
        self.master = Master(bench, rng)
        self.memory: list[int] = bench.design.setdefault("memory", [])
        # The address at which a read continues, if known.
        self.pointer: int | None = 0

    def byte(self, address: int) -> int:
        return self.memory[address % 128]

    async def check(self, *acks: bool) -> None:
        if not all(acks):
            raise FaultError("not acknowledged")

    async def block(self, address: int, count: int) -> list[int]:
        m = self.master
        await m.start()
        await self.check(await m.write(DEVICE << 1), await m.write(address))
        if self.rng.random() < 0.3:
            await m.stop()
        self.pointer = address
        return await self.from_here(count)

    async def from_here(self, count: int) -> list[int]:
        m = self.master
        before = m.lines.reads
        await m.start()
        await self.check(await m.write(DEVICE << 1 | 1))
        got = [await m.read(more=n < count - 1) for n in range(count)]
        if self.rng.random() < 0.8:
            await m.stop()
        if m.lines.reads - before != count:
            raise FaultError(f"{m.lines.reads - before} bytes were told, {count} were read")
        assert self.pointer is not None
        begin, self.pointer = self.pointer, (self.pointer + count) % 128
        want = [self.byte(begin + n) for n in range(count)] if self.memory else got
        if got != want:
            raise FaultError(f"from {begin}: got {got}, want {want}")
        return got

    async def act(self, kind: str) -> None:
        rng, m = self.rng, self.master
        self.bench.counts[f"transfers: {kind}"] += 1
        if kind == "read":
            await self.block(rng.choice([0, 120, 126, 254, rng.randrange(256)]), rng.randint(1, 6))
        elif kind == "go on" and self.pointer is not None:
            await self.from_here(rng.randint(1, 4))
        elif kind == "other device":
            other = rng.choice([b for b in range(256) if b >> 1 != DEVICE])
            await m.start()
            if await m.write(other) or await m.write(rng.randrange(256)):
                raise FaultError(f"{other:#04x} is acknowledged")
            await m.stop()
        elif kind == "write":
            address = rng.randrange(256)
            await m.start()
            await self.check(await m.write(DEVICE << 1), await m.write(address))
            if await m.write(rng.randrange(256)):
                raise FaultError("a byte to be written is acknowledged")
            await m.stop()
            self.pointer = address
        elif kind == "broken off":
            await self.broken_off()
        elif kind == "noise":
            self.pointer = None
            for _ in range(rng.randint(1, 80)):
                m.lines.scl, m.lines.sda = rng.randrange(2), rng.randrange(2)
                await self.bench.clocks(rng.choice([1, 2, m.quarter, rng.randint(1, 40)]))
            await m.recover()
        elif kind == "reset":
            await self.broken_off(vanish=False)
            await self.bench.reset(1)
            self.pointer = 0
            await self.bench.clocks(2)
            if m.lines.slave:
                raise FaultError("a reset leaves the data line low")
            if not all([await m.bit(1) for _ in range(rng.randint(1, 12))]):
                raise FaultError("the slave is not silent behind a reset")
            await m.stop()

    async def broken_off(self, *, vanish: bool = True) -> None:
        """A transfer that ends at any bit: the master disappears, starts again, or stops."""
        rng, m = self.rng, self.master
        self.pointer = None
        await m.start()
        byte = rng.choice([DEVICE << 1, DEVICE << 1 | 1, rng.randrange(256)])
        for i in range(rng.randint(0, 30)):
            await m.bit(byte >> (7 - i) & 1 if i < 8 else rng.choice([1, 1, 1, 0]))
        if not vanish:
            return
        m.lines.scl = rng.randrange(2)
        await self.bench.clocks(rng.randint(1, 4 * m.quarter))
        m.lines.sda = 1
        await m.clock(1)
        if not m.lines.line or rng.random() < 0.3:
            await m.recover()
        elif rng.random() < 0.5:
            await m.stop()
            if not m.lines.line:
                # The clock of the stop was the last of a byte, which the slave acknowledges.
                await m.recover()


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(scl=1, sda=1)
        await bench.clocks(2)
        generics = bench.design["generics"]
        bench.add(Lines(bench.dut, generics["FILTER"], generics["HOLD"]))
        # Start values of the filters are no start condition.
        await bench.reset(12)
    lines = bench.ports[0]
    lines.scl = lines.sda = 1
    lines.rng = None
    await bench.reset(rng.choice([1, 1, 3]))
    await bench.clocks(30)
    hunt = Hunt(bench, rng)
    await hunt.master.stop()
    if not hunt.memory:
        # Without glitches a quarter may be shorter.
        slow, hunt.master.quarter = hunt.master.quarter, lines.filter + 2 * lines.hold + 6
        lines.delays.clear()
        block = await hunt.block(0, 128)
        g = bench.design["generics"]
        # A clock more from here to the pins, and one back.
        lag = g["HOLD"] + 4 + (g["FILTER"] if g["FILTER"] > 1 else 0) + 2
        if lines.delays != {lag}:
            raise FaultError(f"the data line lags by {sorted(lines.delays)} clocks, not {lag}")
        hunt.master.quarter = slow
        hunt.memory += block
        most = max(LEAST_COLUMNS[g["CLOCK_RANGE"] > 0], g["MAX_COLUMNS"])
        faults = edid_faults(block, most)
        if faults:
            raise FaultError(f"no EDID: {', '.join(faults)}")
    lines.rng = rng if rng.random() < 0.6 else None
    bench.counts["streams with glitches"] += lines.rng is not None and lines.filter > 1
    kinds = ["read", "read", "go on", "other device", "write", "broken off", "noise", "reset"]
    for _ in range(rng.randint(3, 7)):
        await hunt.act(rng.choice(kinds))
    await hunt.block(rng.randrange(128), 2)
