# SPDX-License-Identifier: Apache-2.0
"""Axes of a grid along which its lenses stand one pitch apart: two, 60 degrees apart if hexagonal.

A raster of micro images along these axes has a place (row, column) for each lens, though hexagonal
rows are half a pitch aside of each other: lens (row, column) stands at C + row a_1 + column a_2,
with `plenofir.camera.calibration.lattice.primitive_vectors` as a_1 and a_2.
"""

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.grid import Floats, Grid, Indices

RIM = 1.5
"""Pixels at the rim of a focused camera's micro image whose light mixes with its neighbour's."""
DIMMEST = 0.6
"""Pixels of a focused camera that get less of the light do not count."""


def reach_of(grid: Grid) -> float:
    """Radius within which pixels of a focused camera's micro image count, in pixels."""
    return grid.lens_pitch / 2 - RIM


def along_axes(grid: Grid, row: npt.ArrayLike, column: npt.ArrayLike) -> Floats:
    """Lattice coordinates of places along the axes, any shape."""
    t, s = np.asarray(row, np.float64), np.asarray(column, np.float64)
    if grid.layout == "hexagonal-rows":
        s = s + (t + grid.stagger) / 2
    elif grid.layout == "hexagonal-columns":
        t = t + (s + grid.stagger) / 2
    return np.stack([t, s], axis=-1)


def lenses_along(grid: Grid, lattice: Floats) -> tuple[Indices, Indices]:
    """The grid's rows and columns of the lenses at lattice coordinates."""
    t, s = (np.rint(lattice[..., k]).astype(np.int64) for k in (0, 1))
    if grid.layout == "hexagonal-rows":
        s = np.rint(lattice[..., 1] - 0.5 * ((t + grid.stagger) % 2)).astype(np.int64)
    elif grid.layout == "hexagonal-columns":
        t = np.rint(lattice[..., 0] - 0.5 * ((s + grid.stagger) % 2)).astype(np.int64)
    return t, s


def extent_along(grid: Grid, shape: tuple[int, ...]) -> tuple[tuple[int, int], tuple[int, int]]:
    """First row and column along the axes that a raster needs to hold an image, and their number.

    `shape`: rows and columns of the image.
    """
    end = np.array(shape[:2]) - 1
    corners = np.array([(0, 0), (0, end[1]), (end[0], 0), end], dtype=np.float64)
    t, s = np.moveaxis(grid.inverse(corners), -1, 0)
    if grid.layout == "hexagonal-rows":
        s = s - (t + grid.stagger) / 2
    elif grid.layout == "hexagonal-columns":
        t = t - (s + grid.stagger) / 2
    low = int(np.floor(t.min())), int(np.floor(s.min()))
    high = int(np.ceil(t.max())), int(np.ceil(s.max()))
    return low, (high[0] - low[0] + 1, high[1] - low[1] + 1)
