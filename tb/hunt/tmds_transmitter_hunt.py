# SPDX-License-Identifier: Apache-2.0
"""Hunt of `tmds_transmitter`: any pattern of data enable, any phase of the sending clock."""

import random
from typing import Any

from cocotb.clock import Clock
from cocotb.triggers import Timer

from hunt.rasters import draw_mode, frames
from hunt.references.tmds import words
from hunt.streams import FaultError

ENTITY = "tmds_transmitter"
FAULTS = [
    ("tmds_encoder.vhd", "disparity <= disparity - excess + 1;",
     "disparity <= disparity - excess;"),
    ("tmds_encoder.vhd", "disparity > 0) = (excess > 0)", "disparity > 1) = (excess > 0)"),
]  # fmt: skip
CLOCK_WORD = 0b0000011111
SETTLED = 60


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {}, "phase": rng.choice([1, 2, 3, 4, 6, 7, 8, 9])}


class Sender:
    """Video in; words out, with the sending clock's phase."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.restart()

    def restart(self) -> None:
        self.queue: list[tuple[int, int, int, int]] = []
        self.got: list[str] = []

    def step(self, clock: int) -> None:
        self.got.append(str(self.dut.tx_words.value))
        if self.queue:
            now = self.queue.pop(0)
            for name, value in zip(("active", "h_sync", "v_sync", "pixel"), now, strict=True):
                getattr(self.dut, name).value = value


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(active=0, h_sync=0, v_sync=0, pixel=0, reset=1, tx_reset=1)
        await Timer(bench.design["phase"], "ns")
        Clock(bench.dut.tx_clk, 10, "ns").start()
        await bench.clocks(12)
        bench.add(Sender(bench.dut))
    sender = bench.ports[0]
    bench.set(tx_reset=1)
    await bench.reset(rng.choice([4, 9]))
    bench.set(tx_reset=0)
    sent = []
    kind = rng.choice(["raster", "random", "few ones"])
    bench.counts[f"video: {kind}"] += 1
    if kind == "raster":
        sent = frames(draw_mode(rng, (4, 30)), 2, rng)[:1500]
    else:
        active = 0
        for _ in range(1200):
            active ^= rng.random() < rng.choice([0.02, 0.4])
            pixel = rng.getrandbits(24) & (rng.getrandbits(24) if kind == "few ones" else -1)
            sent.append((active, rng.randrange(2), rng.randrange(2), pixel))
    sender.queue = [(0, 0, 0, 0)] * SETTLED + sent
    if rng.random() < 0.2:
        bench.counts["reset inside"] += 1
        await bench.clocks(rng.randint(1, 300))
        return
    await bench.clocks(len(sender.queue) + 60)
    want = []
    for row in words(sent):
        packed = CLOCK_WORD << 30 | row[2] << 20 | row[1] << 10 | row[0]
        want.append(f"{packed:040b}")
    for late in range(SETTLED, SETTLED + 50):
        if sender.got[late : late + len(want)] == want:
            return
    raise FaultError("no delay makes the words what DVI has for this video")
