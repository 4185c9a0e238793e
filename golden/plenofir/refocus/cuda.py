# SPDX-License-Identifier: Apache-2.0
"""The refocuser as one fused kernel for NVIDIA's GPUs: tiles in shared memory.

The kernel is compiled by numba and works on any array with ``__cuda_array_interface__``: CuPy's and
PyTorch's. Each block of threads first runs down the columns of its tile, one thread a column, and
keeps the sums in shared memory; then it runs along the lines, a few pixels each thread, divides and
writes. Sums are the moving sums of `plenofir.refocus.operator`, in 32 bits.
"""

from functools import cache
from math import gcd
from typing import Any

import numpy as np
from numba import cuda as numba_cuda
from numba import int32

from plenofir.refocus.division import division
from plenofir.refocus.operator import output_offset

# numba has types for it on the host only.
cuda: Any = numba_cuda

THREADS = 256
TILE_ROWS, TILE_COLUMNS = 32, 128
SEGMENT = 16
"""Pixels of a line that a thread sums; the first of them costs M additions, the others two."""
_SHARED_BYTES = 48 * 1024


def _refocus_tile(
    x: Any,
    out: Any,
    m: int,
    shift: int,
    common: int,
    channels: int,
    row_base: int,
    column_base: int,
    tile_rows: int,
    width: int,
    half: int,
    multiplier: int,
    drop: int,
) -> None:
    sums = cuda.shared.array(0, int32)
    rows, columns = x.shape[0], x.shape[1] // channels
    out_rows, out_columns = out.shape[0], out.shape[1] // channels
    channel = cuda.blockIdx.z
    row0, column0 = cuda.blockIdx.y * tile_rows, cuda.blockIdx.x * TILE_COLUMNS
    thread, threads = cuda.threadIdx.x, cuda.blockDim.x
    stride = m // common
    # For each p mod M the first pixel u with u a' = p modulo M; M if there is none.
    first = tile_rows * width
    for phase in range(thread, m, threads):
        sums[first + phase] = m
    cuda.syncthreads()
    for v in range(thread, stride, threads):
        sums[first + v * shift % m] = v
    cuda.syncthreads()
    # First of the `width` columns that the tile reads.
    origin = column0 + column_base - m + min(0, -(m - 1) * (shift - 1))
    for k in range(thread, width, threads):
        column = origin + k
        there = 0 <= column < columns
        place = column * channels + channel
        total = np.int64(0)
        p = row0 + row_base
        for v in range(m if there else 0):
            row = m * ((p - v * shift) // m) + v
            if 0 <= row < rows:
                total += np.int64(x[row, place])
        sums[k] = total
        for r in range(1, tile_rows):
            p += 1
            u = np.int64(sums[first + p % m]) if there else np.int64(m)
            while u < m:
                row = p - u * (shift - 1)
                if 0 <= row < rows:
                    total += np.int64(x[row, place])
                if 0 <= row - m < rows:
                    total -= np.int64(x[row - m, place])
                u += stride
            sums[r * width + k] = total
    cuda.syncthreads()
    segments = TILE_COLUMNS // SEGMENT
    for part in range(thread, tile_rows * segments, threads):
        r = part // segments
        row, column = row0 + r, column0 + part % segments * SEGMENT
        if row < out_rows:
            line = r * width - origin
            p = column + column_base
            total = np.int64(0)
            for v in range(m):
                total += np.int64(sums[line + m * ((p - v * shift) // m) + v])
            for k in range(column, min(column + SEGMENT, out_columns)):
                if k > column:
                    p += 1
                    u = np.int64(sums[first + p % m])
                    while u < m:
                        enters = line + p - u * (shift - 1)
                        total += np.int64(sums[enters]) - np.int64(sums[enters - m])
                        u += stride
                out[row, k * channels + channel] = ((total + half) * multiplier) >> drop


@cache
def _kernel() -> Any:
    return cuda.jit(_refocus_tile)


def fits(m: int, shift: int, pixel_bits: int) -> bool:
    """Whether the kernel can do it: sums in 31 bits, a line of a tile in shared memory."""
    largest = m * m * ((1 << pixel_bits) - 1)
    return largest + m * m // 2 < 1 << 31 and _tile(m, shift)[0] >= 1


def _tile(m: int, shift: int) -> tuple[int, int]:
    """Rows of a tile, and columns that it takes."""
    width = TILE_COLUMNS + m + (m - 1) * abs(shift - 1)
    return min(TILE_ROWS, (_SHARED_BYTES - 4 * m) // (4 * width)), width


def cuda_refocus(
    raw: Any,
    out: Any,
    m: int,
    shift: int,
    pixel_bits: int,
    region: tuple[range, range],
    stream: int,
) -> None:
    """Refocus an image on a GPU, arguments checked by the caller; see `fits`."""
    tile_rows, width = _tile(m, shift)
    divisor = m * m
    chosen = division(divisor, (1 << pixel_bits) - 1)
    columns = len(region[1])
    channels = out.shape[1] // columns
    offset = output_offset(m, shift, "centred")
    grid = (-(-columns // TILE_COLUMNS), -(-len(region[0]) // tile_rows), channels)
    queue = cuda.external_stream(stream) if stream else 0
    _kernel()[grid, THREADS, queue, 4 * (tile_rows * width + m)](
        raw,
        out,
        m,
        shift,
        gcd(shift, m),
        channels,
        region[0].start + offset,
        region[1].start + offset,
        tile_rows,
        width,
        chosen.half,
        chosen.multiplier,
        chosen.drop,
    )
