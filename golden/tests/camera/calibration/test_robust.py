# SPDX-License-Identifier: Apache-2.0
"""Least squares with weights and with outliers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.calibration.robust import robust_fit, weighted_fit

seeds = st.integers(0, 1000)
FACTORS = np.array([[1.0, 2.0], [0.5, -1.0], [0.1, 0.2]])


def drawn(rng, count: int, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Terms of parabolas, and their values with noise."""
    terms = np.vander(np.linspace(-1, 1, count), 3, increasing=True)
    return terms, terms @ FACTORS + rng.normal(0, noise, (count, 2))


@given(seeds, st.integers(3, 30))
def test_weights_are_those_of_least_squares(seed, count) -> None:
    rng = np.random.default_rng(seed)
    terms, values = drawn(rng, count, 0.3)
    weights = rng.uniform(0.1, 2, count)
    root = np.sqrt(weights)[:, np.newaxis]
    expected = np.linalg.lstsq(root * terms, root * values, rcond=None)[0]
    assert weighted_fit(terms, values, weights) == pytest.approx(expected, abs=1e-9)


@given(seeds, st.booleans())
def test_a_robust_fit_is_its_own_reweighting(seed, has_prior) -> None:
    """Tukey's biweight up to 6 robust deviations, and the deviation of a normal distribution."""
    rng = np.random.default_rng(seed)
    terms, values = drawn(rng, 40, 0.1)
    values[:3] += (0.45, -0.3)
    prior = rng.uniform(0.2, 1, 40) if has_prior else None
    found, weights, scale = robust_fit(terms, values, 1e-9, prior, rounds=200)
    given_weights = np.ones(40) if prior is None else prior
    left = (values - terms @ found) * np.sqrt(given_weights)[:, np.newaxis]
    assert scale == pytest.approx(1.4826 * np.median(np.abs(left)) * np.sqrt(40 / 37), rel=0.1)
    away = np.minimum(np.hypot(*left.T) / (6 * scale), 1)
    assert weights == pytest.approx(given_weights * (1 - away**2) ** 2, abs=0.03)
    assert found == pytest.approx(weighted_fit(terms, values, weights))


@given(seeds)
def test_far_outliers_do_not_count(seed) -> None:
    rng = np.random.default_rng(seed)
    terms, values = drawn(rng, 60, 0.01)
    values[::5] += rng.uniform(1, 5, (12, 1))
    found, weights, scale = robust_fit(terms, values, 1e-9)
    assert (weights[::5] == 0).all()
    assert found == pytest.approx(FACTORS, abs=0.02)
    assert 0.006 < scale < 0.02
    assert robust_fit(terms, values, 1e-9, rounds=1)[0] != pytest.approx(FACTORS, abs=0.02)


def test_the_scatter_has_a_floor() -> None:
    terms, values = drawn(np.random.default_rng(0), 9, 0.0)
    values[4, 0] += 0.05
    _, weights, scale = robust_fit(terms, values, 0.01)
    assert scale == 0.01
    # The residual there is below six times the floor, so that it counts in part.
    assert 0 < weights[4] < 0.5 < np.delete(weights, 4).min()
    assert robust_fit(terms, values, 0.001)[0] == pytest.approx(FACTORS, abs=1e-9)


def test_as_many_values_as_terms() -> None:
    terms, values = drawn(np.random.default_rng(0), 3, 0.1)
    found, weights, scale = robust_fit(terms, values, 0.01)
    assert terms @ found == pytest.approx(values)
    assert (scale, weights.min()) == (0.01, pytest.approx(1.0))
