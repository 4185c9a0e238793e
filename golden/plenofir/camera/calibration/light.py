# SPDX-License-Identifier: Apache-2.0
"""The smooth part of a white image's brightness: fitted to lenses, divided out of the image."""

import numpy as np

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Floats, exponents, polynomial_terms
from plenofir.camera.calibration.robust import robust_fit
from plenofir.camera.calibration.shading import order_of, unit_positions

_ORDER = 4
# Lower limit of the light that is divided by, as a share of the brightest.
_DARKEST = 0.03
# Brightness, as a share of the brightest, at which lenses have half the weight.
_HALF_WEIGHT = 0.15
# Usual size of the terms of each order.
_USUAL = (0.0, 0.5, 0.7, 0.2, 0.3)
_BAND = 32


def light_order(lenses: int) -> int:
    """Order of the polynomial that this many lenses determine."""
    return next((n for n in range(_ORDER, 0, -1) if lenses >= 4 * n * n + 1), 0)


def constant(value: float, coefficients: Floats) -> Floats:
    """Coefficients of a constant in a polynomial like another."""
    return np.concatenate([[value], np.zeros(len(coefficients) - 1)])


def counting(light: Floats) -> Floats:
    """Weights of lenses by the light on them."""
    light = light / light.max()
    return np.asarray(light**2 / (light**2 + _HALF_WEIGHT**2))


def fitted_light(
    places: Floats, level: Floats, probes: Floats, shape: tuple[int, int]
) -> tuple[Floats, Floats]:
    """Coefficients of the logarithm of the light, from levels at places of an image.

    `probes` are 1 at places around the middle of a micro image. These are darker than the middle by
    the same share in all micro images, so they give the slope of the light besides its level. All
    terms up to order 4 have priors, so where lenses differ among themselves more than the light
    does, it is even. Result: the coefficients, and their covariance.
    """
    positions = unit_positions(places, shape)
    lenses = len(places) / (5 if probes.any() else 1)
    prior = counting(level)
    logs = np.log(level)[:, np.newaxis]

    def terms(order: int) -> Floats:
        smooth = polynomial_terms(positions, order)
        return np.hstack([smooth, probes[:, np.newaxis]]) if probes.any() else smooth

    _, weights, scatter = robust_fit(terms(light_order(int(lenses))), logs, 1e-3, prior)
    rich = terms(_ORDER)
    precisions = np.zeros(rich.shape[1])
    # Light changes less along a shorter side.
    y, x = np.array(shape) / max(shape)
    spreads = [_USUAL[m + n] * y**m * x**n for m, n in exponents(_ORDER)]
    size = len(spreads)
    precisions[1:size] = np.array(spreads[1:]) ** -2
    weighted = rich * weights[:, np.newaxis] / scatter**2
    covariance = np.asarray(np.linalg.pinv(weighted.T @ rich + np.diag(precisions)))
    coefficients = covariance @ weighted.T @ logs[:, 0]
    return np.asarray(coefficients[:size]), np.asarray(covariance[:size, :size], np.float64)


def divide_by_light(image: Image32, dark: float, coefficients: Floats, result: Image32) -> None:
    """Subtract an image's dark level and divide the rest by the light."""
    order = order_of(coefficients)
    table = np.zeros((order + 1, order + 1), dtype=np.float32)
    for value, (m, n) in zip(coefficients, exponents(order), strict=True):
        table[m, n] = value
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) for n in image.shape)
    lines = np.polynomial.polynomial.polyvander(y, order) @ table
    # A few lines at a time, which fit the processor's cache.
    for start in range(0, len(y), _BAND):
        band = slice(start, start + _BAND)
        shade = np.zeros((len(lines[band]), len(x)), dtype=np.float32)
        for term in lines[band].T[::-1]:
            shade *= x
            shade += term[:, np.newaxis]
        np.clip(shade, np.float32(np.log(_DARKEST)), np.float32(0), out=shade)
        np.exp(shade, out=shade)
        np.divide(image[band] - np.float32(dark), shade, out=result[band])
