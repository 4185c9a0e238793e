# SPDX-License-Identifier: Apache-2.0
"""Resolution by place: a small box where a slice is in focus, the whole one elsewhere.

A box of B samples makes sharper what is in focus, and shows a lattice of views where it is not.
Both are sums of one stream (`plenofir.refocus.operator`), so a pixel is one of two numbers:

    E[k] = E_B[k] if here[t, s] else E_M[k]     with (t, s) the micro image that pixel k lies in

E_B and E_M are rounded as each is alone. Which micro images are in focus comes from the depth index
(`plenofir.refocus.sharpness.DepthIndex.sharp_in`). Pictures to look at blend both from micro image
to micro image instead (`blended`), so that no squares show.
"""

from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.refocus import refocus
from plenofir.refocus.checks import whole_number
from plenofir.refocus.operator import Image, least_box
from plenofir.refocus.shifts import focus_to_shift

# Lines that are blended at once.
_BAND = 64


def chosen(sharp: Image, whole: Image, here: npt.NDArray[np.bool_], micro_image_size: int) -> Image:
    """Pixels of `sharp` in the micro images that are `here`, of `whole` in the others.

    `sharp`, `whole`: pictures of equal shape, (rows, columns[, 3]), and type. `here`: one value for
    each micro image that they begin, shape (t, s).
    """
    m = micro_image_size
    rows, columns = (np.arange(length) // m for length in whole.shape[:2])
    places = here[np.ix_(rows, columns)].reshape(*whole.shape[:2], *[1] * (whole.ndim - 2))
    return np.where(places, sharp, whole)


def refocus_by_place(
    raw: Image,
    M: int,  # noqa: N803  (as `plenofir.refocus.refocus` has it)
    a: int | str | Fraction,
    here: npt.NDArray[np.bool_],
    *,
    box: int,
    **how: Any,
) -> Image:
    """Refocus with a box of B samples in some micro images, and with one of M in all others.

    `here`: where the box is small, shape (t, s), a value for each micro image that the raw image
    begins. `box`: B, or the next larger one that the slice can have
    (`plenofir.refocus.operator.least_box`). `how`: further options of `plenofir.refocus.refocus`,
    for the whole picture. Result: `chosen` from both pictures. Raises `InputError` for what
    `refocus` refuses, and if `here` has another shape.
    """
    size = least_box(M, focus_to_shift(a, whole_number(M, "M", 1)), box)
    whole = refocus(raw, M, a, **how)
    lenses = tuple(-(-length // M) for length in whole.shape[:2])
    if here.shape != lenses:
        raise InputError(f"has the shape {here.shape}; it must be {lenses}", where="here")
    if size == M or not here.any():
        return whole
    return chosen(refocus(raw, M, a, box=size, **how), whole, here, M)


def blended(
    sharp: Image, whole: Image, shares: npt.NDArray[np.floating[Any]], micro_image_size: int
) -> Image:
    """A picture that goes from `whole` to `sharp` as the shares of micro images go from 0 to 1.

    `sharp`, `whole`: pictures of equal shape, (rows, columns[, 3]), and type. `shares`: of each
    micro image, shape (t, s), interpolated linearly between their middles. Result: of their type.
    """
    places = [
        _between(length, micro_image_size, count)
        for length, count in zip(whole.shape, shares.shape, strict=False)
    ]
    shares = shares.astype(np.float32)
    picture = np.empty_like(whole)
    (up, down, low), (left, right, side) = places
    across = shares[:, left] + side * (shares[:, right] - shares[:, left])
    for first in range(0, len(whole), _BAND):
        part = slice(first, first + _BAND)
        share = across[up[part]] + low[part, None] * (across[down[part]] - across[up[part]])
        share = share.reshape(*share.shape, *[1] * (whole.ndim - 2))
        one = whole[part].astype(np.float32)
        picture[part] = np.rint(one + share * (sharp[part] - one))
    return picture


def _between(length: int, m: int, count: int) -> tuple[Any, Any, Any]:
    """For each pixel the micro images before and behind it, and its place between their middles."""
    places = ((np.arange(length) - (m - 1) / 2) / m).clip(0, count - 1)
    before = places.astype(np.int64)
    return before, (before + 1).clip(max=count - 1), (places - before).astype(np.float32)
