# SPDX-License-Identifier: Apache-2.0
"""Views of three textured planes with exact parallax, computed without the package.

The background has disparity -1, a disc in the upper left 0, one in the lower right +1.
"""

from functools import lru_cache

import numpy as np

PLANES = ((-1.0, None), (0.0, (0.30, 0.45, 0.18)), (1.0, (0.70, 0.60, 0.20)))


def texture(x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    waves = np.zeros((*x.shape, 3))
    for _ in range(24):
        frequency, turn, phase = rng.uniform((0.05, 0, 0), (0.9, 2 * np.pi, 2 * np.pi))
        wave = np.sin(frequency * (x * np.cos(turn) + y * np.sin(turn)) + phase)
        waves += 0.09 * rng.uniform(-1, 1, 3) * wave[..., np.newaxis]
    return np.clip(0.5 + waves, 0, 1)


def places(
    rows: int, columns: int, aside: float, disparity: float, scale: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Where pixels (`scale` samples of each) see a plane, from `aside` views below and right."""
    y, x = ((np.arange(n * scale) - (scale - 1) / 2) / scale for n in (rows, columns))
    down, right = np.meshgrid(y, x, indexing="ij")
    return down + disparity * aside, right + disparity * aside


def disc_view(v: float, u: float, rows: int, columns: int, scale: int = 1) -> np.ndarray:
    """The view v below and u right of the middle, 0 to 255."""
    image = np.zeros((rows * scale, columns * scale, 3))
    for seed, (disparity, disc) in enumerate(PLANES):
        down = places(rows, columns, v, disparity, scale)[0]
        right = places(rows, columns, u, disparity, scale)[1]
        shown = np.ones((*down.shape, 1))
        if disc is not None:
            distance = np.hypot(right - disc[0] * columns, down - disc[1] * rows)
            shown = np.clip(disc[2] * rows - distance + 0.5, 0, 1)[..., np.newaxis]
        image += shown * (texture(right, down, seed) - image)
    return 255 * image


@lru_cache(maxsize=4)
def disc_views(m: int, rows: int = 72, columns: int = 96) -> np.ndarray:
    """Views (v, u, rows, columns, 3), uint8: what has disparity d at x is at x - d u in view u."""
    views = np.empty((m, m, rows, columns, 3), np.uint8)
    for v, u in np.ndindex(m, m):
        views[v, u] = np.rint(disc_view(v - (m - 1) / 2, u - (m - 1) / 2, rows, columns))
    return views


def true_disparity(rows: int = 72, columns: int = 96, aside: float = 0.0) -> np.ndarray:
    """Disparity of the view `aside` below and right of the middle."""
    result = np.full((rows, columns), PLANES[0][0])
    for disparity, disc in PLANES[1:]:
        assert disc is not None
        down, right = places(rows, columns, aside, disparity)
        inside = np.hypot(right - disc[0] * columns, down - disc[1] * rows) < disc[2] * rows
        result[inside] = disparity
    return result
