# SPDX-License-Identifier: Apache-2.0
"""A white image redrawn at known centres, to find the errors of measuring them.

Where the pitch changes, or a neighbour is missing, neighbours reach into a centroid's window
unequally from both sides, which biases it. So the mean micro image is taken from the white image as
a function of the distance from its centre, and drawn at all centres of the grid found. The same
windows then see the same neighbours around known centres, which gives the bias.
"""

import numpy as np

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Flags, Floats

# The mean micro image: radius in pitches; samples of its profile per pitch, and their least
# distance in pixels.
_RADIUS, _PLACES, _FINEST = 0.75, 50.0, 0.35
_LENSES, _PIXELS = 400, 40_000
# A pixel sees light of its own lens and, in a hexagonal grid, of six around it.
_NEIGHBOURS = 7
# Strength of the profile's smoothness prior, relative to the pixels' information.
_EVEN = 1e-3
# Pixels that deviate by more than this many times the 90th percentile are outliers.
_OUTLIERS = 3.0


def redrawn(image: Image32, places: Floats, levels: Floats, usual: Flags, pitch: float) -> Image32:
    """An image drawn again.

    `places` are the lenses' positions in it, with their brightness (1 is usual, 0 unlit); the mean
    micro image is taken from the `usual` ones.
    """
    from plenofir.camera.calibration.moments import add_spots

    result = np.zeros_like(image)
    if usual.any():
        spot, step = usual_spot(image, places, levels, places[usual], pitch)
        add_spots(result, places, levels, spot, step)
    return result


def usual_spot(
    image: Image32, places: Floats, levels: Floats, chosen: Floats, pitch: float
) -> tuple[Floats, float]:
    """Brightness of the mean micro image by the distance from its centre, and the step of it.

    `chosen` are positions of the lenses that it is taken from.
    """
    from scipy.spatial import cKDTree

    from plenofir.camera.calibration.moments import add_spot_system, spot_values

    step = max(_FINEST, pitch / _PLACES)
    count = int(np.ceil(_RADIUS * pitch / step))
    few = chosen[np.random.default_rng(8).permutation(len(chosen))[:_LENSES]]
    side = int(pitch / 2)
    every = max(1, int(np.sqrt(len(few) * (2 * side + 1) ** 2 / _PIXELS)))
    moves = np.arange(-side, side + 1, every)
    away = np.stack(np.meshgrid(moves, moves, indexing="ij"), axis=-1).reshape(-1, 2)
    pixels = (np.rint(few).astype(np.int64)[:, np.newaxis] + away).reshape(-1, 2)
    values = image[pixels[:, 0], pixels[:, 1]].astype(np.float64)
    bright = levels > 0
    tree = cKDTree(places[bright])
    nearest = list(range(1, min(_NEIGHBOURS, int(bright.sum())) + 1))
    distance, which = tree.query(pixels, nearest, distance_upper_bound=count * step)
    distance /= step
    brightness = np.append(levels[bright], 0.0)[which]  # The last is no lens.
    ridge = _EVEN * len(pixels) / count * _bends(count)
    weights = np.ones(len(pixels))
    for _ in range(3):
        system, right = ridge.copy(), np.zeros(count)
        add_spot_system(distance, brightness, values, weights, system, right)
        profile = np.append(np.linalg.lstsq(system, right, rcond=None)[0], 0.0)
        residuals = np.abs(values - spot_values(distance, brightness, profile))
        weights = (residuals <= _OUTLIERS * np.percentile(residuals, 90)).astype(np.float64)
    return profile, step


def _bends(count: int) -> Floats:
    """Squared second differences of a profile that is symmetric at its middle and 0 at its end."""
    whole = np.vstack([np.eye(count)[1], np.eye(count), np.zeros(count)])
    second = np.diff(whole, 2, axis=0)
    return np.asarray(second.T @ second)
