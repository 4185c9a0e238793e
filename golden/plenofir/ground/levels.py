# SPDX-License-Identifier: Apache-2.0
"""Numbers of any type as the 8 or 16 bit that pictures have, where their meaning is certain."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError

# Floats from 0 to 1 may overshoot by this much below and above, as filters leave them.
_BELOW, _ABOVE = 0.05, 1.5
_MOST = 65535


class Levels(NamedTuple):
    """Values of 8 or 16 bit."""

    values: npt.NDArray[np.integer]
    full_scale: int  # value of white
    notes: tuple[str, ...] = ()  # what was changed


def levels(array: npt.NDArray[Any], where: str) -> Levels:
    """Values of an array as uint8 or uint16, and the value of white.

    uint8 and uint16 stay. Wider integers from 0 to 65535, and floats that are whole numbers, keep
    their values. Other floats go from 0 to 1. What is no number (nan) is black. Raises `InputError`
    for all others; `where` names them.
    """
    kind = array.dtype.newbyteorder("=")
    if kind in (np.uint8, np.uint16):
        return Levels(array.astype(kind, copy=False), int(np.iinfo(kind).max))
    if array.size == 0 or kind.kind not in "iuf":
        raise InputError(
            f"has values of type {kind}; use uint8, uint16, or floats from 0 to 1", where=where
        )
    if kind.kind in "iu":
        least, most = int(array.min()), int(array.max())
        if not 0 <= least <= most <= _MOST:
            raise InputError(
                f"has whole numbers from {least} to {most}; they must be within 0 to {_MOST}",
                where=where,
            )
        return _whole(array, most, kind)
    is_number = np.isfinite(array)
    dark = array.size - int(is_number.sum())
    notes = (f"{100 * dark / array.size:.1f} % of the values are no numbers: black",) * (dark > 0)
    if dark:
        array = np.where(is_number, array, 0)
    low, high = float(array.min()), float(array.max())
    if low >= 0 and 2 <= high <= _MOST and _are_whole(array):
        whole = _whole(array, int(high), kind)
        return whole._replace(notes=notes)
    if not -_BELOW <= low <= high <= _ABOVE or high <= 0:
        raise InputError(
            f"has values from {low:g} to {high:g}; floats must go from 0 to 1, or be whole numbers "
            f"up to {_MOST}",
            where=where,
        )
    if low < 0:
        notes += (f"values from {low:g} on: those below 0 are black",)
    full_scale = _MOST
    if high > 1:
        # White stays white, and what is brighter stays brighter.
        full_scale = int(_MOST / high)
        notes += (f"values up to {high:g}: 1 is white",)
    stored = np.empty(array.shape, np.uint16)
    for part, values in zip(stored.reshape(-1, *array.shape[1:]), array, strict=True):
        part[...] = np.rint(np.maximum(values, 0).astype(np.float64) * full_scale)
    return Levels(stored, full_scale, notes)


def _are_whole(array: npt.NDArray[Any]) -> bool:
    return all(bool((part == np.rint(part)).all()) for part in array)


def _whole(array: npt.NDArray[Any], high: int, kind: np.dtype[Any]) -> Levels:
    """Whole numbers; up to 255 they are 8 bit, unless their type says more."""
    if kind == np.int16:
        return Levels(array.astype(np.uint16), 32767)
    dtype = np.uint8 if high <= 255 else np.uint16
    return Levels(array.astype(dtype), int(np.iinfo(dtype).max))
