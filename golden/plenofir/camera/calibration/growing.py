# SPDX-License-Identifier: Apache-2.0
"""A fit of a grid that grows from the middle of the image."""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.bending import BentFit, Lenses
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
from plenofir.camera.calibration.grid import (
    Flags,
    Floats,
    Grid,
    Indices,
    exponents,
    polynomial_terms,
)
from plenofir.camera.calibration.lattice import no_grid, primitive_vectors, reduced_lengths
from plenofir.camera.calibration.models import MODELS, Frame, Model
from plenofir.camera.calibration.pixels import pixel_fit
from plenofir.camera.calibration.robust import robust_fit
from plenofir.camera.calibration.shading import (
    extents,
    indices_within,
    outline,
    shading_at,
    unit_positions,
)

_SLOPE_LENSES = 8000
SHADING_ORDER = 4
DARK = 0.02
_SMALLEST_PITCH = 2.8
# Flattened micro images beyond these shares of the usual brightness are left out.
DIMMEST, _BRIGHTEST = 0.25, 1.8
# Shading is not divided by where it is less than this share of the brightest part.
_DARKEST_SHADING = 0.03
# Brightness (share of the brightest) of lenses whose centroids count half.
_HALF_WEIGHT = 0.15
# A lens beside this many unlit ones is at the border of the image circle, which cuts it off.
_UNLIT_NEIGHBOURS = 3
_LEAST_FIT = 9
_SMOOTH = 0.06
_ENOUGH_LENSES = 12000
_MANY_LENSES = 400
_LARGE_PITCH = 16.0
_SMALL_PITCH = 8.0
# Length of the mean of all directions 2 pi (place between pixels) from which places are alike.
_ALIKE_PLACES = 0.3
# Smallest scatter (in pitches) that large micro images are given: a missing neighbour moves them
# a little, which makes no outliers of them.
_LARGE_FLOOR = 5e-4
_PROBE = 0.18
# Lenses whose brightness varies less than this say nothing about the level without light.
_EVEN_LIGHT = 0.15
_WEAKEST_RESPONSE = 0.02
_BAND = 32
_EVEN_BELOW, _TOLD_BELOW = 0.85, 0.95
_FEWEST_ROUND = 25
# Shares of what the light's slope and changes of the pitch do to centroids that stay in them; the
# slope's part goes with the variance of micro images in their window, in pitches. Large ones are
# matched by their borders, which it moves less.
_MATCHED = 0.1
_UNSURE_LIGHT, _UNSURE_CLIPPED, _UNSURE_BENT, _SPREAD = 0.01, 0.25, 0.02, 0.2
_FEWEST_TOLD, _LEAST_TOLD = 20, 0.15
# Windows are not made smaller than by this share where distortion makes cells smaller.
_SMALLEST_CELL = 0.8
# Response of the small window, as a share of what spots would give it, for an even middle.
_EVEN_MIDDLE = 0.6


def enough(count: int) -> slice | Indices:
    """Lenses that suffice of so many: all, or some at random (always the same)."""
    if count <= _ENOUGH_LENSES:
        return slice(None)
    return np.random.default_rng(6).permutation(count)[:_ENOUGH_LENSES]


def repeat_edges(image: Image32, margin: int) -> None:
    """Fill the border of an image with the pixels at the edge of its inner part."""
    image[:margin], image[-margin:] = image[margin], image[-margin - 1]
    image[:, :margin] = image[:, margin : margin + 1]
    image[:, -margin:] = image[:, -margin - 1 : -margin]


class GrowingFit:
    """State of the growing fit."""

    def __init__(self, image: Image32, grid: Grid, clipped: float | None = None) -> None:
        self.image = image
        # Level at which many pixels clip.
        self.clipped = clipped
        self.shape = image.shape[0], image.shape[1]
        self.grid = grid
        self.shading: Floats | None = None
        self._smooth: Image32 | None = None
        self.scatter = 0.0
        self.weights: Floats = np.empty(0)
        self.fitted: Floats = np.empty((0, 2))
        self.measured: Floats = np.empty((0, 2))
        self._fit: BentFit | None = None
        # Of the grid's coefficients, and what it would be if the grid's model were sure.
        self.covariance: Floats = np.empty(0)
        self.own: Floats = np.empty(0)
        # Standard errors of the grid's size along y and x, as shares, that come of inner slopes.
        self.stretch: Floats = np.zeros(2)
        # Windows of lenses at the border reach beyond it, where the edge pixels are repeated.
        self.margin = int(reach(1.1 * max(extents(grid)))) + 2
        self.raw = np.pad(image, self.margin, mode="edge")
        # Lenses in boxes, of the grid as it is.
        self._listed_for = grid
        self._listed: dict[tuple[tuple[float, ...], ...], tuple[Indices, Indices, Floats]] = {}
        self.padded = self.raw

    @property
    def bent(self) -> BentFit:
        """The latest fit."""
        if self._fit is None:
            raise no_grid("no grid of micro images")
        return self._fit

    def windows(self) -> tuple[float, float]:
        """Pitch along y and x for windows, which fit the smallest cell of the image."""
        down, right = extents(self.grid)
        if self.grid.order > 1:
            end = np.array(self.shape) - 1.0
            corners = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]) * end
            cells = np.abs(np.linalg.det(self.grid.jacobian(self.grid.inverse(corners))))
            share = float(np.sqrt(cells.min() / abs(np.linalg.det(self.grid.vectors))))
            share = min(1.0, max(_SMALLEST_CELL, share))
            down, right = share * down, share * right
        return down, right

    def lenses(self, radius: float, margin: float) -> tuple[Indices, Indices, Floats]:
        """Lenses in the box of a radius around the middle, and margin inside the image."""
        end = np.array(self.shape) - 1.0
        middle = end / 2
        low = np.maximum(middle - radius, margin)
        high = np.minimum(middle + radius, end - margin)
        if (low >= high).any():
            raise no_grid("image too small for its micro images")
        box = tuple(low), tuple(high)
        if self._listed_for is not self.grid:
            self._listed_for, self._listed = self.grid, {}
        if box not in self._listed:
            t, s = indices_within(self.grid, outline(low, high))
            centres = self.grid.centres(t, s)
            inside = ((centres >= low) & (centres <= high)).all(axis=-1)
            self._listed[box] = t[inside], s[inside], centres[inside]
        return self._listed[box]

    def whole_lenses(self, radius: float) -> tuple[Indices, Indices, Floats]:
        """Lenses whose micro images are whole; of few lenses also those close to the border."""
        pitch = max(extents(self.grid))
        found = self.lenses(radius, 0.5 * pitch)
        if len(found[0]) > _MANY_LENSES:
            found = self.lenses(radius, 0.65 * pitch + 1)
        return found

    def core(self, centres: Floats) -> Floats:
        """Brightness of the middle of micro images."""
        return core_brightness(self.padded, centres + self.margin, extents(self.grid))

    def measure(self, centres: Floats) -> Floats:
        """Centroids around expected centres, in pixels."""
        pitch = self.windows()
        places = centres + self.margin
        moments = windowed_moments(self.padded, places, pitch)
        factors = response(self.padded, places, pitch)
        if factors.min() < _WEAKEST_RESPONSE:
            raise no_grid("nothing that repeats like micro images")
        offsets = moments.offsets
        if self.shading is not None:
            slope, unsure = self.inner_slope(centres, moments, factors)
            offsets = offsets - slope * moments.variances
            self.stretch = unsure / ((np.array(self.shape) - 1) / 2)
        largest = np.array(pitch) / 2
        return centres + np.clip(offsets / factors, -largest, largest)

    def inner_slope(
        self, centres: Floats, moments: Moments, factors: Floats
    ) -> tuple[Floats, Floats]:
        """Slope of the light within micro images, besides that of the shading.

        Of each micro image along y and x, and by how many pixels (standard error) the correction
        makes the places of those at the border of the image less sure.
        """
        # Light falls off with the angle to the axis, so micro images far from the middle are a
        # little brighter on one side, which moves their centroids but not their borders. The slope
        # shows in a small window over the middle, which does not reach the borders. It points away
        # from the axis, so the slope along y grows with y only, and along x with x. Spots have no
        # even middle: for them it is not known.
        pitch = self.windows()
        few = np.random.default_rng(2).permutation(len(centres))[:_SLOPE_LENSES]
        places = centres[few] + self.margin
        core = windowed_moments(self.padded, places, pitch, CORE_HALF_WIDTH)
        core_factors = response(self.padded, places, pitch, CORE_HALF_WIDTH)
        # Both windows see the place d and the slope g: offset = factor d + variance g.
        spread, core_spread = (np.median(m.variances, axis=0) for m in (moments, core))
        known = factors * core_spread - core_factors * spread
        result, errors = np.zeros_like(centres), np.zeros(2)
        far = unit_positions(centres, self.shape)
        for axis in (0, 1):
            if known[axis] < _EVEN_MIDDLE * factors[axis] * core_spread[axis]:
                continue
            slope = (
                factors[axis] * core.offsets[:, axis]
                - core_factors[axis] * (moments.offsets[few, axis])
            )
            slope = (slope / known[axis])[:, np.newaxis]
            terms = np.stack([far[few, axis], np.ones(len(slope))], axis=1)
            coefficients, weights, _ = robust_fit(terms, slope, 1e-9)
            # Without the constant: the axis is in the middle, and sampling adds another constant.
            result[:, axis] = far[:, axis] * coefficients[0, 0]
            # What the correction adds to the scatter of centroids: it is measured with their noise.
            place = moments.offsets[few, axis, np.newaxis] / factors[axis]
            moved = place - slope * spread[axis] / factors[axis]
            alone, both = (robust_fit(terms, part, 1e-9)[2] for part in (place, moved))
            inverse = np.linalg.pinv((terms * weights[:, np.newaxis]).T @ terms)
            errors[axis] = np.sqrt(max(0.0, both**2 - alone**2) * inverse[0, 0])
        return result, errors

    def lit(self, t: Indices, s: Indices, centres: Floats) -> Flags:
        """Lenses whose centroids are worth measuring."""
        level = self.core(centres)
        if self.shading is None:
            return np.asarray(level > DARK * float(np.percentile(level, 95)))
        usual = float(np.median(level[level > DIMMEST * float(np.percentile(level, 80))]))
        lit = (level > DIMMEST * usual) & (level < _BRIGHTEST * usual)
        # Inside the image circle: lenses beyond the image count as lit.
        states = np.ones(np.array([np.ptp(t), np.ptp(s)]) + 3)
        places = t - t.min() + 1, s - s.min() + 1
        states[places] = level > DIMMEST * usual
        unlit = 8 - (ndimage.uniform_filter(states, 3, mode="nearest") * 9 - states)[places]
        inner = lit & (unlit < _UNLIT_NEIGHBOURS - 0.5)
        return np.asarray(inner if inner.sum() >= max(25, 0.4 * lit.sum()) else lit)

    def refine(
        self,
        radius: float,
        rounds: int,
        models: tuple[Model, ...] = MODELS,
        order: int | None = None,
        *,
        last: bool = False,
    ) -> None:
        """Measure and fit the lenses within a radius: of many, all if it is the last time."""
        lit_before: tuple[Indices, Indices, Flags] | None = None
        for n in range(rounds):
            pitch = extents(self.grid)
            t, s, centres = self.whole_lenses(radius)
            every = last and n == rounds - 1
            if self.shading is None and not every:
                few = enough(len(t))
                t, s, centres = t[few], s[few], centres[few]
            if len(t) >= _LEAST_FIT:
                # The grid moves so little between rounds that the same lenses are lit.
                if lit_before is None or not all(map(np.array_equal, (t, s), lit_before)):
                    lit_before = t, s, self.lit(t, s, centres)
                lit = lit_before[2]
                t, s, centres = t[lit], s[lit], centres[lit]
            if not every:
                few = enough(len(t))
                t, s, centres = t[few], s[few], centres[few]
            if len(t) < _LEAST_FIT:
                raise no_grid(f"{len(t)} whole micro images only")
            large = self.shading is not None and min(extents(self.grid)) > _LARGE_PITCH
            measured = (
                centres + matched_offsets(self.padded, centres + self.margin, self.windows())
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
            # Only the borders of large micro images count, which are at all places between pixels.
            lenses = Lenses(
                frame=self.frame(),
                points=points,
                lattice=lattice,
                values=measured,
                prior=prior,
                floor=floor,
                pitch=max(pitch),
                pulled=self.shading is not None and not large,
                scale=(scale, middle),
            )
            self._fit = fit = lenses.fit(models, order)
            self.weights, self.scatter = fit.weights, fit.scatter
            self.covariance, self.own = fit.covariance, fit.own
            if lenses.pulled:
                stretched = self.stretched(fit.coefficients, fit.covariance.shape[1])
                self.covariance, self.own = fit.covariance + stretched, fit.own + stretched
            self.fitted, self.measured = lattice, measured
            self.grid = Grid(
                layout=self.grid.layout,
                stagger=self.grid.stagger,
                order=fit.order,
                middle=tuple(middle),
                scale=scale,
                coefficients=tuple(map(tuple, fit.coefficients)),
            )
            if min(reduced_lengths(self.grid)) < _SMALLEST_PITCH:
                size = min(reduced_lengths(self.grid))
                raise no_grid(f"micro images of {size:.1f} pixels, too small")

    def frame(self) -> Frame:
        """The even grid that this one is like in the middle of the image."""
        middle = (np.array(self.shape) - 1) / 2
        origin = self.grid.inverse(middle)
        return Frame(self.grid.jacobian(origin), origin, middle, float(np.hypot(*middle)))

    def stretched(self, coefficients: Floats, count: int) -> Floats:
        """Covariance of a grid that may be stretched from the middle of the image."""
        # An error of the inner slope moves all centroids, the farther out the more: the scatter of
        # centroids does not show it.
        moves = np.zeros((count, 2))
        moves[: len(coefficients)] = coefficients * self.stretch
        moves[0] -= (np.array(self.shape) - 1) / 2 * self.stretch
        result = np.zeros((2, count, 2, count))
        for axis in (0, 1):
            result[axis, :, axis] = np.outer(moves[:, axis], moves[:, axis])
        return result

    def fit_pixels(self) -> None:
        """Fit the grid to the pixels themselves, where their pull looks like another grid."""
        grid = self.grid
        if min(reduced_lengths(grid)) > _SMALL_PITCH or len(self.fitted) < _MANY_LENSES:
            return
        turns = np.exp(2j * np.pi * grid.positions(self.fitted))
        if np.abs(turns.mean(axis=0)).max() < _ALIKE_PLACES:
            return
        terms = polynomial_terms((self.fitted - grid.middle) / grid.scale, grid.order)
        found = pixel_fit(
            self.padded,
            self.margin,
            primitive_vectors(grid),
            terms @ self.bent.fixed + self.margin,
            np.einsum("nt,tap->nap", terms, self.bent.basis),
            self.bent.factors,
            self.weights,
            square=grid.layout == "rectangular",
        )
        coefficients = self.bent.fixed + self.bent.basis @ found.factors
        count = terms.shape[1]
        own = np.einsum("iap,pq,jbq->aibj", self.bent.basis, found.covariance, self.bent.basis)
        doubt = self.covariance - self.own
        self.own = np.zeros_like(doubt)
        self.own[:, :count, :, :count] = own
        self.covariance = self.own + doubt
        self.grid = grid.model_copy(update={"coefficients": tuple(map(tuple, coefficients))})

    def flatten(self) -> None:
        """Fit the smooth part of the brightness, and divide the image by it."""
        _, _, centres = self.whole_lenses(max(self.shape))
        centres = centres[enough(len(centres))]
        base = self.base()
        places, spread = centres, np.zeros(len(centres))
        pitch = extents(self.grid)
        width = CORE_HALF_WIDTH
        if min(pitch) > _LARGE_PITCH:
            # Large micro images show the slope of the light themselves.
            moves = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * _PROBE * min(pitch)
            places = (centres[:, np.newaxis] + moves).reshape(-1, 2)
            spread = np.tile([0.0, 1.0, 1.0, 1.0, 1.0], len(centres))
            width = _PROBE
        level = windowed_moments(self.raw, places + self.margin, pitch, width).sums - base
        lit = level > DARK * np.percentile(level, 95)
        if not lit.any():
            raise no_grid("micro images no brighter than the gaps between them")
        if self.clipped is not None:
            # Clipped ones do not tell the light.
            told = lit & (level < _TOLD_BELOW * (self.clipped - base))
            lit = told if told.sum() > max(_FEWEST_TOLD, _LEAST_TOLD * lit.sum()) else lit
        terms_of = unit_positions(places[lit], self.shape)
        # Probes around a middle tell the slope besides the level.
        count = lit.sum() * (3 / 5 if spread.any() else 1)
        order = next((n for n in range(SHADING_ORDER, 0, -1) if count >= 4 * n * n + 1), 0)
        # Fewer lenses tell the term of order 4 that a round falling off of the light has.
        rounded = 1 < order < SHADING_ORDER and count >= _FEWEST_ROUND
        light = level[lit] / np.percentile(level, 95)
        prior = light**2 / (light**2 + _HALF_WEIGHT**2)
        terms = polynomial_terms(terms_of, 2 if rounded else order)
        if rounded:
            order = SHADING_ORDER
            squares = (terms_of**2) @ self.round_light()
            terms = np.concatenate([terms, squares[:, np.newaxis] ** 2], axis=1)
        smooth = terms.shape[1]
        if spread.any():
            terms = np.concatenate([terms, spread[lit, np.newaxis]], axis=1)
        coefficients, _, _ = robust_fit(terms, np.log(level[lit])[:, np.newaxis], 1e-3, prior)
        found = coefficients[:smooth, 0]
        if rounded:
            y, x = self.round_light()
            fourth = {(4, 0): y * y, (2, 2): 2 * x * y, (0, 4): x * x}
            found = np.concatenate([found[:-1], np.zeros(len(exponents(order)) - smooth + 1)])
            for power, part in fourth.items():
                found[exponents(order).index(power)] = part * coefficients[smooth - 1, 0]
        self.shading = found
        table = np.zeros((order + 1, order + 1))
        for value, (m, n) in zip(self.shading, exponents(order), strict=True):
            table[m, n] = value
        top = float(np.max(terms[:, :smooth] @ coefficients[:smooth, 0]))
        table[0, 0] -= top
        self.divide(np.float32(base), table.astype(np.float32))

    def round_light(self) -> Floats:
        """Square of the distance from the middle is the product of these and squared unit ones."""
        half = (np.array(self.shape) - 1.0) ** 2
        return np.asarray(half / half.sum())

    def shared_errors(self, t: Indices, s: Indices, centres: Floats) -> Floats:
        """Errors of centres that the scatter does not show, (y, x) in pixels."""
        # The slope of the light moves centroids, and what is divided out of it is not sure.
        if self.shading is None:
            return np.zeros_like(centres)
        steps = np.eye(2) * 0.5
        slopes = np.stack(
            [
                np.log(shading_at(self.shading, centres + step, self.shape))
                - np.log(shading_at(self.shading, centres - step, self.shape))
                for step in steps
            ],
            axis=-1,
        )
        unsure = _UNSURE_LIGHT if self.clipped is None else _UNSURE_CLIPPED
        if min(extents(self.grid)) > _LARGE_PITCH:
            unsure *= _MATCHED
        moved = unsure * slopes * (_SPREAD * np.array(extents(self.grid))) ** 2
        # Where the pitch changes, neighbours reach into windows from one side.
        lattice, bent = self.grid.lattice(t, s), np.zeros_like(centres)
        for step in np.eye(2):
            ends = self.grid.positions(lattice + step) + self.grid.positions(lattice - step)
            bent += ends - 2 * centres
        return np.asarray(np.hypot(moved, _UNSURE_BENT * bent))

    def divide(self, base: np.float32, table: Image32) -> None:
        """Divide the image above its base by light whose logarithm is a polynomial of y, x."""
        if self.padded is self.raw:
            self.padded = np.empty_like(self.raw)
        y, x = (np.linspace(-1, 1, n, dtype=np.float32) for n in self.shape)
        lines = np.polynomial.polynomial.polyvander(y, len(table) - 1) @ table
        inner = self.padded[self.margin : -self.margin, self.margin : -self.margin]
        # Some lines at a time, which the processor's cache holds.
        for start in range(0, len(y), _BAND):
            band = slice(start, start + _BAND)
            shade = np.zeros((len(lines[band]), len(x)), dtype=np.float32)
            for term in lines[band].T[::-1]:
                shade *= x
                shade += term[:, np.newaxis]
            np.clip(shade, np.float32(np.log(_DARKEST_SHADING)), np.float32(0), out=shade)
            np.exp(shade, out=shade)
            np.divide(self.image[band] - base, shade, out=inner[band])
        if self.clipped is not None:
            # Clipped micro images are even; divided by the light they would lean to one side. Cut
            # off below, all are even, those that are not clipped too.
            np.minimum(inner, np.float32(_EVEN_BELOW * (self.clipped - base)), out=inner)
        repeat_edges(self.padded, self.margin)

    def smooth(self) -> Image32:
        """The image with less noise."""
        if self._smooth is None:
            self._smooth = ndimage.gaussian_filter(self.image, _SMOOTH * min(extents(self.grid)))
        return self._smooth

    def base(self) -> float:
        """Level of the image without light: what the darkest places keep where lenses are dark."""
        _, _, centres = self.whole_lenses(max(self.shape))
        centres = centres[enough(len(centres))]
        part = 2 if self.grid.layout == "rectangular" else 3
        gaps = centres + primitive_vectors(self.grid).sum(axis=0) / part
        core, gap = (
            ndimage.map_coordinates(self.smooth(), places.T, order=1, mode="nearest")
            for places in (centres, gaps)
        )
        low, middle, high = np.percentile(core, [10, 50, 90])
        if high - low < _EVEN_LIGHT * middle:
            return 0.0
        terms = np.stack([np.ones_like(core), core / high], axis=-1).astype(np.float64)
        (level, _), _, _ = robust_fit(terms, gap[:, np.newaxis], 1e-6 * float(high))
        return float(np.clip(level[0], 0.0, max(0.0, float(np.percentile(gap, 5)))))
