# SPDX-License-Identifier: Apache-2.0
"""Focused cameras in the commands of the ray model: their answers, and what they refuse."""

import json
from pathlib import Path

import pytest
from in_process import plenofir

from plenofir.camera.rays import (
    RayModel,
    load_camera,
)
from plenofir.ground.errors import InputError

F193 = load_camera("f193-mla2")
R12 = load_camera("raytrix-r12")
# Where its main lens is focused: 56.86 mm from the micro lenses (`D` of the calibration).
R12_FOCUS = 463.54174

R12_WORDS = ("--camera", "raytrix-r12", "--focus", f"{R12_FOCUS}", "-M", "23")


def test_commands(tmp_path: Path) -> None:
    settings_asked = ("-a", "2/23", "-a", "5/46", "-a", "0", "-a", "-3/23")
    done = plenofir("distance", *R12_WORDS, *settings_asked, "--json")
    assert done.returncode == 0, done.stderr
    planes = json.loads(done.stdout)["planes"]
    states = [plane["near_state"] for plane in planes]
    blurred = "no lens type is sharp"
    assert states == [blurred, "real", blurred, blurred]
    assert [plane["lens_type"] for plane in planes] == [None, 3, None, None]
    assert [plane["near_mm"] is None for plane in planes] == [True, False, True, True]
    assert planes[1]["box"] == 2.5
    assert (planes[2]["virtual_depth"], planes[2]["blur_px"]) == (0, None)
    drawing = tmp_path / "bench.svg"
    done = plenofir("distance", *R12_WORDS, *settings_asked, "--plot", str(drawing))
    assert f"a = 2/23: {blurred}" in drawing.read_text()
    assert "at a = 2/23, 0, -3/23" in done.stdout
    done = plenofir("slices", *R12_WORDS, "--near", "350", "--far", "inf", "--json")
    content = json.loads(done.stdout)
    assert [part["a"] for part in content["slices"]] == ["3/23"]
    assert len(content["gaps"]) == 2
    other = plenofir("baseline", *R12_WORDS, "--sensor-distance", "0.3mm", "--json")
    assert json.loads(other.stdout)["baseline_mm"] == pytest.approx(
        float(RayModel.focused(R12, R12_FOCUS, 23).baseline(1)) * R12.micro_lenses.spacing_mm / 0.3
    )
    page = ("design", *R12_WORDS, "--near", "400", "--far", "450")
    assert plenofir(*page, "--plot", str(tmp_path / "design.svg")).returncode == 0
    text = plenofir(*page).stdout
    for part in ("total covering plane", "lens type 2 (Galilean", "resolved / mm"):
        assert part in text
    shipped = {one["name"]: one for one in json.loads(plenofir("cameras", "--json").stdout)}
    assert shipped["raytrix-r12"]["micro_lenses"]["layout"] == "hexagonal"
    assert set(shipped["f193-mla2"]["micro_lenses"]) == {"focal_length_mm", "pitch_mm"}


@pytest.mark.parametrize("length", ["0", "-1", "nan", "inf", "1e40", "x"])
def test_impossible_sensor_distances(length: str) -> None:
    for command in (("distance", "-a", "1"), ("baseline",), ("design", "--near", "300")):
        done = plenofir(*command, "--camera", "f193-mla2", f"--sensor-distance={length}")
        assert done.returncode == 2
        assert done.stderr.startswith("plenofir: --sensor-distance: ")
        assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("focal_length_mm = [1, 2]", "several focal lengths need sensor_distance_mm"),
        ("focal_length_mm = []", "a list of one or more"),
        ("focal_length_mm = [1, 0]\nsensor_distance_mm = 0.9", "other_focal_lengths_mm"),
        ("focal_length_mm = 1\nsensor_distance_mm = nan", "sensor_distance_mm"),
        ("focal_length_mm = 1\nsensor_distance_mm = true", "sensor_distance_mm"),
        ("focal_length_mm = 1\nsensor_distance = 2", "sensor_distance"),
        ("focal_length_mm = 1\nlayout = 'round'", "layout"),
    ],
)
def test_descriptions_that_are_no_camera(tmp_path: Path, lines: str, message: str) -> None:
    file = tmp_path / "camera.toml"
    file.write_text(
        f'name = "x"\n[main_lens]\nfocal_length_mm = 50\n[micro_lenses]\n{lines}\n'
        "pitch_mm = 0.1\n[sensor]\npixel_pitch_mm = 0.005\n"
    )
    done = plenofir("distance", "--camera", str(file), "-a", "1")
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_boxes_and_microscopes_that_are_refused(tmp_path: Path) -> None:
    for box in (0, 24, 2.5):
        with pytest.raises(InputError, match="an integer from 1 to M = 23"):
            RayModel.focused(R12, R12_FOCUS, 23, box)  # type: ignore[arg-type]
    done = plenofir("distance", *R12_WORDS, "-a", "1", "--box", "24")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    file = tmp_path / "microscope.toml"
    file.write_text(
        'name = "x"\n[objective]\nmagnification = 20\nnumerical_aperture = 0.5\n[micro_lenses]\n'
        "focal_length_mm = 2\nsensor_distance_mm = 1.9\npitch_mm = 0.1\n"
        "[sensor]\npixel_pitch_mm = 0.005\n"
    )
    done = plenofir("distance", "--camera", str(file), "-a", "1")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "is for cameras" in done.stderr
