# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the parts of the video path; each is for the entity that it names."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, Timer

from plenofir.fpga.hdmi import marks
from plenofir.fpga.hdmi.link import raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity
from plenofir_tb.video import (
    VideoTap,
    blank_frames,
    light_field,
    random_mode,
    reset,
    shrunken,
    timing_vector,
)


@for_entity("picture_marks")
async def marked_pictures(dut: Any) -> None:
    """Marks unchanged, with other colours, damaged; the bar, and pictures without marks."""
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    tap = VideoTap(dut, sink="out")
    shown = VideoTap(dut, source="shown")
    mode = shrunken(
        "marks",
        **{"h_active": 40, "h_front": 3, "h_sync": 2, "h_back": 4},
        **{"v_active": 9, "v_front": 1, "v_sync": 1, "v_back": 1},
    )
    await reset(dut)
    for number in range(12):
        picture = rng.integers(0, 256, (mode.v_active, mode.h_active, 3), np.uint8)
        picture = marks.mark(picture)
        line = picture[0]
        kind = number % 6
        if kind == 1:  # Limited range.
            line[:] = np.round(16 + line / 255 * 219)
        elif kind == 2:  # One bit of one place.
            line[rng.integers(mode.h_active), rng.integers(3)] ^= 1
        elif kind == 3:  # Moved by a place.
            line[:] = np.roll(line, 1, axis=0)
        elif kind == 4:  # Scaled: every place twice.
            line[:] = np.repeat(line, 2, axis=0)[: mode.h_active]
        elif kind == 5:
            line[:] = rng.integers(0, 256, line.shape)
        told = marks.judge(line)
        assert told == (2, 1, 1, 0, 0, 0)[kind]
        signals = raster_signals(mode, [picture] * 3)
        driving = cocotb.start_soon(shown.drive(signals))
        await tap.drive(signals)
        await driving
        assert int(dut.marks.value) == told
        got = tap.frames()
        want = picture.copy()
        if told:
            want[: read_case()["lines"]] = (marks.CHANGED_BAR, marks.EQUAL_BAR)[told - 1]
        assert np.array_equal(got[-1].pixels, want), kind


@for_entity("raster_generator")
async def rasters_of_any_mode(dut: Any) -> None:
    """Every output at every pixel, after starts and resets at any time."""
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.timing.value = 0
    await FallingEdge(dut.clk)
    for number in range(12):
        mode = random_mode(rng)
        # A start in the clock of the reset is ignored.
        dut.start.value = number // 4 % 2
        await reset(dut, 1)
        dut.start.value = 0
        dut.timing.value = timing_vector(mode)
        levels = (int(not mode.h_positive), int(not mode.v_positive))
        await Timer(1, "ns")
        for _ in range(rng.randrange(1, 5)):
            ports = (dut.running, dut.active, dut.frame_first, dut.line_last)
            assert [int(port.value) for port in ports] == [0] * 4
            assert (int(dut.h_sync.value), int(dut.v_sync.value)) == levels
            await FallingEdge(dut.clk)
        total = mode.h_total * mode.v_total
        signals = blank_frames(mode, 4)
        # The reset comes in the place of a pixel that is something special, or any.
        syncs = (mode.v_active + mode.v_front) * mode.h_total + mode.h_active + mode.h_front
        places = [0, mode.h_active - 1, syncs, rng.randrange(total)]
        # So does the start before, behind that pixel.
        place = 2 * total + places[number % 4]
        for clocks in (place + 1, place):
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


@for_entity("camera_timing")
async def frames_wait_for_a_camera(dut: Any) -> None:
    """Frames any number of clocks apart, and then none: lines are always whole."""
    rng = random.Random(cocotb.RANDOM_SEED)
    late = read_case()["late"]
    mode = random_mode(rng)
    total = mode.h_total * mode.v_total
    Clock(dut.clk, 10, "ns").start()
    dut.timing.value, dut.due.value = timing_vector(mode), 0
    await reset(dut, 1)
    # Little more or less than a frame, and anywhere in one.
    apart = [total + rng.randint(-mode.h_total, mode.h_total) for _ in range(5)]
    apart += [rng.randrange(2 * mode.h_total, total) for _ in range(3)]
    dues = {1 + sum(apart[: n + 1]) for n in range(len(apart))}
    clocks = sum(apart) + 2 * (total + late * mode.h_total)
    row, column, waiting = 0, 0, False
    for clock in range(clocks):
        dut.due.value = int(clock in dues)
        await FallingEdge(dut.clk)
        place = int(dut.following_row.value), int(dut.following_column.value)
        assert dut.following_running.value == 1
        assert place == (row, column), (mode, clock)
        waiting = waiting or clock in dues
        column += 1
        if column == mode.h_total:
            row, column = row + 1, 0
            if waiting or row == mode.v_total + late:
                row, waiting = 0, False


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
    # A reset of one clock, before a pixel of the picture.
    ends = rng.choice(np.flatnonzero(signals.active[1:-1] & signals.active[2:])) + 1
    for clocks in (ends, len(packed)):
        await reset(dut, 1 if clocks == len(packed) else 3)
        assert not int(dut.active.value)
        # The raster starts a clock after the reset, its pixels come a clock later.
        await ClockCycles(dut.clk, 2)
        await FallingEdge(dut.clk)
        for n in range(clocks):
            ports = (dut.active, dut.h_sync, dut.v_sync, dut.pixel)
            got = tuple(int(port.value) for port in ports)
            want = (signals.active[n], signals.h_sync[n], signals.v_sync[n], packed[n])
            assert got == want, f"pixel {n}"
            await FallingEdge(dut.clk)


@for_entity("stream_to_video")
async def streams_with_faults_are_shown(dut: Any) -> None:
    """Missing, late and surplus pixels: reported, black up to the next frame, which is right."""
    case = read_case()
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    mode = shrunken("shown", h_active=6, h_front=1, h_sync=2, h_back=1, v_active=4, v_back=2)
    total = mode.h_total * mode.v_total
    # Clocks from a position at the ports, which is that of the next clock, to its pixel at the
    # output.
    delay = case["lines"] * mode.h_total + case["pixels"] + 2
    Clock(dut.clk, 10, "ns").start()
    position = 0
    beats: list[tuple[int, int]] = []
    # Beats left when one is missing in its clock.
    gap = 0
    dut.following_timing.value = timing_vector(mode)
    dut.delay_lines.value = case["lines"]
    dut.picture_columns.value = dut.picture_rows.value = 0

    async def run(clocks: int) -> np.ndarray:
        """Active, syncs, pixel, running, underflow of some clocks."""
        nonlocal position, gap
        seen = []
        for _ in range(clocks):
            dut.following_row.value, dut.following_column.value = divmod(
                position % total, mode.h_total
            )
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

    async def reset_now() -> None:
        """A clock of reset."""
        nonlocal position
        dut.reset.value = 1
        active, _, _, _, running, underflow = (await run(1))[0]
        dut.reset.value = 0
        assert (active, running, underflow) == (0, 0, 0)
        # Not synchronised: beats that do not start a frame are dropped at once.
        dut.s_axis_tvalid.value, dut.s_axis_tuser.value = 1, 0
        await Timer(1, "ns")
        assert int(dut.s_axis_tready.value)
        position = 0
        beats.clear()

    dut.following_running.value = 0
    await FallingEdge(dut.clk)
    # At first, where a pixel is missing, and in the clock in which the raster begins again.
    for sent, clocks in ((8, mode.h_total + 2), (24, total - 2), (0, 0)):
        await reset_now()
        dut.following_running.value = 0
        # Nothing is shown before the first frame is due.
        assert not (await run(total + 5)).any()
        position = 0
        dut.following_running.value = 1
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
        # Surplus pixels delay the next frame.
        good, late = frame(), frame()
        await show([*good, *frame()[1:7], *late], [pixel for pixel, _ in good], 0)
        await show([], black, 1)
        await show([], [pixel for pixel, _ in late], 0)
        # A frame that is cut short; the next one waits for its position.
        short, good = frame()[:10], frame()
        await show([*short, *good], [*[pixel for pixel, _ in short], *black[10:]], 1)
        await show([], [pixel for pixel, _ in good], 0)
        # Without a source it goes on in black, whatever the timing, without a fault, except for the
        # pixel of the clock in which the source disappeared.
        dut.following_running.value = 0
        dut.following_timing.value = 0
        await show([], black, 1)
        await show([], black, 0)
        dut.following_timing.value = timing_vector(mode)
        dut.following_running.value = 1
        good = frame()
        await show(good, [pixel for pixel, _ in good], 0)
        beats.extend(frame()[:sent])
        await run(clocks)


@for_entity("window")
async def pictures_in_the_middle(dut: Any) -> None:
    """Pictures with black around; one that does not fit is reported and dropped."""
    case = read_case()
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    mode = shrunken("shown", h_active=7, h_front=1, h_sync=2, h_back=2, v_active=5, v_back=2)
    total = mode.h_total * mode.v_total
    Clock(dut.clk, 10, "ns").start()
    dut.following_timing.value = timing_vector(mode)
    dut.delay_lines.value = case["lines"]
    dut.following_running.value = 1
    dut.s_axis_tvalid.value = 0
    active = raster_signals(mode, [np.zeros((5, 7, 3), np.uint8)]).active
    for columns, rows in ((4, 3), (7, 5), (8, 5), (1, 1), (7, 6), (4, 0), (8, 6), (3, 5)):
        fits = columns <= 7 and 1 <= rows <= 5
        dut.picture_columns.value, dut.picture_rows.value = columns, rows
        await reset(dut)
        beats: list[tuple[int, int]] = []
        sent: list[list[int]] = []
        shown = []
        for position in range(4 * total + case["lines"] * mode.h_total + case["pixels"] + 3):
            if not beats:
                sent.append(rng.integers(1, 1 << 24, max(columns * rows, 1)).tolist())
                beats = [(pixel, int(i == 0)) for i, pixel in enumerate(sent[-1])]
            dut.following_row.value, dut.following_column.value = divmod(
                position % total, mode.h_total
            )
            dut.s_axis_tvalid.value = 1
            dut.s_axis_tdata.value, dut.s_axis_tuser.value = beats[0]
            await RisingEdge(dut.clk)
            assert int(dut.too_large.value) == (not fits), (columns, rows)
            if int(dut.s_axis_tready.value):
                beats.pop(0)
            await FallingEdge(dut.clk)
            assert not int(dut.underflow.value)
            shown.append(int(dut.pixel.value))
        got = np.array(shown[-4 * total :]).reshape(4, total)
        assert not got[:, ~active].any()
        for number, frame in enumerate(got[:, active]):
            want = np.zeros((5, 7), int)
            if fits:
                picture = np.reshape(sent[number], (rows, columns))
                top, left = (5 - rows) // 2, (7 - columns) // 2
                want[top : top + rows, left : left + columns] = picture
            assert np.array_equal(frame.reshape(5, 7), want), (columns, rows)
        if not fits:
            assert len(sent) * columns * max(rows, 1) > 4 * total, "a picture too large waits"


@for_entity("mode_ports")
async def timing_of_a_mode(dut: Any) -> None:
    """Every count of a mode, from values as in data sheets."""
    await Timer(1, "ns")
    mode = VideoMode.model_validate(read_case()["mode"])
    assert int(dut.timing.value) == timing_vector(mode)
