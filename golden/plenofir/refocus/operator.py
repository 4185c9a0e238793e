# SPDX-License-Identifier: Apache-2.0
"""The refocusing operator in exact integers, in four equal forms.

The sums of one dimension (Eq. 6.1 of the thesis) are

    S[k'] = sum over input pixels k and n = 0..M-1 with k' = k + n + (k mod M)(a' - 1)

and the refocused image is S of the rows, then of the columns, divided by M^2. Outside the image the
light field is zero.

The M values of n are a box, one lens wide. A box of B < M samples, n = 0..B-1, averages B of the
views at each output, so the picture is blurred over B pixels only; it is divided by B^2. Views meet
in groups of g = gcd(a', M), so B is a multiple of g. B = |a'| shows the pictures of a focused
plenoptic camera.

`gather_sums` is the reference. The others are compared with it; each corresponds to a hardware
architecture.
"""

from fractions import Fraction
from math import gcd

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.images import Image as Image
from plenofir.refocus.checks import Align as Align
from plenofir.refocus.checks import check_align, whole_number

Sums = npt.NDArray[np.int64]

# Roundings need the other two of 63.
_SUM_BITS = 61


def output_offset(micro_image_size: int, shift: int, align: Align, box: int | None = None) -> int:
    """Index of S that output pixel 0 takes.

    `align`: "centred" keeps the picture in place while focus is stepped: floor((M-1) a' / 2), by
    which the middle replica of a micro image's central pixel moves, less the floor((M-B) / 2)
    replicas that a smaller box lacks in front of it. "causal" takes S unshifted: 0. `box`: samples
    B of the box, M if None. Result: offset in pixels.
    """
    check_align(align)
    if align == "causal":
        return 0
    lacking = micro_image_size - (micro_image_size if box is None else box)
    return (micro_image_size - 1) * shift // 2 - lacking // 2


def box_size(micro_image_size: int, shift: int, box: int | None) -> int:
    """Samples of a box along a dimension: B, or M for None.

    Raises `InputError` unless B is 1 to M and a multiple of gcd(a', M).
    """
    m, common = micro_image_size, gcd(shift, micro_image_size)
    if box is None:
        return m
    size = whole_number(box, "box", 1)
    if size > m:
        raise InputError(f"must be {m} samples or fewer for M = {m}, not {size}", where="box")
    if size % common:
        raise InputError(
            f"must be a multiple of gcd(a M, M) = {common} for a = {Fraction(shift, m)} and "
            f"M = {m}, because views meet in groups of {common}; not {size}",
            where="box",
        )
    return size


def least_box(micro_image_size: int, shift: int, box: int | None) -> int:
    """The smallest box of B samples or more that a slice can have; B is M for None.

    Raises `InputError` unless B is 1 to M.
    """
    size = box_size(micro_image_size, 1, box)
    common = gcd(shift, micro_image_size)
    return -(-size // common) * common


def clamped_shift(micro_image_size: int, shift: int, shape: tuple[int, ...]) -> int:
    """A shift with the same sums whose size is bounded by the picture's.

    For larger shifts all views except the one that stays in place have left the picture. Where the
    box has fewer than M samples, that view shows at some outputs only; which ones, depends on the
    rest of the shift modulo M, so this stays.
    """
    # Views move by a' (u - c) pixels; for even M the middle ones by half of a'.
    reach = max(shape[:2]) + micro_image_size
    limit = micro_image_size * -(-reach * (1 + (micro_image_size + 1) % 2) // micro_image_size)
    if abs(shift) <= limit:
        return shift
    return limit + shift % micro_image_size if shift > 0 else -limit - -shift % micro_image_size


def gather_sums(
    samples: Image,
    micro_image_size: int,
    shift: int,
    *,
    axis: int,
    offset: int = 0,
    box: int | None = None,
) -> Sums:
    """Sums of one dimension, written from the output's side: the reference.

    S[k'] = sum over u = 0..M-1 of x[M floor((k' - u a') / M) + u], of those u whose
    n = (k' - u a') mod M lies in the box

    `samples`: image or sums, any shape. `axis`: axis to sum along. `offset`: index of S that output
    0 takes. `box`: samples B of the box, M if None. Result: S[offset] ... S[offset + K - 1] along
    the axis, shape of `samples`.
    """
    size = box_size(micro_image_size, shift, box)
    x = np.moveaxis(np.asarray(samples, dtype=np.int64), axis, 0)
    length = x.shape[0]
    k_out = np.arange(length) + offset
    sums = np.zeros_like(x)
    for u in range(micro_image_size):
        lens, n = np.divmod(k_out - u * shift, micro_image_size)
        k_in = micro_image_size * lens + u
        inside = (k_in >= 0) & (k_in < length) & (n < size)
        sums[inside] += x[k_in[inside]]
    return np.moveaxis(sums, 0, axis)


def scatter_sums(
    samples: Image,
    micro_image_size: int,
    shift: int,
    *,
    axis: int,
    offset: int = 0,
    box: int | None = None,
) -> Sums:
    """Sums of one dimension as Eq. (6.1) states them: each pixel adds to the outputs of its box.

    Parameters and result as `gather_sums`.
    """
    size = box_size(micro_image_size, shift, box)
    x = np.moveaxis(np.asarray(samples, dtype=np.int64), axis, 0)
    length = x.shape[0]
    sums = np.zeros_like(x)
    for k in range(length):
        for n in range(size):
            k_out = k + n + (k % micro_image_size) * (shift - 1) - offset
            if 0 <= k_out < length:
                sums[k_out] += x[k]
    return np.moveaxis(sums, 0, axis)


def moving_sums(
    samples: Image,
    micro_image_size: int,
    shift: int,
    *,
    axis: int,
    offset: int = 0,
    box: int | None = None,
) -> Sums:
    """Sums of one dimension as a re-ordering followed by a moving sum.

    y[k + u (a' - 1)] += x[k], u = k mod M; S = y convolved with the box. The cost for each output
    depends on none of M, a' and B.

    Parameters and result as `gather_sums`.
    """
    size = box_size(micro_image_size, shift, box)
    x = np.moveaxis(np.asarray(samples, dtype=np.int64), axis, 0)
    length = x.shape[0]
    k_in = np.arange(length)
    target = k_in + (k_in % micro_image_size) * (shift - 1)
    # y is kept from index `start` on, wide enough for the outputs' boxes and all targets.
    start = min(int(target.min()), offset) - micro_image_size
    stop = max(int(target.max()), offset + length) + 1
    y = np.zeros((stop - start, *x.shape[1:]), dtype=np.int64)
    np.add.at(y, target - start, x)
    running = np.cumsum(y, axis=0)
    newest = k_in + offset - start
    return np.moveaxis(running[newest] - running[newest - size], 0, axis)


def interpolated_sums(
    samples: Image,
    micro_image_size: int,
    shift: int,
    *,
    axis: int,
    align: Align = "centred",
    order: int = 0,
    box: int | None = None,
) -> Sums:
    """Sums of one dimension with interpolation of whole micro images.

    The operator with a', then ``order`` times the operator with a' = 1, a moving sum over B
    pixels: the kernel is a box for order 0 (nearest neighbour), a triangle for order 1 (linear),
    a B-spline of the order in general. Each of them works on an image of the input's size.

    `samples`: image or sums, any shape. `axis`: axis to sum along. `box`: samples B of the box, M
    if None. Result: B^order times the interpolated sums, shape of `samples`.
    """
    sums: Sums = np.asarray(samples, dtype=np.int64)
    for pass_shift in (shift, *[1] * order):
        offset = output_offset(micro_image_size, pass_shift, align, box)
        sums = gather_sums(sums, micro_image_size, pass_shift, axis=axis, offset=offset, box=box)
    return sums


def check_sums(largest: int) -> None:
    """Refuse sums that could wrap around in 64 bits, roundings included."""
    if largest.bit_length() > _SUM_BITS:
        raise InputError(
            f"this M and interpolation need sums of {largest.bit_length()} bits, "
            f"more than {_SUM_BITS}; use a smaller M or a lower order"
        )


def refocus_sums(
    raw: Image,
    micro_image_size: int,
    *,
    shift: int,
    align: Align = "centred",
    order: int = 0,
    box: int | None = None,
) -> Sums:
    """Sums of both dimensions, rows first: B^(2 + 2 order) times the refocused image.

    `raw`: raw image, shape (rows, columns) or (rows, columns, channels). `box`: samples B of the
    box, M if None. Result: S2, shape of `raw`.
    """
    m = micro_image_size
    box = box_size(m, shift, box)
    shift = clamped_shift(m, shift, raw.shape)
    rows = interpolated_sums(raw, m, shift, axis=1, align=align, order=order, box=box)
    return interpolated_sums(rows, m, shift, axis=0, align=align, order=order, box=box)


def divide_half_up(numerator: Sums, divisor: int | Sums) -> Sums:
    """Divide and round to the nearest integer, halves up."""
    return (2 * numerator + divisor) // (2 * divisor)
