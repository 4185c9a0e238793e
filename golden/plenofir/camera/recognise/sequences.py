# SPDX-License-Identifier: Apache-2.0
"""How many pictures of a sequence stand in a row, by how what they show moves.

From one view to its neighbour each point moves by its disparity, along the line of the views. So
all steps within rows show the same motion, part by part of the picture; a step to the next row
shows another one. Frames of a film have no such steps.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

# Pictures are compared at these numbers of pixels along the longer side; large motions are seen in
# small ones.
_SIDES = (256, 128, 64, 32)
_SMALLEST_SIDE = 16
_BLUR, _WINDOW = 1.0, 11
# Least share of the first step's change that its motion along one axis explains, of what motion in
# any direction does: turning and zooming are no parallax.
_ALONG = 0.85
# Least share of the changes that the first step's motion explains, in the middle of all steps.
_SAME = 0.35
# Steps within rows explain more than this share of that, steps to another row less.
_OTHER = 0.5
# Mean change from picture to picture, in shares of the contrast, that is noise or no motion.
_STILL = 0.01


class SequenceLayout(NamedTuple):
    """Views in a sequence."""

    rows: int
    columns: int
    order: Literal["rows", "columns"]  # whether the sequence fills rows or columns of views first
    serpentine: bool  # every second row, or column, runs backwards

    def place(self, number: int) -> tuple[int, int]:
        """Row and column of a picture, counted from 0."""
        length = self.columns if self.order == "rows" else self.rows
        line, along = divmod(number, length)
        if self.serpentine and line % 2:
            along = length - 1 - along
        return (line, along) if self.order == "rows" else (along, line)


def sequence_layout(pictures: Sequence[Image]) -> SequenceLayout | None:
    """Layout of pictures (t, s[, 3]) that are views, one after the other; None if unclear.

    A sequence whose steps are all alike is a line of views.
    """
    count = len(pictures)
    # Two pictures have one step, with nothing to compare it with.
    if count < 3 or min(pictures[0].shape[:2]) < _SMALLEST_SIDE:
        return None
    levels = [grey(picture).astype(np.float32) for picture in pictures]
    best: tuple[float, SequenceLayout] | None = None
    for side in _SIDES:
        scale = max(1, max(levels[0].shape) // side)
        if min(levels[0].shape) // scale < _SMALLEST_SIDE:
            break
        layout = _layout_at([_reduced(one, scale) for one in levels])
        if layout is not None and (best is None or layout[0] > best[0]):
            best = layout
    return None if best is None else best[1]


def _reduced(image: npt.NDArray[np.float32], scale: int) -> Floats:
    rows, columns = (n // scale for n in image.shape)
    whole = image[: rows * scale, : columns * scale].reshape(rows, scale, columns, scale)
    return np.asarray(ndimage.gaussian_filter(whole.mean(axis=(1, 3), dtype=np.float64), _BLUR))


def _layout_at(levels: list[Floats]) -> tuple[float, SequenceLayout] | None:
    """Layout at one scale, and how well the motion explains the steps within its rows."""
    changes = [after - before for before, after in pairwise(levels)]
    contrast = float(np.mean([one.std() for one in levels]))
    # Noise has a direction too, by chance.
    if float(np.mean([np.abs(change).mean() for change in changes])) < _STILL * contrast:
        return None
    axis = _direction(levels, changes[0])
    if axis is None:
        return None
    forwards, backwards = _agreements(levels, changes, axis)
    order: Literal["rows", "columns"] = "rows" if axis == 1 else "columns"
    count = len(levels)
    layouts: list[tuple[float, SequenceLayout]] = []
    for length in (n for n in range(2, count + 1) if count % n == 0):
        lines = count // length
        steps = np.arange(count - 1)
        joints = steps % length == length - 1
        for serpentine in (False, True) if lines > 1 else (False,):
            reversed_ = (steps // length) % 2 == 1
            agree = np.where(serpentine & reversed_, backwards, forwards)
            within = float(np.median(agree[~joints]))
            limit = _OTHER * within
            # The median bears one odd picture; the least step shows a joint where this length has
            # none.
            if within < _SAME or float(agree[~joints].min()) < limit:
                continue
            if (forwards[joints] > limit).any():
                continue
            shape = (lines, length) if order == "rows" else (length, lines)
            layouts.append((within, SequenceLayout(*shape, order, serpentine)))
    return max(layouts, key=lambda one: one[0], default=None)


def _mean(values: Floats) -> Floats:
    return np.asarray(ndimage.uniform_filter(values, _WINDOW, mode="nearest"))


def _direction(levels: list[Floats], change: Floats) -> int | None:
    """The axis along which the first step moves; None where it moves in another way."""
    slopes = np.array(np.gradient((levels[0] + levels[1]) / 2))
    power = np.array([[_mean(a * b) for a in slopes] for b in slopes])
    mean_slopes = np.array([_mean(a * change) for a in slopes])
    eased = power + 1e-3 * float(np.trace(power.mean(axis=(2, 3)))) * np.eye(2)[:, :, None, None]
    whole = float((change**2).sum())
    # Pictures that are equal, or without texture, tell no motion.
    if not whole or not power.any():
        return None
    moves = [np.zeros_like(mean_slopes) for _ in range(3)]
    for axis in (0, 1):
        moves[axis][axis] = mean_slopes[axis] / eased[axis, axis]
    moves[2] = np.moveaxis(
        np.linalg.solve(
            np.moveaxis(eased, (0, 1), (2, 3)), np.moveaxis(mean_slopes, 0, 2)[..., None]
        ),
        2,
        0,
    )[..., 0]
    down, right, any_way = (
        1 - float(((change - (move * slopes).sum(axis=0)) ** 2).sum()) / whole for move in moves
    )
    axis = int(right > down)
    return axis if max(down, right) > _ALONG * any_way and any_way > _SAME else None


def _agreements(levels: list[Floats], changes: list[Floats], axis: int) -> tuple[Floats, Floats]:
    """Share of each step's change that the motion along an axis of steps before it explains.

    Once as it is, once reversed: 1 for all of it, 0 or less for none. The motion is that of the
    first step, or of the last one that agreed, as near things have moved on by then.
    """
    slopes = [np.gradient((a + b) / 2, axis=axis) for a, b in pairwise(levels)]

    def motion(step: int) -> Floats:
        power = _mean(slopes[step] ** 2)
        eased = power + 1e-3 * float(power.mean()) + 1e-12
        return np.asarray(-_mean(slopes[step] * changes[step]) / eased)

    def share(step: int, moves: Floats) -> float:
        residual = (changes[step] + moves * slopes[step]) ** 2
        return 1 - float(residual.sum() / max((changes[step] ** 2).sum(), 1e-12))

    first = latest = motion(0)
    forwards, backwards = [], []
    for step in range(len(changes)):
        forwards.append(max(share(step, first), share(step, latest)))
        backwards.append(max(share(step, -first), share(step, -latest)))
        if max(forwards[-1], backwards[-1]) > _SAME:
            sign = 1 if forwards[-1] > backwards[-1] else -1
            latest = sign * motion(step)
    return np.array(forwards), np.array(backwards)
