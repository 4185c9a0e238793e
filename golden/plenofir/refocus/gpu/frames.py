# SPDX-License-Identifier: Apache-2.0
"""Frames between the host's memory and a GPU's, by CuPy or PyTorch."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from plenofir.ground import compiling
from plenofir.refocus.operator import Image


def _by_cupy(raw: Image) -> Any:
    import cupy

    return cupy.asarray(raw)


def _by_torch(raw: Image) -> Any:
    import torch

    return torch.tensor(raw, device="cuda")


_LIBRARIES: Mapping[str, Callable[[Image], Any]] = {"CuPy": _by_cupy, "PyTorch": _by_torch}


def to_gpu(raw: Image) -> Any:
    """An image as an array on an NVIDIA GPU; where that cannot be, the image itself.

    Libraries, drivers and cards fail in ways that no list has, and the processor makes an equal
    picture; so every failure is told, once.
    """
    reasons = []
    for library, put in _LIBRARIES.items():
        try:
            return put(raw)
        except Exception as failure:
            reasons.append(f"{library}: {reason(failure)}")
    compiling.hindered("gpu", f"the processor refocuses, not a GPU ({'; '.join(reasons)})")
    return raw


def gpu_pictures(
    raw: Image,
    focus: Iterable[Fraction],
    refocused: Callable[[Any, Fraction], Any],
    notes: list[str],
) -> Iterator[Image]:
    """Pictures of a frame, made on a GPU; `notes` get why the processor made some.

    `refocused` makes one of an array on the GPU, or of the image itself, for a focus setting.
    """
    # Only the run itself tells, once for all of its workers.
    before, compiling.tell = compiling.tell, notes.append
    try:
        there = to_gpu(raw)
        for a in focus:
            try:
                picture = to_host(refocused(there, a))
            except Exception as failure:
                if there is raw:
                    raise
                compiling.hindered("gpu", f"the processor refocuses, not a GPU ({reason(failure)})")
                there = raw
                picture = refocused(raw, a)
            yield picture
    finally:
        compiling.tell = before


def to_host(array: Any) -> Image:
    """An array of any library in the host's memory."""
    copied = getattr(array, "get", None) or getattr(array, "cpu", None)
    return np.asarray(copied() if copied else array)


def reason(error: Exception) -> str:
    """An error's first line, or its class where it says nothing."""
    return (str(error).splitlines() or [""])[0] or type(error).__name__
