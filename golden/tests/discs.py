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


@lru_cache(maxsize=4)
def disc_views(m: int, rows: int = 72, columns: int = 96) -> np.ndarray:
    """Views (v, u, rows, columns, 3), uint8: what has disparity d at x is at x - d u in view u."""
    y, x = np.mgrid[:rows, :columns].astype(float)
    found = np.empty((m, m, rows, columns, 3), np.uint8)
    for v, u in np.ndindex(m, m):
        image = np.zeros((rows, columns, 3))
        for seed, (disparity, disc) in enumerate(PLANES):
            right, down = (x + disparity * (u - (m - 1) / 2), y + disparity * (v - (m - 1) / 2))
            shown = np.ones((rows, columns, 1))
            if disc is not None:
                distance = np.hypot(right - disc[0] * columns, down - disc[1] * rows)
                shown = np.clip(disc[2] * rows - distance + 0.5, 0, 1)[..., np.newaxis]
            image += shown * (texture(right, down, seed) - image)
        found[v, u] = np.rint(255 * image)
    return found


def true_disparity(rows: int = 72, columns: int = 96) -> np.ndarray:
    """Disparity of the central view."""
    y, x = np.mgrid[:rows, :columns].astype(float)
    found = np.full((rows, columns), PLANES[0][0])
    for disparity, disc in PLANES[1:]:
        assert disc is not None
        inside = np.hypot(x - disc[0] * columns, y - disc[1] * rows) < disc[2] * rows
        found[inside] = disparity
    return found
