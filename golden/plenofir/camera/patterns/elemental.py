# SPDX-License-Identifier: Apache-2.0
"""Elemental images of a Fourier light-field microscope: few large round pictures, dark between.

Its micro lenses stand in the pupil, so each of them makes a whole view of the scene.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.grid import Floats
from plenofir.refocus.operator import Image

_SIDE = 512
_SAMPLES = 4  # for each pixel of the picture that is scaled down
# Two discs happen in any picture; more than 100 are rather micro images, which `lenslets` finds.
_FEWEST, _MOST = 3, 100
# Diameter in pixels of the picture that was scaled down, and as a share of its shorter side.
_SMALLEST, _SMALLEST_SHARE = 24, 0.08
# Largest ratio of the areas, of the sides of what surrounds one, and least share that is filled.
_AREAS, _SIDES, _FILLED = 1.3, 1.12, 0.7
# Shares of the usual level: the dark between them, and the rim that counts.
_DARK, _RIM = 0.15, 0.4
# Details of a picture, as a share of its level: what is smooth is a white image.
_DETAILED = 0.05
# Distances from a line of centres, in diameters, and of gaps in a line from each other.
_ASIDE, _UNEVEN = 0.2, 0.1


class Elemental(NamedTuple):
    """Elemental images."""

    number: int  # how many there are
    centres: Floats  # of those in rows and columns, shape (rows, columns, 2), (y, x) in pixels
    radius: float  # in pixels


def find_elemental(image: Image) -> Elemental | None:
    """Elemental images of a picture; None for another one.

    Of a hexagonal arrangement the fullest row is taken, which is a line of views.
    """
    # Elemental pictures are large: every k-th pixel of a large picture shows them.
    k = max(1, min(image.shape[:2]) // (_SAMPLES * _SIDE))
    if k > 1:
        elemental = find_elemental(image[::k, ::k])
        if elemental is None:
            return None
        return elemental._replace(centres=k * elemental.centres, radius=k * elemental.radius)
    levels = grey(image)
    scale = max(1, min(levels.shape) // _SIDE)
    rows, columns = (n // scale for n in levels.shape)
    whole = levels[: rows * scale, : columns * scale].reshape(rows, scale, columns, scale)
    small = ndimage.gaussian_filter(whole.mean(axis=(1, 3)), 2.0)
    dark, bright = np.percentile(small, [2, 99.5])
    lit = small > dark + 0.02 * (bright - dark)
    if not 0.1 < lit.mean() < 0.95:
        return None
    usual = float(np.median(small[lit])) - dark
    parts, count = ndimage.label(ndimage.binary_fill_holes(small - dark > _RIM * usual))
    if not _FEWEST <= count <= 10 * _MOST:
        return None
    areas = ndimage.sum_labels(np.ones_like(small), parts, np.arange(1, count + 1))
    boxes = ndimage.find_objects(parts)
    kept = [n for n in range(count) if areas[n] > 0.3 * areas.max()]
    sides = np.array([[part.stop - part.start for part in boxes[n]] for n in kept])
    diameter = float(np.median(sides))
    least = max(_SMALLEST, _SMALLEST_SHARE * min(small.shape))
    alike = areas[kept].max() < _AREAS * areas[kept].min()
    round_ = (sides.max(axis=1) < _SIDES * sides.min(axis=1)).all()
    filled = (areas[kept] > _FILLED * sides.prod(axis=1)).all()
    between = float(np.median(small[parts == 0])) - dark
    if not (_FEWEST <= len(kept) <= _MOST and diameter >= least and alike and round_ and filled):
        return None
    if between > _DARK * usual:
        return None
    smooth = ndimage.gaussian_filter(small, diameter / 12)
    inside = ndimage.binary_erosion(parts > 0, iterations=max(1, round(diameter / 6)))
    if not inside.any() or (small - smooth)[inside].std() < _DETAILED * usual:
        return None
    # Middles of the boxes: content moves the centroids.
    middles = np.array([[(p.start + p.stop - 1) / 2 for p in boxes[n]] for n in kept])
    arranged = _arranged(middles, diameter)
    if arranged is None:
        return None
    radius = float(np.sqrt(np.median(areas[kept]) / np.pi)) * scale
    return Elemental(len(kept), (arranged + 0.5) * scale - 0.5, radius)


def _arranged(middles: Floats, diameter: float) -> Floats | None:
    """Middles in rows and columns, evenly apart; the fullest row where rows differ."""
    order = middles[np.argsort(middles[:, 0])]
    breaks = np.flatnonzero(np.diff(order[:, 0]) > _ASIDE * diameter) + 1
    lines = [line[np.argsort(line[:, 1])] for line in np.split(order, breaks)]
    length = len(lines[0])
    is_grid = len(lines) > 1 and all(len(line) == length for line in lines)
    if is_grid:
        grid = np.stack(lines)
        is_grid = bool((np.ptp(grid[..., 1], axis=0) < _ASIDE * diameter).all())
    # Hexagonal arrays have shorter rows between: views need one length of rows.
    if not is_grid:
        middle = float(np.mean(middles[:, 0]))
        best = max(lines, key=lambda line: (len(line), -abs(float(line[:, 0].mean()) - middle)))
        grid = best[np.newaxis]
    if grid.shape[0] * grid.shape[1] < _FEWEST:
        return None
    for axis in (0, 1):
        gaps = np.diff(grid[..., axis], axis=axis)
        if gaps.size and np.ptp(gaps) > _UNEVEN * diameter:
            return None
    return grid
