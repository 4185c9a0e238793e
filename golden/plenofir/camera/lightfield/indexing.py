# SPDX-License-Identifier: Apache-2.0
"""Raw image and 4-D light field are the same samples (Eqs. 3.46-3.49), seen without copying.

A light field has the axes (t, s, v, u[, channels]): row and column of the micro lens, row and
column of the pixel in its micro image. Pixel k of a raw line is pixel u = k mod M of micro image
s = floor(k / M); the thesis counts u from the micro image's centre, i = u - c with c = (M - 1) / 2.
"""

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus import check_raw
from plenofir.refocus.operator import Image


def light_field(raw: Image, micro_image_size: int) -> Image:
    """Light field of a raw image, as a view of the same memory.

    `raw`: raw image, shape (rows, columns[, 3]); incomplete micro images at the right and at the
    bottom are left out. Result: shape (t, s, v, u[, 3]). Raises `InputError` if the image is not a
    raw image of that M.
    """
    m = micro_image_size
    check_raw(raw, m)
    rows, columns = raw.shape[0] // m, raw.shape[1] // m
    blocks = raw[: rows * m, : columns * m].reshape(rows, m, columns, m, *raw.shape[2:])
    return np.moveaxis(blocks, 2, 1)


def raw_image(field: Image) -> Image:
    """Raw image of a light field; a view where the light field is one of a raw image.

    `field`: shape (t, s, v, u[, 3]) with as many pixel rows as columns in a micro image. Result:
    shape (t M, s M[, 3]). Raises `InputError` if the micro images are not square.
    """
    if field.ndim not in (4, 5) or field.shape[2] != field.shape[3]:
        raise InputError(
            f"a light field has shape (t, s, M, M) or (t, s, M, M, 3), not {field.shape}"
        )
    t, s, m = field.shape[:3]
    return np.moveaxis(field, 1, 2).reshape(t * m, s * m, *field.shape[4:])


def sub_aperture(raw: Image, micro_image_size: int, v: int, u: int) -> Image:
    """Sub-aperture image: pixel (v, u) of all micro images (Eq. 3.45), as a view.

    `v`, `u`: pixel of the micro images, 0 to M - 1. Result: shape (t, s[, 3]). Raises `InputError`
    if there is no such view.
    """
    m = micro_image_size
    if not (0 <= v < m and 0 <= u < m):
        raise InputError(f"there is no view ({v}, {u}); views are numbered from 0 to {m - 1}")
    return light_field(raw, m)[:, :, v, u]


def views(raw: Image, micro_image_size: int) -> Image:
    """All sub-aperture images, as a view.

    Result: shape (v, u, t, s[, 3]).
    """
    return np.moveaxis(light_field(raw, micro_image_size), (2, 3), (0, 1))


def compose(images: Image) -> Image:
    """Raw image from its sub-aperture images: the inverse of `views`.

    `images`: shape (v, u, t, s[, 3]) with as many rows of views as columns. Result: shape (t M, s
    M[, 3]). Raises `InputError` if the views are not a square of views.
    """
    return raw_image(np.moveaxis(images, (0, 1), (2, 3)))


def central(images: Image, count: int) -> Image:
    """Keep the central views, `count` along each side of (v, u, t, s[, 3]), without a copy."""
    there = min(images.shape[:2])
    if not 1 <= count <= there:
        raise InputError(
            f"{count} views cannot be taken of {there}; use 1 to {there}", where="views"
        )
    first, across = ((n - count) // 2 for n in images.shape[:2])
    return images[first : first + count, across : across + count]
