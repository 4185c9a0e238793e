# SPDX-License-Identifier: Apache-2.0
"""Disparity by the structure tensors of epipolar plane images (EPI).

What one line of the views in a row sees, stacked over the views, shows a point as a straight line
whose slope is its disparity. S. Wanner, B. Goldluecke, Variational light field analysis, IEEE TPAMI
36(3), 2014. It takes five views a side or more: derivatives over fewer are too small.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

# Standard deviation of the derivatives' kernels, in views and pixels.
_INNER = 0.7
# Slopes are found to a pixel per view at most, and well to half of that.
_WELL = 0.6


def structure_tensor_disparity(
    images: Image,
    search: tuple[float, float],
    window: int,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Floats, Floats]:
    """Disparity of the central view in pixels per view, and coherence from 0 to 1; both (t, s).

    `images`: views (v, u, t, s[, 3]), of which those of the central column and row are used where
    there are several. `search`: smallest and largest disparity. Views are moved by each whole
    number of pixels per view in between, and the most coherent slope is taken. `window`:
    approximate side of the averaged area.
    """
    centres = [count // 2 for count in images.shape[:2]]
    moves = np.arange(np.round(search[0]), np.round(search[1]) + 1).astype(int)
    best: Floats = np.zeros(images.shape[2:4])
    coherence: Floats = np.full(best.shape, -1.0)
    for number, move in enumerate(moves.tolist()):
        for axis in (axis for axis in (0, 1) if images.shape[axis] > 1):
            centre = centres[axis]
            line = images[:, centres[1]] if axis == 0 else images[centres[0]]
            moved = []
            for view, picture in enumerate(line, -centre):
                place = np.arange(picture.shape[axis]) - move * view
                place = np.clip(place, 0, picture.shape[axis] - 1)
                moved.append(np.take(grey(picture).astype(np.float64), place, axis))
            slope, sure = _slopes(np.stack(moved), axis, window / 4, centre)
            better = (sure > coherence) & (np.abs(slope) <= _WELL)
            best[better], coherence[better] = move + slope[better], sure[better]
        if progress is not None:
            progress(number + 1, len(moves))
    return np.clip(best, *search), np.maximum(coherence, 0)


def _slopes(lines: Floats, axis: int, sigma: float, centre: int) -> tuple[Floats, Floats]:
    """Slope and coherence at the middle one of views of shape (views, t, s)."""
    kernel = [_INNER if k in (0, axis + 1) else 0.0 for k in range(3)]
    across, along = (
        ndimage.gaussian_filter(lines, kernel, [int(k == turned) for k in range(3)], mode="nearest")
        for turned in (0, axis + 1)
    )
    averages = []
    for product in (along * along, along * across, across * across):
        over_views = ndimage.gaussian_filter1d(product, sigma, 0, mode="nearest")[centre]
        averages.append(ndimage.gaussian_filter(over_views, sigma, mode="nearest"))
    same, mixed, views_ = averages
    # A point is at x - a u, so brightness rises with u as it does with a x.
    difference = same - views_
    slope = np.tan(0.5 * np.arctan2(2 * mixed, difference))
    total = same + views_
    ratio = (difference**2 + 4 * mixed**2) / np.maximum(total, 1e-9) ** 2
    return slope, np.where(total > 1e-6, np.sqrt(ratio), 0.0)
