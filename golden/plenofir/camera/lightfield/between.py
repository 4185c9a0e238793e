# SPDX-License-Identifier: Apache-2.0
"""Views between the views of a line, interpolated with the depth of the central one.

Each place between two views takes from both what lies at the depth seen there. The depth of the
central view is carried there point by point, nearer points in front; what the central view does not
see takes the depth of what lies behind.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

# Two views that differ by more than this share of the contrast at a place do not see the same.
_OTHER = 0.5


def views_between(line: Image, disparity: Floats, places: Sequence[float]) -> Iterator[Image]:
    """Views at places along a line, one after the other, each of shape (t, s[, 3]).

    `line`: views from left to right, shape (u, t, s[, 3]). `disparity`: of view u // 2 in pixels
    per view, shape (t, s). `places`: from 0 (the first view) to u - 1; a whole number gives that
    view unchanged.
    """
    count = len(line)
    for place in places:
        first = min(int(np.floor(place)), count - 1)
        share = float(place - first)
        if share < 1e-6 or first == count - 1:
            yield line[first]
            continue
        depth = _carried(disparity, place - count // 2)
        one, other = (
            _seen(line[view].astype(np.float64), depth * (place - view))
            for view in (first, first + 1)
        )
        yield _mixed(one, other, share, line.dtype)


def _carried(disparity: Floats, by: float) -> Floats:
    """The disparity that a view `by` places to the right sees, of that of the central view."""
    rows, columns = disparity.shape
    # A point at x is at x - d u in view u.
    aims = np.rint(np.arange(columns) - disparity * by).astype(np.int64)
    inside = (aims >= 0) & (aims < columns)
    lines = np.broadcast_to(np.arange(rows)[:, np.newaxis], aims.shape)
    found = np.full(disparity.shape, -np.inf)
    np.maximum.at(found, (lines[inside], aims[inside]), disparity[inside])
    gaps = ~np.isfinite(found)
    if gaps.all():
        return disparity
    # Gaps open beside nearer things: what is behind shows there.
    nearest = [_filled(found, gaps, step) for step in (1, -1)]
    behind = np.minimum(*nearest)
    return np.asarray(ndimage.median_filter(np.where(gaps, behind, found), (3, 3), mode="nearest"))


def _filled(values: Floats, gaps: npt.NDArray[np.bool_], step: int) -> Floats:
    """Each gap's nearest value to the left (step 1) or right (-1); infinite without one."""
    flipped, missing = values[:, ::step], gaps[:, ::step]
    places = np.where(missing, -1, np.arange(values.shape[1]))
    last = np.maximum.accumulate(places, axis=1)
    filled = np.take_along_axis(flipped, np.maximum(last, 0), axis=1)
    return np.asarray(np.where(last < 0, np.inf, filled)[:, ::step])


def _seen(view: Floats, moves: Floats) -> Floats:
    """A view at x + moves, by cubic splines along its lines."""
    rows, columns = moves.shape
    places = np.mgrid[:rows, :columns].astype(np.float64)
    places[1] += moves
    colours = [
        ndimage.map_coordinates(colour, places, order=3, mode="nearest")
        for colour in np.moveaxis(np.atleast_3d(view), 2, 0)
    ]
    return np.stack(colours, axis=-1).reshape(view.shape)


def _mixed(one: Floats, other: Floats, share: float, dtype: np.dtype[np.integer]) -> Image:
    """Both views by their distance; where they see different things the nearer view alone."""
    off = np.atleast_3d(np.abs(one - other)).mean(axis=2)
    differ = off > _OTHER * float(one.std())
    weights = np.where(differ, float(share > 0.5), share)
    weights = weights.reshape(*weights.shape, *[1] * (one.ndim - 2))
    mixed = one + weights * (other - one)
    return np.asarray(np.clip(np.rint(mixed), 0, np.iinfo(dtype).max).astype(dtype))
