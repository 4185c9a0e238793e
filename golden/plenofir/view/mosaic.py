# SPDX-License-Identifier: Apache-2.0
"""The views of a light field as one compressed picture, for a page of its own."""

import io
from typing import NamedTuple

import numpy as np
from PIL import Image as PillowImage

from plenofir.ground.images import SCREEN_GAMMA, Image
from plenofir.ground.png import png_file
from plenofir.view.page import Part

# WebP's largest side.
_WEBP_SIDE = 16383
_LARGE = 1 << 21
_QUALITIES = (95, 90, 85, 80, 70, 60, 50, 40, 30)


class Mosaic(NamedTuple):
    """Compressed views."""

    part: Part  # picture of views beside and below each other
    words: str  # how it was compressed
    codes: list[int] | None = None  # value of each of 256 codes, where the picture has these


def planes(image: Image) -> Image:
    """The high bytes of 16 bits above the low ones, because browsers decode 8 bits."""
    return np.concatenate([image >> 8, image & 255]).astype(np.uint8)


def packed_views(views: Image, limit: int) -> Mosaic | None:
    """Compress views (v, u, t, s[, 3]) into at most `limit` bytes; None if they don't fit.

    Without loss if that fits; 16 bit otherwise in 256 steps of brightness; then with the best
    quality that fits.
    """
    v, u, rows, columns = views.shape[:4]
    whole = np.moveaxis(views, (0, 1), (0, 2)).reshape(v * rows, u * columns, *views.shape[4:])
    if whole.dtype == np.uint8:
        return _packed(whole, limit, "Views")
    # Low bytes are mostly noise, so at best half of the size remains.
    if whole.nbytes < 2 * limit:
        part = _without_loss(planes(whole), limit)
        if part is not None:
            return Mosaic(part, "Views without loss, 16 bit.")
    levels = _coded(whole)
    mosaic = _packed(levels.codes, limit, "Views in 256 steps of brightness")
    return None if mosaic is None else mosaic._replace(codes=levels.values)


class _Codes(NamedTuple):
    codes: Image  # uint8
    values: list[int]  # of each code


def _coded(image: Image) -> _Codes:
    """256 steps of brightness, equal with a gamma of 2.2, so that dark ones are finer."""
    black, white = int(image.min()), int(image.max())
    wide = max(white - black, 1)
    table = np.arange(white + 1, dtype=np.float64) - black
    steps = np.floor(255 * (np.maximum(table, 0) / wide) ** (1 / SCREEN_GAMMA) + 0.5)
    values = np.rint(black + wide * (np.arange(256) / 255) ** SCREEN_GAMMA)
    return _Codes(steps.astype(np.uint8)[image], [int(value) for value in values])


def _encoded(image: Image, kind: str, **options: object) -> bytes:
    file = io.BytesIO()
    PillowImage.fromarray(image).save(file, kind, **options)
    return file.getvalue()


def _without_loss(image: Image, limit: int) -> Part | None:
    # More effort takes three times as long and saves a third: too long for large pictures.
    small = image.nbytes < _LARGE
    # WebP knows colours only: of large grey pictures PNG takes a tenth of the time, and no more
    # bytes.
    if max(image.shape[:2]) > _WEBP_SIDE or (image.ndim == 2 and not small):
        kind, content = "png", png_file(image, b"")
    else:
        effort = {"method": int(small), "quality": 0}
        kind, content = "webp", _encoded(image, "WEBP", lossless=True, **effort)
    return Part(content, f"image/{kind}") if len(content) <= limit else None


def _packed(whole: Image, limit: int, words: str) -> Mosaic | None:
    """A picture of 8 bit, without loss or with the best quality that fits."""
    # No attempt without loss if the data are not compressible.
    if whole.nbytes < 8 * limit:
        part = _without_loss(whole, limit)
        if part is not None:
            return Mosaic(part, f"{words} without loss.")
    low, high, best = 0, len(_QUALITIES) - 1, None
    kind = "webp" if max(whole.shape[:2]) <= _WEBP_SIDE else "jpeg"
    while low <= high:
        middle = (low + high) // 2
        quality = _QUALITIES[middle]
        content = _encoded(whole, kind.upper(), quality=quality)
        if len(content) <= limit:
            how = f"{words} as {kind.upper()}, quality {quality}."
            best = Mosaic(Part(content, f"image/{kind}"), how)
            high = middle - 1
        else:
            low = middle + 1
    return best
