# SPDX-License-Identifier: Apache-2.0
"""A GPU that is the processor."""

import sys
from collections.abc import Iterator
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest
from kernels_on_cpu import cuda_core
from streams_on_cpu import with_streams

from plenofir.ground import compiling
from plenofir.refocus import arrays
from plenofir.refocus.gpu import program


@pytest.fixture
def gpu_on_cpu(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """Arrays of array-api-strict, as if they lay on a GPU, whose kernels the processor runs.

    What the user is told, kernels that were launched, and what streams of their own were given.
    """
    record = SimpleNamespace(told=[], launched=[], queued=[])
    monkeypatch.setattr(compiling, "tell", record.told.append)
    monkeypatch.setattr(compiling, "_announced", set())
    there = arrays._Gpu(0, nullcontext(), lambda: 0)
    monkeypatch.setattr(arrays, "_gpu_of", lambda xp, array: there)
    monkeypatch.setattr(arrays, "_contiguous", lambda xp, array: array)
    monkeypatch.setattr(arrays, "_address", lambda array: array._array.ctypes.data)
    core = cuda_core()
    launch = core.launch

    def launch_noted(stream: Any, config: Any, kernel: Any, *arguments: Any) -> None:
        record.launched.append(kernel.name)
        launch(stream, config, kernel, *arguments)

    core.launch = launch_noted
    with_streams(core, record.queued)
    monkeypatch.setitem(sys.modules, "cuda", SimpleNamespace(core=core))
    monkeypatch.setitem(sys.modules, "cuda.core", core)
    monkeypatch.setattr(program, "_compiled", lambda text, architecture: text.encode())
    caches = program.launches_of, program._code_or_failure
    for each in caches:
        each.cache_clear()
    yield record
    for each in caches:
        each.cache_clear()
