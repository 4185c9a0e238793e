# SPDX-License-Identifier: Apache-2.0
"""What `refocus` and stacks of its pictures are given, checked."""

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.refocus.border import Border, check_border
from plenofir.refocus.checks import (
    Align,
    Interpolation,
    Region,
    check_align,
    check_raw,
    interpolation_order,
    region_ranges,
)
from plenofir.refocus.operator import Image, box_size, clamped_shift
from plenofir.refocus.sharpening import Sharpen, sharpening_units
from plenofir.refocus.shifts import focus_to_shift, shift_to_text
from plenofir.refocus.slices import Slice

_NO_ARRAY = "must be an array of NumPy, CuPy or PyTorch, not {}"


# Libraries by the classes of their arrays: array-api-compat takes longer to find one.
_LIBRARIES: dict[type, Any] = {}


def library_of(raw: Any) -> Any:
    """The namespace of the library that an array is of; refuses what is no array."""
    kind = type(raw)
    if kind not in _LIBRARIES:
        try:
            from array_api_compat import array_namespace

            _LIBRARIES[kind] = array_namespace(raw)
        except ModuleNotFoundError as error:
            if error.name == "array_api_compat" and hasattr(raw, "__dlpack__"):
                raise missing(error.name) from None
            raise InputError(_NO_ARRAY.format(kind.__name__), where="raw") from None
        except TypeError:
            raise InputError(_NO_ARRAY.format(kind.__name__), where="raw") from None
    return _LIBRARIES[kind]


def _stand_in(xp: Any, dtype: Any, shape: tuple[int, ...]) -> Image:
    """NumPy array with the shape and type of a library's array, but without its data."""
    for kind in (np.uint8, np.uint16):
        if dtype == getattr(xp, kind.__name__):
            # This array takes no memory: all its pixels are one.
            return np.broadcast_to(kind(0), shape)
    raise InputError(
        f"has pixels of type {dtype}; they must be unsigned integers of 8 or 16 bit",
        where="raw",
    )


def checked(
    raw: Any,
    M: int,  # noqa: N803  (as `plenofir.refocus.refocus` has all of these)
    a: int | str | Fraction,
    align: Align = "centred",
    interpolation: Interpolation = "nearest",
    sharpen: Sharpen = "off",
    border: Border = "zero",
    box: int | None = None,
    region: Region | None = None,
    upsample: bool = True,
) -> tuple[Any, Slice]:
    """The image as it is read, and the slice; refuses what is not possible."""
    xp: Any = np
    if isinstance(raw, np.ndarray):
        raw = check_raw(raw, M)
    else:
        xp = library_of(raw)
    options = align, interpolation, sharpen, border, box, upsample
    image = xp, raw.dtype, tuple(raw.shape)
    try:
        slice_ = _whole(*image, M, a, *options)
    except TypeError:  # Values without a hash are refused by name.
        slice_ = _whole.__wrapped__(*image, M, a, *options)
    if region is not None:
        rows, columns = slice_.region
        slice_ = _part(slice_, region_ranges(region, (len(rows), len(columns))))
    return raw, slice_


def check_pixel_for_each_lens(
    micro_image_size: int, shift: int, order: int, units: int, sharpen: Sharpen
) -> None:
    """Refuse what `upsample=False` cannot have; `units`: weight of the sharpening in 64ths."""
    if shift % micro_image_size or order:
        raise InputError(
            "one pixel for each micro lens needs an integer a and nearest neighbour, not "
            f"a = {shift_to_text(shift, micro_image_size)} with order {order}",
            where="upsample",
        )
    if units:
        raise InputError(
            f"one pixel for each micro lens takes off or auto, not {sharpen}", where="sharpen"
        )


# Films have the same settings for each frame, and checking them takes longer than a GPU's picture.
@lru_cache(1024, typed=True)
def _whole(
    xp: Any,
    dtype: Any,
    shape: tuple[int, ...],
    M: int,  # noqa: N803
    a: int | str | Fraction,
    align: Align,
    interpolation: Interpolation,
    sharpen: Sharpen,
    border: Border,
    box: int | None,
    upsample: bool,
) -> Slice:
    """The slice of a whole picture by a user's settings; refuses those that are not possible."""
    # Checks need only shape and type, so pixels are not copied from a GPU.
    pixel_bits = 8 * check_raw(_stand_in(xp, dtype, shape), M).itemsize
    M = int(M)  # noqa: N806
    shift = focus_to_shift(a, M)
    check_align(align)
    check_border(border)
    order = interpolation_order(interpolation)
    size = box_size(M, shift, box)
    units = sharpening_units(sharpen, M, shift, order, box=size)
    if not upsample:
        check_pixel_for_each_lens(M, shift, order, units, sharpen)
    step = 1 if upsample else M
    return Slice(
        shape,
        pixel_bits,
        M,
        clamped_shift(M, shift, shape),
        (range(shape[0] // step), range(shape[1] // step)),
        align=align,
        order=order,
        units=units,
        upsample=upsample,
        normalise=border == "normalise",
        box_samples=size,
    )


@lru_cache(1024)
def _part(whole: Slice, region: tuple[range, range]) -> Slice:
    return replace(whole, region=region)
