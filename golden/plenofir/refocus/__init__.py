# SPDX-License-Identifier: Apache-2.0
"""Shift and integration: refocusing a calibrated raw image.

`refocus` is the call for users; the modules hold the operator's forms (`operator`), its form
as a switched filter (`switches`) and the hardware's arithmetic (`arithmetic`). In all of them
`raw` is a raw image, shape (rows, columns[, channels]), uint8 or uint16; `micro_image_size` is M
and `shift` a' = a M, both in pixels; `align` is as in `output_offset`, `order` that of the
interpolation (`interpolated_sums`); `where` names the input in messages.
"""

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.refocus.arithmetic import (
    Arithmetic,
    ExactArithmetic,
    StoredProductArithmetic,
    error_against_operator,
)
from plenofir.refocus.border import Border, check_border
from plenofir.refocus.by_place import chosen
from plenofir.refocus.checks import (
    MAX_INTERPOLATION_ORDER,
    Align,
    Interpolation,
    Region,
    check_align,
    check_out,
    check_raw,
    interpolation_order,
    region_ranges,
    whole_number,
)
from plenofir.refocus.first_calls import refocus_image
from plenofir.refocus.operator import (
    Image,
    box_size,
    clamped_shift,
    gather_sums,
    interpolated_sums,
    least_box,
    moving_sums,
    output_offset,
    refocus_sums,
    scatter_sums,
)
from plenofir.refocus.pictures import Aperture, best_picture, real_focus
from plenofir.refocus.sharpening import (
    Sharpen,
    automatic_units,
    derived_moment,
    sharpening_units,
)
from plenofir.refocus.shifts import (
    focus_to_shift,
    parse_focus,
    setting_names,
    shift_to_name,
    shift_to_text,
)
from plenofir.refocus.slices import Slice
from plenofir.refocus.switches import FilterLayout, filter_lines
from plenofir.refocus.threads import processors

__all__ = [
    "MAX_INTERPOLATION_ORDER",
    "Align",
    "Aperture",
    "Arithmetic",
    "Border",
    "ExactArithmetic",
    "FilterLayout",
    "Image",
    "Interpolation",
    "Region",
    "Sharpen",
    "StoredProductArithmetic",
    "automatic_units",
    "best_picture",
    "check_raw",
    "derived_moment",
    "error_against_operator",
    "filter_lines",
    "focus_to_shift",
    "gather_sums",
    "interpolated_sums",
    "interpolation_order",
    "moving_sums",
    "output_offset",
    "parse_focus",
    "processors",
    "real_focus",
    "refocus",
    "refocus_by_place",
    "refocus_sums",
    "scatter_sums",
    "setting_names",
    "sharpening_units",
    "shift_to_name",
    "shift_to_text",
]


_NO_ARRAY = "must be an array of NumPy, CuPy or PyTorch, not {}"


def _like(raw: Any) -> Image:
    """NumPy array with the shape and type of another library's array, but without its data."""
    try:
        from array_api_compat import array_namespace

        xp = array_namespace(raw)
    except ModuleNotFoundError as error:
        if error.name == "array_api_compat" and hasattr(raw, "__dlpack__"):
            raise missing(error.name) from None
        raise InputError(_NO_ARRAY.format(type(raw).__name__), where="raw") from None
    except TypeError:
        raise InputError(_NO_ARRAY.format(type(raw).__name__), where="raw") from None
    for kind in (np.uint8, np.uint16):
        if raw.dtype == getattr(xp, kind.__name__):
            return _stand_in(kind, tuple(raw.shape))
    raise InputError(
        f"has pixels of type {raw.dtype}; they must be unsigned integers of 8 or 16 bit",
        where="raw",
    )


@lru_cache(256)
def _stand_in(kind: type[np.generic], shape: tuple[int, ...]) -> Image:
    return np.broadcast_to(kind(0), shape)


def refocus(
    raw: Image,
    M: int,  # noqa: N803  (the field's symbol, and part of the stable interface)
    a: int | str | Fraction,
    *,
    align: Align = "centred",
    interpolation: Interpolation = "nearest",
    sharpen: Sharpen = "off",
    border: Border = "zero",
    box: int | None = None,
    region: Region | None = None,
    upsample: bool = True,
    out: Image | None = None,
    threads: int | None = None,
) -> Image:
    """Refocus a calibrated raw image: shift and integration (Eq. 6.1), correctly rounded.

    The result equals `ExactArithmetic`'s to the bit; `plenofir.refocus.compiled` makes it, at a
    cost that depends on neither M nor a. Its loops are compiled once on a machine, in a thread;
    until they are there, pictures come from NumPy (`plenofir.refocus.plain`), equal to the bit.

    Parameters
    ----------
    raw
        Raw image, shape (rows, columns) or (rows, columns, 3), uint8 or uint16, made of micro
        images of M x M pixels from the top left corner on. Sizes need not be multiples of M.
        An array of CuPy, PyTorch or another library with the array API is refocused by that
        library, in its own memory (a GPU for instance); the result is an array of that library.
    M
        Micro image size in pixels, 1 or more.
    a
        Focus setting in micro lens pitches, a fraction whose denominator divides M: int,
        `Fraction` or text such as ``"-3/5"``. Negative values lie beyond the main lens focus.
    align
        "centred": the picture stays put while focus is stepped. "causal": output pixel k is
        S[k], as in the thesis's timing diagrams.
    interpolation
        "nearest": each micro image is repeated M times (Eq. 6.1). "linear": whole micro images
        are interpolated linearly. A number: B-spline of that order (0 nearest, 1 linear, up to 3).
    sharpen
        "off": the operator as it is defined. "auto": the filter (-b, 1 + 2b, -b), its taps a lens
        apart, along rows and columns takes back what the operator blurs; b follows from M, a and
        the interpolation, and is 0 for an integer a (`plenofir.refocus.sharpening`). Or b itself, a
        multiple of 1/64 from 0 to 1/4. A tap outside the picture counts as the pixel itself.
    border
        Near the border of the picture some of the M^2 views have no pixel. "zero": they count as
        black, as Eq. 6.1 has it. "normalise": the sum is divided by the number of those that have
        one, so the picture is not darker there (`plenofir.refocus.border`); sharpened are then only
        pixels that all views reach.
    box
        Samples B along a dimension that an output averages, from 1 to M (None), a multiple of
        gcd(a M, M). A smaller box makes a plane in focus sharper, and averages noise over fewer
        views; B = |a M| is for focused plenoptic cameras. Where M - B is odd, the picture lies half
        a pixel beside.
    region
        Rows and columns of the result to compute, as slices.
    upsample
        False, for an integer a and nearest neighbour: one pixel for each whole micro lens,
        the first of each M x M pixels of the full result.
    out
        Array to write the result to, C-contiguous, of the result's shape and the type of `raw`,
        not overlapping it. Saves the time in which the system provides new memory. For arrays of
        another library one of its own that can be written, on the same device.
    threads
        Number of threads; as many as there are processors if None.

    Returns
    -------
    numpy.ndarray
        round(S2 / B^2), halves up (order n: round(S2 / B^(2 + 2n))), with sharpening still one
        rounding, limited to the range of the pixels; size and type of `raw`, in this machine's byte
        order, or of the region asked for.

    Raises
    ------
    InputError
        If the image, M, a or an option is not supported.
    """
    other_library = not isinstance(raw, np.ndarray)
    if other_library:
        # Checks need only shape and type, so pixels are not copied from the GPU.
        pixel_bits = 8 * check_raw(_like(raw), M).itemsize
    else:
        raw = check_raw(raw, M)
        pixel_bits = 8 * raw.itemsize
    options = align, interpolation, sharpen, border, box, upsample
    try:
        slice_ = _whole(tuple(raw.shape), pixel_bits, M, a, *options)
    except TypeError:  # Values without a hash are refused by name.
        slice_ = _whole.__wrapped__(tuple(raw.shape), pixel_bits, M, a, *options)
    if threads is not None:
        threads = whole_number(threads, "threads", 1)
    if region is not None:
        rows, columns = slice_.region
        slice_ = replace(slice_, region=region_ranges(region, (len(rows), len(columns))))
    if other_library:
        from plenofir.refocus.arrays import device_refocus

        return cast("Image", device_refocus(raw, slice_, out))
    if out is not None:
        check_out(out, raw, slice_.result_shape)
    return refocus_image(raw, slice_, out=out, threads=threads)


# Films have the same settings for each frame, and checking them takes longer than a GPU's picture.
@lru_cache(1024, typed=True)
def _whole(
    shape: tuple[int, ...],
    pixel_bits: int,
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
    M = int(M)  # noqa: N806
    shift = focus_to_shift(a, M)
    check_align(align)
    check_border(border)
    order = interpolation_order(interpolation)
    if not upsample and (shift % M or order):
        raise InputError(
            "one pixel for each micro lens needs an integer a and nearest neighbour, not "
            f"a = {shift_to_text(shift, M)} with order {order}",
            where="upsample",
        )
    size = box_size(M, shift, box)
    units = sharpening_units(sharpen, M, shift, order, box=size)
    if units and not upsample:
        raise InputError(
            f"one pixel for each micro lens takes off or auto, not {sharpen}", where="sharpen"
        )
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


def refocus_by_place(
    raw: Image,
    M: int,  # noqa: N803  (as `refocus` has it)
    a: int | str | Fraction,
    here: npt.NDArray[np.bool_],
    *,
    box: int,
    **how: Any,
) -> Image:
    """Refocus with a box of B samples in some micro images, and with one of M in all others.

    `here`: where the box is small, shape (t, s), a value for each micro image that the raw image
    begins. `box`: B, or the next larger one that the slice can have
    (`plenofir.refocus.operator.least_box`). `how`: further options of `refocus`,
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
