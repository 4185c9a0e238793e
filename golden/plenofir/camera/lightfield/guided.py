# SPDX-License-Identifier: Apache-2.0
"""Means that stop at the edges of a picture: the guided filter.

K. He, J. Sun, X. Tang, Guided image filtering, IEEE TPAMI 35(6), 2013: in each window what is
averaged is taken for a linear function of the picture's colours.
"""

import numpy as np
import numpy.typing as npt
from scipy import ndimage

Floats = npt.NDArray[np.float64]

# Variance of a window, as a share of the picture's, up to which it counts as even.
_EVEN = 0.01


class GuidedMean:
    """Means over windows of some pixels a side (odd), guided by a picture (rows, columns[, 3])."""

    def __init__(self, picture: npt.NDArray[np.generic], window: int) -> None:
        colours = np.atleast_3d(picture).astype(np.float64)
        self.window = window
        self.colours = np.moveaxis(colours / max(float(colours.std()), 1e-9), 2, 0)
        self.means = [self._mean(colour) for colour in self.colours]
        count = len(self.colours)
        spread = np.empty((*colours.shape[:2], count, count))
        for i, j in np.ndindex(count, count):
            product = self._mean(self.colours[i] * self.colours[j])
            spread[..., i, j] = product - self.means[i] * self.means[j]
        self.inverse = np.linalg.inv(spread + _EVEN * np.eye(count))

    def _mean(self, values: Floats) -> Floats:
        return np.asarray(ndimage.uniform_filter(values, self.window, mode="nearest"))

    def __call__(self, values: Floats) -> Floats:
        """Means of values, shape (rows, columns)."""
        mean = self._mean(values)
        pairs = zip(self.colours, self.means, strict=True)
        common = np.stack([self._mean(c * values) - m * mean for c, m in pairs], axis=-1)
        slopes = np.moveaxis(np.einsum("...ij,...j->...i", self.inverse, common), -1, 0)
        rest = mean - sum(s * m for s, m in zip(slopes, self.means, strict=True))
        smooth = sum(self._mean(s) * c for s, c in zip(slopes, self.colours, strict=True))
        return np.asarray(smooth + self._mean(rest))
