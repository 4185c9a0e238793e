# SPDX-License-Identifier: Apache-2.0
"""The result of planning: slices, engines, the sensor, resources."""

from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from plenofir.camera.resampling import BayerOrder, red_place
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.devices import DEFAULT_DEVICE, DEVICES, Device
from plenofir.fpga.names import SliceEngineName
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.chip_light_field import StoredLightField
from plenofir.plan.sensor.board_camera import PlannedCamera
from plenofir.plan.sensor.board_load import Shown, description
from plenofir.plan.sensor.board_sensor import BoardSensor
from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration
from plenofir.plan.sensor.scene_sensor import SensorChip


class PlannedSlice(BaseModel):
    """A slice of the plan."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    a: str  # focus setting, a fraction with denominator M
    shift: int  # a' in pixels
    near_mm: float | None  # depth of field; None without a camera
    far_mm: float | None  # None also where it reaches infinity
    box: int  # B, samples that an output averages along a dimension
    # Frequency in cycles a micro lens at which half of the contrast is left, in focus.
    half_contrast: float
    noise: float  # standard deviation of the picture's noise over that of the raw image


class EngineOption(BaseModel):
    """One of the engines as a candidate."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    engine: SliceEngineName
    needs: dict[str, int] | None  # resources (estimate); None if it was not considered
    refused: str  # why it cannot be built; empty if it can


class LeftOut(BaseModel):
    """A feature that the scene does not need."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    what: str
    # Resources that it would add to the plan, and those that the plan needs in addition without it,
    # by the device's names.
    saves: dict[str, int]
    costs: dict[str, int]
    # Why it is left out all the same, if by the largest share of the device it costs more.
    reason: str = ""

    def change(self, available: Mapping[str, int]) -> str:
        """What leaving it out changes, with the shares of what a device has, the largest first."""
        parts = []
        for sign, amounts in (("-", self.saves), ("+", self.costs)):
            shares = {name: n / available[name] for name, n in amounts.items() if available[name]}
            for name in sorted(amounts, key=lambda name: -shares.get(name, 0)):
                share = f" ({100 * shares[name]:.1f} %)" if name in shares else ""
                parts.append(f"{sign}{amounts[name]} {name.partition(' (')[0]}{share}")
        return ", ".join(parts)


class PlannedSensor(BaseModel):
    """The logic between the sensor and the core."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    core: ResamplerConfiguration
    mosaic: BayerOrder | None  # order of the colour filters that are interpolated in front of it
    columns: int  # of the raw frames, as `rows`
    rows: int
    calibrated: bool  # a calibration is built in; else one is loaded at run time
    lines: int  # raw lines that the ring holds
    ring_bits: int
    full_rate: bool  # a source without gaps never has to wait
    needs: dict[str, int]  # resources (estimate)
    # Words for the load port, if a calibration is built in.
    loads: tuple[Load, ...] = Field(default=(), exclude=True)
    raster_columns: int  # of the longest line of the raster
    shown: Shown | None = None  # limits by a board's screen; None without video out

    def board_sensor(self, late: int = 0) -> BoardSensor:
        """The sensor of the board's package; calibrations cannot use `late` lines of the ring."""
        core = self.core.model_copy(update={"lines": self.core.lines - late})
        return BoardSensor(
            core=self.core,
            red_place=None if self.mosaic is None else red_place(self.mosaic),
            columns=self.columns,
            rows=self.rows,
            raster_columns=self.raster_columns,
            description=description(core, self.shown),
            loads=self.loads,
        )


def planned_sensor(chip: SensorChip, device: Device) -> PlannedSensor:
    """Plan the logic between a sensor and the core, with its resources on a device."""
    core = chip.core
    return PlannedSensor(
        core=core,
        mosaic=chip.mosaic,
        columns=chip.columns,
        rows=chip.rows,
        calibrated=chip.calibrated is not None,
        lines=core.lines,
        ring_bits=core.lines * core.max_columns * core.channels * core.pixel_bits,
        full_rate=chip.full_rate,
        needs=device.amounts(estimate(chip.logic.blocks, device.family)),
        loads=() if chip.calibrated is None else tuple(chip.calibrated.loads()),
        raster_columns=chip.raster[1],
        shown=chip.shown,
    )


class Plan(BaseModel):
    """The plan of a scene."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    scene: str
    path: str  # "core", "video" or "camera"
    device: str  # that it fits
    grade: str  # its speed grade
    part: str  # it with package and grade, as the vendor's tool names it
    # Clock that everything which follows is built for: constraints, projects, block designs.
    built_mhz: float
    kept_mhz: float  # clock that such cores are trusted to keep on the device; 0 if unknown
    clock_mhz: float | None  # pixel clock that the frame rate needs; None for stills
    # Pixels of horizontal and lines of vertical blanking that the source sends; None without.
    blanking: tuple[int, int] | None
    frame_clocks: int  # clocks for each frame, blanking included
    # Clocks from a frame's first pixel in to its first pixel out, and the lines among them: of the
    # core, or of the video path.
    latency_clocks: int
    latency_lines: int
    slices: tuple[PlannedSlice, ...]  # from far to near
    # (near, far) of what no slice of the grid covers; far None for infinity.
    gaps_mm: tuple[tuple[float, float | None], ...]
    core: CoreConfiguration
    columns: int  # of a frame; with a sensor, of the (largest) raster
    rows: int
    taps: int  # of the filters of each dimension
    # Lines that each channel keeps: of partial sums, or of pixels.
    line_buffers: int
    line_buffer_bits: int  # bits of all these lines
    error_bound: float  # largest distance from the real-valued operator in grey levels
    engines: tuple[EngineOption, ...]  # all, with their resources
    engine_reason: str  # why the one of `core` was chosen
    needs: dict[str, int]  # resources of the plan (estimate)
    error_class: str  # how far off the estimate may be
    # The part of them for video path and board control; None for a core.
    video_needs: dict[str, int] | None
    full: dict[str, int]  # resources of the full build
    full_build: str  # its description
    available: dict[str, int]  # resources of the device
    left_out: tuple[LeftOut, ...]  # features left out, each with the resources that it would take
    screen: Screen = Screen()  # outputs of a board's screen, and the text over them
    screen_needs: dict[str, int] | None = None  # resources of the text; None without one
    # Light field stored on the board, and its resources.
    stored: StoredLightField | None = Field(default=None, exclude=True)
    stored_needs: dict[str, int] | None = None
    # EDID in hexadecimal that the board serves instead of its own; None for its own.
    edid: str | None = None
    camera: PlannedCamera | None = None  # camera on the board's CSI-2 lanes
    # Resampler of a sensor's raw frames; None if the frames are the raster.
    sensor: PlannedSensor | None = None
    chip: Device = Field(default=DEVICES[DEFAULT_DEVICE], exclude=True)  # `device` in its grade
    notes: tuple[str, ...] = ()  # effects of the camera's optics on the slices
