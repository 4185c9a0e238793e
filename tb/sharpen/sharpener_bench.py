# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``lens_sharpener``: frames of any size, with gaps, empty tokens, flush lines."""

import random
from collections.abc import Iterator
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir.refocus.sharpening import sharpened_sums, taps
from plenofir_tb.case import read_case

CASE = read_case()
M, PIXELS, CHANNELS = CASE["m"], CASE["pixels"], CASE["channels"]
SUM_MAX, DIVISOR, WEIGHTS = CASE["sum_max"], CASE["divisor"], CASE["weights"]
SUM_BITS = SUM_MAX.bit_length()

Token = dict[str, int]
Frame = tuple[int, np.ndarray]


def golden(slice_: int, sums: np.ndarray) -> np.ndarray:
    """Expected sums, before the division by DIVISOR."""
    scale = taps(CASE["scale_units"]).scale
    # All slices use taps of the smallest common scale.
    found = sharpened_sums(sums, M, WEIGHTS[slice_]) * (scale // taps(WEIGHTS[slice_]).scale) ** 2
    half = scale**2 // 2 if DIVISOR % 2 else 0
    return np.clip((found + half) // scale**2, 0, SUM_MAX)


def packed(values: np.ndarray) -> int:
    """Values of a token, pixel 0 and channel 0 in the low bits."""
    return sum(int(value) << n * SUM_BITS for n, value in enumerate(values.reshape(-1)))


def draw_frame(rng: random.Random) -> Frame:
    """A frame of sums, often at the ends of their range."""
    columns = rng.randint(1, CASE["columns"])
    shape = (rng.randint(1, 3 * M + 2), columns, CHANNELS)
    values = np.random.default_rng(rng.getrandbits(32)).integers(0, SUM_MAX + 1, shape)
    if rng.random() < 0.6:
        values = np.where(values > SUM_MAX // 2, SUM_MAX, 0)
    return rng.randrange(len(WEIGHTS)), values


def line_tokens(rng: random.Random, line: np.ndarray, about: Token) -> Iterator[Token]:
    """Tokens of a line, with the least number of empty ones after it."""
    count = -(-len(line) // PIXELS)
    rest = len(line) - (count - 1) * PIXELS
    for n in range(count):
        part = line[n * PIXELS : (n + 1) * PIXELS]
        fill = np.array([rng.randint(0, SUM_MAX) for _ in range((PIXELS - len(part)) * CHANNELS)])
        part = np.concatenate([part.reshape(-1), fill]).astype(np.int64)
        first = int(n == 0)
        # Inputs that only matter with a line's first token are random elsewhere.
        other = {key: rng.getrandbits(1) for key in ("image", "frame_first")}
        other["slice"] = rng.randrange(len(WEIGHTS))
        yield {
            **(about if first else other),
            "pixel": 1,
            "line_first": first,
            "line_last": int(n == count - 1),
            "sums": packed(part),
            "line_end": (1 << rest) - 1,
        }
    for _ in range(max(4 - count, 0) + rng.choice([0, 0, 0, 2])):
        yield {"pixel": 0, "line_first": rng.getrandbits(1), "line_end": (1 << rest) - 1}


def frame_tokens(rng: random.Random, frame: Frame) -> Iterator[Token]:
    slice_, values = frame
    for number, line in enumerate(values):
        about = {"image": 1, "frame_first": int(number == 0), "slice": slice_}
        yield from line_tokens(rng, line, about)


def flush_tokens(rng: random.Random, columns: int, lines: int) -> Iterator[Token]:
    """Tokens of lines that belong to no frame, and of empty steps after the last."""
    for _ in range(lines):
        zeros = np.zeros((columns, CHANNELS), np.int64)
        yield from line_tokens(rng, zeros, {"image": 0, "frame_first": 0, "slice": 0})
    for _ in range(M):
        yield {"pixel": 0, "line_end": (1 << ((columns - 1) % PIXELS + 1)) - 1}


class Bench:
    """Feeds tokens and collects what comes out."""

    def __init__(self, dut: Any, rng: random.Random) -> None:
        self.dut, self.rng = dut, rng
        self.got: list[tuple[tuple[int, ...], list[int]]] = []
        Clock(dut.clk, 10, "ns").start()

    async def clock(self, token: Token | None) -> None:
        """One clock, with a token or without."""
        await FallingEdge(self.dut.clk)
        if str(self.dut.out_token_strobe.value) == "1" and int(self.dut.out_token_pixel.value):
            self.take()
        self.dut.token_strobe.value = int(token is not None)
        for name, value in (token or {}).items():
            port = name if name in ("sums", "line_end") else f"token_{name}"
            getattr(self.dut, port).value = value

    def take(self) -> None:
        """Note a token of an image."""
        if not int(self.dut.out_token_image.value):
            return
        names = ("frame_first", "line_first", "line_last", "slice")
        marks = tuple(int(getattr(self.dut, f"out_token_{name}").value) for name in names)
        word = int(self.dut.out_sums.value)
        mask = (1 << SUM_BITS) - 1
        sums = [word >> n * SUM_BITS & mask for n in range(PIXELS * CHANNELS)]
        self.got.append((marks, sums))

    async def send(self, tokens: Iterator[Token]) -> None:
        """Send tokens, with idle clocks in between."""
        share = self.rng.choice([0, 0, 0.3])
        for token in tokens:
            while self.rng.random() < share:
                await self.clock(None)
            await self.clock(token)


def expected(frames: list[Frame]) -> list[tuple[tuple[int, ...], list[int]]]:
    """Tokens that come out of frames."""
    found = []
    for slice_, values in frames:
        sharp = golden(slice_, values)
        for number, line in enumerate(sharp):
            count = -(-len(line) // PIXELS)
            padded = np.zeros((count * PIXELS, CHANNELS), np.int64)
            padded[: len(line)] = line
            for n in range(count):
                marks = int(number == 0), int(n == 0), int(n == count - 1), slice_
                part = padded[n * PIXELS : (n + 1) * PIXELS].reshape(-1).tolist()
                found.append((marks, part))
    return found


@cocotb.test()
async def every_sum(dut: Any) -> None:
    """Frames one after another, without a gap, after flush lines, after a reset."""
    rng = random.Random(cocotb.RANDOM_SEED)
    bench = Bench(dut, rng)
    dut.reset.value = 1
    for name in ("strobe", "pixel", "line_first", "line_last", "image", "frame_first", "slice"):
        getattr(dut, f"token_{name}").value = 0
    dut.line_end.value = 1
    dut.sums.value = 0
    for _ in range(3):
        await bench.clock(None)
    for turn in range(CASE["turns"]):
        dut.reset.value = 0
        frames = [draw_frame(rng)]
        # Frames that follow each other without a gap have lines of one length.
        columns = frames[0][1].shape[1]
        while len(frames) < 2 or rng.random() < 0.4:
            slice_, values = draw_frame(rng)
            frames.append((slice_, np.resize(values, (values.shape[0], columns, CHANNELS))))
        broken = turn % 3 == 1
        for number, frame in enumerate(frames):
            await bench.send(frame_tokens(rng, frame))
            if rng.random() < 0.3 and number + 1 < len(frames):
                await bench.send(flush_tokens(rng, columns, rng.randint(1, M + 2)))
        if broken:
            dut.reset.value = 1
            for _ in range(2):
                await bench.clock(None)
            bench.got.clear()
            continue
        await bench.send(flush_tokens(rng, columns, M))
        for _ in range(20):
            await bench.clock(None)
        want = expected(frames)
        seed = f"seed {cocotb.RANDOM_SEED}, turn {turn}"
        assert len(bench.got) == len(want), f"{seed}: {len(bench.got)} tokens, {len(want)} wanted"
        for place, (one, other) in enumerate(zip(bench.got, want, strict=True)):
            assert one == other, f"{seed}, token {place}: got {one}, want {other}"
        bench.got.clear()
