# SPDX-License-Identifier: Apache-2.0
"""Checks of the refocuser's arguments, with errors in one line."""

from typing import Any, Literal

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.images import Image

Align = Literal["centred", "causal"]
Interpolation = Literal["nearest", "linear"] | int
"""How micro images are interpolated: by name, or the order of the B-spline (0 to 3)."""
MAX_INTERPOLATION_ORDER = 3
Region = tuple[slice, slice]
"""Rows and columns of a result, without steps."""


def whole_number(value: object, where: str, least: int | None = None) -> int:
    """A Python integer from an integer of Python or NumPy."""
    kind = "an integer" if least is None else f"an integer, {least} or more"
    # True is a number to Python, and a mistake here.
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise InputError(f"must be {kind}, not {value!r}", where=where)
    number = int(value)
    if least is not None and number < least:
        raise InputError(f"must be {kind}, not {number}", where=where)
    return number


def check_align(align: str) -> None:
    """Refuse an alignment that does not exist."""
    if align not in ("centred", "causal"):
        raise InputError(f"{align!r} is not possible; use 'centred' or 'causal'", where="align")


def check_pixels(raw: Image, where: str = "raw") -> Image:
    """Refuse an array that is no image; the array in this machine's byte order."""
    # Conversion to a plain array would drop the mask in silence.
    if isinstance(raw, np.ma.MaskedArray):
        raise InputError("is a masked array; use a plain one, such as raw.filled(0)", where=where)
    native = raw.dtype.newbyteorder("=")
    if native not in (np.uint8, np.uint16):
        raise InputError(
            f"has pixels of type {raw.dtype}; they must be unsigned integers of 8 or 16 bit",
            where=where,
        )
    if raw.ndim not in (2, 3) or (raw.ndim == 3 and raw.shape[2] != 3):
        got = f"{raw.shape[2]} channels" if raw.ndim == 3 else f"{raw.ndim} dimensions"
        raise InputError(
            f"has {got}; an image has 2 dimensions, or 3 with three channels", where=where
        )
    return np.asarray(raw, dtype=native)


def check_raw(raw: Image, micro_image_size: int, *, where: str = "raw") -> Image:
    """Refuse an array that is not a raw image of micro images of M x M pixels.

    `raw`: candidate, expected shape (rows, columns) or (rows, columns, 3), uint8 or uint16. Result:
    the same pixels in this machine's byte order. Raises `InputError` if M, the type, the number of
    channels or the size is not supported.
    """
    m = whole_number(micro_image_size, "M", 1)
    image = check_pixels(raw, where)
    rows, columns = image.shape[:2]
    if min(rows, columns) < m:
        raise InputError(
            f"has {columns} x {rows} pixels, less than one micro image; it needs at "
            f"least {m} x {m} for M = {m}",
            where=where,
        )
    return image


def interpolation_order(interpolation: Interpolation | str, *, where: str = "interpolation") -> int:
    """Order of an interpolation.

    `interpolation`: "nearest", "linear", or a number from 0 to 3, as a number or as text. Result: 0
    for nearest neighbour, 1 for linear, the number itself otherwise. Raises `InputError` if there
    is no such interpolation.
    """
    names = {"nearest": 0, "linear": 1}
    if isinstance(interpolation, str) and interpolation in names:
        return names[interpolation]
    orders = [str(order) for order in range(MAX_INTERPOLATION_ORDER + 1)]
    if str(interpolation) in orders:
        return int(interpolation)
    raise InputError(
        f"{interpolation!r} is not an interpolation; use nearest, linear, or an order "
        f"from 0 to {MAX_INTERPOLATION_ORDER}",
        where=where,
    )


def region_ranges(region: Region | None, shape: tuple[int, int]) -> tuple[range, range]:
    """Rows and columns of a region of interest."""
    if region is None:
        return range(shape[0]), range(shape[1])
    try:
        # Other values than two slices cannot be unpacked, or have no steps.
        rows, columns = region
        if isinstance(region, tuple) and {rows.step, columns.step} <= {None, 1}:
            return range(*rows.indices(shape[0])), range(*columns.indices(shape[1]))
    except (TypeError, ValueError, AttributeError):
        pass
    raise InputError(
        f"{region!r} is not a region; give two slices without steps: rows, columns", where="region"
    )


def check_out(out: Any, raw: Image, shape: tuple[int, ...]) -> None:
    """Refuse memory that a result of a shape cannot be written to."""
    kind = f"a C-contiguous array of shape {shape}, {raw.dtype}, that can be written"
    if not isinstance(out, np.ndarray) or isinstance(out, np.ma.MaskedArray):
        raise InputError(f"is a {type(out).__name__}; it must be {kind}", where="out")
    if out.shape != shape or out.dtype != raw.dtype:
        raise InputError(f"has shape {out.shape}, {out.dtype}; it must be {kind}", where="out")
    if not out.flags.c_contiguous or not out.flags.writeable:
        fault = "not contiguous" if out.flags.writeable else "read-only"
        raise InputError(f"is {fault}; it must be {kind}", where="out")
    # The exact answer may take long, so it is asked for where the bounds overlap.
    if np.may_share_memory(out, raw) and np.shares_memory(out, raw):
        raise InputError("shares its memory with the raw image; use other memory", where="out")
