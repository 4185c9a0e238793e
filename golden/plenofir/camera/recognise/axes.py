# SPDX-License-Identifier: Apache-2.0
"""Order and direction of the axes of views, by the motion of what they show."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.indexing import raw_image
from plenofir.camera.recognise.source import Confidence, Finding, Hints, Order
from plenofir.ground.images import Image, Picture

_FEWEST_VIEWS, _SMALLEST_VIEW, _WINDOW, _FAR = 3, 24, 15, 2
# The direction is clear if the displacement in it is this many times that in the other.
_CLEAR = 1.3

View = Callable[[int, int], Picture]


class Axes(NamedTuple):
    """How views as stored become rows from above and columns from the left.

    In this order: every second row turned round, rows and columns exchanged, rows reversed, columns
    reversed.
    """

    serpentine: bool = False
    swapped: bool = False
    rows_reversed: bool = False
    columns_reversed: bool = False
    text: str = ""
    confidence: Confidence = "assumed"

    def as_stored(self) -> bool:
        """Whether nothing has to be changed."""
        return not any(self[:4])

    def counts(self, stored: tuple[int, int]) -> tuple[int, int]:
        """Rows and columns of views, once put right."""
        return stored[::-1] if self.swapped else stored

    def arranged(self, images: Image) -> Image:
        """Views (v, u, ...) in their right order; a view of the same memory where possible."""
        if self.serpentine:
            images = images.copy()
            images[1::2] = images[1::2, ::-1].copy()
        if self.swapped:
            images = images.swapaxes(0, 1)
        if self.rows_reversed:
            images = images[::-1]
        return images[:, ::-1] if self.columns_reversed else images

    def put_right(self, picture: Picture) -> Picture:
        """`arranged` views of a picture of shape (v, u, t, s[, 3])."""
        return picture._replace(pixels=self.arranged(picture.pixels))

    def raster(self, raw: Image, m: int) -> Image:
        """An aligned raw image in its right order."""
        from plenofir.camera.lightfield.indexing import views

        return raw_image(np.moveaxis(self.arranged(views(raw, m)), (0, 1), (2, 3)))

    def findings(self) -> tuple[Finding, ...]:
        """What was found, for people."""
        return (Finding("axes", self.text, self.confidence),) if self.text else ()


def find_axes(view: View, counts: tuple[int, int], hints: Hints) -> Axes:
    """Order and direction of stored views, as told or by their motion."""
    rows, columns = hints.flip in ("rows", "both"), hints.flip in ("columns", "both")
    order, confidence = hints.order, "told"
    if order is None and min(counts) >= _FEWEST_VIEWS:
        order, confidence = _first_counts(view, counts), "measured"
    if order != "columns":
        return Axes(False, False, rows, columns)
    text = "the first number counts columns"
    if confidence == "measured":
        text += ": what is seen moves sideways with it"
    return Axes(False, True, rows, columns, text, "told" if hints.order else "measured")


def _first_counts(view: View, counts: tuple[int, int]) -> Order | None:
    """Whether the first number of views counts rows or columns, by how the content moves.

    Content moves vertically between views above each other, horizontally between views side by
    side; None if that is unclear.
    """
    middle = counts[0] // 2, counts[1] // 2
    centre = grey(view(*middle).pixels)
    if min(centre.shape) < _SMALLEST_VIEW:
        return None
    down, right = np.gradient(ndimage.gaussian_filter(centre, 1.0))
    sums = [[down * down, down * right], [down * right, right * right]]
    matrix = np.array([[ndimage.uniform_filter(part, _WINDOW) for part in line] for line in sums])
    matrix += 1e-3 * float(np.trace(matrix.mean(axis=(2, 3)))) * np.eye(2)[:, :, None, None]
    upright = sideways = 0.0
    for axis in (0, 1):
        far = max(1, min(_FAR, middle[axis], counts[axis] - 1 - middle[axis]))
        steps = (far, 0) if axis == 0 else (0, far)
        one = grey(view(middle[0] + steps[0], middle[1] + steps[1]).pixels)
        other = grey(view(middle[0] - steps[0], middle[1] - steps[1]).pixels)
        change = ndimage.gaussian_filter(one - other, 1.0)
        known = np.array([ndimage.uniform_filter(g * change, _WINDOW) for g in (down, right)])
        moves = np.linalg.solve(
            np.moveaxis(matrix, (0, 1), (2, 3)), np.moveaxis(known, 0, 2)[..., None]
        )
        up, side = np.abs(moves[..., 0]).reshape(-1, 2).mean(axis=0)
        upright += up if axis == 0 else side
        sideways += side if axis == 0 else up
    if max(upright, sideways) < _CLEAR * min(upright, sideways):
        return None
    return "rows" if upright > sideways else "columns"
