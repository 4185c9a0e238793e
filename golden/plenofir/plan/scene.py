# SPDX-License-Identifier: Apache-2.0
"""The scene profile, ``scene.toml``: camera, frame, depths, and what to build."""

from functools import partial
from math import inf
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from plenofir.fpga.boards import BOARDS, board_of
from plenofir.fpga.core.configuration import MAX_COLUMNS, MAX_MICRO_IMAGE_SIZE, MAX_ROWS
from plenofir.fpga.core.engine import MAX_PARALLEL_ROWS, PixelsPerClock
from plenofir.fpga.csi import RAW_BITS
from plenofir.fpga.devices import DEFAULT_DEVICE, DEVICES, device_name
from plenofir.fpga.hdmi.modes import find_source_mode
from plenofir.fpga.names import SliceEngineName, engines_with
from plenofir.ground.errors import InputError
from plenofir.plan.scene_device import SceneDevice, nearest_device
from plenofir.plan.scene_light_field import SceneStored
from plenofir.plan.scene_screen import SceneScreen
from plenofir.plan.scene_stack import SceneStack
from plenofir.plan.sensor.scene_lanes import SceneLanes
from plenofir.plan.sensor.scene_sensor import SceneSensor
from plenofir.refocus import Border
from plenofir.refocus.operator import box_size
from plenofir.refocus.sharpening import WEIGHT_ADVICE, check_sharpen, sharpening_units

Distance = Annotated[float, Field(gt=0)]
Blank = Annotated[int, Field(ge=0, le=4096)]


def _as_tuple(value: Any) -> Any:
    # TOML has lists only, and strict validation takes no list for a tuple.
    return tuple(value) if isinstance(value, list) else value


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def _refuse_first(*rules: tuple[bool, str]) -> None:
    """Refuse with the message of the first broken rule."""
    if broken := next((text for is_broken, text in rules if is_broken), ""):
        raise ValueError(broken)


class SceneCamera(_Part):
    """The camera."""

    micro_image_size: Annotated[int, Field(ge=1, le=MAX_MICRO_IMAGE_SIZE)]  # M in pixels
    # Shipped camera or TOML file (relative to the scene file); required for a depth range.
    model: Annotated[str, Field(min_length=1)] | None = None
    # Distance that the main lens is focused to, from the micro lenses; inf allowed.
    focus_mm: Distance = inf


class SceneFrame(_Part):
    """The raw image."""

    columns: Annotated[int, Field(ge=1, le=MAX_COLUMNS)]
    rows: Annotated[int, Field(ge=1, le=MAX_ROWS)]
    # None for stills.
    rate_hz: Annotated[float, Field(ge=0.001, allow_inf_nan=False)] | None = None
    colour: Literal["grey", "rgb"]
    bits: Annotated[int, Field(ge=1, le=16)] = 8  # width of a channel
    # Clocks without pixels that the source sends too, in pixels a line and lines a frame: "none"
    # for a source that waits, such as a memory; "video" for those of the video mode of this size.
    blanking: Literal["none", "video"] | tuple[Blank, Blank] = "none"

    _list_to_tuple = field_validator("blanking", mode="before")(_as_tuple)

    @model_validator(mode="after")
    def _has_its_mode(self) -> "SceneFrame":
        if self.blanking == "none":
            return self
        if self.rate_hz is None:
            raise ValueError("blanking needs rate_hz")
        size = self.columns, self.rows, self.rate_hz
        if self.blanking == "video" and find_source_mode(*size) is None:
            raise ValueError(
                f"blanking = 'video': no mode of {self.columns} x {self.rows} at {self.rate_hz:g} "
                "Hz is known; give [pixels, lines]"
            )
        return self

    @property
    def blank(self) -> tuple[int, int]:
        """Pixels of a line and lines of a frame that the source sends without content."""
        if self.blanking == "none":
            return 0, 0
        if self.blanking != "video":
            return self.blanking
        assert self.rate_hz is not None
        mode = find_source_mode(self.columns, self.rows, self.rate_hz)
        assert mode is not None
        return mode.h_total - self.columns, mode.v_total - self.rows

    @property
    def channels(self) -> int:
        return 3 if self.colour == "rgb" else 1


class SceneDepth(_Part):
    """What is to be in focus: a range of depths, or slices by their a."""

    near_mm: Distance | None = None  # from the micro lenses; far may be inf
    far_mm: Distance | None = None
    # Focus settings a, fractions whose denominators divide M.
    slices: Annotated[tuple[str, ...], Field(min_length=1)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _list_to_tuple(cls, content: Any) -> Any:
        # TOML has lists only, and strict validation takes no list for a tuple.
        if isinstance(content, dict) and isinstance(content.get("slices"), list):
            return {**content, "slices": tuple(content["slices"])}
        return content

    @model_validator(mode="after")
    def _one_of_both(self) -> "SceneDepth":
        has_range = self.near_mm is not None and self.far_mm is not None
        has_end = self.near_mm is not None or self.far_mm is not None
        if has_range == (self.slices is not None) or has_end != has_range:
            raise ValueError("give either near_mm and far_mm, or slices")
        if self.near_mm is not None and self.far_mm is not None and self.near_mm >= self.far_mm:
            raise ValueError("near_mm must be below far_mm")
        return self


Box = Annotated[int, Field(ge=1, le=MAX_MICRO_IMAGE_SIZE)]


class SceneBuild(_Part):
    """How it is to be computed, and where."""

    # "auto": exact if it fits the device, else stored products with as many fraction bits as fit.
    arithmetic: Literal["auto", "exact", "stored"] = "auto"
    fraction_bits: Annotated[int, Field(ge=0, le=12)] = 8  # of stored products, as `guard_bits`
    guard_bits: Annotated[int, Field(ge=0, le=12)] = 2
    # Interpolation between micro images: nearest neighbour, linear, or B-splines of higher order.
    interpolation: Literal["nearest", "linear", "2", "3"] = "nearest"
    # "off", "auto" or the weight b, such as "1/16", of taps a lens apart that sharpen what
    # refocusing between integer a blurs; with exact arithmetic, one row at a time, path "core".
    sharpen: str = "off"
    # Samples B of the box that each output averages along a dimension, M by default: one number, or
    # one for each of depth.slices; a multiple of gcd(a M, M).
    box: Box | tuple[Box, ...] | None = None
    # In place of box: cycles a micro lens at which half of the contrast is to be left, and noise at
    # most, as a share of the raw image's: the largest box that resolves so much, or the smallest
    # one that is so quiet.
    resolution: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    noise: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    # "normalise": near the border, where not all views reach, divide by the number that do; "zero":
    # count the others as black. With exact arithmetic, one row at a time, path "core", no sharpen.
    border: Border = "zero"
    # Rows that are filtered at once (iota).
    parallel_rows: Annotated[int, Field(ge=1, le=MAX_PARALLEL_ROWS)] = 1
    # Neighbouring pixels of a line that come together; "auto": the fewest that keep the frame rate
    # at the device's clock; above 1 for moving sums with exact arithmetic.
    pixels_per_clock: Literal["auto"] | PixelsPerClock = "auto"
    # "core": the streams of the raster core; "video": video in and out; "camera": a camera's lanes
    # in (sensor.input = "csi", or lanes), video out.
    path: Literal["core", "video", "camera"] = "core"
    device: str = DEFAULT_DEVICE  # what it must fit
    # Speed grade as the vendor names it; None for the one whose clocks are known.
    speed_grade: str | None = None
    # Clock that the core is built for; None for the one that the frame rate needs.
    clock_mhz: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)] | None = None
    # "auto": the one that fits; of two, the one whose scarcest resource is used less.
    engine: Literal["auto", SliceEngineName] = "auto"
    # File (relative to the scene file) of an EDID that the board serves instead of its own; for the
    # path "video".
    edid: Annotated[str, Field(min_length=1)] | None = None

    @field_validator("box", mode="before")
    @classmethod
    def _list_to_tuple(cls, content: Any) -> Any:
        return tuple(content) if isinstance(content, list) else content

    def boxes(self, shifts: tuple[int, ...], micro_image_size: int) -> tuple[int, ...]:
        """Box of each slice; empty if all are M."""
        boxes = self.box if isinstance(self.box, tuple) else (self.box,) * len(shifts)
        try:
            if len(boxes) != len(shifts):
                raise InputError(
                    f"has {len(boxes)} numbers for {len(shifts)} slices; give one for all, or one "
                    "for each"
                )
            whole = tuple(map(partial(box_size, micro_image_size), shifts, boxes))
        except InputError as error:
            raise InputError(error.problem, where="build.box") from None
        return whole if min(whole) < micro_image_size else ()

    @field_validator("device")
    @classmethod
    def _is_a_device(cls, name: str) -> str:
        if device_name(name) not in DEVICES:
            near = nearest_device(name)
            nearest = f"the nearest is {near}; " * bool(near)
            raise ValueError(
                f"not in the table of devices; {nearest}plenofir devices lists all, and [device] "
                "takes the facts of any other part of their families"
            )
        return device_name(name)

    @field_validator("sharpen")
    @classmethod
    def _is_a_weight(cls, text: str) -> str:
        try:
            check_sharpen(text)
        except InputError:
            raise ValueError(WEIGHT_ADVICE) from None
        return text

    @model_validator(mode="after")
    def _fits_together(self) -> "SceneBuild":
        sharpens = bool(sharpening_units(self.sharpen, 2, 1))
        normalises = self.border == "normalise"
        stored, video = self.arithmetic == "stored", self.path != "core"
        wishes = self.resolution is not None or self.noise is not None
        rows, many = self.parallel_rows > 1, self.pixels_per_clock not in ("auto", 1)
        _refuse_first(
            (self.guard_bits > self.fraction_bits, "guard_bits must be at most fraction_bits"),
            (video and self.clock_mhz is not None, "clock_mhz needs path = 'core'"),
            (video and self.speed_grade is not None, "speed_grade needs path = 'core'"),
            (sharpens and stored, "sharpen needs exact sums: arithmetic = 'exact' or 'auto'"),
            (sharpens and rows, "sharpen needs parallel_rows = 1"),
            (sharpens and video, "sharpen needs path = 'core'"),
            (self.box is not None and wishes, "give either box, or resolution and noise"),
            (normalises and stored, "border = 'normalise' needs arithmetic = 'exact' or 'auto'"),
            (normalises and rows, "border = 'normalise' needs parallel_rows = 1"),
            (normalises and video, "border = 'normalise' needs path = 'core'"),
            (normalises and sharpens, "border = 'normalise' needs sharpen = 'off'"),
            (
                rows and self.engine not in ("auto", *engines_with("parallel_rows")),
                f"engine = '{self.engine}' needs parallel_rows = 1",
            ),
            (
                many and (rows or self.engine not in ("auto", *engines_with("pixels_per_clock"))),
                "pixels_per_clock above 1 needs engine = "
                + " or ".join(map(repr, engines_with("pixels_per_clock"))),
            ),
            (many and stored, "pixels_per_clock above 1 needs arithmetic = 'exact'"),
            (
                many and self.path == "video",
                "path = 'video' needs pixels_per_clock = 1, as TMDS brings one pixel each clock",
            ),
        )
        return self


class Scene(_Part):
    """A scene profile."""

    # Short: letters, digits, and hyphens in between.
    name: Annotated[str, Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$", max_length=40)]
    title: str = ""  # description in a line
    camera: SceneCamera
    frame: SceneFrame
    depth: SceneDepth
    build: SceneBuild = SceneBuild()
    # A part that is not in the table, in place of build.device.
    device: SceneDevice | None = None
    # Source of raw frames, from which the chip makes the raster; None if the raster comes in.
    sensor: SceneSensor | None = None
    screen: SceneScreen | None = None
    # All slices at once.
    stack: SceneStack | None = None
    # Lanes of a camera whose frames already are the raster.
    lanes: SceneLanes | None = None
    # Light field stored on the chip, instead of the test pattern.
    stored: SceneStored | None = None

    @model_validator(mode="after")
    def _parts_agree(self) -> "Scene":
        build, frame, sensor = self.build, self.frame, self.sensor
        video, board = build.path == "video", board_of(build.device)
        camera = build.path == "camera"
        colour = "rgb" if sensor is None else frame.colour
        boards = ", ".join(
            f"{d} ({b.title})" for b in BOARDS.values() if b.modes for d in b.devices
        )
        cameras, parallel = (
            ", ".join(
                f"{d} ({b.title})"
                for b in BOARDS.values()
                if b.camera is not None and (b.camera.out_bits or not out)
                for d in b.devices
            )
            for out in (False, True)
        )
        lanes = self.lanes is not None
        has_screen = bool(board and board.camera and board.camera.screen)
        # What asks for a focal stack.
        asks = "stack" if self.stack is not None else "screen.output"
        stack = self.stack is not None or (self.screen is not None and self.screen.judges)
        _refuse_first(
            (
                self.screen is not None and not video,
                "screen needs build.path = 'video'; a core alone gives more than the refocused "
                "picture by [stack]",
            ),
            (self.device is not None and build.path != "core", "device needs build.path = 'core'"),
            (
                self.device is not None
                and not build.model_fields_set.isdisjoint(("device", "speed_grade")),
                "[device] takes the place of build.device and build.speed_grade",
            ),
            (self.stack is not None and build.path != "core", "stack needs build.path = 'core'"),
            (
                self.screen is not None and sensor is not None,
                "a screen shows refocused and micro images if there is a sensor; leave it out",
            ),
            (
                stack and self.camera.micro_image_size < 2,
                f"{asks} needs camera.micro_image_size of 2 or more",
            ),
            (
                stack and build.arithmetic == "stored",
                f"{asks} needs build.arithmetic = 'exact'",
            ),
            (
                stack and build.interpolation != "nearest",
                f"{asks} needs build.interpolation = 'nearest'",
            ),
            (
                stack and build.engine != "auto",
                f"{asks} needs all slices in one pass: build.engine = 'auto'",
            ),
            (
                stack and build.parallel_rows > 1,
                f"{asks} needs build.parallel_rows = 1",
            ),
            (
                stack and bool(sharpening_units(build.sharpen, 2, 1)),
                f"{asks} needs build.sharpen = 'off'",
            ),
            (
                self.depth.slices is None and self.camera.model is None,
                "a depth range needs camera.model; without it give depth.slices",
            ),
            (
                video and sensor is not None and sensor.bits != 8,
                "build.path = 'video' needs sensor.bits = 8",
            ),
            (
                sensor is not None and build.pixels_per_clock not in ("auto", 1),
                "a sensor needs build.pixels_per_clock = 1",
            ),
            (
                video and (frame.colour != colour or frame.bits != 8),
                "build.path = 'video' needs frame.colour = 'rgb' with 8 bits",
            ),
            (video and frame.rate_hz is None, "build.path = 'video' needs frame.rate_hz"),
            (video and build.parallel_rows > 1, "build.path = 'video' needs parallel_rows = 1"),
            (
                video and (board is None or not board.modes),
                f"build.path = 'video' needs build.device of a board: {boards}",
            ),
            (not video and build.edid is not None, "build.edid needs build.path = 'video'"),
            (self.stored is not None and not video, "stored needs build.path = 'video'"),
            (
                camera != (lanes or (sensor is not None and sensor.input == "csi")),
                "build.path = 'camera' and sensor.input = 'csi', or lanes, need each other",
            ),
            (
                sensor is not None and sensor.input == "csi" and sensor.bits not in RAW_BITS,
                f"sensor.input = 'csi' needs sensor.bits of {', '.join(map(str, RAW_BITS))}",
            ),
            (
                frame.blanking != "none" and (build.path != "core" or sensor is not None),
                "frame.blanking needs build.path = 'core' without a sensor",
            ),
            (lanes and sensor is not None, "lanes bring the raster; leave the sensor out"),
            (lanes and frame.colour != "grey", "lanes need frame.colour = 'grey'"),
            (
                lanes and frame.bits not in RAW_BITS,
                f"lanes need frame.bits of {', '.join(map(str, RAW_BITS))}",
            ),
            (
                camera and (board is None or board.camera is None),
                f"build.path = 'camera' needs build.device of a board with a camera: {cameras}",
            ),
            (
                lanes and has_screen,
                f"lanes need build.device of a board with parallel video: {parallel}",
            ),
            (camera and build.parallel_rows > 1, "build.path = 'camera' needs parallel_rows = 1"),
            (
                self.stored is not None and sensor is not None,
                "a stored light field takes the place of a sensor; leave one of both out",
            ),
        )
        return self
