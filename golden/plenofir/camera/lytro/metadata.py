# SPDX-License-Identifier: Apache-2.0
"""Metadata of a Lytro frame: pixels, micro lenses, main lens.

The first camera (F01), the Illum and the white images of both name the same things, at different
places. Lengths are in metres there and here.
"""

from math import hypot, isfinite
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from plenofir.camera.calibration.grid import Grid, Layout
from plenofir.camera.lytro.container import Json, part_of
from plenofir.ground.errors import InputError, validation_error

Corner = Literal["r", "gr", "gb", "b"]
CHANNELS: tuple[Corner, ...] = ("r", "gr", "gb", "b")
# Sizes come from a file, and memory is asked for by them: an absurd one must be refused first.
_LARGEST_SIDE = 1 << 15
_MOST_PIXELS = 1 << 27
_LAYOUTS: dict[str, Layout] = {
    "hexUniformRowMajor": "hexagonal-rows",
    "squareUniform": "rectangular",
}
# Smaller micro images cannot be resolved; of larger ones a picture holds too few.
_SMALLEST_PITCH, _LARGEST_PITCH = 2.8, 200.0


class Numbers(BaseModel):
    """Base of the parts: other fields are ignored, nan and infinity refused."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class Vector(Numbers):
    """(x, y[, z]) in metres, or a factor for each."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Bayer(Numbers):
    """A number for each colour of the mosaic."""

    r: float
    gr: float
    gb: float
    b: float

    def of(self, channel: Corner) -> float:
        """Number of a colour."""
        return float(getattr(self, channel))


class Mosaic(Numbers):
    """Colour filters: a tile of 2 x 2 pixels."""

    tile: Literal["r,gr:gb,b"]
    upperLeftPixel: Corner  # noqa: N815


class Packing(Numbers):
    """How pixels are packed."""

    endianness: Literal["big", "little"]
    bitsPerPixel: Literal[10, 12]  # noqa: N815

    @model_validator(mode="after")
    def _has_layout(self) -> "Packing":
        if (self.bitsPerPixel, self.endianness) not in ((12, "big"), (10, "little")):
            raise ValueError("must be 12 bit big endian (F01) or 10 bit little endian (Illum)")
        return self


class MicroLenses(Numbers):
    """The micro lens array."""

    tiling: str
    lensPitch: float = Field(gt=0, le=1e-2)  # noqa: N815
    rotation: float = Field(ge=-0.2, le=0.2)
    scaleFactor: Vector = Vector(x=1.0, y=1.0)  # noqa: N815
    sensorOffset: Vector = Vector()  # noqa: N815


class MainLens(Numbers):
    """The main lens, as far as it is known."""

    focalLength: float | None = None  # noqa: N815
    fNumber: float | None = None  # noqa: N815
    zoomStep: float | None = None  # noqa: N815
    focusStep: float | None = None  # noqa: N815
    exitPupilOffset: Vector | None = None  # noqa: N815


class FrameMetadata(Numbers):
    """A frame's metadata."""

    model: str  # Camera, such as F01 or ILLUM.
    serial: str | None = None  # number of the camera, where the file tells
    # Pixels of the raw picture.
    width: int = Field(ge=16, le=_LARGEST_SIDE, multiple_of=4)
    height: int = Field(ge=16, le=_LARGEST_SIDE, multiple_of=2)
    packing: Packing
    mosaic: Mosaic
    # Grey levels without light and of full scale.
    black: Bayer
    white: Bayer
    gains: Bayer | None = None  # White balance: factor for each colour.
    # Camera's colours to sRGB, three rows, where the file tells.
    matrix: tuple[float, ...] | None = Field(default=None, min_length=9, max_length=9)
    # Exponent that the camera's own pictures are encoded with, where the file tells.
    gamma: float | None = Field(default=None, gt=0.1, le=4)
    # How the picture is to be turned, as EXIF counts; the cameras write 1.
    orientation: int = Field(default=1, ge=1, le=8)
    pixel_pitch: float = Field(gt=0, le=1e-3)  # In metres.
    mla: MicroLenses
    lens: MainLens = MainLens()

    @model_validator(mode="after")
    def _fits_together(self) -> "FrameMetadata":
        if self.width * self.height > _MOST_PIXELS:
            raise ValueError(f"{self.width} x {self.height} pixels are more than {_MOST_PIXELS}")
        if not self.has_tiling:
            raise ValueError(f"tiling {self.mla.tiling!r}, known are {', '.join(_LAYOUTS)}")
        scale = self.mla.scaleFactor
        if not (0.5 < scale.x < 2 and 0.5 < scale.y < 2):
            raise ValueError("scaleFactor must be near 1")
        if not _SMALLEST_PITCH <= self.pitch_px <= _LARGEST_PITCH:
            raise ValueError(
                f"micro lenses {self.pitch_px:.3g} pixels apart, "
                f"not {_SMALLEST_PITCH} to {_LARGEST_PITCH:.0f}"
            )
        # An offset in another unit is a number like any other: the picture's size tells.
        offset = hypot(self.mla.sensorOffset.x, self.mla.sensorOffset.y) / self.pixel_pitch
        if offset > max(self.width, self.height):
            raise ValueError(f"a sensorOffset of {offset:.0f} pixels, outside of the picture")
        for channel in CHANNELS:
            black, white = self.black.of(channel), self.white.of(channel)
            if not 0 <= black < white < 1 << self.packing.bitsPerPixel:
                raise ValueError(f"black {black:g} and white {white:g} of {channel}")
            if self.gains is not None and not 0.05 < self.gains.of(channel) < 50:
                raise ValueError(f"a white balance gain of {self.gains.of(channel):g}")
        return self

    @property
    def has_tiling(self) -> bool:
        """Whether the layout is one of those that are known."""
        return self.mla.tiling in _LAYOUTS

    @property
    def pitch_px(self) -> float:
        """Pitch of the micro images in pixels: light that leaves the exit pupil spreads."""
        pupil = self.lens.exitPupilOffset
        spread = 1.0
        if pupil is not None and pupil.z > 0:
            spread += self.mla.sensorOffset.z / pupil.z
        return self.mla.lensPitch / self.pixel_pitch * spread

    def grid(self) -> Grid:
        """Where the micro images lie, by these metadata alone.

        Lens (0, 0) lies at the middle of the sensor plus `sensorOffset`; rotation is clockwise as
        the picture is seen. Readers of others (lightfields, UAM.Optics) agree on this; how well a
        camera's pixels do is measured (`plenofir.camera.patterns.match`).
        """
        layout = _LAYOUTS[self.mla.tiling]
        turn, scale, offset = self.mla.rotation, self.mla.scaleFactor, self.mla.sensorOffset
        right = self.pitch_px * scale.x * np.array([np.sin(turn), np.cos(turn)])
        down = self.pitch_px * scale.y * np.array([np.cos(turn), -np.sin(turn)])
        if layout == "hexagonal-rows":
            down = down * np.sqrt(0.75)
        origin = (np.array([self.height, self.width]) - 1) / 2
        origin = origin + np.array([offset.y, offset.x]) / self.pixel_pitch
        return Grid(
            layout=layout,
            order=1,
            middle=(0.0, 0.0),
            scale=1.0,
            coefficients=(tuple(origin), tuple(down), tuple(right)),
        )

    def described(self) -> list[tuple[str, str]]:
        """Headings and texts for people."""
        mla, lens = self.mla, self.lens
        offset = np.array([mla.sensorOffset.x, mla.sensorOffset.y]) / self.pixel_pitch
        lines = [
            ("camera", self.model + (f", serial number {self.serial}" if self.serial else "")),
            (
                "pixels",
                f"{self.width} x {self.height}, {self.packing.bitsPerPixel} bit, colour filters "
                f"from {self.mosaic.upperLeftPixel}, {1e6 * self.pixel_pitch:.2f} um pitch",
            ),
            (
                "micro lenses",
                f"{mla.tiling}, pitch {self.pitch_px:.4f} pixels, rotation "
                f"{np.degrees(mla.rotation):.4f} degrees, offset {offset[0]:.2f}, {offset[1]:.2f}",
            ),
        ]
        words = []
        if lens.focalLength:
            words.append(f"focal length {1e3 * lens.focalLength:.2f} mm")
        if lens.fNumber:
            words.append(f"f/{lens.fNumber:.2f}")
        for name, value in (("zoom step", lens.zoomStep), ("focus step", lens.focusStep)):
            if value is not None:
                words.append(f"{name} {value:g}")
        if lens.exitPupilOffset is not None and lens.exitPupilOffset.z < 100:
            words.append(f"exit pupil at {1e3 * lens.exitPupilOffset.z:.1f} mm")
        if words:
            lines.append(("main lens", ", ".join(words)))
        return lines


def _first(content: Any, *paths: tuple[str | int, ...]) -> Any:
    """Value at the first of these places that has one."""
    for path in paths:
        value = part_of(content, *path)
        if value is not None:
            return value
    return None


def frame_metadata(content: Json, where: str, private: Json | None = None) -> FrameMetadata:
    """Read a frame's metadata.

    `content`: as a container, a .json or a .txt beside a .raw file has them. `private`: private
    metadata, for the serial number. Raises `InputError` if something is missing, unknown or
    contradicts something else.
    """
    frame = part_of(content, "master", "picture", "frameArray", 0, "frame")
    if isinstance(frame, dict):
        private = frame.get("privateMetadata") or private
        content = frame.get("metadata") or {}
    image = part_of(content, "image") or {}
    details = part_of(image, "rawDetails") or image
    sensor = part_of(content, "devices", "sensor") or {}
    orientation = part_of(image, "orientation")
    gains = _first(
        content, ("algorithms", "awb", "computed", "gain"), ("image", "color", "whiteBalanceGain")
    )
    fields = {
        "model": part_of(content, "camera", "model"),
        "serial": part_of(private or content, "camera", "serialNumber"),
        "width": part_of(image, "width"),
        "height": part_of(image, "height"),
        "packing": part_of(details, "pixelPacking"),
        "mosaic": part_of(details, "mosaic") or part_of(sensor, "mosaic"),
        "black": part_of(details, "pixelFormat", "black"),
        "white": part_of(details, "pixelFormat", "white"),
        "gains": gains,
        "matrix": _first(image, ("color", "ccm"), ("color", "ccmRgbToSrgbArray")),
        "gamma": part_of(image, "color", "gamma"),
        "orientation": orientation if orientation in range(2, 9) else None,
        "pixel_pitch": part_of(sensor, "pixelPitch"),
        "mla": part_of(content, "devices", "mla"),
        "lens": part_of(content, "devices", "lens"),
    }
    try:
        return FrameMetadata.model_validate(
            {name: value for name, value in fields.items() if value is not None}
        )
    except ValidationError as error:
        refusal = validation_error(error, where=where)
        raise InputError(f"metadata: {refusal.problem}", where=where) from None


def steps_apart(one: MainLens, other: MainLens) -> tuple[float, float]:
    """How far two frames are apart in zoom and in focus; infinite where that is not known."""
    apart = []
    for a, b in ((one.zoomStep, other.zoomStep), (one.focusStep, other.focusStep)):
        apart.append(abs(a - b) if a is not None and b is not None else float("inf"))
    return apart[0], apart[1]


def steps_text(lens: MainLens) -> str:
    """Zoom and focus step for people."""
    parts = [
        f"{name} {value:g}"
        for name, value in (("zoom step", lens.zoomStep), ("focus step", lens.focusStep))
        if value is not None and isfinite(value)
    ]
    return ", ".join(parts) or "no zoom and focus steps"
