# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``refocus_video`` with a sensor: every pixel of every frame that is shown."""

from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import FallingEdge

from plenofir.camera.resampling import (
    Tables,
    grid_registers,
    interpolate_mosaic,
    resample,
    tables_of,
)
from plenofir.fpga.hdmi.link import RasterSignals, raster_signals
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.plan.sensor.board_sensor import SENSOR_BLANK_LINES
from plenofir.plan.sensor.chip import loads
from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration
from plenofir.refocus import ExactArithmetic
from plenofir_tb.case import read_case
from plenofir_tb.shown_sensor import ShownCamera
from plenofir_tb.video import VideoBench, part

CASE = read_case()
# Whole frames from a new signal to the first one that is shown.
FRAMES_TO_FOLLOW = 3
REFOCUSED, ALIGNED = 0, 1
MODE = VideoMode.model_validate(CASE["mode"])
SHAPE = (MODE.v_active, MODE.h_active)


class Bench(VideoBench):
    """Source of raw video, design, video sink."""

    def __init__(self, dut: Any) -> None:
        super().__init__(dut)
        self.core = ResamplerConfiguration.model_validate(CASE["core"])
        self.camera = 0
        self.place = REFOCUSED

    def chip(self) -> tuple[Any, Tables]:
        """Registers and tables of the camera."""
        camera = ShownCamera(**CASE["cameras"][self.camera])
        registers, _ = grid_registers(camera.calibration, CASE["m"])
        tables = tables_of(camera.calibration, registers, devignette=self.core.gains)
        return registers, tables

    async def load(self, camera: int) -> None:
        """Load the calibration of a camera, a word at a time with gaps, while a frame comes in."""
        self.camera = camera
        writing = cocotb.start_soon(self._write_all(loads(self.core, *self.chip())))
        await self.play(MODE, 1)
        await writing

    async def _write_all(self, words: list[Load]) -> None:
        for word in words:
            await self._write(word)

    async def _write(self, word: Load) -> None:
        self.dut.load_write.value = 1
        names = ("load_kind", "load_address", "load_data")
        for name, value in zip(names, word, strict=True):
            getattr(self.dut, name).value = value
        await FallingEdge(self.dut.clk)
        self.dut.load_write.value = 0
        if self.random.random() < 0.3:
            await FallingEdge(self.dut.clk)

    def golden(self, picture: np.ndarray) -> np.ndarray:
        registers, tables = self.chip()
        raw = picture
        if CASE["order"] is not None:
            raw = interpolate_mosaic(picture[..., 0], CASE["order"])
        elif self.core.channels == 1:
            raw = picture[..., 0]
        shown = resample(raw, registers, tables)
        if self.place == REFOCUSED:
            shift = CASE["shifts"][int(self.dut.slice.value)]
            shown = ExactArithmetic().refocus(shown, CASE["m"], shift=shift)
        if shown.ndim == 2:
            shown = np.repeat(shown[..., np.newaxis], 3, axis=2)
        screen = np.zeros_like(picture)
        top, left = ((a - b) // 2 for a, b in zip(SHAPE, shown.shape, strict=False))
        screen[top : top + shown.shape[0], left : left + shown.shape[1]] = shown
        return screen

    async def play(self, mode: VideoMode, count: int) -> list[np.ndarray]:
        """Send random frames, and return them."""
        frames = self.pictures(mode, count)
        await self.tap.drive(raster_signals(mode, frames))
        return frames

    async def check(self, mode: VideoMode, lost: int = 1, count: int = 2) -> None:
        """Check that after lost frames each is right, except the last, incomplete one."""
        await self.play(mode, lost)
        # The first frame is incomplete, from before.
        before = (mode.v_total - mode.v_active + 2) * mode.h_total
        self.tap.taken = self.tap.taken[-before:]
        frames = await self.play(mode, count + 1)
        got = self.tap.frames()
        for number in range(2, count + 2):
            frame = got[1 - number]
            assert frame.mode == mode.as_measured()
            want = self.golden(frames[-number])
            assert np.array_equal(frame.pixels, want), differences(frame.pixels, want)
        assert int(self.dut.on_show_place.value) == self.place


def differences(got: np.ndarray, want: np.ndarray) -> str:
    """Description of the differences of a picture."""
    places = np.argwhere((got != want).any(axis=-1))
    return f"{len(places)} pixels differ, from {places[0]} to {places[-1]}"


LOST = FRAMES_TO_FOLLOW + 1
BIND = not CASE["ring"]


@cocotb.test(skip=not BIND)
async def raw_aligned_refocused(dut: Any) -> None:
    """Each output for some frames, chosen at any time, and calibrations that are loaded later."""
    bench = Bench(dut)
    await bench.reset()
    # Without a calibration black frames, and an error.
    await bench.play(MODE, FRAMES_TO_FOLLOW)
    await bench.load(0)
    assert bench.errors == {"core"}
    await bench.check(MODE, 3)
    bench.errors.clear()
    for place in (ALIGNED, REFOCUSED):
        signals = raster_signals(MODE, bench.pictures(MODE, 1))
        cut = bench.random.randrange(len(signals.active))
        await bench.tap.drive(part(signals, 0, cut))
        dut.shown.value = place
        bench.place = place
        dut.slice.value = bench.random.randrange(len(CASE["shifts"]))
        await bench.tap.drive(part(signals, cut))
        await bench.check(MODE, 2, 1)
        assert not bench.errors
    for camera in range(1, len(CASE["cameras"])):
        await bench.load(camera)
        await bench.check(MODE, 2, 1)
        assert not bench.errors
    dut.pass_through.value = 1
    bench.tap.taken = []
    frames = await bench.play(MODE, 3)
    assert np.array_equal(bench.tap.frames()[-1].pixels, frames[-2])
    assert int(dut.on_show_raw.value)
    assert not bench.errors


@cocotb.test(skip=not BIND)
async def blanking(dut: Any) -> None:
    """The shortest blanking, in thorough runs also long ones, with either output."""
    bench = Bench(dut)
    await bench.reset()
    await bench.load(0)
    short = max(CASE["m"] - 1, 3) - 2
    rows = {"v_front": 1, "v_sync": 1, "v_back": short}
    columns = {"h_front": 1, "h_sync": 1, "h_back": 16}
    every = (rows | columns, rows, columns, {"v_back": 40}, {"h_back": 90})
    for changes in every if CASE["thorough"] else every[:1]:
        mode = MODE.model_copy(update=changes)
        for place in (REFOCUSED, ALIGNED):
            bench.place = place
            dut.shown.value = place
            bench.errors.clear()
            await bench.play(mode, LOST)
            bench.errors.clear()
            await bench.check(mode, 1, 2)
            assert not bench.errors, f"{mode}: {bench.errors}"
            assert int(dut.following.value)


@cocotb.test(skip=not BIND or not CASE["thorough"])
async def modes_change(dut: Any) -> None:
    """A mode of another size is passed through; then the sensor is back."""
    bench = Bench(dut)
    await bench.reset()
    await bench.load(0)
    for changes in ({}, {"h_active": SHAPE[1] - 9}, {"v_active": SHAPE[0] + 4}, {}):
        mode = MODE.model_copy(update=changes)
        cut = bench.random.randrange(1, mode.h_total * mode.v_total)
        await bench.tap.drive(part(raster_signals(mode, bench.pictures(mode, 1)), cut))
        if changes:
            await bench.play(mode, LOST)
            # What was taken while the mode changed is no whole frames.
            bench.tap.taken = []
            frames = await bench.play(mode, 3)
            assert int(dut.unsupported.value)
            assert np.array_equal(bench.tap.frames()[-1].pixels, frames[-2])
        else:
            await bench.play(mode, LOST)
            bench.errors.clear()
            await bench.check(mode)
            assert not bench.errors


@cocotb.test(skip=not BIND or not CASE["thorough"])
async def broken_frames(dut: Any) -> None:
    """Gaps in data enable give black pixels; a source is lost and comes back at any phase."""
    bench = Bench(dut)
    await bench.reset()
    await bench.load(0)
    await bench.play(MODE, LOST)
    bench.tap.taken = []
    frames = bench.pictures(MODE, 4)
    signals = raster_signals(MODE, frames)
    active = signals.active.copy()
    hit = [frame.copy() for frame in frames]
    for number in (0, 1, 2):
        for _ in range(3):
            y, x = bench.random.randrange(SHAPE[0]), bench.random.randrange(1, SHAPE[1])
            active[(number * MODE.v_total + y) * MODE.h_total + x] = False
            hit[number][y, x] = 0
    await bench.tap.drive(RasterSignals(active, signals.h_sync, signals.v_sync, signals.pixels))
    got = bench.tap.frames()
    for frame, want in zip(got[-2:], hit[1:3], strict=True):
        assert np.array_equal(frame.pixels, bench.golden(want))
    for _ in range(2):
        cut = bench.random.randrange(1, len(active) // 4)
        await bench.tap.drive(part(raster_signals(MODE, bench.pictures(MODE, 1)), 0, cut))
        nothing = np.zeros(4 * len(active) // 4 + bench.random.randrange(len(active)), bool)
        pixels = np.zeros((len(nothing), 3), np.uint8)
        bench.tap.taken = []
        await bench.tap.drive(RasterSignals(nothing, nothing, nothing, pixels))
        assert not int(dut.following.value)
        assert not bench.tap.frames()[-1].pixels.any()
        await bench.play(MODE, LOST)
        bench.errors.clear()
        await bench.check(MODE)
        assert not bench.errors


@cocotb.test(skip=BIND)
async def lines_of_the_ring(dut: Any) -> None:
    """Nothing is lost with the shortest blanking; with a smaller ring pixels are, with a flag."""
    bench = Bench(dut)
    await bench.reset()
    bench.core = bench.core.model_copy(update={"lines": 256})
    await bench.load(0)
    rows = {"v_front": 1, "v_sync": 1, "v_back": SENSOR_BLANK_LINES - 2}
    mode = MODE.model_copy(update={**rows, "h_front": 1, "h_sync": 1, "h_back": 16})
    # The core's input holds a line of what is refocused: micro images need more.
    for place in (ALIGNED,) if CASE["fewer_lines"] else (ALIGNED, REFOCUSED):
        bench.place = place
        dut.shown.value = place
        await bench.play(mode, LOST + 1)
        bench.errors.clear()
        if CASE["fewer_lines"]:
            await bench.play(mode, 2)
            assert "overflow" in bench.errors
        else:
            await bench.check(mode, 1, 2)
            assert not bench.errors
        assert int(dut.following.value)
