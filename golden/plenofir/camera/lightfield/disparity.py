# SPDX-License-Identifier: Apache-2.0
"""Disparity between views, how likely it is right, and depth from it.

A point that is sharp at focus setting a lies at x - a (u - c) micro lenses in view u, so the
disparity between neighbouring views is a: the ray model gives its distance.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.lightfield.indexing import views
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]
Floats32 = npt.NDArray[np.float32]

SEARCH = -1.0, 2.0
"""Range of disparities in pixels per view that is searched if nothing else is said."""
RIGHT = 0.07
"""Error of a disparity up to which it counts as right."""
LEAST_CONFIDENCE = 0.5
"""Confidence from which on a depth counts as known, if nothing else is said."""

# If more than this share of the matched pixels is found at an end of the range, it is too small.
MANY = 0.03
# Limit to which an end of the range is moved automatically.
_WIDEST = 8.0
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
# Parts of a picture are matched with a margin, of at most so many costs at once.
_MARGIN, _MOST_COSTS = 32, 2**24
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
# Vertex of a parabola: at most so many candidates aside. Weight of a neighbour; iterations.
_ASIDE, _STIFFNESS, _TIMES = 1.5, 20.0, 40
# Sharpness of the distribution of probability over the candidates, by what `plenofir report depth`
# shows as reliable.
_SHARP = 2.0


@dataclass(frozen=True)
class Disparity:
    """Disparity of each pixel of a view.

    `pixels_per_view`: disparity between neighbouring views in pixels (micro lenses), shape (t, s).
    `confidence`: probability that it is off by `RIGHT` at most, 0 where all fit equally well.
    """

    pixels_per_view: Floats
    confidence: Floats

    def limited(self, low: float, high: float) -> "Disparity":
        """The same with disparities limited to a range."""
        return replace(self, pixels_per_view=np.clip(self.pixels_per_view, low, high))


@dataclass(frozen=True)
class Searched:
    """Disparity, and how its search went.

    `search`: smallest and largest disparity searched. `at_ends`: shares of the matched pixels that
    were found at the one and at the other.
    """

    disparity: Disparity
    search: tuple[float, float]
    at_ends: tuple[float, float]


@dataclass(frozen=True)
class DepthMap:
    """Depth of each pixel of the central view.

    `distance_mm`: distance from the micro lenses; nan at and beyond infinity and where confidence
    is low. `disparity`: what it comes from.
    """

    distance_mm: Floats
    disparity: Disparity


def check_search(search: tuple[float, float], most: int) -> None:
    """Refuse a range that is empty, or moves a point from one view to the next by more than `most`.

    Such a point is seen in one view alone.
    """
    low, high = search
    if not -np.inf < low < high < np.inf:
        raise InputError(
            f"the search from {low} to {high} is empty; give the smaller disparity first"
        )
    if max(-low, high) > most:
        raise InputError(
            f"the search from {low:g} to {high:g} goes beyond the views; use -{most} to {most}"
        )


def light_field_disparity(
    raw: Image,
    micro_image_size: int,
    *,
    search: tuple[float, float] = SEARCH,
    progress: Callable[[int, int], None] | None = None,
) -> Disparity:
    """Disparity of the central view against others around it, `views_disparity`.

    `micro_image_size`: M in pixels, 2 or more; for even M the central view is the one below and
    right of the centre. Result: shape (t, s). Raises `InputError` if M is below 2.
    """
    _check_views(micro_image_size)
    return views_disparity(views(raw, micro_image_size), search=search, progress=progress)


def _check_views(m: int) -> None:
    if m < 2:
        raise InputError(f"M = {m} is a single view, which has no disparity; M must be 2 or more")


def views_disparity(
    images: Image,
    *,
    search: tuple[float, float] = SEARCH,
    progress: Callable[[int, int], None] | None = None,
) -> Disparity:
    """Disparity of the view in the middle of views (v, u, t, s[, 3]), a square, rectangle or line.

    Each pixel's differences to the other views are set against the noise, which is measured, and
    limited, because a point may be hidden from some; paths over the picture join them
    (`plenofir.camera.lightfield.matching`). The vertex of each pixel's cost then is drawn to those
    of its neighbours, the more, the less sure it is.

    `search`: smallest and largest disparity in pixels per view. Result: shape (t, s); 0 with
    confidence 0 where nothing is seen. Raises `InputError` if the range cannot be used or there is
    no other view.
    """
    return _matched(images, search, progress)[0]


def _matched(
    images: Image, search: tuple[float, float], progress: Callable[[int, int], None] | None
) -> tuple[Disparity, tuple[float, float]]:
    """Disparity, and the shares of what is matched that lie at the ends of the range."""
    size = images.shape[2:4]
    check_search(search, max(size))
    match = _Match(images, search)
    pixels, confidence = np.zeros(size), np.zeros(size)
    if not np.ptp(match.seen):
        return Disparity(pixels, confidence), (0.0, 0.0)
    parts = [
        (rows, columns)
        for rows in _parts(size[0], match.side())
        for columns in _parts(size[1], match.side())
    ]
    for number, part in enumerate(parts, 1):
        whole = tuple(slice(max(0, p.start - _MARGIN), p.stop + _MARGIN) for p in part)
        inside = tuple(
            slice(p.start - w.start, p.stop - w.start) for p, w in zip(part, whole, strict=True)
        )
        found = match.found(whole[0], whole[1])
        for result, values in zip((pixels, confidence), found, strict=True):
            result[part] = values[inside]
        if progress is not None:
            progress(number, len(parts))
    below, above, matched = match.ends.tolist()
    return Disparity(pixels, confidence), (below / max(matched, 1), above / max(matched, 1))


def _parts(length: int, side: int) -> list[slice]:
    """Parts of a picture's side."""
    return [slice(first, min(first + side, length)) for first in range(0, length, side)]


class _Match:
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

    def side(self) -> int:
        """Side of the parts that are matched at once, so that memory stays bounded."""
        return max(2 * _MARGIN, int((_MOST_COSTS / len(self.candidates)) ** 0.5))

    def _noise(self) -> tuple[Floats, Floats]:
        """Variance of a pixel's noise over its brightness: both ascending in brightness."""
        from plenofir.camera.lightfield.matching import match_costs

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
        found = [float(np.median(least[even][group])) / (2 * _gain(1.0)) for group in groups]
        return np.array(levels), np.array(found)

    def _prepared(self, rows: slice, columns: slice) -> Floats32:
        """A part of the views, to be interpolated by B-splines, with a margin around it."""
        return np.stack(
            [
                np.pad(_prefiltered(view[rows, columns], self.soft), self.pad, mode="edge")
                for view in self.views
            ]
        )

    def found(self, rows: slice, columns: slice) -> tuple[Floats32, Floats32]:
        """Disparity and confidence of a part of the picture."""
        from plenofir.camera.lightfield.matching import add_paths, joined, match_costs

        seen = _smooth(_prefiltered(self.seen[rows, columns], self.soft))
        gain = _gain(self.soft)
        noise = gain * np.interp(seen, *self.noise)
        slopes = np.maximum(_slopes(seen) - _NOISE_SLOPE / _gain(1.0) * noise, 0)
        variance = 2 * noise + _MISFIT**2 * slopes + _FLOOR**2
        costs = np.empty((*seen.shape, len(self.candidates)), np.float32)
        match_costs(
            self._prepared(rows, columns),
            self.gaps,
            self.pad,
            np.arange(len(seen)),
            seen,
            (1 / variance).astype(np.float32),
            self.candidates,
            np.float32(_MOST),
            np.float32(_UNSEEN),
            costs,
        )
        self._count_ends(costs)
        costs *= np.float32(_TRUST * np.sqrt(len(self.views)))
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
        inner = np.clip(best, 1, len(self.candidates) - 2)
        before, least, after = (
            np.take_along_axis(costs, (inner + k)[..., np.newaxis], 2)[..., 0] for k in (-1, 0, 1)
        )
        bend = before - 2 * least + after
        aside = 0.5 * (before - after) / np.maximum(bend, 1e-6)
        sure = (bend > 1e-6) & (np.abs(aside) <= _ASIDE)
        vertex = self.candidates[best]
        vertex[sure] = (self.candidates[inner] + aside * step)[sure]
        pixels = joined(
            vertex.astype(np.float32),
            np.where(sure, bend, 0).astype(np.float32),
            guide,
            np.float32(_STIFFNESS),
            np.float32(step),
            _TIMES,
        )
        return pixels, self._confidence(sums, pixels)

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


def search_disparity(
    raw: Image,
    micro_image_size: int,
    *,
    smallest: float | None = None,
    largest: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Searched:
    """Disparity of the central view of a raw image, see `search_views`."""
    _check_views(micro_image_size)
    images = views(raw, micro_image_size)
    return search_views(images, smallest=smallest, largest=largest, progress=progress)


def search_views(
    images: Image,
    *,
    smallest: float | None = None,
    largest: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Searched:
    """Disparity of the view in the middle of views (v, u, t, s[, 3]), in a range that fits.

    `smallest`, `largest`: ends of the range; one that is None starts at that of `SEARCH`, and moves
    to twice that while more than `MANY` of what is matched lies there.
    """
    given = smallest, largest
    widest = min(_WIDEST, float(max(images.shape[2:4])))
    search = tuple(start if end is None else end for end, start in zip(given, SEARCH, strict=True))
    while True:
        low, high = search
        found, at_ends = _matched(images, (low, high), progress)
        wider = tuple(
            float(np.clip(2 * end, -widest, widest)) if limit is None and share > MANY else end
            for end, limit, share in zip(search, given, at_ends, strict=True)
        )
        if wider == search:
            return Searched(found, (low, high), at_ends)
        search = wider


def sure_distances(found: Disparity, model: RayModel, least_confidence: float) -> Floats:
    """Distances in mm of pixels of at least that confidence, as in `DepthMap`."""
    distances = model.distance(found.pixels_per_view).mm
    return np.where(found.confidence >= least_confidence, distances, np.nan)


def depth_map(
    raw: Image,
    model: RayModel,
    *,
    search: tuple[float, float] = SEARCH,
    least_confidence: float = LEAST_CONFIDENCE,
    progress: Callable[[int, int], None] | None = None,
) -> DepthMap:
    """Depth of what a camera sees, in mm.

    Result: distances from the micro lenses, shape (t, s).

    Parameters
    ----------
    raw
        Raw image of micro images of the model's M.
    model
        The camera, focused as it was.
    search, progress
        As in `views_disparity`.
    least_confidence
        Pixels below this confidence get no distance.
    """
    found = light_field_disparity(raw, model.micro_image_size, search=search, progress=progress)
    return DepthMap(sure_distances(found, model, least_confidence), found)
