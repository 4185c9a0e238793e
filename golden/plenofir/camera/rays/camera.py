# SPDX-License-Identifier: Apache-2.0
"""What a plenoptic camera is described by: micro lenses, main lens, sensor.

All lengths are in mm. A description is a small TOML file; those of some known cameras are shipped.
"""

import tomllib
from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from plenofir.ground import project
from plenofir.ground.errors import InputError, validation_error
from plenofir.ground.files import input_file

CAMERAS = project.DATA / "cameras"
MICROSCOPES = project.DATA / "microscopes"

# Beyond any camera, but small enough for products and quotients of lengths not to overflow.
_SHORTEST, _LONGEST = 1e-30, 1e30


def _length(value: float) -> float:
    if not _SHORTEST <= value <= _LONGEST:
        raise ValueError(f"Input should be a positive number from {_SHORTEST:g} to {_LONGEST:g}")
    return value


def _signed_length(value: float) -> float:
    if not abs(value) <= _LONGEST:
        raise ValueError(f"Input should be a number up to {_LONGEST:g} on either side")
    return value


def _pupil_distance(value: float) -> float:
    if value != inf and not _SHORTEST <= abs(value) <= _LONGEST:
        raise ValueError(
            f"Input should be a number other than 0, up to {_LONGEST:g} on either side, or inf"
        )
    return value


# Neither true nor a text is a length.
Length = Annotated[float, Field(strict=True), AfterValidator(_length)]
SignedLength = Annotated[float, Field(strict=True), AfterValidator(_signed_length)]
PupilDistance = Annotated[float, Field(strict=True), AfterValidator(_pupil_distance)]


def check_micro_image(size: object) -> None:
    """Refuse an M that no micro image has."""
    if not isinstance(size, int) or size < 2:
        raise InputError(
            f"M = {size!r} is not the size of a micro image; use an integer, 2 or more"
        )


class Part(BaseModel):
    """A part of a description: fields are checked, others refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


Kind = Literal["standard", "Galilean", "Keplerian"]
"""Where the micro lenses are focused: at infinity, behind the sensor, or in front of themselves."""


class MicroLensArray(Part):
    """Micro lenses before the sensor."""

    # f_s; a file may have `f_number` instead, f_s / p_M, or a list: the focal lengths of the types
    # of micro lenses in an array of several. Of these it is the first.
    focal_length_mm: Length
    other_focal_lengths_mm: tuple[Length, ...] = ()  # the rest of that list
    pitch_mm: Length  # p_M, distance between neighbouring micro lenses
    # b_s from the micro lenses to the sensor. Left out it is f_s: a standard plenoptic camera. Any
    # other makes it a focused plenoptic camera.
    sensor_distance_mm: Length | None = None
    # How the micro lenses are arranged, which says from where on micro images cover a picture.
    layout: Literal["rectangular", "hexagonal"] = "rectangular"

    @property
    def spacing_mm(self) -> float:
        """b_s, from the micro lenses to the sensor."""
        return self.focal_length_mm if self.sensor_distance_mm is None else self.sensor_distance_mm

    @property
    def focal_lengths_mm(self) -> tuple[float, ...]:
        """f_s of each type of micro lens."""
        return self.focal_length_mm, *self.other_focal_lengths_mm

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Kind of plenoptic camera that each type of micro lens makes (Lumsdaine, Georgiev 2009).

        Micro lenses nearer to the sensor than f_s are focused on an image behind the sensor
        (Galilean), others on one between them and the main lens (Keplerian).
        """
        spacing = self.spacing_mm
        return tuple(
            "standard" if f == spacing else "Galilean" if f > spacing else "Keplerian"
            for f in self.focal_lengths_mm
        )

    @property
    def standard(self) -> bool:
        """Whether this is a standard plenoptic camera: all micro lenses are focused at infinity."""
        return set(self.kinds) == {"standard"}

    @model_serializer(mode="wrap")
    def _without_defaults(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The lengths of a standard camera alone, as its file has them."""
        content: dict[str, Any] = handler(self)
        fields = type(self).model_fields
        return {name: v for name, v in content.items() if v != fields[name].default}

    @model_validator(mode="before")
    @classmethod
    def _of_types(cls, values: Any) -> Any:
        if not isinstance(values, dict) or not isinstance(values.get("focal_length_mm"), list):
            return values
        lengths = values["focal_length_mm"]
        if not lengths or "other_focal_lengths_mm" in values:
            raise ValueError("focal_length_mm must be a number, or a list of one or more")
        return {**values, "focal_length_mm": lengths[0], "other_focal_lengths_mm": lengths[1:]}

    @model_validator(mode="after")
    def _where_the_sensor_is(self) -> Self:
        if self.other_focal_lengths_mm and self.sensor_distance_mm is None:
            raise ValueError("several focal lengths need sensor_distance_mm, where the sensor is")
        return self

    @model_validator(mode="before")
    @classmethod
    def _of_f_number(cls, values: Any) -> Any:
        if not isinstance(values, dict) or "f_number" not in values:
            return values
        rest = {name: value for name, value in values.items() if name != "f_number"}
        number, pitch = values["f_number"], values.get("pitch_mm")
        if "focal_length_mm" in rest:
            raise ValueError("give focal_length_mm or f_number, not both")
        if any(isinstance(n, bool) or not isinstance(n, int | float) for n in (number, pitch)):
            raise ValueError("f_number and pitch_mm must be numbers")
        return {**rest, "focal_length_mm": number * pitch}


def _thin_lens(values: dict[str, Any]) -> float:
    """Exit pupil of a thin lens: f_U (inf if that is wrong: its own check reports it)."""
    pupil: float = values.get("focal_length_mm", inf)
    return pupil


class MainLens(Part):
    """Paraxial data of the main lens."""

    focal_length_mm: Length  # f_U
    # H1H2 from the object-side to the image-side principal plane, negative when they are crossed.
    principal_plane_separation_mm: SignedLength = 0.0
    # d_A' from the micro lenses to the exit pupil with the lens focused to infinity: inf if the
    # lens is telecentric on its image side, negative if the pupil lies behind the micro lenses.
    # Left out, the lens is a thin one: its pupil is the lens, f_U from the micro lenses.
    exit_pupil_mm: PupilDistance = Field(default_factory=_thin_lens)
    # V1H1 from the front vertex to the object-side principal plane, if known. Planes nearer than
    # the front vertex lie inside the lens.
    front_vertex_mm: SignedLength | None = None
    # d_A from the micro lenses to the aperture stop with the lens focused to infinity, if known.
    aperture_stop_mm: Length | None = None
    # Diameter of the entrance pupil, if known. Views beyond it are vignetted.
    entrance_pupil_diameter_mm: Length | None = None


class Sensor(Part):
    """Image sensor.

    `pixel_pitch_mm`: p_p. `columns`, `rows`: number of pixels, if known.
    """

    pixel_pitch_mm: Length
    columns: Annotated[int, Field(ge=1)] | None = None
    rows: Annotated[int, Field(ge=1)] | None = None


class Instrument(Part):
    """What cameras and microscopes have in common: micro lenses before a sensor."""

    name: Annotated[str, Field(min_length=1)]
    title: str = ""
    micro_lenses: MicroLensArray
    sensor: Sensor

    @property
    def pixels_per_lens(self) -> float:
        """Pitch of the micro lenses in pixels."""
        return self.micro_lenses.pitch_mm / self.sensor.pixel_pitch_mm

    @property
    def micro_image_size(self) -> int:
        """M: the largest odd number of pixels that a micro image has, 1 or more."""
        return max(1, int((self.pixels_per_lens - 1) // 2 * 2 + 1))

    def micro_image_note(self, micro_image_size: int) -> str:
        """What is wrong with M for this instrument; empty if its micro images have M pixels."""
        pixels, wrong = self.pixels_per_lens, ""
        # Compared with the size that decoding chooses.
        if micro_image_size < self.micro_image_size:
            wrong = "hold only if the picture has their middle pixels, as decode crops them"
        if micro_image_size > pixels + 0.5:
            wrong = "are wrong"
        have = f"the micro images of {self.name} have {pixels:.1f} pixels, not {micro_image_size}"
        return f"{have}; distances {wrong}" if wrong else ""


class Camera(Instrument):
    """A plenoptic camera, standard or focused."""

    main_lens: MainLens

    def thin_lens_note(self) -> str:
        """Say that the exit pupil is assumed; empty where the camera's data have it."""
        if "exit_pupil_mm" in self.main_lens.model_fields_set:
            return ""
        return (
            f"{self.name} has no main_lens.exit_pupil_mm: a thin lens is assumed, whose pupil is "
            "the lens itself"
        )

    def reversed(self) -> "Camera":
        """The camera with its main lens the other way round: the exit is the entrance pupil then.

        Result: by Newton's equation the pupils' distances from the focal points multiply to f_U^2.
        Raises `InputError` if that is no number.
        """
        lens = self.main_lens
        shrunk = lens.exit_pupil_mm / lens.focal_length_mm
        diameter = lens.entrance_pupil_diameter_mm
        try:
            turned = MainLens(
                focal_length_mm=lens.focal_length_mm,
                principal_plane_separation_mm=lens.principal_plane_separation_mm,
                exit_pupil_mm=lens.focal_length_mm / shrunk,
                entrance_pupil_diameter_mm=None if diameter is None else diameter * abs(shrunk),
            )
        except ValidationError:
            raise InputError(
                "its pupils are too far apart; check exit_pupil_mm", where=self.name
            ) from None
        return self.model_copy(update={"name": f"{self.name} reversed", "main_lens": turned})


# Where a camera's data stand in its file, by the names that commands and pages take them under.
FIELDS = {
    "focal_length": ("main_lens", "focal_length_mm"),
    "exit_pupil": ("main_lens", "exit_pupil_mm"),
    "pupil": ("main_lens", "entrance_pupil_diameter_mm"),
    "lens_focal_length": ("micro_lenses", "focal_length_mm"),
    "sensor_distance": ("micro_lenses", "sensor_distance_mm"),
    "lens_pitch": ("micro_lenses", "pitch_mm"),
    "pixel": ("sensor", "pixel_pitch_mm"),
    "columns": ("sensor", "columns"),
    "rows": ("sensor", "rows"),
}


def camera_of(base: Camera | None, changes: Mapping[str, float]) -> Camera:
    """A camera from its lengths, or another camera with some lengths replaced.

    `changes`: names of `FIELDS` and their values in mm (pixels for columns and rows). Raises
    `InputError` if one of them is not possible, or is missing.
    """
    content: dict[str, Any] = {"main_lens": {}, "micro_lenses": {}, "sensor": {}}
    if base is not None:
        content = base.model_dump(exclude_unset=True)
    for name, value in changes.items():
        part, field = FIELDS[name]
        content[part] = {**content[part], field: value}
    if base is None or changes:
        content["name"] = "camera" if base is None else f"{base.name}, changed"
    try:
        return Camera.model_validate(content)
    except ValidationError as error:
        places: dict[object, str] = {place: name for name, place in FIELDS.items()}
        order = [*FIELDS, "camera"]
        name, wrong = min(
            ((places.get(one["loc"], "camera"), one) for one in error.errors()),
            key=lambda pair: order.index(pair[0]),
        )
        message = wrong["msg"].removeprefix("Value error, ").replace("Input should", "it should")
        raise InputError(f"{wrong['input']!r}; {message}", where=name) from None


def camera_names() -> list[str]:
    """Names of the shipped cameras."""
    return sorted(path.stem for path in CAMERAS.glob("*.toml"))


def microscope_names() -> list[str]:
    """Names of the shipped microscopes."""
    return sorted(path.stem for path in MICROSCOPES.glob("*.toml"))


def load_camera(source: str | Path) -> Camera:
    """Load a shipped camera by name, or any camera from a file.

    `source`: name (`camera_names`) or path of a TOML file. Raises `InputError` if there is no such
    camera, or the file is not valid: field, value and what is allowed.
    """
    content, path = description(source, camera_names())
    if "objective" in content:
        raise InputError(
            "is a microscope; of develop, refocus, stack, depth-map, view, batch, distance",
            where=path,
        )
    return checked(Camera, content, path)


def description(source: str | Path, names: list[str]) -> tuple[dict[str, Any], str]:
    """What a shipped description says, or a file, and its path; `names` may be given instead."""
    path = Path(source)
    if str(source) in {*camera_names(), *microscope_names()}:
        shipped = (folder / f"{source}.toml" for folder in (CAMERAS, MICROSCOPES))
        path = next(file for file in shipped if file.is_file())
    if not path.is_file():
        raise InputError(
            f"no such camera; give a TOML file, or one of {', '.join(names)}", where=str(source)
        )
    try:
        return tomllib.loads(input_file(path).read_text(encoding="utf-8")), str(path)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(
            f"cannot be read ({error}); it must be a TOML file of a camera", where=str(path)
        ) from None


Described = TypeVar("Described", bound=Instrument)


def checked(kind: type[Described], content: dict[str, Any], path: str) -> Described:
    """An instrument of a description; raises `InputError` for one that is not valid."""
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise validation_error(error, where=path) from None
