# SPDX-License-Identifier: Apache-2.0
"""From packed pixels of a colour filter mosaic to RGB in linear light."""

from typing import Literal

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.lytro.metadata import CHANNELS, Corner, FrameMetadata
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Colour = Literal["camera", "balanced", "srgb", "best"]
Demosaic = Literal["edge-aware", "bilinear"]
Mosaic = npt.NDArray[np.uint16]

FULL_SCALE = 65535
# Colours of the first two lines of pixels by the one at the top left.
_TILES: dict[Corner, tuple[Corner, Corner, Corner, Corner]] = {
    "r": ("r", "gr", "gb", "b"),
    "gr": ("gr", "r", "b", "gb"),
    "gb": ("gb", "b", "r", "gr"),
    "b": ("b", "gb", "gr", "r"),
}
_PATTERNS: dict[Corner, str] = {"r": "RGGB", "gr": "GRBG", "gb": "GBRG", "b": "BGGR"}
# Floats of a whole Illum frame take 166 MB for each step; blocks of rows bound that.
_BLOCK_ROWS = 256


def packed_size(metadata: FrameMetadata) -> int:
    """Bytes of a frame."""
    return metadata.width * metadata.height * metadata.packing.bitsPerPixel // 8


def unpack(data: bytes, metadata: FrameMetadata, where: str) -> Mosaic:
    """Pixels of a packed frame.

    `data`: 12 bit: two pixels in three bytes, high bits first. 10 bit: the high eight bits of four
    pixels, then a byte with their low two bits, first pixel lowest. Result: shape (rows, columns).
    Raises `InputError` if there are more or fewer bytes than the metadata say.
    """
    expected = packed_size(metadata)
    if len(data) != expected:
        size = f"{metadata.width} x {metadata.height} pixels of {metadata.packing.bitsPerPixel} bit"
        raise InputError(
            f"has {len(data)} bytes of pixels; {size}, as the metadata say, take {expected}",
            where=where,
        )
    packed = np.frombuffer(data, np.uint8).reshape(metadata.height, -1)
    result = np.empty((metadata.height, metadata.width), np.uint16)
    for start in range(0, metadata.height, _BLOCK_ROWS):
        rows = slice(start, start + _BLOCK_ROWS)
        part = packed[rows].astype(np.uint16)
        if metadata.packing.bitsPerPixel == 12:
            first, middle, last = (part[:, k::3] for k in range(3))
            result[rows, 0::2] = (first << 4) | (middle >> 4)
            result[rows, 1::2] = ((middle & 15) << 8) | last
        else:
            low = part[:, 4::5]
            for k in range(4):
                result[rows, k::4] = (part[:, k::5] << 2) | ((low >> 2 * k) & 3)
    return result


def balanced(mosaic: Mosaic, metadata: FrameMetadata, *, white_balance: bool = True) -> Mosaic:
    """Mosaic in linear light, 0 to 65535, black subtracted and white balance applied.

    The colour that is amplified least keeps its full scale, so white clips to white.
    """
    gains = [
        metadata.gains.of(channel) if metadata.gains is not None and white_balance else 1.0
        for channel in CHANNELS
    ]
    factors = dict(zip(CHANNELS, (gain / min(gains) for gain in gains), strict=True))
    result = np.empty_like(mosaic)
    for place, channel in enumerate(_TILES[metadata.mosaic.upperLeftPixel]):
        part = np.s_[place // 2 :: 2, place % 2 :: 2]
        black, white = metadata.black.of(channel), metadata.white.of(channel)
        factor = FULL_SCALE * factors[channel] / (white - black)
        # A table: there are 4096 levels at most.
        levels = np.arange(1 << metadata.packing.bitsPerPixel, dtype=np.float64)
        table = np.clip(np.rint((levels - black) * factor), 0, FULL_SCALE).astype(np.uint16)
        result[part] = table[mosaic[part]]
    return result


def grey_mosaic(mosaic: Mosaic) -> Image32:
    """Mosaic whose four colours are made equally bright: a grey picture of all pixels."""
    result = mosaic.astype(np.float32)
    parts = [np.s_[down::2, right::2] for down in (0, 1) for right in (0, 1)]
    means = [float(result[part].mean()) for part in parts]
    for part, mean in zip(parts, means, strict=True):
        result[part] *= max(means) / max(mean, 1.0)
    return result


def develop(
    mosaic: Mosaic,
    metadata: FrameMetadata,
    *,
    colour: Colour = "balanced",
    demosaic: Demosaic = "edge-aware",
) -> Image:
    """RGB picture of a mosaic.

    `mosaic`: of `unpack`. `colour`: "camera": colours of the sensor. "balanced": with the white
    balance of the file. "srgb": with its colour matrix too; "best": if it has one. `demosaic`: how
    missing colours are interpolated, both by OpenCV: along edges, or bilinear. Result: shape
    (rows, columns, 3), uint16, 0 to 65535, in linear light. Raises `InputError` if OpenCV is
    missing, or the file has no colour matrix for "srgb".
    """
    if colour == "best":
        colour = "balanced" if metadata.matrix is None else "srgb"
    if colour == "srgb" and metadata.matrix is None:
        raise InputError(
            "this camera's colour matrix is not known, so there is no srgb; use camera or balanced",
            where="colour",
        )
    try:
        import cv2
    except ImportError:
        raise InputError("OpenCV is not installed; pip install opencv-python-headless") from None
    pattern = _PATTERNS[metadata.mosaic.upperLeftPixel]
    suffix = "_EA" if demosaic == "edge-aware" else ""
    code = getattr(cv2, f"COLOR_Bayer{pattern}2RGB{suffix}")
    linear = balanced(mosaic, metadata, white_balance=colour != "camera")
    image: Image = np.asarray(cv2.demosaicing(linear, code))
    if colour != "srgb":
        return image
    matrix = np.array(metadata.matrix, dtype=np.float32).reshape(3, 3)
    for start in range(0, len(image), _BLOCK_ROWS):
        part = image[start : start + _BLOCK_ROWS]
        mixed = np.clip(part.astype(np.float32) @ matrix.T, 0, FULL_SCALE)
        image[start : start + _BLOCK_ROWS] = np.rint(mixed)
    return image


def with_gamma(image: Image, gamma: float, full_scale: int) -> Image:
    """Encode linear light: level v of full scale becomes v^(1 / gamma)."""
    if gamma == 1:
        return image
    curve = (np.arange(full_scale + 1) / full_scale) ** (1 / gamma) * full_scale
    return np.asarray(np.rint(curve).astype(image.dtype)[np.minimum(image, full_scale)])
