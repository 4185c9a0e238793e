# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``resampler``: loads that are pending, superseded, aborted, repeated.

The last one runs on ``sensor_raster`` with a mosaic, too.
"""

from typing import Any

import cocotb
from cocotb.triggers import ClockCycles, RisingEdge
from cocotb.utils import get_sim_time

from plenofir.camera.resampling import GridRegisters, Tables, interpolate_mosaic, resample
from plenofir.plan.sensor.chip import loads
from plenofir.plan.sensor.resampler import Load
from plenofir_tb.axi_video import frame_beats, pack_pixels
from plenofir_tb.case import read_case
from resample.resample_bench import Bench

MOSAIC = read_case().get("mosaic", False)
SHAPE = (18, 21)
COMMIT = (3, 0, 0)
Camera = tuple[GridRegisters, Tables]


class LoadBench(Bench):
    """A resampler, and calibrations for frames of one size."""

    async def begin(self, count: int) -> list[Camera]:
        await self.reset()
        self.stall("none", "none")
        self.dut.rows.value, self.dut.columns.value = SHAPE
        self.patience = 4000
        cameras = [self.camera(shape=SHAPE) for _ in range(count)]
        self.registers, self.tables = cameras[0]
        return cameras

    def words(self, camera: Camera) -> list[Load]:
        """Registers of a calibration, without the commit."""
        return loads(self.core, *camera)[:-1]

    async def shows(self, camera: Camera) -> None:
        """A frame comes out by a calibration."""
        self.registers, self.tables = camera
        self.send_frame(self.frame("random"))
        await self.drain()
        assert not self.errors()


@cocotb.test(skip=MOSAIC)
async def words_behind_a_pending_commit(dut: Any) -> None:
    """Words written after a commit affect no earlier frame, and no frame mixes two loads."""
    bench = LoadBench(dut)
    for some in (1, 9, 15):
        a, b = await bench.begin(2)
        await bench.load([*bench.words(a), COMMIT, *bench.words(b)[:some]])
        await bench.shows(a)
        await bench.load([*bench.words(b)[some:]])
        await bench.shows(a)
        await bench.load([COMMIT])
        await bench.shows(b)
        await bench.shows(b)


@cocotb.test(skip=MOSAIC)
async def the_same_calibration_twice(dut: Any) -> None:
    """The first frame comes during the second load."""
    bench = LoadBench(dut)
    (a,) = await bench.begin(1)
    words = bench.words(a)
    await bench.load([*words, COMMIT, *words[:7]])
    await bench.shows(a)
    await bench.load([*words[7:], COMMIT])
    await bench.shows(a)
    await bench.shows(a)


@cocotb.test(skip=MOSAIC)
async def newer_loads(dut: Any) -> None:
    """The newest commit is used; an aborted load and a second commit change nothing."""
    bench = LoadBench(dut)
    a, b, c = await bench.begin(3)
    await bench.load([*bench.words(a), COMMIT, *bench.words(b), COMMIT])
    await bench.shows(b)
    await bench.load([*bench.words(c)[:8]])
    await bench.shows(b)
    await bench.load(
        [*bench.words(a), COMMIT, *bench.words(c)[:5], *bench.words(c), COMMIT, COMMIT]
    )
    await bench.shows(c)
    await bench.load([COMMIT])
    await bench.shows(c)
    await bench.load([*bench.words(a)[:4], *bench.words(a)[5:], COMMIT])
    await ClockCycles(dut.clk, 2)
    assert bench.errors() == {"grid"}
    await bench.clear_errors()
    await bench.shows(c)
    await bench.load([bench.words(a)[4], COMMIT])
    await bench.shows(a)


@cocotb.test()
async def commits_around_the_first_pixel(dut: Any) -> None:
    """A frame has the calibration of the clock in which its first pixel is taken."""
    bench = LoadBench(dut)
    old, *others = await bench.begin(7)
    await bench.load([*bench.words(old), COMMIT])
    got: list[int] = []
    bench.sink.add_callback(lambda beat: got.append(beat.data))
    used = set()
    if MOSAIC:
        dut.red_place.value = 0
    for clocks, new in enumerate(others):
        await bench.load(bench.words(new))
        frame = bench.frame("random")
        if MOSAIC:
            sent = frame[..., 0]
            frame = interpolate_mosaic(sent, "rggb")
        else:
            sent = frame
        bench.scoreboard.listening = False
        got.clear()
        first = cocotb.start_soon(seen(dut, dut.s_axis_tvalid, dut.s_axis_tready))
        commit = cocotb.start_soon(seen(dut, dut.load_write))
        sending = cocotb.start_soon(bench.source.send(frame_beats(sent, bench.core.pixel_bits)))
        if clocks:
            # The mosaic holds a frame back for two lines.
            await ClockCycles(dut.clk, clocks * (9 if MOSAIC else 1))
        await bench.load([COMMIT])
        await sending
        await ClockCycles(dut.clk, 400)
        bits = bench.core.pixel_bits
        rasters = [
            pack_pixels(resample(frame, *camera, full_scale=(1 << bits) - 1), bits).ravel().tolist()
            for camera in (old, new)
        ]
        late = (await commit - await first) / 10
        used.add(late)
        assert got == rasters[late <= 0], f"commit {late} clocks behind the first pixel"
        bench.scoreboard.listening = True
        old = new
        if not MOSAIC:
            await bench.shows(new)
    assert min(used) <= 0
    assert max(used) > 2 * SHAPE[1] if MOSAIC else {1, 2} <= used


@cocotb.test()
async def commits_between_two_marks_of_a_start(dut: Any) -> None:
    """A start whose mark lasts two pixels, with a commit between: no frame mixes two loads."""
    bench = LoadBench(dut)
    old, new = await bench.begin(2)
    await bench.load([*bench.words(old), COMMIT])
    await bench.load(bench.words(new))
    got: list[int] = []
    bench.sink.add_callback(lambda beat: got.append(beat.data))
    bench.scoreboard.listening = False
    frame = bench.frame("random")
    if MOSAIC:
        dut.red_place.value = 0
        frame = frame[..., 0]
    first, second, *rest = frame_beats(frame, bench.core.pixel_bits)
    await bench.source.send([first])
    await bench.load([COMMIT])
    await bench.source.send([second._replace(start_of_frame=True), *rest])
    await ClockCycles(dut.clk, 600)
    pixels = interpolate_mosaic(frame, "rggb") if MOSAIC else frame
    bits = bench.core.pixel_bits
    rasters = [
        pack_pixels(resample(pixels, *camera, full_scale=(1 << bits) - 1), bits).ravel().tolist()
        for camera in (old, new)
    ]
    assert got in rasters
    assert not bench.errors()
    bench.scoreboard.listening = True


async def seen(dut: Any, *signals: Any) -> float:
    """Time in ns of the first rising edge at which all signals are 1."""
    while True:
        await RisingEdge(dut.clk)
        if all(str(signal.value) == "1" for signal in signals):
            return get_sim_time("ns")
