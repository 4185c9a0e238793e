# SPDX-License-Identifier: Apache-2.0
"""The light field of a scene that is stored on the chip, to show refocusing without a source."""

from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from plenofir.fpga.screen.chip_light_field import StoredLightField, move_focus, store
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import eight_bits, read_picture
from plenofir.refocus import check_raw

Place = Annotated[int, Field(ge=0)]
Extent = Annotated[int, Field(ge=1)]


class SceneStored(BaseModel):
    """A part of a raw image, counted in micro images."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    # Aligned raw image of the scene's M: a file (relative to the scene file) or a shipped one.
    raw: Annotated[str, Field(min_length=1)]
    top: Place = 0  # first micro image of the part
    left: Place = 0
    rows: Extent | None = None  # number of micro images, as `columns`; None for all
    columns: Extent | None = None
    # A plane that is sharp at a in the raw image is sharp at a + move_focus on the chip: its views
    # are moved by whole micro images.
    move_focus: Annotated[int, Field(ge=-8, le=8)] = 0


def _margin(part: SceneStored, m: int) -> int:
    """Micro images at each border whose views come from the opposite side."""
    return abs(part.move_focus) * (m // 2)


def _moved(part: SceneStored, m: int, scene: Path) -> tuple[npt.NDArray[np.uint8], str]:
    """Raw image of the part with the planes moved, in colour, and the name of the file."""
    beside, shipped = scene.parent / part.raw, project.DATA / part.raw
    file = shipped if shipped.is_file() and not beside.is_file() else beside
    picture = read_picture(file)
    check_raw(picture.pixels, m, where=str(file))
    pixels = eight_bits(picture.pixels, picture.full_scale)
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    rows, columns = (extent // m * m for extent in pixels.shape[:2])
    return move_focus(np.ascontiguousarray(pixels[:rows, :columns]), m, part.move_focus), file.name


def stored_raw(part: SceneStored, micro_image_size: int, scene: Path) -> npt.NDArray[np.uint8]:
    """The whole light field of which a scene file stores a part, with its focus moved."""
    pixels, margin = _moved(part, micro_image_size, scene)[0], _margin(part, micro_image_size)
    edge = margin * micro_image_size
    return pixels[edge : pixels.shape[0] - edge, edge : pixels.shape[1] - edge]


def load_stored(part: SceneStored, micro_image_size: int, scene: Path) -> StoredLightField:
    """Read the raw image of a scene file and compress the stored part.

    InputError if there is no such image, or the part reaches beyond it.
    """
    m, where = micro_image_size, f"{scene}: stored"
    moved, name = _moved(part, m, scene)
    margin, lenses = _margin(part, m), [extent // m for extent in moved.shape[:2]]
    first = (part.top, part.left)
    count = [
        lenses[d] - first[d] - margin if asked is None else asked
        for d, asked in enumerate((part.rows, part.columns))
    ]
    for axis, begin, number, there in zip(("rows", "columns"), first, count, lenses, strict=True):
        if number < 1 or begin < margin or begin + number + margin > there:
            beyond = f", as move_focus = {part.move_focus} takes {margin} beyond it"
            raise InputError(
                f"{axis} {begin} to {begin + number - 1} of the {there} of {name}; use a part "
                f"within {margin} to {there - 1 - margin}{beyond if margin else ''}",
                where=where,
            )
    top, left = (m * begin for begin in first)
    return store(moved[top : top + m * count[0], left : left + m * count[1]], m)
