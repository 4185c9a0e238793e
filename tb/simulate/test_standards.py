# SPDX-License-Identifier: Apache-2.0
"""All sources as VHDL-93 and as VHDL-2008: analysed, and the same pictures in each simulator."""

import dataclasses
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.resampling import interpolate_mosaic, red_place, resample
from plenofir.fpga import hdl
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.simulate.chain import run_chain
from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import Simulator, Standard, find_simulator
from plenofir.plan.sensor.chip import resampling
from plenofir.plan.sensor.sensor_bench import run_sensor
from plenofir.refocus.sharpness import depth_index
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.tools import or_skip

BOARD_NAMES = [board.name for board in BOARDS.values() if board.library]
# Simulators that can run a chain.
WITH_INPUT = [name for name in BOARD_NAMES if BOARDS[name].clock_ranges]


@pytest.fixture(params=["ghdl", "nvc"])
def simulator(request: pytest.FixtureRequest) -> Simulator:
    with or_skip():
        return find_simulator(request.param, brief=True)


@pytest.fixture
def of_2008(simulator: Simulator) -> Simulator:
    return dataclasses.replace(simulator, standard="2008")


def raw(*shape: int) -> np.ndarray:
    return np.random.default_rng(8).integers(0, 256, shape, np.uint8)


@pytest.mark.quick
@pytest.mark.parametrize("standard", get_args(Standard))
@pytest.mark.parametrize("board", BOARD_NAMES)
def test_all_sources_are_both(
    tmp_path: Path, simulator: Simulator, board: str, standard: Standard
) -> None:
    chosen = dataclasses.replace(simulator, standard=standard)
    library = BOARDS[board].library
    chosen.run(chosen.analysis(hdl.model_sources(library), library=library), tmp_path)
    chosen.run(chosen.analysis(hdl.board_sources(board)), tmp_path)


@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=24),
        CoreConfiguration(
            micro_image_size=3, shifts=(-2,), max_columns=24, engine=FirEngine(parallel_rows=3)
        ),
        CoreConfiguration(
            micro_image_size=3, shifts=(2,), max_columns=24, engine=MovingSumEngine(), channels=3
        ),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(-2,),
            max_columns=24,
            engine=MovingSumEngine(pixels_per_clock=4),
        ),
    ],
    ids=["fir", "fir, three rows", "moving sums", "moving sums, four pixels"],
)
def test_engines_in_2008(tmp_path: Path, of_2008: Simulator, core: CoreConfiguration) -> None:
    frame = raw(12, 24, *([3] if core.channels == 3 else []))
    result = run_bench(of_2008, core, frame[np.newaxis], tmp_path, stall_percent=20)
    assert np.array_equal(result.frames[0], core.golden(frame)[0])


def test_stack_and_depth_in_2008(tmp_path: Path, of_2008: Simulator) -> None:
    core = CoreConfiguration(
        micro_image_size=3, shifts=(-1, 0, 2), max_columns=24, engine=StackEngine()
    )
    index = DepthIndexConfiguration(
        micro_image_size=3, slices=3, shifts=core.shifts, radius=1, max_columns=24
    )
    frame = raw(12, 24)
    result = run_bench(of_2008, core, frame[np.newaxis], tmp_path, index=index)
    slices = core.golden(frame)
    want = depth_index(slices, 3, 1, shifts=core.shifts)
    assert result.stacks is not None
    assert result.index is not None
    assert result.depth is not None
    assert np.array_equal(result.stacks[0], slices)
    assert np.array_equal(result.frames[0], want.image)
    assert np.array_equal(result.index[0][::3, ::3], want.index)
    assert np.array_equal(result.depth[0][::3, ::3] & 255, want.fraction)
    assert np.array_equal(result.depth[0][::3, ::3] >> 8, want.confidence)


def test_sensor_in_2008(tmp_path: Path, of_2008: Simulator) -> None:
    shape = (30, 36)
    calibration = calibration_of_grid(regular_grid(shape, 5.4, layout="hexagonal-rows"), shape)
    chip = resampling(calibration, 4, channels=3)
    frame = raw(*shape)
    result = run_sensor(
        of_2008,
        chip.core,
        chip.loads(),
        frame[np.newaxis],
        chip.registers.raster_shape,
        tmp_path,
        red_place=red_place("gbrg"),
    )
    want = resample(interpolate_mosaic(frame, "gbrg"), chip.registers, chip.tables)
    assert np.array_equal(result.frames[0], want)


@pytest.mark.slow
@pytest.mark.parametrize("board", WITH_INPUT)
def test_boards_in_2008(tmp_path: Path, of_2008: Simulator, board: str) -> None:
    frame = raw(25, 40, 3)
    core = CoreConfiguration(micro_image_size=5, shifts=(-3,), max_columns=40, channels=3)
    result = run_chain(of_2008, core, frame, tmp_path, board=board)
    assert np.array_equal(result.frames[0], core.golden(frame)[0])
