# SPDX-License-Identifier: Apache-2.0
"""Matching of views with the one in their middle: their noise, and the disparity that fits best.

Loops: `plenofir.camera.lightfield.matching_loops`.
"""

from functools import cache

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]
Floats32 = npt.NDArray[np.float32]

RIGHT = 0.07
"""Error of a disparity up to which it counts as right."""

# Candidates are this many pixels apart in the views that are farthest from each other.
_STEP = 0.25
# ... but at most this many pixels per view, or none would be near what is right.
_LARGEST_STEP = 0.125
# Other views on each side of the central one: of a square, and of a single line.
_SIDE, _SIDE_OF_LINE = 2, 8
# Views darker than this share of the central one are left out. Percentile that counts as white.
_DARK, _WHITE = 0.5, 99.5
# Side of windows that tell whether the range is too small; cost of a match, as a share of the mean.
_WINDOW, _FITS = 5, 0.8
# Noise: each so many lines, at most about so many; groups of brightness, pixels in each at least.
_EACH, _LINES, _GROUPS, _GROUP = 8, 64, 6, 50
_SPLINE = 1 / 6, 4 / 6, 1 / 6
# Variance of the slope (both directions) that noise of variance 1 gives a view that is smoothed.
_NOISE_SLOPE = 0.236
# How smooth views are by the noise's ratio to the slopes, from - to: least = first + third.
_SOFT = 0.4, 2.0, 0.2
# Beside noise, views differ by this share of the slope, and by this share of white.
_MISFIT, _FLOOR = 0.25, 0.002
# Squared differences are limited to this many variances: the point is hidden from that view.
_MOST = 6.0
# Cost of a point that no view sees: what more views see is preferred.
_UNSEEN = 1.0
# Costs of paths: of differences, of the next candidate, of any other. Brightness of an edge.
_TRUST, _CHANGE, _JUMP, _EDGE, _TIE = 0.1, 1.5, 12.0, 0.03, 1e-4
# What fits best lies at most so many candidates aside. Weight of a neighbour; iterations; how often
# the fit is refined.
_ASIDE, _STIFFNESS, _TIMES, _TURNS = 1.5, 20.0, 40, 2
# Surroundings whose slopes of brightness tell whether there is anything to match: sigma, and end in
# sigmas. Share of the slopes that views agree on: noise has 0.1 (M = 9) to 0.25 (3) at most.
_NEAR_SIGMA, _NEAR_END, _AGREED = 3.0, 2.0, (0.25, 0.5)
# Mean confidence of the surroundings (sigma) from - to which one counts in part: among many
# unsure ones a sure one is a chance.
_AMONG_SIGMA, _AMONG_SURE = 2.0, (0.4, 0.7)
# Sharpness of the distribution of probability over the candidates, by what `plenofir report depth`
# shows as reliable.
_SHARP = 2.0


class Matcher:
    """Views that are compared with the central one, their noise, and how they are interpolated."""

    def __init__(self, images: Image, search: tuple[float, float]) -> None:
        rows, columns = images.shape[:2]
        centre = rows // 2, columns // 2
        seen = _grey(images[centre])
        white = max(float(np.percentile(seen, _WHITE)), 1e-6)
        self.seen = seen / np.float32(white)
        self.colours = images[centre].reshape(*seen.shape, -1)
        self.white = white
        side = _SIDE if min(rows, columns) > 1 else _SIDE_OF_LINE
        # In small pictures far views see too little of what moves.
        most = max(-search[0], search[1])
        downs, rights = (
            _gaps(count, side, max(1, int(length / (2 * most))))
            for count, length in zip((rows, columns), seen.shape, strict=True)
        )
        self.views, gaps = list[Floats32](), list[tuple[int, int]]()
        for gap in np.ndindex(rows, columns):
            down, right = gap[0] - centre[0], gap[1] - centre[1]
            if down in downs and right in rights and (down or right):
                view = _grey(images[gap])
                level = float(view.mean()) / max(float(seen.mean()), 1e-6)
                # Views in the corners may be dark, as micro images are round.
                if level > _DARK or not seen.any():
                    self.views.append(view / np.float32(white * (level or 1)))
                    gaps.append((down, right))
        if not self.views:
            raise InputError(
                "there is no other view to compare with; the views must have no gaps from the "
                "first on"
            )
        self.gaps = np.array(gaps, np.float64)
        reach = float(np.abs(self.gaps).max())
        step = min(_STEP / reach, _LARGEST_STEP)
        count = max(int(np.ceil((search[1] - search[0]) / step)) + 1, 3)
        self.candidates = np.linspace(*search, count)
        self.pad = int(np.ceil(reach * max(-search[0], search[1]))) + 3
        self.ends = np.zeros(3, np.int64)  # matched pixels: at the ends of the range, all
        self.soft = 1.0
        self.noise = self._noise()
        slope = float(np.median(_slopes(_smooth(self.seen)))) - _NOISE_SLOPE * self.noise[1].mean()
        ratio = float(np.sqrt(self.noise[1].mean() / max(slope, 1e-9)))
        self.soft = float(np.clip(_SOFT[0] + _SOFT[1] * ratio, _SOFT[0] + _SOFT[2], 1))

    def _noise(self) -> tuple[Floats, Floats]:
        """Variance of a pixel's noise over its brightness: both ascending in brightness."""
        from plenofir.camera.lightfield.matching_loops import match_costs

        seen = _smooth(self.seen)
        rows = np.arange(min(4, len(seen) // 2), len(seen), max(_EACH, len(seen) // _LINES))
        costs = np.empty((len(rows), seen.shape[1], len(self.candidates)), np.float32)
        part = slice(None), slice(None)
        match_costs(
            self._prepared(*part),
            self.gaps,
            self.pad,
            rows,
            seen,
            np.ones_like(seen),
            self.candidates,
            np.float32(1e30),
            np.float32(0),
            costs,
        )
        slopes, least, level = _slopes(seen)[rows].ravel(), costs.min(2).ravel(), seen[rows].ravel()
        even = slopes <= np.median(slopes)
        order = np.argsort(level[even])
        groups = np.array_split(order, min(_GROUPS, max(1, len(order) // _GROUP)))
        levels = [float(np.median(level[even][group])) for group in groups]
        variances = [float(np.median(least[even][group])) / (2 * _gain(1.0)) for group in groups]
        return np.array(levels), np.array(variances)

    def _prepared(self, rows: slice, columns: slice) -> Floats32:
        """A part of the views, to be interpolated by B-splines, with a margin around it."""
        return np.stack(
            [
                np.pad(_prefiltered(view[rows, columns], self.soft), self.pad, mode="edge")
                for view in self.views
            ]
        )

    def results(self, rows: slice, columns: slice) -> tuple[Floats32, Floats32]:
        """Disparity and confidence of a part of the picture."""
        from plenofir.camera.lightfield.matching_loops import (
            add_paths,
            joined,
            match_costs,
            refined,
        )

        coefficients = _prefiltered(self.seen[rows, columns], self.soft)
        seen, slope = _smooth(coefficients), _slope(coefficients)
        other_views = self._prepared(rows, columns)
        gain = _gain(self.soft)
        noise = gain * np.interp(seen, *self.noise)
        slopes = np.maximum(_slopes(seen) - _NOISE_SLOPE / _gain(1.0) * noise, 0)
        variance = 2 * noise + _MISFIT**2 * slopes + _FLOOR**2
        costs = np.empty((*seen.shape, len(self.candidates)), np.float32)
        inverse = (1 / variance).astype(np.float32)
        match_costs(
            other_views,
            self.gaps,
            self.pad,
            np.arange(len(seen)),
            seen,
            inverse,
            self.candidates,
            np.float32(_MOST),
            np.float32(_UNSEEN),
            costs,
        )
        self._count_ends(costs)
        scale = _TRUST * np.sqrt(len(self.views))
        costs *= np.float32(scale)
        # What looks the same at all candidates lies in the plane in focus.
        costs += (_TIE * np.abs(self.candidates)).astype(np.float32)
        colours = [
            _smooth(_prefiltered(colour.astype(np.float32), self.soft))
            for colour in np.moveaxis(self.colours[rows, columns], 2, 0)
        ]
        edges = self.white * np.sqrt(len(colours) * (noise + _EDGE**2))
        guide = (np.stack(colours, axis=-1) / edges[..., np.newaxis]).astype(np.float32)
        sums = np.zeros_like(costs)
        add_paths(costs, guide, np.float32(_CHANGE), np.float32(_JUMP), sums)
        best = sums.argmin(2)
        step = float(self.candidates[1] - self.candidates[0])
        pixels = self.candidates[best].astype(np.float32)
        for _ in range(_TURNS):
            fits, bends, others = refined(
                other_views,
                self.gaps,
                self.pad,
                seen,
                inverse,
                slope,
                pixels,
                np.float32(_MOST),
            )
            fits = np.clip(fits, self.candidates[0], self.candidates[-1])
            near = np.abs(fits - pixels) <= _ASIDE * step
            pixels = joined(
                np.where(near, fits, pixels),
                np.where(near, bends * np.float32(scale * step**2), 0),
                guide,
                np.float32(_STIFFNESS),
                np.float32(step),
                _TIMES,
            )
        confidence = self._confidence(sums, pixels) * self._textured(seen, others, inverse)
        around = ndimage.gaussian_filter(confidence, _AMONG_SIGMA, mode="nearest", truncate=2.0)
        # Between two candidates that are far apart nothing is surer.
        low, high = np.float32(min(1, RIGHT / step)) * np.array(_AMONG_SURE, np.float32)
        return pixels, confidence * np.clip((around - low) / (high - low), 0, 1)

    def _textured(self, seen: Floats32, others: Floats32, inverse: Floats32) -> Floats32:
        """From 0 to 1, whether the views agree on slopes of brightness near a pixel.

        Paths carry the depth of an object far into what is empty. Slopes of noise are not those of
        the mean of the other views, at any disparity.

        `others`: the mean of the other views at the disparities.
        """
        common, alone = np.zeros_like(seen), np.zeros_like(seen)
        for axis, reach in enumerate((self.gaps**2).sum(0)):
            here, there = (
                ndimage.correlate1d(values, [-0.5, 0, 0.5], axis, mode="nearest")
                for values in (seen, others)
            )
            common += np.float32(reach) * here * there * inverse
            alone += np.float32(reach) * here * here * inverse
        common, alone = (
            ndimage.gaussian_filter(each, _NEAR_SIGMA, mode="nearest", truncate=_NEAR_END)
            for each in (common, alone)
        )
        low, high = _AGREED
        share = common / np.maximum(alone, 1e-9)
        return np.asarray(np.clip((share - low) / (high - low), 0, 1))

    def _count_ends(self, costs: Floats32) -> None:
        """Count where windows of some pixels fit best: what lies beyond the range fits its end."""
        side = min(_WINDOW, *costs.shape[:2])
        rows = len(costs) // side
        means = costs[: rows * side].reshape(rows, side, *costs.shape[1:]).mean(1)
        means = ndimage.uniform_filter1d(means, side, 1, mode="nearest")
        best, least = means.argmin(2), means.min(2)
        matched = least < _FITS * means.mean(2)
        self.ends += [
            int((matched & (best == 0)).sum()),
            int((matched & (best == costs.shape[2] - 1)).sum()),
            int(matched.sum()),
        ]

    def _confidence(self, sums: Floats32, pixels: Floats32) -> Floats32:
        """Probability that a disparity is right, of all candidates by their sums of costs."""
        sums -= sums.min(2, keepdims=True)
        likely = np.exp(-np.float32(_SHARP) * sums)
        step = float(self.candidates[1] - self.candidates[0])
        away = np.abs(self.candidates.astype(np.float32) - pixels[..., np.newaxis])
        # Candidates count by how much of their step lies within the bound.
        near = np.clip((RIGHT - away) / step + 0.5, 0, 1).astype(np.float32)
        share = (near * likely).sum(2) / likely.sum(2)
        blind = near.mean(2)
        return np.asarray(np.clip((share - blind) / (1 - blind), 0, 1))


def _grey(image: Image) -> Floats32:
    """Mean of the channels: what differs in any of them is seen."""
    values = image.astype(np.float32)
    return values if values.ndim == 2 else np.asarray(values.mean(axis=2))


def _gaps(count: int, side: int, most: int) -> set[int]:
    """Places of the views along a line that are compared with its central one, and its own."""
    centre = count // 2
    return {
        sign * round(gap)
        for sign, reach in ((-1, min(centre, most)), (1, min(count - 1 - centre, most)))
        for gap in np.linspace(0, reach, min(side, reach) + 1)
    }


def _prefiltered(view: Floats32, soft: float) -> Floats32:
    """Coefficients of B-splines through a view, or smoother: with `soft` = 1 its own values."""
    if soft == 1:
        return view
    through = ndimage.spline_filter(view, 3, np.float32, "mirror")
    return np.asarray(soft * view + np.float32(1 - soft) * through)


def _smooth(coefficients: Floats32) -> Floats32:
    """Values of B-splines at whole pixels."""
    for axis in (0, 1):
        coefficients = ndimage.correlate1d(coefficients, _SPLINE, axis, mode="mirror")
    return coefficients


def _slope(coefficients: Floats32) -> Floats32:
    """Slopes of B-splines at whole pixels, down and right."""
    return np.stack(
        [
            ndimage.correlate1d(
                ndimage.correlate1d(coefficients, [-0.5, 0, 0.5], axis, mode="mirror"),
                _SPLINE,
                1 - axis,
                mode="mirror",
            )
            for axis in (0, 1)
        ]
    )


def _slopes(values: Floats32) -> Floats32:
    """Squares of the slopes, over 3 x 3 pixels."""
    squares = sum(
        ndimage.correlate1d(values, [-0.5, 0, 0.5], axis, mode="nearest") ** 2 for axis in (0, 1)
    )
    return np.asarray(ndimage.uniform_filter(squares, 3, mode="nearest"))


@cache
def _gain(soft: float) -> float:
    """Share of the noise's variance that is left after `_prefiltered` and `_smooth`."""
    point = np.zeros((17, 17), np.float32)
    point[8, 8] = 1
    return float((_smooth(_prefiltered(point, soft)) ** 2).sum())
