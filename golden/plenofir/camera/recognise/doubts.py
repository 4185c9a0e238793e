# SPDX-License-Identifier: Apache-2.0
"""Whether a picture is an aligned raw image of a given M, as far as its pixels show.

Joints between micro images are searched in the whole picture, lenses in its middle; that takes
tenths of a second. Only if lenses have another period, the middle is recognised as `plenofir
inspect` does it, so that both give the same answer.
"""

from typing import NamedTuple

from plenofir.camera.calibration.frames import grey
from plenofir.camera.patterns.lenslets import find_lenslets
from plenofir.camera.patterns.rasters import COHERENT, Raster, coherence, find_raster
from plenofir.camera.recognise.picture import is_flat, middle, recognise_picture
from plenofir.ground.images import Image, Picture

_LARGEST_SIDE = 4096
# Least number of lenses along each side for a verdict.
_FEWEST = 8


class Doubt(NamedTuple):
    """Why a picture is no aligned raw image of M."""

    text: str  # what it is, and what to do
    certain: bool


def joints(image: Image, *, is_jpeg: bool) -> Raster | None:
    """Micro images by the joints between them, in the first 4096 rows and columns."""
    return find_raster(grey(image[:_LARGEST_SIDE, :_LARGEST_SIDE]), is_jpeg=is_jpeg)


def doubt(
    picture: Picture, micro_image_size: int, name: str, raster: Raster | None, *, is_jpeg: bool
) -> Doubt | None:
    """What speaks against a picture's being an aligned raw image of M; None if nothing does.

    `raster`: its `joints`.
    """
    m, shape = micro_image_size, picture.pixels.shape[:2]
    # Few lenses are no evidence: a picture this small is taken as it is given.
    if m < 2 or min(shape) < _FEWEST * m:
        return None
    whole = picture.pixels[:_LARGEST_SIDE, :_LARGEST_SIDE]
    if raster is not None:
        size = raster.micro_image_size
        if size == m or is_flat(whole, size):
            return None
        text = f"its micro images have {size} x {size} pixels, not {m}; give -M {size}"
        # A multiple or a part of M has joints at the same places, so that is no contradiction.
        return Doubt(text, certain=size % m != 0 and m % size != 0)
    levels = grey(whole)
    inner = middle(levels.shape)
    lenses = find_lenslets(levels[inner])
    if lenses is None or coherence(levels, m) > COHERENT:
        return None
    kind = recognise_picture(picture.like(whole[inner]), name, is_jpeg=is_jpeg)
    if kind.kind not in ("raw capture", "white image", "raw capture of a focused (2.0) camera"):
        return None
    text = (
        f"a capture that is not decoded, its micro images are {lenses.pitch:.2f} pixels apart; "
        "plenofir decode makes an aligned raw image of it"
    )
    return Doubt(text, certain=kind.kind != "raw capture of a focused (2.0) camera")
