# SPDX-License-Identifier: Apache-2.0
"""Hunt of `video_to_stream`: modes at its limits, torn and moved frames, noise, restarts.

And sources whose frames are not all alike.
"""

import random
from dataclasses import replace
from typing import Any

from hunt.rasters import Mode, draw_mode, frames
from hunt.streams import FaultError, stalls
from hunt.video_sources import CHANGES, Source

ENTITY = "video_to_stream"
FAULTS = [
    ("video_to_stream.vhd", "rows_now <= divided - over;", "rows_now <= divided;"),
    ("video_to_stream.vhd", "if video_1.active = '1' then", "if true then"),
    ("video_to_stream.vhd", "(frames = FEW and alike = '0')", "false"),
]  # fmt: skip
# Random start values of these counters could overflow in simulation before the reset.
KEEP = ("video_to_stream.vhd",)
# Steps from writing a pixel to reading it: a latency of three clocks, and one for the write.
LATENCY = 4
# Frames of a regular signal until it is followed, whatever came before.
TO_FOLLOW = 6
# Frames that are not all alike until this is told.
TO_VARY = 16


def draw(rng: random.Random) -> dict[str, Any]:
    generics = {
        "MAX_COLUMNS": rng.choice([8, 12, 20]),
        "DELAY_LINES": rng.choice([0, 3, 7, 9]),
        "DELAY_PIXELS": rng.choice([0, 10, 16, 22]),
        "BLANK_LINES": rng.choice([0, 0, 3, 5]),
        "ROW_MODULUS": rng.choice([1, 1, 2, 3, 5]),
    }
    if rng.random() < 0.2:
        generics |= {"ONLY_COLUMNS": rng.randint(4, 8), "ONLY_ROWS": rng.randint(3, 8)}
    return {"generics": generics}


def fits(mode: Mode, g: dict[str, Any]) -> bool:
    """Whether a mode can be followed."""
    only = (g.get("ONLY_COLUMNS", 0), g.get("ONLY_ROWS", 0))
    return (
        mode.h[0] <= g["MAX_COLUMNS"]
        and mode.line > g["DELAY_PIXELS"]
        and sum(mode.v) > g["DELAY_LINES"]
        and sum(mode.v) - mode.v[0] >= g["BLANK_LINES"]
        and (only == (0, 0) or only == (mode.h[0], mode.v[0]))
    )


class Video:
    """Video in; the output is a raster of whole lines for any input."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        names = (
            "m_axis_tvalid",
            "m_axis_tuser",
            "m_axis_tlast",
            "following_running",
            "unsupported",
            "varying",
        )
        self.ports = [getattr(dut, name) for name in (*names, "overflow", "miss")]
        self.stalls: Any = iter(())
        self.restart()

    def restart(self) -> None:
        self.queue: list[tuple[int, int, int, int]] = []
        self.sent: list[tuple[int, int, int, int]] = []
        self.ready = 1
        # Position in the output frame, its size, clocks since its first pixel.
        self.clocks = -1
        self.size = (0, 0, 0, 0)
        self.starts: list[int] = []
        self.misses = self.following = 0

    def step(self, clock: int) -> None:
        texts = [str(port.value) for port in self.ports]
        if "".join(texts).strip("01"):
            raise FaultError(f"undefined: {texts}")
        valid, first, last, following, self.unsupported, self.varying, overflow, miss = map(
            int, texts
        )
        self.misses += miss
        was, self.following = self.following, following
        if overflow != (valid and not self.ready):
            raise FaultError(f"overflow {overflow}, tvalid {valid}, tready {self.ready}")
        # The raster ends a clock after the followed signal.
        if following or not (was or valid):
            self._place(valid, first, last)
        elif valid and not was:
            raise FaultError("a pixel while nothing is followed")
        if not following:
            self.clocks = -1
        if valid:
            active, _, _, pixel = self.sent[-LATENCY] if len(self.sent) >= LATENCY else (0, 0, 0, 0)
            got = int(str(self.dut.m_axis_tdata.value), 2)
            if got != pixel * active:
                raise FaultError(f"pixel {got:06x}, want {pixel * active:06x}")
        self.ready = int(not next(self.stalls, False))
        self.dut.m_axis_tready.value = self.ready
        now = self.queue.pop(0) if self.queue else (0, 0, 0, 0)
        self.sent.append(now)
        for name, value in zip(("active", "h_sync", "v_sync", "pixel"), now, strict=True):
            getattr(self.dut, name).value = value

    def _place(self, valid: int, first: int, last: int) -> None:
        """Check that lines are whole, and frames follow each other without a clock in between."""
        if self.clocks >= 0:
            self.clocks += 1
        if valid and first:
            timing = int(str(self.dut.following_timing.value), 2)
            rows = int(str(self.dut.stream_rows.value), 2)
            size = (timing & 4095, timing >> 12 & 4095, rows, timing >> 60 & 4095)
            total = self.size[1] * self.size[3]
            if self.clocks >= 0 and (self.clocks != total or size != self.size):
                raise FaultError(f"a frame of {self.clocks} clocks, {self.size}; then {size}")
            self.clocks, self.size = 0, size
            self.starts.append(len(self.sent) - LATENCY)
        if self.clocks < 0:
            if valid:
                raise FaultError("a stream does not begin with a frame")
            return
        y, x = divmod(self.clocks, self.size[1])
        inside = x < self.size[0] and y < self.size[2]
        want = (
            int(inside),
            int(inside and self.clocks == 0),
            int(inside and x == self.size[0] - 1),
        )
        if (valid, first * valid, last * valid) != want:
            raise FaultError(
                f"line {y}, {x}: tvalid, tuser, tlast {(valid, first, last)}, want {want}"
            )


class Hunt:
    """Regular video after disturbances."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng, self.g = bench, rng, bench.design["generics"]
        self.video: Video = bench.ports[0]
        self.modes = 0
        self.another()

    def another(self) -> None:
        """Mostly a mode that just fits or just does not."""
        g, rng = self.g, self.rng
        most = g["MAX_COLUMNS"]
        only = g.get("ONLY_COLUMNS", 0)
        while True:
            mode = draw_mode(rng, (only, only + 1) if only else (3, most + rng.randrange(2)))
            if only and rng.random() < 0.7:
                mode = replace(mode, h=(only, *mode.h[1:]), v=(g["ONLY_ROWS"], *mode.v[1:]))
            if fits(mode, g) or rng.random() < 0.1:
                self.mode = mode
                return

    async def play(self, signals: list[tuple[int, int, int, int]]) -> None:
        self.video.queue += signals
        await self.bench.clocks(len(self.video.queue))

    async def check(self, kind: str) -> None:
        """Check that regular frames are followed in the end, or reported as unsupported."""
        mode, video = self.mode, self.video
        await self.play(frames(mode, TO_FOLLOW, self.rng))
        begin = len(video.sent)
        misses = video.misses
        await self.play(frames(mode, 2, self.rng))
        await self.bench.clocks(1)
        good = fits(mode, self.g)
        told = (video.following, video.unsupported, video.varying)
        if told != (int(good), int(not good), 0):
            raise FaultError(f"{kind}: following, unsupported, varying {told} of {mode}")
        if not good:
            return
        if begin not in video.starts or begin + mode.total not in video.starts:
            raise FaultError(f"{kind}: frames at {begin}, streams at {video.starts[-3:]}")
        if self.bench.number("following_timing") != mode.timing() or video.misses != misses:
            raise FaultError(f"{kind}: timing or misses of {mode}")
        total = sum(mode.v)
        modulus = self.g["ROW_MODULUS"]
        rows = mode.v[0] if modulus == 1 else total - total % modulus
        if video.size[2] != rows:
            raise FaultError(f"{video.size[2]} lines, want {rows}")

    async def disturb(self, kind: str) -> None:
        rng, mode, video = self.rng, self.mode, self.video
        self.bench.counts[f"video: {kind}"] += 1
        signals = frames(mode, rng.randint(1, 3), rng)
        if kind == "torn":
            for _ in range(rng.randint(1, 6)):
                at = rng.randrange(len(signals))
                a, h, v, p = signals[at]
                signals[at] = rng.choice([(1 - a, h, v, p | 1), (a, 1 - h, v, p), (a, h, 1 - v, p)])
            await self.play(signals)
        elif kind == "moved":
            await self.play(signals[: rng.randrange(1, len(signals))])
        elif kind == "longer":
            at = rng.randrange(len(signals))
            await self.play(
                signals[:at] + [signals[at]] * rng.randint(1, 2 * mode.line) + signals[at:]
            )
        elif kind == "noise":
            share = rng.choice([0.01, 0.1, 0.5])
            row = [0, 0, 0]
            for _ in range(rng.randint(1, 1500)):
                row = [bit ^ (rng.random() < share) for bit in row]
                video.queue.append((row[0], row[1], row[2], rng.getrandbits(24)))
            await self.play([])
        elif kind == "silence":
            level = rng.randrange(2)
            await self.play([(0, level, level, 0)] * rng.choice([10, mode.total, 5000]))
        elif kind == "not alike":
            change = rng.choice(CHANGES)
            self.bench.counts[f"frames: {change}"] += 1
            source = Source(rng, mode.h, mode.v, mode.h_level, mode.v_level, change=change)
            for _ in range(TO_VARY):
                await self.play(list(source.frame()))
            if (video.following, video.unsupported, video.varying) != (0, 0, 1):
                raise FaultError(f"{change}: following or not told of {mode}")
        elif kind == "another mode":
            self.another()
        elif kind == "restart":
            await self.play(signals[: rng.randrange(len(signals))])
            self.bench.set(restart=1)
            await self.bench.clocks(rng.randint(1, 3))
            self.bench.set(restart=0)
        elif kind == "reset":
            await self.play(signals[: rng.randrange(len(signals))])
            await self.bench.reset(1)
            await self.bench.clocks(1)
            if video.following or video.clocks >= 0:
                raise FaultError("following behind a reset")


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.set(active=0, h_sync=0, v_sync=0, pixel=0, restart=0, reset=1, m_axis_tready=1)
        await bench.clocks(6)
        bench.add(Video(bench.dut))
    bench.ports[0].stalls = stalls(rng) if rng.random() < 0.3 else iter(())
    await bench.reset(rng.choice([1, 1, 5]))
    hunt = Hunt(bench, rng)
    await hunt.check("start")
    kinds = ["torn", "moved", "longer", "noise", "silence", "another mode", "restart", "reset"]
    kinds += ["not alike"] * 2
    for _ in range(rng.randint(1, 3)):
        kind = rng.choice(kinds)
        await hunt.disturb(kind)
        await hunt.check(kind)
