# SPDX-License-Identifier: Apache-2.0
"""Inspection of synthetic white images, spots and stars with known optics."""

from decimal import Decimal
from math import inf

import numpy as np
import pytest

from plenofir.camera.calibration import calibrate
from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.inspection import inspect_white, mean_micro_image
from plenofir.camera.calibration.spots import focus_score, infinity_focus, measure_spots
from plenofir.camera.rays import RayModel, extension_of_infinity, load_camera
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import (
    TexturedPlane,
    field_of_view,
    regular_grid,
    render,
    white_image,
)

F197 = load_camera("f197-mla2")


def mixed_white(radius: float, layout: str = "rectangular", pitch: float = 11.3) -> np.ndarray:
    shape = 120, 130
    grid = regular_grid(shape, pitch, rotation_degrees=0.7, layout=layout, offset=(1.2, 3.4))  # type: ignore[arg-type]
    return white_image(shape, grid, radius=radius, mixed=True)


@pytest.mark.parametrize(
    ("layout", "radius", "verdict"),
    [
        ("rectangular", 0.35, "gaps"),
        ("rectangular", 0.5, "touching"),
        # Overlaps repeat with the pitch, but half a pitch beside the lenses.
        ("rectangular", 0.75, "overlapping"),
        ("rectangular", 0.9, "overlapping"),
        ("hexagonal-rows", 0.42, "gaps"),
    ],
)
def test_aperture(layout: str, radius: float, verdict: str) -> None:
    fill = inspect_white(mixed_white(radius, layout)).fill
    assert fill.verdict == verdict
    if verdict == "gaps":
        assert fill.diameter == pytest.approx(2 * radius, abs=0.035)
        cell = 1.0 if layout == "rectangular" else np.sqrt(0.75)
        assert fill.share == pytest.approx(np.pi * radius**2 / cell, rel=0.1)
        assert fill.stops_to_touch == pytest.approx(-2 * np.log2(2 * radius), abs=0.2)


@pytest.mark.parametrize(
    ("layout", "radius", "pitch"),
    [
        # Overlaps repeat at 1 / sqrt 2 of the pitch, turned by 45 degrees, and at half the pitch.
        ("rectangular", 0.6, 11.3),
        ("rectangular", 0.6, 8.2),
        ("hexagonal-rows", 0.53, 11.3),
    ],
)
def test_overlaps_are_no_micro_images(layout: str, radius: float, pitch: float) -> None:
    with pytest.raises(InputError, match="micro images overlap"):
        calibrate(mixed_white(radius, layout, pitch))


def test_a_scene_is_no_white_image() -> None:
    model = RayModel.focused(F197, inf, 11)
    distance = float(model.distance(0.1).mm)
    texture = np.kron(np.random.default_rng(4).random((9, 9)), np.ones((8, 8)))
    plane = TexturedPlane(texture, distance, field_of_view(model, distance, 30))
    capture = render(model, [plane], (18, 22), radius=0.45)
    assert inspect_white(capture.white).unevenness < 0.01
    with pytest.raises(InputError, match="white image"):
        inspect_white(capture.raw)


def spots_at(radius: float, seed: int) -> np.ndarray:
    shape = 110, 120
    grid = regular_grid(shape, 14.2, rotation_degrees=0.4, offset=(2.0, 1.0))
    return white_image(shape, grid, form="spot", radius=radius, noise=0.01, seed=seed)


def test_micro_lenses_in_focus() -> None:
    # Radius in pitches: 0.1 in focus at 0.23 mm, and a cone of f/22 for pitches of 0.125 mm.
    positions = (-1.0, -0.4, 0.2, 1.3)
    spots = []
    for seed, position in enumerate(positions):
        image = spots_at(np.hypot(0.1, (position - 0.23) / 22 / 0.125 / 4), seed)
        spots.append(measure_spots(grey(image), calibrate(image), position))
    score = focus_score(spots[::-1])
    assert score.best is not None
    assert score.best.error is not None
    print(score.best, score.sides)
    assert score.best.bracketed
    assert abs(score.best.position - 0.23) < max(0.02, 4 * score.best.error)
    assert score.best.error < 0.05
    assert min(score.spots, key=lambda one: one.radius).position == 0.2
    for side in score.sides.values():
        assert side is not None
        assert abs(side.position - 0.23) < 0.05


@pytest.mark.parametrize("extension", [0.0, -8.0])
def test_main_lens_at_infinity(extension: float) -> None:
    model = RayModel(F197, Decimal(extension), 13)
    star = TexturedPlane(np.ones((2, 2)), 1e7, 3000.0)
    capture = render(model, [star], (16, 18), radius=0.45, noise=0.002)
    found = inspect_white(capture.white)
    diameter = found.fill.diameter * found.calibration.grid.lens_pitch
    state = infinity_focus(capture.raw, found.calibration, diameter)
    wanted = float(model.focus_setting(inf))
    print(extension, wanted, state)
    assert state.in_focus == (extension == 0)
    assert state.a == pytest.approx(wanted, abs=max(state.resolution, 3 * state.error))
    assert extension_of_infinity(F197, wanted) == pytest.approx(extension, abs=1e-9)


def test_pictures_without_spots_and_stars() -> None:
    white = mixed_white(0.4)
    found = calibrate(white)
    nothing = np.zeros(found.lenses, dtype=bool)
    with pytest.raises(InputError, match=r"spots.png: shows no whole micro image"):
        mean_micro_image(grey(white), found, nothing, where="spots.png")
    for picture, message in (
        (white, "light everywhere"),
        (np.full_like(white, 9), "no light that stands out"),
        (white[:100], "130 x 100 pixels"),
    ):
        with pytest.raises(InputError, match=message):
            infinity_focus(picture, found, 9.0, where="star.png")
