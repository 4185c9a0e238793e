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


class Tiles(NamedTuple):
    """What a stack's tiles are made from and written to: addresses, and 0 for what is not used."""

    raw: int
    out: int  # the slices, or the one picture that has each lens from its sharpest slice
    reached_rows: int = 0  # weights of all outputs of a column, for each slice, in 64 bits
    reached_columns: int = 0
    lens_sums: int = 0  # luma of each lens in each slice, in 64 bits, to be added to
    sharpest: int = 0  # a slice for each lens, in 8 bits


class Launch(NamedTuple):
    """What a kernel needs for its slices of a stack."""

    kernel: Any  # a Kernel of cuda-core
    config: Any  # its LaunchConfig
    ahead: Tiles  # bytes in front of what is for its slices
    numbers: tuple[np.int32, ...]  # of rows and columns, ends of the region, its first slice


# Films have stacks of one kind, and preparing one takes longer than a GPU's picture.
@lru_cache(256)
def launches_of(slices: tuple[Slice, ...], device: int) -> list[Launch] | None:
    """The kernels for a stack on a device.

    None: not even one row of a tile fits into a block's memory. Raises what cuda-core raises where
    it cannot compile or load the code.
    """
    from cuda.core import Device, LaunchConfig

    gpu = Device(device)
    gpu.set_current()
    properties = gpu.properties
    limit = properties.max_shared_memory_per_block_optin
    beside = properties.max_shared_memory_per_multiprocessor // _BLOCKS_BESIDE - _RESERVED_BYTES
    one, launches = slices[0], []
    rows, columns = one.shape[:2]
    m, step = one.micro_image_size, one.step
    picture = prod(one.result_shape) * one.pixel_bits // 8
    lenses = -(-rows // m) * -(-columns // m)
    ends = [end for part in one.region for end in (part.start, part.stop)]
    for first in range(0, len(slices), MOST_SLICES):
        group = slices[first : first + MOST_SLICES]
        tiles = tiles_of(group, min(limit, beside)) or tiles_of(group, limit)
        if tiles is None:
            return None
        kernel = _loaded(source(group, tiles), gpu).get_kernel("refocus_tiles")
        shared = max(tile.shared_bytes for tile in tiles)
        kernel.attributes[gpu].max_dynamic_shared_size_bytes = shared
        grid = tiles[0].blocks(len(group), one.region)
        config = LaunchConfig(grid, block=tiles[0].threads, shmem_size=shared)
        down, across = (8 * first * (length // step) for length in (rows, columns))
        ahead = Tiles(0, first * picture, down, across, 8 * first * lenses)
        numbers = tuple(map(np.int32, (rows, columns, *ends, first)))
        launches.append(Launch(kernel, config, ahead, numbers))
    return launches


def run_tiles(slices: Sequence[Slice], at: Tiles, stream: int, device: int) -> bool:
    """Queue the tiles of a stack on a stream of a device.

    `slices`: of one image and one region. The raw picture and the results are contiguous; of a
    normalised border the weights are needed. Result: False if the GPU has too little shared memory.
    """
    from cuda.core import launch

    launches = launches_of(tuple(slices), device)
    for kernel, config, ahead, numbers in launches or ():
        places = [place and place + ahead for place, ahead in zip(at, ahead, strict=True)]
        if at.sharpest:
            places[1] = at.out
        launch(Stream(stream), config, kernel, *places, *numbers)
    return launches is not None


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
def _depth_launches(
    slices: tuple[Slice, ...], search: Search, device: int
) -> tuple[list[Any], Any, list[np.int32]]:
    """Kernels in their order, and for all of them their config and rows and columns of lenses."""
    from cuda.core import Device, LaunchConfig

    gpu = Device(device)
    gpu.set_current()
    code = _loaded(depth_source(slices, search), gpu)
    names = ["find_sharpest", *(["vote", "fill"] if search.vote_radius else [])]
    m = slices[0].micro_image_size
    lenses = [np.int32(-(-length // m)) for length in slices[0].shape[:2]]
    config = LaunchConfig(lens_grid(slices), block=prod(LENS_TILE))
    return [code.get_kernel(name) for name in names], config, lenses


def run_depth(slices: Sequence[Slice], search: Search, at: Depth, stream: int, device: int) -> None:
    """Queue the search for the sharpest slice of each lens, when all sums of lenses are queued."""
    from cuda.core import launch

    kernels, config, lenses = _depth_launches(tuple(slices), search, device)
    vote, fill = (at.best, at.textured, at.voted), (at.best, at.voted, at.filled)
    for kernel, addresses in zip(kernels, (at[:5], vote, fill), strict=False):
        launch(Stream(stream), config, kernel, *addresses, *lenses)
