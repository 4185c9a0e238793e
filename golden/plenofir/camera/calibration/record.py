"""What a calibration holds, and its file."""

import json
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from plenofir.camera.calibration.fit import shading_at, within
from plenofir.camera.calibration.grid import Flags, Floats, Grid
from plenofir.errors import InputError
from plenofir.files import write_file

PROFILE_REACH = 0.6
"""Half width of the stored profile of a micro image in pitches."""

Count = Annotated[int, Field(ge=1)]
Index = Annotated[int, Field(ge=0)]


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
        (`plenofir.camera.calibration.fit.shading_at`); 0 at the brightest lens.
    profile
        Brightness across a micro image relative to its middle: rows and columns from
        -`PROFILE_REACH` to `PROFILE_REACH` pitches.
    residual_px
        Scatter of single centroids around the grid, robust standard deviation in pixels.
    used
        Number of micro images that the grid was fitted to.
    clipped_share
        Share of the white image's pixels at full scale.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["plenofir-calibration-1"] = "plenofir-calibration-1"
    image_shape: tuple[Count, Count]
    lenses: tuple[Count, Count]
    grid: Grid
    missing: tuple[tuple[Index, Index], ...] = ()
    uneven: tuple[tuple[Index, Index, float], ...] = ()
    dark_level: float = 0.0
    shading: tuple[float, ...]
    profile: tuple[tuple[float, ...], ...]
    residual_px: float
    used: Count
    clipped_share: float = 0.0

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
        """Write the file.

        Parameters
        ----------
        path
            JSON file to write.
        """
        content = self.model_dump()
        # A line for each field keeps the file readable and small.
        lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
        write_file(path, "{\n" + ",\n".join(lines) + "\n}\n")


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration file.

    Parameters
    ----------
    path
        What `Calibration.save` wrote.

    Returns
    -------
    Calibration
        The calibration; `Calibration.centres` are the micro image centres.

    Raises
    ------
    InputError
        If there is no such file, or it is not a calibration.
    """
    expected = "a file written by plenofir calibrate"
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValueError) as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "cannot be read"
        raise InputError(reason, where=str(path), expected=expected) from None
    try:
        return Calibration.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "content"
        raise InputError(
            f"{field}: {first['msg'].lower()}", where=str(path), expected=expected
        ) from None
