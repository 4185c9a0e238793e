# SPDX-License-Identifier: Apache-2.0
"""Windows, samples and spots against their definitions in NumPy and SciPy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from plenofir.camera.calibration.centroids import (
    core_brightness,
    matched_offsets,
    matching_scale,
    raised_cosine,
    reach,
    response,
    smoothed,
    windowed_moments,
)
from plenofir.camera.calibration.moments import add_spot_system, add_spots, sample, spot_values
from plenofir.camera.calibration.redrawn import redrawn, usual_spot
from plenofir_studies.synthetic import centres_within, regular_grid, white_image

RNG = np.random.default_rng(8)
NOISE = RNG.uniform(0, 900, (60, 70)).astype(np.float32)
PLACES = RNG.uniform(18, 41, (6, 2))


def keys(away: np.ndarray) -> np.ndarray:
    """Keys's cubic interpolation, a = -1/2."""
    x = np.abs(away)
    near, far = 1.5 * x**3 - 2.5 * x**2 + 1, -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2
    return np.where(x < 1, near, np.where(x < 2, far, 0))


def line_weights(size: int, middle: float, half: float, pitch: float) -> np.ndarray:
    """What each pixel of a line gives to the mass, moment and square of a window, shape (3, n).

    The window is evaluated at 24 or more places a pitch, on the interpolated line.
    """
    count = max(1, int(np.ceil(24 / pitch)))
    places = (np.arange(size * count) + 0.5) / count - 0.5
    away = places - middle
    window = np.where(np.abs(away) < half, 0.5 + 0.5 * np.cos(np.pi * away / half), 0.0)
    pixels = keys(places[:, np.newaxis] - np.arange(size)) / count
    return np.stack([window, window * away, window * away**2]) @ pixels


@pytest.mark.parametrize("pitch", [(3.0, 3.0), (6.2, 8.3), (13.0, 12.0)])
@pytest.mark.parametrize("half", [0.35, 0.6])
def test_moments_of_windows(pitch, half) -> None:
    found = windowed_moments(NOISE, PLACES, pitch, half)
    for n, place in enumerate(PLACES):
        y, x = (line_weights(*part) for part in zip(
            NOISE.shape, place, half * np.array(pitch), pitch, strict=True
        ))  # fmt: skip
        mass = y[0] @ NOISE @ x[0]
        assert found.sums[n] == pytest.approx(mass / y[0].sum() / x[0].sum(), rel=1e-5)
        first = np.array([y[1] @ NOISE @ x[0], y[0] @ NOISE @ x[1]]) / mass
        second = np.array([y[2] @ NOISE @ x[0], y[0] @ NOISE @ x[2]]) / mass
        assert found.offsets[n] == pytest.approx(first, abs=1e-5)
        assert found.variances[n] == pytest.approx(second, rel=1e-5)
    assert core_brightness(NOISE, PLACES, pitch, half) == pytest.approx(found.sums)
    # The change of the offset by a pixel's move of the window, from moves of a twentieth.
    factors = response(NOISE, PLACES, pitch, half)
    for axis in (0, 1):
        move = 0.05 * pitch[axis] * np.eye(2)[axis]
        ends = [
            windowed_moments(NOISE, PLACES + sign * move, pitch, half).offsets[:, axis]
            for sign in (1, -1)
        ]
        assert factors[axis] == pytest.approx(np.median(ends[1] - ends[0]) / (0.1 * pitch[axis]))


def test_the_middle_of_a_window() -> None:
    """Within 0.35 pitches: a micro image of that size is seen alone."""
    image = np.zeros((41, 41), np.float32)
    image[14:27, 14:27] = 5.0
    assert core_brightness(image, np.array([[20.0, 20.0]]), (10.0, 10.0)) == pytest.approx(5, 1e-6)
    assert core_brightness(image, np.array([[20.0, 20.0]]), (30.0, 30.0))[0] < 4.9
    assert raised_cosine(np.array([0.0, 1.5, -1.5, 3.0, 4.0]), 3.0) == pytest.approx(
        [1, 0.5, 0.5, 0, 0]
    )


def test_windows_end_at_the_image() -> None:
    """Their half width, rounded up, and two pixels for interpolation; dark images have no slope."""
    side = 4 + 2
    for inside, beyond in (
        ((side, 30.0), (side - 1, 30.0)), ((59 - side, 30.0), (60 - side, 30.0)),
        ((30.0, side), (30.0, side - 1)), ((30.0, 69 - side), (30.0, 70 - side)),
    ):  # fmt: skip
        windowed_moments(NOISE, np.array([inside], float), (6.0, 6.0))
        with pytest.raises(ValueError, match="beyond the image"):
            windowed_moments(NOISE, np.array([beyond], float), (6.0, 6.0))
    assert (windowed_moments(0 * NOISE, PLACES, (6.0, 6.0)).offsets == 0).all()
    # As many pixels as a window needs with the moves of `response`.
    for pitch in (3.0, 9.9, 20.0):
        margin = int(reach(pitch))
        image = np.ones((2 * margin + 1,) * 2, np.float32)
        assert (response(image, np.full((1, 2), margin), (pitch, pitch)) < 0.2).all()


@settings(max_examples=20)
@given(
    st.integers(1, 9), st.integers(1, 9), st.integers(0, 99),
    st.lists(st.floats(-15, 15), min_size=1, max_size=4),
)  # fmt: skip
def test_samples_are_linear_interpolations(rows, columns, seed, moves) -> None:
    rng = np.random.default_rng(seed)
    image = rng.uniform(0, 1, (rows, columns)).astype(np.float32)
    places, down, right = rng.uniform(-2, 11, (5, 2)), np.sort(moves), np.array([-1.5, 0.4, 3.0])
    found = np.empty((5, len(down) * 3), np.float32)
    sample(image, places, down, right, found)
    y = places[:, 0, np.newaxis, np.newaxis] + down[:, np.newaxis] + 0 * right
    x = places[:, 1, np.newaxis, np.newaxis] + 0 * down[:, np.newaxis] + right
    expected = ndimage.map_coordinates(image, [y, x], order=1, mode="nearest")
    assert found == pytest.approx(expected.reshape(5, -1), abs=1e-5)


@pytest.mark.parametrize("scale", [0.4, 1.3])
def test_smoothing_is_gaussian(scale) -> None:
    for image in (NOISE, NOISE[:3, :1]):
        expected = ndimage.gaussian_filter(image, scale, mode="nearest", truncate=4)
        assert smoothed(image, scale) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("form", ["disc", "spot"])
@pytest.mark.parametrize("pitch", [7.0, 21.0, 40.0])
def test_windows_locate_micro_images(form, pitch) -> None:
    """The centroid over the response, or the match with all, is the place of the micro image."""
    shape = (int(6.3 * pitch), int(6.6 * pitch))
    grid = regular_grid(shape, pitch, offset=(0.2, -0.3))
    image = white_image(shape, grid, shading=0.0, noise=0.0, form=form, radius=0.3)
    truth = centres_within(grid, shape)
    margin = 0.8 * pitch
    truth = truth[((truth > margin) & (truth < np.array(shape) - 1 - margin)).all(axis=1)]
    moves = np.random.default_rng(1).uniform(-0.1, 0.1, truth.shape)
    scale = (pitch, pitch)
    image = image.astype(np.float32)
    found = windowed_moments(image, truth + moves, scale)
    assert found.offsets / response(image, truth, scale) == pytest.approx(-moves, abs=0.02)
    smooth = smoothed(image, matching_scale(scale))
    assert matched_offsets(smooth, truth + moves, scale) == pytest.approx(-moves, abs=0.05)
    assert matched_offsets(smooth, truth + moves, scale, 0.85) == pytest.approx(-moves, abs=0.05)
    far = matched_offsets(smooth, truth + pitch / 2, scale)
    assert np.abs(far).max() <= pitch / 4
    assert matching_scale(scale) == pytest.approx(0.4 * max(1, pitch / 28), abs=0.021)


def test_spots_are_interpolated_profiles() -> None:
    profile, step = np.array([1.0, 0.6, 0.3, 0.0]), 1.25
    places = np.array([[0.0, 0.0], [8.4, 10.2], [4.0, 5.0], [20.0, 3.0], [3.3, 9.0]])
    levels = np.array([1.0, 0.5, 2.0, 1.0, 0.0])
    image = np.zeros((9, 11), np.float32)
    add_spots(image, places, levels, profile, step)
    away = np.linalg.norm(np.moveaxis(np.indices(image.shape), 0, -1)[:, :, None] - places, axis=-1)
    at = np.interp(away / step, np.arange(4), profile)
    assert image == pytest.approx(at @ levels, abs=1e-6)
    # The same pixels as sums of the nearest spots, and the least squares that tell the profile.
    order = np.argsort(away.reshape(-1, 5), axis=1)
    near = np.take_along_axis(away.reshape(-1, 5), order, axis=1) / step
    near = np.where(near < 3, near, np.inf)
    assert spot_values(near, levels[order], profile) == pytest.approx(image.ravel(), abs=1e-6)
    system, right = np.zeros((3, 3)), np.zeros(3)
    weights = np.random.default_rng(0).uniform(0.5, 1, near.shape[0])
    add_spot_system(near, levels[order], image.ravel().astype(float), weights, system, right)
    hats = np.stack([np.interp(away / step, np.arange(4), row) @ levels for row in np.eye(4)[:3]])
    design = hats.reshape(3, -1)
    assert system == pytest.approx(design * weights @ design.T)
    assert right == pytest.approx(design * weights @ image.ravel(), rel=1e-5)


@pytest.mark.parametrize(("pitch", "count"), [(5.0, 9), (9.3, 7), (40.0, 3)])
def test_an_image_of_spots_is_redrawn(pitch, count) -> None:
    """Of different brightness, with unlit ones, overlaps and dust."""
    rng = np.random.default_rng(9)
    places = np.stack(np.mgrid[:count, :count], axis=-1).reshape(-1, 2) * pitch + 1.2 * pitch
    places += rng.uniform(-0.4, 0.4, places.shape)
    levels = np.where(rng.random(len(places)) < 0.2, 0.0, rng.uniform(0.7, 1.2, len(places)))
    side = int((count + 1.4) * pitch)
    y, x = np.indices((side, side))
    away = np.hypot(y[..., np.newaxis] - places[:, 0], x[..., np.newaxis] - places[:, 1]) / pitch
    image = (np.exp(-0.5 * (away / 0.22) ** 2) @ levels).astype(np.float32)
    spot, step = usual_spot(image, places, levels, places[levels > 0], pitch)
    assert (len(spot) - 1) * step == pytest.approx(0.75 * pitch, abs=step)
    assert step == pytest.approx(max(0.35, pitch / 50))
    shape = np.exp(-0.5 * (np.arange(len(spot)) * step / pitch / 0.22) ** 2)
    assert spot == pytest.approx(shape, abs=0.03)
    again = redrawn(image, places, levels, levels > 0, pitch)
    assert np.abs(again - image).mean() < 0.01 * image.max()
    dusty = image.copy()
    dusty[rng.random(image.shape) < 0.02] = 3.0
    assert usual_spot(dusty, places, levels, places[levels > 0], pitch)[0] == pytest.approx(
        shape, abs=0.06
    )
    assert not redrawn(image, places, levels, levels > 9, pitch).any()
