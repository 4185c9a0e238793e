# SPDX-License-Identifier: Apache-2.0
"""The refocusing operator in exact integers, in four equal forms.

The sums of one dimension (Eq. 6.1 of the thesis) are

    S[k'] = sum over input pixels k and n = 0..M-1 with k' = k + n + (k mod M)(a' - 1)

and the refocused image is S of the rows, then of the columns, divided by M^2. Outside the image the
light field is zero.

`gather_sums` is the reference. The others are compared with it; each corresponds to a hardware
architecture.
"""

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.images import Image as Image
from plenofir.refocus.checks import Align as Align
from plenofir.refocus.checks import check_align

Sums = npt.NDArray[np.int64]

_SUM_BITS = 61


def output_offset(micro_image_size: int, shift: int, align: Align) -> int:
    """Index of S that output pixel 0 takes.

    `align`: "centred" keeps the picture in place while focus is stepped: floor((M-1) a' / 2), by
    which the middle replica of a micro image's central pixel moves. "causal" takes S unshifted: 0.
    Result: offset in pixels.
    """
    check_align(align)
    return (micro_image_size - 1) * shift // 2 if align == "centred" else 0


def clamped_shift(micro_image_size: int, shift: int, shape: tuple[int, ...]) -> int:
    """A shift with the same sums whose size is bounded by the picture's: itself or a multiple of M.

    For larger shifts all views except the one that stays in place have left the picture.
    """
    # Views move by a' (u - c) pixels; for even M the middle ones by half of a'.
    reach = max(shape[:2]) + micro_image_size
    limit = micro_image_size * -(-reach * (1 + (micro_image_size + 1) % 2) // micro_image_size)
    return max(-limit, min(shift, limit))


def gather_sums(
    samples: Image, micro_image_size: int, shift: int, *, axis: int, offset: int = 0
) -> Sums:
    """Sums of one dimension, written from the output's side: the reference.

    S[k'] = sum over u = 0..M-1 of x[M floor((k' - u a') / M) + u]

    `samples`: image or sums, any shape. `axis`: axis to sum along. `offset`: index of S that output
    0 takes. Result: S[offset] ... S[offset + K - 1] along the axis, shape of `samples`.
    """
    x = np.moveaxis(np.asarray(samples, dtype=np.int64), axis, 0)
    length = x.shape[0]
    k_out = np.arange(length) + offset
    sums = np.zeros_like(x)
    for u in range(micro_image_size):
        k_in = micro_image_size * ((k_out - u * shift) // micro_image_size) + u
        inside = (k_in >= 0) & (k_in < length)
        sums[inside] += x[k_in[inside]]
    return np.moveaxis(sums, 0, axis)


def scatter_sums(
    samples: Image, micro_image_size: int, shift: int, *, axis: int, offset: int = 0
) -> Sums:
    """Sums of one dimension as Eq. (6.1) states them: each pixel adds to M outputs.

    Parameters and result as `gather_sums`.
    """
    x = np.moveaxis(np.asarray(samples, dtype=np.int64), axis, 0)
    length = x.shape[0]
    sums = np.zeros_like(x)
    for k in range(length):
        for n in range(micro_image_size):
            k_out = k + n + (k % micro_image_size) * (shift - 1) - offset
            if 0 <= k_out < length:
                sums[k_out] += x[k]
    return np.moveaxis(sums, 0, axis)


def moving_sums(
    samples: Image, micro_image_size: int, shift: int, *, axis: int, offset: int = 0
) -> Sums:
    """Sums of one dimension as a re-ordering followed by a moving sum.

    y[k + u (a' - 1)] += x[k], u = k mod M; S = y convolved with a box of length M. The cost for
    each output depends on neither M nor a'.

    Parameters and result as `gather_sums`.
    """
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
    k_out = k_in + offset - start
    return np.moveaxis(running[k_out] - running[k_out - micro_image_size], 0, axis)


def interpolated_sums(
    samples: Image,
    micro_image_size: int,
    shift: int,
    *,
    axis: int,
    align: Align = "centred",
    order: int = 0,
) -> Sums:
    """Sums of one dimension with interpolation of whole micro images.

    The operator with a', then ``order`` times the operator with a' = 1, a moving sum over M
    pixels: the kernel is a box for order 0 (nearest neighbour), a triangle for order 1 (linear),
    a B-spline of the order in general. Each of them works on an image of the input's size.

    `samples`: image or sums, any shape. `axis`: axis to sum along. Result: M^order times the
    interpolated sums, shape of `samples`.
    """
    sums: Sums = np.asarray(samples, dtype=np.int64)
    for pass_shift in (shift, *[1] * order):
        offset = output_offset(micro_image_size, pass_shift, align)
        sums = gather_sums(sums, micro_image_size, pass_shift, axis=axis, offset=offset)
    return sums


def check_sums(largest: int) -> None:
    """Refuse sums that could wrap around in 64 bits, roundings included."""
    if largest.bit_length() > _SUM_BITS:
        raise InputError(
            f"this M and interpolation need sums of {largest.bit_length()} bits, "
            f"more than {_SUM_BITS}; use a smaller M or a lower order"
        )


def refocus_sums(
    raw: Image, micro_image_size: int, *, shift: int, align: Align = "centred", order: int = 0
) -> Sums:
    """Sums of both dimensions, rows first: M^(2 + 2 order) times the refocused image.

    `raw`: raw image, shape (rows, columns) or (rows, columns, channels). Result: S2, shape of
    `raw`.
    """
    shift = clamped_shift(micro_image_size, shift, raw.shape)
    rows = interpolated_sums(raw, micro_image_size, shift, axis=1, align=align, order=order)
    return interpolated_sums(rows, micro_image_size, shift, axis=0, align=align, order=order)


def divide_half_up(numerator: Sums, divisor: int | Sums) -> Sums:
    """Divide and round to the nearest integer, halves up."""
    return (2 * numerator + divisor) // (2 * divisor)
