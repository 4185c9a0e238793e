# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``row_scatter`` behind an engine with the highest permitted rate."""

import random
from collections import deque
from dataclasses import dataclass
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir_tb.case import read_case

CASE = read_case()


@dataclass(frozen=True)
class Word:
    """A row's output for a token: a pixel, or that it has no image line."""

    skip: bool
    start: bool = False
    last: bool = False
    slice_: int = 0
    data: int = 0

    def beat(self) -> tuple[int, int, int, int]:
        return self.data, int(self.start), int(self.last), self.slice_


Token = list[Word | None]
"""What the rows give with a token; a row may give nothing."""


class Bench:
    """An engine, the entity, and a sink."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.rows: int = CASE["parallel_rows"]
        self.under_way: int = CASE["under_way"]
        self.line_words = 2 * CASE["max_columns"] + self.rows if self.rows > 1 else 0
        # A power of two for the words of lines and twice one more than those under way.
        self.words = 1 << (self.line_words + 2 * self.under_way + 1).bit_length()
        self.wanted: deque[tuple[int, int, int, int]] = deque()
        # Tokens in the engine for each row, and those that leave it, by clock.
        self.todo: list[deque[Word | None]] = []
        self.pipeline: deque[Token] = deque()
        Clock(dut.clk, 10, "ns").start()
        self.start_anew()

    def start_anew(self) -> None:
        """Forget all words."""
        self.wanted.clear()
        # Row r is r tokens behind.
        self.todo = [deque([None] * r) for r in range(self.rows)]
        # Clocks from the decision to send a token to its result.
        self.pipeline = deque([[None] * self.rows] * (self.under_way - 1))

    def add_band(self, columns: int, lines: int, *, first: bool, slice_: int) -> None:
        """Queue a band with image lines in its first rows."""
        for r, todo in enumerate(self.todo):
            if r >= lines:
                todo.extend([Word(skip=True), *[None] * (columns - 1)])
                continue
            for k in range(columns):
                data = self.rng.getrandbits(CASE["data_bits"])
                start = first and r == 0 and k == 0
                word = Word(False, start, k == columns - 1, slice_, data)
                todo.append(word)
                self.wanted.append(word.beat())

    def add_frame(self, *, flushed: bool) -> None:
        """Queue a frame, or a frame and bands without an image line."""
        columns = self.rng.choice([1, 2, CASE["max_columns"]])
        slice_ = self.rng.randrange(1 << CASE["slice_bits"])
        left = self.rng.randint(1, 3 * self.rows)
        first = True
        while left > 0:
            self.add_band(columns, min(left, self.rows), first=first, slice_=slice_)
            left -= self.rows
            first = False
        for _ in range(2 * flushed):
            self.add_band(columns, 0, first=False, slice_=0)

    async def step(self, *, send: bool, take: bool) -> None:
        """One clock, from falling clock to falling clock."""
        dut = self.dut
        token: Token = [None] * self.rows
        if send and int(dut.credit.value):
            token = [todo.popleft() if todo else None for todo in self.todo]
        self.pipeline.append(token)
        came = list(enumerate(self.pipeline.popleft()))
        words = [(r, word) for r, word in came if word is not None]
        dut.in_valid.value = sum((not word.skip) << r for r, word in words)
        dut.in_skip.value = sum(word.skip << r for r, word in words)
        dut.in_start.value = sum(word.start << r for r, word in words)
        dut.in_last.value = sum(word.last << r for r, word in words)
        dut.in_slice.value = sum(word.slice_ << 8 * r for r, word in words)
        dut.in_data.value = sum(word.data << CASE["data_bits"] * r for r, word in words)
        dut.m_axis_tready.value = int(take)
        ports = (dut.m_axis_tdata, dut.m_axis_tuser, dut.m_axis_tlast, dut.m_axis_tid)
        if take and int(dut.m_axis_tvalid.value):
            beat = tuple(int(port.value) for port in ports)
            assert self.wanted, f"{beat} is one too many"
            assert beat == self.wanted.popleft()
        await FallingEdge(dut.clk)

    async def drain(self, patience: int = 40) -> None:
        """Let all words leave; fail if they do not."""
        quiet = 0
        while (self.wanted or any(self.todo)) and quiet < patience + self.under_way:
            before = len(self.wanted), len(self.todo[-1])
            await self.step(send=True, take=True)
            quiet = quiet + 1 if before == (len(self.wanted), len(self.todo[-1])) else 0
        assert not self.wanted, f"{len(self.wanted)} words have not come"
        for _ in range(self.under_way + 6):
            await self.step(send=False, take=True)
            assert not self.wanted

    async def reset(self, clocks: int = 1) -> None:
        """Reset, and forget what was under way."""
        self.start_anew()
        self.dut.reset.value = 1
        for clock in range(clocks):
            await self.step(send=False, take=False)
            if clock:
                continue
            assert not int(self.dut.credit.value)
            assert not int(self.dut.m_axis_tvalid.value)
        self.dut.reset.value = 0
        for _ in range(3):
            await self.step(send=False, take=False)
        assert int(self.dut.credit.value)
        assert int(self.dut.drained.value)


@cocotb.test()
async def lines_leave_in_order(dut: Any) -> None:
    """Frames at any pace, with resets: no lost words, no deadlock."""
    bench = Bench(dut)
    dut.in_valid.value = dut.in_skip.value = 0
    await bench.reset(3)
    for _ in range(12):
        for _ in range(bench.rng.randint(1, 4)):
            bench.add_frame(flushed=bench.rng.random() < 0.3)
        sending, taking = bench.rng.choice([(1, 1), (1, 0.3), (0.3, 1), (0.7, 0.7), (1, 0.9)])
        pause = bench.rng.choice([0, 0, 4 * bench.words])
        for _ in range(pause):
            await bench.step(send=True, take=False)
        for _ in range(bench.rng.randint(1, 300)):
            await bench.step(send=bench.rng.random() < sending, take=bench.rng.random() < taking)
        if bench.rng.random() < 0.5:
            await bench.drain()
        await bench.reset()


@cocotb.test()
async def words_that_wait(dut: Any) -> None:
    """`credit` and `drained` follow the waiting words, one by one; then all leave without a gap."""
    bench = Bench(dut)
    dut.in_valid.value = dut.in_skip.value = 0
    await bench.reset(3)
    columns = CASE["max_columns"]
    bands: list[int] = []
    waiting = 0
    # The two registers of a FIFO hold a word each besides its memory.
    while int(dut.credit.value):
        if not bench.todo[0]:
            bands.append(bench.rng.randint(1, bench.rows) if bands else bench.rows)
            bench.add_band(columns, bands[-1], first=len(bands) == 1, slice_=0)
        await bench.step(send=True, take=False)
        # No row has more than the first.
        waiting += 1
        for _ in range(bench.under_way + 4):
            await bench.step(send=False, take=False)
        inside = max(waiting - 2, 0)
        assert int(dut.drained.value) == (inside < bench.under_way), f"{inside} words"
        assert int(dut.credit.value) == (inside < bench.words - bench.under_way), f"{inside} words"
    # Complete bands leave without a gap: rows without a line take no clock.
    whole = (waiting - bench.rows + 1) // columns
    for _ in range(columns * sum(bands[:whole])):
        assert int(dut.m_axis_tvalid.value)
        await bench.step(send=False, take=True)
    await bench.drain()


@cocotb.test()
async def a_stall_costs_nothing(dut: Any) -> None:
    """After any stall of the sink a word leaves each clock, as long as the engine has some."""
    bench = Bench(dut)
    dut.in_valid.value = dut.in_skip.value = 0
    await bench.reset(3)
    columns = CASE["max_columns"]

    async def step(*, take: bool) -> None:
        if len(bench.todo[0]) < 2 * columns:
            bench.add_band(columns, bench.rows, first=False, slice_=0)
        await bench.step(send=True, take=take)

    # Until a band is in.
    for _ in range(bench.under_way + columns + bench.rows + 4):
        await step(take=False)
    for _ in range(5):
        for _ in range(bench.rng.choice([1, bench.under_way, 2 * bench.words])):
            await step(take=False)
        for clock in range(2 * bench.rows * bench.words):
            assert int(dut.m_axis_tvalid.value), f"nothing {clock} clocks behind a stall"
            await step(take=True)
    await bench.drain()
