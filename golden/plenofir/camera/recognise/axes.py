# SPDX-License-Identifier: Apache-2.0
"""Order and direction of the axes of views, by the motion of what they show.

In every light field, what is seen moves vertically from row to row of views and horizontally from
column to column, by the same disparity in both. Blocks of the central view are matched with its
neighbours under each assumption about the axes; the true one leaves the smallest differences. A
disparity of the other sign fits as well if both axes are reversed, so which of them is reversed, or
whether both are, follows from what hides what alone: where two surfaces meet in a view, the nearer
one is seen.
"""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.disparity import search_views
from plenofir.camera.lightfield.hiding import larger_hides
from plenofir.camera.lightfield.indexing import raw_image, views
from plenofir.camera.recognise.source import Finding, Hints
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture

Image32 = npt.NDArray[np.float32]
View = Callable[[int, int], Picture]
_Place = tuple[int, int]

# Smaller views have too few blocks for a standard error; larger ones only take longer.
_SMALLEST_VIEW, _LARGEST_SIDE, _BLOCK = 24, 384, 8
# Coarse structures (in standard deviations, pixels) are left out: vignetting, shading.
_COARSE = 3.0
# Largest disparity that is tried: a share of the side, and limits in pixels.
_REACH, _LEAST_REACH, _MOST_REACH = 0.05, 2, 16
# An assumption is ruled out if it leaves this many times the differences, by so many standard
# errors of the mean over blocks.
_WORSE, _CERTAIN = 1.02, 6.0
# What hides what is looked for in so many views along a side; more only take longer.
_MOST_VIEWS = 11


class Axes(NamedTuple):
    """How views as stored become rows from above and columns from the left.

    In this order: every second row turned round, rows and columns exchanged, rows reversed, columns
    reversed.
    """

    serpentine: bool = False
    swapped: bool = False
    rows_reversed: bool = False
    columns_reversed: bool = False
    finding: Finding | None = None

    def as_stored(self) -> bool:
        """Whether nothing has to be changed."""
        return not any(self[:4])

    def counts(self, stored: _Place) -> _Place:
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

    def place(self, v: int, u: int, stored: _Place) -> _Place:
        """Where the view in row v and column u is stored."""
        rows, columns = self.counts(stored)
        v = rows - 1 - v if self.rows_reversed else v
        u = columns - 1 - u if self.columns_reversed else u
        first, second = (u, v) if self.swapped else (v, u)
        return first, stored[1] - 1 - second if self.serpentine and first % 2 else second

    def put_right(self, picture: Picture) -> Picture:
        """`arranged` views of a picture of shape (v, u, t, s[, 3])."""
        return picture._replace(pixels=self.arranged(picture.pixels))

    def raster(self, raw: Image, m: int) -> Image:
        """An aligned raw image in its right order."""
        return raw_image(np.moveaxis(self.arranged(views(raw, m)), (0, 1), (2, 3)))

    def findings(self) -> tuple[Finding, ...]:
        """Findings, for people."""
        return () if self.finding is None else (self.finding,)


class _Motion(NamedTuple):
    """What the motion says; None where it does not tell."""

    serpentine: bool = False
    swapped: bool | None = None
    mirrored: bool | None = None  # whether rows or columns are reversed, but not both


def find_axes(view: View, counts: _Place, hints: Hints, *, named: bool = True) -> Axes:
    """Order and direction of stored views, by hints or else by their motion.

    `view`: the stored view of a first and second number. `named`: whether the order comes from
    names or from a convention, so that people are told if the views do not show it.
    """
    motion = _motion(view, counts)
    swapped = bool(motion.swapped) if hints.order is None else hints.order == "columns"
    axes = Axes(motion.serpentine, swapped)

    def nearer(of: Axes) -> float:
        """Occlusion: 1 where near objects hide far ones, -1 the other way round, 0 unknown."""
        return _hiding(lambda v, u: view(*of.place(v, u, counts)), of.counts(counts))

    sure = True
    if hints.flip is not None:
        rows, columns = hints.flip in ("rows", "both"), hints.flip in ("columns", "both")
        axes = axes._replace(rows_reversed=rows, columns_reversed=columns)
    # Motion tells that one axis is mirrored, and occlusion which one of the two.
    elif motion.mirrored:
        axes = axes._replace(rows_reversed=True)
        hiding = nearer(axes)
        sure = hiding != 0.0
        if hiding < 0:
            axes = axes._replace(rows_reversed=False, columns_reversed=True)
    against = motion.swapped not in (None, swapped) or motion.mirrored not in (
        None,
        axes.rows_reversed != axes.columns_reversed,
    )
    if against:
        text = "the parallax of the views contradicts the order and direction that are told"
        return axes._replace(finding=Finding("axes", text, "told", notable=True))
    words = ", ".join(
        word
        for word, change in zip(
            (
                "every second row of views runs back",
                "the first number counts columns",
                "rows count from below",
                "columns count from the right",
            ),
            axes,
            strict=False,
        )
        if change
    )
    if hints.order is not None and hints.flip is not None:
        return axes._replace(finding=Finding("axes", f"as told: {words or 'as stored'}", "told"))
    if words:
        reason = "by the parallax of the views" if hints.flip is None else "as --flip tells"
        text = f"{words}: put right, {reason}"
        if not sure:
            text += "; if near is far, --flip columns"
        return axes._replace(finding=Finding("axes", text, notable=True))
    if motion.swapped is None or (motion.mirrored is None and min(counts) > 1):
        text = (
            "too little parallax to tell the order and direction of rows and columns; taken as "
            "stored (--order, --flip)"
        )
        return axes._replace(finding=Finding("axes", text, "unknown", notable=named))
    text = "rows from above, columns from the left, by the parallax of the views"
    finding = Finding("axes", text)
    # With both axes mirrored motion looks right: only what hides what can tell.
    if hints.flip is None and nearer(axes) < 0:
        text = "near objects seem to be hidden by far ones: --flip both exchanges them"
        finding = Finding("axes", text, notable=True)
    return axes._replace(finding=finding)


def _levels(picture: Picture) -> Image32:
    """Fine structures of a view, made smaller if it is large."""
    levels = _reduced(picture)
    return np.asarray(levels - ndimage.gaussian_filter(levels, _COARSE), np.float32)


def _reduced(picture: Picture) -> Image32:
    """Grey levels of a view, made smaller if it is large."""
    levels = grey(picture.pixels).astype(np.float32)
    scale = -(-max(levels.shape) // _LARGEST_SIDE)
    rows, columns = (n // scale for n in levels.shape)
    levels = levels[: rows * scale, : columns * scale]
    return np.asarray(levels.reshape(rows, scale, columns, scale).mean(axis=(1, 3)), np.float32)


def _steps(shape: _Place) -> tuple[npt.NDArray[np.float64], int]:
    """Disparities to be tried, symmetric, and a margin for them."""
    reach = int(np.clip(_REACH * min(shape), _LEAST_REACH, _MOST_REACH))
    far = np.arange(2.5, reach + 0.01, 0.5)
    return np.concatenate([-far[::-1], np.arange(-2, 2.01, 0.25), far]), reach + 1


def _differences(
    one: Image32, other: Image32, axis: int, sign: int, tried: npt.NDArray[np.float64], margin: int
) -> Image32:
    """Mean differences of blocks from another view, for each disparity along an axis."""
    inner = one[margin:-margin, margin:-margin]
    rows, columns = (n // _BLOCK for n in inner.shape)
    inner = inner[: rows * _BLOCK, : columns * _BLOCK]
    between = [
        other * (1 - part) + np.roll(other, -1, axis) * part for part in (0.0, 0.25, 0.5, 0.75)
    ]
    result = np.empty((len(tried), rows, columns), np.float32)
    for number, disparity in enumerate(tried):
        whole, part = divmod(-disparity * sign, 1.0)
        start = [margin, margin]
        start[axis] += int(whole)
        moved = between[int(4 * part)][
            start[0] : start[0] + inner.shape[0], start[1] : start[1] + inner.shape[1]
        ]
        blocks = np.abs(moved - inner).reshape(rows, _BLOCK, columns, _BLOCK)
        result[number] = blocks.mean(axis=(1, 3))
    return result


def _is_worse(remaining: Image32, least: Image32) -> bool:
    """Whether an assumption leaves clearly more differences than another."""
    more = (remaining - least).ravel()
    error = float(more.std()) / max(len(more), 1) ** 0.5
    worse = float(remaining.sum()) > _WORSE * float(least.sum()) > 0
    return worse and float(more.mean()) > _CERTAIN * error


def _motion(view: View, counts: _Place) -> _Motion:
    """Evidence of the motion of the views about the central one."""
    middle = counts[0] // 2, counts[1] // 2
    size = view(*middle).pixels.shape
    if max(counts) < 2 or min(size[:2]) < _SMALLEST_VIEW:
        return _Motion()
    serpentine = min(counts) > 1 and _is_serpentine(view, counts)

    def at(first: int, second: int) -> Image32:
        place = Axes(serpentine).place(first, second, counts)
        picture = view(*place)
        return _levels(picture if picture.pixels.shape == size else view(*middle))

    central = at(*middle)
    tried, margin = _steps(central.shape)
    # By the number that counts views, and the axis of motion.
    errors: dict[tuple[int, int], Image32] = {}
    for number in (0, 1):
        far = min(2, middle[number])
        for sign in (-1, 1):
            place = list(middle)
            place[number] = min(middle[number] + sign * far, counts[number] - 1)
            if place[number] == middle[number]:
                continue
            other = at(*place)
            for axis in (0, 1):
                part = _differences(central, other, axis, sign, tried, margin)
                errors[number, axis] = errors.get((number, axis), 0.0) + part
    if not errors[max(errors)[0], 0].size:
        return _Motion()
    if min(counts) == 1:
        number = int(counts[0] == 1)
        straight, across = (
            errors[number, number].min(axis=0),
            errors[number, 1 - number].min(axis=0),
        )
        if _is_worse(across, straight):
            return _Motion(swapped=False)
        return _Motion(swapped=True if _is_worse(straight, across) else None)
    assumed = {
        (swapped, mirrored): (
            errors[0, int(swapped)] + errors[1, 1 - int(swapped)][:: -1 if mirrored else 1]
        ).min(axis=0)
        for swapped, mirrored in product((False, True), repeat=2)
    }
    best = min(assumed, key=lambda one: float(assumed[one].sum()))
    swapped, mirrored = best
    order = all(_is_worse(assumed[not swapped, one], assumed[best]) for one in (False, True))
    sense = order and _is_worse(assumed[swapped, not mirrored], assumed[best])
    return _Motion(serpentine, swapped if order else None, mirrored if sense else None)


def _is_serpentine(view: View, counts: _Place) -> bool:
    """Whether every second row of views runs back.

    The view below the first one of a row is then the last one of the next row.
    """
    row = counts[0] // 2 - 1
    one, under, last = (
        _levels(view(*place)) for place in ((row, 0), (row + 1, 0), (row + 1, counts[1] - 1))
    )
    if not one.shape == under.shape == last.shape:
        return False
    tried, margin = _steps(one.shape)
    straight, back = (
        np.minimum(
            *(_differences(one, other, axis, 1, tried, margin).min(axis=0) for axis in (0, 1))
        )
        for other in (under, last)
    )
    return straight.size > 0 and _is_worse(straight, back)


def _hiding(view: View, counts: _Place) -> float:
    """Whether surfaces of larger disparity hide others (1) or are hidden (-1); 0 if not seen."""
    middle = counts[0] // 2, counts[1] // 2
    central = _reduced(view(*middle))
    if max(counts) < 2 or min(central.shape) < _SMALLEST_VIEW:
        return 0.0
    apart = -(-max(counts) // _MOST_VIEWS)
    first, second = (range(c % apart, n, apart) for c, n in zip(middle, counts, strict=True))
    images = np.empty((len(first), len(second), *central.shape), np.float32)
    for place in np.ndindex(images.shape[:2]):
        levels = _reduced(view(first[place[0]], second[place[1]]))
        images[place] = levels if levels.shape == central.shape else central
    try:
        disparity = search_views(images).disparity
    except InputError:  # No view beside the middle is lit.
        return 0.0
    return larger_hides(images, disparity)
