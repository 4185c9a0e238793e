# SPDX-License-Identifier: Apache-2.0
"""The border of a picture, where some views have no pixel.

An output takes one pixel of each view. Near the border pixels of some views would lie outside of
the raw image. ``border="zero"`` counts these as black, so pictures get darker at their border, over
half of a' (M - 1) pixels. ``border="normalise"`` divides by the sum of the weights of the existing
pixels instead. This is a product of one number for the row and one for the column, which follow
from M, a', the order and the size of the frame. In the interior both are equal.
"""

from functools import lru_cache
from typing import Literal, get_args

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Align, Sums, divide_half_up, interpolated_sums
from plenofir.refocus.sharpening import neighbours, taps

Border = Literal["zero", "normalise"]


def check_border(border: str) -> None:
    """Refuse a border that does not exist."""
    if border not in get_args(Border):
        raise InputError(f"{border!r} is not a border; use 'zero' or 'normalise'", where="border")


@lru_cache(maxsize=512)
def arrived(
    length: int, micro_image_size: int, shift: int, order: int, align: Align, box: int | None = None
) -> Sums:
    """Sums of weights for each output of one dimension, shape (length,); B^(1 + order) inside.

    They are the sums of a row of ones. `box`: samples B of the box, M if None.
    """
    ones = np.ones(length, np.int64)
    weights = interpolated_sums(
        ones, micro_image_size, shift, axis=0, align=align, order=order, box=box
    )
    # The cache gives one array to all callers.
    weights.flags.writeable = False
    return weights


def sharpened_inside(
    sums: Sums, weights: tuple[Sums, Sums], full: int, micro_image_size: int, units: int
) -> Sums:
    """Sharpen as `sharpened_sums` where all views have a pixel; leave other pixels unchanged.

    A tap with missing views is replaced by the pixel itself, as one outside of the picture.
    """
    filter_ = taps(units)
    for axis, reached in enumerate(weights):
        before, behind = neighbours(len(reached), micro_image_size)
        pixels, sharp = np.arange(len(reached)), reached == full
        around = [
            np.take(sums, np.where(sharp & sharp[k], k, pixels), axis) for k in (before, behind)
        ]
        sums = filter_.centre * sums - filter_.side * (around[0] + around[1])
    return sums


def weighted_quotients(sums: Sums, weights: tuple[Sums, Sums], largest: int) -> Sums:
    """Sums over the product of a weight for the row and one for the column, in plain integers.

    Rounded, halves up, and limited to 0 .. `largest`; 0 where the weight is 0. `sums` has the shape
    (rows, columns[, channels]), and so has the result.
    """
    down, across = weights
    weight = np.outer(down, across).reshape(sums.shape[:2] + (1,) * (sums.ndim - 2))
    quotients = divide_half_up(sums, np.maximum(weight, 1))
    return np.where(weight > 0, np.clip(quotients, 0, largest), 0)
