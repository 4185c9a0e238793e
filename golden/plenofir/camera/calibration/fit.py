"""Fit of a grid to the centroids of all micro images."""

from dataclasses import dataclass, replace
from math import sqrt
from typing import get_args

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.centroids import (
    CORE_HALF_WIDTH,
    Image32,
    Moments,
    core_brightness,
    matched_offsets,
    reach,
    response,
    windowed_moments,
)
from plenofir.camera.calibration.evidence import Evidence
from plenofir.camera.calibration.grid import (
    MAX_ORDER,
    Flags,
    Floats,
    Grid,
    Indices,
    Layout,
    exponents,
    polynomial_terms,
)
from plenofir.camera.calibration.lattice import (
    Lattice,
    guess,
    lattices,
    layout_misfits,
    no_grid,
    reduced,
)
from plenofir.errors import InputError

_FIRST_RADIUS = 5.0
# Pixels reach half a pixel beyond their centres; a little more for centres on the very border.
_BORDER = 0.52
_ORDER_LENSES = 4000
_SLOPE_LENSES = 8000
# Distortion of less than this many pixels (root mean square) is not modelled.
_SMALLEST_DISTORTION = 0.015
_GROWTH = 1.6
# Tukey's biweight: residuals beyond this many (robust) standard deviations do not count.
_TUKEY = 6.0
_SHADING_ORDER = 4
_LARGEST_LOG = 30.0
# Below this share of the brightness around it, a micro image counts as missing.
_MISSING = 0.05
_DARK = 0.02
# If centroids scatter by more than this share of a pitch, there is no grid.
_LARGEST_SCATTER = 0.12
_FEWEST_USED = 0.5
_FEWEST_LENSES = 14
_SMALLEST_PITCH = 2.8
# Flattened micro images beyond these shares of the usual brightness are left out.
_DIMMEST, _BRIGHTEST = 0.25, 1.8
# Shading is not divided by where it is less than this share of the brightest part.
_DARKEST_SHADING = 0.03
# Brightness (share of the brightest) of lenses whose centroids count half.
_HALF_WEIGHT = 0.15
# A lens beside this many unlit ones is at the border of the image circle, which cuts it off.
_UNLIT_NEIGHBOURS = 3
_LARGEST_MISSING = 0.45
_LARGEST_CENTRE_ERROR = 0.12
_CHANCE = 4.5
_SMALLEST_CELL_MARGIN = 0.4
_CELL_SAMPLES = 12
_CELL_LENSES = 600
# Fewer lenses than this share of the usual in every second or third row: the grid is too fine.
_EVEN_CLASSES = 0.4
_CANDIDATES = 4
# Lattices with less than this share of the highest score are not tried.
_LIKELY = 0.5
_LEAST_FIT = 9
# Lens vectors may differ from those of a square or hexagonal array by this share of a pitch.
_LARGEST_MISFIT = 0.04
_MANY_LENSES = 400
_LARGE_PITCH = 16.0
# Smallest scatter (in pitches) that large micro images are given: a missing neighbour moves them
# a little, which makes no outliers of them.
_LARGE_FLOOR = 5e-4
# Pixels and micro images have a moire, which grows as the pitch gets smaller (square pixels).
_MOIRE = 0.12
_PROBE = 0.18
# A second spot is at least this many pitches from the first.
_SECOND_SPOT = 0.47
# Lenses whose brightness varies less than this say nothing about the level without light.
_EVEN_LIGHT = 0.15
# Distortion of less than this share of a pitch is not modelled either.
_DISTORTION_SHARE = 0.001
_WEAKEST_RESPONSE = 0.02
# Response of the small window, as a share of what spots would give it, for an even middle.
_EVEN_MIDDLE = 0.6


@dataclass(frozen=True)
class Fit:
    """A grid and how well it fits.

    Attributes
    ----------
    grid
        The grid, lens (0, 0) at the top left.
    shape
        Rows and columns of lenses whose centres lie in the image somewhere.
    present
        Whether the lens is in the image and lit, shape `shape`.
    brightness
        Brightness of each lens's middle over that of the brightest part, nan where it is outside;
        shape `shape`.
    shading
        Coefficients of the logarithm of the smooth part of the brightness, see `shading_at`.
    residual_px
        Robust standard deviation of single centroids from the grid (each of y and x).
    used
        Number of micro images whose centroids were used.
    evidence
        What speaks for this grid.
    """

    grid: Grid
    shape: tuple[int, int]
    present: Flags
    brightness: Floats
    shading: Floats
    residual_px: float
    used: int
    evidence: Evidence


def shading_at(coefficients: Floats, positions: Floats, image_shape: tuple[int, int]) -> Floats:
    """Smooth part of the white image: vignetting of the main lens."""
    order = next(n for n in range(20) if len(exponents(n)) == len(coefficients))
    logs = polynomial_terms(_unit(positions, image_shape), order) @ coefficients
    # Far from all lenses the polynomial goes anywhere.
    return np.exp(np.clip(logs, -_LARGEST_LOG, _LARGEST_LOG))


def within(centres: Floats, image_shape: tuple[int, int]) -> Flags:
    """Whether centres lie in an image."""
    end = np.array(image_shape) - 1
    return np.asarray(((centres >= -_BORDER) & (centres <= end + _BORDER)).all(axis=-1))


def _unit(positions: Floats, image_shape: tuple[int, int]) -> Floats:
    half = (np.array(image_shape) - 1) / 2
    return np.clip((positions - half) / half, -1.0, 1.0)


def _shading_slope(coefficients: Floats, positions: Floats, image_shape: tuple[int, int]) -> Floats:
    """Relative slope of the shading along y and x for each pixel."""
    steps = np.eye(2)
    return np.stack(
        [
            (
                np.log(shading_at(coefficients, positions + step, image_shape))
                - np.log(shading_at(coefficients, positions - step, image_shape))
            )
            / 2
            for step in steps
        ],
        axis=-1,
    )


def weighted_fit(terms: Floats, values: Floats, weights: Floats) -> Floats:
    """Linear least squares."""
    # The terms' arguments are within -1 and 1, which keeps the normal equations well conditioned.
    weighted = terms * weights[:, np.newaxis]
    return np.asarray(np.linalg.lstsq(weighted.T @ terms, weighted.T @ values, rcond=None)[0])


def robust_fit(
    terms: Floats, values: Floats, floor: float, prior: Floats | None = None, rounds: int = 12
) -> tuple[Floats, Floats, float]:
    """Least squares that outliers cannot bend: iterated, with Tukey's biweight."""
    prior = np.ones(len(values)) if prior is None else prior
    weights: Floats = prior
    scale = 0.0
    for _ in range(rounds):
        coefficients = weighted_fit(terms, values, weights)
        residual = values - terms @ coefficients
        residual = residual * np.sqrt(prior)[:, np.newaxis]
        spread = 1.4826 * float(np.median(np.abs(residual)))
        scale = max(spread * sqrt(len(terms) / max(1, len(terms) - terms.shape[1])), floor)
        distance = np.sqrt((residual**2).sum(axis=1)) / (_TUKEY * scale)
        new = prior * np.where(distance < 1, (1 - distance**2) ** 2, 0.0)
        if np.abs(new - weights).max() < 1e-3:
            weights = new
            break
        weights = new
    return weighted_fit(terms, values, weights), weights, scale


def _indices_within(grid: Grid, corners: Floats) -> tuple[Indices, Indices]:
    """Rows and columns of all lenses that can lie in a box, given its outline."""
    lattice = grid.inverse(corners)
    low = np.floor(lattice.min(axis=0)).astype(np.int64) - 1
    high = np.ceil(lattice.max(axis=0)).astype(np.int64) + 1
    t, s = np.meshgrid(
        np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1), indexing="ij"
    )
    return t, s


def _outline(low: Floats, high: Floats) -> Floats:
    """Points on the border of a box."""
    steps = np.linspace(0, 1, 9)
    sides = []
    for axis in (0, 1):
        for end in (low, high):
            points = np.empty((len(steps), 2))
            points[:, axis] = end[axis]
            points[:, 1 - axis] = low[1 - axis] + steps * (high - low)[1 - axis]
            sides.append(points)
    return np.concatenate(sides)


def lens_indices(grid: Grid, image_shape: tuple[int, int]) -> tuple[Indices, Indices]:
    """Rows and columns of all lenses that can lie in an image, and a few around it."""
    end = np.array(image_shape) - 0.5
    return _indices_within(grid, _outline(np.full(2, -0.5), end))


def _extents(grid: Grid) -> tuple[float, float]:
    """Pitch along y and x for the windows: extent of a lens's cell."""
    down, right = grid.pitch
    if grid.layout == "hexagonal-rows":
        return right, right
    return (down, down) if grid.layout == "hexagonal-columns" else (down, right)


class _Fitter:
    """State of the growing fit."""

    def __init__(self, image: Image32, grid: Grid) -> None:
        self.image = image
        self.shape = image.shape[0], image.shape[1]
        self.grid = grid
        self.shading: Floats | None = None
        self.scatter = 0.0
        self.weights: Floats = np.empty(0)
        self.unit = 1.0
        self.covariance: Floats = np.empty(0)
        # Windows of lenses at the border reach beyond it, where the edge pixels are repeated.
        self.margin = int(reach(max(_extents(grid)))) + 2
        self.padded = np.pad(image, self.margin, mode="edge")

    def lenses(self, radius: float, margin: float) -> tuple[Indices, Indices, Floats]:
        """Lenses in the box of a radius around the middle, and margin inside the image."""
        end = np.array(self.shape) - 1.0
        middle = end / 2
        low = np.maximum(middle - radius, margin)
        high = np.minimum(middle + radius, end - margin)
        if (low >= high).any():
            raise no_grid("image too small for its micro images")
        t, s = _indices_within(self.grid, _outline(low, high))
        centres = self.grid.centres(t, s)
        inside = ((centres >= low) & (centres <= high)).all(axis=-1)
        return t[inside], s[inside], centres[inside]

    def whole_lenses(self, radius: float) -> tuple[Indices, Indices, Floats]:
        """Lenses whose micro images are whole; of few lenses also those close to the border."""
        pitch = max(_extents(self.grid))
        found = self.lenses(radius, 0.5 * pitch)
        if len(found[0]) > _MANY_LENSES:
            found = self.lenses(radius, 0.65 * pitch + 1)
        return found

    def core(self, centres: Floats) -> Floats:
        """Brightness of the middle of micro images."""
        return core_brightness(self.padded, centres + self.margin, _extents(self.grid))

    def measure(self, centres: Floats) -> Floats:
        """Centroids around expected centres, in pixels."""
        pitch = _extents(self.grid)
        places = centres + self.margin
        moments = windowed_moments(self.padded, places, pitch)
        factors = response(self.padded, places, pitch)
        if factors.min() < _WEAKEST_RESPONSE:
            raise no_grid("nothing that repeats like micro images")
        offsets = moments.offsets
        if self.shading is not None:
            slope = self.inner_slope(centres, moments, factors)
            offsets = offsets - slope * moments.variances
        largest = np.array(pitch) / 2
        return centres + np.clip(offsets / factors, -largest, largest)

    def inner_slope(self, centres: Floats, moments: Moments, factors: Floats) -> Floats:
        """Slope of the light within micro images, besides that of the shading."""
        # Light falls off with the angle to the axis, so micro images far from the middle are a
        # little brighter on one side, which moves their centroids but not their borders. The slope
        # shows in a small window over the middle, which does not reach the borders. A line over
        # the image is fitted to the slopes. Spots have no even middle: for them it is not known.
        pitch = _extents(self.grid)
        few = np.random.default_rng(2).permutation(len(centres))[:_SLOPE_LENSES]
        places = centres[few] + self.margin
        core = windowed_moments(self.padded, places, pitch, CORE_HALF_WIDTH)
        core_factors = response(self.padded, places, pitch, CORE_HALF_WIDTH)
        # Both windows see the place d and the slope g: offset = factor d + variance g.
        spread, core_spread = (np.median(m.variances, axis=0) for m in (moments, core))
        known = factors * core_spread - core_factors * spread
        result = np.zeros_like(centres)
        terms = polynomial_terms(_unit(centres, self.shape), 1)
        for axis in (0, 1):
            if known[axis] < _EVEN_MIDDLE * factors[axis] * core_spread[axis]:
                continue
            slope = (
                factors[axis] * core.offsets[:, axis]
                - core_factors[axis] * (moments.offsets[few, axis])
            )
            slope = (slope / known[axis])[:, np.newaxis]
            coefficients, _, _ = robust_fit(terms[few], slope, 1e-9)
            # Without the constant: the axis is in the middle, and sampling adds another constant.
            result[:, axis] = (terms[:, 1:] @ coefficients[1:])[:, 0]
        return result

    def lit(self, t: Indices, s: Indices, centres: Floats) -> Flags:
        """Lenses whose centroids are worth measuring."""
        level = self.core(centres)
        if self.shading is None:
            return np.asarray(level > _DARK * float(np.percentile(level, 95)))
        usual = float(np.median(level[level > _DIMMEST * float(np.percentile(level, 80))]))
        lit = (level > _DIMMEST * usual) & (level < _BRIGHTEST * usual)
        # Inside the image circle: lenses beyond the image count as lit.
        states = np.ones(np.array([np.ptp(t), np.ptp(s)]) + 3)
        places = t - t.min() + 1, s - s.min() + 1
        states[places] = level > _DIMMEST * usual
        unlit = 8 - (ndimage.uniform_filter(states, 3, mode="nearest") * 9 - states)[places]
        inner = lit & (unlit < _UNLIT_NEIGHBOURS - 0.5)
        return np.asarray(inner if inner.sum() >= max(25, 0.4 * lit.sum()) else lit)

    def refine(self, radius: float, order: int | None, rounds: int) -> None:
        """Measure and fit the lenses within a radius."""
        for _ in range(rounds):
            pitch = _extents(self.grid)
            t, s, centres = self.whole_lenses(radius)
            if len(t) >= _LEAST_FIT:
                lit = self.lit(t, s, centres)
                t, s, centres = t[lit], s[lit], centres[lit]
            if len(t) < _LEAST_FIT:
                raise no_grid(f"{len(t)} whole micro images only")
            large = self.shading is not None and min(_extents(self.grid)) > _LARGE_PITCH
            measured = (
                centres + matched_offsets(self.padded, centres + self.margin, _extents(self.grid))
                if large
                else self.measure(centres)
            )
            lattice = self.grid.lattice(t, s)
            middle = np.round((lattice.min(axis=0) + lattice.max(axis=0)) / 2)
            scale = max(1.0, float(np.abs(lattice - middle).max()))
            points = (lattice - middle) / scale
            floor = (_LARGE_FLOOR if large else 1e-4) * max(pitch)
            prior = np.ones(len(t))
            if self.shading is not None:
                light = shading_at(self.shading, centres, self.shape)
                light = light / light.max()
                prior = light**2 / (light**2 + _HALF_WEIGHT**2)
            self.unit = scale
            chosen = order or self.best_order(points, measured, floor, prior)
            terms = polynomial_terms(points, chosen)
            coefficients, self.weights, self.scatter = robust_fit(terms, measured, floor, prior)
            self.grid = Grid(
                layout=self.grid.layout,
                stagger=self.grid.stagger,
                order=chosen,
                middle=tuple(middle),
                scale=scale,
                coefficients=tuple(map(tuple, coefficients)),
            )
            if min(reduced_lengths(self.grid)) < _SMALLEST_PITCH:
                size = min(reduced_lengths(self.grid))
                raise no_grid(f"micro images of {size:.1f} pixels, too small")
            weighted = terms * self.weights[:, np.newaxis]
            self.covariance = np.asarray(np.linalg.pinv(weighted.T @ terms), dtype=np.float64)

    def best_order(self, points: Floats, values: Floats, floor: float, prior: Floats) -> int:
        """Lowest order that predicts lenses left out of the fit as well as any higher one."""
        # Each half of the lenses (drawn at random, always the same) is predicted from the other. A
        # higher order must be better by more than chance (standard errors) and by more than
        # sampling does to centroids: pixels and micro images have a moire.
        drawn = np.random.default_rng(1).permutation(len(points))[:_ORDER_LENSES]
        points, values, prior = points[drawn], values[drawn], prior[drawn]
        half = np.arange(len(drawn)) % 2 == 0
        best, least = 1, np.zeros(len(points))
        sides = np.ptp(points, axis=0) * self.unit
        pitch = max(_extents(self.grid))
        smallest = max(_SMALLEST_DISTORTION, _DISTORTION_SHARE * pitch, _MOIRE / pitch)
        for order in range(1, MAX_ORDER + 1):
            if 4 * len(exponents(order)) > half.sum() or (order > 1 and min(sides) < 3 * order):
                break
            terms = polynomial_terms(points, order)
            squares = np.empty(len(values))
            for part in (half, ~half):
                coefficients, _, _ = robust_fit(terms[part], values[part], floor, prior[part])
                left = values[~part] - terms[~part] @ coefficients
                squares[~part] = (left**2).sum(axis=1) * prior[~part]
            # Outliers say nothing about the order.
            squares = np.minimum(squares, np.percentile(squares, 90))
            if order == 1:
                least = squares
                continue
            gain = least - squares
            chance = _CHANCE * gain.std() / np.sqrt(len(gain))
            if gain.mean() > max(chance, smallest**2):
                best, least = order, squares
        return best

    def flatten(self) -> None:
        """Fit the smooth part of the brightness, and divide the image by it."""
        _, _, centres = self.whole_lenses(max(self.shape))
        self.padded = np.pad(self.image, self.margin, mode="edge")
        base = self.base()
        places, spread = centres, np.zeros(len(centres))
        pitch = _extents(self.grid)
        width = CORE_HALF_WIDTH
        if min(pitch) > _LARGE_PITCH:
            # Large micro images show the slope of the light themselves.
            moves = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * _PROBE * min(pitch)
            places = (centres[:, np.newaxis] + moves).reshape(-1, 2)
            spread = np.tile([0.0, 1.0, 1.0, 1.0, 1.0], len(centres))
            width = _PROBE
        level = windowed_moments(self.padded, places + self.margin, pitch, width).sums - base
        lit = level > _DARK * np.percentile(level, 95)
        terms_of = _unit(places[lit], self.shape)
        count = lit.sum() * len(centres) / len(places)
        order = next(n for n in range(_SHADING_ORDER, -1, -1) if count >= 4 * n * n + 1)
        light = level[lit] / np.percentile(level, 95)
        prior = light**2 / (light**2 + _HALF_WEIGHT**2)
        terms = polynomial_terms(terms_of, order)
        smooth = terms.shape[1]
        if spread.any():
            terms = np.concatenate([terms, spread[lit, np.newaxis]], axis=1)
        coefficients, _, _ = robust_fit(terms, np.log(level[lit])[:, np.newaxis], 1e-3, prior)
        self.shading = coefficients[:smooth, 0]
        y, x = (np.clip(np.linspace(-1, 1, n), -1, 1) for n in self.shape)
        table = np.zeros((order + 1, order + 1))
        for value, (m, n) in zip(self.shading, exponents(order), strict=True):
            table[m, n] = value
        logs = np.polynomial.polynomial.polygrid2d(y, x, table).astype(np.float32)
        top = float(np.max(terms[:, :smooth] @ self.shading))
        darkest = np.log(_DARKEST_SHADING)
        flat = (self.image - np.float32(base)) * np.exp(-np.clip(logs - top, darkest, 0.0))
        self.padded = np.pad(flat.astype(np.float32), self.margin, mode="edge")

    def base(self) -> float:
        """Level of the image without light: what the darkest places keep where lenses are dark."""
        _, _, centres = self.whole_lenses(max(self.shape))
        part = 2 if self.grid.layout == "rectangular" else 3
        gaps = centres + primitive_vectors(self.grid).sum(axis=0) / part
        smooth = ndimage.gaussian_filter(self.image, 0.06 * min(_extents(self.grid)))
        core, gap = (
            ndimage.map_coordinates(smooth, places.T, order=1, mode="nearest")
            for places in (centres, gaps)
        )
        low, middle, high = np.percentile(core, [10, 50, 90])
        if high - low < _EVEN_LIGHT * middle:
            return 0.0
        terms = np.stack([np.ones_like(core), core / high], axis=-1).astype(np.float64)
        (level, _), _, _ = robust_fit(terms, gap[:, np.newaxis], 1e-6 * float(high))
        return float(np.clip(level[0], 0.0, max(0.0, float(np.percentile(gap, 5)))))


def reduced_lengths(grid: Grid) -> tuple[float, float]:
    """Distances to the nearest lenses."""
    a, b = reduced(*primitive_vectors(grid))
    return float(np.hypot(*a)), float(np.hypot(*b))


def primitive_vectors(grid: Grid) -> Floats:
    """Vectors to two neighbouring lenses, in the middle of a grid."""
    down, right = grid.vectors
    if grid.layout == "hexagonal-rows":
        down = down + right / 2
    elif grid.layout == "hexagonal-columns":
        right = right + down / 2
    return np.array([down, right])


def _primitive_indices(grid: Grid, t: Indices, s: Indices) -> tuple[Indices, Indices]:
    """Indices of lenses in terms of `primitive_vectors`."""
    lattice = grid.lattice(t, s)
    down, right = lattice[..., 0], lattice[..., 1]
    if grid.layout == "hexagonal-rows":
        right = right - down / 2
    elif grid.layout == "hexagonal-columns":
        down = down - right / 2
    return np.floor(down).astype(np.int64), np.floor(right).astype(np.int64)


def _cell_margin(fitter: _Fitter, centres: Floats) -> float:
    """1 minus the brightness of a second spot in the mean cell of the grid."""
    few = np.random.default_rng(3).permutation(len(centres))[:_CELL_LENSES]
    vectors = primitive_vectors(fitter.grid)
    steps = np.arange(_CELL_SAMPLES) / _CELL_SAMPLES
    steps = steps - np.round(steps)
    moves = steps[:, np.newaxis, np.newaxis] * vectors[0] + steps[:, np.newaxis] * vectors[1]
    places = centres[few][:, np.newaxis, np.newaxis] + moves + fitter.margin
    values = ndimage.map_coordinates(
        fitter.padded, np.moveaxis(places, -1, 0), order=1, mode="nearest"
    )
    cell = ndimage.gaussian_filter(np.median(values, axis=0), 0.7, mode="wrap")
    cell = (cell - cell.min()) / max(float(cell[0, 0] - cell.min()), 1e-9)
    peaks = cell == ndimage.maximum_filter(cell, 5, mode="wrap")
    corners = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, -1], [-1, 1]]) @ vectors
    distance = np.linalg.norm(moves[:, :, np.newaxis] - corners, axis=-1).min(axis=-1)
    away = distance > _SECOND_SPOT * min(reduced_lengths(fitter.grid))
    return 1 - float(np.max(cell, where=peaks & away, initial=0.0))


def _check_classes(grid: Grid, t: Indices, s: Indices, level: Floats) -> None:
    """Refuse a grid in which every second or third row is dark: it is too fine."""
    m, n = _primitive_indices(grid, t, s)
    usual = float(np.percentile(level, 75))
    for divisor in (2, 3):
        for index in (m, n, m + n, m - n):
            parts = [level[index % divisor == k] for k in range(divisor)]
            if any(len(p) >= 4 and np.median(p) < _EVEN_CLASSES * usual for p in parts):
                raise no_grid(
                    "micro images of half the distance or darker ones in every second row"
                )


def fit_grid(image: Image32, *, layout: Layout | None = None, order: int | None = None) -> Fit:
    """Find the grid of a white image and fit it to all its micro images.

    The grid starts in the middle from the shifts that repeat the image and grows: lenses around
    the ones that are known are where the grid says, their centroids are measured, and the grid is
    fitted to all of them again, outliers left out. A grid that its lenses do not bear out is
    refused.

    Parameters
    ----------
    image
        White image, dark frame subtracted, shape (rows, columns).
    layout
        Arrangement of the micro lenses, None to find out.
    order
        Order of the grid's polynomial, None for the lowest that describes it.

    Returns
    -------
    Fit
        The grid and what was measured.

    Raises
    ------
    InputError
        If there is no grid, or too little speaks for it.
    """
    if layout is not None and layout not in get_args(Layout):
        raise InputError(f"{layout!r}", where="layout", expected=", ".join(get_args(Layout)))
    found = lattices(image, layout)
    first: InputError | None = None
    strongest = max((lattice.score for lattice in found), default=0.0)
    likely = [lattice for lattice in found if lattice.score > _LIKELY * strongest]
    for lattice in likely[:_CANDIDATES]:
        others = [other.score for other in found if other is not lattice]
        try:
            return _fit(image, lattice, max(others, default=0.0), layout, order)
        except InputError as error:
            first = first or error
        except np.linalg.LinAlgError:
            first = first or no_grid("no regular grid")
    raise first or no_grid("no grid of micro images")


def _fit(
    image: Image32, lattice: Lattice, next_score: float, layout: Layout | None, order: int | None
) -> Fit:
    """Fit one lattice; refuse it if too little speaks for it."""
    fitter = _Fitter(image, guess(image, lattice.vectors, layout))
    largest = max(image.shape) / 2
    pitch = max(_extents(fitter.grid))
    radius = _FIRST_RADIUS * pitch
    fitter.refine(min(radius, largest), 1, 3)
    while radius < largest:
        radius *= _GROWTH
        fitter.refine(min(radius, largest), 1 if radius < 10 * pitch else 2, 1)
    for _ in range(2):
        fitter.flatten()
        fitter.refine(largest, order, 2)
    used = int((fitter.weights > 0).sum())
    if fitter.scatter > _LARGEST_SCATTER * pitch or used < _FEWEST_USED * len(fitter.weights):
        raise no_grid(
            f"no regular grid (micro images of {pitch:.1f} pixels off by {fitter.scatter:.2f})"
        )
    if used < _FEWEST_LENSES:
        raise no_grid(f"{used} regular micro images only")
    t, s, centres = fitter.whole_lenses(largest)
    level = fitter.core(centres)
    bright = level > _DIMMEST * float(np.percentile(level, 80))
    _check_classes(fitter.grid, t, s, level)
    # Not flattened, too: a grid that is too fine has no smooth brightness to divide by.
    smooth = ndimage.gaussian_filter(image, 0.1 * pitch)
    raw = ndimage.map_coordinates(smooth, centres.T, order=1, mode="nearest")
    _check_classes(fitter.grid, t, s, raw - float(np.percentile(smooth, 1)))
    margin = _cell_margin(fitter, centres[bright])
    if margin < _SMALLEST_CELL_MARGIN:
        raise no_grid("more than one micro image in each cell of the grid")
    misfits = sorted(layout_misfits(primitive_vectors(fitter.grid)))
    if layout is None and misfits[0] > _LARGEST_MISFIT:
        raise no_grid("lenses neither square nor hexagonal")
    evidence = Evidence(
        missing_share=0.0,
        scatter_share=fitter.scatter / pitch,
        centre_error_px=0.0,
        periodicity=lattice.score,
        next_periodicity=next_score,
        layout_margin=misfits[1] - misfits[0],
        cell_margin=margin,
    )
    fit = _finish(fitter, used, evidence)
    inside = ~np.isnan(fit.brightness)
    t, s = np.nonzero(inside)
    points = (fit.grid.lattice(t, s) - fit.grid.middle) / fit.grid.scale
    terms = polynomial_terms(points, fit.grid.order)
    spread = np.einsum("ni,ij,nj->n", terms, fitter.covariance, terms)
    error = fitter.scatter * float(np.sqrt(spread.max()))
    # Bent grids go astray beyond the lenses that they were fitted to: they have to be surer.
    if error > _LARGEST_CENTRE_ERROR / (1 if fit.grid.order == 1 else 2):
        raise no_grid(f"centres uncertain by {error:.2f} pixels (standard error)")
    lit = ndimage.binary_closing(np.pad(fit.present, 2), np.ones((3, 3)))[2:-2, 2:-2] & inside
    missing = 1 - float(fit.present[lit].mean()) if lit.any() else 1.0
    if missing > _LARGEST_MISSING:
        raise no_grid(f"{100 * missing:.0f} % of the micro images missing")
    sure = evidence.model_copy(update={"missing_share": missing, "centre_error_px": error})
    return replace(fit, evidence=sure)


def _shading(fitter: _Fitter) -> Floats:
    """Smooth part of the brightness as it is in the image, from the lenses' middles."""
    _, _, centres = fitter.whole_lenses(max(fitter.shape))
    level = core_brightness(
        np.pad(fitter.image, fitter.margin, mode="edge"),
        centres + fitter.margin,
        _extents(fitter.grid),
    )
    lit = level > _DARK * np.percentile(level, 95)
    order = next(n for n in range(_SHADING_ORDER, -1, -1) if lit.sum() >= 4 * n * n + 1)
    terms = polynomial_terms(_unit(centres[lit], fitter.shape), order)
    return robust_fit(terms, np.log(level[lit])[:, np.newaxis], 1e-3)[0][:, 0]


def _finish(fitter: _Fitter, used: int, evidence: Evidence) -> Fit:
    """Count lenses from the top left; tell which are there."""
    shape = fitter.shape
    t, s = lens_indices(fitter.grid, shape)
    centres = fitter.grid.centres(t, s)
    inside = within(centres, shape)
    rows, columns = np.nonzero(inside.any(axis=1))[0], np.nonzero(inside.any(axis=0))[0]
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    grid = fitter.grid.moved(int(t[rows[0], 0]), int(s[0, columns[0]]))
    inside, centres = inside[part], centres[part]
    pitch = _extents(grid)
    # Cut-off micro images are measured with the edge pixels repeated.
    margin = int(np.ceil(max(pitch))) + 1
    padded = np.pad(fitter.image, margin, mode="edge")
    level = core_brightness(padded, centres[inside] + margin, pitch)
    base = max(fitter.base(), float(np.percentile(fitter.image[::3, ::3], 0.5)))
    shading = _shading(fitter)
    smooth = shading_at(shading, centres[inside], shape)
    lit = level - base > np.maximum(
        _MISSING * (smooth - base), _DARK * (np.percentile(level, 95) - base)
    )
    present = np.zeros(inside.shape, dtype=bool)
    present[inside] = lit
    brightness = np.full(inside.shape, np.nan)
    brightness[inside] = level
    return Fit(
        grid=grid,
        shape=(inside.shape[0], inside.shape[1]),
        present=present,
        brightness=brightness,
        shading=shading,
        residual_px=fitter.scatter,
        used=used,
        evidence=evidence,
    )
