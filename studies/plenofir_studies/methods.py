# SPDX-License-Identifier: Apache-2.0
"""Ways to refocus a raw image, to compare with each other.

All take a grey raw image, M and a', and return the refocused image in grey levels, in the raw
image's size or with a value for each micro lens.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import ndimage

from plenofir.camera.lightfield.fourier import fourier_slice
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
    """The method of `refocus` as plain loops for Numba, vectorised only by its compiler."""
    out = np.empty_like(raw)
    offset = output_offset(m, shift, "centred")
    # Which pixels of a micro image have u a' = p modulo M, for each p.
    phases = np.array([[int(u * shift % m == p) for u in range(m)] for p in range(m)])
    _plain_loops(raw, out, m, shift, offset, phases)
    return out


_LINES = 32


@njit(nogil=True)
def _plain_loops(raw: Any, out: Any, m: int, shift: int, offset: int, phases: Any) -> None:
    rows, columns = raw.shape
    half = np.uint32(m * m // 2)
    # 2^32 over M^2, rounded up: exact for sums of 8 bit pixels and M of up to 60.
    scale = np.uint64((1 << 32) // (m * m) + 1)
    sums = np.zeros(columns, np.uint32)
    # A number of lines side by side, so that sums along them are vectors.
    words = np.zeros((columns + 3 * m, _LINES), np.uint32)
    total, values = np.zeros(_LINES, np.uint32), np.zeros((columns, _LINES), np.uint8)
    places, ends = np.empty(2 * columns + 2 * m, np.int64), np.zeros(columns + 1, np.int64)
    n = 0
    for p in range(offset + 1, offset + columns):
        for u in range(m):
            k = p - u * (shift - 1)
            if phases[p % m, u] and 0 <= k < columns + m:
                places[n] = m + k
                n += 1
        ends[p - offset] = n
    for top in range(0, rows, _LINES):
        count = min(_LINES, rows - top)
        for j in range(count):
            r = top + j
            for u in range(m):
                k = r + offset - u * (shift - 1)
                if r == 0:
                    k = m * ((offset - u * shift) // m) + u
                    if 0 <= k < rows:
                        sums += raw[k]
                elif phases[(r + offset) % m, u]:
                    if 0 <= k < rows:
                        sums += raw[k]
                    if 0 <= k - m < rows:
                        sums -= raw[k - m]
            for c in range(columns):
                words[m + c, j] = sums[c]
        total[:] = 0
        for u in range(m):
            k = m * ((offset - u * shift) // m) + u
            if 0 <= k < columns:
                total += words[m + k]
        for c in range(columns):
            for i in range(ends[c - 1] if c else 0, ends[c]):
                enters, leaves = words[places[i]], words[places[i] - m]
                for j in range(_LINES):
                    total[j] += enters[j] - leaves[j]
            value = values[c]
            for j in range(_LINES):
                value[j] = (np.uint64(total[j] + half) * scale) >> np.uint64(32)
        for j in range(count):
            for c in range(columns):
                out[top + j, c] = values[c, j]


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
