# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of video input; each is for the entity that it names."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir.fpga.hdmi.link import RasterSignals, raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity
from plenofir_tb.video import (
    COUNT_BITS,
    blank_frames,
    random_mode,
    reset,
    shrunken,
    timing_vector,
)

CASE = read_case()
# Bits of a timing's counts, and positions of two of them.
MOST = (1 << COUNT_BITS) - 1
LINE_LENGTH, ROWS = 1, 4


class MeterSource:
    """Video into the timing meter."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        # Whether the timing was stable, a clock after each start of a frame.
        self.stable: list[int] = []
        self.timings: list[list[int]] = []

    async def reset(self, mode: VideoMode) -> None:
        """Reset in the blanking of a mode."""
        dut = self.dut
        dut.active.value = 0
        dut.h_sync.value = int(not mode.h_positive)
        dut.v_sync.value = int(not mode.v_positive)
        await reset(dut)
        assert (int(dut.stable.value), int(dut.timing.value)) == (0, 0)
        self.stable.clear()

    async def play(self, active: Any, h_sync: Any, v_sync: Any) -> None:
        dut = self.dut
        for a, h, v in zip(*(s.tolist() for s in (active, h_sync, v_sync)), strict=True):
            dut.active.value, dut.h_sync.value, dut.v_sync.value = int(a), int(h), int(v)
            await FallingEdge(dut.clk)
            if int(dut.frame_start.value):
                self.stable.append(int(dut.stable.value))
                timing = int(dut.timing.value)
                self.timings.append([timing >> COUNT_BITS * i & MOST for i in range(10)])

    async def frames(self, mode: VideoMode, count: int = 1) -> None:
        signals = blank_frames(mode, count)
        await self.play(signals.active, signals.h_sync, signals.v_sync)


@for_entity("video_timing_meter")
async def timings_of_any_mode(dut: Any) -> None:
    """Every count of a mode after two whole frames, one mode after the other."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    source = MeterSource(dut)
    mode = random_mode(rng)
    await source.reset(mode)
    for _ in range(12):
        source.stable.clear()
        await source.frames(mode, 5)
        assert 0 in source.stable, mode
        assert source.stable[-2:] == [1, 1], mode
        assert int(dut.timing.value) == timing_vector(mode), mode
        mode = random_mode(rng)
    # After a reset earlier frames do not count.
    total = mode.h_total * mode.v_total
    for clocks in (1, 3 * mode.h_total, total - 1, total + 1, 4 * total - 1):
        signals = blank_frames(mode, 4)
        await source.play(*(s[:clocks] for s in (signals.active, signals.h_sync, signals.v_sync)))
        await source.reset(mode)
        await source.frames(mode, 5)
        # The beginning of a frame is not recognised without a vertical sync before it.
        assert source.stable == [0, 0, 1, 1]


@for_entity("video_timing_meter")
async def irregular_frames_are_not_stable(dut: Any) -> None:
    """A single different line makes the frame's timing unstable, until two regular frames."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    source = MeterSource(dut)
    mode = shrunken(
        *("meter",),
        **{"h_active": 5, "h_front": 2, "h_sync": 2, "h_back": 2},
        **{"v_active": 3, "v_front": 1, "v_sync": 1, "v_back": 2},
    )
    await source.reset(mode)
    await source.frames(mode, 4)
    regular = blank_frames(mode, 1)
    sync = mode.h_active + mode.h_front

    def one(signal: str, at: int) -> RasterSignals:
        changed = {"active": regular.active, "h_sync": regular.h_sync, "v_sync": regular.v_sync}
        changed[signal] = changed[signal].copy()
        changed[signal][at] ^= True
        return RasterSignals(**changed, pixels=regular.pixels)

    def cut(at: int, count: int) -> RasterSignals:
        keep = np.r_[0:at, at + max(count, 0) : len(regular.active)]
        if count < 0:
            keep = np.r_[0:at, np.full(-count, at), at : len(regular.active)]
        return RasterSignals(
            *(s[keep] for s in (regular.active, regular.h_sync, regular.v_sync, regular.pixels))
        )

    v_begin = (mode.v_active + mode.v_front) * mode.h_total + sync
    v_end = v_begin + mode.v_sync * mode.h_total
    faults = []
    for line in range(mode.v_total):
        at = line * mode.h_total
        for place in (sync - 1, sync, sync + mode.h_sync - 1, sync + mode.h_sync):
            faults.append((f"line {line}, horizontal sync at {place}", one("h_sync", at + place)))
        if line < mode.v_active:
            place = rng.randrange(1, mode.h_active)
            faults.append((f"line {line}, torn at {place}", one("active", at + place)))
            # A line with one pixel more or less.
            faults.append((f"line {line} begins late", one("active", at)))
            faults.append((f"line {line} ends late", one("active", at + mode.h_active)))
            faults.append((f"line {line} is shorter", cut(at + mode.h_active, 1)))
            faults.append((f"line {line} is longer", cut(at + mode.h_active, -1)))
    for place in (v_begin - 1, v_begin, v_end - 1, v_end):
        faults.append((f"vertical sync at {place}", one("v_sync", place)))
    faults.append(("a line less", cut(mode.v_active * mode.h_total, mode.h_total)))
    faults.append(("a frame that is a clock longer", cut(len(regular.active) - 2, -1)))
    for name, signals in rng.sample(faults, len(faults)):
        source.stable.clear()
        await source.play(signals.active, signals.h_sync, signals.v_sync)
        # The start of the frame itself, after the regular one before it.
        assert source.stable[0] == signals.active[0], name
        source.stable.clear()
        await source.frames(mode, 3)
        assert source.stable[0] == 0, name
        assert source.stable[-1] == 1, name
        assert int(dut.timing.value) == timing_vector(mode)


@for_entity("video_timing_meter")
async def timings_end(dut: Any) -> None:
    """A timing ends with a line or a frame longer than any."""
    Clock(dut.clk, 10, "ns").start()
    source = MeterSource(dut)
    mode = shrunken(
        *("meter",),
        **{"h_active": 4, "h_front": 1, "h_sync": 2, "h_back": 1},
        **{"v_active": 3, "v_front": 1, "v_sync": 1, "v_back": 1},
    )
    line = mode.h_total
    signals = blank_frames(mode, 1)
    # Lines of the last frame that have come, and clocks from then on until the timing is lost.
    for lines, clocks in ((2, (MOST - 2) * line), (1, MOST - line)):
        await source.reset(mode)
        await source.frames(mode, 4)
        begin = [s[: lines * line] for s in (signals.active, signals.h_sync, signals.v_sync)]
        await source.play(*begin)
        assert int(dut.stable.value)
        dut.active.value = 0
        await ClockCycles(dut.clk, clocks - 2)
        await FallingEdge(dut.clk)
        assert int(dut.stable.value)
        await ClockCycles(dut.clk, line if lines == 2 else 4)
        await FallingEdge(dut.clk)
        assert not int(dut.stable.value)


@for_entity("video_timing_meter")
async def meter_is_reset_at_any_pixel(dut: Any) -> None:
    """A reset of one clock while video goes on: earlier measurements do not count."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    source = MeterSource(dut)
    mode = random_mode(rng)
    await source.reset(mode)
    total = mode.h_total * mode.v_total
    signals = blank_frames(mode, 1)
    position = 0

    async def play(clocks: int) -> None:
        nonlocal position
        at = np.arange(position, position + clocks) % total
        await source.play(signals.active[at], signals.h_sync[at], signals.v_sync[at])
        position += clocks

    v_begin = (mode.v_active + mode.v_front) * mode.h_total + mode.h_active + mode.h_front
    v_end = v_begin + mode.v_sync * mode.h_total
    places = [0, 1, mode.h_active, mode.h_total, v_begin, v_end, v_end + 1]
    for place in (*places, *rng.choices(range(total), k=4)):
        await play((place - position) % total + 4 * total)
        assert int(dut.stable.value)
        source.stable.clear()
        source.timings.clear()
        dut.reset.value = 1
        await play(1)
        dut.reset.value = 0
        assert [int(p.value) for p in (dut.frame_start, dut.stable, dut.timing)] == [0, 0, 0]
        # The beginning of a frame is not recognised without a vertical sync since the reset.
        await play(5 * total)
        assert source.stable == [0, 0, 1, 1, 1][: 5 if place < v_end else 4], f"{mode}, {place}"
        assert int(dut.timing.value) == timing_vector(mode)
        # In the frame with the reset, lines are counted from the reset on, without their length.
        if mode.h_total <= place < v_end:
            ends = np.arange(mode.v_active) * mode.h_total + mode.h_active - 1
            assert source.timings[0][ROWS] == sum(ends > place)
            assert source.timings[0][LINE_LENGTH] == 0


def at_the_limits(name: str, **changes: int) -> VideoMode:
    """The mode that just meets the limits of the entity under test, or one with parts changed."""
    horizontal = {"h_active": 12, "h_front": 1, "h_sync": 1, "h_back": 1}
    vertical = {"v_active": 3, "v_front": 2, "v_sync": 1, "v_back": 1}
    return shrunken(name, **{**horizontal, **vertical, **changes})


class StreamTap:
    """Video into ``video_to_stream``, and all of its outputs."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.stalls = 0.0
        self.taken: list[tuple[int, ...]] = []
        # Reports with the first pixel of each frame.
        self.rows: list[int] = []
        dut.restart.value = 0

    async def play(self, signals: RasterSignals) -> None:
        """Send a signal; the output is added to `taken`."""
        dut = self.dut
        packed = signals.pixels.astype(int) @ (1, 256, 65536)
        columns = (signals.active, signals.h_sync, signals.v_sync, packed)
        for a, h, v, p in zip(*(column.tolist() for column in columns), strict=True):
            dut.active.value, dut.h_sync.value, dut.v_sync.value = int(a), int(h), int(v)
            dut.pixel.value = p
            dut.m_axis_tready.value = int(self.rng.random() >= self.stalls)
            await FallingEdge(dut.clk)
            valid = int(dut.m_axis_tvalid.value)
            assert int(dut.overflow.value) == (valid and not int(dut.m_axis_tready.value))
            ports = (dut.m_axis_tdata, dut.m_axis_tuser, dut.m_axis_tlast)
            beat = tuple(int(port.value) if valid else 0 for port in ports)
            if beat[1]:
                self.rows.append(int(dut.stream_rows.value))
            self.taken.append((*beat, int(dut.following_running.value), int(dut.miss.value)))

    def pictures(self, mode: VideoMode, count: int) -> RasterSignals:
        rng = np.random.default_rng(self.rng.randrange(1 << 32))
        shape = (count, mode.v_active, mode.h_active, 3)
        return raster_signals(mode, list(rng.integers(0, 256, shape, np.uint8)))


@for_entity("video_to_stream")
async def modes_at_the_limits(dut: Any) -> None:
    """Modes that just fit are streamed whole; those that just do not are reported."""
    Clock(dut.clk, 10, "ns").start()
    tap = StreamTap(dut)
    for name in ("active", "h_sync", "v_sync", "pixel"):
        getattr(dut, name).value = 0
    await reset(dut)
    for mode, fits in (
        (at_the_limits("fits"), True),
        (at_the_limits("wide", h_active=13), False),
        (at_the_limits("short lines", h_active=11), False),
        (at_the_limits("short lines with blanking", h_active=11, h_back=2), True),
        (at_the_limits("few lines", v_active=2), False),
        (at_the_limits("little blanking", v_active=4, v_front=1), False),
        (at_the_limits("more of all", v_active=5, v_front=3, h_back=4), True),
    ):
        await tap.play(tap.pictures(mode, 5))
        assert int(dut.unsupported.value) == (not fits), mode
        tap.stalls = 0.3
        tap.taken.clear()
        signals = tap.pictures(mode, 2)
        await tap.play(signals)
        tap.stalls = 0
        y, x = np.divmod(np.arange(len(signals.active)), mode.h_total)
        first = (y % mode.v_total == 0) & (x == 0)
        packed = signals.pixels.astype(int) @ (1, 256, 65536)
        last = signals.active & (x == mode.h_active - 1)
        want = np.stack([packed, first, last, np.ones_like(first), np.zeros_like(first)], axis=1)
        # The latency of 3 clocks, of which the first is this one.
        got = np.array(tap.taken)[2:]
        assert np.array_equal(got, (want if fits else 0 * want)[: len(got)]), mode
        if fits:
            assert int(dut.following_timing.value) == timing_vector(mode)


def unlike(mode: VideoMode, kind: str, number: int) -> RasterSignals:
    """A frame of a source whose frames are not all alike."""
    odd = number % 2
    if kind == "refresh rate":
        mode = mode.model_copy(update={"v_back": mode.v_back + number * 2 % 5})
    elif kind == "a line more":
        mode = mode.model_copy(update={"v_back": mode.v_back + odd})
    elif kind == "blanking of lines":
        mode = mode.model_copy(update={"h_back": mode.h_back + number % 3})
    signals = blank_frames(mode, 1)
    v_sync, keep = signals.v_sync, np.ones(len(signals.active), bool)
    if kind == "interlaced":
        v_sync = np.roll(v_sync, odd * mode.h_total // 2)
    # A pixel less in the blanking.
    keep[-1] = kind != "short line" or not odd
    columns = (signals.active, signals.h_sync, v_sync, signals.pixels)
    return RasterSignals(*(column[keep] for column in columns))


@for_entity("video_to_stream")
async def frames_that_are_not_all_alike(dut: Any) -> None:
    """They are told, from the start or behind a timing that was followed, until they are alike.

    So is one frame in eight that has a line more, once its timing was lost four times.
    """
    Clock(dut.clk, 10, "ns").start()
    tap = StreamTap(dut)
    for name in ("active", "h_sync", "v_sync", "pixel"):
        getattr(dut, name).value = 0
    mode = at_the_limits("fits")

    def told() -> tuple[int, ...]:
        ports = (dut.following_running, dut.unsupported, dut.varying)
        return tuple(int(port.value) for port in ports)

    kinds = ("short line", "a line more", "refresh rate", "interlaced", "blanking of lines")
    for kind in kinds:
        for begins in (True, False):
            if begins:
                await reset(dut)
            # Power-up in the middle of a frame.
            signals = unlike(mode, kind, 0)
            at = tap.rng.randrange(1, len(signals.active))
            columns = (signals.active, signals.h_sync, signals.v_sync, signals.pixels)
            await tap.play(RasterSignals(*(column[at:] for column in columns)))
            for number in range(1, 13):
                await tap.play(unlike(mode, kind, number))
            assert told() == (0, 0, 1), (kind, begins)
            await tap.play(blank_frames(mode, 5))
            assert told() == (1, 0, 0), (kind, begins)
    await reset(dut)
    lost = 0
    longer = mode.model_copy(update={"v_back": mode.v_back + 1})
    for _ in range(6):
        await tap.play(blank_frames(mode, 7))
        lost += told() == (0, 0, 1)
        await tap.play(blank_frames(longer, 1))
    assert told() == (0, 0, 1)
    assert lost == 2
    await tap.play(blank_frames(mode, 12))
    assert told() == (1, 0, 0)


@for_entity("more_rows")
async def frames_reach_into_the_blanking(dut: Any) -> None:
    """Black lines below the picture; their number is right at the first pixel of a frame."""
    Clock(dut.clk, 10, "ns").start()
    tap = StreamTap(dut)
    for name in ("active", "h_sync", "v_sync", "pixel"):
        getattr(dut, name).value = 0
    await reset(dut)
    for mode in (
        at_the_limits("two more"),
        at_the_limits("none more", v_active=4, v_front=3, v_back=2),
        at_the_limits("all of the blanking", v_active=5, v_front=2, v_back=2),
    ):
        rows = mode.v_total - mode.v_total % CASE["modulus"]
        tap.taken.clear()
        tap.rows.clear()
        signals = tap.pictures(mode, 6)
        await tap.play(signals)
        # Three frames until a timing is followed; the last one is incomplete.
        assert tap.rows[-3:] == [rows] * 3, mode
        packed = signals.pixels.astype(int) @ (1, 256, 65536)
        total = mode.h_total * mode.v_total
        got = np.array(tap.taken)[2 + 3 * total :].reshape(-1)
        want = packed[3 * total :][: len(got) // 5]
        y, x = np.divmod(np.arange(len(want)), mode.h_total)
        in_rows = y % mode.v_total < rows
        first = (y % mode.v_total == 0) & (x == 0)
        last = in_rows & (x == mode.h_active - 1)
        assert np.array_equal(
            got.reshape(-1, 5)[:, :3], np.stack([want * in_rows, first, last], axis=1)
        ), mode


@for_entity("video_to_stream")
async def misses_are_counted(dut: Any) -> None:
    """A frame that begins at another time is a miss; two misses in a row cause a restart."""
    Clock(dut.clk, 10, "ns").start()
    tap = StreamTap(dut)
    mode = at_the_limits("moved")
    await reset(dut)
    await tap.play(tap.pictures(mode, 5))

    async def moved(clocks: int) -> None:
        """A frame that is longer, or shorter."""
        frame = tap.pictures(mode, 1)
        keep = np.r_[0 : len(frame.active) + min(clocks, 0)]
        if clocks > 0:
            keep = np.r_[keep, np.full(clocks, keep[-1])]
        await tap.play(RasterSignals(*(s[keep] for s in vars(frame).values())))

    # Single misses, repeatedly: it goes on.
    for clocks in (1, -1, 2):
        tap.taken.clear()
        await moved(clocks)
        await moved(-clocks)
        await tap.play(tap.pictures(mode, 1))
        assert sum(miss for *_, miss in tap.taken) == 1
        assert all(following for *_, following, _ in tap.taken)
    # Moved permanently.
    tap.taken.clear()
    await moved(1)
    await tap.play(tap.pictures(mode, 4))
    assert sum(miss for *_, miss in tap.taken) == 2
    following = [following for *_, following, _ in tap.taken]
    assert 0 in following
    assert following[-1]
    # A reset in a frame.
    await tap.play(RasterSignals(*(s[:20] for s in vars(tap.pictures(mode, 1)).values())))
    assert int(dut.following_running.value)
    dut.reset.value = 1
    await FallingEdge(dut.clk)
    assert not int(dut.following_running.value)
    dut.reset.value = 0
    tap.taken.clear()
    await tap.play(tap.pictures(mode, 3))
    assert not any(beat[3] for beat in tap.taken)


@for_entity("video_to_stream")
async def stream_is_reset_at_any_pixel(dut: Any) -> None:
    """A reset of one clock while video goes on: no stream until two more frames are measured."""
    Clock(dut.clk, 10, "ns").start()
    tap = StreamTap(dut)
    mode = at_the_limits("reset")
    total = mode.h_total * mode.v_total
    await reset(dut)
    for place in (0, 1, 2, 3, mode.h_active + 2, *tap.rng.choices(range(total), k=3)):
        signals = tap.pictures(mode, 10)
        begin = 4 * total + place

        def part(begin: int, end: int, signals: RasterSignals = signals) -> RasterSignals:
            return RasterSignals(*(s[begin:end] for s in vars(signals).values()))

        await tap.play(part(0, begin))
        assert int(dut.following_running.value)
        tap.taken.clear()
        dut.reset.value = 1
        await tap.play(part(begin, begin + 1))
        dut.reset.value = 0
        await tap.play(part(begin + 1, 7 * total))
        assert not any(any(beat) for beat in tap.taken), place
        await tap.play(part(7 * total, 10 * total))
        assert int(dut.following_running.value)
        assert not any(miss for *_, miss in tap.taken)
