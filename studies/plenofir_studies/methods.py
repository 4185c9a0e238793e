# SPDX-License-Identifier: Apache-2.0
"""Ways to refocus a raw image, to compare with each other.

All take a grey raw image, M and a', and return the refocused image in grey levels, in the raw
image's size or with a value for each micro lens.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import gcd
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import ndimage

from plenofir.camera.lightfield.indexing import views
from plenofir.refocus import (
    ExactArithmetic,
    Sharpen,
    StoredProductArithmetic,
    best_picture,
    output_offset,
    refocus,
    refocus_sums,
)
from plenofir.refocus.operator import Image
from plenofir_studies.fourier import fourier_slice

Floats = npt.NDArray[np.floating[Any]]
Work = Callable[[Any, int, int], Any]


@dataclass(frozen=True)
class Method:
    """A way to refocus."""

    name: str  # name for tables
    work: Work  # takes a raw image, M and a'
    lenses: bool = False  # whether the result has a value for each micro lens, not for each pixel
    # order of its interpolation; None if it is of another kind and is only compared with the truth
    order: int | None = 0
    # arithmetic, if it is the core's
    hardware: StoredProductArithmetic | ExactArithmetic | None = None


def exact_sums(raw: Image, m: int, shift: int, order: int = 0) -> npt.NDArray[np.longdouble]:
    """Value of the operator, sums in integers and one division in extended precision."""
    sums = refocus_sums(raw, m, shift=shift, order=order)
    return np.asarray(sums.astype(np.longdouble) / m ** (2 + 2 * order))


def plain_numba(raw: Image, m: int, shift: int) -> Image:
    """The method of `refocus` as plain loops for Numba: 8 bit pixels, M of up to 60.

    Its compiler finds vectors by itself, but for the running sum along a line.
    """
    out = np.empty_like(raw)
    rows, columns = (_moving_box(length, m, shift) for length in raw.shape)
    _plain_loops(raw, out, m, rows, columns)
    return out


def _moving_box(length: int, m: int, shift: int) -> tuple[Any, Any, Any]:
    """For each step the pixel that enters the box and the one that leaves it, `length` for none.

    Then for each output the step whose sum it takes. With g = gcd(a', M) the g pixels that enter
    together have a step each, as in `plenofir.refocus.moving_sum`.
    """
    common, offset = gcd(shift, m), output_offset(m, shift, "centred")
    places = np.arange(offset // common * common - m, offset + length + common)
    groups = places // common * common
    phases = np.arange(m // common)
    first = np.zeros(m, np.int64)
    first[phases * shift % m] = phases
    pixels = groups - (first[groups % m] + (places - groups) * len(phases)) * (shift - 1)
    enters = np.where((pixels >= 0) & (pixels < length), pixels, length)
    leaves = np.concatenate([np.full(m, length), enters[:-m]])
    outputs = np.arange(length) + offset
    return enters, leaves, outputs // common * common + common - 1 - places[0]


@njit(nogil=True)
def _plain_loops(raw: Any, out: Any, m: int, rows: Any, columns: Any) -> None:
    height, width = raw.shape
    half = np.int32(m * m // 2)
    # Rounded up, so that multiples of M^2 are not missed; exact for sums below 2^22.
    inverse = np.nextafter(np.float32(1 / (m * m)), np.float32(1))
    # The last sum of columns is no pixel's, and stays 0.
    sums, totals = np.zeros(width + 1, np.int32), np.zeros(len(columns[0]), np.int32)
    step = 0
    for r in range(height):
        for n in range(step, rows[2][r] + 1):
            enters, leaves = rows[0][n], rows[1][n]
            if enters < height and leaves < height:
                for c in range(width):
                    sums[c] += np.int32(raw[enters, c]) - np.int32(raw[leaves, c])
            elif enters < height:
                for c in range(width):
                    sums[c] += raw[enters, c]
            elif leaves < height:
                for c in range(width):
                    sums[c] -= raw[leaves, c]
        step = rows[2][r] + 1
        for n in range(totals.size):
            totals[n] = sums[columns[0][n]] - sums[columns[1][n]]
        for n in range(1, totals.size):
            totals[n] += totals[n - 1]
        for c in range(width):
            total = np.float32(totals[columns[2][c]] + half)
            out[r, c] = np.int32(total * inverse)


def shift_and_sum(raw: Any, m: int, shift: int, kind: type[np.floating[Any]]) -> Floats:
    """Mean of the shifted sub-aperture images, each repeated M times, in floating point."""
    x = raw.astype(kind)
    offset = output_offset(m, shift, "centred")
    total = np.zeros(raw.shape, kind)
    places = []
    for length in raw.shape:
        out = np.arange(length) + offset
        sources = [m * ((out - u * shift) // m) + u for u in range(m)]
        places.append([(k, (k >= 0) & (k < length)) for k in sources])
    for rows, row_there in places[0]:
        for columns, column_there in places[1]:
            part = x[np.ix_(rows[row_there], columns[column_there])]
            total[np.ix_(row_there, column_there)] += part
    return np.asarray(total / kind(m * m))


def running_sums(raw: Any, m: int, shift: int, kind: Any) -> Any:
    """Re-ordering and cumulative sums with NumPy, separable."""
    sums = np.ascontiguousarray(raw).astype(kind)
    offset = output_offset(m, shift, "centred")
    for axis in (1, 0):
        length = sums.shape[axis]
        p = np.arange(offset - m + 1, offset + length)
        entering = np.zeros((*sums.shape[:axis], p.size, *sums.shape[axis + 1 :]), kind)
        for u in np.arange(m)[np.isin(np.arange(m) * shift % m, p % m)]:
            # y[p] is the sum of the pixels with M j + u a' = p.
            source = p - u * (shift - 1)
            there = ((p - u * shift) % m == 0) & (source >= 0) & (source < length)
            if axis == 1:
                entering[:, there] += sums[:, source[there]]
            else:
                entering[there] += sums[source[there]]
        total = np.cumsum(entering, axis=axis, dtype=kind)
        if axis == 1:
            sums = total[:, m - 1 :].copy()
            sums[:, 1:] -= total[:, : length - 1]
        else:
            sums = total[m - 1 :].copy()
            sums[1:] -= total[: length - 1]
    if np.issubdtype(kind, np.integer):
        return ((sums + m * m // 2) // (m * m)).astype(raw.dtype)
    return sums / kind(m * m)


def shifted_by_interpolation(raw: Image, m: int, shift: int, order: int) -> Floats:
    """Mean of the sub-aperture images, each shifted between its samples by a spline."""
    images, c = views(raw, m).astype(np.float64), (m - 1) / 2
    total = np.zeros(images.shape[2:])
    for v in range(m):
        for u in range(m):
            move = (shift / m * (v - c), shift / m * (u - c))
            total += ndimage.shift(images[v, u], move, order=order, mode="constant")
    return total / (m * m)


def software() -> list[Method]:
    def fast(raw: Image, m: int, shift: int, order: int = 0, sharpen: Sharpen = "off") -> Image:
        return refocus(raw, m, Fraction(shift, m), interpolation=order, sharpen=sharpen)

    def best(raw: Image, m: int, shift: int) -> Image:
        return best_picture(raw, m, Fraction(shift, m))

    names = {0: "nearest", 1: "linear", 3: "cubic"}
    methods = [Method("refocus", fast)]
    methods += [
        Method(f"refocus, {names[order]}", partial(fast, order=order), order=order)
        for order in (1, 3)
    ]
    methods += [
        Method(name, partial(fast, order=order, sharpen="auto"), order=None)
        for name, order in (("refocus, sharpened", 0), ("refocus, linear, sharpened", 1))
    ]
    methods.append(Method("best picture", best, order=None))
    methods += [
        Method("reference (gather)", in_hardware(ExactArithmetic())),
        Method("plain loops for Numba", plain_numba),
        Method("NumPy, separable int32", partial(running_sums, kind=np.int32)),
        Method("running sums, float32", partial(running_sums, kind=np.float32)),
        Method("running sums, float64", partial(running_sums, kind=np.float64)),
        Method("shift and sum, float32", partial(shift_and_sum, kind=np.float32)),
        Method("shift and sum, float64", partial(shift_and_sum, kind=np.float64)),
    ]
    methods += [
        Method(
            f"shift and sum, {name}",
            partial(shifted_by_interpolation, order=order),
            lenses=True,
            order=None,
        )
        for order, name in names.items()
    ]
    for width, oversampling in ((1.5, 2.0), (2.5, 2.0), (3.5, 1.25), (3.5, 2.0), (6.0, 2.0)):

        def slice_(
            raw: Image, m: int, shift: int, w: float = width, o: float = oversampling
        ) -> Any:
            return fourier_slice(raw, m, shift / m, width=w, oversampling=o)

        name = f"Fourier slice, window {width:g}, oversampling {oversampling:g}"
        methods.append(Method(name, slice_, lenses=True, order=None))
    return methods


def in_hardware(arithmetic: ExactArithmetic | StoredProductArithmetic) -> Work:
    """The core's arithmetic as a way to refocus."""
    return lambda raw, m, shift: arithmetic.refocus(raw, m, shift=shift)


def hardware() -> list[Method]:
    """The core's arithmetic, bit-true: exact, and stored products with F and G bits."""
    methods = [Method("core, exact", in_hardware(ExactArithmetic()), hardware=ExactArithmetic())]
    for fraction in range(11):
        for guard in range(min(fraction, 4) + 1):
            arithmetic = StoredProductArithmetic(fraction_bits=fraction, guard_bits=guard)
            name = f"core, F = {fraction}, G = {guard}"
            methods.append(Method(name, in_hardware(arithmetic), hardware=arithmetic))
    return methods
