# SPDX-License-Identifier: Apache-2.0
"""A calibration over the board's serial port, by the command line."""

from pathlib import Path

import pytest

from plenofir.camera.calibration import calibration_of_grid
from plenofir.fpga import hdl
from plenofir.plan.sensor.board_load import Shown, description
from plenofir.plan.sensor.chip import resampling
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.faults import plant
from plenofir_tb.runner import Case, run_cases
from plenofir_tb.shown_sensor import ShownCamera, sensor_packages, shown_chip
from plenofir_tb.video import MODE_720

SHAPE = (40, 50)
NO_WORDS = """CALIBRATION : words_t(0 to 0) :=
  (
    0 => x"0000000000000000"
  )"""


def test_load_port(tmp_path: Path) -> None:
    for name, layout in (("calib", "rectangular"), ("other", "hexagonal-rows")):
        grid = regular_grid(SHAPE, 6.3, rotation_degrees=0.7, layout=layout)  # type: ignore[arg-type]
        calibration_of_grid(grid, SHAPE).save(tmp_path / f"{name}.json")
    grid = regular_grid(SHAPE, 6.3, rotation_degrees=0.7)
    core = resampling(calibration_of_grid(grid, SHAPE), 5, devignette=False).core
    text = description(core)
    case = {
        "bit_clocks": 8,
        "lines": core.lines,
        "description": text,
        "calib": str(tmp_path / "calib.json"),
        "other": str(tmp_path / "other.json"),
    }
    generics = {"DESCRIPTION": text, "BIT_CLOCKS": 8}
    run_cases([Case("load_ports", "link.load_bench", generics, case)])


@pytest.mark.slow
def test_from_the_command_to_the_picture(tmp_path: Path) -> None:
    """Two cameras that fit the board, and one whose raster has too many lines to wait."""
    shape = (MODE_720.v_active, MODE_720.h_active)
    fitting = [ShownCamera(3.4, 1.5, shape=shape), ShownCamera(3.5, -1.0, shape=shape)]
    cameras = [*fitting, ShownCamera(4.6, -1.0, shape=shape)]
    paths = [tmp_path / f"calib-{number}.json" for number in range(len(cameras))]
    for path, camera in zip(paths, cameras, strict=True):
        camera.calibration.save(path)
    core = shown_chip(3, fitting, mosaic=False, channels=1)
    text = description(core, Shown(shape[0], raster=shape[1], mosaic=0))
    generics = {
        "DESCRIPTION": text,
        "BIT_CLOCKS": 8,
        "MICRO_IMAGE_SIZE": 3,
        "SHIFTS": "2",
        "MAX_COLUMNS": shape[1],
    }
    case = {
        "bit_clocks": 8,
        "calibrations": [str(path) for path in paths],
        "m": 3,
        "shifts": [2],
        "cameras": [camera.model_dump() for camera in cameras],
        "core": core.model_dump(),
        "order": None,
        "mode": MODE_720.model_dump(),
        "thorough": False,
        "ring": False,
    }
    packages = sensor_packages(core, shape)
    run_cases([Case("load_picture", "link.picture_bench", generics, case, packages)])


def test_words_into_the_pixel_clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the package of a scene with a sensor and a calibration."""
    words = [f"{(kind << 60) + 0x0123456789ABCDE * kind:016X}" for kind in (3, 0, 1, 2)]
    values = ", ".join(f'{n} => x"{word}"' for n, word in enumerate(words))
    sources = hdl.hdl_sources()
    for number, (old, new) in enumerate(
        (
            ("WITH_SENSOR    : boolean  := false", "WITH_SENSOR    : boolean  := true"),
            ("CALIBRATED : boolean := false", "CALIBRATED : boolean := true"),
            (NO_WORDS, f"CALIBRATION : words_t(0 to {len(words) - 1}) := ({values})"),
        )
    ):
        sources = plant(tmp_path / str(number), sources, "sensor_pkg.vhd", old, new)
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    run_cases([Case("load_crossing", "link.crossing_bench", {}, {"words": words})])
