# SPDX-License-Identifier: Apache-2.0
"""Sensors whose raw frames come as video: their cameras, and a resampler for some of them."""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.camera.resampling import BayerOrder, red_place
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.plan.sensor.board_sensor import (
    SENSOR_OUTPUTS,
    SENSOR_PACKAGE,
    BoardSensor,
    sensor_package,
)
from plenofir.plan.sensor.chip import resampling, shown_lines
from plenofir.plan.sensor.resampler import ResamplerConfiguration
from plenofir_studies.synthetic import regular_grid


@dataclass(frozen=True)
class ShownCamera:
    """A camera whose sensor has as many rows and columns as a small video mode."""

    pitch: float
    rotation_degrees: float
    layout: str = "rectangular"
    shading: bool = False
    shape: tuple[int, int] = (36, 64)

    def model_dump(self) -> dict[str, Any]:
        """Its fields, for a case."""
        return asdict(self)

    @cached_property
    def calibration(self) -> Calibration:
        grid = regular_grid(
            self.shape,
            self.pitch,
            rotation_degrees=self.rotation_degrees,
            layout=self.layout,  # type: ignore[arg-type]
        )
        calibration = calibration_of_grid(grid, self.shape)
        if not self.shading:
            return calibration
        profile = tuple(tuple(1 - 0.1 * abs(k - 1) for k in range(3)) for _ in range(3))
        changes = {"shading": (-0.1, 0.05, 0.0), "profile": profile, "dark_level": 3.0}
        return calibration.model_copy(update=changes)


def shown_chip(
    m: int, cameras: list[ShownCamera], *, mosaic: bool, channels: int
) -> ResamplerConfiguration:
    """Resampler for all of the cameras."""
    chips = [resampling(c.calibration, m, channels=channels, devignette=c.shading) for c in cameras]
    lines = max(shown_lines(chip.registers, chip.tables, mosaic=mosaic) for chip in chips)
    return chips[0].core.model_copy(
        update={"lines": lines, "lenses": max(chip.core.lenses for chip in chips)}
    )


def sensor_packages(
    core: ResamplerConfiguration, shape: tuple[int, int], order: BayerOrder | None = None
) -> dict[str, str]:
    """The packages of a board with a sensor of some rows and columns: names and texts."""
    rows, columns = shape
    sensor = BoardSensor(
        core=core,
        red_place=None if order is None else red_place(order),
        columns=columns,
        rows=rows,
        raster_columns=columns,
        description="",
    )
    return {
        SENSOR_PACKAGE: sensor_package(sensor),
        SCREEN_PACKAGE: screen_package(Screen(outputs=SENSOR_OUTPUTS)),
    }
