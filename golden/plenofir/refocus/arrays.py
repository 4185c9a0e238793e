# SPDX-License-Identifier: Apache-2.0
"""The refocuser for arrays of other libraries: CuPy, PyTorch and others with the array API.

Arrays of CuPy and PyTorch on NVIDIA's GPUs are refocused by `plenofir.refocus.gpu`. Everywhere
else, and where that cannot run, functions of the array API standard do the work, so that arrays
stay where they are. Their method is that of `plenofir.refocus.operator.moving_sums`, all in
integers.
"""

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import lru_cache
from math import prod
from typing import Any, NamedTuple, cast

import numpy as np
from array_api_compat import device, is_cupy_array, is_torch_array

from plenofir.ground import compiling
from plenofir.ground.errors import InputError
from plenofir.refocus.border import arrived
from plenofir.refocus.gpu.frames import reason
from plenofir.refocus.operator import Image, Sums
from plenofir.refocus.settings import library_of
from plenofir.refocus.sharpness import DepthIndex, LazySlices, Search, depth_index
from plenofir.refocus.slices import Slice


def device_stack(raw: Any, slices: Sequence[Slice], shape: tuple[int, ...], out: Any = None) -> Any:
    """Refocus an array of any library to slices of one region, arguments checked by the caller.

    `shape`: of the result, in which slices follow each other. `out`: array of the library to write
    the result to. Raises `InputError` if it is none.
    """
    xp = library_of(raw)
    if out is not None:
        _check_out(out, raw, shape)
    if 0 in shape:
        return xp.zeros(shape, dtype=raw.dtype, device=device(raw))
    result = _on_gpu(xp, raw, lambda gpu: _refocused(xp, gpu, raw, slices, shape, out))
    if result is None:
        pictures = [_by_library(xp, raw, slice_) for slice_ in slices]
        result = xp.reshape(pictures[0] if len(slices) == 1 else xp.stack(pictures), shape)
    if out is None or result is out:
        return result
    try:
        out[...] = result
    except Exception as error:  # of the library, by its own classes
        raise InputError(f"cannot be written to ({reason(error)})", where="out") from error
    return out


def _check_out(out: Any, raw: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array that the result cannot be written to."""
    fits = type(out) is type(raw) and tuple(out.shape) == shape and out.dtype == raw.dtype
    # `device` takes longer; libraries whose arrays have no such property write to none.
    if not (fits and getattr(out, "device", None) == getattr(raw, "device", None)):
        raise InputError(
            f"must be an array of the library, device and type of raw, of shape {shape}",
            where="out",
        )


def _weights(slice_: Slice) -> list[Any]:
    """Sums of weights for all outputs of a column, and of a line."""
    m, step = slice_.micro_image_size, slice_.step
    return [
        arrived(length, m, slice_.shift, slice_.order, slice_.align, slice_.box)[::step]
        for length in slice_.shape[:2]
    ]


def _by_library(xp: Any, raw: Any, slice_: Slice) -> Any:
    """The picture by the library's operations, shape (rows, columns, channels) of the region."""
    filter_, region = slice_.taps, slice_.region
    # Sharpening needs one more lens on each side.
    lens = slice_.lens
    read = [
        range(max(0, part.start - lens), min(length, part.stop + lens))
        for part, length in zip(region, raw.shape, strict=False)
    ]
    x = xp.astype(xp.reshape(raw, (raw.shape[0], raw.shape[1], -1)), xp.int64)
    for axis in (1, 0):
        x = _sums(xp, x, slice_, axis, read[axis] if lens else region[axis])
    weights = _weights(slice_) if slice_.normalise else []
    for axis, part in enumerate(region if lens else ()):
        here = np.arange(part.start, part.stop)
        complete = weights[axis] == slice_.full if weights else np.ones(raw.shape[axis], bool)
        around: Any = 0
        for k in (here - lens, here + lens):
            there = (k >= 0) & (k < complete.size)
            there &= complete[here] & complete[np.where(there, k, 0)]
            around = around + _at(xp, x, np.where(there, k, here) - read[axis].start, axis)
        x = filter_.centre * _at(xp, x, here - read[axis].start, axis) - filter_.side * around
    divisor: Any = slice_.divisor * filter_.scale**2
    if weights:
        down, across = (
            weight[part.start : part.stop] for weight, part in zip(weights, region, strict=True)
        )
        outer = np.outer(down, across)[:, :, None] * filter_.scale**2
        x = x * _put(xp, x, outer > 0)
        divisor = _put(xp, x, np.maximum(outer, 1))
    return xp.astype(xp.clip((x + divisor // 2) // divisor, 0, slice_.white), raw.dtype)


def _put(xp: Any, beside: Any, numbers: Any) -> Any:
    """Integers of NumPy as an array beside another one."""
    return xp.asarray(np.asarray(numbers, np.int64), dtype=xp.int64, device=device(beside))


def _at(xp: Any, x: Any, places: Any, axis: int) -> Any:
    return xp.take(x, _put(xp, x, places), axis=axis)


def _sums(xp: Any, x: Any, slice_: Slice, axis: int, outputs: range) -> Any:
    """Sums of a dimension for neighbouring outputs, with moving sums for the interpolation."""
    first, further = slice_.passes(outputs, x.shape[axis])
    x = _first_sums(xp, x, slice_, axis, first)
    for indices in further:
        x = _moving_sum(xp, x, slice_.box, axis, indices)
    return x


def _first_sums(xp: Any, x: Any, slice_: Slice, axis: int, newest: range) -> Any:
    """Sums over the box up to equally spaced places of the re-ordered line."""
    m, shift, box = slice_.micro_image_size, slice_.shift, slice_.box
    start, stop, length = newest[0] - box + 1, newest[-1] + 1, x.shape[axis]
    p = np.arange(start, stop)
    entering = None
    for u in range(m):
        # y[p] is the sum of the pixels with M j + u a' = p.
        source = p - u * (shift - 1)
        there = ((p - u * shift) % m == 0) & (source >= 0) & (source < length)
        if not there.any():
            continue
        mask = _put(xp, x, there)
        part = _at(xp, x, np.where(there, source, 0), axis)
        part = part * xp.reshape(mask, (-1, 1, 1) if axis == 0 else (1, -1, 1))
        entering = part if entering is None else entering + part
    if entering is None:
        shape_out = [len(newest) if n == axis else size for n, size in enumerate(x.shape)]
        return xp.zeros(tuple(shape_out), dtype=xp.int64, device=device(x))
    return _moving_sum(xp, entering, box, axis, range(box - 1, stop - start, newest.step))


def _moving_sum(xp: Any, x: Any, box: int, axis: int, newest: range) -> Any:
    """Sums of the box of pixels up to each newest one; 0 outside of x."""
    length = x.shape[axis]
    total = xp.cumulative_sum(x, axis=axis, dtype=xp.int64, include_initial=True)
    last = np.asarray(newest) + 1
    return _at(xp, total, np.clip(last, 0, length), axis) - _at(
        xp, total, np.clip(last - box, 0, length), axis
    )


class _Gpu(NamedTuple):
    """An NVIDIA GPU that holds an array."""

    number: int
    active: AbstractContextManager[Any]  # makes it the library's current device
    stream: Callable[[], int]  # the library's stream there


def _gpu_of(xp: Any, array: Any) -> _Gpu | None:
    """The GPU of an array of CuPy or PyTorch; None for other arrays."""
    if is_cupy_array(array):
        return _Gpu(array.device.id, array.device, lambda: int(xp.cuda.get_current_stream().ptr))
    if is_torch_array(array) and array.is_cuda:
        return _Gpu(
            array.device.index,
            xp.cuda.device(array.device),
            lambda: int(xp.cuda.current_stream(array.device).cuda_stream),
        )
    return None


def _on_gpu(xp: Any, raw: Any, work: Callable[[_Gpu], Any]) -> Any | None:
    """What `work` makes on the NVIDIA GPU that holds an array.

    Result: None where there is no such GPU, or its own code cannot run.

    The GPU's code depends on NVIDIA's libraries, driver and card, which fail in ways that no list
    has, and the library's operations give an equal picture; so every failure is told, once.
    """
    gpu = _gpu_of(xp, raw)
    if gpu is None:
        return None
    try:
        with gpu.active:
            return work(gpu)
    except Exception as failure:
        compiling.hindered(
            "gpu", f"the library's own operations refocus, which takes longer ({reason(failure)})"
        )
        return None


def _refocused(
    xp: Any, gpu: _Gpu, raw: Any, slices: Sequence[Slice], shape: tuple[int, ...], out: Any
) -> Any | None:
    """The slices from a GPU, in `out` itself where the GPU can write there at once."""
    from plenofir.refocus.gpu.program import Tiles, run_tiles

    pixels = _contiguous(xp, raw)
    picture, there = out, _address(pixels)
    written = out is not None and _contiguous(xp, out) is out
    if written:
        # The kernel reads what others of its threads write where the arrays overlap.
        apart, size = _address(out) - there, slices[0].pixel_bits // 8
        written = apart >= size * prod(raw.shape) or -apart >= size * prod(shape)
    if not written:
        picture = xp.empty(shape, dtype=raw.dtype, device=device(raw))
    reached = _reached(xp, raw, slices)
    at = Tiles(there, _address(picture), *map(_address, reached))
    return picture if run_tiles(slices, at, gpu.stream(), gpu.number) else None


def _to_host(array: Any) -> Image:
    """An array of any library in the host's memory."""
    copied = getattr(array, "get", None) or getattr(array, "cpu", None)
    return np.asarray(copied() if copied else array)


def device_depth(raw: Any, slices: Sequence[Slice], search: Search) -> DepthIndex:
    """The sharpest slice of each lens and the picture in focus, arguments checked by the caller.

    Fields are arrays of the library, on the device of `raw`.
    """
    xp = library_of(raw)
    result = _on_gpu(xp, raw, lambda gpu: _depth_on_gpu(xp, gpu, raw, slices, search))
    if result is not None:
        return cast("DepthIndex", result)

    def picture_of(slice_: Slice) -> Image:
        return _to_host(device_stack(raw, [slice_], slice_.result_shape))

    m = slices[0].micro_image_size
    by_cpu = depth_index(LazySlices(slices, picture_of), m, **search._asdict())
    fields = ((field.name, getattr(by_cpu, field.name)) for field in dataclasses.fields(by_cpu))
    arrays: dict[str, Any] = {
        name: None if array is None else xp.asarray(array, device=device(raw))
        for name, array in fields
    }
    return DepthIndex(**arrays)


def _depth_on_gpu(
    xp: Any, gpu: _Gpu, raw: Any, slices: Sequence[Slice], search: Search
) -> DepthIndex | None:
    """The same from a GPU: slices are made twice, for their lenses' luma and for the picture."""
    from plenofir.refocus.gpu.program import Depth, Tiles, run_depth, run_tiles

    def new(kind: Any, *shape: int, needed: bool = True) -> Any:
        return xp.empty(shape, dtype=kind, device=device(raw)) if needed else None

    def at(array: Any) -> int:
        return 0 if array is None else _address(array)

    m = slices[0].micro_image_size
    lenses = [-(-length // m) for length in raw.shape[:2]]
    pixels, picture = _contiguous(xp, raw), new(raw.dtype, *raw.shape)
    sums = xp.zeros((len(slices), *lenses), dtype=xp.int64, device=device(raw))
    best, textured = new(xp.uint8, *lenses), new(xp.bool, *lenses)
    fraction, confidence = (new(xp.uint8, *lenses, needed=bool(search.shifts)) for _ in "fc")
    voted = new(xp.int16, *lenses, needed=search.vote_radius > 0)
    filled = best if voted is None else new(xp.uint8, *lenses)
    reached = _reached(xp, raw, slices)
    tiles = Tiles(at(pixels), at(picture), *map(_address, reached))
    queue = gpu.stream(), gpu.number
    if not run_tiles(slices, tiles._replace(lens_sums=at(sums)), *queue):
        return None
    each = sums, best, textured, fraction, confidence, voted, filled
    run_depth(slices, search, Depth(*map(at, each)), *queue)
    run_tiles(slices, tiles._replace(sharpest=at(filled)), *queue)
    return DepthIndex(filled, picture, textured, fraction, confidence)


def _reached(xp: Any, raw: Any, slices: Sequence[Slice]) -> list[Any]:
    """Weights of all outputs of a column, and of a line, for each slice; none without a need."""
    if not slices[0].normalise:
        return []
    return [xp.asarray(each, device=device(raw)) for each in _stacked(tuple(slices))]


@lru_cache(16)
def _stacked(slices: tuple[Slice, ...]) -> list[Sums]:
    """`_weights` of slices, each shape (slices, outputs)."""
    return [np.stack(each) for each in zip(*map(_weights, slices), strict=True)]


def _contiguous(xp: Any, array: Any) -> Any:
    """The array itself if it is contiguous, otherwise a copy."""
    if is_torch_array(array):
        return array.contiguous()
    return array if array.flags.c_contiguous else xp.ascontiguousarray(array)


def _address(array: Any) -> int:
    return int(array.data_ptr() if is_torch_array(array) else array.data.ptr)
