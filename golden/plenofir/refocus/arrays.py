# SPDX-License-Identifier: Apache-2.0
"""The refocuser for arrays of other libraries: CuPy, PyTorch and others with the array API.

Only functions of the array API standard are used, so that arrays stay where they are, on a GPU for
instance. The method is that of `plenofir.refocus.operator.moving_sums`, all in integers.
"""

from typing import Any

import numpy as np
from array_api_compat import array_namespace, device, is_cupy_array, is_torch_array

from plenofir.refocus.operator import output_offset
from plenofir.refocus.slices import Slice


def _sums(xp: Any, x: Any, m: int, shift: int, axis: int, outputs: range) -> Any:
    """S[k'] along an axis for equally spaced k'."""
    length = x.shape[axis]
    start, stop = outputs[0] - m + 1, outputs[-1] + 1
    p = np.arange(start, stop)
    entering = None
    for u in range(m):
        if not np.any((p - u * shift) % m == 0):
            continue
        # y[p] is the sum of the pixels with M j + u a' = p.
        source = p - u * (shift - 1)
        there = ((p - u * shift) % m == 0) & (source >= 0) & (source < length)
        if not there.any():
            continue
        index = xp.asarray(np.where(there, source, 0), dtype=xp.int64, device=device(x))
        part = xp.take(x, index, axis=axis)
        shape = (-1, 1, 1) if axis == 0 else (1, -1, 1)
        mask = xp.asarray(there.astype(np.int64), dtype=xp.int64, device=device(x))
        part = part * xp.reshape(mask, shape)
        entering = part if entering is None else entering + part
    if entering is None:
        shape_out = [len(outputs) if n == axis else size for n, size in enumerate(x.shape)]
        return xp.zeros(tuple(shape_out), dtype=xp.int64, device=device(x))
    return _moving_sum(xp, entering, m, axis, range(m - 1, stop - start, outputs.step))


def device_refocus(raw: Any, slice_: Slice) -> Any:
    """Refocus an array of any library, arguments checked by the caller."""
    xp = array_namespace(raw)
    m, units, region, filter_ = slice_.micro_image_size, slice_.units, slice_.region, slice_.taps
    shape = slice_.result_shape
    if 0 in shape:
        return xp.zeros(shape, dtype=raw.dtype, device=device(raw))
    fits = slice_.upsample and slice_.align == "centred" and m > 1
    if fits and units == 0 and slice_.order == 0:
        result = _fused(xp, raw, m, slice_.shift, slice_.pixel_bits, region)
        if result is not None:
            return result
    # Sharpening needs one more lens on each side.
    wider = region
    if units:
        wider = (_wider(region[0], m, raw.shape[0]), _wider(region[1], m, raw.shape[1]))
    x = _both_sums(xp, raw, slice_, wider)
    for axis in (0, 1) if units else ():
        pixels, first = np.arange(region[axis].start, region[axis].stop), wider[axis].start
        before, behind = (
            _at(xp, x, np.where((k >= 0) & (k < raw.shape[axis]), k, pixels) - first, axis)
            for k in (pixels - m, pixels + m)
        )
        middle = _at(xp, x, pixels - first, axis)
        x = filter_.centre * middle - filter_.side * (before + behind)
    divisor = slice_.divisor * filter_.scale**2
    result = xp.clip((x + divisor // 2) // divisor, 0, slice_.white)
    return xp.reshape(xp.astype(result, raw.dtype), shape)


def _wider(part: range, m: int, length: int) -> range:
    return range(max(0, part.start - m), min(length, part.stop + m))


def _at(xp: Any, x: Any, places: Any, axis: int) -> Any:
    return xp.take(x, xp.asarray(places, dtype=xp.int64, device=device(x)), axis=axis)


def _both_sums(xp: Any, raw: Any, slice_: Slice, region: tuple[range, range]) -> Any:
    """Sums of both dimensions, shape (rows, columns, channels) of the region."""
    x = xp.astype(xp.reshape(raw, (raw.shape[0], raw.shape[1], -1)), xp.int64)
    m, step = slice_.micro_image_size, slice_.step
    box = output_offset(m, 1, slice_.align)
    for axis in (1, 0):
        part, length = region[axis], raw.shape[axis]
        # Ranges that each of the interpolation's moving sums needs, the last one first.
        low, high = part.start * step, (part.stop - 1) * step + 1
        ranges = [(low, high)]
        for _ in range(slice_.order):
            low, high = max(0, low + box - m + 1), min(length, high + box)
            ranges.append((low, high))
        low, high = ranges.pop()
        offset = output_offset(m, slice_.shift, slice_.align)
        x = _sums(xp, x, m, slice_.shift, axis, range(low + offset, high + offset, step))
        for first, last in reversed(ranges):
            # Index 0 of x is output `low`; a' = 1 is the moving sum.
            x = _moving_sum(xp, x, m, axis, range(first + box - low, last + box - low))
            low = first
    return x


def _stream(raw: Any) -> int:
    """The CUDA stream of the array's library."""
    if is_torch_array(raw):
        import torch

        return int(torch.cuda.current_stream(raw.device).cuda_stream)
    import cupy

    return int(cupy.cuda.get_current_stream().ptr)


def _fused(
    xp: Any, raw: Any, m: int, shift: int, bits: int, region: tuple[range, range]
) -> Any | None:
    """Result of the fused kernel, or None where there is no NVIDIA GPU or it does not fit."""
    if not (is_cupy_array(raw) or (is_torch_array(raw) and raw.is_cuda)):
        return None
    try:
        from plenofir.refocus.cuda import cuda_refocus, fits
    except ImportError:
        return None
    if not fits(m, shift, bits):
        return None
    out = xp.empty(
        (len(region[0]), len(region[1]), *raw.shape[2:]), dtype=raw.dtype, device=device(raw)
    )
    # A copy if it is a view that is not contiguous.
    flat = xp.reshape(raw, (raw.shape[0], -1))
    flat = flat.contiguous() if is_torch_array(flat) else xp.asarray(flat, order="C")
    goal = xp.reshape(out, (out.shape[0], -1))
    cuda_refocus(flat, goal, m, shift, bits, region, _stream(raw))
    return out


def _moving_sum(xp: Any, x: Any, m: int, axis: int, outputs: range) -> Any:
    """Sums of the M pixels up to each output; 0 outside of x."""
    length = x.shape[axis]
    total = xp.cumulative_sum(x, axis=axis, dtype=xp.int64, include_initial=True)
    last = np.asarray(outputs) + 1

    def at(places: Any) -> Any:
        inside = np.clip(places, 0, length)
        return xp.take(total, xp.asarray(inside, dtype=xp.int64, device=device(x)), axis=axis)

    return at(last) - at(last - m)
