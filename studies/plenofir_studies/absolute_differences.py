# SPDX-License-Identifier: Apache-2.0
"""Disparity between single views by absolute differences, as in section 5.3.3 of the thesis."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.disparity import check_search
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

# Candidates are this many pixels apart in the views that are farthest from each other.
_STEP = 0.25


def sad_disparity(
    reference: Image | Floats,
    others: Sequence[tuple[Image | Floats, tuple[float, float]]],
    *,
    search: tuple[float, float],
    window: int = 7,
) -> Floats:
    """Disparity by the sum of absolute differences, with sub-pixel refinement.

    Differences are averaged over a window and over all views given.

    Result: pixels per view, shape (t, s), positive for what is nearer than the plane of disparity
    zero. Raises `InputError` if the views, the search range or the window cannot be used.

    Parameters
    ----------
    reference
        View, shape (t, s[, 3]).
    others
        Other views with their gaps (rows, columns) from the reference, counted in views.
    search
        Smallest and largest disparity in pixels per view.
    window
        Side of the window in pixels, odd.
    """
    if not others or any(gap == (0, 0) for _, gap in others):
        raise InputError(
            "there is no other view to compare with; the views must have no gaps from the first on"
        )
    if window < 1 or window % 2 == 0:
        raise InputError(f"the window of {window} pixels must be an odd number")
    check_search(search, max(reference.shape[:2]))
    low, high = search
    base = grey(reference)
    reach = max(float(np.hypot(*gap)) for _, gap in others)
    count = int(np.ceil((high - low) * reach / _STEP)) + 1
    candidates = np.linspace(low, high, max(count, 3))
    splines = []
    for image, gap in others:
        if image.shape[:2] != base.shape:
            raise InputError(
                f"views must have one size, but there are {base.shape} and {image.shape[:2]}"
            )
        values = grey(image).astype(np.float64)
        for axis in (0, 1):
            if gap[axis]:
                values = ndimage.spline_filter1d(values, 3, axis, mode="mirror")
        splines.append((values, gap))
    # Only the costs of the best candidate, its neighbours and the latest one are kept.
    least = np.full(base.shape, np.inf)
    best = np.zeros(base.shape, np.int64)
    before, after, last = (np.zeros(base.shape) for _ in range(3))
    for n, candidate in enumerate(candidates):
        differences = np.zeros(base.shape)
        for values, gap in splines:
            differences += np.abs(base - _moved(values, candidate, gap))
        cost = ndimage.uniform_filter(differences, window, mode="nearest")
        after = np.where(best == n - 1, cost, after)
        better = cost < least
        before = np.where(better, last, before)
        best[better] = n
        least = np.minimum(cost, least)
        last = cost
    bend = before - 2 * least + after
    shift = np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1), 0.0)
    at_end = (best == 0) | (best == len(candidates) - 1)
    step = candidates[1] - candidates[0]
    return np.asarray(candidates[best] + np.where(at_end, 0.0, np.clip(shift, -1, 1) * step))


def _moved(splines: Floats, disparity: float, gap: tuple[float, float]) -> Floats:
    """A view moved so that points of a disparity coincide with the reference; cubic splines."""
    moved = splines
    for axis in (0, 1):
        if gap[axis]:
            # The point at x is at x - disparity gap in the other view.
            whole = int(np.floor(-disparity * gap[axis]))
            t = -disparity * gap[axis] - whole
            weights = (
                (1 - t) ** 3 / 6,
                (3 * t**3 - 6 * t**2 + 4) / 6,
                (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6,
                t**3 / 6,
            )
            length = moved.shape[axis]
            places = np.arange(length) + whole - 1
            parts = (
                weight * np.take(moved, np.clip(places + k, 0, length - 1), axis)
                for k, weight in enumerate(weights)
            )
            moved = np.asarray(sum(parts))
    return moved
