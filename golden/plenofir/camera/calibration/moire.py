# SPDX-License-Identifier: Apache-2.0
"""Fit of a grid to centroids that pixels pull.

Sharp micro images of a few pixels have details finer than a pixel. So a centroid is pulled a
little, depending on where the centre lies between pixels. Along each axis

    pull = b1 sin(2 pi centre) + b2 sin(4 pi centre)

with the same strengths b1, b2 for all micro images and both axes; by symmetry there are no cosines.
Pulls cancel out where centres lie everywhere between pixels. At an integer pitch and a small
rotation they drift by little, and pulls look like another pitch and another rotation. So the
strengths are fitted together with the grid.
"""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.robust import robust_fit

# Standard deviations of the strengths times the pitch, in square pixels: what is known beforehand.
_USUAL = np.array([0.2, 0.02])
_ROUNDS = 3
_STEPS = 4
_SMALL_STEP = 1e-6


@dataclass(frozen=True)
class PulledFit:
    """Polynomial of a grid, strengths of the pull, robust weights and scatter in pixels.

    `covariance` is that of the coefficients for y and for x, shape (2, terms, terms).
    """

    coefficients: Floats
    strengths: Floats
    weights: Floats
    scatter: float
    covariance: Floats

    def centroids(self, terms: Floats) -> Floats:
        """Centroids that the fit predicts, pulls included."""
        centres = np.asarray(terms @ self.coefficients)
        return centres + _waves(centres)[0] @ self.strengths


def _waves(centres: Floats) -> tuple[Floats, Floats]:
    """Pulls of strength 1 and their slopes, shape (lenses, 2 axes, strengths)."""
    turn = 2 * np.pi
    sine, cosine = np.sin(turn * centres), np.cos(turn * centres)
    pulls = np.stack([sine, 2 * sine * cosine], axis=-1)
    return pulls, np.stack([turn * cosine, 2 * turn * (1 - 2 * sine**2)], axis=-1)


def pulled_fit(
    terms: Floats, values: Floats, floor: float, prior: Floats, pitch: float | None
) -> PulledFit:
    """Fit a polynomial robustly, and with it the pull at this pitch (None: there is none)."""
    count = terms.shape[1]
    strengths = np.zeros(len(_USUAL))
    coefficients, weights, scatter = robust_fit(terms, values, floor, prior)
    if pitch is None:
        inverse = np.linalg.pinv((terms * weights[:, np.newaxis]).T @ terms)
        covariance = np.stack([scatter**2 * inverse] * 2)
        return PulledFit(coefficients, strengths, weights, scatter, covariance)
    known = np.diag((pitch / _USUAL) ** 2)
    axes = [slice(0, count), slice(count, 2 * count)]
    pull = slice(2 * count, None)
    for _ in range(_ROUNDS):
        # Gauss-Newton, as pulls depend on the centres.
        for _ in range(_STEPS):
            centres = terms @ coefficients
            waves, slopes = _waves(centres)
            left = values - centres - waves @ strengths
            matrix = np.zeros((2 * count + len(known),) * 2)
            right = np.zeros(len(matrix))
            matrix[pull, pull] = scatter**2 * known
            right[pull] = -(scatter**2) * known @ strengths
            for axis, own in enumerate(axes):
                tilted = terms * (1 + slopes[:, axis] @ strengths)[:, np.newaxis]
                wave = np.ascontiguousarray(waves[:, axis])
                weighted, pulled = (part * weights[:, np.newaxis] for part in (tilted, wave))
                matrix[own, own] = weighted.T @ tilted
                matrix[own, pull] = weighted.T @ wave
                matrix[pull, own] = matrix[own, pull].T
                matrix[pull, pull] += pulled.T @ wave
                right[own] = weighted.T @ left[:, axis]
                right[pull] += pulled.T @ left[:, axis]
            inverse = np.linalg.pinv(matrix)
            step = inverse @ right
            coefficients = coefficients + np.stack([step[own] for own in axes], axis=-1)
            strengths = strengths + step[pull]
            if np.abs(step).max() < _SMALL_STEP:
                break
        pulls = _waves(terms @ coefficients)[0] @ strengths
        coefficients, weights, scatter = robust_fit(terms, values - pulls, floor, prior)
    covariance = scatter**2 * np.stack([inverse[own, own] for own in axes])
    return PulledFit(coefficients, strengths, weights, scatter, covariance)
