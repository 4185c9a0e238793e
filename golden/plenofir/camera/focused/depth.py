# SPDX-License-Identifier: Apache-2.0
"""Virtual depth: at which micro images that are laid over each other agree.

At each place of the picture the micro images that see it differ by noise if they are laid over each
other at its virtual depth, and by what lies around it at any other. Candidates are equally far
apart in 1 / v, as the parallax between micro images is; paths join those of neighbouring places
(`plenofir.camera.lightfield.matching_loops`), a parabola goes between candidates.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.focused.capture import LEAST, FocusedCapture
from plenofir.camera.lightfield.matching_loops import add_paths

Floats = npt.NDArray[np.float64]
Floats32 = npt.NDArray[np.float32]

# Pixels by which candidates move a micro image's content against its neighbour's.
_MOVE = 0.3
# Smallest and largest |v| that is searched: two micro images see a place at the smallest.
_NEAREST, _FARTHEST = 1.6, 12.0
# Places for each micro image, and surroundings whose differences count (sigma), in pitches.
_PLACES, _AROUND = 8.0, 0.18
# Least differences that micro images have from each other, as a share of white; of the differences
# at a place's best candidate, what share of the places is even; most variances that count.
_MISFIT, _EVEN, _MOST = 0.004, 20, 8.0
# Costs of paths, as of `plenofir.camera.lightfield.matching`.
_CHANGE, _JUMP, _EDGE = 1.5, 8.0, 0.05
# A depth is sure if other candidates differ by so many times more: from - to.
_SURE = 2.0, 6.0


@dataclass(frozen=True, eq=False)
class FocusedDepth:
    """Virtual depth of a capture."""

    inverse: Floats  # 1 / v at each place, shape (rows, columns)
    confidence: Floats  # from 0 to 1, same shape
    step: float  # pixels of the capture from one place to the next

    def at(self, shape: tuple[int, int], step: float, *, confidence: bool = False) -> Floats:
        """1 / v, or how sure it is, at the places of a picture with another step.

        That of the nearest place: edges stay edges.
        """
        values = self.confidence if confidence else self.inverse
        rows, columns = (
            np.clip(
                np.rint(((step - self.step) / 2 + step * np.arange(n)) / self.step), 0, m - 1
            ).astype(int)
            for n, m in zip(shape, values.shape, strict=True)
        )
        return np.asarray(values[rows[:, np.newaxis], columns])


def search_depth(
    capture: FocusedCapture,
    search: tuple[float, float] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FocusedDepth:
    """Find the virtual depth of a capture.

    `search`: 1 / v from - to; without it |v| from 1.6 to 12 on the side where the types of micro
    lenses are sharp.
    """
    pitch = capture.pitch
    low, high = search_range(capture) if search is None else search
    candidates = np.linspace(low, high, max(3, int(np.ceil((high - low) * pitch / _MOVE)) + 1))
    step = max(1.0, pitch / _PLACES)
    shape = capture.shape(step)
    grey = capture.pixels.mean(axis=2)
    white = max(float(np.percentile(grey[capture.light > 0], 99.5)), 1e-6)
    grey /= np.float32(white)
    lenses = capture.lenses()
    costs = np.empty((*shape, len(candidates)), np.float32)
    for number, inverse in enumerate(candidates):
        if abs(inverse) < 1 / _FARTHEST / 2:
            costs[..., number] = np.nan
            continue
        off, free = differences(capture, float(inverse), step, grey, lenses, _AROUND)
        costs[..., number] = np.where(free > 1e-3, off / np.maximum(free, 1e-3), 1)
        if progress is not None:
            progress(number + 1, len(candidates))
    usable = np.isfinite(costs).all(axis=(0, 1))
    costs, candidates = np.ascontiguousarray(costs[..., usable]), candidates[usable]
    least = costs.min(axis=2)
    noise = max(float(np.percentile(least, _EVEN)), _MISFIT**2)
    confidence = _confidence(costs, least, noise)
    sums = np.zeros_like(costs)
    limited = np.minimum(costs / np.float32(noise), np.float32(_MOST))
    middle = capture.layers(
        float(candidates[costs.mean(axis=(0, 1)).argmin()]), step, matching=grey
    )
    colours = middle.sums / np.maximum(middle.shares, 1e-9)[..., np.newaxis]
    guide = np.ascontiguousarray(colours / _EDGE, np.float32)
    add_paths(limited, guide, np.float32(_CHANGE), np.float32(_JUMP), sums)
    best = np.clip(sums.argmin(axis=2), 1, len(candidates) - 2)
    before, here, after = (
        np.take_along_axis(costs, (best + move)[..., np.newaxis], axis=2)[..., 0]
        for move in (-1, 0, 1)
    )
    bend = before - 2 * here + after
    aside = np.where(bend > 1e-9, (before - after) / (2 * np.maximum(bend, 1e-9)), 0)
    inverse = candidates[best] + np.clip(aside, -0.5, 0.5) * (candidates[1] - candidates[0])
    return FocusedDepth(inverse, confidence, step)


def differences(
    capture: FocusedCapture,
    inverse: Floats | float,
    step: float,
    grey: Floats32,
    lenses: Floats,
    around: float,
) -> tuple[Floats32, Floats32]:
    """How micro images differ: sum of the squared differences from their mean, and its freedom.

    Both over the surroundings of places with a sigma of `around` pitches. `inverse`, `step`,
    `lenses`: see `FocusedCapture.layers`; `grey`: what is compared.
    """
    sums, shares, squares = capture.layers(inverse, step, matching=grey, lenses=lenses)
    least = np.maximum(shares, 1e-9)
    off = np.maximum(squares[..., 0] - sums[..., 0] ** 2 / least, 0)
    free = shares - squares[..., 1] / least
    sigma = around * capture.pitch / step
    off, free = (ndimage.gaussian_filter(one, sigma, mode="nearest") for one in (off, free))
    return off, free


def search_range(capture: FocusedCapture) -> tuple[float, float]:
    """1 / v from - to: |v| from 1.6 to 12 on the side where the types of lenses are sharp."""
    types = capture.calibration.lens_types
    side = -1 if types is not None and np.mean(types.sharpest) < 0 else 1
    ends = sorted((side / _NEAREST, side / _FARTHEST))
    assert max(map(abs, ends)) < 1 / LEAST
    return ends[0], ends[1]


def _confidence(costs: Floats32, least: Floats32, noise: float) -> Floats:
    """From 0 to 1: how much more micro images differ at other candidates."""
    ratio = np.median(costs, axis=2) / (least + noise)
    return np.clip((ratio - _SURE[0]) / (_SURE[1] - _SURE[0]), 0, 1).astype(np.float64)
