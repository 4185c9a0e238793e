# SPDX-License-Identifier: Apache-2.0
"""The grid of a focused capture by the dark gaps between its micro images, without a white image.

Content repeats nearly as lenses do, with a parallax, so frequencies alone mislead. Gaps are narrow
and dark whatever the scene: a closing fills them, and what it fills, as a share, is a picture of
the gaps alone. A first grid is guessed from that (`plenofir.camera.patterns.lenslets`), then the
places where three or four micro images meet are fitted.
"""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.calibrate import calibration_of_grid
from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Floats, Grid, polynomial_terms
from plenofir.camera.calibration.lattice import primitive_vectors
from plenofir.camera.calibration.record import PROFILE_REACH, Calibration
from plenofir.camera.calibration.shading import lens_indices, within
from plenofir.camera.calibration.types_of_lenses import usual_order
from plenofir.camera.patterns.lenslets import find_lenslets
from plenofir.ground.errors import InputError

# Sides in pixels of closings that a grid is guessed with, and its pitches in sides then.
_SIDES, _PITCHES = (7, 11, 17, 25), (1.5, 3.5)
# The guess is made in the middle of large pictures; side of the closing of the fit in pitches.
_MIDDLE, _SIDE = 1536, 0.25
# Window around a place where micro images meet, in pitches, and rounds of the fit.
_WINDOW, _ROUNDS = 0.22, 6
# Least darkness of these places beside the middles, in each third of the lenses; largest scatter of
# single places, in pitches.
_CONTRAST, _SCATTER = 0.08, 0.1
_SAMPLES = 31


def grid_of_gaps(levels: Image32, where: str) -> Grid:
    """Find the grid of a capture; `levels`: grey levels, shape (rows, columns).

    Raises `InputError` if its gaps do not tell.
    """
    top, left = (max(0, (n - _MIDDLE) // 2) for n in levels.shape)
    middle = levels[top : top + _MIDDLE, left : left + _MIDDLE]
    found: list[tuple[float, Grid]] = []
    for side in _SIDES:
        lenslets = find_lenslets(1 - _gaps(middle, side))
        if lenslets is None:
            continue
        # A grid of lenses and gaps together has a gap in the middle of two cells of three.
        if _PITCHES[0] < lenslets.pitch / side < _PITCHES[1]:
            grid = lenslets.grid.mapped(np.eye(2), np.array([top, left]))
            found.append(_fitted(levels, grid))
    contrast, best = max(found, key=lambda one: one[0], default=(0.0, None))
    if best is None or contrast < _CONTRAST:
        raise InputError(
            "the gaps between its micro images do not show where they are; calibrate with a white "
            "image",
            where=where,
        )
    return best


def calibration_of_gaps(levels: Image32, where: str) -> Calibration:
    """Calibration of a focused capture without a white image: grid, and light across micro images.

    Raises `InputError` as `grid_of_gaps` does.
    """
    grid = grid_of_gaps(levels, where)
    calibration = calibration_of_grid(grid, (levels.shape[0], levels.shape[1]))
    centres = calibration.model_centres[calibration.inside]
    steps = np.linspace(-PROFILE_REACH, PROFILE_REACH, _SAMPLES) * max(calibration.grid.pitch)
    places = centres[:, np.newaxis, np.newaxis] + np.stack(
        np.meshgrid(steps, steps, indexing="ij"), axis=-1
    )
    values = ndimage.map_coordinates(levels, np.moveaxis(places, -1, 0), order=1, mode="nearest")
    # The content of many micro images is even on the average.
    values /= np.maximum(np.percentile(values, 80, axis=(1, 2), keepdims=True), 1e-6)
    profile = np.mean(np.minimum(values, 1.5), axis=0)
    profile = np.clip(profile / np.percentile(profile, 80), 0, 1)
    lines = tuple(tuple(line) for line in profile.round(4).tolist())
    return calibration.model_copy(update={"profile": lines})


def _gaps(levels: Image32, side: int) -> Image32:
    """Share of the light that is missing in what is darker than all around within a side."""
    filled = ndimage.grey_closing(levels, size=(side, side), mode="nearest")
    floor = 1e-3 * float(levels.max()) + 1e-9
    return np.asarray((filled - levels) / (filled + floor), np.float32)


def _fitted(levels: Image32, grid: Grid) -> tuple[float, Grid]:
    """The grid that fits the gaps best near one, and how much darker they are than middles."""
    shape = (levels.shape[0], levels.shape[1])
    gaps = _gaps(levels, max(3, int(_SIDE * grid.lens_pitch) | 1))
    gaps = ndimage.gaussian_filter(gaps, 0.7)
    scatter = np.inf
    for _ in range(_ROUNDS):
        pitch = grid.lens_pitch
        t, s = (one.ravel() for one in lens_indices(grid, shape))
        lattice = grid.lattice(t, s)
        meets = _meetings(grid)
        places = (grid.positions(lattice)[:, np.newaxis] + meets).reshape(-1, 2)
        lattice = lattice.repeat(len(meets), axis=0)
        margin = _WINDOW * pitch + 1
        inside = ((places > margin) & (places < np.array(shape) - 1 - margin)).all(axis=1)
        places, lattice = places[inside], lattice[inside]
        away, weight = _centroids(gaps, places, _WINDOW * pitch)
        terms = polynomial_terms((lattice - grid.middle) / grid.scale, 1)
        for _ in range(4):
            root = np.sqrt(weight)[:, np.newaxis]
            moves = np.linalg.lstsq(root * terms, root * away, rcond=None)[0]
            off = np.hypot(*(away - terms @ moves).T)
            scatter = float(np.median(off))
            weight = weight * np.minimum(1, scatter / np.maximum(off, 1e-9))
        coefficients = np.array(grid.coefficients)
        coefficients[: len(moves)] += moves
        grid = grid.model_copy(update={"coefficients": tuple(map(tuple, coefficients.tolist()))})
    t, s = (one.ravel() for one in lens_indices(grid, shape))
    centres = grid.centres(t, s)
    inner = within(centres, shape)
    t, s, centres = t[inner], s[inner], centres[inner]
    kinds = usual_order(grid, t, s, 3) if grid.layout != "rectangular" else (t + s) % 2
    at_gap = np.mean([_at(gaps, centres + one) for one in _meetings(grid)], axis=0)
    contrast = at_gap - _at(gaps, centres)
    worst = min(float(contrast[kinds == kind].mean()) for kind in np.unique(kinds))
    return (worst if scatter < _SCATTER * grid.lens_pitch else 0.0), grid


def _meetings(grid: Grid) -> Floats:
    """Places where micro images meet, from a lens, each shared by three or four; (n, 2)."""
    first, second = primitive_vectors(grid)
    if grid.layout == "rectangular":
        return np.array([(first + second) / 2])
    if first @ second < 0:
        second = first + second
    middle = (first + second) / 3
    return np.array([middle, -middle])


def _at(values: Image32, places: Floats) -> Floats:
    return np.asarray(ndimage.map_coordinates(values, places.T, order=1, mode="nearest"), float)


def _centroids(gaps: Image32, places: Floats, reach: float) -> tuple[Floats, Floats]:
    """Where the gaps' darkness lies around places, (n, 2), and how much of it there is."""
    steps = np.arange(-np.ceil(reach), np.ceil(reach) + 1)
    moves = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    moves = moves[np.hypot(*moves.T) <= reach]
    values = _at(gaps, (places[:, np.newaxis] + moves).reshape(-1, 2)).reshape(len(places), -1)
    total = values.sum(axis=1)
    return values @ moves / np.maximum(total, 1e-9)[:, np.newaxis], total
