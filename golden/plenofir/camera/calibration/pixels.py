# SPDX-License-Identifier: Apache-2.0
"""Fit of a grid to the pixels of small micro images whose centres lie alike between pixels.

Micro images of a few pixels have details finer than a pixel, so pixels pull their centroids
(`plenofir.camera.calibration.moire`). Where all centres lie at nearly the same place between pixels
(an integer pitch, a small rotation), the pull looks like another pitch. The pixels contain more
information than centroids: they are samples of one periodic function, the mean micro image
convolved with a pixel's area,

    pixel at x = L(x) S(x - centre),    S(d) = sum over k of a_k b_k cos(2 pi k . u(d))

with the light L (a polynomial in x), lattice coordinates u, and pairs of integers k. There are only
cosines, as S is symmetric about its middle, which defines the centre. All k that are equivalent by
the lattice's symmetry share one a_k; b_k is the pixel's transfer function, a product of sinc (1 in
square lattices: square pixels have their symmetry, so a_k includes it). Grid, light and a_k are
fitted together (Gauss-Newton), with a prior by which a_k decreases with k.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.centroids import HALF_WIDTH, Image32, raised_cosine
from plenofir.camera.calibration.grid import Floats, Indices, exponents, polynomial_terms
from plenofir.camera.calibration.shading import unit_positions

# Highest modelled frequency in waves per pixel; pixels average finer details away.
_FINEST = 2.1
# Prior standard deviation of a_k at the lowest frequency, as a share of the mean brightness. It
# decreases with the square of the frequency, as the spectrum of a profile with sharp bends does.
_USUAL = 0.5
_LIGHT_ORDER = 4
_STEPS = 6
_SMALL_STEP = 1e-4
_ROWS = 1 << 11
# Pixels of all lenses that are fitted. Each has an equation with all parameters, so time grows with
# their number, and the scatter of the lenses tells the error whatever their number is.
_MOST_ROWS = 30_000


@dataclass(frozen=True)
class PixelFit:
    """Factors of a grid's terms fitted to pixels, and their covariance."""

    factors: Floats
    covariance: Floats


def _waves(vectors: Floats, *, square: bool) -> tuple[Indices, Floats, Floats]:
    """Waves k of half the plane, the class and weight b_k of each, and prior deviations of a_k."""
    reciprocal = np.linalg.inv(vectors)
    reach = np.arange(-16, 17)
    k = np.stack(np.meshgrid(reach, reach, indexing="ij"), axis=-1).reshape(-1, 2)
    k = k[(k[:, 0] > 0) | ((k[:, 0] == 0) & (k[:, 1] > 0))]
    waves = k @ reciprocal.T
    pace = np.linalg.norm(waves, axis=1)
    slow = pace < _FINEST
    k, waves, pace = k[slow], waves[slow], pace[slow]
    if square:
        alike = np.sort(np.abs(k), axis=1)
    else:  # The reciprocal vectors of neighbours 60 degrees apart are 120 degrees apart.
        alike = np.sort(np.abs(np.stack([k[:, 0], k[:, 1], k[:, 0] - k[:, 1]], axis=1)), axis=1)
    _, first, number = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    classes = np.zeros((len(k), len(first)))
    classes[np.arange(len(k)), number.ravel()] = 1.0 if square else np.sinc(waves).prod(axis=1)
    return k, classes, _USUAL * (pace[first] / pace.min()) ** -2


def _turns(lattice: Floats, k: Indices) -> npt.NDArray[np.complex128]:
    """exp(2 pi i k . u) for all waves, from powers."""
    highest = int(np.abs(k).max())
    powers = []
    for axis in (0, 1):
        once = np.exp(2j * np.pi * lattice[..., axis])
        line = np.empty((*once.shape, highest + 1), dtype=np.complex128)
        line[..., 0] = 1.0
        for n in range(highest):
            line[..., n + 1] = line[..., n] * once
        powers.append(line)
    # k[:, 0] is never negative.
    second = np.take(powers[1], np.abs(k[:, 1]), axis=-1)
    np.conjugate(second, out=second, where=k[:, 1] < 0)
    second *= np.take(powers[0], k[:, 0], axis=-1)
    return second


def pixel_fit(
    image: Image32,
    margin: int,
    vectors: Floats,
    places: Floats,
    terms: Floats,
    factors: Floats,
    weights: Floats,
    *,
    square: bool,
) -> PixelFit:
    """Fit a grid to the pixels around its lenses.

    The image has a margin, included in `places`, whose pixels are not fitted. `vectors` are those
    of neighbouring lenses in the middle, shape (2, 2). Lenses are at `places`, shape (n, 2), plus
    the product of `terms`, shape (n, 2, factors), and the factors; `weights` are theirs.
    """
    inverse = np.linalg.inv(vectors)
    k, classes, usual = _waves(vectors, square=square)
    half = HALF_WIDTH * float(np.linalg.norm(vectors, axis=1).max())
    side = int(half + 0.5)
    steps = np.arange(-side, side + 1)
    windows = np.lib.stride_tricks.sliding_window_view(image, (len(steps),) * 2)
    shape = image.shape[0] - 2 * margin, image.shape[1] - 2 * margin
    counting = np.random.default_rng(5).permutation(np.nonzero(weights > 0)[0])
    lenses = counting[: _MOST_ROWS // len(steps) ** 2]
    places, terms, weights = places[lenses], terms[lenses], weights[lenses]
    ends = np.cumsum([0, len(factors), 1 + classes.shape[1], len(exponents(_LIGHT_ORDER)) - 1])
    grid, spot, light = (slice(*part) for part in pairwise(ends))
    # Parameters: the grid's factors, a_k (k = 0 first), the light's coefficients (constant first).
    parameters = np.zeros(ends[-1])
    parameters[grid] = factors
    precisions = np.zeros(len(parameters))
    block = max(1, _ROWS // len(steps) ** 2)
    for n in range(_STEPS + 1):
        matrix = np.zeros((len(parameters), len(parameters)))
        scores = np.zeros((len(lenses), len(parameters)))
        noise = total = 0.0
        centres = places + terms @ parameters[grid]
        for start in range(0, len(lenses), block):
            part = slice(start, start + block)
            corner = np.rint(centres[part]).astype(np.int64)
            values = windows[corner[:, 0] - side, corner[:, 1] - side].reshape(len(corner), -1)
            y, x = np.moveaxis((corner - centres[part])[:, np.newaxis] + steps[:, np.newaxis], 2, 0)
            window = (
                raised_cosine(y, half)[:, :, np.newaxis] * raised_cosine(x, half)[:, np.newaxis]
            )
            window = window.reshape(values.shape) * weights[part, np.newaxis]
            away = np.stack(np.broadcast_arrays(y[:, :, np.newaxis], x[:, np.newaxis]), axis=-1)
            away = away.reshape(*values.shape, 2)
            turns = _turns(away @ inverse, k)
            waves = np.concatenate([np.ones((*values.shape, 1)), turns.real @ classes], axis=-1)
            model = waves @ parameters[spot]
            slopes = turns.imag @ ((classes @ parameters[spot][1:])[:, np.newaxis] * k)
            slopes = 2 * np.pi * slopes @ inverse.T
            position = unit_positions(away + centres[part, np.newaxis] - margin, shape)
            bends = polynomial_terms(position, _LIGHT_ORDER)[..., 1:]
            level = 1 + bends @ parameters[light]
            columns = np.concatenate(
                [
                    (slopes * level[..., np.newaxis]) @ terms[part],
                    waves * level[..., np.newaxis],
                    bends * model[..., np.newaxis],
                ],
                axis=-1,
            )
            residuals = values - level * model
            weighted = columns * window[..., np.newaxis]
            matrix += weighted.reshape(-1, len(parameters)).T @ columns.reshape(-1, len(parameters))
            scores[part] = np.einsum("npc,np->nc", weighted, residuals)
            noise += float((window * residuals**2).sum())
            total += float(window.sum())
        sums = scores.sum(axis=0)
        if n == 0:
            # S is unknown in the first round, so its slopes, and shifts of centres, are too.
            gram = matrix[spot, spot]
            ridge = 1e-9 * np.trace(gram) * np.eye(len(gram))
            parameters[spot] = np.linalg.solve(gram + ridge, sums[spot])
            continue
        precisions[spot][1:] = noise / total / (parameters[spot][0] * usual) ** 2
        uncertainty = np.linalg.inv(matrix + np.diag(precisions))
        step = uncertainty @ (sums - precisions * parameters)
        parameters += step
        if np.abs(step[grid]).max() < _SMALL_STEP:
            break
    # From the scatter of single lenses' contributions, with the prior of a_k.
    spread = scores.T @ scores + noise / total * np.diag(precisions)
    covariance = uncertainty @ spread @ uncertainty
    return PixelFit(parameters[grid], covariance[grid, grid])
