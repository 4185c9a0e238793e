# SPDX-License-Identifier: Apache-2.0
"""A fit of a grid that grows from the middle of the image."""

import numpy as np

from plenofir.camera.calibration.bending import BentFit, Lenses
from plenofir.camera.calibration.centroids import (
    Image32,
)
from plenofir.camera.calibration.grid import (
    Flags,
    Floats,
    Grid,
    Indices,
    polynomial_terms,
)
from plenofir.camera.calibration.lattice import no_grid, primitive_vectors, reduced_lengths
from plenofir.camera.calibration.light import (
    counting,
)
from plenofir.camera.calibration.models import MODELS, Frame, Model
from plenofir.camera.calibration.pixels import pixel_fit
from plenofir.camera.calibration.robust import robust_fit
from plenofir.camera.calibration.shading import (
    extents,
    order_of,
    unit_positions,
)
from plenofir.camera.calibration.white import (
    MANY_LENSES,
    WhiteImage,
    enough,
)

_SMALLEST_PITCH = 2.8
_LEAST_FIT = 9
_SMALL_PITCH = 8.0
# Centres are at about the same place between pixels if the mean of exp(2 pi i centre) exceeds this.
_ALIKE_PLACES = 0.3
# Lower limit of the scatter of large micro images, in pitches: a missing neighbour shifts them a
# little, which must not make them outliers.
_LARGE_FLOOR = 1e-4
# Shares of the shifts by the light's slope (of clipped images, too) and by changes of the pitch
# that remain after correction. A slope moves micro images by these shares of their spread and, if
# they are large and located by their borders, of the square of the pitch (from drawn images).
_UNSURE_LIGHT, _UNSURE_CLIPPED, _UNSURE_BENT, _MOVING, _MATCHED = 0.001, 0.025, 0.002, 0.75, 0.004
# A correction of centres is accepted if it increases their scatter by no more than this factor plus
# this many pixels.
_WORSE, _NOTHING = 1.25, 0.002


class GrowingFit(WhiteImage):
    """State of the growing fit."""

    def __init__(self, image: Image32, grid: Grid, clipped: float | None = None) -> None:
        super().__init__(image, grid, clipped)
        self.scatter = 0.0
        self.weights: Floats = np.empty(0)
        self.fitted: Floats = np.empty((0, 2))
        self.measured: Floats = np.empty((0, 2))
        self._fit: BentFit | None = None
        self.as_measured = True  # Whether the error found on drawn ones is left in centres.
        # Covariance of the grid's coefficients, and the same if the model is the true one.
        self.covariance: Floats = np.empty(0)
        self.own: Floats = np.empty(0)

    @property
    def bent(self) -> BentFit:
        """The latest fit."""
        if self._fit is None:
            raise no_grid("no grid of micro images")
        return self._fit

    def refine(
        self,
        radius: float,
        rounds: int,
        models: tuple[Model, ...] = MODELS,
        order: int | None = None,
        *,
        last: bool = False,
    ) -> None:
        """Measure and fit the lenses within a radius: a random part of many, all if `last`."""
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
            large = self.large
            measured = self.measure(self.padded, centres)
            lattice = self.grid.lattice(t, s)
            middle = np.round((lattice.min(axis=0) + lattice.max(axis=0)) / 2)
            scale = max(1.0, float(np.abs(lattice - middle).max()))
            points = (lattice - middle) / scale
            floor = (_LARGE_FLOOR if large else 1e-4) * max(pitch)
            corrected = self.corrected(measured, t, s, points)
            self.as_measured = corrected is None
            prior = np.ones(len(t))
            if self.shading is not None:
                prior = counting(self.light(centres))
            if corrected is not None:
                measured, prior = corrected, prior * self.as_drawn(centres)
            # Large micro images are not biased by pixels: their borders average over all places.
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
            self._fit = fit = lenses.fit(models, order, gained=every)
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

    def corrected(self, measured: Floats, t: Indices, s: Indices, points: Floats) -> Floats | None:
        """Measured centres, corrected by the error found on drawn ones; None if that is worse."""
        if self.drawn_grid is None:
            return None
        drawn = self.drawn_grid.centres(t, s)
        # The drawn grid does not cover lenses that have come in since.
        if ((drawn < 0) | (drawn > self.end)).any():
            return None
        stretch = self.stretch
        result = measured - (self.measure(self.redrawn, drawn) - drawn)
        # Where micro images look different from the drawn ones, the correction adds scatter.
        order = max(n for n in range(1, min(self.grid.order, 3) + 1) if n == 1 or len(t) >= 8 * n)
        terms = polynomial_terms(points, order)
        before, after = (robust_fit(terms, part, 1e-4)[2] for part in (measured, result))
        if after > _WORSE * before + _NOTHING:
            self.stretch = stretch
            return None
        return result

    def repeated(self, share: float) -> Floats:
        """Factors of the grid's change if centres are measured in a share of the window, pixels."""
        stretch, grid = self.stretch, self.grid
        again = self.measure(self.padded, grid.positions(self.fitted), share)
        if not self.as_measured and self.drawn_grid is not None:
            places = self.drawn_grid.positions(self.fitted)
            again -= self.measure(self.redrawn, places, share) - places
        self.stretch = stretch
        return self.followed((again - self.measured)[..., np.newaxis])

    def followed(self, moves: Floats) -> Floats:
        """What the grid's coefficients change if measured centres move, pixels.

        `moves`: shape (lenses, 2, n) for n errors. Result: shape (coefficients, 2, n).
        """
        grid = self.grid
        terms = polynomial_terms((self.fitted - grid.middle) / grid.scale, grid.order)
        design = np.einsum("nt,tap->nap", terms, self.bent.basis)
        design = design.reshape(-1, design.shape[-1])
        weighted = (design * self.weights.repeat(2)[:, np.newaxis]).T
        system = weighted @ design + np.diag(self.bent.prior_weights)
        changes = np.linalg.lstsq(system, weighted @ moves.reshape(len(design), -1), rcond=None)[0]
        return np.asarray(self.bent.basis @ changes)

    def frame(self) -> Frame:
        """The even grid that approximates this one in the middle of the image."""
        middle = self.end / 2
        origin = self.grid.inverse(middle)
        return Frame(self.grid.jacobian(origin), origin, middle, float(np.hypot(*middle)))

    def stretched(self, coefficients: Floats, count: int) -> Floats:
        """Covariance from an uncertain scale about the middle of the image."""
        # An error of the inner slope moves centroids in proportion to their distance from the
        # middle, so their scatter does not show it.
        moves = np.zeros((count, 2))
        moves[: len(coefficients)] = coefficients * self.stretch
        moves[0] -= self.end / 2 * self.stretch
        result = np.zeros((2, count, 2, count))
        for axis in (0, 1):
            result[axis, :, axis] = np.outer(moves[:, axis], moves[:, axis])
        return result

    def fit_pixels(self) -> None:
        """Fit the grid to the pixels where their bias of centroids looks like another pitch."""
        grid = self.grid
        if min(reduced_lengths(grid)) > _SMALL_PITCH or len(self.fitted) < MANY_LENSES:
            return
        turns = np.exp(2j * np.pi * grid.positions(self.fitted))
        if np.abs(turns.mean(axis=0)).max() < _ALIKE_PLACES:
            return
        terms = polynomial_terms((self.fitted - grid.middle) / grid.scale, grid.order)
        refined = pixel_fit(
            self.padded,
            self.margin,
            primitive_vectors(grid),
            terms @ self.bent.fixed + self.margin,
            np.einsum("nt,tap->nap", terms, self.bent.basis),
            self.bent.factors,
            self.weights,
            square=grid.layout == "rectangular",
        )
        coefficients = self.bent.fixed + self.bent.basis @ refined.factors
        count = terms.shape[1]
        certain = np.einsum(
            "iap,pq,jbq->aibj", self.bent.basis, refined.covariance, self.bent.basis
        )
        doubt = self.covariance - self.own
        self.own = np.zeros_like(doubt)
        self.own[:, :count, :, :count] = certain
        self.covariance = self.own + doubt
        self.grid = grid.model_copy(update={"coefficients": tuple(map(tuple, coefficients))})

    def shared_moves(self) -> Floats:
        """Errors of measured centres that many lenses have in common, (y, x) in pixels.

        Result: shape (lenses, 2, errors); each error moves all lenses at once, and the errors are
        independent of each other.
        """
        # The light's slope moves centroids, and the correction for it is uncertain.
        centres = self.grid.positions(self.fitted)
        if self.shading is None:
            return np.zeros((*centres.shape, 0))
        order, steps = order_of(self.shading), np.eye(2) * 0.5
        high, low = (
            [unit_positions(centres + step, self.shape) for step in sign * steps]
            for sign in (1, -1)
        )
        terms = np.stack(
            [
                polynomial_terms(ahead, order) - polynomial_terms(behind, order)
                for ahead, behind in zip(high, low, strict=True)
            ],
            axis=1,
        )
        share = _UNSURE_LIGHT if self.clipped is None else _UNSURE_CLIPPED
        values, vectors = np.linalg.eigh(self.unsure_light)
        slopes = np.concatenate(
            [
                terms @ (vectors * np.sqrt(np.maximum(values, 0.0))),
                share * (terms @ self.shading)[..., np.newaxis],
            ],
            axis=-1,
        )
        spread = _MOVING * self.spread
        if self.large:
            spread = _MATCHED * np.array(extents(self.grid)) ** 2
        else:
            far = unit_positions(centres, self.shape)
            for axis in self._sloped:
                # The part that grows with the distance from the middle is measured.
                line = far[:, axis] - far[:, axis].mean()
                part = line @ slopes[:, axis] / max(float(line @ line), 1e-12)
                slopes[:, axis] -= np.outer(far[:, axis], part)
        # Where the pitch changes, neighbours reach farther into the window from one side.
        bent = np.zeros_like(centres)
        for step in np.eye(2):
            both = self.grid.positions(self.fitted + step)
            both += self.grid.positions(self.fitted - step)
            bent += both - 2 * centres
        return np.concatenate(
            [slopes * spread[:, np.newaxis], _UNSURE_BENT * bent[..., np.newaxis]], axis=-1
        )
