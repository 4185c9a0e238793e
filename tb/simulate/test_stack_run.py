# SPDX-License-Identifier: Apache-2.0
"""Focal stack and depth index by command, in one pass through the VHDL."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from plenofir.commands.app import main
from plenofir.fpga.simulate import file_bench
from plenofir.ground import project
from plenofir.ground.errors import EXIT_MISMATCH
from plenofir.ground.images import read_image, write_png
from plenofir.refocus import refocus
from plenofir.refocus.sharpness import TEXTURE, confidence_level, depth_between_picture, depth_index
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name

SLICES = ("-3/5", "1/5", "1")


@pytest.fixture
def plenofir(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]):
    """Run ``plenofir sim`` in this process; its exit code and what it said on standard error."""

    def command(*arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(
            sys, "argv", ["plenofir", "sim", "--simulator", simulator_name(), *arguments]
        )
        capfd.readouterr()
        with pytest.raises(SystemExit) as done:
            main()
        return int(done.value.code or 0), capfd.readouterr().err

    return command


@pytest.mark.parametrize("pixels", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_crop_of_a_light_field(tmp_path: Path, plenofir, pixels: int) -> None:
    # A region where three of the planes meet, with lines that are no multiple of M.
    raw = read_image(project.DATA / "planes_5x5.png")[100:143, 300:352].copy()
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "out"
    stack = " ".join(SLICES)
    code, errors = plenofir(
        *(
            "--raw",
            str(tmp_path / "raw.png"),
            "-M",
            "5",
            "--engine",
            "stack",
            "-a",
            stack,
            "--radius",
            "2",
        ),
        *("--pixels", str(pixels), "--out", str(out)),
    )
    assert code == 0, errors
    slices = np.stack([refocus(raw, 5, a) for a in SLICES])
    level = confidence_level(TEXTURE, 5, 2, channels=3)
    want = depth_index(slices, 5, 2, confidence=level, shifts=(-3, 1, 5))
    for a, image in zip(("-3_5", "1_5", "1"), slices, strict=True):
        assert np.array_equal(read_image(out / f"refocused_{a}.png"), image)
    assert np.array_equal(read_image(out / "all_in_focus.png"), want.image)
    levels = read_image(out / "depth_index.png")[::5, ::5]
    assert np.array_equal(levels, np.array([0, 127, 255])[want.index])
    assert want.fraction is not None
    depth = depth_between_picture(want.index, want.fraction, 3)
    assert np.array_equal(read_image(out / "depth.png")[::5, ::5], depth)
    assert np.array_equal(read_image(out / "confidence.png")[::5, ::5], want.confidence)
    report = json.loads((out / "report.json").read_text())
    assert report["mismatches"] == 0
    assert report["pixels_compared"] == 6 * 43 * 52
    assert report["pixels_per_clock"] == pixels
    assert report["clocks_per_pixel"] == 1 / pixels
    counted = np.bincount(want.index.ravel(), minlength=3)
    assert report["micro_images_of_slice"] == counted.tolist()


def test_a_fault_in_the_stack_is_found(tmp_path: Path, plenofir, monkeypatch) -> None:
    # Exit code 1, but the pictures are written.
    sources = plant(
        tmp_path / "hdl",
        file_bench.core_sources(),
        "stack_columns.vhd",
        "entering_age(GEOMETRY, slice, v)",
        "entering_age(GEOMETRY, 0, v)",
    )
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    raw = np.random.default_rng(2).integers(0, 256, (13, 24), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "out"
    code, errors = plenofir(
        *("--raw", str(tmp_path / "raw.png"), "-M", "3", "--engine", "stack", "-a", "-2/3 1"),
        *("--out", str(out)),
    )
    assert code == EXIT_MISMATCH, errors
    report = json.loads((out / "report.json").read_text())
    assert 0 < report["mismatches"] < report["pixels_compared"]
    assert (out / "all_in_focus.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-a", "1/2 0"), "--a: 1/2 is not on the grid of M = 5"),
        (("-a", "0 1", "--radius", "9"), "--radius: '9' must be less than or equal to 8"),
        (("-a", "0 1", "-M", "1"), "--micro-image: M = 1 is too small"),
        (("-a", "0 1", "-M", "3", "--pixels", "4"), "--pixels: a depth index judges"),
    ],
)
def test_bad_input_is_one_line(
    tmp_path: Path, plenofir, arguments: tuple[str, ...], message: str
) -> None:
    code, errors = plenofir("--engine", "stack", *arguments, "--out", str(tmp_path / "out"))
    assert code == 2
    assert message in errors
    assert len(errors.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_scene_of_all_slices(tmp_path: Path, plenofir) -> None:
    # The index alone, between slices, two pixels a clock.
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'name = "test"\n[camera]\nmicro_image_size = 3\n'
        '[frame]\ncolumns = 28\nrows = 9\ncolour = "grey"\n'
        '[depth]\nslices = ["-1/3", "0", "2/3"]\n'
        '[stack]\noutput = "depth"\nvote_radius = 0\nbetween_slices = true\n'
        "[build]\npixels_per_clock = 2\n"
    )
    raw = np.random.default_rng(3).integers(0, 256, (9, 28), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "out"
    code, errors = plenofir(
        *("--scene", str(scene), "--raw", str(tmp_path / "raw.png"), "--out", str(out))
    )
    assert code == 0, errors
    slices = np.stack([refocus(raw, 3, a) for a in ("-1/3", "0", "2/3")])
    want = depth_index(slices, 3, 1, confidence=confidence_level(TEXTURE, 3, 1), shifts=(-1, 0, 2))
    assert np.array_equal(read_image(out / "depth_index.png")[::3, ::3] // 127, want.index)
    assert np.array_equal(read_image(out / "confidence.png")[::3, ::3], want.confidence)
    # No picture in focus, and no pixel that waits for one.
    report = json.loads((out / "report.json").read_text())
    assert (report["mismatches"], report["pixels_compared"]) == (0, 5 * 9 * 28)
    assert report["waiting_bits"] == 0
    assert not (out / "all_in_focus.png").exists()


@pytest.mark.parametrize(
    "more", ["vote_radius = 0\n", pytest.param("between_slices = true\n", marks=pytest.mark.slow)]
)
def test_a_scene_with_a_smaller_box_in_focus(tmp_path: Path, plenofir, more: str) -> None:
    scene, names = tmp_path / "scene.toml", ("-1/3", "1/3", "2/3")
    scene.write_text(
        'name = "test"\n[camera]\nmicro_image_size = 3\n'
        '[frame]\ncolumns = 28\nrows = 9\ncolour = "grey"\n'
        '[depth]\nslices = ["-1/3", "1/3", "2/3"]\n'
        f'[stack]\noutput = "all-in-focus"\nsharp_box = 1\nconfidence = 15.0\n{more}'
    )
    raw = np.random.default_rng(4).integers(0, 256, (9, 28), np.uint8)
    raw[:, :14] = 90
    write_png(tmp_path / "raw.png", raw)
    out = tmp_path / "out"
    code, errors = plenofir(
        *("--scene", str(scene), "--raw", str(tmp_path / "raw.png"), "--out", str(out))
    )
    assert code == 0, errors
    slices, sharp = (np.stack([refocus(raw, 3, a, box=box) for a in names]) for box in (3, 1))
    level, between = confidence_level(15.0, 3, 1), "between" in more
    want = depth_index(
        *(slices, 3, 1),
        confidence=level,
        vote_radius=int(between),
        shifts=(-1, 1, 2) if between else (),
        sharp=sharp,
    )
    assert 0 < np.mean(want.textured) < 1
    assert np.array_equal(read_image(out / "depth_index.png")[::3, ::3] // 127, want.index)
    assert np.array_equal(read_image(out / "all_in_focus.png"), want.image)
    assert np.array_equal(read_image(out / "refocused_2_3.png"), slices[2])
    assert np.array_equal(read_image(out / "refocused_2_3_box1.png"), sharp[2])
    report = json.loads((out / "report.json").read_text())
    assert (report["mismatches"], len(report["slices"])) == (0, 6)
    assert report["micro_images_of_slice"] == np.bincount(want.index.ravel()).tolist()
