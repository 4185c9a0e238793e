# SPDX-License-Identifier: Apache-2.0
"""Extensions, pupils and focal lengths against the thin lens equation in exact fractions."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from math import inf, isnan, nextafter

import numpy as np
import pytest
from test_definitions import camera, plain

from plenofir.camera.rays import (
    MeasuredPupil,
    RayModel,
    extension_of_infinity,
    lens_extension,
    measure_pupil,
    measured_focal_length,
)
from plenofir.ground.errors import InputError
from plenofir_studies.intersections import iterated_image_distance


@pytest.mark.parametrize("separation", [-33.4236, 0.0, 12.5])
def test_the_extension_solves_the_lens_equation(separation: float) -> None:
    f = Fraction(99.5045)
    for focus in (float(4 * f) + separation + 1e-6, 500.0, 1e4, 1e12):
        e = Fraction(lens_extension(99.5045, separation, focus))
        in_front = Fraction(focus) - Fraction(separation) - f - e
        assert abs(1 / (f + e) + 1 / in_front - 1 / f) < Fraction(1, 10**20) / f
        assert e < f
    assert lens_extension(99.5045, separation, inf) == 0
    for bad in (float(4 * f) + separation - 1e-6, -inf, float("nan")):
        with pytest.raises(InputError, match="nearer than the main lens can focus"):
            lens_extension(99.5045, separation, bad)


def test_steps_of_the_fixed_point_iteration() -> None:
    image, steps = 100.0, []
    for _ in range(40):
        away = 600.0 - image - 3.0
        image = away * 100.0 / (away - 100.0)
        steps.append(image)
    for limit in (1, 2, 5):
        found = iterated_image_distance(100.0, 3.0, 600.0, limit=limit)
        assert found == (pytest.approx(steps[limit - 1], rel=1e-13), limit)
    # It stops at the step that changes less than the tolerance.
    changes = [abs(b - a) / b for a, b in zip([100.0, *steps], steps, strict=False)]
    for tolerance in (1e-2, 1e-6, 1e-12):
        wanted = next(n for n, change in enumerate(changes, 1) if change <= tolerance)
        found = iterated_image_distance(100.0, 3.0, 600.0, tolerance=tolerance)
        assert found == (pytest.approx(steps[wanted - 1], rel=1e-12), wanted)
    assert iterated_image_distance(100.0, 3.0, 600.0)[1] == wanted
    assert iterated_image_distance(100.0, 3.0, inf) == (100.0, 0)
    # A plane so far away is right at once, to the last digit.
    assert iterated_image_distance(100.0, 3.0, 1e30, tolerance=0.0) == (100.0, 1)
    # Nearer than 1:1 nothing settles.
    assert iterated_image_distance(100.0, 0.0, 350.0)[1] == 100_000


@pytest.mark.parametrize("pupil", [111.0324, inf, -300.0])
@pytest.mark.parametrize("focus", [inf, 1500.0])
def test_pupils_from_pitches(pupil: float, focus: float) -> None:
    """Lines from the pupil through neighbouring micro lenses are a pitch apart on the sensor."""
    model = RayModel.focused(camera(pupil), focus, 13)
    place = model.exit_pupil_mm

    def pitch(away: float) -> float:
        return 0.125 * (1 + 2.75 / away) / 0.009

    for away in (60.0, 105.0, 300.0, -250.0):
        found = measure_pupil(model, pitch(away), 1e-4)
        assert found.distance_mm == pytest.approx(away)
        moved = [measure_pupil(model, pitch(away) + off, 0).distance_mm for off in (-1e-4, 1e-4)]
        assert found.error_mm == pytest.approx(abs(moved[1] - moved[0]) / 2, rel=1e-3)
        assert found.predicted_mm == place
        assert found.deviation_percent == pytest.approx(100 * (away / place - 1))
        other = model.camera.micro_lenses.model_copy(update={"pitch_mm": found.micro_lens_pitch_mm})
        same = replace(model, camera=model.camera.model_copy(update={"micro_lenses": other}))
        assert measure_pupil(same, pitch(away), 0).distance_mm == pytest.approx(place)
    # Three standard errors and a fortieth of the excess, on either side.
    excess, error = 2.75 / place, 1e-3
    margin = 3 * error * 0.009 / 0.125 + abs(excess) / 40
    for side in (-1, 1):
        for share, agrees in ((0.999, True), (1.001, False)):
            seen = (1 + excess + side * share * margin) * 0.125 / 0.009
            assert measure_pupil(model, seen, error).agrees == agrees


def test_pitches_of_the_same_camera() -> None:
    """Within a fifth, and that too."""
    for model, usual in ((plain(), 16.0), (plain(exit_pupil_mm=8.0), 20.0)):
        assert all(measure_pupil(model, usual * share, 0.1).distance_mm for share in (0.8, 1.2))
        for share in (0.799, 1.201):
            with pytest.raises(InputError, match=f"plain are {usual:.2f} apart; name the camera"):
                measure_pupil(model, usual * share, 0.1)
    # A pitch that is exactly the predicted one, without an error.
    assert measure_pupil(plain(), 16.0, 0.0).agrees


def test_focal_lengths_from_two_pupils() -> None:
    models = RayModel.focused(camera(), 1500.0, 13), RayModel.focused(camera(), 900.0, 13)
    extensions = [m.extension_mm for m in models]

    def pupil(distance: float, error: float) -> MeasuredPupil:
        return MeasuredPupil(distance, error, distance, 0.1, agrees=True)

    def length(first: float, second: float) -> float:
        return measured_focal_length(models[0], pupil(first, 1), models[1], pupil(second, 1))[0]

    first, second = 90.0 + extensions[0], 160.0 + extensions[1]
    found, error = measured_focal_length(
        models[0], pupil(first, 0.02), models[1], pupil(second, 0.07)
    )
    assert found == pytest.approx(120.0, rel=1e-14)
    shifts = (length(first + 0.02, second) - found, length(first, second + 0.07) - found)
    assert error == pytest.approx(np.hypot(*shifts), rel=1e-3)
    # A pupil in the focal point has none.
    for none in (extensions[0], extensions[0] - 1, extensions[0] - 1e-3, inf, -inf):
        assert isnan(length(none, second))


@pytest.mark.parametrize("pupil", [111.0324, inf, -300.0])
def test_the_extension_that_has_infinity_in_a_slice(pupil: float) -> None:
    for a in (-1.9, -0.3, 0.0, 0.1, 0.4):
        e = extension_of_infinity(camera(pupil), a)
        model = RayModel(camera(pupil), Decimal(e), 13)
        assert float(model.focus_setting(inf)) == pytest.approx(a, rel=1e-12, abs=1e-15)
    # Of pupils at P: a up to kappa P / 4 / p_M, where e is -P / 2.
    lens = plain(exit_pupil_mm=32.0).camera
    most = 32 / 256 / 4 / 0.125
    assert extension_of_infinity(lens, most) == -16.0
    for a in (nextafter(most, inf), 1.5 * most, 3 * most):
        assert isnan(extension_of_infinity(lens, a))
