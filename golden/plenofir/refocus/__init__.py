# SPDX-License-Identifier: Apache-2.0
"""Shift and integration: refocusing a calibrated raw image.

`refocus` is the call for users; the modules hold the operator's forms (`operator`), its form
as a switched filter (`switches`) and the hardware's arithmetic (`arithmetic`). In all of them
`raw` is a raw image, shape (rows, columns[, channels]), uint8 or uint16; `micro_image_size` is M
and `shift` a' = a M, both in pixels; `align` is as in `output_offset`, `order` that of the
interpolation (`interpolated_sums`); `where` names the input in messages.
"""

from fractions import Fraction
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.refocus.arithmetic import (
    Arithmetic,
    ExactArithmetic,
    StoredProductArithmetic,
    error_against_operator,
)
from plenofir.refocus.border import Border
from plenofir.refocus.by_place import chosen
from plenofir.refocus.checks import (
    MAX_INTERPOLATION_ORDER,
    Align,
    Interpolation,
    Region,
    check_out,
    check_raw,
    interpolation_order,
    whole_number,
)
from plenofir.refocus.first_calls import refocus_image
from plenofir.refocus.operator import (
    Image,
    gather_sums,
    interpolated_sums,
    least_box,
    moving_sums,
    output_offset,
    refocus_sums,
    scatter_sums,
)
from plenofir.refocus.pictures import Aperture, best_picture, real_focus
from plenofir.refocus.settings import checked
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
from plenofir.refocus.stacks import refocus_stack, sharpest_slices
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
    "refocus_stack",
    "refocus_sums",
    "scatter_sums",
    "setting_names",
    "sharpening_units",
    "sharpest_slices",
    "shift_to_name",
    "shift_to_text",
]


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
    raw, slice_ = checked(raw, M, a, align, interpolation, sharpen, border, box, region, upsample)
    if threads is not None:
        threads = whole_number(threads, "threads", 1)
    if not isinstance(raw, np.ndarray):
        from plenofir.refocus.arrays import device_stack

        return cast("Image", device_stack(raw, [slice_], slice_.result_shape, out))
    if out is not None:
        check_out(out, raw, slice_.result_shape)
    return refocus_image(raw, slice_, out=out, threads=threads)


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
