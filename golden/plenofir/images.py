"""Reading and writing images without losing depth."""

import os
from pathlib import Path

os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")

import cv2
import imageio.v3 as iio
import numpy as np

from plenofir.errors import InputError
from plenofir.refocus.operator import Image

_EXPECTED = "an 8 or 16 bit grey or RGB image file (PNG, TIFF, PGM/PPM, BMP or JPEG)"


def read_image(path: Path) -> Image:
    """Read an image as it is stored."""
    # The OpenCV reader is used because it keeps 16 bit RGB, which Pillow cuts to 8 bit.
    if not path.is_file():
        raise InputError("no such file", where=str(path), expected=_EXPECTED)
    if not os.access(path, os.R_OK):
        raise InputError("file cannot be read", where=str(path), expected="read permission")
    try:
        image = iio.imread(path, plugin="opencv", flags=cv2.IMREAD_UNCHANGED)
    except (OSError, ValueError, cv2.error):
        raise InputError("no image that can be read", where=str(path), expected=_EXPECTED) from None
    if image.dtype not in (np.uint8, np.uint16):
        raise InputError(f"pixels of type {image.dtype}", where=str(path), expected=_EXPECTED)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[:, :, 0]
    if image.ndim == 3 and image.shape[2] != 3:
        raise InputError(f"{image.shape[2]} channels", where=str(path), expected=_EXPECTED)
    if image.ndim != 2 and image.ndim != 3:
        raise InputError(f"{image.ndim} dimensions", where=str(path), expected=_EXPECTED)
    return np.asarray(image)


def write_png(path: Path, image: Image) -> None:
    """Write a PNG with the depth and channels of the array."""
    iio.imwrite(path, image, plugin="opencv", extension=".png")
