"""cocotb tests of the parts of the refocuser; each is for the entity that it names."""

import random
from fractions import Fraction
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge

from plenofir.refocus import filter_lines, output_delay, switch_matrix
from plenofir_tb.runner import read_case

CASE = read_case()


def for_entity(name: str) -> Any:
    """Run a test only where its entity is under test."""
    return cocotb.test(skip=CASE["entity"] != name)


async def stream_values(
    dut: Any, port_in: str, port_out: str, values: list[int], latency: int
) -> list[int]:
    """Feed one value each clock and return what comes out for each, `latency` clocks later."""
    Clock(dut.clk, 10, "ns").start()
    got = []
    for clock in range(len(values) + latency):
        await FallingEdge(dut.clk)
        if clock >= latency:
            got.append(int(getattr(dut, port_out).value))
        getattr(dut, port_in).value = values[min(clock, len(values) - 1)]
    return got


@for_entity("divide_round")
async def every_quotient(dut: Any) -> None:
    """All values in reach, or their ends, the places where the quotient steps, and random ones."""
    largest, divisor = CASE["value_max"], CASE["divisor"]
    values: list[int] = list(range(min(largest, 12_000) + 1))
    if largest >= 12_000:
        rng = random.Random(cocotb.RANDOM_SEED)
        steps = [
            q * divisor - divisor // 2 for q in rng.choices(range(1, largest // divisor), k=4000)
        ]
        values = [s + d for s in steps for d in (-1, 0, 1)] + [largest, largest - 1, 0]
        values += [rng.randint(0, largest) for _ in range(4000)]
    got = await stream_values(dut, "value", "quotient", values, latency=3)
    want = [int(Fraction(value, divisor) + Fraction(1, 2)) for value in values]
    wrong = [(v, g, w) for v, g, w in zip(values, got, want, strict=True) if g != w]
    assert not wrong, f"{len(wrong)} wrong, first (value, got, want) {wrong[0]}"


@for_entity("round_saturate")
async def every_value(dut: Any) -> None:
    """All values: halves up, saturated."""
    values = list(range(CASE["value_max"] + 1))
    got = await stream_values(dut, "value", "result", values, latency=1)
    top = 2 ** CASE["result_bits"] - 1
    want = [min(int(Fraction(v, 2 ** CASE["drop_bits"]) + Fraction(1, 2)), top) for v in values]
    assert got == want


@for_entity("stored_product")
async def every_product(dut: Any) -> None:
    """The whole ROM."""
    values = list(range(2 ** CASE["value_bits"]))
    got = await stream_values(dut, "value", "product", values, latency=1)
    scale = Fraction(2 ** CASE["scale_bits"], CASE["divisor"])
    assert got == [int(v * scale + Fraction(1, 2)) for v in values]


@for_entity("switch_table")
async def every_row(dut: Any) -> None:
    """All rows equal the golden model's switch matrix, leftmost switch first."""
    Clock(dut.clk, 10, "ns").start()
    matrix = switch_matrix(CASE["m"], CASE["shift"])
    await FallingEdge(dut.clk)
    dut.enable.value = 1
    for phase, row in enumerate(matrix):
        dut.phase.value = phase
        await FallingEdge(dut.clk)
        assert str(dut.closed.value) == "".join("01"[int(closed)] for closed in row)
    dut.enable.value = 0
    dut.phase.value = 0
    await FallingEdge(dut.clk)
    assert str(dut.closed.value) == "".join("01"[int(closed)] for closed in matrix[-1])


@for_entity("switched_fir")
async def interleaved_streams(dut: Any) -> None:
    """DEPTH independent streams through one filter: each as if it had a filter of its own."""
    m, shift, depth = CASE["m"], CASE["shift"], CASE["depth"]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    length, lines = 3 * m + 2, 3
    streams = rng.integers(0, 256, (depth, lines, length))
    want = np.array([np.concatenate(list(filter_lines(s, m, shift))) for s in streams])
    switches = switch_matrix(m, shift)
    taps = switches.shape[1]
    delay = output_delay(m, shift)

    Clock(dut.clk, 10, "ns").start()
    dut.step.value = 0
    # One entry a clock: slot, whether it steps, and what it does. Idle clocks are thrown in.
    schedule: list[tuple[int, bool, int, str, int, int]] = []
    for step in range(lines * length + delay):
        line, position = divmod(step, length)
        inside = line < lines
        mask = [w <= position + taps - 1 - delay for w in range(taps)]
        closed = [
            inside and bool(c) and b for c, b in zip(switches[position % m], mask, strict=True)
        ]
        row = "".join("01"[int(c)] for c in closed)
        for slot in range(depth):
            while rng.random() < 0.2:
                schedule.append((int(rng.integers(depth)), False, 0, row, 0, step))
            data = int(streams[slot, line, position]) if inside else 0
            schedule.append((slot, True, data, row, int(position == 0 and inside), step))
        # The same slot may come again only after the read-modify-write loop.
        schedule += [(0, False, 0, row, 0, step)] * max(0, 4 - depth)
    got: list[list[int]] = [[] for _ in range(depth)]
    read_ahead = 2 if depth > 1 else 0
    total = len(schedule)
    for clock in range(total + read_ahead + 1):
        await FallingEdge(dut.clk)
        done = clock - read_ahead - 1
        if done >= 0 and schedule[done][1] and schedule[done][5] >= delay:
            got[schedule[done][0]].append(int(dut.sum.value))
        if clock < total:
            dut.slot.value = schedule[clock][0]
        now = clock - read_ahead
        stepping = 0 <= now < total
        dut.step.value = int(stepping and schedule[now][1])
        if stepping:
            dut.data.value = schedule[now][2]
            dut.closed.value = cocotb.types.LogicArray(schedule[now][3])
            dut.restart.value = schedule[now][4]
    assert np.array_equal(np.array(got), want)


@for_entity("axis_fifo")
async def words_in_order(dut: Any) -> None:
    """Random words with random stalls: none lost, none repeated, full and empty reached."""
    rng = random.Random(cocotb.RANDOM_SEED)
    capacity = 2 ** CASE["address_bits"]
    words = [rng.randrange(2 ** CASE["width"]) for _ in range(60 * capacity)]
    Clock(dut.clk, 10, "ns").start()
    dut.reset.value = 1
    dut.s_axis_tvalid.value = 0
    dut.m_axis_tready.value = 0
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    sent = 0
    received: list[int] = []
    levels = set()
    writing, reading = 0.5, 0.5
    for clock in range(400 * capacity):
        if clock % (8 * capacity) == 0:
            writing, reading = rng.choice([(0.9, 0.2), (0.2, 0.9), (1.0, 1.0), (0.5, 0.5)])
        offer = sent < len(words) and rng.random() < writing
        take = rng.random() < reading
        dut.s_axis_tvalid.value = int(offer)
        dut.s_axis_tdata.value = words[sent] if offer else rng.randrange(2 ** CASE["width"])
        dut.m_axis_tready.value = int(take)
        await RisingEdge(dut.clk)
        accepted = offer and int(dut.s_axis_tready.value)
        if take and int(dut.m_axis_tvalid.value):
            received.append(int(dut.m_axis_tdata.value))
        level = int(dut.level.value)
        assert level == sent - len(received) + int(bool(take and int(dut.m_axis_tvalid.value)))
        levels.add(level)
        sent += int(bool(accepted))
        await FallingEdge(dut.clk)
        if len(received) == len(words):
            break
    assert received == words
    assert {0, capacity} <= levels, f"levels seen: {sorted(levels)}"
    assert not int(dut.m_axis_tvalid.value)


@for_entity("tag_delay")
async def tags_come_later(dut: Any) -> None:
    """Tags come out LENGTH enabled clocks later; reset clears their valid bit."""
    rng = random.Random(cocotb.RANDOM_SEED)
    length, width = CASE["length"], CASE["width"]
    Clock(dut.clk, 10, "ns").start()
    dut.reset.value = 0
    dut.enable.value = 0
    await FallingEdge(dut.clk)
    stored = [0] * length
    for _ in range(500):
        tag, enable = rng.randrange(2**width), rng.random() < 0.6
        reset = rng.random() < 0.02
        dut.tag.value = tag
        dut.enable.value = int(enable)
        dut.reset.value = int(reset)
        await RisingEdge(dut.clk)
        assert int(dut.delayed.value) == [*stored, tag][0]
        if enable and length:
            stored = [*stored[1:], tag]
        if reset:
            stored = [t & ~1 for t in stored]
        await FallingEdge(dut.clk)
