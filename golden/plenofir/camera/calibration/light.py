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
_BAND = 32  # unseen
_FEWEST_ROUND = 25


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
    places: Floats, level: Floats, probes: Floats, shape: tuple[int, int], *, every: bool
) -> Floats:
    """Coefficients of the logarithm of the light, from levels at places of an image.

    `probes` are 1 at places around the middle of a micro image. These are darker than the middle by
    the same share in all micro images, so they give the slope of the light besides its level. Where
    lenses differ among themselves more than the light does, a lower order is fitted, unless `every`
    term is asked for.
    """
    positions = unit_positions(places, shape)
    count = len(places) * (3 / 5 if probes.any() else 1)
    prior = counting(level)
    order = light_order(int(count))
    if not every:
        lenses = len(places) / (5 if probes.any() else 1)
        costs = []
        for n in range(order + 1):
            terms = polynomial_terms(positions, n)
            size = terms.shape[1]
            if probes.any():
                terms = np.concatenate([terms, probes[:, np.newaxis]], axis=1)
            scatter = robust_fit(terms, np.log(level)[:, np.newaxis], 1e-3, prior)[2]
            # The Bayesian information criterion.
            costs.append(lenses * np.log(scatter**2) + size * np.log(lenses))
        best = int(np.argmin(costs))
        if best < min(order, 2):
            order = best
    # Rotationally symmetric fall-off adds one term of order 4, for which fewer lenses suffice.
    rounded = 1 < order < _ORDER and count >= _FEWEST_ROUND
    terms = polynomial_terms(positions, 2 if rounded else order)
    # Product of these and the squared positions: squared distance from the middle.
    y, x = (np.array(shape) - 1.0) ** 2 / ((np.array(shape) - 1.0) ** 2).sum()
    if rounded:
        order = _ORDER
        squares = positions**2 @ (y, x)
        terms = np.concatenate([terms, squares[:, np.newaxis] ** 2], axis=1)
    smooth = terms.shape[1]
    if probes.any():
        terms = np.concatenate([terms, probes[:, np.newaxis]], axis=1)
    coefficients = robust_fit(terms, np.log(level)[:, np.newaxis], 1e-3, prior)[0][:smooth, 0]
    if not rounded:
        return np.asarray(coefficients)
    found = np.concatenate([coefficients[:-1], np.zeros(len(exponents(order)) - smooth + 1)])
    for power, part in {(4, 0): y * y, (2, 2): 2 * x * y, (0, 4): x * x}.items():
        found[exponents(order).index(power)] = part * coefficients[-1]
    return found


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
