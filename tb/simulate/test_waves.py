# SPDX-License-Identifier: Apache-2.0
"""Waveforms of the same frame from different simulators, formats and sources, compared."""

import re
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.calibration import calibration_of_grid
from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.simulate import file_bench
from plenofir.fpga.simulate.dump_compare import DumpComparison, compare_dumps
from plenofir.fpga.simulate.request import Run
from plenofir.fpga.simulate.simulations import Place
from plenofir.fpga.simulate.waves import WaveSignal, finish_waves, named_waves
from plenofir.fpga.tools.dumps import Dump
from plenofir.fpga.tools.simulators import Simulator, Waves, find_simulator
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import bare, write_png
from plenofir.plan.sensor import sensor_bench, sensor_csi
from plenofir.plan.sensor.sensor_run import Sensor, load_sensor
from plenofir.refocus import StoredProductArithmetic
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name
from plenofir_tb.tools import or_skip

CORE = CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=12)
STACK = CORE.model_copy(update={"shifts": (-1, 1, 2), "engine": StackEngine()})
DEPTH = DepthIndexConfiguration(micro_image_size=3, slices=3, max_columns=12)
CORES = {
    "filters": (CORE, None),
    "rows at once": (
        CORE.model_copy(update={"engine": FirEngine(parallel_rows=2), "order": 1}),
        None,
    ),
    "sums": (CORE.model_copy(update={"engine": MovingSumEngine()}), None),
    "stored sums": (
        CORE.model_copy(
            update={
                "engine": MovingSumEngine(any_rows=True),
                "order": 1,
                "arithmetic": StoredProductArithmetic(),
            }
        ),
        None,
    ),
    "pixels": (
        CORE.model_copy(update={"engine": MovingSumEngine(pixels_per_clock=4), "shifts": (2, 0)}),
        None,
    ),
    "stack": (STACK, DEPTH),
    "stack of pixels": (
        STACK.model_copy(update={"engine": StackEngine(pixels_per_clock=2)}),
        DEPTH.model_copy(
            update={
                "pixels_per_clock": 2,
                "vote_radius": 1,
                "shifts": STACK.shifts,
                "picture": False,
            }
        ),
    ),
}
FRAME = np.random.default_rng(0).integers(0, 255, (1, 6, 12), np.uint8, endpoint=True)


FORMATS = {"ghdl": ["ghw", "fst"], "nvc": ["fst"]}


def dump(simulator: Simulator, path: Path, name: str = "filters", work: Path | None = None) -> Path:
    """Run the frame through a core and write its waveform, in a folder that may be built."""
    folder = work or path.parent / f"work-{path.name}"
    core, index = CORES[name]
    signals = file_bench.wave_signals(core, index)
    waves = named_waves(path, signals)
    built = folder.exists()
    file_bench.run_bench(
        simulator, core, FRAME, folder, index=index, stall_percent=20, waves=waves, built=built
    )
    finish_waves(waves, signals)
    return path


@pytest.fixture(scope="module")
def good_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """VCD of the frame through a core, from the simulator that the tests run on."""
    folder = tmp_path_factory.mktemp("good")

    def make(name: str) -> Path:
        path = folder / f"{name}.vcd"
        if not path.exists():
            dump(find_simulator(simulator_name(), brief=True), path, name, folder / "work")
        return path

    return make


@pytest.fixture
def good(good_of: Callable[[str], Path]) -> Path:
    return good_of("filters")


def check_equal(found: DumpComparison) -> None:
    assert found.equal, found.differences[0]
    assert found.signals == len(file_bench.wave_signals(CORE)) - 1
    assert found.samples > FRAME.size
    assert found.clock is not None
    assert found.clock.endswith("clk")
    assert found.only_in_a == found.only_in_b == found.not_comparable == ()


def test_simulators_agree(good: Path, tmp_path: Path) -> None:
    with or_skip():
        other = find_simulator("nvc" if simulator_name() == "ghdl" else "ghdl")
    path = dump(other, tmp_path / "other.vcd")
    check_equal(compare_dumps(good, path))
    check_equal(compare_dumps(path, good))


@pytest.mark.parametrize("suffix", FORMATS[simulator_name()])
def test_formats_agree(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    if suffix == "fst":
        # Of GHDL 5, the one that does not compile (mcode) writes all signals into an FST.
        monkeypatch.delenv("GHDL_BACKEND", raising=False)
    path = dump(find_simulator(simulator_name()), tmp_path / f"other.{suffix}")
    check_equal(compare_dumps(good, path))


def ranges_of(vcd: Path) -> dict[str, str]:
    """How a VCD declares each bit and vector: its path to ``bit``, ``downto`` or ``to``."""
    ranges, path = {}, [""]
    for line in vcd.read_text().partition("$enddefinitions")[0].splitlines():
        words = line.split()
        if words[0] == "$scope":
            path.append(words[2])
        elif words[0] == "$upscope":
            path.pop()
        elif words[:2] == ["$var", "reg"]:
            name, _, bounds = words[4].partition("[")
            left, _, right = bounds.strip("]").partition(":")
            kind = "bit" if not bounds else "downto" if int(left) >= int(right) else "to"
            ranges["/".join([*path, name])] = kind
    return ranges


@pytest.mark.parametrize("name", CORES)
def test_every_named_signal_of_an_engine_is_written(good_of, name: str) -> None:
    path = good_of(name)
    signals = file_bench.wave_signals(*CORES[name])
    assert len(path.with_suffix(".gtkw").read_text().splitlines()) > 2 * len(signals)
    if simulator_name() == "ghdl":
        assert ranges_of(path) == {signal.path: signal.kind for signal in signals}


def test_a_signal_that_is_not_there_is_refused(good: Path) -> None:
    wanted = WaveSignal("/file_bench/design/raster/core/planned/result_dat", "downto")
    with pytest.raises(InputError, match=r"no signal .*result_dat; the nearest is .*result_data$"):
        finish_waves(named_waves(good, [wanted]), [wanted])


@pytest.mark.skipif(simulator_name() != "ghdl", reason="GHDL's format")
def test_all_signals_hold_records_down_to_a_depth(good_of, tmp_path: Path) -> None:
    good_of("sums")
    simulator = find_simulator("ghdl", brief=True)
    names = {}
    for depth in (0, 5):
        waves = Waves(tmp_path / f"{depth}.ghw", depth=depth)
        core, _ = CORES["sums"]
        work = good_of("sums").parent / "work"
        file_bench.run_bench(simulator, core, FRAME, work, waves=waves, built=True)
        names[depth] = {signal.canonical for signal in Dump(waves.path).signals}
    stage = "file_bench.design.raster.core.planned.moving_sum_engine."
    stage += "moving_sums.every_stage[0].one_pixel.stage."
    assert {f"{stage}command_at[3].take", f"{stage}token.strobe"} <= names[0]
    # The bench, the core of any engine, its generate region, the refocuser, and records in it.
    assert "file_bench.design.raster.core.planned.token.strobe" in names[5] < names[0]
    assert max(name.count(".") for name in names[5]) == 6


def check_named(good: Path, bad: Path, signal: str) -> None:
    """The first difference is in this signal, and before it there is none."""
    found = compare_dumps(good, bad)
    assert not found.equal
    first = found.differences[0]
    assert first.signal.endswith(signal), first
    assert first.value_a != first.value_b
    assert compare_dumps(good, bad, end=first.cycle - 1).equal


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "signal"),
    [
        (
            "sums",
            "moving_sum_stage.vhd",
            "read_leave when choice_at(READ).leave = '1'",
            "read_leave when false",
            "every_stage[0].one_pixel.stage.leaving",
        ),
        (
            "sums",
            "moving_sum_control.vhd",
            "out_first <= out_now;",
            "out_first <= first;",
            "every_stage[0].one_pixel.stage.control.out_first",
        ),
        (
            "pixels",
            "prefix_sums.vhd",
            "before + partial(LEVELS)",
            "before + partial(0)",
            "planned.tail.last_sums",
        ),
        (
            "pixels",
            "lane_control.vhd",
            "ended    <= following;",
            "null;",
            "every_stage[1].several_pixels.stage.banks.end_row_1",
        ),
        (
            "stack",
            "stack_columns.vhd",
            "choice_3.enter = '1' and choice_3.enter_now = '1'",
            "choice_3.enter_now = '1' and false",
            "columns.slice[0].entering_4",
        ),
        (
            "stack",
            "lens_sharpness.vhd",
            "bend    <= along + across;",
            "bend    <= along;",
            "index.planned.find.slice[0].judge.laplacian",
        ),
    ],
)
def test_a_fault_of_an_engine_is_named(
    good_of, tmp_path, monkeypatch, name, file, old, new, signal
) -> None:
    # First: its sources are the ones without the fault.
    good = good_of(name)
    sources = plant(tmp_path / "hdl", file_bench.core_sources(), file, old, new)
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    bad = dump(find_simulator(simulator_name(), brief=True), tmp_path / "bad.vcd", name)
    check_named(good, bad, signal)


@pytest.fixture
def sensor(tmp_path: Path) -> Sensor:
    """A small capture."""
    shape = 20, 24
    raw = np.random.default_rng(5).integers(0, 256, shape, np.uint8)
    write_png(tmp_path / "raw.png", bare(raw))
    calibration = calibration_of_grid(regular_grid(shape, 5.4, rotation_degrees=0.7), shape)
    calibration.save(tmp_path / "calib.json")
    return load_sensor(tmp_path / "raw.png", tmp_path / "calib.json", 4)


def test_a_fault_of_the_resampler_is_named(tmp_path, monkeypatch, sensor: Sensor) -> None:
    chip, signals = sensor.chip, sensor_bench.wave_signals()

    def run(name: str) -> Path:
        waves = named_waves(tmp_path / f"{name}.vcd", signals)
        raw = sensor.capture.pixels[np.newaxis]
        shape = chip.registers.raster_shape
        simulator = find_simulator(simulator_name(), brief=True)
        sensor_bench.run_sensor(
            simulator, chip.core, chip.loads(), raw, shape, tmp_path / name, waves=waves
        )
        finish_waves(waves, signals)
        return waves.path

    good = run("good")
    if simulator_name() == "ghdl":
        assert ranges_of(good) == {signal.path: signal.kind for signal in signals}
    sources = plant(
        *(tmp_path / "hdl", hdl.hdl_sources(), "pixel_sample.vhd"),
        *("weight_x_2 <= weight_x_1;", "weight_x_2 <= weight_x;"),
    )
    monkeypatch.setattr(sensor_bench.hdl, "hdl_sources", lambda: sources)
    check_named(good, run("bad"), "lenses_out.samples.channel[0].sample")


def test_a_fault_of_the_receiver_is_named(tmp_path, monkeypatch, sensor: Sensor) -> None:
    raster = bare(sensor.golden())
    engine = MovingSumEngine()
    core = CORE.model_copy(
        update={"micro_image_size": 4, "max_columns": raster.pixels.shape[1], "engine": engine}
    )
    what = Run(core=core, out=tmp_path / "out", chain="csi", simulator=simulator_name())

    def run(name: str) -> Path:
        simulation = sensor.csi_frame(2).simulation(what, raster)
        waves = named_waves(tmp_path / f"{name}.vcd", simulation.wave_signals)
        simulator = find_simulator(simulator_name(), brief=True)
        simulation.run(Place(simulator, tmp_path / name, waves, lambda _: None))
        finish_waves(waves, simulation.wave_signals)
        return waves.path

    good = run("good")
    if simulator_name() == "ghdl":
        signals = sensor_csi.wave_signals(core)
        assert ranges_of(good) == {signal.path: signal.kind for signal in signals}
    sources = plant(
        *(tmp_path / "hdl", file_bench.core_sources(), "raw_unpacker.vhd"),
        *(":= payload_data;", ":= not payload_data;"),
    )
    monkeypatch.setattr(sensor_csi, "core_sources", lambda: sources)
    check_named(good, run("bad"), "receiver.pixels_data")


@pytest.mark.parametrize(
    ("file", "old", "new", "signal"),
    [
        (
            "switch_control.vhd",
            "switches and mask when live_held",
            "switches when live_held",
            "planned.fir_engine.filters.row_pass[0].stage.control.closed",
        ),
        (
            "switched_fir.vhd",
            "carried + to_integer(unsigned(pixels(w / GROUP_TAPS)))",
            "carried + to_integer(unsigned(pixels(w / GROUP_TAPS))) / 2 * 2",
            "planned.fir_engine.filters.skewed_data",
        ),
        (
            "divide_round.vhd",
            "NUMERATOR_BITS) + HALF;",
            "NUMERATOR_BITS);",
            "planned.result_data",
        ),
    ],
)
def test_a_planted_fault_is_named(good, tmp_path, monkeypatch, file, old, new, signal) -> None:
    sources = plant(tmp_path / "hdl", file_bench.core_sources(), file, old, new)
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    bad = dump(find_simulator(simulator_name()), tmp_path / "bad.vcd")
    check_named(good, bad, signal)
    if file == "switch_control.vhd" and simulator_name() == "ghdl":
        page = (project.root() / "docs/simulation.md").read_text()
        shown = re.search(r"(?:^    .*\n)*^    result .*different\n", page, flags=re.M)
        assert shown is not None
        command = [sys.executable, "-m", "plenofir", "waves", "compare", str(good), str(bad)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert textwrap.dedent(shown[0]) == done.stdout
