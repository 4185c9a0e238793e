# SPDX-License-Identifier: Apache-2.0
"""Errata of chapter 4, the calibration."""

from collections.abc import Callable
from math import ceil, floor

import numpy as np
import numpy.typing as npt

from plenofir_studies.errata.entry import Erratum, Shown
from plenofir_studies.thesis_calibration import regression, rotated

Weights = Callable[[float, float], npt.NDArray[np.float64]]
"""Weights of the four neighbours, [g, i], of a centre at (x, y)."""

_FRACTIONS = np.linspace(0, 0.99, 34)


def bilinear(x: float, y: float) -> npt.NDArray[np.float64]:
    """Weights of plain bilinear interpolation."""
    fx, fy = x - floor(x), y - floor(y)
    return np.outer([1 - fy, fy], [1 - fx, fx])


def printed_equation(x: float, y: float) -> npt.NDArray[np.float64]:
    """Weights as Eq. (4.11) prints them."""
    fx, fy = x - floor(x), y - floor(y)
    up_x, up_y = ceil(x) - x, ceil(y) - y
    weights = np.empty((2, 2))
    for g in (0, 1):
        for i in (0, 1):
            right, low = fx + i >= 0.5, fy + g >= 0.5
            if right and low:
                weights[g, i] = fx * fy
            elif right:
                weights[g, i] = up_x * fy
            elif low:
                weights[g, i] = fx * up_y
            else:
                weights[g, i] = up_x * up_y
    return weights


def printed_algorithm(x: float, y: float) -> npt.NDArray[np.float64]:
    """Weights as Algorithm 1 (appendix B) prints them."""
    fx, fy = x - floor(x), y - floor(y)
    along_x = [fx, 1 - fx] if fx >= 0.5 else [1 - fx, fx]
    along_y = [fy, 1 - fy] if fy >= 0.5 else [1 - fy, fy]
    return np.outer(along_y, along_x)


def _worst(way: Weights, picture: npt.NDArray[np.float64]) -> float:
    """Largest distance from the value of a picture that is linear in x and y."""
    slope_x, slope_y = picture[0, 1] - picture[0, 0], picture[1, 0] - picture[0, 0]
    worst = 0.0
    for x in _FRACTIONS:
        for y in _FRACTIONS:
            want = picture[0, 0] + x * slope_x + y * slope_y
            worst = max(worst, abs(float((way(x, y) * picture).sum()) - float(want)))
    return worst


def _weights_of_the_equation() -> Shown:
    picture = np.array([[100.0, 101.0], [102.0, 103.0]])
    low, high = printed_equation(0.2, 0.4), printed_equation(0.7, 0.7)
    return Shown(
        "A picture of grey levels 100 to 103 that rises by 1 for each pixel in x and by 2 in y. At "
        f"(0.2, 0.4) the neighbours (1, 0) and (0, 1) get {low[0, 1]:.2f} and {low[1, 0]:.2f} "
        f"instead of {bilinear(0.2, 0.4)[0, 1]:.2f} and {bilinear(0.2, 0.4)[1, 0]:.2f}: the second "
        f"and third line are exchanged. At (0.7, 0.7) the weights sum to {high.sum():.2f}, at a "
        f"centre on a pixel to {printed_equation(0, 0).sum():.0f}. Largest error "
        f"{_worst(printed_equation, picture):.0f} grey levels; bilinear weights have none.",
        _worst(printed_equation, picture),
        _worst(bilinear, picture),
        1e-9,
    )


def _weights_of_the_algorithm() -> Shown:
    picture = np.array([[100.0, 101.0], [102.0, 103.0]])
    values = [float((printed_algorithm(x, 0.0) * picture).sum()) for x in (0.49, 0.51, 0.99)]
    return Shown(
        "The same picture, along its first row: 0.49, 0.51 and 0.99 pixels from the left pixel it "
        f"gives {values[0]:.2f}, {values[1]:.2f} and {values[2]:.2f}: from one half on the value "
        "goes back to the left pixel. Largest error "
        f"{_worst(printed_algorithm, picture):.2f} grey levels.",
        _worst(printed_algorithm, picture),
        _worst(bilinear, picture),
        1e-9,
    )


def _rotation() -> Shown:
    shape = 600, 900
    columns = np.arange(30, 871, 14.0)
    row = rotated(np.stack([np.full_like(columns, 300.0), columns], axis=-1), 1.0, shape)
    beta = float(np.degrees(np.arctan(regression(row)[1])))
    slopes = {
        sign: float(np.degrees(np.arctan(regression(rotated(row, sign * beta, shape))[1])))
        for sign in (1, -1)
    }
    return Shown(
        f"A row of centres with a slope of {beta:.3f} degree (Eqs. 4.4 to 4.6): rotated by +beta "
        f"it has {slopes[1]:.3f} degree, by -beta {abs(slopes[-1]):.3f}.",
        abs(slopes[1]),
        abs(slopes[-1]),
        1e-9,
    )


def _hexagonal() -> Shown:
    # Distances of samples, in lens distances, after the doubling of the columns.
    along, across = 0.5, np.sqrt(3) / 2
    printed, holds = along / (across * np.sqrt(3)), along * np.sqrt(3) / across
    return Shown(
        f"Behind the doubling, samples are {along} lens distances apart along the rows and "
        f"{across:.3f} across them. Down-sampled by sqrt(3) across the rows they are {printed:.3f} "
        f"times as far apart along the rows as across, along the rows {holds:.3f} times.",
        float(abs(printed - 1)),
        float(abs(holds - 1)),
        1e-9,
    )


ERRATA = (
    Erratum(
        "weights-of-eq-4-11",
        "Eq. 4.11",
        "weights of the four pixels around a micro image centre, in four cases",
        "plain bilinear weights: (1 - x)(1 - y), x (1 - y), (1 - x) y, x y with x, y the fractions "
        "of the centre, in all cases",
        _weights_of_the_equation,
    ),
    Erratum(
        "weights-of-algorithm-1",
        "Algorithm 1 (appendix B)",
        "the weights are mirrored where a fraction is 0.5 or more",
        "plain bilinear weights; it disagrees with Eq. 4.11 too",
        _weights_of_the_algorithm,
    ),
    Erratum(
        "rotation",
        "Eqs. 4.6, 4.7",
        "to level the micro images they are rotated by +beta, the angle of their row",
        "by -beta",
        _rotation,
    ),
    Erratum(
        "hexagonal-grid",
        "Section 4.2.2, below Eq. 4.12",
        "views of a hexagonal array: doubled in one dimension, then down-sampled by sqrt(3) in the "
        "other one",
        "down-sampled by sqrt(3) in the same dimension, as the thesis does a page on (Fig. 4.11)",
        _hexagonal,
    ),
)
