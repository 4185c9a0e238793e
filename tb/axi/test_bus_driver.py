# SPDX-License-Identifier: Apache-2.0
"""The driver and the example in C against the VHDL."""

import shutil
import subprocess
from pathlib import Path

import pytest

from plenofir.camera.calibration import calibration_of_grid
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.ground import project
from plenofir.plan.sensor.chip import resampling
from plenofir_studies.synthetic import regular_grid
from plenofir_tb.runner import Case, run_cases

EXAMPLES = project.root() / "examples"
HDL = project.root() / "hdl" / "axi"
REFOCUSER = CoreConfiguration(micro_image_size=3, shifts=(2, -1, 0), max_columns=15)
# That of the sessions in docs/registers.md.
SESSION = CoreConfiguration(micro_image_size=5, shifts=(-3, -1, 0, 2), max_columns=20)
STACK = CoreConfiguration(
    micro_image_size=3, shifts=(-1, 2), max_columns=14, boxes=(2, 3), engine=StackEngine()
)
# With the index behind it two pixels a clock, and each slice twice.
JUDGED = CoreConfiguration(
    micro_image_size=3,
    shifts=(-1, -1, 2, 2),
    max_columns=14,
    boxes=(3, 2, 3, 1),
    engine=StackEngine(pixels_per_clock=2),
)
INDEX = DepthIndexConfiguration(
    micro_image_size=3, slices=2, max_columns=14, confidence=800, sharp_too=True
)
WISHBONE = {
    "MICRO_IMAGE_SIZE": 3,
    "SHIFTS": "2 -1 0",
    "MAX_COLUMNS": 15,
    "ENGINE": "fir",
}
SHAPE = (30, 40)


@pytest.fixture
def library(tmp_path: Path) -> str:
    """The example in C as a library; nothing where there is no compiler."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return ""
    file = tmp_path / "libplenofir_start.so"
    strict = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-I", str(HDL))
    source = str(EXAMPLES / "c" / "plenofir_start.c")
    subprocess.run([compiler, *strict, "-shared", "-fPIC", "-o", file, source], check=True)
    # Also compiled as a program, which uses POSIX.
    program = ("-DPLENOFIR_MAIN", "-D_POSIX_C_SOURCE=200809L", "-o", str(tmp_path / "start"))
    subprocess.run([compiler, *strict, *program, source], check=True)
    return str(file)


def test_driver(library: str) -> None:
    for package in ("cocotbext.axi", "cocotbext.wishbone", "cocotbpynq"):
        pytest.importorskip(package, reason=f"{package} is missing: scripts/setup.sh tests")
    stack = {"kind": "stack_axi", "core": STACK.model_dump(mode="json")}
    judged = {
        "kind": "stack_axi",
        "core": JUDGED.model_dump(mode="json"),
        "index": INDEX.model_dump(mode="json"),
    }
    index = {"DEPTH_INDEX": True, "RADIUS": INDEX.radius}
    index |= {"CONFIDENCE": INDEX.confidence, "SHARP_TOO": True}
    grids = [regular_grid(SHAPE, 6.3, rotation_degrees=degrees) for degrees in (0.7, -0.4)]
    calibrations = [calibration_of_grid(grid, SHAPE) for grid in grids]
    chips = [resampling(calibration, 5, devignette=False) for calibration in calibrations]
    chip = max((chip.core for chip in chips), key=lambda core: core.lines)
    other = regular_grid(SHAPE, 6.3, layout="hexagonal-rows")
    sensor = {
        "kind": "sensor_axi",
        "core": chip.model_dump(),
        "calibrations": [calibration.model_dump(mode="json") for calibration in calibrations],
        "other": calibration_of_grid(other, SHAPE).model_dump(mode="json"),
    }
    refocuser = {"kind": "refocuser_axi", "core": REFOCUSER.model_dump(mode="json")}
    session = {"core": SESSION.model_dump(mode="json")}
    on_wishbone = {"kind": "refocuser_wishbone"}
    with_library = {**refocuser, "library": library} if library else refocuser
    run_cases(
        [
            Case("refocuser_axi", "axi.driver_bench", REFOCUSER.generics(), with_library),
            Case("refocuser_wishbone", "axi.driver_bench", WISHBONE, {**refocuser, **on_wishbone}),
            Case("refocuser_wishbone", "axi.wishbone_bench", WISHBONE, {"accesses": 500}),
            Case("stack_axi", "axi.driver_bench", STACK.generics(), stack),
            Case("stack_axi", "axi.driver_bench", {**JUDGED.generics(), **index}, judged),
            Case("refocuser_axi", "axi.session_bench", SESSION.generics(), session),
            Case("sensor_axi", "axi.driver_bench", chip.generics(), sensor),
        ]
    )


def test_device_tree(tmp_path: Path) -> None:
    if shutil.which("dtc") is None:
        pytest.skip("dtc is not installed (scripts/setup.sh tests)")
    source = EXAMPLES / "linux" / "plenofir.dtso"
    done = subprocess.run(
        ["dtc", "-@", "-I", "dts", "-O", "dtb", "-o", tmp_path / "plenofir.dtbo", source],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr, done.stderr
