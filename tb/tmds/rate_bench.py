# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of clock crossings and gearboxes; each is for the entity it names."""

import random
from typing import Any, NamedTuple

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, Timer

from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity

CASE = read_case()
PERIOD = 10


class Port(NamedTuple):
    """A port of words, its clock and bits."""

    name: str
    clock: str
    width: int


HALF, WHOLE = Port("half", "clk_x2", 5), Port("bits", "clk", 10)


def bits_of(words: list[int], width: int) -> str:
    """Bits in the order in which they are sent."""
    return "".join(str(word >> i & 1) for word in words for i in range(width))


async def two_clocks(dut: Any, halves: int) -> None:
    """Drive both clocks, the rising edges of clk together with every other one of clk_x2."""
    for _ in range(halves):
        dut.clk.value = 1
        dut.clk_x2.value = 1
        await Timer(2, "ns")
        dut.clk_x2.value = 0
        await Timer(2, "ns")
        dut.clk.value = 0
        dut.clk_x2.value = 1
        await Timer(2, "ns")
        dut.clk_x2.value = 0
        await Timer(2, "ns")


async def all_bits_in_order(dut: Any, source: Port, sink: Port) -> None:
    """The output has all bits of random input words in order."""
    rng = random.Random(cocotb.RANDOM_SEED)
    words = [rng.randrange(1 << source.width) for _ in range(2000 // source.width)]
    cocotb.start_soon(two_clocks(dut, 220))
    given, taken = getattr(dut, source.name), getattr(dut, sink.name)
    given.value = 0
    got = []

    async def watch() -> None:
        while True:
            await FallingEdge(getattr(dut, sink.clock))
            if "U" not in str(taken.value):
                got.append(int(taken.value))

    cocotb.start_soon(watch())
    for word in [*words, *[0] * (60 // source.width)]:
        await FallingEdge(getattr(dut, source.clock))
        given.value = word
    assert bits_of(words, source.width) in bits_of(got, sink.width)


@for_entity("gearbox_5_to_10")
async def ten_bits_from_five(dut: Any) -> None:
    """All bits come out in order."""
    await all_bits_in_order(dut, HALF, WHOLE)


@for_entity("gearbox_10_to_5")
async def five_bits_from_ten(dut: Any) -> None:
    """All bits come out in order."""
    await all_bits_in_order(dut, WHOLE, HALF)


@for_entity("elastic_buffer")
async def words_cross_clocks(dut: Any) -> None:
    """Words come in order and half the depth late, at any phase, also after a lost clock."""
    rng = random.Random(cocotb.RANDOM_SEED)
    words = 1 << CASE["width"]
    half = 1 << (CASE["address_bits"] - 1)
    sent = 0
    writing = True

    async def write() -> None:
        nonlocal sent
        while True:
            dut.write_clk.value = 0
            await Timer(PERIOD // 2, "ns")
            if writing:
                sent += 1
                dut.write_word.value = sent % words
                dut.write_clk.value = 1
            await Timer(PERIOD // 2, "ns")

    dut.write_reset.value = 1
    dut.read_reset.value = 1
    cocotb.start_soon(write())
    for phase in (1, 2, 5, 9):
        await Timer(phase, "ns")
        clock = Clock(dut.read_clk, PERIOD, "ns")
        clock.start()
        writing = True
        for _ in range(rng.randrange(8, 20)):
            await FallingEdge(dut.read_clk)
        # Nothing flows in a reset.
        assert not int(dut.flowing.value)
        dut.write_reset.value = 0
        dut.read_reset.value = 0
        for _ in range(4 * half):
            await FallingEdge(dut.read_clk)
            if int(dut.flowing.value):
                break
        assert int(dut.flowing.value)
        # The memory's old contents come out first.
        for _ in range(2 * half):
            await FallingEdge(dut.read_clk)
        late = {(sent - int(dut.read_word.value)) % words}
        for _ in range(300):
            await FallingEdge(dut.read_clk)
            assert int(dut.flowing.value)
            late.add((sent - int(dut.read_word.value)) % words)
        # One more or less if both clocks change at the same time.
        assert max(late) - min(late) <= 1, late
        assert half - 1 <= min(late) <= max(late) <= half + 5, late
        # The write clock stops long enough to be noticed: reading restarts, half the depth late.
        writing = False
        for _ in range(2 * half):
            await FallingEdge(dut.read_clk)
            if not int(dut.flowing.value):
                break
        assert not int(dut.flowing.value)
        writing = True
        for _ in range(4 * half):
            await FallingEdge(dut.read_clk)
        assert int(dut.flowing.value)
        again = (sent - int(dut.read_word.value)) % words
        assert half - 1 <= again <= half + 5, again
        dut.read_reset.value = 1
        await FallingEdge(dut.read_clk)
        await FallingEdge(dut.read_clk)
        assert not int(dut.flowing.value)
        clock.stop()
