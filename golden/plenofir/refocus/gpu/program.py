# SPDX-License-Identifier: Apache-2.0
"""Code for stacks of slices on an NVIDIA GPU: compiled at its first use, kept on disk, launched.

NVIDIA's ``cuda-core`` compiles (NVRTC), loads and launches; arrays come as addresses, so those of
any library do, and the work is queued on that library's own stream.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from math import prod
from typing import Any, NamedTuple

import numpy as np

from plenofir.ground import compiling
from plenofir.ground.kept_code import Files, KeptCode
from plenofir.refocus.gpu.constants import LENS_TILE, depth_source, lens_grid, source, tiles_of
from plenofir.refocus.sharpness import Search
from plenofir.refocus.slices import Slice

# Blocks may share a multiprocessor's memory with one more of their kind, and each takes 1 KiB more.
_BLOCKS_BESIDE = 2
_RESERVED_BYTES = 1024

MOST_SLICES = 16
"""Slices that are compiled into one kernel: each takes the compiler a second."""


@dataclass(frozen=True)
class Stream:
    """A library's stream, as cuda-core takes it."""

    handle: int

    def __cuda_stream__(self) -> tuple[int, int]:
        """Version of the protocol, and the stream."""
        return 0, self.handle


@cache
def _files() -> Files | None:
    """Where code is kept, by its source text; None where no folder can be written."""
    try:
        return KeptCode(tiles_of, []).files
    except (RuntimeError, OSError):
        return None


def _compiled(text: str, architecture: str) -> bytes:
    """Machine code of a source for an architecture such as ``sm_90``."""
    from cuda.bindings import nvrtc
    from cuda.core import Program, ProgramOptions

    kept, key = _files(), (text, architecture, nvrtc.nvrtcVersion())
    code: bytes | None = kept.load(key) if kept else None
    if code is None:
        compiling.begin("refocus_tiles")
        try:
            options = ProgramOptions(std="c++17", arch=architecture)
            code = bytes(Program(text, "c++", options).compile("cubin").code)
        finally:
            compiling.end("refocus_tiles")
        if kept:
            with suppress(OSError):
                kept.save(key, code)
    return code


@lru_cache(256)
def _code_or_failure(text: str, architecture: str) -> bytes | Exception:
    """What came of compiling: a compiler that failed would fail again, seconds later."""
    try:
        return _compiled(text, architecture)
    except Exception as failure:
        return failure


def _loaded(text: str, gpu: Any) -> Any:
    """Code of a source on a device."""
    from cuda.core import ObjectCode

    major, minor = gpu.compute_capability
    code = _code_or_failure(text, f"sm_{major}{minor}")
    if isinstance(code, Exception):
        raise code
    return ObjectCode.from_cubin(code)


class Launch(NamedTuple):
    """All that a call for pictures of one stack needs."""

    kernel: Any  # a Kernel of cuda-core
    config: Any  # its LaunchConfig


@lru_cache(256)
def launch_of(slices: tuple[Slice, ...], device: int) -> Launch | None:
    """Code and grid for a stack on a device.

    None: not even one row of a tile fits into a block's memory. Raises what cuda-core raises where
    it cannot compile or load the code.
    """
    from cuda.core import Device, LaunchConfig

    gpu = Device(device)
    gpu.set_current()
    properties = gpu.properties
    limit = properties.max_shared_memory_per_block_optin
    shared = properties.max_shared_memory_per_multiprocessor // _BLOCKS_BESIDE - _RESERVED_BYTES
    tiles = tiles_of(slices, min(limit, shared)) or tiles_of(slices, limit)
    if tiles is None:
        return None
    kernel = _loaded(source(slices, tiles), gpu).get_kernel("refocus_tiles")
    shared = max(tile.shared_bytes for tile in tiles)
    kernel.attributes[gpu].max_dynamic_shared_size_bytes = shared
    grid = tiles[0].blocks(len(slices), slices[0].region)
    return Launch(kernel, LaunchConfig(grid, block=tiles[0].threads, shmem_size=shared))


class Tiles(NamedTuple):
    """What a stack's tiles are made from and written to: addresses, and 0 for what is not used."""

    raw: int
    out: int  # the slices, or the one picture that has each lens from its sharpest slice
    reached_rows: int = 0  # weights of all outputs of a column, for each slice, in 64 bits
    reached_columns: int = 0
    lens_sums: int = 0  # luma of each lens in each slice, in 64 bits, to be added to
    sharpest: int = 0  # a slice for each lens, in 8 bits


def run_tiles(slices: Sequence[Slice], at: Tiles, stream: int, device: int) -> bool:
    """Queue the tiles of a stack on a stream of a device.

    `slices`: of one image and one region. The raw picture and the results are contiguous; of a
    normalised border the weights are needed. Result: False if the GPU has too little shared memory.
    """
    from cuda.core import launch

    one, count = slices[0], len(slices)
    rows, columns = one.shape[:2]
    m, step = one.micro_image_size, one.step
    picture = prod(one.result_shape) * one.pixel_bits // 8
    lenses = -(-rows // m) * -(-columns // m)
    ends = [end for part in one.region for end in (part.start, part.stop)]
    firsts = range(0, count, MOST_SLICES)
    planned = [launch_of(tuple(slices[first : first + MOST_SLICES]), device) for first in firsts]
    if None in planned:
        return False
    for first, each in zip(firsts, planned, strict=True):
        assert each is not None
        group = at._replace(
            out=at.out if at.sharpest else at.out + first * picture,
            reached_rows=at.reached_rows + 8 * first * (rows // step),
            reached_columns=at.reached_columns + 8 * first * (columns // step),
            lens_sums=at.lens_sums and at.lens_sums + 8 * first * lenses,
        )
        numbers = map(np.int32, (rows, columns, *ends, first))
        launch(Stream(stream), each.config, each.kernel, *group, *numbers)
    return True


class Depth(NamedTuple):
    """Addresses of what is found for each lens, as `plenofir.refocus.sharpness.DepthIndex` has it.

    `lens_sums` has a number for each slice.
    """

    lens_sums: int
    best: int  # the sharpest slice, before the vote
    textured: int
    fraction: int  # 0 if depth between slices is not asked for, as the next one
    confidence: int
    voted: int  # 16 bits, for the vote
    filled: int  # after the vote; of both 0 without one


@lru_cache(256)
def _depth_code(slices: tuple[Slice, ...], search: Search, device: int) -> Any:
    from cuda.core import Device

    gpu = Device(device)
    gpu.set_current()
    return _loaded(depth_source(slices, search), gpu)


def run_depth(slices: Sequence[Slice], search: Search, at: Depth, stream: int, device: int) -> None:
    """Queue the search for the sharpest slice of each lens, when all sums of lenses are queued."""
    from cuda.core import LaunchConfig, launch

    code = _depth_code(tuple(slices), search, device)
    m = slices[0].micro_image_size
    rows, columns = (-(-length // m) for length in slices[0].shape[:2])
    kernels: list[tuple[str, tuple[int, ...]]] = [("find_sharpest", at[:5])]
    if search.vote_radius:
        kernels += [
            ("vote", (at.best, at.textured, at.voted)),
            ("fill", (at.best, at.voted, at.filled)),
        ]
    config = LaunchConfig(lens_grid(slices), block=prod(LENS_TILE))
    for name, addresses in kernels:
        kernel = code.get_kernel(name)
        launch(Stream(stream), config, kernel, *addresses, np.int32(rows), np.int32(columns))
