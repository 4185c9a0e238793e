"""cocotb tests of the parts of the video path; each is for the entity that it names."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir.fpga.hdmi.link import RasterSignals, raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity
from plenofir_tb.video import COUNT_BITS, light_field, shrunken, timing_vector


async def reset(dut: Any, clocks: int = 2) -> None:
    """Reset, up to a falling clock."""
    dut.reset.value = 1
    await ClockCycles(dut.clk, clocks)
    await FallingEdge(dut.clk)
    dut.reset.value = 0


def random_mode(rng: random.Random) -> VideoMode:
    """A mode of some hundred pixels, both polarities of both syncs."""
    parts = {
        f"{d}_{part}": rng.randint(1, most)
        for d in "hv"
        for part, most in (("active", 9), ("front", 3), ("sync", 3), ("back", 3))
    }
    return shrunken(
        "random",
        **{**parts, "h_active": rng.randint(2, 16), "v_active": rng.randint(2, 9)},
        h_positive=rng.random() < 0.5,
        v_positive=rng.random() < 0.5,
    )


def blank_frames(mode: VideoMode, count: int) -> RasterSignals:
    """Signals of black frames."""
    return raster_signals(mode, [np.zeros((mode.v_active, mode.h_active, 3), np.uint8)] * count)


@for_entity("raster_generator")
async def rasters_of_any_mode(dut: Any) -> None:
    """Every output at every pixel, from starts and resets at any moment on."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.start.value = 0
    for _ in range(12):
        mode = random_mode(rng)
        dut.timing.value = timing_vector(mode)
        await reset(dut)
        levels = (int(not mode.h_positive), int(not mode.v_positive))
        for _ in range(rng.randrange(1, 5)):
            await FallingEdge(dut.clk)
            ports = (dut.running, dut.active, dut.frame_first, dut.line_last)
            assert [int(port.value) for port in ports] == [0] * 4
            assert (int(dut.h_sync.value), int(dut.v_sync.value)) == levels
        total = mode.h_total * mode.v_total
        signals = blank_frames(mode, 3)
        for clocks in (2 * total + rng.randrange(total), rng.randrange(1, 2 * total)):
            dut.start.value = 1
            for n in range(clocks):
                await FallingEdge(dut.clk)
                dut.start.value = 0
                y, x = divmod(n % total, mode.h_total)
                active = signals.active[n]
                got = [
                    int(getattr(dut, name).value)
                    for name in (
                        *("running", "row", "column", "active", "frame_first", "line_last"),
                        *("h_sync", "v_sync"),
                    )
                ]
                want = [
                    *(1, y, x, active, n % total == 0, active and x == mode.h_active - 1),
                    *(signals.h_sync[n], signals.v_sync[n]),
                ]
                assert got == want, f"{mode}, pixel {n}"


@for_entity("light_field_pattern")
async def pattern_from_its_equation(dut: Any) -> None:
    """Two frames from each reset on, also from one in the middle of a frame."""
    case = read_case()
    mode = shrunken("pattern", **case["mode"])
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.timing.value = timing_vector(mode)
    depths = tuple(case[f"{side}_shift"] for side in ("left", "middle", "right"))
    begins = case["middle_begin"], case["right_begin"]
    picture = light_field(mode, case["micro_image_size"], depths, begins)
    signals = raster_signals(mode, [picture] * 2)
    packed = signals.pixels.astype(int) @ (1, 256, 65536)
    for clocks in (rng.randrange(2, len(packed)), len(packed)):
        await reset(dut)
        assert not int(dut.active.value)
        # The raster starts a clock behind the reset, its pixels come a clock later.
        await ClockCycles(dut.clk, 2)
        await FallingEdge(dut.clk)
        for n in range(clocks):
            ports = (dut.active, dut.h_sync, dut.v_sync, dut.pixel)
            got = tuple(int(port.value) for port in ports)
            want = (signals.active[n], signals.h_sync[n], signals.v_sync[n], packed[n])
            assert got == want, f"pixel {n}"
            await FallingEdge(dut.clk)


class MeterSource:
    """Video into the timing meter.

    Parameters
    ----------
    dut
        The meter.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        # Whether the timing was stable, a clock behind each start of a frame.
        self.stable: list[int] = []

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
        """Send a signal."""
        dut = self.dut
        for a, h, v in zip(*(s.tolist() for s in (active, h_sync, v_sync)), strict=True):
            dut.active.value, dut.h_sync.value, dut.v_sync.value = int(a), int(h), int(v)
            await FallingEdge(dut.clk)
            if int(dut.frame_start.value):
                self.stable.append(int(dut.stable.value))

    async def frames(self, mode: VideoMode, count: int = 1) -> None:
        """Send regular frames."""
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
    # A reset: nothing is known of what came before.
    total = mode.h_total * mode.v_total
    for clocks in (1, 3 * mode.h_total, total - 1, total + 1, 4 * total - 1):
        signals = blank_frames(mode, 4)
        await source.play(*(s[:clocks] for s in (signals.active, signals.h_sync, signals.v_sync)))
        await source.reset(mode)
        await source.frames(mode, 5)
        # A frame that begins without a vertical sync before it is not known to begin.
        assert source.stable == [0, 0, 1, 1]


@for_entity("video_timing_meter")
async def irregular_frames_are_not_stable(dut: Any) -> None:
    """One line that differs makes the frame's timing unstable, two regular frames end that."""
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
            # A line of a pixel more, or of one less.
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
        # The start of the frame itself, told by the regular one before.
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
    longest = 2**COUNT_BITS - 1
    signals = blank_frames(mode, 1)
    # Lines of the last frame that have come, and clocks from then on until the timing is lost.
    for lines, clocks in ((2, (longest - 2) * line), (1, longest - line)):
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


def at_the_limits(name: str, **changes: int) -> VideoMode:
    """The mode that just meets the limits of the entity under test, or one with parts changed."""
    horizontal = {"h_active": 12, "h_front": 1, "h_sync": 1, "h_back": 1}
    vertical = {"v_active": 3, "v_front": 2, "v_sync": 1, "v_back": 1}
    return shrunken(name, **{**horizontal, **vertical, **changes})


class StreamTap:
    """Video into ``video_to_stream``, and all of its outputs.

    Parameters
    ----------
    dut
        The entity.
    """

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        self.stalls = 0.0
        self.taken: list[tuple[int, ...]] = []

    async def play(self, signals: RasterSignals) -> None:
        """Send a signal; what comes out is added to `taken`."""
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
            self.taken.append((*beat, int(dut.following.value), int(dut.miss.value)))

    def pictures(self, mode: VideoMode, count: int) -> RasterSignals:
        """Signals of random frames."""
        rng = np.random.default_rng(self.rng.randrange(1 << 32))
        shape = (count, mode.v_active, mode.h_active, 3)
        return raster_signals(mode, list(rng.integers(0, 256, shape, np.uint8)))


@for_entity("video_to_stream")
async def modes_at_the_limits(dut: Any) -> None:
    """Modes that just fit are streamed whole; those that just do not are told."""
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
            assert int(dut.timing.value) == timing_vector(mode)


@for_entity("video_to_stream")
async def misses_are_counted(dut: Any) -> None:
    """One frame that begins elsewhere is a miss, two in a row make it start anew."""
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

    # There and back, again and again: it goes on.
    for clocks in (1, -1, 2):
        tap.taken.clear()
        await moved(clocks)
        await moved(-clocks)
        await tap.play(tap.pictures(mode, 1))
        assert sum(miss for *_, miss in tap.taken) == 1
        assert all(following for *_, following, _ in tap.taken)
    # Moved for good.
    tap.taken.clear()
    await moved(1)
    await tap.play(tap.pictures(mode, 4))
    assert sum(miss for *_, miss in tap.taken) == 2
    following = [following for *_, following, _ in tap.taken]
    assert 0 in following
    assert following[-1]
    # A reset in a frame.
    await tap.play(RasterSignals(*(s[:20] for s in vars(tap.pictures(mode, 1)).values())))
    assert int(dut.following.value)
    dut.reset.value = 1
    await FallingEdge(dut.clk)
    assert not int(dut.following.value)
    dut.reset.value = 0
    tap.taken.clear()
    await tap.play(tap.pictures(mode, 3))
    assert not any(beat[3] for beat in tap.taken)


@for_entity("stream_to_video")
async def streams_with_faults_are_shown(dut: Any) -> None:
    """Missing, late and surplus pixels: told, black up to the next frame, which is right."""
    case = read_case()
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    mode = shrunken("shown", h_active=6, h_front=1, h_sync=2, h_back=1, v_active=4, v_back=2)
    total = mode.h_total * mode.v_total
    # From a position at the ports, which is of the clock to come, to its place at the output.
    delay = case["lines"] * mode.h_total + case["pixels"] + 2
    Clock(dut.clk, 10, "ns").start()
    position = 0
    beats: list[tuple[int, int]] = []
    # Beats that are left when one is not there in the clock in which it is wanted.
    gap = 0
    dut.timing.value = timing_vector(mode)

    async def run(clocks: int) -> np.ndarray:
        """Active, syncs, pixel, running, underflow of some clocks."""
        nonlocal position, gap
        seen = []
        for _ in range(clocks):
            dut.row.value, dut.column.value = divmod(position % total, mode.h_total)
            offer = len(beats) not in (0, gap)
            dut.s_axis_tvalid.value = int(offer)
            dut.s_axis_tdata.value, dut.s_axis_tuser.value = beats[0] if beats else (0, 0)
            await RisingEdge(dut.clk)
            if beats and int(dut.s_axis_tready.value):
                if offer:
                    beats.pop(0)
                else:
                    gap = 0
            position += 1
            await FallingEdge(dut.clk)
            ports = (dut.active, dut.h_sync, dut.v_sync, dut.pixel, dut.running, dut.underflow)
            seen.append([int(port.value) for port in ports])
        return np.array(seen)

    def frame() -> list[tuple[int, int]]:
        pixels = rng.integers(1, 1 << 24, mode.h_active * mode.v_active).tolist()
        return [(pixel, int(i == 0)) for i, pixel in enumerate(pixels)]

    async def show(sent: list[tuple[int, int]], shown: list[int], underflows: int) -> None:
        """A frame of the output under which beats are sent."""
        beats.extend(sent)
        got = await run(total)
        want = raster_signals(mode, [np.zeros((mode.v_active, mode.h_active, 3), np.uint8)])
        syncs = np.stack([want.active, want.h_sync, want.v_sync], axis=1)
        assert np.array_equal(got[:, :3], syncs)
        assert got[:, 4].all()
        assert got[want.active, 3].tolist() == shown
        assert not got[~want.active, 3].any()
        assert got[:, 5].sum() == underflows

    for _ in range(2):
        dut.following.value = 0
        await reset(dut)
        position = 0
        beats.clear()
        # Nothing is shown before the first frame is due.
        assert not (await run(total + 5)).any()
        position = 0
        dut.following.value = 1
        assert not (await run(delay)).any()
        good = frame()
        await show(good, [pixel for pixel, _ in good], 0)
        black = [0] * len(good)
        # A pixel that is late, and a frame that is missing.
        good = frame()
        gap = len(good) - 9
        await show(good, [*[pixel for pixel, _ in good[:9]], *black[9:]], 1)
        await show([], black, 1)
        good = frame()
        await show(good, [pixel for pixel, _ in good], 0)
        # Pixels too many take the place of the next frame, which so comes later.
        good, late = frame(), frame()
        await show([*good, *frame()[1:7], *late], [pixel for pixel, _ in good], 0)
        await show([], black, 1)
        await show([], [pixel for pixel, _ in late], 0)
        # A frame that is cut short; the next one waits for its place.
        short, good = frame()[:10], frame()
        await show([*short, *good], [*[pixel for pixel, _ in short], *black[10:]], 1)
        await show([], [pixel for pixel, _ in good], 0)
        # Without a source it goes on, black, whatever the timing says, and that is no fault: but
        # for the pixel that was due in the clock in which the source went.
        dut.following.value = 0
        dut.timing.value = 0
        await show([], black, 1)
        await show([], black, 0)
        dut.timing.value = timing_vector(mode)
        dut.following.value = 1
        good = frame()
        await show(good, [pixel for pixel, _ in good], 0)
        await run(mode.h_total + 2)
