# SPDX-License-Identifier: Apache-2.0
"""Disparity between views, how likely it is right, and depth from it.

A point that is sharp at focus setting a lies at x - a (u - c) micro lenses in view u, so the
disparity between neighbouring views is a: the ray model gives its distance.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.lightfield.indexing import views
from plenofir.camera.lightfield.matching import Matcher
from plenofir.camera.rays.microscope import MicroscopeModel
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

SEARCH = -1.0, 2.0
"""Range of disparities in pixels per view that is searched if nothing else is said."""
LEAST_CONFIDENCE = 0.5
"""Confidence from which on a depth counts as known, if nothing else is said."""

# Sigmas of the surroundings from which improbable values are taken, and how much each counts.
_SURROUNDINGS = (2.0, 1.0), (8.0, 0.02)
# If more than this share of the matched pixels is found at an end of the range, it is too small.
MANY = 0.03
# Limit to which an end of the range is moved automatically.
_WIDEST = 8.0
# Parts of a picture are matched with a margin, of at most so many costs at once.
_MARGIN, _MOST_COSTS = 32, 2**24


@dataclass(frozen=True)
class Disparity:
    """Disparity of each pixel of a view.

    `pixels_per_view`: disparity between neighbouring views in pixels (micro lenses), shape (t, s).
    `confidence`: probability that it is off by `plenofir.camera.lightfield.matching.RIGHT` at most,
    0 where all fit equally well.
    """

    pixels_per_view: Floats
    confidence: Floats

    def limited(self, low: float, high: float) -> "Disparity":
        """The map with disparities limited to a range."""
        return replace(self, pixels_per_view=np.clip(self.pixels_per_view, low, high))

    def settled(self) -> Floats:
        """Disparities, and where they are improbable those of the surroundings, shape (t, s)."""
        around, weight = np.zeros(self.confidence.shape), np.full(self.confidence.shape, 1e-9)
        sure = self.confidence >= LEAST_CONFIDENCE
        around += 1e-9 * (np.median(self.pixels_per_view[sure]) if sure.any() else 0.0)
        probable = self.confidence * self.pixels_per_view
        for sigma, counts in _SURROUNDINGS:
            around += counts * ndimage.gaussian_filter(probable, sigma, mode="nearest")
            weight += counts * ndimage.gaussian_filter(self.confidence, sigma, mode="nearest")
        return np.asarray(probable + (1 - self.confidence) * around / weight)


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
    (`plenofir.camera.lightfield.matching`). What fits best near the candidate that this gives is
    drawn to that of each pixel's neighbours, the more, the less sure it is.

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
    match = Matcher(images, search)
    pixels, confidence = np.zeros(size), np.zeros(size)
    if not np.ptp(match.seen):
        return Disparity(pixels, confidence), (0.0, 0.0)
    # Memory stays bounded.
    side = max(2 * _MARGIN, int((_MOST_COSTS / len(match.candidates)) ** 0.5))
    parts = [(rows, columns) for rows in _parts(size[0], side) for columns in _parts(size[1], side)]
    for number, part in enumerate(parts, 1):
        whole = tuple(slice(max(0, p.start - _MARGIN), p.stop + _MARGIN) for p in part)
        inside = tuple(
            slice(p.start - w.start, p.stop - w.start) for p, w in zip(part, whole, strict=True)
        )
        results = match.results(whole[0], whole[1])
        for result, values in zip((pixels, confidence), results, strict=True):
            result[part] = values[inside]
        if progress is not None:
            progress(number, len(parts))
    below, above, matched = match.ends.tolist()
    return Disparity(pixels, confidence), (below / max(matched, 1), above / max(matched, 1))


def _parts(length: int, side: int) -> list[slice]:
    """Parts of a picture's side."""
    return [slice(first, min(first + side, length)) for first in range(0, length, side)]


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
        disparity, at_ends = _matched(images, (low, high), progress)
        wider = tuple(
            float(np.clip(2 * end, -widest, widest)) if limit is None and share > MANY else end
            for end, limit, share in zip(search, given, at_ends, strict=True)
        )
        if wider == search:
            return Searched(disparity, (low, high), at_ends)
        search = wider


def sure_distances(
    disparity: Disparity, model: RayModel | MicroscopeModel, least_confidence: float
) -> Floats:
    """Distances in mm of pixels of at least that confidence, as in `DepthMap`.

    With a microscope's model their heights in um over the plane in focus.
    """
    a = disparity.pixels_per_view
    distances = model.height_um(a) if isinstance(model, MicroscopeModel) else model.distance(a).mm
    return np.where(disparity.confidence >= least_confidence, distances, np.nan)


def depth_map(
    raw: Image,
    model: RayModel,
    *,
    search: tuple[float, float] = SEARCH,
    least_confidence: float = LEAST_CONFIDENCE,
    progress: Callable[[int, int], None] | None = None,
) -> DepthMap:
    """Depth of what a camera sees, in mm.

    `raw`: raw image of micro images of the model's M. `model`: the camera, focused as it was.
    `search`, `progress`: as in `views_disparity`. `least_confidence`: pixels below this confidence
    get no distance. Result: distances from the micro lenses, shape (t, s).
    """
    disparity = light_field_disparity(raw, model.micro_image_size, search=search, progress=progress)
    return DepthMap(sure_distances(disparity, model, least_confidence), disparity)
