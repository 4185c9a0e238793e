"""What speaks against a grid: a second spot in its cells, dark rows."""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.grid import (
    Floats,
    Grid,
    Indices,
)
from plenofir.camera.calibration.growing import GrowingFit, primitive_vectors, reduced_lengths
from plenofir.camera.calibration.lattice import (
    no_grid,
)

_CELL_SAMPLES = 12
_CELL_LENSES = 600
# Lenses (most of them) that are darker than this share of the usual in every second or third row:
# the grid is too fine.
_EVEN_CLASSES = 0.4
# A second spot is at least this many pitches from the first.
_SECOND_SPOT = 0.47


def primitive_indices(grid: Grid, t: Indices, s: Indices) -> tuple[Indices, Indices]:
    """Indices of lenses in terms of `primitive_vectors`."""
    lattice = grid.lattice(t, s)
    down, right = lattice[..., 0], lattice[..., 1]
    if grid.layout == "hexagonal-rows":
        right = right - down / 2
    elif grid.layout == "hexagonal-columns":
        down = down - right / 2
    return np.floor(down).astype(np.int64), np.floor(right).astype(np.int64)


def cell_margin(fitter: GrowingFit, centres: Floats) -> float:
    """1 minus the brightness of a second spot in the mean cell of the grid."""
    few = np.random.default_rng(3).permutation(len(centres))[:_CELL_LENSES]
    vectors = primitive_vectors(fitter.grid)
    steps = np.arange(_CELL_SAMPLES) / _CELL_SAMPLES
    steps = steps - np.round(steps)
    moves = steps[:, np.newaxis, np.newaxis] * vectors[0] + steps[:, np.newaxis] * vectors[1]
    places = centres[few][:, np.newaxis, np.newaxis] + moves + fitter.margin
    values = ndimage.map_coordinates(
        fitter.padded, np.moveaxis(places, -1, 0), order=1, mode="nearest"
    )
    cell = ndimage.gaussian_filter(np.median(values, axis=0), 0.7, mode="wrap")
    cell = (cell - cell.min()) / max(float(cell[0, 0] - cell.min()), 1e-9)
    peaks = cell == ndimage.maximum_filter(cell, 5, mode="wrap")
    corners = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, -1], [-1, 1]]) @ vectors
    distance = np.linalg.norm(moves[:, :, np.newaxis] - corners, axis=-1).min(axis=-1)
    away = distance > _SECOND_SPOT * min(reduced_lengths(fitter.grid))
    return 1 - float(np.max(cell, where=peaks & away, initial=0.0))


def check_classes(grid: Grid, t: Indices, s: Indices, level: Floats) -> None:
    """Refuse a grid in which every second or third row is dark: it is too fine."""
    m, n = primitive_indices(grid, t, s)
    usual = float(np.percentile(level, 75))
    for divisor in (2, 3):
        for index in (m, n, m + n, m - n):
            parts = [level[index % divisor == k] for k in range(divisor)]
            if any(len(p) >= 4 and np.percentile(p, 70) < _EVEN_CLASSES * usual for p in parts):
                raise no_grid(
                    "micro images of half the distance or darker ones in every second row"
                )
