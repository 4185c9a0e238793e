# SPDX-License-Identifier: Apache-2.0
"""What a calibration holds, and its file."""

import json
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from plenofir.camera.calibration.evidence import Evidence
from plenofir.camera.calibration.grid import Flags, Floats, Grid, exponents
from plenofir.camera.calibration.shading import shading_at, within
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file, write_file

PROFILE_REACH = 0.6
"""Half width of the stored profile of a micro image in pitches."""

_LARGEST = 1 << 16
_LARGEST_FILE = 64 << 20
_OUTSIDE = 4
_SHADING_ORDERS = 5
_LARGEST_SHADING = 1e6
_MOST_LENSES = 1 << 22

Count = Annotated[int, Field(ge=1, le=_LARGEST)]
Index = Annotated[int, Field(ge=0, lt=_LARGEST)]
Number = Annotated[float, Field(allow_inf_nan=False)]
# About 1 at the most; products of it must not overflow.
Brightness = Annotated[Number, Field(ge=-1000, le=1000)]
Share = Annotated[float, Field(gt=0, le=1)]


class Calibration(BaseModel):
    """Calibration of a camera from its white image: a small JSON file.

    Attributes
    ----------
    format
        Version of the file's format.
    image_shape
        Rows and columns of the raw image in pixels.
    lenses
        Rows and columns of the grid: all lenses whose centres lie in the image are in it.
    grid
        Where the micro image centres are.
    missing
        (row, column) of lenses in the image that are not lit.
    uneven
        (row, column, brightness) of lenses that are darker or brighter than those around them by
        more than 2 %, and more than is usual; brightness as a share of theirs.
    dark_level
        Grey level without light: median of the dark frame, 0 without one.
    shading
        Logarithm of the lenses' brightness, coefficients of a polynomial
        (`plenofir.camera.calibration.shading.shading_at`); 0 at the brightest lens.
    profile
        Brightness across a micro image relative to its middle: rows and columns from
        -`PROFILE_REACH` to `PROFILE_REACH` pitches.
    residual_px
        Scatter of single centroids around the grid, robust standard deviation in pixels.
    used
        Number of micro images that the grid was fitted to.
    clipped_share
        Share of the white image's pixels at full scale.
    evidence
        What speaks for the grid; None if it did not come from a white image.
    colours
        What the sensor sees of white: red, green and blue, the largest of them 1; None if the white
        image is grey.
    orientation
        How the white image is to be turned to be looked at, as EXIF counts; None as it lies. The
        grid is that of its pixels as they are stored.
    lens_types
        Types of the micro lenses of a focused camera; None for a standard camera.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["plenofir-calibration-1"] = "plenofir-calibration-1"
    image_shape: tuple[Count, Count]
    lenses: tuple[Count, Count]
    grid: Grid
    missing: tuple[tuple[Index, Index], ...] = ()
    uneven: tuple[tuple[Index, Index, Brightness], ...] = ()
    dark_level: Annotated[Number, Field(ge=0, le=65535)] = 0.0
    shading: tuple[Number, ...]
    profile: tuple[tuple[Brightness, ...], ...]
    residual_px: Annotated[Number, Field(ge=0)]
    used: Annotated[int, Field(ge=1)]
    clipped_share: Annotated[Number, Field(ge=0, le=1)] = 0.0
    evidence: Evidence | None = None
    colours: tuple[Share, Share, Share] | None = None
    orientation: Annotated[int, Field(ge=2, le=8)] | None = None
    lens_types: LensTypes | None = None

    @model_validator(mode="after")
    def _fits_together(self) -> "Calibration":
        rows, columns = self.lenses
        # A rotated grid has more rows than fit the image's height.
        if max(self.lenses) > sum(self.image_shape) + _OUTSIDE:
            raise ValueError(f"{columns} x {rows} lenses are more than the image has pixels")
        places = [place[:2] for place in (*self.missing, *self.uneven)]
        if any(t >= rows or s >= columns for t, s in places):
            raise ValueError(f"a missing or uneven lens outside the {columns} x {rows} lenses")
        if len(self.shading) not in {len(exponents(order)) for order in range(_SHADING_ORDERS)}:
            raise ValueError(f"{len(self.shading)} shading coefficients, 1, 3, 6, 10 or 15 needed")
        width = len(self.profile[0]) if self.profile else 0
        if width < 2 or len(self.profile) < 2 or any(len(line) != width for line in self.profile):
            raise ValueError("profile: 2 or more lines of 2 or more values, all of one length")
        if rows * columns > _MOST_LENSES:
            raise ValueError(f"{columns} x {rows} lenses are too many")
        # No cached property: copies would not compare equal.
        centres = self.grid.centres(*np.indices(self.lenses))
        if max(map(abs, self.shading)) > _LARGEST_SHADING:
            raise ValueError("shading: too large")
        if not within(centres, self.image_shape).any():
            raise ValueError("no lens in the image")
        usual = (1, 2) if self.grid.layout == "rectangular" else (1, 3)
        if self.lens_types is not None and len(self.lens_types.pattern) not in usual:
            raise ValueError(f"lens_types: {usual[0]} or {usual[1]} types in this layout")
        return self

    @cached_property
    def model_centres(self) -> Floats:
        """Micro image centres of all lenses of the grid, in the image or not.

        Shape (rows, columns, 2) of (y, x) in pixels, pixel centres at integers.
        """
        t, s = np.indices(self.lenses)
        return self.grid.centres(t, s)

    @cached_property
    def inside(self) -> Flags:
        """Whether a lens's centre lies in the image, shape (rows, columns)."""
        return within(self.model_centres, self.image_shape)

    @cached_property
    def centres(self) -> Floats:
        """Micro image centres, nan where there is no lens in the image.

        Shape (rows, columns, 2) of (y, x) in pixels, pixel centres at integers.
        """
        centres = np.where(self.inside[..., np.newaxis], self.model_centres, np.nan)
        for t, s in self.missing:
            centres[t, s] = np.nan
        return centres

    @cached_property
    def lens_brightness(self) -> Floats:
        """Brightness of each lens relative to the brightest, shape (rows, columns)."""
        level = shading_at(np.array(self.shading), self.model_centres, self.image_shape)
        for t, s, share in self.uneven:
            level[t, s] *= share
        return level

    def save(self, path: Path) -> None:
        """Write the file."""
        write_file(path, self.text())

    def text(self) -> str:
        """What `save` writes."""
        rare = {"orientation", "lens_types"}
        content = self.model_dump(exclude={name for name in rare if getattr(self, name) is None})
        # One line for each field keeps the file readable and small.
        lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
        return "{\n" + ",\n".join(lines) + "\n}\n"


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration file.

    `path`: what `Calibration.save` wrote. Result: the calibration; `Calibration.centres` are the
    micro image centres. Raises `InputError` if there is no such file, or it is not a calibration.
    """
    advice = "give a file that plenofir calibrate wrote"
    try:
        if Path(path).is_char_device():  # a device may have no end
            raise OSError
        size = Path(path).stat().st_size
        content = (
            None if size > _LARGEST_FILE else json.loads(input_file(Path(path)).read_text("utf-8"))
        )
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "cannot be read"
        raise InputError(f"{reason}; {advice}", where=str(path)) from None
    if size > _LARGEST_FILE:
        raise InputError(f"is too large ({size >> 20} MiB); {advice}", where=str(path))
    try:
        return Calibration.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "content"
        raise InputError(
            f"{field}: {first['msg'].removeprefix('Value error, ').lower()}; {advice}",
            where=str(path),
        ) from None
