# SPDX-License-Identifier: Apache-2.0
"""The views of a light field as one compressed picture, for a page of its own."""

import io
from typing import NamedTuple

import numpy as np
from PIL import Image as PillowImage

from plenofir.ground.images import Image
from plenofir.view.page import Part

# WebP's largest side.
_WEBP_SIDE = 16383
_QUALITIES = (95, 90, 85, 80, 70, 60, 50, 40, 30)


class Mosaic(NamedTuple):
    """Compressed views."""

    part: Part  # picture of views beside and below each other
    words: str  # how it was compressed


def packed_views(views: Image, limit: int) -> Mosaic | None:
    """Compress views (v, u, t, s[, 3]), uint8, into at most `limit` bytes; None if they don't fit.

    Without loss if that fits, or with the best quality that does.
    """
    m, _, rows, columns = views.shape[:4]
    whole = np.moveaxis(views, (0, 1), (0, 2)).reshape(m * rows, m * columns, *views.shape[4:])
    picture = PillowImage.fromarray(whole)
    small = max(whole.shape[:2]) <= _WEBP_SIDE

    def encoded(kind: str, **options: object) -> bytes:
        file = io.BytesIO()
        picture.save(file, kind, **options)
        return file.getvalue()

    # What is not compressible at all costs no attempt.
    if whole.nbytes < 8 * limit:
        kind = "webp" if small else "png"
        content = encoded("WEBP", lossless=True, method=2) if small else encoded("PNG")
        if len(content) <= limit:
            return Mosaic(Part(content, f"image/{kind}"), "Views without loss.")
    low, high, best = 0, len(_QUALITIES) - 1, None
    kind = "webp" if small else "jpeg"
    while low <= high:
        middle = (low + high) // 2
        quality = _QUALITIES[middle]
        content = encoded(kind.upper(), quality=quality)
        if len(content) <= limit:
            words = f"Views as {kind.upper()}, quality {quality}."
            best = Mosaic(Part(content, f"image/{kind}"), words)
            high = middle - 1
        else:
            low = middle + 1
    return best
