# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``resampler``: every pixel of every frame against the bit-true model."""

import logging
import random
from pathlib import Path
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.calibration.grid import Layout
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.resampling import GridRegisters, Precision, Tables, grid_registers, resample
from plenofir.camera.resampling.lines import line_needs, ring_needs
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.chip import check_fits, loads
from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.axi_video import (
    AxiVideoSink,
    AxiVideoSource,
    Beat,
    Frame,
    frame_beats,
    stall_pattern,
)
from plenofir_tb.case import read_case
from plenofir_tb.frames import make_frame, repaired_frames
from plenofir_tb.scoreboard import FrameScoreboard

THOROUGH = read_case()["thorough"]
ERROR_NAMES = ("line early", "line late", "frame early", "frame late", "size", "grid")


class Bench:
    """Source, resampler, sink and scoreboard."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        case = read_case()
        self.core = ResamplerConfiguration.model_validate(case["core"])
        self.rng = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start()
        logging.getLogger(f"cocotb.{dut._name}.m_axis").setLevel(logging.WARNING)
        self.source = AxiVideoSource(dut, "s_axis", dut.clk)
        self.sink = AxiVideoSink(dut, "m_axis", dut.clk, reset=dut.reset)
        self.scoreboard = FrameScoreboard(self.sink, self.core.pixel_bits, Path(case["pictures"]))

    def tight_camera(self) -> tuple[GridRegisters, Tables]:
        """The calibration that needs most lines of the ring, out of several."""
        drawn = [self.camera() for _ in range(12)]
        return max(drawn, key=lambda camera: ring_needs(*camera).least)

    def camera(self, *, shape: tuple[int, int] | None = None) -> tuple[GridRegisters, Tables]:
        """Draw a calibration that fits the resampler."""
        core, rng = self.core, self.rng
        while True:
            m = core.micro_image_size
            # Rows of lenses that overlap, that touch, that are apart.
            pitch = m + rng.choice([-0.9 * rng.random(), 0, rng.random(), 2 * rng.random()])
            if core.hexagonal and rng.random() < 0.7:
                pitch = max(pitch, (m + rng.random()) / 0.866)
            pitch = max(pitch, 2.5)
            layout: Layout = "hexagonal-rows" if core.hexagonal else "rectangular"
            if core.skewed:
                # M steps to a pitch, whatever it is; a micro image has a rim.
                pitch = max(pitch * rng.choice([1, 1.6]), 4.5)
                layout = rng.choice(["hexagonal-rows", "hexagonal-rows", "rectangular"])
            fewest = min(max(int(3.2 * pitch), 12), core.max_columns)
            columns = rng.randint(fewest, core.max_columns)
            rows = rng.randint(max(int(2.2 * pitch), 12), int(4.5 * pitch) + 12)
            rows, columns = shape or (rows, columns)
            grid = regular_grid(
                (rows, columns),
                pitch,
                rotation_degrees=rng.uniform(-4, 4),
                layout=layout,
                offset=(rng.uniform(-1, 1), rng.uniform(-1, 1)),
            )
            precision = Precision(
                fraction_bits=core.fraction_bits,
                weight_bits=core.weight_bits,
                guard_bits=core.guard_bits,
                gain_bits=core.gain_bits,
            )
            try:
                calibration = calibration_of_grid(grid, (rows, columns))
                if core.skewed:
                    types = LensTypes(pattern=(0,), sharpest=(0.4,))
                    calibration = calibration.model_copy(update={"lens_types": types})
                registers, _ = grid_registers(calibration, m, precision)
                tables = self._tables(registers)
                check_fits(core, registers, tables)
            except InputError:
                continue
            return registers, tables

    def border_camera(self) -> tuple[GridRegisters, Tables]:
        """Draw a grid of level or steep rows, with lenses on the first and on the last line."""
        core, rng = self.core, self.rng
        bits = core.fraction_bits
        while True:
            # Far apart, so that more lines of the next row of lenses are kept.
            drawn, tables = max(
                (self.camera() for _ in range(4)), key=lambda camera: camera[0].down[0][0]
            )
            slope = (rng.choice((0, 0, rng.randint(-5, 5))) << bits) // max(drawn.lenses[1] - 1, 1)
            registers = drawn.model_copy(update={"right": (slope, drawn.right[1])})
            lines = registers.positions()[..., 0]
            half = (int(registers.samples()[-1, 0, 0]) >> bits) + 1 >> 1 << bits
            up = int(lines.min()) + half + rng.randrange(1 << bits)
            rows = (int(lines.max()) - up + half >> bits) + 1
            moved = {
                "origin": (drawn.origin[0] - up, drawn.origin[1]),
                "image_shape": (rows, drawn.image_shape[1]),
            }
            registers = registers.model_copy(update=moved)
            try:
                registers.check_mirrored(where="drawn grid")
                check_fits(core, registers, tables)
            except InputError:
                continue
            return registers, tables

    def _tables(self, registers: GridRegisters) -> Tables:
        core = self.core
        draw = np.random.default_rng(self.rng.randrange(1 << 32))
        black = int(draw.integers(0, 1 << (core.pixel_bits + core.guard_bits - 3)))
        moves = lenses = profile = None
        m, shape = core.micro_image_size, registers.lenses
        if core.moves:
            most = 1 << core.weight_bits
            moves = draw.integers(-most, most, (*shape, 2))
        if core.gains:
            top = 1 << (core.gain_bits + 4)
            lenses = draw.integers(0, top, shape)
            lenses[draw.random(shape) < 0.7] >>= 3
            profile = draw.integers(0, top, (m, m)) >> 2
        return Tables(black, moves, lenses, profile)

    async def reset(self) -> None:
        dut = self.dut
        for port in (dut.load_write, dut.load_kind, dut.load_address, dut.load_data):
            port.value = 0
        dut.columns.value = dut.rows.value = 0
        dut.error_clear.value = 0
        dut.reset.value = 1
        await ClockCycles(dut.clk, 16)
        dut.reset.value = 0
        await ClockCycles(dut.clk, 16)

    async def reset_once(self) -> None:
        """Reset for a clock, and compare the output from then on."""
        self.dut.reset.value = 1
        await RisingEdge(self.dut.clk)
        self.dut.reset.value = 0
        await FallingEdge(self.dut.clk)
        self.scoreboard.listening = True

    async def load(self, words: list[Load]) -> None:
        """Write words through the load port."""
        dut = self.dut
        dut.load_write.value = 1
        for kind, address, word in words:
            dut.load_kind.value = kind
            dut.load_address.value = address
            dut.load_data.value = word
            await RisingEdge(dut.clk)
        dut.load_write.value = 0

    async def use(self, registers: GridRegisters, tables: Tables) -> None:
        """Load a calibration and set the size of the next frames."""
        self.registers, self.tables = registers, tables
        await self.load(loads(self.core, registers, tables))
        rows, columns = registers.image_shape
        self.dut.rows.value = rows
        self.dut.columns.value = columns
        lines = registers.lenses[0] * registers.micro_image_size
        self.patience = 4000 + 20 * columns * (lines + self.core.lines)

    def stall(self, source: str, sink: str) -> None:
        """Choose the stall patterns of both sides."""
        self.source.stalls = stall_pattern(source, random.Random(self.rng.random()))
        self.sink.stalls = stall_pattern(sink, random.Random(self.rng.random()))

    def frame(self, kind: str) -> Frame:
        rows, columns = self.registers.image_shape
        core = self.core
        return make_frame(kind, rows, columns, core.channels, core.pixel_bits, self.rng)

    def golden(self, frame: Frame) -> Frame:
        full = (1 << self.core.pixel_bits) - 1
        return resample(frame, self.registers, self.tables, full_scale=full)

    def send_frame(self, frame: Frame) -> None:
        """Queue a frame and expect its raster."""
        self.scoreboard.expect(self.golden(frame))
        self.source.append(frame_beats(frame, self.core.pixel_bits))

    async def drain(self) -> None:
        """Wait until all expected frames are out, and some more clocks for unexpected output."""
        quiet = 0
        while self.scoreboard.waiting and quiet < self.patience:
            before = len(self.scoreboard.received), self.scoreboard.frames_done
            await ClockCycles(self.dut.clk, 20)
            same = before == (len(self.scoreboard.received), self.scoreboard.frames_done)
            quiet = quiet + 20 if same else 0
        await ClockCycles(self.dut.clk, 100)
        self.scoreboard.result  # noqa: B018  (raises)

    async def clear_errors(self) -> None:
        self.dut.error_clear.value = 1
        await ClockCycles(self.dut.clk, 2)
        self.dut.error_clear.value = 0

    def errors(self) -> set[str]:
        """Names of the error flags that are set."""
        flags = int(self.dut.error_flags.value)
        return {name for i, name in enumerate(ERROR_NAMES) if flags >> i & 1}


@cocotb.test()
async def frames_without_stalls(dut: Any) -> None:
    """Frames back to back; the source does not have to wait if the ring has enough lines."""
    bench = Bench(dut)
    await bench.reset()
    bench.stall("none", "none")
    for _ in range(2 if THOROUGH else 1):
        await bench.use(*bench.camera())
        needs = ring_needs(bench.registers, bench.tables)
        refused = bench.source.refused_clocks
        for kind in ("white", "random", "gradient"):
            bench.send_frame(bench.frame(kind))
        await bench.drain()
        assert not bench.errors()
        if needs.full_rate is not None and bench.core.lines >= needs.full_rate:
            assert bench.source.refused_clocks == refused


@cocotb.test()
async def frames_with_stalls(dut: Any) -> None:
    """Frames with stalls on both sides, cameras of several sizes."""
    bench = Bench(dut)
    await bench.reset()
    patterns = [("none", "bursts"), ("some", "some"), ("many", "none"), ("none", "many")]
    for stalls in patterns if THOROUGH else patterns[:2]:
        await bench.use(*bench.tight_camera())
        bench.stall(*stalls)
        for kind in ("random", "impulse") if THOROUGH else ("random",):
            bench.send_frame(bench.frame(kind))
        await bench.drain()
    assert not bench.errors()


@cocotb.test()
async def lenses_at_the_borders(dut: Any) -> None:
    """For lenses half outside the frame, mirrored pixels are in the ring, and still in it."""
    bench = Bench(dut)
    await bench.reset()
    for stalls in (("many", "none"), ("some", "some"), ("none", "many")):
        bench.stall(*stalls)
        await bench.use(*bench.border_camera())
        for _ in range(2):
            bench.send_frame(bench.frame("random"))
        await bench.drain()
    assert not bench.errors()


@cocotb.test()
async def frames_behind_resets(dut: Any) -> None:
    """After a reset of one clock in a frame the next frames are right, and loaded words stay."""
    bench = Bench(dut)
    rng = bench.rng
    await bench.reset()
    await bench.use(*min((bench.camera() for _ in range(8)), key=lambda c: c[0].image_shape))
    shape = bench.registers.image_shape
    for number in range(9 if THOROUGH else 4):
        bench.stall(*[("none", "none"), ("none", "many"), ("some", "some")][number % 3])
        for _ in range(2):
            bench.send_frame(bench.frame("random"))
        await bench.drain()
        assert not bench.errors()
        bench.scoreboard.listening = False
        beats = frame_beats(bench.frame("random"), bench.core.pixel_bits)
        if number % 2:
            # A line of one pixel raises flags.
            beats[0] = Beat(0, True, True)
        await bench.source.send(beats[: rng.randint(len(beats) // 3, len(beats))])
        if number == 3:
            # No frame has used it yet.
            await bench.use(*bench.camera(shape=shape))
        await ClockCycles(dut.clk, rng.randint(1, 30))
        await bench.reset_once()
        assert not bench.errors()
    for _ in range(2):
        bench.send_frame(bench.frame("random"))
    await bench.drain()
    assert not bench.errors()


@cocotb.test(
    skip=not THOROUGH or read_case()["core"]["moves"] or read_case()["core"]["gains"],
)
async def registers_change_while_video_runs(dut: Any) -> None:
    """Registers written in the middle of a frame apply from the next one on."""
    bench = Bench(dut)
    await bench.reset()
    await bench.use(*bench.camera())
    bench.stall("none", "some")
    shape = bench.registers.image_shape
    for _ in range(3):
        frame = bench.frame("random")
        bench.scoreboard.expect(bench.golden(frame))
        beats = frame_beats(frame, bench.core.pixel_bits)
        half = bench.rng.randrange(1, len(beats))
        await bench.source.send(beats[:half])
        await bench.use(*bench.camera(shape=shape))
        await bench.source.send(beats[half:])
    bench.send_frame(bench.frame("random"))
    await bench.drain()
    assert not bench.errors()


@cocotb.test()
async def broken_frames(dut: Any) -> None:
    """Lines and frames that end anywhere are resampled as far as possible; later ones whole."""
    bench = Bench(dut)
    await bench.reset()
    await bench.use(*bench.camera())
    core, rng = bench.core, bench.rng
    rows, columns = bench.registers.image_shape
    needed, _ = line_needs(bench.registers, bench.tables)
    beats: list[Beat] = []
    for share in (0.002, 0.02, 0.2, 0.001) if THOROUGH else (0.005, 0.1):
        whole = frame_beats(bench.frame("random"), core.pixel_bits)
        part = [
            Beat(
                b.data,
                b.start_of_frame != (rng.random() < share / 8),
                b.end_of_line != (rng.random() < share),
            )
            for b in whole
        ]
        beats += part[: rng.choice([len(part), len(part), rng.randint(1, len(part))])]
    beats += frame_beats(bench.frame("random"), core.pixel_bits)
    frames, faults = repaired_frames(beats, columns, rows)
    for lines in frames:
        # Every line is whole; a frame that was cut short is filled up with black lines.
        packed = np.zeros((rows, columns), object)
        packed[: len(lines)] = np.array(lines, object).reshape(-1, columns)
        mask = (1 << core.pixel_bits) - 1
        planes = [(packed >> (c * core.pixel_bits) & mask) for c in range(core.channels)]
        frame = np.stack(planes, axis=-1).astype(np.uint8 if core.pixel_bits <= 8 else np.uint16)
        done = np.logical_and.accumulate(needed < len(lines)).sum()
        if done:
            got = bench.golden(frame[:, :, 0] if core.channels == 1 else frame)
            bench.scoreboard.expect(got[:done])
    bench.stall(*rng.choice([("none", "none"), ("some", "some"), ("none", "many")]))
    await bench.source.send(beats)
    await bench.drain()
    assert bench.errors() == faults
    await bench.clear_errors()
    bench.send_frame(bench.frame("random"))
    await bench.drain()
    assert not bench.errors()


@cocotb.test(skip=read_case()["core"]["lines"] > 16)
async def grid_that_needs_too_many_lines(dut: Any) -> None:
    """It raises a flag and does not hang; a reset ends it; the next one is resampled."""
    bench = Bench(dut)
    await bench.reset()
    registers, tables = bench.camera()
    # No grid needs more lines than the frame has.
    while registers.image_shape[0] <= bench.core.lines:
        registers, tables = bench.camera()
    # Each lens lies as many lines below the one before as the ring holds.
    below = bench.core.lines << bench.core.fraction_bits
    registers = registers.model_copy(update={"right": (below, registers.right[1])})
    roomy = bench.core.model_copy(update={"lines": 256, "lenses": 1 << 16})
    bench.registers = registers
    dut.rows.value, dut.columns.value = registers.image_shape
    await bench.load(loads(roomy, registers, tables)[-16:])
    bench.stall("none", "none")
    beats = frame_beats(bench.frame("random"), bench.core.pixel_bits)
    # Until the flag is up; then resets in the clocks around.
    clocks = 0
    for place in (200, 2, 1, 0, -1):
        bench.scoreboard.listening = False
        await bench.source.send(beats[:3])
        if place == 200:
            while not bench.errors():
                await RisingEdge(dut.clk)
                clocks += 1
                assert clocks < place
            await ClockCycles(dut.clk, 20)
            assert bench.errors() == {"grid"}
        else:
            await ClockCycles(dut.clk, clocks - place)
        await bench.reset_once()
        await ClockCycles(dut.clk, 20)
        assert not bench.errors()
    await bench.source.send(beats)
    await ClockCycles(dut.clk, 200)
    assert bench.errors() == {"grid"}
    await bench.clear_errors()
    await bench.use(*bench.camera())
    for _ in range(2):
        bench.send_frame(bench.frame("random"))
    await bench.drain()
    assert not bench.errors()
