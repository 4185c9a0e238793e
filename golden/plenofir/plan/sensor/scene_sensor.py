# SPDX-License-Identifier: Apache-2.0
"""The sensor of a scene, whose raw frames the chip resamples to the raster."""

from dataclasses import dataclass, replace
from math import ceil, cos, floor, radians, sin, sqrt, tan
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from plenofir.camera.calibration import load_calibration
from plenofir.camera.calibration.shading import BORDER
from plenofir.camera.resampling import BayerOrder
from plenofir.camera.resampling.lines import LATENCY
from plenofir.camera.resampling.registers import ChipLayout
from plenofir.fpga.core.configuration import MAX_MICRO_IMAGE_SIZE
from plenofir.fpga.sensors import SensorPattern
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.board_load import Shown
from plenofir.plan.sensor.board_sensor import CAMERA_LATE_LINES, sensor_delay_lines
from plenofir.plan.sensor.chip import Resampling, check_frame, check_ring, resampling, shown_lines
from plenofir.plan.sensor.resampler import ResamplerConfiguration, SensorLogic

LARGEST_ROTATION_DEGREES = 30
_LINES_OF_MOVES = 4
"""A lens is moved by up to two pixels to either side."""
_PITCHES = 1.01
"""Largest pitch beside the least one, unless a scene says it."""


class SceneSensor(BaseModel):
    """The sensor: its raw frames, and where its micro images are."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    columns: Annotated[int, Field(ge=2, le=8192)]
    rows: Annotated[int, Field(ge=2, le=8192)]
    bits: Annotated[int, Field(ge=1, le=16)] = 8
    mosaic: BayerOrder | None = None  # order of its colour filters; None for a sensor without
    # File (relative to the scene file) of the calibration that is built in.
    calibration: Annotated[str, Field(min_length=1)] | None = None
    # Layout without a calibration: any within the following limits can be loaded at run time.
    # "skewed": hexagonal rows of a focused camera.
    layout: ChipLayout | None = None
    # Least distance of neighbouring lenses.
    pitch_px: Annotated[float, Field(ge=1, le=MAX_MICRO_IMAGE_SIZE)] | None = None
    # Largest distance of neighbouring lenses; 1 % more than the least if None. With video in and
    # out the ring also holds as many lines as the raster has fewer than the sensor; that of a
    # skewed raster holds the lines of a lens.
    largest_pitch_px: Annotated[float, Field(ge=1, le=2 * MAX_MICRO_IMAGE_SIZE)] | None = None
    # Largest rotation to either side.
    rotation_degrees: Annotated[float, Field(ge=0, le=LARGEST_ROTATION_DEGREES)] | None = None
    distortion: bool | None = None  # lenses may be up to two pixels off an even grid
    devignette: bool = False  # vignetting is corrected, by a table of all lenses
    # Source of raw frames: "frames", a stream or video, or "csi", a sensor's lanes. With "csi"
    # build.path = "camera" sets the sensor up: type, exposure (None: half of a frame), gain,
    # pattern.
    input: Literal["frames", "csi"] = "frames"
    chip: Literal["imx219"] = "imx219"
    exposure_lines: Annotated[int, Field(ge=4, le=65535)] | None = None
    gain: Annotated[int, Field(ge=0, le=232)] = 0
    pattern: SensorPattern = "off"

    @model_validator(mode="after")
    def _calibration_or_limits(self) -> "SceneSensor":
        pitches = self.pitch_px, self.largest_pitch_px
        limits = (self.layout, *pitches, self.rotation_degrees, self.distortion)
        if self.calibration is not None and any(value is not None for value in limits):
            raise ValueError(
                "give either calibration or limits (pitch_px, rotation_degrees), not both"
            )
        if self.calibration is None and None in (self.pitch_px, self.rotation_degrees):
            raise ValueError("give calibration, or pitch_px and rotation_degrees")
        least, largest = pitches
        if least is not None and largest is not None and largest < least:
            raise ValueError("largest_pitch_px must be at least pitch_px")
        return self


@dataclass(frozen=True)
class SensorChip:
    """The resampling hardware of a scene."""

    core: ResamplerConfiguration
    mosaic: BayerOrder | None  # order of the colour filters in front of it
    columns: int  # of the raw frame, as `rows`
    rows: int
    raster: tuple[int, int]  # rows and columns; the largest, if calibrations are loaded at run time
    full_rate: bool  # a source without gaps never has to wait
    calibrated: Resampling | None  # the calibration that is built in
    shown: Shown | None = None  # limits by a board's screen; None without video in and out

    @property
    def logic(self) -> SensorLogic:
        """Mosaic and resampler, for the estimate."""
        return SensorLogic(self.core, self.mosaic is not None)


def sensor_chip(
    sensor: SceneSensor,
    micro_image_size: int,
    colour: Literal["grey", "rgb"],
    path: Path,
    *,
    video: bool = False,
) -> SensorChip:
    """Resampler for a scene's sensor: for its calibration, or for every one within the limits.

    `colour`: whether pixels after the mosaic are RGB. `path`: the scene's file, for relative paths.
    `video`: the raster is shown with the timing of the raw frames.
    """
    channels = 3 if colour == "rgb" else 1
    if sensor.mosaic is not None and channels != 3:
        raise InputError(
            "a mosaic gives colours; set frame.colour = 'rgb'", where=f"{path}: sensor.mosaic"
        )
    if sensor.calibration is not None:
        chip = _calibrated(sensor, micro_image_size, channels, path, video=video)
    else:
        chip = _limited(sensor, micro_image_size, channels, path, video=video)
    if not video:
        return chip
    if sensor.input == "csi":
        lines = chip.core.lines + CAMERA_LATE_LINES
        check_ring(lines, "a screen that waits for the camera", where=f"{path}: sensor")
        chip = replace(chip, core=chip.core.model_copy(update={"lines": lines}))
    return replace(
        chip, shown=Shown(sensor.rows, chip.raster[1], 0 if sensor.mosaic is None else 1)
    )


def _calibrated(
    sensor: SceneSensor, m: int, channels: int, path: Path, *, video: bool
) -> SensorChip:
    assert sensor.calibration is not None
    where = f"{path}: sensor.calibration"
    calibration = load_calibration(path.parent / sensor.calibration)
    check_frame(calibration, sensor.rows, sensor.columns, where=where)
    chip = resampling(
        calibration,
        m,
        channels=channels,
        pixel_bits=sensor.bits,
        devignette=sensor.devignette,
        where=where,
    )
    core = chip.core
    if video:
        mosaic = sensor.mosaic is not None
        lines = shown_lines(chip.registers, chip.tables, mosaic=mosaic, where=where)
        check_ring(lines, "a raster shown under the raw frames' timing", where=where)
        core = core.model_copy(update={"lines": lines})
        chip = replace(chip, core=core)
    return SensorChip(
        core=core,
        mosaic=sensor.mosaic,
        columns=sensor.columns,
        rows=sensor.rows,
        raster=chip.registers.raster_shape,
        full_rate=chip.needs.full_rate is not None,
        calibrated=chip,
    )


def _limited(sensor: SceneSensor, m: int, channels: int, path: Path, *, video: bool) -> SensorChip:
    pitch, rotation = sensor.pitch_px, sensor.rotation_degrees
    assert pitch is not None
    assert rotation is not None
    where, angle = f"{path}: sensor", radians(rotation)
    skewed = sensor.layout == "skewed"
    if m > ceil(pitch) and not skewed:
        raise InputError(
            f"pitch_px = {pitch:g} is too small for M = {m}; it must be above {m - 1}", where=where
        )
    if skewed and not 2 <= m <= 4 * pitch:
        raise InputError(
            f"M = {m} is not possible with micro images {pitch:g} pixels apart; use 2 to "
            f"{int(4 * pitch)}",
            where=where,
        )
    hexagonal = sensor.layout == "hexagonal-rows"
    row_pitch = pitch * sqrt(3) / 2 if hexagonal or skewed else pitch
    # A row of n lenses, whose centres lie in the image, is (n - 1) pitch cos(angle) wide.
    lenses_down = floor((sensor.rows - 1 + 2 * BORDER) / (row_pitch * cos(angle))) + 1
    lenses_across = floor((sensor.columns - 1 + 2 * BORDER) / (pitch * cos(angle))) + 1
    outputs = lenses_across
    if hexagonal:
        outputs = floor((lenses_across - 1.5) / (row_pitch / pitch)) + 1
    moves, across = sensor.distortion or False, sensor.columns
    if skewed:
        # All rows and columns, 60 degrees apart, that have a lens in the frame.
        turn, side = sin(angle), tan(radians(30))
        down = sensor.rows * cos(angle) + sensor.columns * turn
        across = ceil(sensor.columns * cos(angle) + sensor.rows * turn + side * down)
        lenses_down = floor(down / row_pitch) + 1
        outputs = lenses_across = floor(across / pitch) + 1
    gains = sensor.devignette or skewed
    drift = ceil(across * tan(angle)) + _LINES_OF_MOVES * moves
    # A line is delayed by clocks, which are whole lines if there are few columns.
    largest = row_pitch / pitch * (sensor.largest_pitch_px or _PITCHES * pitch)
    # Raw lines of a row of micro images.
    high = max(m, ceil(largest) + 2) if skewed else m
    lines = drift + high + 4 + 4 * LATENCY // sensor.columns
    raster = lenses_down * m, outputs * m
    # Lenses cut by the border are included, so with few lenses the raster may have more pixels than
    # the raw frame.
    line = max(outputs, lenses_across) * m
    keeps_up = m <= row_pitch and line <= sensor.columns
    keeps_up = keeps_up and raster[0] * line <= sensor.rows * sensor.columns
    if skewed and not keeps_up:
        # A source that has to wait needs the lines of one line of the raster alone, since whole
        # micro images lie in the frame.
        lines = min(lines, 2 * drift + ceil(largest / m) + 8)
    cause = f"a rotation of {rotation:g} degrees"
    if video:
        # Lenses of the largest pitch whose rows certainly lie in the image.
        rows = m * max(floor((sensor.rows - 1 - drift) / largest), 0)
        lines = max(sensor.rows - rows, drift + high) + m // 2 + 3
        lines += sensor_delay_lines(m, mosaic=sensor.mosaic is not None)
        cause += ", pitches and a raster shown under the raw frames' timing"
    lines += lines % 2
    check_ring(lines, cause, where=f"{where}.rotation_degrees")
    if video:
        # A calibration whose raster is larger than the frame is refused.
        raster = min(raster[0], sensor.rows // m * m), min(raster[1], sensor.columns // m * m)
    return SensorChip(
        core=ResamplerConfiguration(
            micro_image_size=m,
            hexagonal=hexagonal,
            skewed=skewed,
            max_columns=sensor.columns,
            lines=lines,
            lenses=lenses_down * lenses_across if moves or gains else 2,
            moves=moves,
            gains=gains,
            channels=channels,
            pixel_bits=sensor.bits,
        ),
        mosaic=sensor.mosaic,
        columns=sensor.columns,
        rows=sensor.rows,
        raster=raster,
        full_rate=keeps_up,
        calibrated=None,
    )
