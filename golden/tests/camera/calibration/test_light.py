# SPDX-License-Identifier: Apache-2.0
"""The light of a white image: fitted, divided out, and where lenses lie in it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_lattice import LAYOUTS

from plenofir.camera.calibration import calibration_of_grid, raster_window
from plenofir.camera.calibration.light import (
    constant,
    counting,
    divide_by_light,
    fitted_light,
    light_order,
)
from plenofir.camera.calibration.shading import (
    extents,
    lens_indices,
    order_of,
    outline,
    shading_at,
    unit_positions,
    within,
)
from plenofir_studies.synthetic import regular_grid

SHAPE = (91, 121)


def vignetting(places: np.ndarray) -> np.ndarray:
    """Light that falls off from a place beside the middle."""
    return 900 * np.exp(-0.6 * ((places - (40, 65)) ** 2).sum(axis=1) / 75**2)


@pytest.mark.parametrize("with_probes", [False, True])
@pytest.mark.parametrize(("count", "spread"), [(30, 0.004), (70, 0.004), (250, 0.002), (250, 0.1)])
def test_fitted_light_is_the_light_that_was_drawn(count, spread, with_probes) -> None:
    errors, claims = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        places = rng.uniform(0, 1, (count, 2)) * (90, 120)
        probes = np.zeros(count)
        if with_probes:  # The middle of each lens and four places around it, which are darker.
            middles = rng.uniform(0.1, 0.9, (count // 5, 2)) * (90, 120)
            moves = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
            places = (middles[:, np.newaxis] + moves).reshape(-1, 2)
            probes = np.tile([0.0, 1, 1, 1, 1], len(middles))
        level = vignetting(places) * np.exp(rng.normal(0, spread, len(places)))
        level = level * np.where(probes, 0.9, 1.0)
        level[:1] *= 0.5  # An outlier.
        found, covariance = fitted_light(places, level, probes, SHAPE)
        assert found.shape == (15,)
        assert covariance.shape == (15, 15)
        at = places[probes == 0]
        errors.append(np.log(shading_at(found, at, SHAPE) / vignetting(at)))
        terms = [shading_at(row, at, SHAPE) for row in np.eye(15)]
        claims.append(np.einsum("in,ij,jn->n", np.log(terms), covariance, np.log(terms)))
    worst = np.sqrt(np.mean(np.square(errors)))
    assert worst < max(0.02, 0.6 * spread)
    ratio = worst / np.sqrt(np.mean(claims))
    assert 0.4 * (count > 200) < ratio < 2.5


@pytest.mark.parametrize("coefficients", [[0.0, -0.5, 0.3], [-0.9, 0.1, 0.3, -0.4, 0.3, -0.5]])
def test_dividing_by_the_light_makes_an_image_even(coefficients) -> None:
    shape, dark = (70, 45), 15.0
    y, x = np.meshgrid(np.linspace(-1, 1, 70), np.linspace(-1, 1, 45), indexing="ij")
    terms = [y**0, y, x, y * y, y * x, x * x][: len(coefficients)]
    logs = sum(c * term for c, term in zip(coefficients, terms, strict=True))
    light = np.exp(np.clip(logs, np.log(0.03), 0))
    assert light.min() < 1 == light.max() or len(coefficients) > 3
    pattern = np.random.default_rng(0).uniform(20, 900, shape)
    even = np.empty(shape, np.float32)
    image = (dark + pattern * light).astype(np.float32)
    divide_by_light(image, dark, np.array(coefficients), even)
    assert even == pytest.approx(pattern, rel=1e-4)
    positions = np.stack(np.indices(shape), axis=-1)
    assert shading_at(np.array(coefficients), positions, shape) == pytest.approx(np.exp(logs))


def test_light_below_three_percent_is_divided_by_three_percent() -> None:
    even = np.empty((3, 3), np.float32)
    divide_by_light(np.ones((3, 3), np.float32), 0.0, np.array([-9.0]), even)
    assert even == pytest.approx(1 / 0.03)
    divide_by_light(np.ones((3, 3), np.float32), 0.0, np.array([2.0]), even)
    assert even == pytest.approx(1.0)


def test_numbers_of_lenses_and_of_terms() -> None:
    """Four lenses for each term or more, of order 4 at most."""
    assert [light_order(n) for n in (0, 4, 5, 16, 17, 36, 37, 64, 65, 9999)] == [
        0, 0, 1, 1, 2, 2, 3, 3, 4, 4,
    ]  # fmt: skip
    assert [order_of(np.zeros(n)) for n in (1, 3, 6, 10, 15, 21)] == [0, 1, 2, 3, 4, 5]
    assert constant(0.7, np.ones(3)).tolist() == [0.7, 0, 0]
    # A lens at 15 % of the brightest has half the weight that the most have.
    assert counting(np.array([200.0, 30.0])) == pytest.approx([1 / (1 + 0.15**2), 0.5])


def test_positions_over_half_an_image() -> None:
    places = np.array([[-5.0, 0.0], [0, 30], [45, 60], [67.5, 120], [95, 200]])
    expected = [[-1, -1], [-1, -0.5], [0, 0], [0.5, 1], [1, 1]]
    assert unit_positions(places, SHAPE) == pytest.approx(np.array(expected))
    # Far from all lenses the light stays finite.
    steep = shading_at(np.array([0.0, 99.0, 0.0]), places, SHAPE)
    assert steep == pytest.approx(np.exp([-30.0, -30.0, 0.0, 30.0, 30.0]))
    steps = outline(np.array([1.0, 2.0]), np.array([5.0, 10.0]))
    assert steps.min(axis=0).tolist() == [1, 2]
    assert steps.max(axis=0).tolist() == [5, 10]
    assert (np.isin(steps[:, 0], (1, 5)) | np.isin(steps[:, 1], (2, 10))).all()
    for corner in ((1, 2), (1, 10), (5, 2), (5, 10), (3, 2), (1, 6)):
        assert (steps == corner).all(axis=1).any()


def test_centres_in_an_image_reach_half_a_pixel_beyond_the_last() -> None:
    """And a little more, for rounding."""
    end = [[-0.53, 3], [-0.51, 3], [90.51, 120.51], [90.53, 3], [3, 120.53], [3, -0.51]]
    assert within(np.array(end), SHAPE).tolist() == [False, True, True, False, False, True]


@given(
    st.sampled_from(LAYOUTS), st.integers(0, 1), st.floats(5, 30), st.floats(-9, 9),
    st.floats(0.95, 1.05), st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
)  # fmt: skip
def test_lenses_of_an_image_are_all_that_lie_in_it(
    layout, stagger, pitch, rotation, stretch, offset
) -> None:
    grid = regular_grid(SHAPE, pitch, rotation_degrees=rotation, layout=layout, offset=offset)
    stretched = tuple((stretch * y, x) for y, x in grid.coefficients)
    grid = grid.model_copy(update={"stagger": stagger, "coefficients": stretched})
    inside = within(grid.centres(*np.mgrid[-40:41, -40:41]), SHAPE)
    if not inside.any():
        return
    found = calibration_of_grid(grid, SHAPE)
    rows, columns = np.nonzero(inside.any(axis=1))[0], np.nonzero(inside.any(axis=0))[0]
    assert found.lenses == (np.ptp(rows) + 1, np.ptp(columns) + 1)
    assert found.used == inside.sum() == found.inside.sum()
    first = grid.centres(rows[0] - 40, columns[0] - 40)
    assert found.model_centres[0, 0] == pytest.approx(first, abs=1e-9)
    assert found.lens_brightness == pytest.approx(1.0)
    t, s = lens_indices(grid, SHAPE)
    assert within(grid.centres(t, s), SHAPE).sum() == inside.sum()
    window = raster_window(found)
    part = found.inside[window]
    assert part.all()
    assert part.size > 0.4 * inside.sum()
    # Windows are as high and wide as a lens's cell.
    tall, wide = extents(grid)
    if layout == "rectangular":
        assert (tall, wide) == pytest.approx(grid.pitch)
    else:
        assert tall == wide == pytest.approx(max(grid.pitch), rel=0.1)
