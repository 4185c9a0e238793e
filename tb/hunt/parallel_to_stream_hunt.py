# SPDX-License-Identifier: Apache-2.0
"""Hunt of `parallel_to_stream`: cameras with any blanking, glitches, a stream that stalls."""

import random
from typing import Any

from hunt.references.parallel import beats
from hunt.streams import FaultError, stalls

ENTITY = "parallel_to_stream"
FAULTS = [
    ("parallel_to_stream.vhd", "pixel_valid <= frame_valid and line_valid;",
     "pixel_valid <= line_valid;"),
    ("parallel_to_stream.vhd", "lost          <= valid and not m_axis_tready;",
     "lost          <= not m_axis_tready;"),
    # A camera that is in the middle of a frame at power-up.
    ("parallel_to_stream.vhd", "first       : std_logic                            := '0';",
     "first       : std_logic                            := 'U';"),
    ("parallel_to_stream.vhd", "first       : std_logic                            := '0';",
     "first       : std_logic                            := '1';"),
]  # fmt: skip
# Without a reset, they say that the frame at power-up has begun before.
KEEP = ("parallel_to_stream.vhd",)
# Clocks from a pixel to its beat.
LATENCY = 3


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {"WIDTH": rng.randint(1, 16)}}


class Camera:
    """Sends clocks of video; records beats, which do not wait."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.queue: list[tuple[int, int, int]] = []
        self.stalls: Any = iter(())
        self.restart()

    def restart(self) -> None:
        self.got: list[tuple[int, int, int, int]] = []
        self.begin = self.ready = 0
        self.sent: list[tuple[int, int, int]] = []

    def step(self, clock: int) -> None:
        dut = self.dut
        texts = [str(p.value) for p in (dut.m_axis_tvalid, dut.lost)]
        if self.sent and "".join(texts).strip("01"):
            raise FaultError(f"tvalid, lost: {texts}")
        valid = texts[0] == "1"
        if self.sent and (texts[1] == "1") != (valid and not self.ready):
            raise FaultError(f"lost is {texts[1]}, tvalid {texts[0]}, tready {self.ready}")
        if valid:
            ports = (dut.m_axis_tdata, dut.m_axis_tuser, dut.m_axis_tlast)
            values = [str(port.value) for port in ports]
            if not any(value.strip("01") for value in values):
                self.got.append((clock - self.begin, *(int(value, 2) for value in values)))
            elif len(self.sent) > LATENCY:
                raise FaultError(f"undefined: {values}")
        self.ready = int(not next(self.stalls, False))
        dut.m_axis_tready.value = self.ready
        if self.queue:
            now = self.queue.pop(0)
            self.sent.append(now)
            for port, value in zip((dut.frame_valid, dut.line_valid, dut.data), now, strict=True):
                port.value = value


def video(
    rng: random.Random, width: int, bench: Any, *, inside: bool
) -> list[tuple[int, int, int]]:
    """Clocks of video, after some without, or from the middle of a frame on."""
    kind = rng.choice(["regular", "regular", "no blanking", "noise", "glitches"])
    bench.counts[f"camera: {kind}"] += 1
    clocks: list[tuple[int, int]] = [(int(inside), 0)] * 3
    if inside:
        clocks += [(1, 1)] * rng.randint(1, 9) + [(1, 0)] * rng.randint(0, 4)
    if kind == "noise":
        share = rng.choice([0.05, 0.3, 0.5])
        frame = line = 0
        for _ in range(300):
            frame ^= rng.random() < share / 4
            line ^= rng.random() < share
            clocks.append((frame, line))
    else:
        least = 0 if kind == "no blanking" else 1
        for _ in range(rng.randint(1, 5)):
            clocks += [(0, rng.randrange(2))] * rng.randint(1, 5)
            clocks += [(1, 0)] * rng.randint(least, 4)
            for _ in range(rng.randint(0, 5)):
                clocks += [(1, 1)] * rng.randint(1, 9) + [(1, 0)] * rng.randint(least, 4)
    if kind == "glitches":
        for _ in range(rng.randint(1, 8)):
            at = rng.randrange(3, len(clocks))
            frame, line = clocks[at]
            clocks[at] = rng.choice([(1 - frame, line), (frame, 1 - line)])
    return [(frame, line, rng.getrandbits(width)) for frame, line in clocks]


async def stream(bench: Any, rng: random.Random) -> None:
    inside = not bench.ports and rng.random() < 0.5
    if not bench.ports:
        bench.counts["power-up: inside a frame"] += inside
        bench.set(frame_valid=int(inside), line_valid=0)
        await bench.clocks(8)
        bench.add(Camera(bench.dut))
    camera = bench.ports[0]
    camera.stalls = stalls(rng)
    if not inside:
        camera.queue = [(0, 0, 0)] * 8
        await bench.clocks(8)
    camera.restart()
    # A pixel written after this edge is sampled at the next one.
    camera.begin = bench.clock + 2
    sent = video(rng, bench.design["generics"]["WIDTH"], bench, inside=inside)
    camera.queue = [*sent, *[(0, 0, 0)] * 6]
    await bench.clocks(len(sent) + 6)
    want = beats(sent)
    got = [(clock - LATENCY, *beat) for clock, *beat in camera.got]
    for n, (one, other) in enumerate(zip(got, want, strict=False)):
        if one != other:
            raise FaultError(f"beat {n}: got {one}, want {other}")
    if len(got) != len(want):
        raise FaultError(f"{len(got)} beats came, {len(want)} were expected")
