# SPDX-License-Identifier: Apache-2.0
"""Where pictures to look at have small boxes: in focus, and where views show no lattice.

`plenofir.refocus.by_place` chooses for each micro image; here both pictures are blended from one
micro image to the next.
"""

from fractions import Fraction

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.lightfield.disparity import Disparity
from plenofir.camera.lightfield.enlarged import lens_shares
from plenofir.refocus import best_picture
from plenofir.refocus.operator import Image, least_box

Floats = npt.NDArray[np.float64]

# Weights of the four micro lenses around, in a row, whose common detail is a lattice of views.
_AROUND = np.array([0.25, 0.25, 0, 0.25, 0.25], np.float32)
# Share of the detail's energy that micro lenses around have alike: less and more, it is no lattice
# and is one.
_OF_LATTICES = 0.1, 0.3
# Settings of micro lenses beside each other that differ by more are those of two things.
_STEP = 0.1
# Micro lenses over which energies of detail are compared (sigma).
_SIGMA = 1.0


def even(settings: Floats) -> npt.NDArray[np.bool_]:
    """Micro lenses that are not beside a step of depth, where views see two things."""
    rise = ndimage.maximum_filter(settings, 3) - ndimage.minimum_filter(settings, 3)
    return np.asarray(rise <= _STEP)


def smaller(shifts: Floats, m: int, box: int | None) -> Floats:
    """For each shift the share of the slices before and after it that can have a box of B < M."""
    if box in (None, m):
        least_box(m, 1, box)
        return np.zeros(shifts.shape)
    can = np.array([least_box(m, shift, box) == box for shift in range(m)], np.float64)
    before = np.floor(shifts)
    low, high = (can[np.asarray(before + k, np.int64) % m] for k in (0, 1))
    return np.asarray(low + (high - low) * (shifts - before))


def lattice(fine: Image, whole: Image, m: int, lenses: tuple[int, ...]) -> Floats:
    """How sure it is that detail is a lattice of views, from 0 to 1, for each micro lens.

    Views that differ leave a pattern in every micro lens alike, along both dimensions; an edge
    repeats along one of them at most. `whole`: the picture without detail.
    """
    energy, common = np.zeros(lenses), np.zeros(lenses)
    for v, u in np.ndindex(m, m):
        detail, without = (
            each[v::m, u::m][: lenses[0], : lenses[1]].astype(np.float32) for each in (fine, whole)
        )
        detail -= without
        down, right = (ndimage.convolve1d(detail, _AROUND, axis, mode="nearest") for axis in (0, 1))
        alike = np.minimum(np.abs(down), np.abs(right)) * (down * right > 0)
        energy += (detail**2).reshape(*lenses, -1).sum(2)
        common += (alike**2).reshape(*lenses, -1).sum(2)
    whole_energy, common_energy = (
        ndimage.gaussian_filter(each, _SIGMA, mode="nearest") for each in (energy, common)
    )
    share = common_energy / np.maximum(whole_energy, 1)
    low, high = _OF_LATTICES
    return np.asarray(np.clip((share - low) / (high - low), 0, 1))


def refocused_by_place(raw: Image, m: int, a: Fraction, box: int, depth: Disparity) -> Image:
    """A picture to look at, with small boxes where it is in focus.

    From M to B samples as the probable depth comes from one and a half steps of 1/M to half a step
    near to a. `depth`: of the micro lenses, shape (t, s). Result: as `best_picture` has it.
    """
    whole, sharp = (best_picture(raw, m, a, box=size) for size in (None, box))
    settings = depth.settled()
    near = np.clip(1.5 - m * np.abs(settings - float(a)), 0, 1)
    shares = depth.confidence * near * even(settings)
    shares *= 1 - lattice(sharp, whole, m, shares.shape)
    rows, columns = (
        lens_shares(length, lenses, m, 1)
        for length, lenses in zip(raw.shape, shares.shape, strict=False)
    )
    share = np.asarray(rows @ (columns @ shares.T).T).reshape(*raw.shape[:2], *[1] * (raw.ndim - 2))
    return np.asarray(np.rint(whole + share * (sharp.astype(np.float64) - whole)), raw.dtype)
