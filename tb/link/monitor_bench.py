# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the reader of the monitor's EDID; each is for the entity that it names."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, First, RisingEdge, Timer
from cocotb.utils import get_sim_time

from link.edid_device import EdidDevice
from plenofir.fpga.hdmi.edid import DESCRIPTORS, make_edid
from plenofir.fpga.hdmi.modes import HD720, HD720_50, MODES, SVGA, VGA, XGA
from plenofir_tb.case import read_case
from plenofir_tb.drawn import drawn
from plenofir_tb.entities import for_entity
from plenofir_tb.hdmi.monitor import Mode, rate_of, read_monitor

CASE = read_case()
PERIOD_NS = 10
# Clocks of a division.
LONGEST = (1 << 13) + 3125 + (1 << 12) + 4
NOTHING = Mode(0, 0, 0)
NO_ANSWER, AN_EDID, NO_EDID, LINE_LOW = range(4)
SHOWN = {mode.name: Mode(mode.h_active, mode.v_active, rate) for mode, rate in (
    (VGA, 599), (SVGA, 603), (XGA, 600), (HD720_50, 500), (HD720, 600)
)}  # fmt: skip


@for_entity("timing_rate")
async def rates(dut: Any) -> None:
    """Standard modes, and random contents of the eight bytes."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, PERIOD_NS, "ns").start()
    dut.start.value = 0
    dut.reset.value = 1
    await ClockCycles(dut.clk, 3)
    dut.reset.value = 0
    timings = [(mode.pixel_clock // 10, mode.h_total, mode.v_total) for mode in MODES]
    assert [rate_of(*timing) for timing in timings] == [599, 603, 600, 500, 600]
    timings += [(65535, 8190, 8190), (1, 8190, 8190), (14850, 2200, 1125), (1, 0, 4), (1, 4, 0)]
    # At the limit, below it, above it; ties.
    timings += [(4095, 1000, 100), (4094, 1000, 100), (4096, 1000, 100), (65535, 7, 3)]
    timings += [(3, 800, 500), (3, 799, 501), (5, 1000, 1000)]
    timings += [
        (rng.randrange(1, 1 << 16), rng.randrange(600, 4000), rng.randrange(300, 3000))
        for _ in range(6)
    ]
    for pixel_clock, line_length, frame_lines in timings:
        dut.pixel_clock.value = pixel_clock
        dut.line_length.value = line_length
        dut.frame_lines.value = frame_lines
        await FallingEdge(dut.clk)
        dut.start.value = 1
        await FallingEdge(dut.clk)
        dut.start.value = 0
        longest = Timer(LONGEST * PERIOD_NS, "ns")
        assert await First(RisingEdge(dut.done), longest) is not longest
        await FallingEdge(dut.clk)
        want = rate_of(pixel_clock, line_length, frame_lines)
        assert int(dut.rate.value) == want, (pixel_clock, line_length, frame_lines)
        await FallingEdge(dut.clk)
        assert not int(dut.done.value)
    # After a reset there is no result, and the next one is right.
    dut.start.value = 1
    await FallingEdge(dut.clk)
    dut.start.value = 0
    await ClockCycles(dut.clk, 50)
    dut.reset.value = 1
    await ClockCycles(dut.clk, 1)
    dut.reset.value = 0
    quiet = Timer(LONGEST * PERIOD_NS, "ns")
    assert await First(RisingEdge(dut.done), quiet) is quiet


def with_checksums(content: bytes) -> bytes:
    """Blocks of 128 bytes with correct checksums."""
    blocks = [content[i : i + 127] for i in range(0, len(content), 128)]
    return b"".join(block + bytes([-sum(block) % 256]) for block in blocks)


def timing(mode: Any) -> bytes:
    """The detailed timing of a mode."""
    return make_edid((mode,))[DESCRIPTORS.start :][:18]


def monitor(
    *detailed: Any,
    established: int = 0,
    standard: tuple[int, ...] = (),
    extension: bytes | None = None,
) -> bytes:
    """An EDID with these timings and no others."""
    block = bytearray(make_edid((VGA,)))
    block[35:38] = established.to_bytes(2, "big") + b"\0"
    block[38:54] = b"\1\1" * 8
    for place, code in enumerate(standard):
        block[38 + 2 * place : 40 + 2 * place] = code.to_bytes(2, "big")
    for place in DESCRIPTORS:
        block[place : place + 18] = bytes([0, 0, 0, 0x10]).ljust(18, b"\0")
    for place, mode in zip(DESCRIPTORS, detailed, strict=False):
        block[place : place + 18] = timing(mode)
    block[126] = extension is not None
    return with_checksums(
        bytes(block) + (b"" if extension is None else extension.ljust(128, b"\0"))
    )


def cea(*codes: int, detailed: tuple[Any, ...] = (), audio: int = 3) -> bytes:
    """A CEA-861 extension: a block of another kind, codes of modes, detailed timings."""
    blocks = bytes([1 << 5 | audio, *[4] * audio, 2 << 5 | len(codes), *codes])
    if not codes:
        blocks = b""
    begin = 4 + len(blocks)
    return bytes([2, 3, begin, 0]) + blocks + b"".join(map(timing, detailed))


HD1080 = HD720.model_copy(
    update={"pixel_clock": 148_500, "h_active": 1920, "h_front": 88, "h_sync": 44, "h_back": 148,
            "v_active": 1080, "v_front": 4, "v_sync": 5, "v_back": 36}
)  # fmt: skip


class Reads:
    """The entity with a device on its lines."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.device = EdidDevice(dut, random.Random(cocotb.RANDOM_SEED))
        self.show(NOTHING)

    def show(self, mode: Mode) -> None:
        self.dut.shown_columns.value = mode.columns
        self.dut.shown_rows.value = mode.rows
        self.dut.shown_rate.value = mode.rate

    async def next(self) -> tuple[int, Mode, bool]:
        """Wait for the end of the next read; what it reports."""
        dut = self.dut
        if str(dut.scl_low.value) != "1":
            begin = Timer((CASE["pause"] + 50) * PERIOD_NS, "ns")
            assert await First(RisingEdge(dut.scl_low), begin) is not begin, "no read"
        # During a read, the clock line is released for no longer than this. Two blocks and their
        # addresses are 2,400 bits.
        idle = (CASE["stretch"] + 60) * PERIOD_NS
        begun = released = get_sim_time("ns")
        while True:
            if str(dut.scl_low.value) == "1":
                await FallingEdge(dut.scl_low)
                released = get_sim_time("ns")
            now = get_sim_time("ns")
            assert now - begun < 10_000 * 4 * CASE["quarter"] * PERIOD_NS, "a read without an end"
            left = max(self.device.clock_moved, released) + idle - now
            if left <= 0:
                break
            await Timer(left, "ns", round_mode="ceil")
        assert not int(dut.sda_low.value)
        return self.report()

    def report(self) -> tuple[int, Mode, bool]:
        dut = self.dut
        mode = Mode(*(int(port.value) for port in (dut.columns, dut.rows, dut.rate)))
        return int(dut.state.value), mode, bool(int(dut.offered.value))

    async def check(self, content: bytes, shown: Mode) -> None:
        """Read an EDID, and compare with the golden model."""
        self.device.content = content
        self.show(shown)
        want = read_monitor(content, shown)
        state = AN_EDID if want.is_edid else NO_EDID
        assert await self.next() == (state, want.preferred, want.offered)


async def begin(dut: Any) -> Reads:
    """Clock, device, reset."""
    Clock(dut.clk, PERIOD_NS, "ns").start()
    reads = Reads(dut)
    dut.reset.value = 1
    await ClockCycles(dut.clk, 5)
    await FallingEdge(dut.clk)
    dut.reset.value = 0
    assert reads.report() == (NO_ANSWER, NOTHING, False)
    return reads


@for_entity("monitor_edid")
async def edids_of_monitors(dut: Any) -> None:
    """A mode is found in each of its possible places, and not in others."""
    reads = await begin(dut)
    names = {name: shown for name, shown in SHOWN.items()}
    cases: list[tuple[bytes, str, bool]] = [
        (make_edid(), HD720.name, True),
        (monitor(HD1080, HD720), HD720.name, True),
        (monitor(HD1080, HD720), HD720_50.name, False),
        (monitor(HD1080, VGA, XGA, HD720_50), HD720_50.name, True),
        (monitor(HD1080, established=0x2108), VGA.name, True),
        (monitor(HD1080, established=0x2108), XGA.name, True),
        (monitor(HD1080, established=0xDEF7), SVGA.name, False),
        (monitor(HD1080, standard=(0x6140, 0x3140)), VGA.name, True),
        (monitor(HD1080, standard=(*[0x8180] * 7, 0x4540)), SVGA.name, True),
        (monitor(HD1080, standard=(0x4061, 0x8100, 0x814A)), HD720.name, False),
        (monitor(HD1080, extension=cea(16, 4, 31)), HD720.name, True),
        (monitor(HD1080, extension=cea(16, 31, 0x93)), HD720_50.name, True),
        (monitor(HD1080, extension=cea(16, 31)), HD720.name, False),
        # A 4 in an audio block, in a tag, or after the blocks is not the code of a mode.
        (monitor(HD1080, extension=cea(16, audio=6, detailed=(XGA,))), HD720.name, False),
        (monitor(HD1080, extension=cea(16, detailed=(XGA, HD720))), HD720.name, True),
        (monitor(HD1080, extension=cea(detailed=(XGA, HD720))), HD720.name, True),
        (monitor(HD1080, extension=bytes([2, 3, 0, 0, 0x41, 4])), HD720.name, False),
        (monitor(HD1080, extension=bytes([0x70, 3, 7, 0, 0x41, 4])), HD720.name, False),
        (monitor(), VGA.name, False),
    ]
    for content, name, offered in drawn(cases, 8):
        assert read_monitor(content, names[name]).offered == offered, name
        device = reads.device
        device.starts = device.stops = device.clocks = 0
        device.written.clear()
        await reads.check(content, names[name])
        # Nine clocks, a stop, a start and two bytes, a start and a byte, what is read, a stop.
        assert (device.starts, device.stops) == (2, 2)
        assert device.clocks == 9 + 1 + 1 + 18 + 1 + 9 + 9 * len(content) + 1
        assert device.written == [0xA0, 0, 0xA1]
    # Within 1 Hz, and of the same size.
    sizes = [
        (monitor(HD720), SHOWN[HD720.name]),
        (monitor(established=0x2000), SHOWN[VGA.name]),
    ]
    for content, shown in drawn(sizes, 1):
        columns, rows, rate = shown
        for change, offered in ((-11, False), (-10, True), (10, True), (11, False)):
            other = Mode(columns, rows, rate + change)
            assert read_monitor(content, other).offered == offered
            await reads.check(content, other)
        await reads.check(content, Mode(columns + 1, rows, rate))
        await reads.check(content, Mode(columns, rows + 1, rate))


@for_entity("monitor_edid")
async def wrong_edids(dut: Any) -> None:
    """Headers and checksums, of both blocks."""
    rng = random.Random(cocotb.RANDOM_SEED)
    reads = await begin(dut)
    good = monitor(HD720, extension=cea(4, 19, detailed=(XGA,)))
    shown = SHOWN[HD720.name]
    places = [0, 127, 255, rng.randrange(1, 126), rng.randrange(128, 255)]
    for place in places:
        wrong = bytearray(good)
        wrong[place] ^= 1 << rng.randrange(8)
        assert not read_monitor(wrong, shown).is_edid
        await reads.check(bytes(wrong), shown)
    await reads.check(bytes(256), shown)
    await reads.check(good, shown)
    # Random bytes: as in the golden model, and the read ends.
    for _ in range(2):
        noise = with_checksums(good[:8] + rng.randbytes(118) + b"\1" + b"\0" + rng.randbytes(128))
        await reads.check(noise, shown)


@for_entity("monitor_edid")
async def faults_of_the_lines(dut: Any) -> None:
    """Each fault is reported, releases the lines, and does not affect the next read."""
    rng = random.Random(cocotb.RANDOM_SEED)
    reads = await begin(dut)
    device = reads.device
    content = make_edid()
    good = (AN_EDID, Mode(1280, 720, 600), True)
    shown = SHOWN[HD720.name]
    reads.show(shown)

    async def works() -> None:
        device.content = content
        device.silent_after = device.refuse = None
        device.scl_stuck = device.sda_stuck = False
        device.update()
        assert await reads.next() == good

    # No monitor; then one is connected.
    assert await reads.next() == (NO_ANSWER, NOTHING, False)
    await works()
    # Disconnected; not acknowledging; falling silent.
    device.content = None
    assert await reads.next() == (NO_ANSWER, NOTHING, False)
    for number in range(2):
        await works()
        device.refuse = number
        assert await reads.next() == (NO_ANSWER, NOTHING, False)
    await works()
    device.silent_after = rng.randrange(1, 128)
    assert await reads.next() == (NO_EDID, NOTHING, False)
    # A line is low from the beginning.
    for line in ("scl_stuck", "sda_stuck"):
        await works()
        setattr(device, line, True)
        device.update()
        for _ in range(2):
            assert await reads.next() == (LINE_LOW, NOTHING, False)
            assert (str(dut.scl_low.value), str(dut.sda_low.value)) == ("0", "0")
    # The clock line is low from the first byte on.
    await works()
    await RisingEdge(dut.scl_low)
    await ClockCycles(dut.clk, 60 * 4 * CASE["quarter"] + rng.randrange(1000))
    device.scl_stuck = True
    device.update()
    assert (await reads.next())[0] == LINE_LOW
    # A device in the middle of a byte of zeros holds the data line until it gets clocks.
    await works()
    device.send_from_reset(0x00)
    await works()
    # A clock stretched as long as allowed.
    device.stretch_ns = (CASE["stretch"] - 20) * PERIOD_NS
    await works()
    device.stretch_ns = 0
    # A reset releases the lines at once and starts again.
    await RisingEdge(dut.scl_low)
    await Timer(rng.randrange(20000, 60000), "ns")
    await FallingEdge(dut.clk)
    dut.reset.value = 1
    await FallingEdge(dut.clk)
    assert (int(dut.scl_low.value), int(dut.sda_low.value)) == (0, 0)
    assert reads.report() == (NO_ANSWER, NOTHING, False)
    dut.reset.value = 0
    pause = ClockCycles(dut.clk, CASE["pause"] - 1)
    assert await First(RisingEdge(dut.scl_low), pause) is pause
    assert reads.report() == (NO_ANSWER, NOTHING, False)
    await works()


@for_entity("monitor_edid")
async def slow_enough(dut: Any) -> None:
    """Two quarters of a bit high, two low; data changes a quarter from the edges."""
    reads = await begin(dut)
    device = reads.device
    device.content = make_edid()
    quarter_ns = CASE["quarter"] * PERIOD_NS
    times: dict[str, list[float]] = {"rise": [], "fall": [], "data": []}

    def now() -> float:
        # The simulator's steps are not exact fractions of a ns.
        return round(float(cocotb.utils.get_sim_time("ns")), 3)

    async def watch(trigger: Any, name: str) -> None:
        while True:
            await trigger
            times[name].append(now())

    for trigger, name in (
        (FallingEdge(dut.scl_low), "rise"),
        (RisingEdge(dut.scl_low), "fall"),
        (RisingEdge(dut.sda_low), "data"),
        (FallingEdge(dut.sda_low), "data"),
    ):
        cocotb.start_soon(watch(trigger, name))
    assert (await reads.next())[0] == AN_EDID
    # The clock line is low before the first rise; it is seen high three clocks after it was let go.
    lows = [rise - fall for fall, rise in zip(times["fall"], times["rise"], strict=True)]
    assert min(lows) == sorted(lows)[len(lows) // 2] == 2 * quarter_ns
    highs = {fall - rise for rise, fall in zip(times["rise"], times["fall"][1:], strict=False)}
    assert highs == {2 * quarter_ns + 3 * PERIOD_NS}
    edges = sorted(times["rise"] + times["fall"])
    assert times["data"]
    assert min(abs(t - edge) for t in times["data"] for edge in edges) == quarter_ns


@for_entity("monitor_edid")
async def limits_of_times(dut: Any) -> None:
    """The pause before a read, and how long a clock line may stay low, to a few clocks."""
    reads = await begin(dut)
    reads.device.content = make_edid()

    def clock_of() -> float:
        return round(float(cocotb.utils.get_sim_time("ns")) / PERIOD_NS, 3)

    reset = clock_of()
    await RisingEdge(dut.scl_low)
    assert CASE["pause"] - 1 < clock_of() - reset <= CASE["pause"]
    reads.device.scl_stuck = True
    reads.device.update()
    await FallingEdge(dut.scl_low)
    released = clock_of()
    await dut.state.value_change
    assert int(dut.state.value) == LINE_LOW
    assert CASE["stretch"] <= clock_of() - released <= CASE["stretch"] + 1
    ended = clock_of()
    await RisingEdge(dut.scl_low)
    assert CASE["pause"] <= clock_of() - ended <= CASE["pause"] + 1
    # A reset in a clock near the end of a read: there is no report.
    for early in range(4):
        await FallingEdge(dut.scl_low)
        await ClockCycles(dut.clk, round(ended - released) - early)
        await FallingEdge(dut.clk)
        dut.reset.value = 1
        await FallingEdge(dut.clk)
        dut.reset.value = 0
        await ClockCycles(dut.clk, 5)
        assert reads.report() == (NO_ANSWER, NOTHING, False), early
        await RisingEdge(dut.scl_low)
