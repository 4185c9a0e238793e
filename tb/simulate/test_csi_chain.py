# SPDX-License-Identifier: Apache-2.0
"""Raw captures over CSI-2: from the bytes of a D-PHY's lanes to the refocused picture."""

import json
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.calibration import calibration_of_grid
from plenofir.ground import project
from plenofir.ground.images import bare, read_image, read_picture, write_png
from plenofir.refocus import refocus
from plenofir_studies.synthetic import regular_grid

SHAPE = 34, 44


def sim(folder: Path, raw: np.ndarray, *arguments: str, full_scale: int = 0) -> tuple[int, str]:
    """Run the command on a capture; result: exit code and standard error."""
    calibration_of_grid(regular_grid(SHAPE, 5.4, rotation_degrees=0.7), SHAPE).save(
        folder / "calib.json"
    )
    picture = bare(raw)
    scale = full_scale or picture.full_scale
    write_png(folder / "raw.png", picture._replace(full_scale=scale))
    files = "--raw", folder / "raw.png", "--calib", folder / "calib.json", "--out", folder / "out"
    done = plenofir("sim", *map(str, files), "--chain", "csi", "-M", "4", *arguments)
    return done.returncode, done.stderr


def capture(bits: int) -> np.ndarray:
    dtype = np.uint8 if bits == 8 else np.uint16
    return np.random.default_rng(5).integers(0, 1 << bits, SHAPE, dtype)


@pytest.mark.drawn(1, "chain runs")
def test_small_capture_over_two_lanes(tmp_path: Path) -> None:
    arguments = "-a", "1/4", "--engine", "moving_sum", "--lanes", "2", "--waves", "1"
    arguments += "--stalls", "5"
    code, notes = sim(tmp_path, capture(8), *arguments)
    # So few pixels do not show whether the calibration fits.
    assert (code, notes.count("\n")) == (0, 1)
    assert "could not be checked whether the calibration fits" in notes
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == report["faults"] == 0
    assert (report["chain"], report["lanes"], report["format"]) == ("csi", 2, "RAW8")
    assert report["packets"] == SHAPE[0] + 2
    stalls = report["stalls"]
    assert (stalls["mismatches"], stalls["pixels_compared"]) == (0, report["pixels_compared"])
    assert {"aligned.fst", "aligned.gtkw", "refocused.fst", "refocused.gtkw"} < {*report["files"]}
    aligned = read_image(tmp_path / "out" / "aligned.png")
    assert (read_image(tmp_path / "out" / "refocused.png") == refocus(aligned, 4, "1/4")).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bits", "arguments"),
    [
        (10, ("--lanes", "4", "--bayer", "grbg", "-a", "1/4", "-a", "2/4")),
        (12, ("--lanes", "1", "-a", "-1/4", "--engine", "moving_sum", "--border", "normalise")),
    ],
)
def test_more_bits_and_lanes(tmp_path: Path, bits: int, arguments: tuple[str, ...]) -> None:
    code, _ = sim(tmp_path, capture(bits), *arguments, full_scale=(1 << bits) - 1)
    assert code == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    assert report["format"] == f"RAW{bits}"
    assert len(report["slices"]) == arguments.count("-a")


@pytest.mark.parametrize(
    ("raw", "arguments", "what"),
    [
        (np.zeros((*SHAPE, 3), np.uint8), (), "has colours; a sensor"),
        (np.full(SHAPE, 65535, np.uint16), (), "RAW8, RAW10 and RAW12 have"),
        (np.zeros(SHAPE, np.uint8), ("--simulator", "verilator"), "--chain cannot be combined"),
        (np.zeros(SHAPE, np.uint8), ("--lanes", "3"), "'3'"),
        (np.zeros(SHAPE, np.uint8), ("--raw-bits", "9"), "'9'"),
    ],
)
def test_what_no_lane_brings_is_refused(
    tmp_path: Path, raw: np.ndarray, arguments: tuple[str, ...], what: str
) -> None:
    code, error = sim(tmp_path, raw, "-a", "1/4", *arguments)
    assert code == 2
    assert what in error
    assert not (tmp_path / "out").exists()


def test_a_capture_needs_its_calibration() -> None:
    done = plenofir("sim", "--chain", "csi")
    assert (done.returncode, done.stdout) == (2, "")
    assert "requires --calib" in done.stderr


@pytest.mark.slow
def test_real_capture_scaled_to_a_sensors_bits(tmp_path: Path) -> None:
    """A part of the microscope's capture with its own calibration, 16 bits as RAW10."""
    data = project.DATA / "microscope"
    size = 15 * 16
    for name in ("raw", "white"):
        picture = read_picture(data / f"{name}.png")
        write_png(
            tmp_path / f"{name}.png", picture._replace(pixels=picture.pixels[:size, :size].copy())
        )
    commands = (
        ("calibrate", tmp_path / "white.png", "--out", tmp_path / "calib.json"),
        (
            *("sim", "--raw", tmp_path / "raw.png", "--calib", tmp_path / "calib.json"),
            *("--chain", "csi", "-M", "13", "-a", "4/13", "--engine", "moving_sum"),
            *("--lanes", "2", "--raw-bits", "10", "--out", tmp_path / "out"),
        ),
    )
    for command in commands:
        done = plenofir(*map(str, command))
        assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == report["faults"] == 0
    assert (report["format"], report["packets"]) == ("RAW10", size + 2)
