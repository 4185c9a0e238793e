# SPDX-License-Identifier: Apache-2.0
"""Time that the host takes for a call on a GPU, measured without one.

Stand-ins take the places of the array's library, of cuda-core and of the driver. They do nothing,
so what remains is plenofir's own part.
"""

import sys
from contextlib import nullcontext
from fractions import Fraction
from functools import partial
from timeit import repeat
from types import ModuleType, SimpleNamespace
from typing import Any, cast
from unittest.mock import MagicMock, patch

import numpy as np

from plenofir.refocus import arrays, refocus, refocus_stack
from plenofir.refocus.gpu import program

_CALLS = 20
_LIBRARY = ModuleType("stand_ins")


class _Array:
    """An array without memory."""

    device = "a GPU"
    dtype = np.dtype(np.uint8)

    def __init__(self, place: int, shape: tuple[int, ...]) -> None:
        self.place, self.shape = place, shape

    def __array_namespace__(self, api_version: str | None = None) -> ModuleType:
        return _LIBRARY


def _core() -> SimpleNamespace:
    """A stand-in for ``cuda.core``, with the memory of an H100."""
    memory = SimpleNamespace(
        max_shared_memory_per_block_optin=227 << 10,
        max_shared_memory_per_multiprocessor=228 << 10,
    )
    device = SimpleNamespace(set_current=lambda: None, properties=memory)
    return SimpleNamespace(
        Device=lambda number: device, LaunchConfig=MagicMock(), launch=lambda *given: None
    )


def host_seconds(m: int, size: int, numbers: int, rounds: int = 50) -> dict[str, float]:
    """Least time of a call for pictures like the one before, of `size` x `size` grey pixels.

    `numbers`: slices of a stack. Result: seconds, by what is refocused.
    """
    one_slice = size, size
    shapes = one_slice, one_slice, (numbers, *one_slice)
    # Pictures lie far from each other, in a class that annotations do not name.
    raw, out, stack = (cast("Any", _Array(n << 40, shape)) for n, shape in enumerate(shapes, 1))
    part = slice(size), slice(size)
    _LIBRARY.__dict__.update(uint8=np.uint8, uint16=np.uint16, empty=lambda *_, **__: out)
    _LIBRARY.__dict__.update(asarray=lambda *_, **__: raw)
    one: Any = partial(refocus, raw, m, Fraction(1, m))
    settings = [Fraction(n, m) for n in range(numbers)]
    works: dict[str, Any] = {
        "a slice": partial(one, out=out),
        "one without `out=`": one,
        "one with a region": partial(one, region=part, out=out),
        'one with `border="normalise"`': partial(one, border="normalise", out=out),
        f"{numbers} slices": partial(refocus_stack, raw, m, settings, out=stack),
    }
    core, gpu = _core(), arrays._Gpu(0, nullcontext(), lambda: 0)
    try:
        with (
            patch.dict(sys.modules, {"cuda": core, "cuda.core": core}),
            patch.object(program, "_loaded", MagicMock()),
            patch.object(arrays, "_gpu_of", lambda *_: gpu),
            patch.object(arrays, "_contiguous", lambda xp, array: array),
            patch.object(arrays, "_address", lambda array: array.place),
        ):
            program.launches_of.cache_clear()
            return {
                name: min(repeat(work, repeat=rounds + 1, number=_CALLS)) / _CALLS
                for name, work in works.items()
            }
    finally:
        # Kernels of stand-ins are for nobody else.
        program.launches_of.cache_clear()
