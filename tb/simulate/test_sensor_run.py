"""Raw captures through mosaic, resampler and refocuser: file bench, command line, bad input."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.camera.resampling import interpolate_mosaic, red_place, resample
from plenofir.camera.synthetic import regular_grid
from plenofir.fpga import hdl
from plenofir.fpga.simulate.sensor_bench import run_sensor
from plenofir.fpga.simulate.simulators import SimulationError, find_simulator
from plenofir.images import read_image, write_png
from plenofir.plan.resampling import resampling
from plenofir.refocus import refocus
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name

PLENOFIR = str(Path(sys.executable).parent / "plenofir")
SHAPE = (34, 41)


def plenofir(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PLENOFIR, "sim", *arguments], capture_output=True, text=True, check=False
    )


def camera(layout: str = "rectangular", pitch: float = 5.4) -> Calibration:
    profile = tuple(tuple(1 - 0.1 * abs(k - 1) for k in range(3)) for _ in range(3))
    grid = regular_grid(SHAPE, pitch, rotation_degrees=0.7, layout=layout)  # type: ignore[arg-type]
    changes = {"shading": (-0.1, 0.05, 0.0), "profile": profile, "dark_level": 3.0}
    return calibration_of_grid(grid, SHAPE).model_copy(update=changes)


def capture(shape: tuple[int, ...] = SHAPE) -> np.ndarray:
    return np.random.default_rng(5).integers(0, 256, shape, np.uint8)


@pytest.mark.slow
@pytest.mark.parametrize("stall_percent", [0, 40])
def test_file_bench_equals_the_models(tmp_path: Path, stall_percent: int) -> None:
    chip = resampling(camera("hexagonal-rows"), 4, channels=3)
    raw = capture()
    result = run_sensor(
        find_simulator(simulator_name()),
        chip.core,
        chip.loads(),
        np.stack([raw, raw]),
        chip.registers.raster_shape,
        tmp_path,
        red_place=red_place("gbrg"),
        stall_percent=stall_percent,
    )
    want = resample(interpolate_mosaic(raw, "gbrg"), chip.registers, chip.tables)
    assert (result.frames == want).all()


def test_capture_becomes_a_picture(tmp_path: Path) -> None:
    raw, calib, out = tmp_path / "raw.png", tmp_path / "calib.json", tmp_path / "out"
    write_png(raw, capture())
    camera().save(calib)
    files = "--raw", str(raw), "--calib", str(calib), "--out", str(out)
    done = plenofir(
        *files, "--micro-image", "5", "-a", "1/5", "--engine", "moving_sum", "--bayer", "grbg"
    )
    assert done.returncode == 0, done.stderr
    chip = resampling(camera(), 5, channels=3)
    aligned = read_image(out / "aligned.png")
    want = resample(interpolate_mosaic(capture(), "grbg"), chip.registers, chip.tables)
    assert (aligned == want).all()
    assert (read_image(out / "refocused.png") == refocus(aligned, 5, "1/5")).all()
    report = json.loads((out / "report.json").read_text())
    assert report["mismatches"] == report["sensor"]["mismatches"] == 0
    assert report["raw"] == "raw.png"
    assert report["sensor"]["pixels_compared"] == aligned.shape[0] * aligned.shape[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--bayer", "rggb"], "--bayer: is for --calib; expected --calib too"),
        (["--calib", "calib.json"], "--calib: is for --raw; expected --raw too"),
        (["--calib", "{}/calib.json", "--raw", "{}/small.png"], "small.png: 40 x 34 pixels"),
        (["--calib", "{}/columns.json", "--raw", "{}/raw.png"], "straight rows of lenses"),
        (
            ["--calib", "{}/calib.json", "--raw", "{}/raw.png", "--micro-image", "9", "-a", "0"],
            "at most 6",
        ),
        (
            ["--calib", "{}/calib.json", "--raw", "{}/rgb.png", "--bayer", "rggb"],
            "expected a mosaic: one channel",
        ),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, arguments: list[str], message: str) -> None:
    camera().save(tmp_path / "calib.json")
    camera("hexagonal-columns").save(tmp_path / "columns.json")
    write_png(tmp_path / "raw.png", capture())
    write_png(tmp_path / "small.png", capture()[:, 1:])
    write_png(tmp_path / "rgb.png", capture((*SHAPE, 3)))
    out = tmp_path / "out"
    done = plenofir(*(a.format(tmp_path) for a in arguments), "--out", str(out))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert message in done.stderr
    assert not out.exists()


@pytest.mark.slow
def test_missing_lines_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sources = plant(
        tmp_path / "sources",
        hdl.hdl_sources(),
        "lens_rows.vhd",
        "if row_index + 1 = signed(",
        "if row_index + 2 = signed(",
    )
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    chip = resampling(camera(), 5)
    with pytest.raises(SimulationError, match="pixels received for"):
        run_sensor(
            find_simulator(simulator_name()),
            chip.core,
            chip.loads(),
            capture()[np.newaxis],
            chip.registers.raster_shape,
            tmp_path / "bench",
        )
