# SPDX-License-Identifier: Apache-2.0
"""A scene as it is loaded: the profile, and the files and sensors that it names."""

import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from plenofir.camera.rays import Camera, RayModel, load_camera
from plenofir.fpga.boards import Board, board_of
from plenofir.fpga.devices import DEVICES, Device, device_name
from plenofir.fpga.hdmi.edid import check_edid
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.chip_light_field import StoredLightField
from plenofir.fpga.sensors import Entry
from plenofir.ground import project
from plenofir.ground.errors import InputError, validation_error
from plenofir.ground.files import input_file
from plenofir.plan.scene import Scene, SceneFrame
from plenofir.plan.scene_light_field import load_stored
from plenofir.plan.sensor.scene_lanes import load_registers
from plenofir.plan.sensor.scene_sensor import SceneSensor, SensorChip, sensor_chip
from plenofir.refocus.shifts import focus_to_shift


class LoadedScene(BaseModel):
    """A scene with everything that its file refers to."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    path: Path
    scene: Scene
    camera: Camera | None  # that it names
    shifts: tuple[int, ...] | None  # a' of the slices that it names
    edid: bytes | None = None  # that it names, checked
    sensor: SensorChip | None = None  # the resampler of its sensor's raw frames
    registers: tuple[Entry, ...] = ()  # of its lanes' sensor
    shown: Screen = Screen()  # its board's screen, once its slices are known
    stored: StoredLightField | None = None  # light field on its board

    @property
    def device(self) -> Device:
        """The device with its speed grade; InputError if it has no such grade."""
        build = self.scene.build
        if self.scene.device is not None:
            return self.scene.device.device()
        device = DEVICES[build.device]
        if build.speed_grade is None:
            return device
        try:
            return device.in_grade(build.speed_grade)
        except ValueError as error:
            raise InputError(
                f"no grade {build.speed_grade!r}: {error}", where=f"{self.path}: build.speed_grade"
            ) from None

    @property
    def video_size(self) -> tuple[int, int]:
        """Columns and rows of the frames that come in: the sensor's, if there is one."""
        size = self.scene.frame if self.sensor is None else self.sensor
        return size.columns, size.rows

    def model(self) -> RayModel | None:
        """Ray model of the camera, if it names one.

        InputError if the camera cannot be focused as the scene wants it.
        """
        if self.camera is None:
            return None
        part = self.scene.camera
        return RayModel.focused(self.camera, part.focus_mm, part.micro_image_size)


def scene_files() -> list[Path]:
    """Shipped scene profiles (TOML)."""
    return sorted((project.root() / "scenes").glob("*.toml"))


def load_scene(path: str | Path, device: str | None = None, *, core: bool = False) -> LoadedScene:
    """Load a shipped scene profile by name, or any scene profile from a file.

    `device` replaces the scene's own; if no board with it accepts such video, the scene gets only
    the core. `core`: it gets only the core in any case.

    InputError if there is no such file, or it is not valid: field, value and what is allowed.
    """
    shipped = {file.stem: file for file in scene_files()}
    file = shipped.get(str(path), Path(path))
    if not file.is_file():
        raise InputError(
            f"no such scene; give a TOML file, or one of {', '.join(shipped)}", where=str(path)
        )
    try:
        content = tomllib.loads(input_file(file).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(
            f"cannot be read ({error}); it must be a TOML file of a scene", where=str(file)
        ) from None
    if device is not None:
        content = _for_device(content, device)
    if core:
        content = _core_alone(content, content.get("build", {}))
    try:
        scene = Scene.model_validate(_with_a_frame(content, str(file)))
    except ValidationError as error:
        raise validation_error(error, where=str(file)) from None
    chip = None
    if scene.sensor is not None:
        chip = _chip_of(scene, scene.sensor, file)
        scene = scene.model_copy(update={"frame": _raster_frame(scene, chip, str(file))})
    model = scene.camera.model
    beside = file.parent / (model or "")
    edid, lanes = scene.build.edid, scene.lanes
    registers = None if lanes is None else lanes.registers
    return LoadedScene(
        path=file,
        scene=scene,
        sensor=chip,
        camera=None if model is None else load_camera(beside if beside.is_file() else model),
        shifts=_shifts_of(scene, file),
        edid=None if edid is None else _read_edid(file.parent / edid, where=f"{file}: build.edid"),
        registers=(
            ()
            if registers is None
            else load_registers(file.parent / registers, where=f"{file}: lanes.registers")
        ),
        stored=(
            None
            if scene.stored is None
            else load_stored(scene.stored, scene.camera.micro_image_size, file)
        ),
    )


def _for_device(content: dict[str, Any], device: str) -> dict[str, Any]:
    """Content of a scene for another device: with the core alone, if its boards have no input."""
    build = {**content.get("build", {}), "device": device}
    build.pop("speed_grade", None)
    content = {name: part for name, part in content.items() if name != "device"}
    board = board_of(device_name(device))
    has_video = board is not None and _takes(board, content.get("frame", {}))
    if board is not None and board.flow == "vivado":
        # Many boards have such a device, so its name alone asks for the core.
        has_video &= device_name(device) == device_name(content.get("build", {}).get("device", ""))
    has_camera = board is not None and board.camera is not None
    if "lanes" in content:
        has_camera = board is not None and bool(board.camera and board.camera.out_bits)
    if has_camera if build.get("path") == "camera" else has_video:
        return {**content, "build": build}
    return _core_alone(content, build)


def _core_alone(content: dict[str, Any], build: object) -> dict[str, Any]:
    """Content of a scene without what belongs to a board."""
    if not isinstance(build, dict) or build.get("path", "core") == "core":
        return {**content, "build": build}
    build = {**build, "path": "core"}
    build.pop("edid", None)
    kept = {name: part for name, part in content.items() if name not in ("stored", "lanes")}
    # Text is a part of the board; outputs other than the refocused one need another core.
    if _text_alone(kept.get("screen")):
        del kept["screen"]
    if isinstance(kept.get("sensor"), dict):
        kept["sensor"] = {**kept["sensor"], "input": "frames"}
    return {**kept, "build": build}


def _chip_of(scene: Scene, sensor: SceneSensor, file: Path) -> SensorChip:
    """The resampling hardware of a scene with a sensor."""
    board = board_of(scene.build.device)
    camera = board.camera if board is not None and scene.build.path == "camera" else None
    shows = camera is not None and camera.screen is not None
    video = scene.build.path == "video" or shows
    return sensor_chip(sensor, scene.camera.micro_image_size, scene.frame.colour, file, video=video)


def _shifts_of(scene: Scene, file: Path) -> tuple[int, ...] | None:
    """The a' in pixels that a scene lists, each once; None for a range of depths."""
    if scene.depth.slices is None:
        return None
    m, where = scene.camera.micro_image_size, f"{file}: depth.slices"
    shifts = tuple(focus_to_shift(a, m, where=where) for a in scene.depth.slices)
    for number, shift in enumerate(shifts):
        if shift in shifts[:number]:
            raise InputError(f"a = {Fraction(shift, m)} is given twice", where=where)
    return shifts


def _text_alone(screen: object) -> bool:
    """Whether a scene's screen has only text, which does not affect the core."""
    return isinstance(screen, dict) and screen.get("output", ["refocused"]) == ["refocused"]


def _takes(board: Board, frame: dict[str, Any]) -> bool:
    """Whether a board has video in, or shows frames of this size without a source."""
    mode = board.own_mode
    size = None if mode is None else (mode.h_active, mode.v_active)
    return bool(board.clock_ranges) or size == (frame.get("columns"), frame.get("rows"))


def _with_a_frame(content: dict[str, Any], where: str) -> dict[str, Any]:
    """Content of a scene; the size of a frame that a sensor gives is filled in later."""
    sensor, frame = content.get("sensor"), content.get("frame", {})
    if not isinstance(sensor, dict) or not isinstance(frame, dict):
        return content
    for name in ("columns", "rows", "bits"):
        if name in frame:
            raise InputError(
                f"frame.{name} = {frame[name]!r} must be left out: sensor and lenses give it",
                where=where,
            )
    colour = "grey" if sensor.get("mosaic") is None else "rgb"
    return {**content, "frame": {"colour": colour, "columns": 1, "rows": 1, **frame}}


def _raster_frame(scene: Scene, chip: SensorChip, where: str) -> SceneFrame:
    """Frame that comes out of the resampler."""
    rows, columns = chip.raster
    update = {"columns": columns, "rows": rows, "bits": chip.core.pixel_bits}
    try:
        return SceneFrame.model_validate({**scene.frame.model_dump(), **update})
    except ValidationError as error:
        raise validation_error(error, where=f"{where}: raster of the sensor") from None


def _read_edid(path: Path, *, where: str) -> bytes:
    """Read an EDID and check it."""
    try:
        content = input_file(path).read_bytes()
    except OSError as error:
        raise InputError(
            f"{path} cannot be read ({error.strerror or error}); it must be a file of "
            "128 or 256 bytes",
            where=where,
        ) from None
    check_edid(content, where=f"{where}: {path}")
    return content
