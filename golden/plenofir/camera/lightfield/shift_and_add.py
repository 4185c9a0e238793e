# SPDX-License-Identifier: Apache-2.0
"""Refocusing of views as they are: each is shifted and added (Ng, 2005), at any real a.

For views that are no square of M x M: a line (a camera on a rail, a quilt), a rectangle (a bar of
cameras). Of two other designs, an aligned raster padded with views without weight takes M / R times
the memory (a line of 100 views of 2 megapixels: 20,000 megapixels), and one with an own M for each
axis has no setting a in common unless the greater M is a multiple of the smaller one. Pictures have
the size of a view; they, depth and the central view lie over each other.
"""

import numpy as np
import numpy.typing as npt

from plenofir.refocus.operator import Image

Floats32 = npt.NDArray[np.float32]


def refocus_views(images: Image, a: float) -> Image:
    """Refocus views to a plane: the mean of what all views that reach a pixel see there.

    `images`: shape (v, u, t, s[, 3]), any number of rows and columns of views. `a`: disparity of
    the plane in pixels per view, positive for what is nearer. Result: shape (t, s[, 3]), type of
    the views.
    """
    rows, columns, *size = images.shape
    total = np.zeros(size, np.float32)
    reached = [np.zeros(length, np.float32) for length in size[:2]]
    for v in range(rows):
        line = np.zeros(size, np.float32)
        for u in range(columns):
            view, there = _moved(images[v, u].astype(np.float32), -a * (u - columns // 2), 1)
            line += view
            if v == 0:
                reached[1] += there
        line, there = _moved(line, -a * (v - rows // 2), 0)
        total += line
        reached[0] += there
    share = reached[0][:, np.newaxis] * reached[1]
    mean = total / np.maximum(share, 1).reshape(*share.shape, *[1] * (images.ndim - 4))
    most = np.iinfo(images.dtype).max
    return np.asarray(np.clip(np.floor(mean + 0.5), 0, most).astype(images.dtype))


def _moved(values: Floats32, by: float, axis: int) -> tuple[Floats32, Floats32]:
    """Values at x + by along an axis (Catmull-Rom), 0 beyond its ends; 1 where there are any."""
    length = values.shape[axis]
    places = np.arange(length) + by
    there = ((places > -0.5) & (places < length - 0.5)).astype(np.float32)
    if by == 0:
        return values, there
    whole = int(np.floor(by))
    t = by - whole
    weights = (
        t * (-0.5 + t * (1 - 0.5 * t)),
        1 + t * t * (-2.5 + 1.5 * t),
        t * (0.5 + t * (2 - 1.5 * t)),
        t * t * (-0.5 + 0.5 * t),
    )
    moved = np.zeros_like(values)
    for k, weight in enumerate(weights):
        if weight:
            index = np.clip(np.arange(length) + whole + k - 1, 0, length - 1)
            moved += np.float32(weight) * np.take(values, index, axis)
    return moved * there.reshape(-1, *[1] * (values.ndim - 1 - axis)), there
