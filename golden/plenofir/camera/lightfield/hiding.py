# SPDX-License-Identifier: Apache-2.0
"""What hides what in a light field: surfaces of larger disparity, which are nearer, or others.

Views whose rows and columns are both reversed show the same scene with disparities of the other
sign: near and far are exchanged, and only what hides what tells. Pixels of the central view are
moved to the outer views by their disparity. Where two of different disparities meet there, the view
shows one of them.
"""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.disparity import LEAST_CONFIDENCE, Disparity
from plenofir.refocus.operator import Image

# Pixels that meet are moved apart by more pixels than rounding and errors of the disparity do it,
# and differ by so many times the noise, at least by so much of what the view ranges over.
_APART, _NOISES, _LEAST = 1.5, 4.0, 1 / 64
# More views only take longer.
_VIEWS = 40
# Meetings beside one edge agree with each other, so a few say little; matches that are wrong meet
# as well, so a small mean says nothing.
_FEWEST, _MEAN, _CERTAIN = 40, 0.25, 3.0


def larger_hides(images: Image, disparity: Disparity) -> float:
    """Whether surfaces of larger disparity hide others.

    `images`: views, shape (v, u, t, s[, 3]). `disparity`: of the view in the middle. Result: 1
    if all meetings say so, -1 if all say the opposite, 0 if too few tell.
    """
    middle = images.shape[0] // 2, images.shape[1] // 2
    central = grey(images[middle]).astype(np.float64)
    noise = float(np.median(np.abs(central - ndimage.median_filter(central, 3))))
    clear = max(_NOISES * noise, _LEAST * float(np.ptp(central)))
    y, x = np.nonzero(disparity.confidence >= LEAST_CONFIDENCE)
    ascending = np.argsort(disparity.pixels_per_view[y, x], kind="stable")
    y, x = y[ascending], x[ascending]
    moves, shown = disparity.pixels_per_view[y, x], central[y, x]
    votes = [np.zeros(0)]
    for v, u in _outer(*images.shape[:2]):
        seen = grey(images[v, u]).astype(np.float64)
        down = np.rint(y - moves * (v - middle[0])).astype(np.int64)
        right = np.rint(x - moves * (u - middle[1])).astype(np.int64)
        inside = np.flatnonzero(
            (down >= 0) & (right >= 0) & (down < seen.shape[0]) & (right < seen.shape[1])
        )
        # The last one written stays: of the largest disparity, and of the smallest.
        levels, disparities = np.full((2, 2, *seen.shape), np.nan)
        for end, order in enumerate((inside, inside[::-1])):
            levels[end, down[order], right[order]] = shown[order]
            disparities[end, down[order], right[order]] = moves[order]
        distance = max(abs(v - middle[0]), abs(u - middle[1]))
        apart = (disparities[0] - disparities[1]) * distance > _APART
        meet = apart & (np.abs(levels[0] - levels[1]) > clear)
        # Pixels lie between those of the other view: any level of the nine around is equal.
        low, high = ndimage.minimum_filter(seen, 3)[meet], ndimage.maximum_filter(seen, 3)[meet]
        larger, smaller = np.abs(levels[:, meet] - np.clip(levels[:, meet], low, high))
        votes.append(np.sign(smaller - larger))
    cast = np.concatenate(votes)
    cast = cast[cast != 0]
    mean = float(cast.mean()) if len(cast) >= _FEWEST else 0.0
    return mean if abs(mean) > _MEAN and abs(mean) * len(cast) ** 0.5 > _CERTAIN else 0.0


def _outer(rows: int, columns: int) -> list[tuple[int, int]]:
    """Places of views far from the middle."""
    middle = rows // 2, columns // 2
    least = max(1, max(middle) - 1)
    places = [
        place
        for place in np.ndindex(rows, columns)
        if max(abs(place[0] - middle[0]), abs(place[1] - middle[1])) >= least
    ]
    return places[:: -(-len(places) // _VIEWS)]
