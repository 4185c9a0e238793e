"""Shift and integration: refocusing a calibrated raw image.

`refocus` is the call for users; the modules hold the operator's forms (`operator`), its form
as a switched filter (`switches`) and the hardware's arithmetic (`arithmetic`).
"""

from fractions import Fraction
from typing import Any, Literal, cast

import numpy as np

from plenofir.errors import InputError
from plenofir.refocus.arithmetic import (
    Arithmetic,
    ExactArithmetic,
    StoredProductArithmetic,
    error_against_operator,
)
from plenofir.refocus.operator import (
    Align,
    Image,
    gather_sums,
    interpolated_sums,
    moving_sums,
    output_offset,
    refocus_sums,
    scatter_sums,
)
from plenofir.refocus.shifts import focus_to_shift, parse_focus, shift_to_text
from plenofir.refocus.switches import FilterLayout, filter_lines
from plenofir.refocus.threads import processors

Interpolation = Literal["nearest", "linear"] | int
"""How micro images are interpolated: by name, or the order of the B-spline (0 to 3)."""
MAX_INTERPOLATION_ORDER = 3

__all__ = [
    "MAX_INTERPOLATION_ORDER",
    "Align",
    "Arithmetic",
    "ExactArithmetic",
    "FilterLayout",
    "Image",
    "Region",
    "StoredProductArithmetic",
    "check_raw",
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
    "refocus",
    "refocus_sums",
    "scatter_sums",
    "shift_to_text",
]


def check_raw(raw: Image, micro_image_size: int, *, where: str = "raw") -> None:
    """Refuse an array that is not a raw image of micro images of M x M pixels.

    Parameters
    ----------
    raw
        Candidate, expected shape (rows, columns) or (rows, columns, 3), uint8 or uint16.
    micro_image_size
        M in pixels.
    where
        Name used in the error message.

    Raises
    ------
    InputError
        If M, the type, the number of channels or the size is not supported.
    """
    if isinstance(micro_image_size, bool) or not isinstance(micro_image_size, (int, np.integer)):
        raise InputError(
            f"{micro_image_size!r} is not an integer",
            where="M",
            expected="an integer, 1 or more",
        )
    if micro_image_size < 1:
        raise InputError(
            f"M = {micro_image_size} is too small", where="M", expected="an integer, 1 or more"
        )
    if raw.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"pixels of type {raw.dtype}", where=where, expected="8 or 16 bit unsigned integers"
        )
    if raw.ndim not in (2, 3) or (raw.ndim == 3 and raw.shape[2] != 3):
        got = f"{raw.shape[2]} channels" if raw.ndim == 3 else f"{raw.ndim} dimensions"
        raise InputError(got, where=where, expected="a grey (1 channel) or RGB (3 channels) image")
    rows, columns = raw.shape[:2]
    if min(rows, columns) < micro_image_size:
        raise InputError(
            f"{columns} x {rows} pixels are less than one micro image",
            where=where,
            expected=f"at least {micro_image_size} x {micro_image_size} pixels for "
            f"M = {micro_image_size}",
        )


def interpolation_order(interpolation: Interpolation | str, *, where: str = "interpolation") -> int:
    """Order of an interpolation.

    Parameters
    ----------
    interpolation
        "nearest", "linear", or a number from 0 to 3, as a number or as text.
    where
        Name used in the error message.

    Returns
    -------
    int
        0 for nearest neighbour, 1 for linear, the number itself otherwise.

    Raises
    ------
    InputError
        If there is no such interpolation.
    """
    names = {"nearest": 0, "linear": 1}
    if isinstance(interpolation, str) and interpolation in names:
        return names[interpolation]
    orders = [str(order) for order in range(MAX_INTERPOLATION_ORDER + 1)]
    if str(interpolation) in orders:
        return int(interpolation)
    raise InputError(
        f"{interpolation!r}",
        where=where,
        expected=f"nearest, linear, or an order from 0 to {MAX_INTERPOLATION_ORDER}",
    )


Region = tuple[slice, slice]
"""Rows and columns of a result, without steps."""


def _ranges(region: Region | None, shape: tuple[int, int]) -> tuple[range, range]:
    """Rows and columns of a region of interest."""
    if region is None:
        return range(shape[0]), range(shape[1])
    expected = "two slices without steps: rows, columns"
    if not isinstance(region, tuple) or len(region) != 2:
        raise InputError(f"{region!r}", where="region", expected=expected)
    if any(not isinstance(part, slice) or part.step not in (None, 1) for part in region):
        raise InputError(f"{region!r}", where="region", expected=expected)
    rows, columns = (range(*p.indices(n)) for p, n in zip(region, shape, strict=True))
    return rows, columns


def _like(raw: Any) -> Image:
    """NumPy array of the shape and type of another library's array, without memory."""
    try:
        from array_api_compat import array_namespace

        xp = array_namespace(raw)
    except TypeError:
        raise InputError(
            f"{type(raw).__name__}", where="raw", expected="an array of NumPy, CuPy or PyTorch"
        ) from None
    for kind in (np.uint8, np.uint16):
        if raw.dtype == getattr(xp, kind.__name__):
            return np.broadcast_to(kind(0), tuple(raw.shape))
    raise InputError(
        f"pixels of type {raw.dtype}", where="raw", expected="8 or 16 bit unsigned integers"
    )


def refocus(
    raw: Image,
    M: int,  # noqa: N803  (the field's symbol, and part of the stable interface)
    a: int | str | Fraction,
    *,
    align: Align = "centred",
    interpolation: Interpolation = "nearest",
    region: Region | None = None,
    upsample: bool = True,
    out: Image | None = None,
    threads: int | None = None,
) -> Image:
    """Refocus a calibrated raw image: shift and integration (Eq. 6.1), correctly rounded.

    The result equals `ExactArithmetic`'s to the bit; `plenofir.refocus.fast` makes it, at a cost
    that depends on neither M nor a.

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
    region
        Rows and columns of the result to compute, as slices.
    upsample
        False, for an integer a and nearest neighbour: one pixel for each whole micro lens,
        the first of each M x M pixels of the full result.
    out
        Array to write the result to, C-contiguous, of the result's shape and the type of `raw`,
        not overlapping it. Saves the time in which the system provides new memory.
    threads
        Number of threads; as many as there are processors if None.

    Returns
    -------
    numpy.ndarray
        round(S2 / M^2), halves up (order n: round(S2 / M^(2 + 2n))); size and type of `raw`, or of
        the region asked for.

    Raises
    ------
    InputError
        If the image, M, a or an option is not supported.
    """
    other_library = not isinstance(raw, np.ndarray)
    if other_library:
        # The checks need only shape and type: pixels stay in their own memory.
        check_raw(_like(raw), M)
    else:
        check_raw(raw, M)
    M = int(M)  # noqa: N806
    shift = focus_to_shift(a, M)
    if align not in ("centred", "causal"):
        raise InputError(f"{align!r}", where="align", expected="'centred' or 'causal'")
    order = interpolation_order(interpolation)
    if not upsample and (shift % M or order):
        raise InputError(
            f"a = {shift_to_text(shift, M)}, interpolation of order {order}",
            where="upsample",
            expected="an integer a and nearest neighbour for one pixel each micro lens",
        )
    if threads is not None and threads < 1:
        raise InputError(f"{threads}", where="threads", expected="1 or more")
    step = 1 if upsample else M
    ranges = _ranges(region, (raw.shape[0] // step, raw.shape[1] // step))
    if other_library:
        from plenofir.refocus.arrays import device_refocus

        if out is not None:
            raise InputError("is for NumPy arrays", where="out", expected="none for other arrays")
        return cast(
            "Image",
            device_refocus(
                raw, M, shift, align=align, order=order, region=ranges, upsample=upsample
            ),
        )
    if out is not None:
        shape = (len(ranges[0]), len(ranges[1]), *raw.shape[2:])
        if out.shape != shape or out.dtype != raw.dtype or not out.flags.c_contiguous:
            raise InputError(
                f"shape {out.shape}, {out.dtype}",
                where="out",
                expected=f"a C-contiguous array of shape {shape}, {raw.dtype}",
            )
        if np.shares_memory(out, raw):
            raise InputError("overlaps the raw image", where="out", expected="other memory")
    # Compiled code is loaded only where something is refocused.
    from plenofir.refocus.fast import fast_refocus

    return fast_refocus(
        raw,
        M,
        shift,
        align=align,
        order=order,
        region=ranges,
        upsample=upsample,
        out=out,
        threads=threads,
    )
