# SPDX-License-Identifier: Apache-2.0
"""Raw captures over HDMI through a whole board: resampled, refocused, in the frame's middle."""

import json
from math import inf
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.images import read_image, write_png
from plenofir.refocus import refocus
from plenofir_studies.experiments import CAMERA, textures
from plenofir_studies.synthetic import (
    Capture,
    TexturedPlane,
    field_of_view,
    regular_grid,
    render,
    with_pitch,
)


def sim(folder: Path, calibration: Calibration, raw: np.ndarray, *arguments: str) -> dict:
    """Run the command and return its report."""
    calibration.save(folder / "calib.json")
    write_png(folder / "raw.png", raw)
    files = "--raw", folder / "raw.png", "--calib", folder / "calib.json", "--out", folder / "out"
    done = plenofir("sim", *map(str, files), "--chain", "hdmi", *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "out" / "report.json").read_text())


@pytest.mark.drawn(1, "chain runs")
def test_small_capture_over_hdmi(tmp_path: Path) -> None:
    shape = 34, 44
    grid = regular_grid(shape, 5.4, rotation_degrees=0.7)
    raw = np.random.default_rng(5).integers(0, 256, shape, np.uint8)
    arguments = "--micro-image", "4", "-a", "1/4", "--engine", "moving_sum"
    report = sim(tmp_path, calibration_of_grid(grid, shape), raw, *arguments)
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    assert report["chain"] == "hdmi"
    aligned = read_image(tmp_path / "out" / "aligned.png")
    assert aligned.shape == (report["rows"], report["columns"])
    want = np.repeat(refocus(aligned, 4, "1/4")[..., np.newaxis], 3, axis=2)
    assert (read_image(tmp_path / "out" / "refocused.png") == want).all()


def rendered(pitch: float, rotation: float, lenses: tuple[int, int]) -> Capture:
    """Capture of a textured plane, micro images darker at their borders."""
    model = with_pitch(RayModel.focused(load_camera(CAMERA), inf, int(pitch)), pitch)
    width = field_of_view(model, 3000.0, 1.6 * max(lenses))
    plane = TexturedPlane(textures()[0], 3000.0, width)
    return render(model, [plane], lenses, rotation_degrees=rotation, bits=8, radius=0.6)


@pytest.mark.slow
@pytest.mark.parametrize(("bayer", "board"), [("grbg", "atlys"), (None, "ulx3s")])
def test_rendered_capture_over_hdmi(tmp_path: Path, bayer: str | None, board: str) -> None:
    capture = rendered(13.889, 0.7, (7, 9))
    # A mosaic under grey light.
    raw = capture.raw
    calibration = calibration_of_grid(capture.grid, raw.shape[:2])
    options = ["--board", board, "--micro-image", "13", "-a", "4/13", "-a", "2/13"]
    options += [] if bayer is None else ["--bayer", bayer]
    report = sim(tmp_path, calibration, raw, "--engine", "moving_sum", *options)
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    assert len(report["slices"]) == 2
