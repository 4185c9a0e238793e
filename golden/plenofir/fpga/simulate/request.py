# SPDX-License-Identifier: Apache-2.0
"""Request of a simulation: a raw image, a core, and the chain of VHDL around it."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from plenofir.fpga.core.configuration import MAX_ROWS, CoreConfiguration
from plenofir.fpga.names import (
    DEFAULT_BOARD,
    DEFAULT_SIMULATOR,
    MAX_SEED,
    BoardName,
    Chain,
    WaveChoice,
)
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.first_light import FLOWER, FLOWER_MICRO_IMAGE_SIZE
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, read_image, read_picture
from plenofir.refocus import check_raw, shift_to_name
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import MAX_SHARPNESS_RADIUS

DEFAULT_RAW = project.DATA / "flower_detail_5x5.png"
"""Part of it, which is refocused when the user names no image."""

Progress = Callable[[str, int, int], None]
"""Called with the step's name, what is done and what there is to do."""


class Run(BaseModel):
    """Request of a simulation."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    raw: Path = DEFAULT_RAW
    # See `core_for_image`; all its slices are simulated, one frame each, or at once in a stack.
    core: CoreConfiguration
    # Radius of a stack's depth index, see `plenofir.refocus.sharpness.local_sharpness`.
    radius: Annotated[int, Field(ge=0, le=MAX_SHARPNESS_RADIUS)] = 1
    out: Path  # folder for the results
    simulator: str = DEFAULT_SIMULATOR
    waves: WaveChoice = "0"
    waves_depth: Annotated[int, Field(ge=0)] = 0  # of "all" signals, see `Waves`
    # Seed of the stalls with which a part of the picture is simulated once more; 0: it is not.
    stalls: Annotated[int, Field(ge=0, le=MAX_SEED)] = 0
    # "core" alone; "hdmi": the whole board from serial TMDS bits to serial TMDS bits; "csi": from
    # the bytes of a D-PHY's lanes to the core's pixels.
    chain: Chain = "core"
    board: BoardName = DEFAULT_BOARD  # of the chain "hdmi"
    # Outputs that the board shows besides the slices, with and without text; for the core of a
    # stack only the depth index is used, instead of `radius`.
    screen: Screen = Screen()


def picture_names(shift: int, micro_image_size: int, slices: int) -> tuple[str, ...]:
    """File names of a slice's refocused, golden and difference picture.

    With several slices the names contain a; a fraction's slash becomes an underscore.
    """
    suffix = f"_{shift_to_name(shift, micro_image_size)}" if slices > 1 else ""
    return f"refocused{suffix}.png", f"golden{suffix}.png", f"diff{suffix}.png"


def core_for_image(path: Path, chain: Chain = "core", **fields: Any) -> CoreConfiguration:
    """Core that fits an image file: line length, channels (three for HDMI) and bits.

    `fields` are the other fields of the core.
    """
    raw = read_image(path)
    return CoreConfiguration(
        max_columns=raw.shape[1],
        channels=1 if raw.ndim == 2 and chain != "hdmi" else 3,
        pixel_bits=8 * raw.dtype.itemsize,
        **fields,
    )


def scene_image(core: CoreConfiguration, rows: int) -> Image:
    """Raw image for a scene without one: the flower, its micro images resampled to M x M.

    As large as the flower and `rows` allow, whole micro images.
    """
    flower = read_image(FLOWER)
    have, want = FLOWER_MICRO_IMAGE_SIZE, core.micro_image_size
    views = np.round(np.linspace(0, have - 1, want)).astype(int)

    def places(length: int, limit: int) -> npt.NDArray[np.intp]:
        lenses = min(length // have, max(limit // want, 1))
        columns: npt.NDArray[np.intp] = (np.arange(lenses)[:, None] * have + views).ravel()
        return columns[:limit]

    image = flower[np.ix_(places(flower.shape[0], rows), places(flower.shape[1], core.max_columns))]
    if core.channels == 1:
        image = image[..., 1]
    if core.pixel_bits > 8:
        return np.left_shift(image.astype(np.uint16), core.pixel_bits - 8)
    return np.right_shift(image, 8 - core.pixel_bits)


def read_raw(request: Run) -> Picture:
    """The raw image; InputError if the core cannot take it."""
    core, where = request.core, str(request.raw)
    shifts = request.screen.shifts(core)
    if len(set(shifts)) < len(shifts):
        raise InputError("a slice is given twice; give each once", where="shifts")
    picture = read_picture(request.raw)
    raw = picture.pixels
    check_raw(raw, core.micro_image_size, where=where)
    core.check_limits()
    if request.chain == "hdmi" and raw.ndim == 2:
        raw = np.repeat(raw[:, :, np.newaxis], 3, axis=2)
    (rows, columns), channels = raw.shape[:2], 1 if raw.ndim == 2 else 3
    largest = int(raw.max())
    if columns > core.max_columns or channels != core.channels or largest >> core.pixel_bits:
        raise InputError(
            f"has {columns} columns, {channels} channels and values up to {largest}; the "
            f"core takes at most {core.max_columns} columns, {core.channels} channels of "
            f"{core.pixel_bits} bit",
            where=where,
        )
    if rows > MAX_ROWS:
        raise InputError(f"has {rows} rows; the core takes at most {MAX_ROWS}", where=where)
    return picture.like(raw)
