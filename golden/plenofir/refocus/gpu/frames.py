# SPDX-License-Identifier: Apache-2.0
"""Frames of the host's memory through an NVIDIA GPU and back, by ``cuda-core`` alone.

Each of some lanes has memory on both sides and a stream, which keeps the upload, the kernel and the
download of a frame in order; those of different lanes overlap.
"""

import ctypes
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from math import prod
from typing import Any, NamedTuple, TypeVar

import numpy as np

from plenofir.ground.extras import missing
from plenofir.refocus.operator import Image
from plenofir.refocus.slices import Slice

LANES = 3
"""One for each of upload, kernel and download."""

Job = TypeVar("Job")


class Work(NamedTuple):
    """An image in the host's memory, and what is made of it."""

    raw: Image
    slices: Sequence[Slice]  # of it, whole or of one region, with black borders


class _Lane:
    """Memory for one frame at a time, and the stream that it is used on."""

    def __init__(self, gpu: Any) -> None:
        from cuda.core import LegacyPinnedMemoryResource

        self._gpu, self.stream = gpu, gpu.create_stream()
        self._pinned = LegacyPinnedMemoryResource()
        self._buffers: dict[str, Any] = {}
        self._slices: Image = np.empty(0, np.uint8)

    def _buffer(self, name: str, size: int) -> Any:
        """Memory of exactly so many bytes, as copies need."""
        if name not in self._buffers or self._buffers[name].size != size:
            on_gpu = name.startswith("gpu")
            new = (self._gpu if on_gpu else self._pinned).allocate(size, stream=self.stream)
            self._buffers[name] = new
        return self._buffers[name]

    def _seen(self, name: str, shape: tuple[int, ...], kind: Any) -> Image:
        """Memory of the host as an array."""
        size = prod(shape) * np.dtype(kind).itemsize
        address = int(self._buffer(name, size).handle)
        return np.frombuffer((ctypes.c_byte * size).from_address(address), kind).reshape(shape)

    def begin(self, work: Work) -> bool:
        """Queue a frame; False if the GPU has too little shared memory for its slices."""
        from plenofir.refocus.gpu.program import Tiles, run_tiles

        raw, slices = work
        # A frame whose slices did not fit may still be on its way.
        self.stream.sync()
        self._seen("raw", raw.shape, raw.dtype)[...] = raw
        shape = len(slices), *slices[0].result_shape
        self._slices = self._seen("slices", shape, raw.dtype)
        there = self._buffer("gpu raw", raw.nbytes)
        slices_there = self._buffer("gpu slices", self._slices.nbytes)
        there.copy_from(self._buffers["raw"], stream=self.stream)
        at = Tiles(int(there.handle), int(slices_there.handle))
        fits = run_tiles(slices, at, int(self.stream.handle), self._gpu.device_id)
        if fits:
            slices_there.copy_to(self._buffers["slices"], stream=self.stream)
        return fits

    def result(self) -> Image:
        """The slices of the frame that was begun; they stay until the next one begins."""
        self.stream.sync()
        return self._slices


class _Lanes:
    """Lanes that frames take in turns, until something fails."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell, self._next = tell, 0
        self._all: list[_Lane] = []
        self._attempt(self._open)

    def _open(self) -> None:
        from cuda.core import Device

        gpu = Device(0)
        gpu.set_current()
        self._all = [_Lane(gpu) for _ in range(LANES)]

    def _attempt(self, step: Callable[[], Any]) -> Any | None:
        """What a step gives.

        Libraries, drivers and cards fail in ways that no list has, and the processor makes an
        equal picture; so every failure is told, and ends the use of the GPU.
        """
        try:
            return step()
        except Exception as failure:
            self._tell(f"the processor refocuses, not a GPU ({reason(failure)})")
            self.close()
            return None

    def begin(self, work: Callable[[], Work]) -> _Lane | None:
        """The lane that makes the slices; None if the processor must."""
        if not self._all:
            return None
        lane = self._all[self._next % LANES]
        self._next += 1
        return lane if self._attempt(lambda: lane.begin(work())) else None

    def result(self, lane: _Lane | None) -> Image | None:
        """The slices of a lane; None if the processor must make them."""
        return self._attempt(lane.result) if lane in self._all and lane else None

    def close(self) -> None:
        """Wait for what was begun, and use the GPU no more."""
        for lane in self._all:
            with suppress(Exception):
                lane.stream.sync()
        self._all = []


def gpu_slices(
    jobs: Iterable[Job], work_of: Callable[[Job], Work], tell: Callable[[str], None]
) -> Iterator[tuple[Job, Image | None]]:
    """Slices of frames in the host's memory, in the order of the frames.

    A job is begun `LANES` - 1 jobs before its slices are asked for. Slices, shape (slices, rows,
    columns[, 3]), stay until the next ones are asked for; None if the processor must make them.
    `tell` gets why no GPU makes them.
    """
    lanes, begun = _Lanes(tell), deque[tuple[Job, _Lane | None]]()
    try:
        for job in jobs:
            begun.append((job, lanes.begin(partial(work_of, job))))
            if len(begun) == LANES:
                first, lane = begun.popleft()
                yield first, lanes.result(lane)
        for first, lane in begun:
            yield first, lanes.result(lane)
    finally:
        lanes.close()


def reason(error: Exception) -> str:
    """An error's first line, or its class where it says nothing."""
    if isinstance(error, ModuleNotFoundError) and error.name:
        error = missing(error.name)
    return (str(error).splitlines() or [""])[0] or type(error).__name__
