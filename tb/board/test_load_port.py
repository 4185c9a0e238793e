# SPDX-License-Identifier: Apache-2.0
"""A calibration over the board's serial port, by the command that a user types."""

from pathlib import Path

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.synthetic import regular_grid
from plenofir.plan.board_load import description
from plenofir.plan.resampling import resampling
from plenofir_tb.runner import Case, run_cases

SHAPE = (40, 50)


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
    run_cases([Case("load_ports", "board.load_bench", generics, case)])
