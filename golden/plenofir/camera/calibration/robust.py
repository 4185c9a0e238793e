# SPDX-License-Identifier: Apache-2.0
"""Robust least squares."""

from math import sqrt

import numpy as np

from plenofir.camera.calibration.grid import (
    Floats,
)

# Tukey's biweight: residuals beyond this many (robust) standard deviations do not count.
_TUKEY = 6.0


def weighted_fit(terms: Floats, values: Floats, weights: Floats) -> Floats:
    """Linear least squares."""
    # The terms' arguments are within -1 and 1, which keeps the normal equations well conditioned.
    weighted = terms * weights[:, np.newaxis]
    return np.asarray(np.linalg.lstsq(weighted.T @ terms, weighted.T @ values, rcond=None)[0])


def robust_fit(
    terms: Floats, values: Floats, floor: float, prior: Floats | None = None, rounds: int = 12
) -> tuple[Floats, Floats, float]:
    """Robust least squares: iteratively reweighted, with Tukey's biweight."""
    prior = np.ones(len(values)) if prior is None else prior
    weights: Floats = prior
    scale = 0.0
    for _ in range(rounds):
        coefficients = weighted_fit(terms, values, weights)
        residual = values - terms @ coefficients
        residual = residual * np.sqrt(prior)[:, np.newaxis]
        spread = 1.4826 * float(np.median(np.abs(residual)))
        scale = max(spread * sqrt(len(terms) / max(1, len(terms) - terms.shape[1])), floor)
        distance = np.sqrt((residual**2).sum(axis=1)) / (_TUKEY * scale)
        new = prior * np.where(distance < 1, (1 - distance**2) ** 2, 0.0)
        if np.abs(new - weights).max() < 1e-3:
            weights = new
            break
        weights = new
    return weighted_fit(terms, values, weights), weights, scale
