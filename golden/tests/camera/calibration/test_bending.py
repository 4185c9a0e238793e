# SPDX-License-Identifier: Apache-2.0
"""Models of bent grids, and their fit to lenses whose true centres are known."""

from typing import Any

import numpy as np
import pytest

from plenofir.camera.calibration.bending import BentFit, Lenses
from plenofir.camera.calibration.grid import polynomial_terms
from plenofir.camera.calibration.models import (
    BENT,
    EVEN,
    FULL,
    GROUPS,
    MODELS,
    TERMS,
    Frame,
    beyond,
    columns,
    places_of,
)
from plenofir.camera.calibration.moire import waves
from plenofir_studies.synthetic import regular_grid

NOISE = 0.02
PULL = 0.01


def bent(
    rows: int, columns: int, *, tilt=(0.0, 0.0), bend: float = 0.0, pull: float = 0.0,
    pitch: float = 9.3, layout: Any = "rectangular", seed: int = 0, outliers: float = 0.0,
    noise: float = NOISE,
) -> tuple[Lenses, np.ndarray]:  # fmt: skip
    """Lenses of a grid that is tilted, then distorted, and their true centres."""
    rng = np.random.default_rng(seed)
    t, s = (n.ravel() for n in np.mgrid[:rows, :columns])
    shape = (int(rows * pitch), int(columns * pitch))
    grid = regular_grid(shape, pitch, rotation_degrees=1.0, layout=layout)
    grid = grid.moved(-(rows // 2), -(columns // 2))
    lattice = grid.lattice(t, s)
    middle = (np.array(shape) - 1) / 2
    half = float(np.hypot(*middle))
    flat = (grid.positions(lattice) - middle) / half
    away = flat / (1 - flat @ np.array(tilt))[:, np.newaxis]
    truth = away * (1 + bend * (away**2).sum(axis=1))[:, np.newaxis] * half + middle
    values = truth + pull * np.sin(2 * np.pi * truth) + rng.normal(0, noise, truth.shape)
    values[rng.random(len(values)) < outliers] += (0.4, 0.3)
    origin = np.round(lattice.mean(axis=0))
    lenses = Lenses(
        frame=Frame(grid.jacobian(grid.inverse(middle)), grid.inverse(middle), middle, half),
        points=(lattice - origin) / 7.0, lattice=lattice, values=values,
        prior=rng.uniform(0.4, 1.0, len(values)), floor=1e-3, pitch=pitch, pulled=pull > 0,
        scale=(7.0, origin),
    )  # fmt: skip
    return lenses, truth


def fitted(lenses: Lenses, fit: BentFit) -> tuple[np.ndarray, np.ndarray]:
    """Centres of a fit, and their standard errors along y and x."""
    centres = polynomial_terms(lenses.points, fit.order) @ fit.coefficients
    terms = polynomial_terms(lenses.points, fit.covariance_order)
    return centres, np.sqrt(np.einsum("ni,aiaj,nj->na", terms, fit.covariance, terms))


@pytest.mark.parametrize(
    ("rows", "columns", "how"),
    [
        (8, 9, {}),
        (14, 13, {"tilt": (0.02, -0.03), "bend": 0.015}),
        (12, 15, {"bend": -0.02, "pull": PULL, "pitch": 4.0}),
        (5, 6, {"tilt": (0.02, 0.0)}),
        (11, 12, {"bend": 0.01, "layout": "hexagonal-rows"}),
        (9, 10, {"tilt": (0.0, 0.03), "layout": "hexagonal-columns", "pitch": 30.0}),
    ],
)
def test_centres_are_right_within_their_claimed_errors(rows, columns, how) -> None:
    ratios = []
    for seed in range(12):
        lenses, truth = bent(rows, columns, seed=seed, outliers=0.04, **how)
        fit = lenses.fit()
        centres, errors = fitted(lenses, fit)
        assert np.abs(centres - truth).max() < 0.06
        ratios.append(((centres - truth) ** 2).mean() / (errors**2).mean())
        assert fit.scatter == pytest.approx(NOISE * np.sqrt(lenses.prior.mean()), rel=0.5)
        far = np.abs(lenses.values - truth).max(axis=1) > 0.2
        assert (fit.weights[far] == 0).all()
        assert (fit.weights[~far] > 0).mean() > 0.9
        assert (fit.weights <= lenses.prior).all()
    # Errors claimed in all are those made, to a factor of two; the true model's alone are less.
    assert 0.2 < np.mean(ratios) < 2
    assert (np.einsum("aiai->ai", fit.own) <= np.einsum("aiai->ai", fit.covariance)).all()


def test_without_noise_all_models_are_exact() -> None:
    """Tilt and distortion up to terms of the sixth order; a pull that has two strengths."""
    for how in ({}, {"tilt": (0.02, -0.03)}, {"bend": -0.02}, {"tilt": (0.03, 0.0), "bend": 0.02}):
        lenses, truth = bent(14, 13, noise=1e-5, **how)
        centres, errors = fitted(lenses, lenses.fit())
        assert np.abs(centres - truth).max() < 2e-3
        assert errors.max() < 0.002
    lenses, truth = bent(14, 13, noise=1e-5, pull=PULL, pitch=4.05)
    assert np.abs(fitted(lenses, lenses.fit())[0] - truth).max() < 5e-4


def test_the_model_is_that_of_the_lenses() -> None:
    even = bent(14, 13)[0].fit()
    assert (even.order, even.factors.shape, even.untried) == (1, (6,), ())
    assert len(even.gains) == 2
    assert max(even.gains) < 0.003
    distorted = bent(14, 13, bend=0.02)[0].fit()
    assert distorted.order == 3
    assert distorted.gains[1] > 0.02 > distorted.gains[0]
    tilted = bent(14, 13, tilt=(0.03, 0.02))[0].fit(gained=False)
    assert (tilted.order, tilted.gains) == (5, ())
    # An order that is given is taken, with all its terms.
    for order, count in ((1, 6), (2, 12), (3, 20)):
        fit = bent(14, 13, bend=0.02)[0].fit(order=order)
        assert (fit.order, fit.factors.shape, fit.gains) == (order, (count,), ())
    # Few lenses and those of models that are given.
    assert bent(5, 6)[0].fit().untried == (3,)
    assert bent(4, 5)[0].fit().untried == (2, 3)
    assert bent(14, 13, bend=0.02)[0].fit((EVEN,)).order == 1


def test_a_fit_that_cannot_tell_claims_more() -> None:
    """Few lenses do not tell of all distortions: more than by their number's square root."""
    few, many = (bent(*size)[0] for size in ((5, 6), (14, 14)))
    claims = [fitted(lenses, lenses.fit())[1].max() for lenses in (few, many)]
    assert claims[0] > 2 * claims[1]
    fit = bent(9, 9, tilt=(0.01, 0.0))[0].fit()
    assert np.einsum("aiai->", fit.covariance) > 1.05 * np.einsum("aiai->", fit.own)


def test_many_lenses_are_drawn_for_the_choice_and_all_are_fitted() -> None:
    lenses, truth = bent(65, 65, bend=0.003, outliers=0.02)
    fit = lenses.fit()
    centres, errors = fitted(lenses, fit)
    assert fit.order == 3
    assert np.abs(centres - truth).max() < 0.01
    assert (fit.weights > 0).sum() > 4100
    assert 0.3 < ((centres - truth) ** 2).mean() / (errors**2).mean() < 3


@pytest.mark.parametrize(
    ("order", "lenses", "rows"), [(2, 24, 4), (3, 100, 10), (4, 100, 10), (5, 160, 12)]
)
def test_numbers_of_lenses_that_an_order_takes(order, lenses, rows) -> None:
    for count, lines, enough in (
        (lenses, rows, True), (lenses - 1, rows, False), (2 * lenses, rows - 1, False),
    ):  # fmt: skip
        across = -(-count // lines)
        part = bent(lines, across)[0]._part(np.arange(count))
        assert part.tried(order) == enough


def test_terms_are_those_of_their_definitions() -> None:
    rng = np.random.default_rng(0)
    z = rng.normal(0, 0.5, 20) + 1j * rng.normal(0, 0.5, 20)
    y, x, square = z.real, z.imag, np.abs(z) ** 2
    expected = {
        "even": [1 + 0 * z, 1j + 0 * z, z, 1j * z, z.conj(), 1j * z.conj()],
        "radial": [z * square],
        "tilt": [z * y, z * x],
        "axis": [square + 0j, 1j * square],
        "quadratic": [z.conj() ** 2, 1j * z.conj() ** 2],
        "high": [z * square**2, z * square * y, z * square * x],
    }
    for name, parts in expected.items():
        assert columns(z, (name,)) == pytest.approx(np.stack(parts, axis=1)), name
    # All terms of an order, as many as a polynomial has for y and x, and no two alike.
    for order, model in FULL.items():
        made = columns(z, model.groups)
        assert made.shape[1] == (order + 1) * (order + 2)
        real = np.concatenate([made.real, made.imag])
        assert np.linalg.matrix_rank(real) == min(real.shape)
        polynomials = polynomial_terms(np.stack([y, x], axis=1), order)
        left = made - polynomials @ np.linalg.lstsq(polynomials + 0j, made, rcond=None)[0]
        assert np.abs(left).max() < 1e-9
    assert np.array_equal(places_of(tuple(GROUPS)), np.arange(len(TERMS)))
    assert columns(z, BENT.groups) == pytest.approx(
        columns(z, tuple(GROUPS))[:, places_of(BENT.groups)]
    )
    assert [model.perspective for model in MODELS].count(True) == 4


def test_terms_beyond_are_what_an_exact_tilt_and_distortion_leave() -> None:
    tilt, bend = np.array([0.3, -0.2]), 0.05
    z = np.exp(1j * np.linspace(0, 6, 9))
    errors = []
    for size in (0.2, 0.1):
        place = size * z
        s = place.real * tilt[0] + place.imag * tilt[1]
        away = place / (1 - s)
        exact = away * (1 + bend * np.abs(away) ** 2)
        low = place * (1 + s + bend * np.abs(place) ** 2)
        errors.append(np.abs(exact - low - beyond(place, tilt, bend)).max())
    # Of the sixth order.
    assert errors[0] / errors[1] == pytest.approx(64, rel=0.2)


def test_pulls_are_sines_with_their_derivatives() -> None:
    places = np.random.default_rng(0).uniform(0, 5, (9, 2))
    pulls, slopes = waves(places)
    for n, turns in enumerate((2 * np.pi, 4 * np.pi)):
        assert pulls[..., n] == pytest.approx(np.sin(turns * places))
        assert slopes[..., n] == pytest.approx(turns * np.cos(turns * places))
