# SPDX-License-Identifier: Apache-2.0
"""Disparity between views by absolute differences, and depth from it.

A point that is sharp at focus setting a lies at x - a (u - c) micro lenses in view u, so the
disparity between neighbouring views is a: the ray model gives its distance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.frames import grey
from plenofir.camera.lightfield.guided import GuidedMean
from plenofir.camera.lightfield.indexing import views
from plenofir.camera.lightfield.structure import structure_tensor_disparity
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]

SEARCH = -1.0, 2.0
"""Range of disparities in pixels per view that is searched if nothing else is said."""

Method = Literal["guided", "windows", "structure-tensor"]
"""Ways to find disparities: differences averaged up to the edges of the central view, or over whole
windows; slopes in epipolar plane images."""

# Candidates are this many pixels apart in the views that are farthest from each other.
_STEP = 0.25
# If more than this share of the matched pixels is found at an end of the range, it is too small.
MANY = 0.03
# Limit to which an end of the range is moved automatically.
_WIDEST = 8.0
# Guided: differences are limited to this share of the picture's standard deviation. Larger ones
# come from points that are hidden in one of the views.
_HIDDEN = 0.4
# Other views on each side of the central one.
_SIDE = 4


@dataclass(frozen=True)
class Disparity:
    """Disparity of each pixel of a view.

    `pixels_per_view`: disparity between neighbouring views in pixels (micro lenses), shape (t, s).
    `confidence`: 0 where all disparities fit equally well, towards 1 where one fits far better.
    """

    pixels_per_view: Floats
    confidence: Floats


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


def sad_disparity(
    reference: Image | Floats,
    others: Sequence[tuple[Image | Floats, tuple[float, float]]],
    *,
    search: tuple[float, float] = SEARCH,
    window: int = 7,
    guided: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Disparity:
    """Disparity by the sum of absolute differences, with sub-pixel refinement.

    Differences are averaged over a window and over all views given.

    Result: positive for what is nearer than the plane of disparity zero. Raises `InputError` if the
    views, the search range or the window cannot be used.

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
    guided
        Windows end at the edges of the reference (`GuidedMean`); differences are limited, because
        a point may be hidden from a view; what stands alone takes its neighbours' disparity.
    """
    if not others or any(gap == (0, 0) for _, gap in others):
        raise InputError(
            "there is no other view to compare with; the views must have no gaps from the first on"
        )
    if window < 1 or window % 2 == 0:
        raise InputError(f"the window of {window} pixels must be an odd number")
    low, high = search
    if not -np.inf < low < high < np.inf:
        raise InputError(
            f"the search from {low} to {high} is empty; give the smaller disparity first"
        )
    base = grey(reference)
    # A point that moves by more than the picture from one view to the next is seen in one alone.
    most = max(base.shape)
    if max(-low, high) > most:
        raise InputError(
            f"the search from {low:g} to {high:g} goes beyond the views; use -{most} to {most}"
        )
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
    guide = GuidedMean(reference, window) if guided else None
    limit = _HIDDEN * float(base.std()) if guided else np.inf
    # Only the costs of the best candidate, its neighbours and the latest one are kept.
    least, total = np.full(base.shape, np.inf), np.zeros(base.shape)
    best = np.zeros(base.shape, np.int64)
    before, after, last = (np.zeros(base.shape) for _ in range(3))
    for n, candidate in enumerate(candidates):
        differences = np.zeros(base.shape)
        for values, gap in splines:
            differences += np.minimum(np.abs(base - _moved(values, candidate, gap)), limit)
        differences /= len(splines)
        if guide is None:
            cost = ndimage.uniform_filter(differences, window, mode="nearest")
        else:
            cost = guide(differences)
        after = np.where(best == n - 1, cost, after)
        better = cost < least
        before = np.where(better, last, before)
        best[better] = n
        least = np.minimum(cost, least)
        total += cost
        last = cost
        if progress is not None:
            progress(n + 1, len(candidates))
    bend = before - 2 * least + after
    shift = np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1), 0.0)
    at_end = (best == 0) | (best == len(candidates) - 1)
    step = candidates[1] - candidates[0]
    pixels = candidates[best] + np.where(at_end, 0.0, np.clip(shift, -1, 1) * step)
    if guided:
        pixels = ndimage.median_filter(pixels, 3, mode="nearest")
    usual = total / len(candidates)
    # Squared: noise raises the cost of even the best match, and those that fit somewhat better are
    # right.
    confidence = np.clip(1 - (least / np.maximum(usual, 1e-9)) ** 2, 0, 1)
    return Disparity(pixels, np.where(usual > 1e-9, confidence, 0.0))


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


def light_field_disparity(
    raw: Image,
    micro_image_size: int,
    *,
    search: tuple[float, float] = SEARCH,
    window: int = 7,
    method: Method = "guided",
    progress: Callable[[int, int], None] | None = None,
) -> Disparity:
    """Disparity of the central view against those above, below, left and right of it.

    `micro_image_size`: M in pixels, 2 or more; for even M the central view is the one below and
    right of the centre. `search`, `window`, `progress`: as in `sad_disparity`. `method`: see
    `Method`. Result: shape (t, s). Raises `InputError` if M is below 2.
    """
    m = micro_image_size
    if m < 2:
        raise InputError(f"M = {m} is a single view, which has no disparity; M must be 2 or more")
    return views_disparity(
        views(raw, m), search=search, window=window, method=method, progress=progress
    )


def views_disparity(
    images: Image,
    *,
    search: tuple[float, float] = SEARCH,
    window: int = 7,
    method: Method = "guided",
    progress: Callable[[int, int], None] | None = None,
) -> Disparity:
    """Disparity as of `light_field_disparity`, of views (v, u, t, s[, 3]).

    A line of views, or a rectangle, has what there is of those above, below, left and right.
    """
    if method == "structure-tensor":
        return Disparity(*structure_tensor_disparity(images, search, window, progress))
    down, right = (count // 2 for count in images.shape[:2])
    others = [
        *((images[down + g, right], (float(g), 0.0)) for g in _gaps(images.shape[0])),
        *((images[down, right + g], (0.0, float(g))) for g in _gaps(images.shape[1])),
    ]
    return sad_disparity(
        images[down, right],
        others,
        search=search,
        window=window,
        guided=method == "guided",
        progress=progress,
    )


def _gaps(count: int) -> list[int]:
    """Places of the views along a line that are compared with its central one."""
    centre = count // 2
    gaps = {
        sign * round(gap)
        for sign, reach in ((-1, centre), (1, count - 1 - centre))
        for gap in np.linspace(reach, reach / min(_SIDE, max(reach, 1)), _SIDE)
    }
    return sorted(gaps - {0})


def search_disparity(
    raw: Image,
    micro_image_size: int,
    *,
    smallest: float | None = None,
    largest: float | None = None,
    window: int = 7,
    method: Method = "guided",
    least_confidence: float = 0.3,
    progress: Callable[[int, int], None] | None = None,
) -> Searched:
    """Disparity of the central view in a range that fits the picture.

    `smallest`, `largest`: ends of the range; one that is None starts at that of `SEARCH`, and moves
    to twice that while many matched pixels lie there. Pixels of `least_confidence` are matched. The
    others: as in `light_field_disparity`.
    """

    def found(search: tuple[float, float]) -> Disparity:
        return light_field_disparity(
            raw, micro_image_size, search=search, window=window, method=method, progress=progress
        )

    widest = min(_WIDEST, float(max(raw.shape[:2]) // micro_image_size))
    return _search(found, (smallest, largest), widest, least_confidence)


def search_views(
    images: Image,
    *,
    smallest: float | None = None,
    largest: float | None = None,
    window: int = 7,
    method: Method = "guided",
    least_confidence: float = 0.3,
    progress: Callable[[int, int], None] | None = None,
) -> Searched:
    """Disparity as of `search_disparity`, of views (v, u, t, s[, 3])."""

    def found(search: tuple[float, float]) -> Disparity:
        return views_disparity(
            images, search=search, window=window, method=method, progress=progress
        )

    widest = min(_WIDEST, float(max(images.shape[2:4])))
    return _search(found, (smallest, largest), widest, least_confidence)


def _search(
    disparity: Callable[[tuple[float, float]], Disparity],
    given: tuple[float | None, float | None],
    widest: float,
    least_confidence: float,
) -> Searched:
    """The disparity in a range that grows until it covers the picture."""
    search = tuple(start if end is None else end for end, start in zip(given, SEARCH, strict=True))
    while True:
        low, high = search
        found = disparity((low, high))
        matched = found.pixels_per_view[found.confidence >= least_confidence]
        beyond = [float((matched == end).sum()) / max(matched.size, 1) for end in search]
        wider = tuple(
            float(np.clip(2 * end, -widest, widest)) if limit is None and share > MANY else end
            for end, limit, share in zip(search, given, beyond, strict=True)
        )
        if wider == search:
            return Searched(found, (low, high), (beyond[0], beyond[1]))
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
    window: int = 7,
    least_confidence: float = 0.3,
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
    search, window, progress
        As in `sad_disparity`.
    least_confidence
        Pixels below this confidence get no distance.
    """
    found = light_field_disparity(
        raw, model.micro_image_size, search=search, window=window, progress=progress
    )
    return DepthMap(sure_distances(found, model, least_confidence), found)
