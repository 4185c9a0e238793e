# SPDX-License-Identifier: Apache-2.0
"""Which lenses are of which type, by how sharp a textured scene is under each.

A micro lens that is sharpest at 1 / v = x_i blurs what lies at x by b = p |x_i - x| pixels, so the
energy of fine structure falls about as exp(-beta b^2). Pictures of the same places by lenses of one
kind each differ in its logarithm by 2 beta p^2 x_i x - beta p^2 x_i^2 and what they have in common:
straight lines over the scene's x. The slopes order the types, the crossings of
lines say where they are sharp; a camera's lengths say both, and lines of one x will do.
"""

from itertools import pairwise, permutations
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.grid import Floats, Indices
from plenofir.camera.calibration.shading import lens_indices
from plenofir.camera.calibration.types_of_lenses import LensTypes, usual_order
from plenofir.camera.focused.capture import FocusedCapture
from plenofir.camera.focused.depth import search_depth
from plenofir.ground.errors import InputError

# Sigma in places of what is too smooth to count.
_SMOOTH = 2.0
# Blocks as large as a micro image are compared. They need a sure depth that moves the content by
# less than so many pixels, this share of places that all types see, and so many times the energy of
# what is even; so many blocks must be left.
_SURE, _EVEN, _SHARE, _TEXTURED, _FEWEST = 0.5, 1.0, 0.3, 3.0, 20
# Standard errors by which types must differ. Neighbours see the same texture: of so many blocks one
# counts as independent.
_CLEAR, _TOGETHER = 4.0, 2.0
# Largest deviation of single lenses that counts in full, in usual ones.
_HUBER = 2.0


class _Lines(NamedTuple):
    """What the lenses show: kind of place in the pattern, 1 / v, energy beside the neighbours."""

    kinds: Indices
    inverse: Floats
    excess: Floats


def types_by_sharpness(
    capture: FocusedCapture, sharpest: tuple[float, ...] | None, types: int, where: str
) -> LensTypes:
    """Tell the types of micro lenses apart in a capture of a textured scene.

    `capture`: its calibration's own types are not looked at but for their side. `sharpest`: 1 / v
    of the types if the camera is known; else they are numbered from near |v| to far. `where` names
    the capture. Raises `InputError` if the scene does not tell.
    """
    if types == 1:
        return LensTypes(pattern=(0,), sharpest=sharpest or (0.0,))
    lines = _lines(capture, types)
    counts = np.bincount(lines.kinds, minlength=types)
    if min(counts) < _FEWEST:
        raise InputError(
            f"only {min(counts)} of its micro images show texture with a sure depth, {_FEWEST} are "
            "needed to tell types of micro lenses apart; take a picture of fine texture all over",
            where=where,
        )
    if sharpest is None:
        return _measured(lines, types, where)
    return _compared(lines, sharpest, capture.pitch, where)


def _lines(capture: FocusedCapture, types: int) -> _Lines:
    """Compare the pictures that lenses of each kind alone make of the same places."""
    grid = capture.calibration.grid
    depth = search_depth(capture)
    t, s = lens_indices(grid, capture.calibration.image_shape)
    kinds = usual_order(grid, t, s, types).ravel()
    lenses = capture.lenses(alike=True)
    # About two places for a pixel of a micro image.
    step = max(1.0, 0.5 / float(np.median(np.abs(depth.inverse))))
    shape = capture.shape(step)
    inverse = depth.at(shape, step)
    pictures, seen = [], np.ones(shape, dtype=bool)
    for kind in range(types):
        sums, shares, _ = capture.layers(inverse, step, lenses=lenses[kinds == kind])
        pictures.append(sums.mean(axis=2) / np.maximum(shares, 1e-9))
        seen &= shares > _SHARE
    inner = ndimage.binary_erosion(seen, iterations=2)
    sure = depth.at(shape, step, confidence=True) >= _SURE
    side = max(4, int(capture.pitch / step))
    rows, columns = (length // side for length in shape)

    def blocks(values: Floats) -> Floats:
        part = values[: rows * side, : columns * side].reshape(rows, side, columns, side)
        return np.asarray(part.swapaxes(1, 2).reshape(rows * columns, side * side))

    used = blocks(inner & sure)
    share = used.mean(axis=1)
    middle = np.median(blocks(inverse), axis=1)
    even = np.abs(blocks(inverse) - middle[:, np.newaxis]).max(axis=1) * capture.pitch < _EVEN
    energies = []
    for picture in pictures:
        rough = (picture - ndimage.gaussian_filter(picture, _SMOOTH)) ** 2
        energies.append((blocks(rough) * used).sum(axis=1) / np.maximum(used.sum(axis=1), 1))
    energy = np.array(energies)
    textured = energy.min(axis=0) > _TEXTURED * np.percentile(energy.min(axis=0), 5)
    chosen = (share > _SHARE) & even & textured
    logs = np.log(np.maximum(energy[:, chosen], 1e-30))
    count = int(chosen.sum())
    return _Lines(
        np.repeat(np.arange(types), count),
        np.tile(middle[chosen], types),
        (logs - logs.mean(axis=0)).ravel(),
    )


def _fit(terms: Floats, values: Floats) -> tuple[Floats, Floats, float]:
    """Least squares without outliers: factors, their covariance, and the scatter."""
    weights = np.ones(len(values))
    for _ in range(8):
        root = np.sqrt(weights)[:, np.newaxis]
        factors = np.linalg.lstsq(root * terms, root[:, 0] * values, rcond=None)[0]
        off = values - terms @ factors
        scatter = max(1.4826 * float(np.median(np.abs(off))), 1e-9)
        weights = np.minimum(1, _HUBER * scatter / np.maximum(np.abs(off), 1e-12))
    covariance = np.linalg.pinv((root * terms).T @ (root * terms)) * scatter**2 * _TOGETHER
    return np.asarray(factors, np.float64), np.asarray(covariance, np.float64), scatter


def _cannot(reason: str, where: str) -> InputError:
    return InputError(
        f"types of micro lenses cannot be told apart: {reason}; take a picture of fine texture "
        "from near to far, or give --camera with the focal lengths",
        where=where,
    )


def _compared(lines: _Lines, sharpest: tuple[float, ...], pitch: float, where: str) -> LensTypes:
    """The pattern that the camera's lengths fit best."""
    blurs = (pitch * (np.array(sharpest) - lines.inverse[:, np.newaxis])) ** 2
    blurs -= blurs.mean(axis=1, keepdims=True)
    offs = []
    patterns = list(permutations(range(len(sharpest))))
    for pattern in patterns:
        of_lens = blurs[np.arange(len(blurs)), np.array(pattern)[lines.kinds]][:, np.newaxis]
        factors, _, _ = _fit(-of_lens, lines.excess)
        beta = max(float(factors[0]), 0.0)
        offs.append(np.abs(lines.excess + beta * of_lens[:, 0]))
    order = np.argsort([off.sum() for off in offs])
    first, second = offs[order[0]], offs[order[1]]
    better = second - first
    error = float(better.std()) / np.sqrt(len(better) / _TOGETHER)
    if not better.mean() > _CLEAR * max(error, 1e-12):
        raise _cannot("two ways to number them fit about equally well", where)
    return LensTypes(pattern=patterns[order[0]], sharpest=sharpest)


def _measured(lines: _Lines, types: int, where: str) -> LensTypes:
    """Pattern, and where types are sharp, by the lines of their energy."""
    middle = float(np.median(lines.inverse))
    of_kind = np.eye(types)[lines.kinds]
    terms = np.hstack([of_kind, of_kind * (lines.inverse - middle)[:, np.newaxis]])
    factors, covariance, _ = _fit(terms, lines.excess)
    offsets, slopes = factors[:types], factors[types:]
    # From large 1 / v to small: from near |v| to far.
    order = np.argsort(-slopes)
    crossings, differences = [], []
    for near, far in pairwise(order.tolist()):
        contrast = np.zeros(2 * types)
        contrast[types + near], contrast[types + far] = 1, -1
        error = float(np.sqrt(contrast @ covariance @ contrast))
        difference = float(slopes[near] - slopes[far])
        if not difference > _CLEAR * error:
            raise _cannot("their sharpness does not change differently with depth", where)
        differences.append(difference)
        crossings.append(middle - float(offsets[near] - offsets[far]) / difference)
    if types == 2:
        # Which of them is how far from the crossing is not known: half a pixel of blur.
        raise _cannot("two types need the camera's focal lengths", where)
    ratio = differences[0] / differences[1]
    second = (crossings[0] + ratio * crossings[1]) / (1 + ratio)
    sharpest = (2 * crossings[0] - second, second, 2 * crossings[1] - second)
    if not (sharpest[0] > sharpest[1] > sharpest[2] and max(map(abs, sharpest)) < 1):
        raise _cannot("where they are sharp contradicts their order", where)
    pattern = np.argsort(order)
    return LensTypes(pattern=tuple(int(k) for k in pattern), sharpest=sharpest)
