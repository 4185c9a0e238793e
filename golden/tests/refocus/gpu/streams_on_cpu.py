# SPDX-License-Identifier: Apache-2.0
"""Streams and memory of ``cuda.core`` on the processor, as late as they may be.

A stream does nothing before somebody waits for it, so work that is used without a wait is seen.
"""

from collections.abc import Callable
from typing import Any

import numpy as np


class Stream:
    """Work in order; `log` notes what is queued, and waits that are not for nothing."""

    def __init__(self, streams: dict[int, "Stream"], log: list[tuple[str, int]]) -> None:
        self.handle = 1 + len(streams)
        streams[self.handle] = self
        self._log, self._queue = log, list[Callable[[], None]]()

    def queue(self, name: str, step: Callable[[], None]) -> None:
        self._log.append((name, self.handle))
        self._queue.append(step)

    def sync(self) -> None:
        if self._queue:
            self._log.append(("wait", self.handle))
        steps, self._queue = self._queue, []
        for step in steps:
            step()


class Buffer:
    """Memory, garbage at first."""

    def __init__(self, size: int) -> None:
        self.size, self.content = size, np.full(size, 0xA5, np.uint8)
        self.handle = self.content.ctypes.data

    def copy_from(self, source: "Buffer", *, stream: Stream) -> None:
        assert source.size == self.size
        queued = source.content.copy()

        def step() -> None:
            assert np.array_equal(source.content, queued), "memory changed before its upload"
            self.content[:] = source.content

        stream.queue("upload", step)

    def copy_to(self, target: "Buffer", *, stream: Stream) -> None:
        assert target.size == self.size
        stream.queue("download", lambda: np.copyto(target.content, self.content))


class Pinned:
    """A memory resource, and a device in its role as one."""

    def allocate(self, size: int, *, stream: Stream) -> Buffer:
        return Buffer(size)


def with_streams(core: Any, log: list[tuple[str, int]]) -> None:
    """Give a stand-in for ``cuda.core`` streams and memory."""
    streams: dict[int, Stream] = {}
    launch = core.launch

    class Device(core.Device, Pinned):  # type: ignore[misc, name-defined]
        device_id = 0

        def create_stream(self) -> Stream:
            return Stream(streams, log)

    def launched(stream: Any, config: Any, kernel: Any, *arguments: Any) -> None:
        def step() -> None:
            launch(stream, config, kernel, *arguments)

        _, handle = stream.__cuda_stream__()
        if handle in streams:
            streams[handle].queue("kernel", step)
        else:
            step()

    core.Device, core.launch, core.LegacyPinnedMemoryResource = Device, launched, Pinned
