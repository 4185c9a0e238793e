# SPDX-License-Identifier: Apache-2.0
"""A rendered capture through the VHDL: objects are sharpest in the slices of the ray model."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.refocus import refocus
from plenofir_studies.sweep import OBJECTS, SHIFTS, M, swept_scene
from plenofir_tb.runner import simulator_name


def test_capture_swept_through_the_array(tmp_path: Path) -> None:
    scene = swept_scene()
    # The ray model says in which slices the objects are sharp.
    predicted = M * scene.model.focus_setting(scene.distances_mm)
    assert predicted == pytest.approx(OBJECTS)
    frames = np.repeat(scene.raster[np.newaxis], len(SHIFTS), axis=0)
    result = run_bench(
        find_simulator(simulator_name()), scene.core, frames, tmp_path, sweep_frames=1
    )
    assert result.slices == tuple(range(len(SHIFTS)))
    for shift, frame in zip(SHIFTS, result.frames, strict=True):
        assert np.array_equal(frame, refocus(scene.raster, M, f"{shift}/{M}"))
    for curve, want in zip(scene.curves(result.frames), predicted, strict=True):
        assert SHIFTS[int(np.argmax(curve))] == round(want)
        # By a clear margin: two slices away sharpness is at least a tenth lower.
        far = np.abs(np.array(SHIFTS) - want) >= 2
        assert curve[far].max() < 0.9
