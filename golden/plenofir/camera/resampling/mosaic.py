# SPDX-License-Identifier: Apache-2.0
"""Bit-true model of the chip's interpolation of a colour filter mosaic (Bayer).

Bilinear in 3 x 3 pixels: a colour that a pixel's filter does not let through is the mean of the
neighbours that have it, two or four, halves up. At the borders pixels are mirrored at the first and
the last one, which keeps the order of the filters.
"""

from typing import Literal, get_args

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

BayerOrder = Literal["rggb", "grbg", "gbrg", "bggr"]
BAYER_ORDERS: tuple[BayerOrder, ...] = get_args(BayerOrder)


def red_place(order: BayerOrder) -> tuple[int, int]:
    """Row and column, 0 or 1, of the red pixel in the order's 2 x 2 pixels."""
    return divmod(order.index("r"), 2)


def interpolate_mosaic(raw: Image, order: BayerOrder, *, where: str = "raw capture") -> Image:
    """Three channels from a colour filter mosaic.

    `raw`: raw frame, shape (rows, columns), uint8 or uint16. `order`: filters of the top left 2 x 2
    pixels, line by line. Result: shape (rows, columns, 3), red, green, blue. Raises `InputError` if
    the frame is not a mosaic of at least 2 x 2 pixels, or there is no such order.
    """
    if order not in BAYER_ORDERS:
        raise InputError(f"there is no mosaic {order!r}; use rggb, grbg, gbrg or bggr")
    if raw.ndim != 2 or min(raw.shape) < 2:
        raise InputError(
            f"a mosaic has one channel and at least 2 x 2 pixels, not shape {raw.shape}",
            where=where,
        )
    rows, columns = raw.shape
    p = np.pad(raw, 1, mode="reflect").astype(np.int64)

    def near(y: int, x: int) -> np.ndarray:
        return p[1 + y : 1 + y + rows, 1 + x : 1 + x + columns]

    across = (near(0, -1) + near(0, 1) + 1) >> 1
    along = (near(-1, 0) + near(1, 0) + 1) >> 1
    cross = (near(0, -1) + near(0, 1) + near(-1, 0) + near(1, 0) + 2) >> 2
    corners = (near(-1, -1) + near(-1, 1) + near(1, -1) + near(1, 1) + 2) >> 2
    here = near(0, 0)
    y, x = red_place(order)
    red_row = (np.arange(rows) % 2 == y)[:, np.newaxis]
    red_column = np.arange(columns) % 2 == x
    green = red_row != red_column
    red = np.where(red_row, np.where(green, across, here), np.where(green, along, corners))
    blue = np.where(red_row, np.where(green, along, corners), np.where(green, across, here))
    return np.stack([red, np.where(green, here, cross), blue], axis=-1).astype(raw.dtype)
