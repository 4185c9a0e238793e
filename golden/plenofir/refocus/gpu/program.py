# SPDX-License-Identifier: Apache-2.0
"""Code for a slice on an NVIDIA GPU: compiled at its first use, kept on disk, launched.

NVIDIA's ``cuda-core`` compiles (NVRTC), loads and launches; arrays come as addresses, so those of
any library do, and the work is queued on that library's own stream.
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from plenofir.ground import compiling
from plenofir.ground.kept_code import Files, KeptCode
from plenofir.refocus.gpu.constants import source, tile_of
from plenofir.refocus.slices import Slice

# Blocks may share a multiprocessor's memory with one more of their kind, and each takes 1 KiB more.
_BLOCKS_BESIDE = 2
_RESERVED_BYTES = 1024


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
        return KeptCode(tile_of, []).files
    except (RuntimeError, OSError):
        return None


def _compiled(text: str, architecture: str) -> bytes:
    """Machine code of a source for an architecture such as ``sm_90``."""
    from cuda.bindings import nvrtc
    from cuda.core import Program, ProgramOptions

    kept, key = _files(), (text, architecture, nvrtc.nvrtcVersion())
    code: bytes | None = kept.load(key) if kept else None
    if code is None:
        compiling.begin("refocus_tile")
        try:
            options = ProgramOptions(std="c++17", arch=architecture)
            code = bytes(Program(text, "c++", options).compile("cubin").code)
        finally:
            compiling.end("refocus_tile")
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


class Launch(NamedTuple):
    """All that a call for pictures of one slice needs."""

    kernel: Any  # a Kernel of cuda-core
    config: Any  # its LaunchConfig


@lru_cache(256)
def launch_of(slice_: Slice, device: int) -> Launch | None:
    """Code and grid for a slice on a device.

    None: not even one row of a tile fits into a block's memory. Raises what cuda-core raises where
    it cannot compile or load the code.
    """
    from cuda.core import Device, LaunchConfig, ObjectCode

    gpu = Device(device)
    gpu.set_current()
    properties = gpu.properties
    limit = properties.max_shared_memory_per_block_optin
    shared = properties.max_shared_memory_per_multiprocessor // _BLOCKS_BESIDE - _RESERVED_BYTES
    tile = tile_of(slice_, min(limit, shared)) or tile_of(slice_, limit)
    if tile is None:
        return None
    major, minor = gpu.compute_capability
    code = _code_or_failure(source(slice_, tile), f"sm_{major}{minor}")
    if isinstance(code, Exception):
        raise code
    kernel = ObjectCode.from_cubin(code).get_kernel("refocus_tile")
    kernel.attributes[gpu].max_dynamic_shared_size_bytes = tile.shared_bytes
    grid = tile.blocks(slice_.region)
    return Launch(kernel, LaunchConfig(grid, block=tile.threads, shmem_size=tile.shared_bytes))


def refocus_at(
    slice_: Slice, addresses: tuple[int, int, int, int], stream: int, device: int
) -> bool:
    """Queue the refocusing of a slice on a stream of a device.

    `addresses`: the raw picture and the region's, both contiguous; for a normalised border the
    weights of all outputs of a column and of a line, in 64 bits each. Result: False if the GPU has
    too little shared memory.
    """
    from cuda.core import launch

    planned = launch_of(slice_, device)
    if planned is None:
        return False
    ends = (end for part in slice_.region for end in (part.start, part.stop))
    numbers = (np.int32(number) for number in (*slice_.shape[:2], *ends))
    launch(Stream(stream), planned.config, planned.kernel, *addresses, *numbers)
    return True
