# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``refocus_video``: video in, refocused video under the same timing out."""

from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import FallingEdge

from plenofir.fpga.hdmi.link import RasterSignals, raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.by_place import chosen
from plenofir.refocus.sharpness import depth_index
from plenofir_tb.case import read_case
from plenofir_tb.levels import levels
from plenofir_tb.slices import SliceModel
from plenofir_tb.video import VideoBench, part, shrunken

CASE = read_case()
# Whole frames from a new signal to the first one that is refocused: two are measured.
FRAMES_TO_FOLLOW = 3
MINI_BLANK = shrunken("mini").h_total - shrunken("mini").h_active


class Bench(VideoBench):
    """Video source, design, video sink."""

    def __init__(self, dut: Any) -> None:
        super().__init__(dut)
        self.slice = self.shown = 0

    def golden(self, picture: np.ndarray) -> np.ndarray:
        arithmetic = (
            StoredProductArithmetic(fraction_bits=4, guard_bits=2)
            if CASE["stored"]
            else ExactArithmetic()
        )
        m, shifts, boxes = CASE["m"], CASE["shifts"], CASE["boxes"]
        kind = CASE["outputs"][self.shown]
        if kind == "r" and not boxes:
            return arithmetic.refocus(picture, m, shift=shifts[self.slice], order=CASE["order"])
        stack = np.stack([arithmetic.refocus(picture, m, shift=shift) for shift in shifts])
        sharp = [
            arithmetic.refocus(picture, m, shift=shift, box=box)
            for shift, box in zip(shifts, boxes, strict=False)
        ]
        found = depth_index(
            stack,
            m,
            CASE["radius"],
            confidence=CASE["confidence"],
            vote_radius=CASE["vote_radius"],
            shifts=shifts if CASE["between"] else (),
            sharp=np.stack(sharp) if boxes else None,
        )
        if kind == "a":
            return found.image
        if kind == "r":
            number = self.slice
            return chosen(sharp[number], stack[number], found.sharp_in(number), m)
        rows, columns = picture.shape[:2]
        colour = found.index.astype(int)
        if found.fraction is not None:
            # Eight colours of each slice.
            colour = 8 * colour + found.fraction // 32
        index = colour.repeat(m, 0).repeat(m, 1)[:rows, :columns]
        return np.array(CASE["colours"], np.uint8)[index]

    async def play(self, mode: VideoMode, frames: list[np.ndarray]) -> None:
        await self.tap.drive(raster_signals(mode, frames))


@cocotb.test()
async def every_frame_is_refocused(dut: Any) -> None:
    """From the third whole frame on, every frame equals the golden model, under its timing."""
    bench = Bench(dut)
    await bench.reset()
    mode = VideoMode.model_validate(CASE["mode"])
    frames = bench.pictures(mode, 7)
    signals = raster_signals(mode, frames)
    # The source was on before, so the first frame is incomplete.
    await bench.tap.drive(part(signals, bench.random.randrange(1, mode.h_total * mode.v_active)))
    got = bench.tap.frames(from_start=True)
    # Two frames are measured after the incomplete one; the last one is incomplete too.
    assert len(got) == len(frames) - FRAMES_TO_FOLLOW - 1
    for picture, frame in zip(frames[FRAMES_TO_FOLLOW:], got, strict=False):
        assert np.array_equal(frame.pixels, bench.golden(picture))
        assert frame.mode == mode.as_measured()
    assert not bench.errors
    assert int(dut.following.value)
    assert not int(dut.unsupported.value)


@cocotb.test(skip=not CASE["thorough"])
async def modes_change(dut: Any) -> None:
    """Another size, then another blanking: followed again after three whole frames."""
    bench = Bench(dut)
    await bench.reset()
    modes = [
        shrunken("one"),
        shrunken("two", h_active=57, v_active=25, h_positive=False),
        shrunken("three", h_active=57, v_active=25, h_positive=False, h_front=9),
        shrunken("four", h_active=57, v_active=30, v_positive=False, v_back=9),
    ]
    for mode in modes:
        frames = bench.pictures(mode, FRAMES_TO_FOLLOW + 3)
        bench.tap.taken = []
        signals = raster_signals(mode, frames)
        half = int((FRAMES_TO_FOLLOW + 0.5) * mode.h_total * mode.v_total)
        await bench.tap.drive(part(signals, 0, half))
        bench.tap.taken = []
        bench.errors.clear()
        await bench.tap.drive(part(signals, half))
        got = bench.tap.frames()
        assert got, mode.name
        assert np.array_equal(got[0].pixels, bench.golden(frames[FRAMES_TO_FOLLOW + 1])), mode.name
        assert got[0].mode == mode.as_measured()
        assert not bench.errors


@cocotb.test(skip=not CASE["thorough"])
async def bit_errors_stay_where_they_are(dut: Any) -> None:
    """Gaps in data enable and wrong syncs: the raster stays, only the affected pixels are wrong."""
    bench = Bench(dut)
    await bench.reset()
    mode = shrunken("mini")
    frames = bench.pictures(mode, 10)
    signals = raster_signals(mode, frames)
    total = mode.h_total * mode.v_total
    active, pixels = signals.active.copy(), signals.pixels.copy()
    h_sync, v_sync = signals.h_sync.copy(), signals.v_sync.copy()
    hit = [frame.copy() for frame in frames]
    for frame in (5, 6):
        for _ in range(3):
            y, x = bench.random.randrange(mode.v_active), bench.random.randrange(1, mode.h_active)
            at = frame * total + y * mode.h_total + x
            active[at] = False
            hit[frame][y, x] = 0
            # And one in the blanking, with a pixel that nobody may see.
            blank = frame * total + y * mode.h_total + mode.h_active + 8
            active[blank], pixels[blank] = True, 255
            h_sync[blank + 3] ^= True
            v_sync[blank + 5] ^= True
    await bench.tap.drive(RasterSignals(active, h_sync, v_sync, pixels))
    # The signal begins with a line, not known to be the first: three frames are measured.
    got = bench.tap.frames(from_start=True)
    assert len(got) == len(frames) - FRAMES_TO_FOLLOW - 1
    for i, (picture, frame) in enumerate(zip(hit[FRAMES_TO_FOLLOW:], got, strict=False)):
        assert np.array_equal(frame.pixels, bench.golden(picture)), f"frame {i}"
        assert frame.mode == mode.as_measured()


@cocotb.test(skip=not CASE["thorough"])
async def input_lost_and_back(dut: Any) -> None:
    """No input for a while: the raster goes on in black; then the picture is back, at any phase."""
    bench = Bench(dut)
    await bench.reset()
    mode = shrunken("mini")
    total = mode.h_total * mode.v_total
    frames = bench.pictures(mode, 6)
    await bench.play(mode, frames)
    cut = bench.random.randrange(total)
    await bench.tap.drive(part(raster_signals(mode, bench.pictures(mode, 1)), 0, cut))
    idle = raster_signals(mode, [np.zeros_like(frames[0])] * 5)
    nothing = RasterSignals(
        np.zeros_like(idle.active), idle.h_sync & False, idle.v_sync & False, idle.pixels
    )
    bench.tap.taken = []
    await bench.tap.drive(nothing)
    black = bench.tap.frames()
    assert not int(dut.following.value)
    assert len(black) >= 3
    assert all(frame.mode == mode.as_measured() for frame in black)
    assert not black[-1].pixels.any()
    await bench.tap.drive(part(nothing, 0, bench.random.randrange(1, total)))
    bench.tap.taken = []
    frames = bench.pictures(mode, FRAMES_TO_FOLLOW + 3)
    signals = raster_signals(mode, frames)
    half = int((FRAMES_TO_FOLLOW + 0.5) * total)
    await bench.tap.drive(part(signals, 0, half))
    bench.tap.taken = []
    bench.errors.clear()
    await bench.tap.drive(part(signals, half))
    got = bench.tap.frames()
    assert np.array_equal(got[0].pixels, bench.golden(frames[FRAMES_TO_FOLLOW + 1]))
    assert not bench.errors


@cocotb.test(skip=not CASE["thorough"])
async def slices_change_between_frames(dut: Any) -> None:
    """Focus is stepped in the middle of frames: the next frame shows it, none is disturbed.

    Where there are several outputs, another one comes with the next frame that leaves.
    """
    bench = Bench(dut)
    await bench.reset()
    mode = shrunken("mini")
    total = mode.h_total * mode.v_total
    slices, outputs = len(CASE["shifts"]), len(CASE["outputs"])
    frames = bench.pictures(mode, FRAMES_TO_FOLLOW + 7)
    signals = raster_signals(mode, frames)
    wanted, tags = [], []
    begin = 0
    model = SliceModel(slices)
    told = cocotb.start_soon(frames_told(dut, tags))
    for picture in frames[FRAMES_TO_FOLLOW:]:
        chosen = {
            "slice": bench.random.randrange(slices + 2),
            "sweep": bench.random.randrange(2),
            "sweep_frames": bench.random.randrange(3),
        }
        # After the previous frame has begun at the output.
        late = CASE["delay_lines"] * mode.h_total + 100
        at = (FRAMES_TO_FOLLOW + len(wanted)) * total - bench.random.randrange(8, total - late)
        await bench.tap.drive(part(signals, begin, at))
        begin = at
        shown = bench.random.randrange(4)
        for name, value in {**chosen, "shown": shown}.items():
            getattr(dut, name).value = value
        bench.slice = model.next_frame(*chosen.values())
        bench.shown = shown if shown < outputs else 0
        wanted.append((bench.slice, bench.shown, bench.golden(picture)))
    await bench.tap.drive(part(signals, begin))
    told.cancel()
    got = bench.tap.frames(from_start=True)
    for i, (want, frame) in enumerate(zip(wanted[-len(got) - 1 :], got, strict=False)):
        assert np.array_equal(frame.pixels, want[2]), f"frame {i}"
        assert frame.mode == mode.as_measured()
    assert len(got) == len(wanted) - 1
    assert tags[-len(wanted) :] == [(*want[:2], 0) for want in wanted]
    assert not bench.errors


async def frames_told(dut: Any, tags: list[tuple[int, ...]]) -> None:
    """Slice, output and whether it is raw, as reported at the first pixel of each frame."""
    blank_lines, was = 1000, 0
    edge, read = FallingEdge(dut.clk), levels(dut.out_active)
    while True:
        await edge
        active = read() == "1"
        blank_lines = 0 if active else blank_lines + 1
        # Longer than a line's blanking: the first pixel after is that of a frame.
        if active and was > 2 * MINI_BLANK:
            names = ("on_show_slice", "on_show_place", "on_show_raw")
            tags.append(tuple(int(getattr(dut, name).value) for name in names))
        was = blank_lines


@cocotb.test(skip=not CASE["thorough"])
async def passed_through(dut: Any) -> None:
    """With pass_through, and with lines that are too long, the input is passed unchanged."""
    bench = Bench(dut)
    await bench.reset()
    for long in (False, True):
        mode = shrunken("long", h_active=CASE["max_columns"] + 1) if long else shrunken("mini")
        dut.pass_through.value = int(not long)
        frames = bench.pictures(mode, 6)
        bench.tap.taken = []
        signals = raster_signals(mode, frames)
        half = int(2.5 * mode.h_total * mode.v_total)
        await bench.tap.drive(part(signals, 0, half))
        bench.tap.taken = []
        await bench.tap.drive(part(signals, half))
        assert int(dut.unsupported.value) == long
        got = bench.tap.frames()
        assert np.array_equal(got[0].pixels, frames[3])
        assert got[0].mode == mode.as_measured()
        assert not int(dut.following.value) or not long
    # A reset makes the output black at once, as long as it lasts.
    dut.pass_through.value = 1
    await bench.tap.drive(part(signals, 0, 5))
    assert int(dut.out_active.value)
    dut.reset.value = 1
    for _ in range(2):
        await FallingEdge(dut.clk)
        assert not int(dut.out_active.value)
    dut.reset.value = 0
    await FallingEdge(dut.clk)
    assert int(dut.out_active.value)
