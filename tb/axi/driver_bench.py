# SPDX-License-Identifier: Apache-2.0
"""The driver against the VHDL: a processor's code on the simulated bus."""

import ctypes
import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import cocotb
import numpy as np
import pytest
from cocotb.clock import Clock
from cocotb.task import bridge, resume
from cocotb.triggers import ClockCycles, RisingEdge

from plenofir.camera.calibration import Calibration
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.resampling import Precision, grid_registers, resample, tables_of
from plenofir.driver import Core, Window
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.resampler import ResamplerConfiguration
from plenofir_tb import axi_lite, wishbone
from plenofir_tb.axi_video import AxiVideoSink, AxiVideoSource, Beat, frame_beats
from plenofir_tb.case import read_case
from plenofir_tb.frames import make_frame

CASE = read_case()
KIND = CASE["kind"]
WISHBONE = KIND == "refocuser_wishbone"
BASE = 0x4000_0000


class SimulatedBus:
    """Words of the simulated core, from `BASE` on, as PYNQ's MMIO; accesses take simulated time."""

    def __init__(self, master: Any) -> None:
        self.master = master

    @resume
    async def read(self, offset: int = 0, length: int = 4) -> int:
        """Read the word at an offset."""
        assert length == 4
        return await self.master.read(offset - BASE)

    @resume
    async def write(self, offset: int, data: int) -> None:
        """Write the word at an offset."""
        await self.master.write(offset - BASE, data)


class Bench:
    """A core with its driver."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.rng = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start(start_high=False)
        self.bus = SimulatedBus(wishbone.Master(dut) if WISHBONE else axi_lite.Master(dut))
        self.bus.master.pause(self.rng, 0.2)
        self.source = AxiVideoSource(dut, "s_axis", dut.clk)
        self.sink = AxiVideoSink(dut, "m_axis", dut.clk, reset=dut.reset)
        self.frames: list[list[Beat]] = []
        self.sink.add_callback(self._take)

    def _take(self, beat: Beat) -> None:
        if beat.start_of_frame:
            self.frames.append([])
        self.frames[-1].append(beat)

    async def start(self) -> Core:
        self.dut.reset.value = 1
        await ClockCycles(self.dut.clk, 3)
        self.dut.reset.value = 0
        await RisingEdge(self.dut.clk)
        return await self.call(lambda: Core(Window(self.bus, BASE), pause=lambda _: None))

    async def call(self, function: Callable[[], Any]) -> Any:
        """Run code that waits for the bus."""
        return await bridge(function)()

    async def refuses(self, function: Callable[[], Any], text: str) -> None:
        """Run code that has to refuse its input."""

        def run() -> None:
            with pytest.raises(InputError) as refused:
                function()
            assert text in str(refused.value)

        await self.call(run)

    async def send(self, core: Core, beats: list[Beat]) -> None:
        """Send a frame and wait until it has come out."""
        await self.source.send(beats)
        assert await self.call(core.drain)

    def packed(self, frame: Any, bits: int) -> list[int]:
        return [beat.data for beat in frame_beats(frame, bits)]


@cocotb.test(skip=KIND not in ("refocuser_axi", "refocuser_wishbone"))
async def refocuser(dut: Any) -> None:
    """Find it, set size and focus in all ways, sweep, counters, faults, events."""
    bench = Bench(dut)
    want = CoreConfiguration.model_validate(CASE["core"])
    core = await bench.start()
    found = core.description
    m = want.micro_image_size
    assert found.parts == {"refocuser"}
    assert (found.micro_image_size, found.shifts) == (m, want.shifts)
    assert found.boxes == want.slice_boxes
    assert (found.channels, found.pixel_bits) == (want.channels, want.pixel_bits)
    assert found.settings == tuple(Fraction(shift, m) for shift in want.shifts)
    columns, rows = want.max_columns, 2 * m
    await bench.refuses(lambda: core.set_frame_size(columns + 1, rows), "columns")
    await bench.call(lambda: core.set_frame_size(columns, rows))
    await bench.call(core.enable)

    async def frame(slice_: int) -> None:
        sent = make_frame("random", rows, columns, want.channels, want.pixel_bits, bench.rng)
        bench.frames.clear()
        await bench.send(core, frame_beats(sent, want.pixel_bits))
        image = want.arithmetic.refocus(sent, m, shift=want.shifts[slice_])
        (got,) = bench.frames
        assert [beat.data for beat in got] == bench.packed(image, want.pixel_bits)
        assert got[0].slice == slice_
        assert await bench.call(lambda: core.shown_slice) == slice_

    for number, setting in enumerate(found.settings):
        assert await bench.call(lambda a=setting: core.set_focus(a)) == number
        await frame(number)
    await bench.refuses(lambda: core.set_focus(Fraction(1, 97)), "a = 1/97; use one of")
    await bench.refuses(lambda: core.set_slice(len(want.shifts)), "use 0 to")
    # By the distances of all slices that have one, and by one out of reach.
    model = RayModel.focused(load_camera("f193-mla2"), 4000, m)
    for number, setting in enumerate(found.settings):
        if setting < 0:
            continue
        distance = float(model.distance(float(setting)).mm)
        assert await bench.call(lambda d=distance: core.set_distance(d, model)) == number
        await frame(number)
    far = float(model.distance(float(max(found.settings)) + 5).mm)
    await bench.refuses(lambda: core.set_distance(far, model), "the core has a =")
    other = RayModel.focused(load_camera("f193-mla2"), 4000, m + 1)
    await bench.refuses(lambda: core.set_distance(distance, other), f"M = {m}")
    await bench.call(lambda: core.set_slice(0))
    await frame(0)
    await bench.call(lambda: core.sweep(2))
    for number in (0, 0, 1, 1):
        await frame(number)
    # An event that comes, and one that does not.
    assert not await bench.call(lambda: core.wait("frame_out", 0.01))
    waiting = cocotb.start_soon(bench.call(lambda: core.wait("frame_in")))
    await ClockCycles(dut.clk, 60)
    await bench.source.send([Beat(0, True, True)])
    assert await waiting
    # A frame whose first line ended early, and whose others never come: a restart.
    assert not await bench.call(lambda: core.drain(0.01))
    assert await bench.call(lambda: core.errors(clear=True)) == {"line_early"}
    assert await bench.call(core.errors) == set()
    counters = await bench.call(core.counters)
    assert counters.frames_in == counters.frames_out + 1 == len(want.shifts) + 8
    assert counters.lines_in == counters.lines_out + 1
    await bench.call(core.restart)
    assert (await bench.call(core.counters)).frames_in == 0
    await bench.refuses(lambda: core.load_words([(3, 0, 0)]), "without a resampler")
    # Another size while enabled: the core goes on with it.
    rows = m
    await bench.call(lambda: core.set_frame_size(columns, rows))
    await bench.call(lambda: core.set_slice(0))
    await frame(0)
    await bench.call(core.disable)
    bench.frames.clear()
    await bench.source.send([Beat(0, True, True)])
    assert (await bench.call(core.counters)).dropped == 1


@cocotb.test(skip=KIND != "refocuser_axi" or "library" not in CASE)
async def c_example(dut: Any) -> None:
    """The example in C, as compiled, sets the core up on the simulated bus."""
    bench = Bench(dut)
    want = CoreConfiguration.model_validate(CASE["core"])
    core = await bench.start()
    library = ctypes.CDLL(CASE["library"])
    read_type = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_void_p, ctypes.c_uint32)
    write_type = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32)
    read = read_type(lambda _, address: bench.bus.read(BASE + address))
    write = write_type(lambda _, address, word: bench.bus.write(BASE + address, word))

    class Bus(ctypes.Structure):
        _fields_ = (("context", ctypes.c_void_p), ("read", read_type), ("write", write_type))

    bus = Bus(None, read, write)
    start = library.plenofir_start
    columns, rows, m = want.max_columns, want.micro_image_size, want.micro_image_size

    def begin(shift: int) -> int:
        # Not PyDLL, which would block the interpreter, on which the simulation runs.
        return int(start(ctypes.byref(bus), columns, rows, shift))

    assert await bench.call(lambda: begin(9999)) == -2
    number = want.shifts.index(-1)
    assert await bench.call(lambda: begin(-1)) == number
    sent = make_frame("random", rows, columns, want.channels, want.pixel_bits, bench.rng)
    await bench.send(core, frame_beats(sent, want.pixel_bits))
    image = want.arithmetic.refocus(sent, m, shift=want.shifts[number])
    assert [beat.data for beat in bench.frames[0]] == bench.packed(image, want.pixel_bits)


@cocotb.test(skip=KIND != "stack_axi")
async def stack(dut: Any) -> None:
    """A stack, and the depth index behind it if there is one."""
    bench = Bench(dut)
    want = CoreConfiguration.model_validate(CASE["core"])
    core = await bench.start()
    index = CASE.get("index")
    assert core.description.parts == {"stack", *(["depth_index"] if index else [])}
    assert core.description.shifts == want.shifts
    assert core.description.boxes == want.slice_boxes
    columns, rows = want.max_columns, 3 * want.micro_image_size
    await bench.refuses(lambda: core.set_slice(0), "without a refocuser")
    await bench.call(lambda: core.set_frame_size(columns, rows))
    await bench.call(core.enable)
    for _ in range(2):
        sent = make_frame("random", rows, columns, want.channels, want.pixel_bits, bench.rng)
        bench.frames.clear()
        await bench.send(core, frame_beats(sent, want.pixel_bits, want.pixels_per_clock))
        slices = want.golden(sent)
        if index:
            found = DepthIndexConfiguration.model_validate(index).golden(np.stack(list(slices)))
            m = want.micro_image_size
            places = found.index.repeat(m, 0).repeat(m, 1)[:rows, :columns].astype(np.uint32)
            words, bits = places << want.pixel_bits | found.image, want.pixel_bits + 8
        else:
            words, bits = np.dstack(list(slices)), want.pixel_bits
        wanted = frame_beats(words, bits, want.pixels_per_clock)
        assert [beat.data for beat in bench.frames[0]] == [beat.data for beat in wanted]
    if index:
        details = core.description.details
        assert details["sharpness.radius"] == index["radius"]
        assert details["sharpness.sharp_too"] == index["sharp_too"]


@cocotb.test(skip=KIND != "sensor_axi")
async def sensor(dut: Any) -> None:
    """Calibrations over the bus: each frame is resampled by the newest."""
    bench = Bench(dut)
    want = ResamplerConfiguration.model_validate(CASE["core"])
    core = await bench.start()
    assert core.description.parts == {"resampler"}
    names = Precision.model_fields
    precision = Precision(**{name: getattr(want, name) for name in names})
    for document in CASE["calibrations"]:
        calibration = Calibration.model_validate(document)
        rows, columns = calibration.image_shape
        await bench.call(lambda c=columns, r=rows: core.set_frame_size(c, r, timeout_s=0.05))
        await bench.call(lambda c=calibration: core.load_calibration(c))
        await bench.call(core.enable)
        sent = make_frame("random", rows, columns, 1, want.pixel_bits, bench.rng)
        bench.frames.clear()
        await bench.source.send(frame_beats(sent, want.pixel_bits))
        assert await bench.call(lambda: core.drain(0.2))
        registers, _ = grid_registers(calibration, want.micro_image_size, precision)
        tables = tables_of(calibration, registers, devignette=want.gains)
        image = resample(sent, registers, tables)
        got = [beat.data for beat in bench.frames[0]]
        assert got == bench.packed(image, want.pixel_bits)
        assert await bench.call(lambda: core.raster_size) == image.shape[::-1]
    assert await bench.call(core.errors) == set()
    other = Calibration.model_validate(CASE["other"])
    await bench.refuses(lambda: core.load_calibration(other), "hexagonal")
