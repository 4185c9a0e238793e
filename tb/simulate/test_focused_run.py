# SPDX-License-Identifier: Apache-2.0
"""Raw captures of a focused camera through resampler and refocuser in the VHDL."""

import json
from pathlib import Path

import numpy as np
import pytest
from focused_scenes import scene
from in_process import plenofir

from plenofir.camera.calibration import Calibration, calibrate
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.ground.images import read_image, write_png
from plenofir.plan.sensor.chip import resampling
from plenofir.refocus import refocus


def rendered(pitch: float, lenses: tuple[int, int], folder: Path) -> tuple[np.ndarray, Calibration]:
    """A capture in grey with its calibration, also in files."""
    truth = scene((3.0,), pitch=pitch, lenses=lenses, rotation_degrees=0.3)
    calibration = calibrate(truth.capture.white >> 8)
    types = LensTypes(pattern=(0, 1, 2), sharpest=(0.4, 0.35, 0.3))
    calibration = calibration.model_copy(update={"lens_types": types})
    raw = (truth.capture.raw.mean(axis=2) / 257).astype(np.uint8)
    write_png(folder / "raw.png", raw)
    calibration.save(folder / "calib.json")
    return raw, calibration


def run(folder: Path, m: int, *arguments: str) -> dict:
    files = "--raw", "raw.png", "--calib", "calib.json", "--out", "out"
    done = plenofir("sim", *files, "--micro-image", str(m), *arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    report = json.loads((folder / "out" / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    assert report["sensor"]["decode_rms"] < 2
    return report


def test_capture_of_a_focused_camera(tmp_path: Path) -> None:
    raw, calibration = rendered(11.0, (5, 6), tmp_path)
    run(tmp_path, 11, "-a", "3/11", "--box", "3", "--engine", "moving_sum", "--stalls", "0")
    chip = resampling(calibration, 11)
    aligned = read_image(tmp_path / "out" / "aligned.png")
    assert aligned.shape == chip.registers.raster_shape
    refocused = read_image(tmp_path / "out" / "refocused.png")
    assert (refocused == refocus(aligned, 11, "3/11", box=3)).all()
    # The picture lies as the capture does, a pixel for two of it.
    upright = read_image(tmp_path / "out" / "upright_refocused.png")
    assert upright.shape == tuple(n // 2 for n in raw.shape)


@pytest.mark.slow
def test_micro_images_of_35_pixels(tmp_path: Path) -> None:
    rendered(35.0, (5, 6), tmp_path)
    run(tmp_path, 35, "-a", "3/35", "--box", "3")


@pytest.mark.slow
def test_larger_capture_and_its_stack(tmp_path: Path) -> None:
    """M = 23, a slice alone, then several in one pass and the picture that is sharp everywhere."""
    rendered(23.0, (12, 10), tmp_path)
    run(tmp_path, 23, "-a", "3/23", "--box", "3")
    report = run(tmp_path, 23, "-a", "2/23", "-a", "3/23", "--box", "2 3", "--engine", "stack")
    assert sum(report["micro_images_of_slice"]) > 0
    assert (tmp_path / "out" / "all_in_focus.png").exists()
