# SPDX-License-Identifier: Apache-2.0
"""Hunt of `sensor_setup`: sensors that reset themselves, are busy, stretch, or are not there."""

import random
from typing import Any

from hunt.references.sensor import Sensor
from hunt.streams import FaultError

ENTITY = "sensor_setup"
FAULTS = [
    ("sensor_setup.vhd", "(now(BEFORE_PAUSE) = '0' or bytes < 3)", "bytes < 9"),
    ("sensor_setup.vhd", "(bytes = 3 and now(WIDE) = '0')", "bytes = 3"),
]  # fmt: skip
# Random start values of these counters could overflow in simulation.
KEEP = ("i2c_lines.vhd", "i2c_master.vhd", "sensor_setup.vhd")
NONE, LINE_LOW, REFUSED = range(3)
PAUSE = 0xFFFF


def draw(rng: random.Random) -> dict[str, Any]:
    entries = []
    for number in range(rng.randint(1, 6)):
        if rng.random() < 0.3:
            entries.append((PAUSE, rng.randint(0, 4), 1))
        else:
            size = rng.choice([1, 2])
            # Addresses are different, so that each names its entry.
            entries.append((number << 8 | rng.getrandbits(8), rng.getrandbits(8 * size), size))
    text = " ".join(f"{address:04x}{value:0{2 * size}x}" for address, value, size in entries)
    generics = {
        **{"REGISTERS": text, "QUARTER": rng.choice([5, 6, 9]), "STRETCH": 200},
        **{"MILLISECOND": rng.choice([7, 40]), "RETRIES": rng.randint(0, 4)},
        **{"RETRY_PAUSE": rng.randint(0, 5)},
    }
    return {"generics": generics, "entries": entries}


class Bus:
    """The lines, with a sensor that changes its data with the clock's fall or some clocks later."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(0)
        self.sensor = Sensor()
        self.restart()

    def restart(self) -> None:
        self.stretch = self.hold = 0
        self.stuck = {"scl": False, "sda": False}
        self.shown = self.wait = 0

    def step(self, clock: int) -> None:
        del clock
        dut, sensor = self.dut, self.sensor
        texts = [str(port.value) for port in (dut.scl_low, dut.sda_low)]
        if "".join(texts).strip("01"):
            raise FaultError(f"scl_low, sda_low are {texts}")
        scl_low, sda_low = map(int, texts)
        sensor.clock()
        self.hold -= self.hold > 0
        # The sensor's level comes up to some clocks behind the clock's fall, also with its rise.
        if self.shown != sensor.low:
            self.wait -= 1
            if self.wait <= 0 or scl_low == 0:
                self.shown = int(sensor.low)
        else:
            self.wait = self.rng.randint(0, 3)
        scl = int(not (scl_low or self.hold or self.stuck["scl"]))
        sda = int(not (sda_low or self.shown or self.stuck["sda"]))
        before = sensor.lines
        sensor.follow(scl, sda)
        if before[0] and not scl and self.stretch and self.rng.random() < 0.2:
            self.hold = self.rng.randint(1, self.stretch)
        dut.scl.value, dut.sda.value = scl, sda


class Hunt:
    """Set-ups and their expected ends."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng, self.bus = bench, rng, bench.ports[0]
        self.g, self.entries = bench.design["generics"], bench.design["entries"]
        self.registers = [e for e in self.entries if e[0] != PAUSE]
        self.wanted = [(a, v.to_bytes(size)) for a, v, size in self.registers]
        self.bit = 4 * self.g["QUARTER"] + 8

    async def run(self) -> tuple[int, int]:
        """Set up once: done and fault."""
        bench, g = self.bench, self.g
        bench.set(start=1)
        await bench.clocks()
        bench.set(start=0)
        await bench.clocks(2)
        transfer = 70 * (self.bit + self.bus.stretch) + 8 * g["MILLISECOND"] + 3 * g["STRETCH"]
        limit = transfer * (len(self.entries) + 1) * (g["RETRIES"] + 1)
        await bench.until(lambda: bench.number("busy") == 0, limit, "no end of a set-up")
        await bench.clocks(20)
        if bench.number("scl_low") or bench.number("sda_low"):
            raise FaultError("a line is not let go")
        return bench.number("done"), bench.number("fault")

    def expect(self, told: tuple[int, int], want: tuple[int, int]) -> None:
        if told != want:
            raise FaultError(f"done and fault are {told}, want {want}")

    async def act(self, kind: str) -> None:
        rng, bus, sensor = self.rng, self.bus, self.bus.sensor
        self.bench.counts[f"set-ups: {kind}"] += 1
        sensor.written.clear()
        sensor.resets.clear()
        bus.stretch = rng.choice([0, 0, 3, 150])
        if kind == "good":
            self.expect(await self.run(), (1, NONE))
        elif kind == "starting" and self.g["RETRIES"]:
            # Shorter than the first pause behind a transfer that fails.
            sensor.busy = 15 * self.bit
            told = await self.run()
            if told not in ((1, NONE), (1, REFUSED)):
                raise FaultError(f"done and fault are {told} with a sensor that starts")
        elif kind == "resets":
            before = [
                one for one, other in zip(self.entries, self.entries[1:], strict=False)
                if other[0] == PAUSE and one[0] != PAUSE
            ]  # fmt: skip
            sensor.resets = {a: (size == 1 or rng.random() < 0.5, 0) for a, _, size in before}
            self.expect(await self.run(), (1, NONE))
            written = [
                (a, value[: 1 if a in sensor.resets and sensor.resets[a][0] else None])
                for a, value in self.wanted
            ]
            if sensor.written != written:
                raise FaultError(f"written {sensor.written}, want {written}")
            return
        elif kind == "absent" and self.registers:
            sensor.busy = 1 << 40
            self.expect(await self.run(), (0, REFUSED))
            sensor.busy = 0
            if int(self.bench.number("retried")) != self.g["RETRIES"]:
                raise FaultError("transfers are not repeated")
            return
        elif kind == "line low":
            name = rng.choice(["scl", "sda"])
            bus.stuck[name] = True
            self.expect(await self.run(), (0, LINE_LOW))
            bus.stuck[name] = False
            return
        else:
            return
        if sensor.written != self.wanted:
            raise FaultError(f"written {sensor.written}, want {self.wanted}")


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(scl=1, sda=1, start=0)
        await bench.clocks(2)
        bench.add(Bus(bench.dut))
    bus = bench.ports[0]
    bus.rng, bus.sensor = rng, Sensor()
    await bench.reset(rng.choice([1, 3]))
    await bench.clocks(8)
    hunt = Hunt(bench, rng)
    for kind in rng.sample(["good", "starting", "resets", "absent", "line low"], 2):
        await hunt.act(kind)
    await hunt.act("good")
    if rng.random() < 0.5:
        # Within a set-up.
        bench.set(start=1)
        await bench.clocks()
        bench.set(start=0)
        await bench.clocks(rng.randint(1, 60 * hunt.bit))
