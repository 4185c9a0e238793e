"""Fit of a grid to the centroids of all micro images."""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.calibration.centroids import (
    CORE_HALF_WIDTH,
    Image32,
    Moments,
    core_brightness,
    reach,
    response,
    windowed_moments,
)
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
from plenofir.camera.calibration.spectrum import GRID_EXPECTED, first_guess
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
# Below this share of the brightness around it, a micro image counts as missing.
_MISSING = 0.05
_DARK = 0.02
# If centroids scatter by more than this share of a pitch, there is no grid.
_LARGEST_SCATTER = 0.12
_FEWEST_USED = 0.5
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
    """

    grid: Grid
    shape: tuple[int, int]
    present: Flags
    brightness: Floats
    shading: Floats
    residual_px: float
    used: int


def shading_at(coefficients: Floats, positions: Floats, image_shape: tuple[int, int]) -> Floats:
    """Smooth part of the white image: vignetting of the main lens."""
    order = next(n for n in range(20) if len(exponents(n)) == len(coefficients))
    return np.exp(polynomial_terms(_unit(positions, image_shape), order) @ coefficients)


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
    terms: Floats, values: Floats, floor: float, rounds: int = 8
) -> tuple[Floats, Floats, float]:
    """Least squares that outliers cannot bend: iterated, with Tukey's biweight."""
    weights = np.ones(len(values))
    scale = 0.0
    for _ in range(rounds):
        coefficients = weighted_fit(terms, values, weights)
        residual = values - terms @ coefficients
        scale = max(1.4826 * float(np.median(np.abs(residual))), floor)
        distance = np.sqrt((residual**2).sum(axis=1)) / (_TUKEY * scale)
        new = np.where(distance < 1, (1 - distance**2) ** 2, 0.0)
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


def _no_grid(what: str) -> InputError:
    return InputError(what, where="white image", expected=GRID_EXPECTED)


class _Fitter:
    """State of the growing fit."""

    def __init__(self, image: Image32, grid: Grid) -> None:
        self.image = image
        self.shape = image.shape[0], image.shape[1]
        self.grid = grid
        self.shading: Floats | None = None
        self.scatter = 0.0
        self.weights = np.empty(0)

    def lenses(self, radius: float, margin: float) -> tuple[Indices, Indices, Floats]:
        """Lenses in the box of a radius around the middle, and margin inside the image."""
        end = np.array(self.shape) - 1.0
        middle = end / 2
        low = np.maximum(middle - radius, margin)
        high = np.minimum(middle + radius, end - margin)
        if (low >= high).any():
            raise _no_grid("image too small for its micro images")
        t, s = _indices_within(self.grid, _outline(low, high))
        centres = self.grid.centres(t, s)
        inside = ((centres >= low) & (centres <= high)).all(axis=-1)
        return t[inside], s[inside], centres[inside]

    def measure(self, centres: Floats) -> Floats:
        """Centroids around expected centres, in pixels."""
        pitch = _extents(self.grid)
        moments = windowed_moments(self.image, centres, pitch)
        factors = response(self.image, centres, pitch)
        if factors.min() < _WEAKEST_RESPONSE:
            raise _no_grid("nothing that repeats like micro images")
        offsets = moments.offsets
        if self.shading is not None:
            slope = _shading_slope(self.shading, centres, self.shape)
            slope = slope + self.inner_slope(centres, moments, factors, slope)
            offsets = offsets - slope * moments.variances
        largest = np.array(pitch) / 2
        return centres + np.clip(offsets / factors, -largest, largest)

    def inner_slope(
        self, centres: Floats, moments: Moments, factors: Floats, shading: Floats
    ) -> Floats:
        """Slope of the light within micro images, besides that of the shading."""
        # Light falls off with the angle to the axis, so micro images far from the middle are a
        # little brighter on one side, which moves their centroids but not their borders. The slope
        # shows in a small window over the middle, which does not reach the borders. A line over
        # the image is fitted to the slopes. Spots have no even middle: for them it is not known.
        pitch = _extents(self.grid)
        few = np.random.default_rng(2).permutation(len(centres))[:_SLOPE_LENSES]
        core = windowed_moments(self.image, centres[few], pitch, CORE_HALF_WIDTH)
        core_factors = response(self.image, centres[few], pitch, CORE_HALF_WIDTH)
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
            slope = (slope / known[axis] - shading[few, axis])[:, np.newaxis]
            coefficients, _, _ = robust_fit(terms[few], slope, 1e-9)
            # Without the constant: the axis is in the middle, and sampling adds another constant.
            result[:, axis] = (terms[:, 1:] @ coefficients[1:])[:, 0]
        return result

    def refine(self, radius: float, order: int | None, rounds: int) -> None:
        """Measure and fit the lenses within a radius."""
        for _ in range(rounds):
            pitch = _extents(self.grid)
            t, s, centres = self.lenses(radius, reach(max(pitch)))
            if len(t) < 9:
                raise _no_grid(f"{len(t)} whole micro images only")
            measured = self.measure(centres)
            lattice = self.grid.lattice(t, s)
            middle = np.round((lattice.min(axis=0) + lattice.max(axis=0)) / 2)
            scale = max(1.0, float(np.abs(lattice - middle).max()))
            points = (lattice - middle) / scale
            floor = 1e-4 * max(pitch)
            chosen = order or self.best_order(points, measured, floor)
            terms = polynomial_terms(points, chosen)
            coefficients, self.weights, self.scatter = robust_fit(terms, measured, floor)
            self.grid = Grid(
                layout=self.grid.layout,
                stagger=self.grid.stagger,
                order=chosen,
                middle=tuple(middle),
                scale=scale,
                coefficients=tuple(map(tuple, coefficients)),
            )

    @staticmethod
    def best_order(points: Floats, values: Floats, floor: float) -> int:
        """Lowest order that predicts lenses left out of the fit as well as any higher one."""
        # Each half of the lenses (drawn at random, always the same) is predicted from the other. A
        # higher order must be better by more than chance (three standard errors) and by more than
        # sampling does to centroids: pixels and micro images have a moire.
        drawn = np.random.default_rng(1).permutation(len(points))[:_ORDER_LENSES]
        points, values = points[drawn], values[drawn]
        half = np.arange(len(drawn)) % 2 == 0
        best, least = 1, np.zeros(len(points))
        for order in range(1, MAX_ORDER + 1):
            if 4 * len(exponents(order)) > half.sum():
                break
            terms = polynomial_terms(points, order)
            squares = np.empty(len(values))
            for part in (half, ~half):
                coefficients, _, _ = robust_fit(terms[part], values[part], floor)
                left = values[~part] - terms[~part] @ coefficients
                squares[~part] = (left**2).sum(axis=1)
            # Outliers say nothing about the order.
            squares = np.minimum(squares, np.percentile(squares, 95))
            if order == 1:
                least = squares
                continue
            gain = least - squares
            chance = 3 * gain.std() / np.sqrt(len(gain))
            if gain.mean() > max(chance, _SMALLEST_DISTORTION**2):
                best, least = order, squares
        return best

    def fit_shading(self, centres: Floats, brightness: Floats) -> None:
        """Smooth part of the brightness, from the lenses' middles."""
        lit = brightness > _DARK * np.percentile(brightness, 95)
        points = _unit(centres[lit], self.shape)
        order = next(n for n in range(_SHADING_ORDER, -1, -1) if lit.sum() >= 4 * n * n + 1)
        terms = polynomial_terms(points, order)
        logs = np.log(brightness[lit])[:, np.newaxis]
        coefficients, _, _ = robust_fit(terms, logs, 1e-3)
        self.shading = coefficients[:, 0]


def fit_grid(image: Image32, *, layout: Layout | None = None, order: int | None = None) -> Fit:
    """Find the grid of a white image and fit it to all its micro images.

    The grid starts in the middle from the Fourier transform and grows: lenses around the ones that
    are known are where the grid says, their centroids are measured, and the grid is fitted to
    all of them again, outliers left out.

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
        If there is no grid.
    """
    fitter = _Fitter(image, first_guess(image, layout))
    largest = max(image.shape) / 2
    pitch = max(_extents(fitter.grid))
    radius = _FIRST_RADIUS * pitch
    fitter.refine(min(radius, largest), 1, 3)
    while radius < largest:
        radius *= _GROWTH
        fitter.refine(min(radius, largest), 1 if radius < 10 * pitch else 2, 1)
    _, _, centres = fitter.lenses(largest, reach(pitch))
    fitter.fit_shading(centres, core_brightness(image, centres, _extents(fitter.grid)))
    fitter.refine(largest, order, 2)
    used = int((fitter.weights > 0).sum())
    if fitter.scatter > _LARGEST_SCATTER * pitch or used < _FEWEST_USED * len(fitter.weights):
        raise _no_grid(
            f"no regular grid (micro images of {pitch:.1f} pixels off by {fitter.scatter:.2f})"
        )
    return _finish(fitter, used)


def _finish(fitter: _Fitter, used: int) -> Fit:
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
    base = float(np.percentile(fitter.image[::3, ::3], 0.5))
    assert fitter.shading is not None
    smooth = shading_at(fitter.shading, centres[inside], shape)
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
        shading=fitter.shading,
        residual_px=fitter.scatter,
        used=used,
    )
