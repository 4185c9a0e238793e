# SPDX-License-Identifier: Apache-2.0
"""Where lenses lie in an image, and the smooth part of its brightness."""

from itertools import count

import numpy as np

from plenofir.camera.calibration.grid import (
    Flags,
    Floats,
    Grid,
    Indices,
    exponents,
    polynomial_terms,
)

# Pixels extend half a pixel beyond their centres; a little more includes centres on the border.
BORDER = 0.52
# e^30 is beyond any light, and its like are still numbers of 32 bits.
_LARGEST_LOG = 30.0


def order_of(coefficients: Floats) -> int:
    """Order of the polynomial that has these coefficients."""
    return next(n for n in count() if len(exponents(n)) == len(coefficients))


def shading_at(coefficients: Floats, positions: Floats, image_shape: tuple[int, int]) -> Floats:
    """Smooth part of the white image: vignetting of the main lens."""
    terms = polynomial_terms(unit_positions(positions, image_shape), order_of(coefficients))
    logs = terms @ coefficients
    # Far from all lenses the polynomial is meaningless.
    return np.exp(np.clip(logs, -_LARGEST_LOG, _LARGEST_LOG))


def pixel_positions(rows: slice, columns: int) -> Floats:
    """Positions of the pixels of some rows."""
    y, x = np.meshgrid(np.arange(rows.start, rows.stop), np.arange(columns), indexing="ij")
    return np.stack([y, x], axis=-1).astype(np.float64)


def within(centres: Floats, image_shape: tuple[int, int]) -> Flags:
    """Whether centres lie in an image."""
    end = np.array(image_shape) - 1
    return np.asarray(((centres >= -BORDER) & (centres <= end + BORDER)).all(axis=-1))


def unit_positions(positions: Floats, image_shape: tuple[int, int]) -> Floats:
    """Positions over half the image: -1 to 1 along y and x."""
    half = (np.array(image_shape) - 1) / 2
    return np.clip((positions - half) / half, -1.0, 1.0)


def indices_within(grid: Grid, corners: Floats) -> tuple[Indices, Indices]:
    """Rows and columns of all lenses that can lie in a box, given its outline."""
    lattice = grid.inverse(corners)
    low = np.floor(lattice.min(axis=0)).astype(np.int64) - 1
    high = np.ceil(lattice.max(axis=0)).astype(np.int64) + 1
    t, s = np.meshgrid(
        np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1), indexing="ij"
    )
    return t, s


def outline(low: Floats, high: Floats) -> Floats:
    """Points on the border of a box."""
    steps = np.linspace(0, 1, 9)
    sides = []
    for axis in (0, 1):
        for end in (low, high):
            points = np.empty((len(steps), 2))
            points[:, axis] = end[axis]
            points[:, 1 - axis] = low[1 - axis] + steps * (high - low)[1 - axis]
            sides.append(points)
    return np.concatenate(sides)


def lens_indices(grid: Grid, image_shape: tuple[int, int]) -> tuple[Indices, Indices]:
    """Rows and columns of all lenses that can lie in an image, and a few around it."""
    end = np.array(image_shape) - 0.5
    return indices_within(grid, outline(np.full(2, -0.5), end))


def extents(grid: Grid) -> tuple[float, float]:
    """Pitch along y and x for the windows: extent of a lens's cell."""
    down, right = grid.pitch
    if grid.layout == "hexagonal-rows":
        return right, right
    return (down, down) if grid.layout == "hexagonal-columns" else (down, right)
