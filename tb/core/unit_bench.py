# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the parts of the refocuser; each is for the entity that it names."""

import random
from fractions import Fraction
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge, Timer

from plenofir.refocus import FilterLayout, filter_lines
from plenofir_tb.case import read_case
from plenofir_tb.slices import SliceModel

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
    """All values, or the ends of the range, the steps of the quotient, and random ones."""
    largest, divisor = CASE["value_max"], CASE["divisor"]
    values: list[int] = list(range(min(largest, 4000) + 1))
    if largest >= 4000:
        rng = random.Random(cocotb.RANDOM_SEED)
        steps = [
            q * divisor - divisor // 2 for q in rng.choices(range(1, largest // divisor), k=1000)
        ]
        values = [s + d for s in steps for d in (-1, 0, 1)] + [largest, largest - 1, 0]
        values += [rng.randint(0, largest) for _ in range(1000)]
    got = await stream_values(dut, "value", "quotient", values, latency=3)
    want = [int(Fraction(value, divisor) + Fraction(1, 2)) for value in values]
    wrong = [(v, g, w) for v, g, w in zip(values, got, want, strict=True) if g != w]
    assert not wrong, f"{len(wrong)} wrong, first (value, got, want) {wrong[0]}"


@for_entity("ram_simple_dual_port")
async def words_are_kept(dut: Any) -> None:
    """Words at the ends of all blocks and at random, read while others are written."""
    rng = random.Random(cocotb.RANDOM_SEED)
    width, words, latency = CASE["width"], CASE["words"], CASE["latency"]
    bases = [sum(CASE["blocks"][:i]) for i in range(len(CASE["blocks"]) + 1)]
    assert bases[-1] == words
    # No more block RAMs than it takes: it is divided as the estimates are.
    assert len(dut.under_test.chosen) == len(CASE["blocks"])
    ends = [place + d for place in bases for d in (-1, 0, 1) if 0 <= place + d < words]
    places = sorted({*ends, *rng.choices(range(words), k=40)})
    kept = dict.fromkeys(places, 0)
    due: list[int | None] = [None] * (latency - 1)
    Clock(dut.clk, 10, "ns").start()
    for clock in range(2000):
        await FallingEdge(dut.clk)
        if clock >= latency:
            assert int(dut.read_data.value) == due[-latency], (
                f"seed {cocotb.RANDOM_SEED}, clock {clock}"
            )
        read, write = rng.choice(places), rng.choice(places)
        word, enable = rng.getrandbits(width), rng.random() < 0.5
        due.append(kept[read])
        dut.read_address.value = read
        dut.write_address.value = write
        dut.write_data.value = word
        dut.write_enable.value = enable
        if enable:
            kept[write] = word


@for_entity("stored_product")
async def every_product(dut: Any) -> None:
    """The whole ROM."""
    values = list(range(2 ** CASE["value_bits"]))
    got = await stream_values(dut, "value", "product", values, latency=1)
    scale = Fraction(2 ** CASE["scale_bits"], CASE["divisor"])
    assert got == [int(v * scale + Fraction(1, 2)) for v in values]


def case_layout() -> FilterLayout:
    """Read the filter of the case."""
    fields = dict(CASE["layout"])
    return FilterLayout(**{**fields, "shifts": tuple(fields["shifts"])})


@for_entity("switch_table")
async def every_row(dut: Any) -> None:
    """All rows equal the golden model's switch matrix, leftmost switch first."""
    Clock(dut.clk, 10, "ns").start()
    switches = case_layout().switches
    await FallingEdge(dut.clk)
    dut.enable.value = 1
    for slice_, matrix in enumerate(switches):
        dut.slice.value = slice_
        for phase, row in enumerate(matrix):
            dut.phase.value = phase
            await FallingEdge(dut.clk)
            assert str(dut.closed.value) == "".join("01"[int(closed)] for closed in row)
    dut.enable.value = 0
    dut.phase.value = 0
    dut.slice.value = 0
    await FallingEdge(dut.clk)
    assert str(dut.closed.value) == "".join("01"[int(closed)] for closed in switches[-1][-1])


@for_entity("switched_fir")
async def interleaved_streams(dut: Any) -> None:
    """DEPTH independent streams through one filter, each as if it had its own filter.

    Each stream takes a few steps at once, as the columns of the filter array do.
    """
    layout, depth, latency = case_layout(), CASE["depth"], CASE["latency"]
    m, taps, delay = layout.micro_image_size, layout.taps, layout.delay
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    burst = int(rng.integers(1, 4))
    length, lines = 3 * m + 2, 3
    slices = [int(s) for s in rng.integers(len(layout.shifts), size=lines)]
    streams = rng.integers(0, 256, (depth, lines, length))
    want = np.array([np.concatenate(list(filter_lines(s, layout, slices))) for s in streams])

    Clock(dut.clk, 10, "ns").start()
    dut.step.value = 0
    # One entry a clock: slot, whether it steps, and its input; with random idle clocks.
    idle = (0, False, 0, "0" * taps, 0, 0, 0, 0)
    schedule: list[tuple[int, bool, int, str, int, int, int, int]] = []
    total_steps = lines * length + delay
    for start in range(0, total_steps, burst):
        for slot in range(depth):
            for step in range(start, min(start + burst, total_steps)):
                line, position = divmod(step, length)
                inside = line < lines
                first = int(position == 0 and inside)
                mask = [w <= position + taps - 1 - delay for w in range(taps)]
                switches = layout.switches[slices[line] if inside else 0][position % m]
                closed = [inside and bool(c) and b for c, b in zip(switches, mask, strict=True)]
                row = "".join("01"[int(c)] for c in closed)
                # The output of this step is that of the pixel `delay` steps ago.
                update = int(step >= delay and (step - delay) % length % m == 0)
                data = int(streams[slot, line, position]) if inside else 0
                while rng.random() < 0.2:
                    schedule.append((*idle[:1], False, 0, row, 0, 0, 0, step))
                schedule.append((slot, True, data, row, first, int(step > start), update, step))
        # The same slot may be read again only after the read-modify-write loop.
        schedule += [idle] * 4
    got: list[list[int]] = [[] for _ in range(depth)]
    read_ahead = 2 if depth > 1 else 0
    total = len(schedule)
    for clock in range(total + read_ahead + latency):
        await FallingEdge(dut.clk)
        done = clock - read_ahead - latency
        if done >= 0 and schedule[done][1] and schedule[done][7] >= delay:
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
            dut.resume.value = schedule[now][5]
            dut.update.value = schedule[now][6]
    assert np.array_equal(np.array(got), want)


@for_entity("lane_skew")
async def lanes_come_later(dut: Any) -> None:
    """Lane i comes i tokens later."""
    rng = random.Random(cocotb.RANDOM_SEED)
    lanes = CASE["lanes"]
    Clock(dut.clk, 10, "ns").start()
    dut.reset.value = 0
    tokens: list[list[int]] = []
    for _ in range(300):
        words = [rng.randrange(32) for _ in range(lanes)]
        enable = rng.random() < 0.7
        await FallingEdge(dut.clk)
        dut.enable.value = int(enable)
        dut.data_in.value = sum(word << 5 * i for i, word in enumerate(words))
        await RisingEdge(dut.clk)
        if not enable:
            continue
        tokens.append(words)
        if len(tokens) >= lanes:
            got = int(dut.data_out.value)
            for i in range(lanes):
                assert got >> 5 * i & 31 == tokens[-1 - i][i]


@for_entity("lane_exchange")
async def lanes_follow_the_counter(dut: Any) -> None:
    """Lane i takes the lane that the counter selected i tokens ago."""
    rng = random.Random(cocotb.RANDOM_SEED)
    lanes = CASE["lanes"]
    Clock(dut.clk, 10, "ns").start()
    counts: list[int] = []
    for _ in range(300):
        words = [rng.randrange(16) for _ in range(lanes)]
        strobe = rng.random() < 0.7
        count = rng.randrange(lanes)
        await FallingEdge(dut.clk)
        dut.strobe.value = int(strobe)
        dut.count.value = count
        dut.data_in.value = sum(word << 4 * i for i, word in enumerate(words))
        await RisingEdge(dut.clk)
        if not strobe:
            continue
        counts.append(count)
        if len(counts) >= lanes:
            got = int(dut.data_out.value)
            for i in range(lanes):
                assert got >> 4 * i & 15 == words[counts[-1 - i]]


@for_entity("slice_select")
async def slices_of_frames(dut: Any) -> None:
    """Selected and swept slices follow the rules."""
    rng = random.Random(cocotb.RANDOM_SEED)
    model = SliceModel(CASE["slices"])
    Clock(dut.clk, 10, "ns").start()
    dut.reset.value = 1
    dut.frame_start.value = 0
    dut.sweep.value = 0
    dut.slice.value = 0
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    knobs = (0, 0, 0)
    for _ in range(1500):
        if rng.random() < 0.03:
            knobs = (rng.randrange(256), int(rng.random() < 0.8), rng.randrange(5))
        start = rng.random() < 0.5
        dut.slice.value, dut.sweep.value, dut.sweep_frames.value = knobs
        dut.frame_start.value = int(start)
        await RisingEdge(dut.clk)
        if start:
            assert int(dut.selected.value) == model.next_frame(*knobs)
        await FallingEdge(dut.clk)


@for_entity("axis_fifo")
async def words_in_order(dut: Any) -> None:
    """Random words with random stalls: none lost or repeated; full and empty are reached."""
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
    # Shares of clocks with a word to write, and to read; it is filled first.
    writing, reading = 0.9, 0.2
    for clock in range(400 * capacity):
        if clock % (8 * capacity) == 0 and clock:
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
        inside = sent - len(received) + int(bool(take and int(dut.m_axis_tvalid.value)))
        # Two words may be in the registers behind the RAM.
        assert inside - 2 <= level <= inside
        levels.add(level)
        sent += int(bool(accepted))
        await FallingEdge(dut.clk)
        if len(received) == len(words):
            break
    assert received == words
    assert {0, capacity} <= levels, f"levels seen: {sorted(levels)}"
    assert not int(dut.m_axis_tvalid.value)


@for_entity("bus_crossing")
async def values_cross_whole(dut: Any) -> None:
    """Values arrive whole, in order and soon; either clock may stop, and the value stays."""
    half = CASE["width"] // 2
    sent: list[int] = [0]
    running = {"source_clk": True, "destination_clk": True}

    async def clock(name: str, period: int) -> None:
        while True:
            port = getattr(dut, name)
            port.value = 0
            await Timer(period, "ns")
            if running[name]:
                if name == "source_clk":
                    # A value whose halves depend on each other.
                    number = len(sent)
                    sent.append(number << half | number ^ (1 << half) - 1)
                    dut.source.value = sent[-1]
                    await Timer(period // 2, "ns")
                port.value = 1
            await Timer(period, "ns")

    tasks = []
    for periods in ((10, 10), (10, 34), (38, 6)):
        for task in tasks:
            task.cancel()
        tasks = [
            cocotb.start_soon(clock(name, period))
            for name, period in zip(running, periods, strict=True)
        ]
        await Timer(20 * sum(periods), "ns")
        seen = set()
        last = 0
        for _ in range(60 * sum(periods) // periods[1]):
            await FallingEdge(dut.destination_clk)
            value = int(dut.destination.value)
            # Each copy takes at most two round trips of both clocks.
            recent = sent[-14 * sum(periods) // periods[0] :]
            assert value in recent
            place = len(sent) - 1 - sent[::-1].index(value)
            assert place >= last
            last = place
            seen.add(value)
        assert len(seen) >= 8
        for name in running:
            running[name] = False
            await Timer(20 * sum(periods), "ns")
            value = int(dut.destination.value)
            await Timer(20 * sum(periods), "ns")
            assert int(dut.destination.value) == value
            running[name] = True


@for_entity("function_ports")
async def functions_of_processes(dut: Any) -> None:
    """Counts stop at their limit, places turn, tags come later, numbers are rounded."""
    rng = random.Random(cocotb.RANDOM_SEED)
    modulus, length = CASE["modulus"], CASE["length"]
    Clock(dut.clk, 10, "ns").start()
    counts, place, stored = [0, 0], 0, [0] * length
    for clock in range(600):
        await FallingEdge(dut.clk)
        happen = [int(rng.random() < 0.7) for _ in counts]
        clear = int(clock % 40 == 0)
        strobe = rng.random() < 0.7 or not clock
        restart = rng.random() < 0.05 or not clock
        enable, reset = rng.random() < 0.6, rng.random() < 0.02
        tag, value = rng.randrange(8), rng.randrange(256)
        dut.happen.value = happen[0] + 2 * happen[1]
        dut.clear.value = clear
        dut.strobe.value, dut.restart.value = int(strobe), int(restart)
        dut.enable.value, dut.reset.value = int(enable), int(reset)
        dut.tag.value, dut.value.value = tag, value
        await RisingEdge(dut.clk)
        # What the inputs make of the registers from before the edge.
        now = 0 if restart else (place + 1) % modulus
        assert int(dut.place.value) == now
        assert int(dut.late.value) == [*stored, tag][0]
        if strobe:
            place = now
        if enable and length:
            stored = [*stored[1:], tag]
        if reset:
            stored = [bits & ~1 for bits in stored]
        counts = [0 if clear else min(n + h, 7) for n, h in zip(counts, happen, strict=True)]
        await FallingEdge(dut.clk)
        assert int(dut.counts.value) == counts[0] + 8 * counts[1]
        assert int(dut.result.value) == min((value + 2) // 4, 31)
        dut.strobe.value, dut.enable.value, dut.reset.value = 0, 0, 0
        dut.happen.value, dut.clear.value = 0, 0
