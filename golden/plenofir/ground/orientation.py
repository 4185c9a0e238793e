# SPDX-License-Identifier: Apache-2.0
"""Orientation of pictures as EXIF counts it: 1 is as stored, 2 to 8 are mirrored or turned."""

import struct
import warnings
from typing import Any

import numpy.typing as npt

TAG_ORIENTATION = 274
"""Number of the tag in EXIF and TIFF."""


def turned(pixels: npt.NDArray[Any], orientation: int) -> npt.NDArray[Any]:
    """Pixels (rows, columns, ...) turned as an orientation says, a view of them."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def exif_orientation(exif: bytes) -> int:
    """Orientation in EXIF metadata; 1, as stored, if they do not tell or are damaged."""
    from PIL.Image import Exif

    content = Exif()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content.load(exif)
            return int(content.get(TAG_ORIENTATION, 1))
    except (SyntaxError, ValueError, TypeError, OSError, struct.error):
        # What Pillow raises at damaged metadata, which are no reason to refuse a picture.
        return 1


def page_orientation(page: Any) -> int:
    """Orientation of a page of a TIFF file (tifffile's), as EXIF counts."""
    return int(page.tags[TAG_ORIENTATION].value) if TAG_ORIENTATION in page.tags else 1
