# SPDX-License-Identifier: Apache-2.0
"""Fit of a grid bent by a tilted array and a distorting lens, with the choice of its model.

A few lenses do not determine all terms of a polynomial of order 3, but they do determine the few
terms that a camera has (`plenofir.camera.calibration.models`).

Each factor has a normal prior (a flat one for the terms of an even grid), so models are compared by
their evidence, which penalises terms that the data do not need. The model with the most evidence is
taken. The predictions of the others, weighted by their probability, go into the standard error of a
centre: where lenses are too few or too noisy to distinguish models, centres are uncertain.

Outliers are the lenses that do not fit the model with the most terms. They are the same for all
models, so a simpler model cannot discard lenses at the border that contradict it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np

from plenofir.camera.calibration.grid import Floats, Indices, exponents, polynomial_terms
from plenofir.camera.calibration.models import (
    BENT,
    EVEN,
    FULL,
    GROUPS,
    HIGHEST,
    MODELS,
    SPREADS,
    TERMS,
    Complexes,
    Frame,
    Model,
    beyond,
    columns,
    places_of,
)
from plenofir.camera.calibration.moire import USUAL, waves

# Tukey's biweight: residuals beyond this many (robust) standard deviations do not count.
_TUKEY = 6.0
_FIRST_ROUNDS, _ROUNDS = 6, 20
_SETTLED = 1e-3
# Models are compared on at most this many lenses, drawn at random with a fixed seed: each of
# ten is fitted to them, and only the best one to all lenses.
_COMPARED = 4000
# Error in pixels that all centroids have in common: the largest of a constant, a multiple of the
# pitch, and a multiple of its reciprocal.
_COMMON = (0.0001, 0.0000075, 0.00075)
# Share of the scatter that centroids are taken to have in common when models are compared.
_TOGETHER = 0.06
# Logarithm of the odds at which an even grid is taken for another model. The standard error does
# without them: where lenses cannot tell, the grid may be bent.
_EVEN_ODDS = 4.0
# Terms of higher order below this many pixels are left out; largest tilt.
_NOTHING, _LARGEST_TILT = 1e-4, 0.1
# For each order: lenses, and rows and columns of them, that fitting all its terms takes. With eight
# rows and noise the free terms of order 3 bent a corner by half a pixel.
_NEEDED = {2: (24, 4), 3: (100, 10), 4: (100, 10), 5: (160, 12)}


@dataclass(frozen=True)
class _Robust:
    """A model fitted robustly, and the fit's linear system at the solution."""

    factors: Floats  # of the terms in pixels, then the strengths of the pull
    tukey: Floats  # weight of each lens, without its prior weight
    scatter: float
    design: Floats  # shape (2 lenses, factors)
    target: Floats  # shape (2 lenses,)


@dataclass(frozen=True)
class BentFit:
    """The model with the most evidence."""

    order: int  # order of the polynomial in `Lenses.points`
    # What each of the model's factors adds to its coefficients, shape (coefficients, 2, factors).
    basis: Floats
    factors: Floats  # factors of the model's terms, in pixels
    # Weight of each factor's prior beside that of lenses.
    prior_weights: Floats
    fixed: Floats  # The coefficients if all factors are 0.
    weights: Floats  # Robust weights of the lenses; 0 for lenses that were not drawn.
    scatter: float  # Robust standard deviation of the lenses from the model in pixels.
    # Covariance of the coefficients of a polynomial of order `covariance_order`, for y and x: shape
    # (2, coefficients, 2, coefficients). Includes the uncertainty of the choice of the model.
    covariance: Floats
    own: Floats  # covariance if this model is the true one
    covariance_order: int
    # For the orders 2 and 3, by how many pixels (root mean square) they predict lenses left out of
    # the fit better than the best lower order, negative if worse.
    gains: tuple[float, ...]
    untried: tuple[int, ...]  # Orders whose terms could not all be tried, for want of lenses.

    @property
    def coefficients(self) -> Floats:
        """Coefficients of the polynomial for y and x: shape (coefficients, 2)."""
        return np.asarray(self.fixed + self.basis @ self.factors)


@dataclass(frozen=True)
class Lenses:
    """Lenses that models are fitted to."""

    frame: Frame  # An even grid near them.
    # Arguments of the polynomial, lattice coordinates, and measured centres (y, x) in pixels, all
    # of shape (n, 2).
    points: Floats
    lattice: Floats
    values: Floats
    prior: Floats  # Weight of each lens.
    floor: float  # Lower limit of the scatter in pixels, from which outliers are judged.
    pitch: float  # In pixels.
    pulled: bool  # Whether the pixel raster biases centroids (`plenofir.camera.calibration.moire`).
    scale: tuple[float, Floats]  # Scale and offset from points to lattice coordinates.

    def tried(self, order: int) -> bool:
        """Whether there are enough lenses to fit all terms of an order."""
        lenses, rows = _NEEDED[order]
        sides = [len(np.unique(np.floor(line))) for line in self.lattice.T]
        return len(self.points) >= lenses and min(sides) >= rows

    def _precisions(self, groups: tuple[str, ...]) -> Floats:
        """Priors of the factors: the reciprocals of their variances."""
        precisions = 1 / (SPREADS[places_of(groups)] * self.frame.half) ** 2
        pulls = (self.pitch / USUAL) ** 2 if self.pulled else np.empty(0)
        return np.concatenate([precisions, pulls])

    def _part(self, lenses: Indices) -> "Lenses":
        return replace(
            self,
            points=self.points[lenses],
            lattice=self.lattice[lenses],
            values=self.values[lenses],
            prior=self.prior[lenses],
        )

    def _lens(self, groups: tuple[str, ...], factors: Floats) -> tuple[Floats, float]:
        """Tilt and distortion from the factors of some groups."""
        whole = np.zeros(len(TERMS))
        whole[places_of(groups)] = factors[: len(places_of(groups))] / self.frame.half
        tilt, radial = whole[places_of(("tilt",))], whole[places_of(("radial",))]
        return np.clip(tilt, -_LARGEST_TILT, _LARGEST_TILT), float(radial[0])

    def _robust(self, groups: tuple[str, ...], *, perspective: bool) -> _Robust:
        """Fit all terms of some groups robustly."""
        complexes = columns(self.frame.places(self.lattice), groups)
        size = complexes.shape[1]
        terms = np.stack([complexes.real, complexes.imag], axis=1).reshape(-1, size)
        measured = values = (self.values - self.frame.middle).ravel()
        shift = np.tile(self.frame.middle, len(self.values))
        precisions = self._precisions(groups)
        factors = np.zeros(len(precisions))
        design, target = np.hstack([terms, np.zeros((len(terms), len(precisions) - size))]), values
        tukey, scatter = np.ones(len(self.values)), 1.0
        for n in range(_FIRST_ROUNDS + _ROUNDS):
            root = np.sqrt(self.prior * tukey).repeat(2)
            rows = root[:, np.newaxis] * design
            gram = rows.T @ rows
            system = gram + scatter**2 * np.diag(precisions)
            # The equations, and beside them those of the degrees of freedom.
            rights = np.column_stack([rows.T @ (root * target), gram])
            factors, *shares = np.linalg.lstsq(system, rights, rcond=None)[0].T
            freedom = float(np.trace(np.array(shares)))
            if perspective:
                values = measured - self._more(self._lens(groups, factors))
                target = values
            if self.pulled:
                centres = terms @ factors[:size]
                pulls, slopes = waves(centres + shift + measured - values)
                left = values - centres - pulls @ factors[size:]
                design = np.concatenate(
                    [terms * (1 + slopes @ factors[size:])[:, np.newaxis], pulls], axis=1
                )
                target = left + design @ factors
            away = (target - design @ factors).reshape(-1, 2) * np.sqrt(self.prior)[:, np.newaxis]
            scatter = self._scatter(away, freedom)
            distance = np.linalg.norm(away, axis=1)
            if n < _FIRST_ROUNDS:
                # Minimises the sum of distances first: unlike Tukey's biweight it has one minimum.
                new = scatter / np.maximum(distance, scatter)
            else:
                share = distance / (_TUKEY * scatter)
                new = np.where(share < 1, (1 - share**2) ** 2, 0.0)
            change = float(np.abs(new - tukey).max())
            tukey = new
            if n >= _FIRST_ROUNDS and change < _SETTLED:
                break
        return _Robust(factors, tukey, scatter, design, target)

    def _scatter(self, away: Floats, freedom: float) -> float:
        """Robust standard deviation of residuals."""
        spread = 1.4826 * float(np.median(np.abs(away)))
        return max(spread * sqrt(away.size / max(1.0, away.size - freedom)), self.floor)

    def fit(
        self, models: tuple[Model, ...] = MODELS, order: int | None = None, *, gained: bool = True
    ) -> BentFit:
        """Fit the model with the most evidence, or the one with all terms of an order.

        `gained`: whether to tell what each order gains, which takes a third of the time.
        """
        few = self
        drawn: Indices | slice = slice(None)
        if len(self.points) > _COMPARED:
            drawn = np.random.default_rng(1).permutation(len(self.points))[:_COMPARED]
            few = self._part(drawn)
        required = None if order is None else FULL[order]
        models = tuple(m for m in models if all(map(few.tried, m.needs)) or m is required)
        groups = tuple(n for n in GROUPS if any(n in m.groups for m in models))
        exact = BENT in models and FULL[3] not in models
        rich = few._robust(groups, perspective=exact)
        lens = few._lens(groups, rich.factors)
        more = few._more(lens)
        plain = rich.target + more if exact else rich.target
        compared = _Compared(few, rich, groups, plain, more)
        fits = [compared.solve(model) for model in models]
        chances = np.exp(np.array([f.evidence for f in fits]) - max(f.evidence for f in fits))
        chances /= chances.sum()
        allowed = [n for n, m in enumerate(models) if required in (None, m)]
        odds = [_EVEN_ODDS if m is EVEN else 0.0 for m in models]
        best = max(allowed, key=lambda n: fits[n].evidence + odds[n])
        model, chosen = models[best], fits[best]
        # Covariance over all models, weighted by their probability (total variance).
        away = np.stack([f.factors - chosen.factors for f in fits])
        others = np.einsum("m,mi,mj->ij", chances, away, away)
        others += np.einsum("m,mij->ij", chances, np.stack([f.covariance for f in fits]))
        others -= chosen.covariance
        part = np.searchsorted(places_of(groups), places_of(model.groups))
        weights = np.zeros(len(self.points))
        weights[drawn] = few.prior * rich.tukey
        factors, own = chosen.factors[part], chosen.covariance
        residuals = compared.left(model, chosen).reshape(-1, 2)
        scatter = self._scatter(residuals * np.sqrt(few.prior)[:, np.newaxis], len(part))
        if few is not self:
            every = self._robust(model.groups, perspective=model.perspective)
            lens = self._lens(model.groups, every.factors)
            weights, scatter = self.prior * every.tukey, every.scatter
            factors = every.factors[: len(part)]
            share = float((few.prior * rich.tukey).sum() / weights.sum())
            noise = compared.noise * share + compared.common
            own = own * noise / (compared.noise + compared.common)
        made = model.order
        if model.perspective and np.abs(more).max() > _NOTHING:
            made = HIGHEST
        fixed = np.zeros((len(exponents(made)), 2))
        if model.perspective:
            fixed = self._polynomial(lambda z: self.frame.half * beyond(z, *lens), made)
        fixed[0] += self.frame.middle
        basis = self._polynomial(lambda z: columns(z, model.groups), made)
        top = max(made, *(m.order for m in models))
        turn = self._polynomial(lambda z: columns(z, groups), top)
        size = turn.shape[-1]
        own, whole = (
            np.einsum("iap,pq,jbq->aibj", turn, c[:size, :size], turn) for c in (own, own + others)
        )
        return BentFit(
            order=made,
            basis=basis,
            factors=factors,
            prior_weights=(compared.noise + compared.common)
            * self._precisions(model.groups)[: len(part)],
            fixed=fixed,
            weights=weights,
            scatter=scatter,
            covariance=whole,
            own=own,
            covariance_order=top,
            gains=compared.gains(models, fits) if gained and order is None else (),
            untried=tuple(n for n in (2, 3) if n in FULL and not few.tried(n)),
        )

    def _more(self, lens: tuple[Floats, float]) -> Floats:
        """Terms of higher order that follow from a tilt and a distortion, in pixels."""
        more = self.frame.half * beyond(self.frame.places(self.lattice), *lens)
        return np.stack([more.real, more.imag], axis=1).ravel()

    def _polynomial(self, of: Callable[[Complexes], Complexes], order: int) -> Floats:
        """Coefficients, in `points`, of polynomials given as functions of places."""
        steps = np.linspace(-1, 1, order + 2)
        samples = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        scale, middle = self.scale
        values = of(self.frame.places(samples * scale + middle))
        solve = np.linalg.pinv(polynomial_terms(samples, order))
        return np.stack([solve @ values.real, solve @ values.imag], axis=1)


class _Solved(NamedTuple):
    """Logarithm of a model's evidence, its factors among all of them, and their covariance."""

    evidence: float
    factors: Floats
    covariance: Floats


class _Compared:
    """Models compared on the same lenses, weighted as in the fit with the most terms."""

    def __init__(
        self, lenses: Lenses, rich: _Robust, groups: tuple[str, ...], plain: Floats, more: Floats
    ) -> None:
        self.lenses, self.rich, self.groups = lenses, rich, groups
        self.plain, self.more = plain, more
        self.weights = (lenses.prior * rich.tukey).repeat(2)
        rows = self.weights[:, np.newaxis] * rich.design
        self.gram = rows.T @ rich.design
        # For models without and with the terms of higher order that follow from tilt and
        # distortion.
        targets = plain, plain - more
        self.rights = [rows.T @ target for target in targets]
        self.squares = [float(self.weights @ target**2) for target in targets]
        self.precisions = lenses._precisions(groups)
        squares = float(self.weights @ (rich.target - rich.design @ rich.factors) ** 2)
        self.noise = rich.scatter**2
        for _ in range(2):
            system = self.gram + self.noise * np.diag(self.precisions)
            freedom = float(np.trace(np.linalg.lstsq(system, self.gram, rcond=None)[0]))
            count = 2 * float(rich.tukey.sum())
            self.noise = max(squares / max(1.0, count - freedom), lenses.floor**2)
        # Errors that all lenses have in common do not average out.
        common = max(_COMMON[0], _COMMON[1] * lenses.pitch, _COMMON[2] / lenses.pitch)
        self.common = common**2 * float(self.weights.sum() / 2)

    def part(self, model: Model) -> Indices:
        """Indices of a model's factors, and of the pixels' pulls, among all factors."""
        places = places_of(self.groups)
        pulls = np.arange(len(places), len(self.gram))
        return np.concatenate([np.searchsorted(places, places_of(model.groups)), pulls])

    def solve(self, model: Model) -> _Solved:
        """Fit a model."""
        part = self.part(model)
        gram, precisions = self.gram[np.ix_(part, part)], self.precisions[part]
        right = self.rights[model.perspective][part]
        # A common error in proportion to the scatter: it must not be taken for distortion.
        noise = self.noise * (1 + _TOGETHER**2 * float(self.weights.sum() / 2)) + self.common
        system = gram / noise + np.diag(precisions)
        evidence = 0.5 * (
            np.log(precisions[precisions > 0]).sum()
            - np.linalg.slogdet(system)[1]
            + right @ np.linalg.solve(system, right) / noise**2
            - self.squares[model.perspective] / noise
        )
        noise = self.noise + self.common
        inverse = np.linalg.inv(gram / noise + np.diag(precisions))
        factors, covariance = np.zeros(len(self.gram)), np.zeros_like(self.gram)
        factors[part] = inverse @ right / noise
        covariance[np.ix_(part, part)] = inverse
        return _Solved(float(evidence), factors, covariance)

    def left(self, model: Model, solved: _Solved) -> Floats:
        """Residuals of a model."""
        target = self.plain - self.more if model.perspective else self.plain
        return target - self.rich.design @ solved.factors

    def gains(self, models: tuple[Model, ...], fits: list[_Solved]) -> tuple[float, ...]:
        """For each order, by how many pixels it predicts left-out lenses better than lower ones."""
        result: list[float] = []
        least = None
        for order in (1, 2, 3):
            of_order = [n for n, m in enumerate(models) if m.order == order]
            if not of_order:
                break
            place = max(of_order, key=lambda n: fits[n].evidence)
            best = fits[place]
            design = self.rich.design
            share = ((design @ best.covariance) * design).sum(axis=1) * self.weights
            share /= self.noise + self.common
            missed = self.left(models[place], best) / np.maximum(1 - share, 0.05)
            squares = (missed**2 * self.weights).reshape(-1, 2).sum(axis=1)
            if least is None:
                least = squares
                continue
            mean = float((least - squares).mean())
            result.append(float(np.copysign(sqrt(abs(mean)), mean)))
            least = squares if mean > 0 else least
        return tuple(result)
