# SPDX-License-Identifier: Apache-2.0
"""The ray model within 1e-12 of a high-precision oracle, however stiff the case."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.rays import RayModel, State, load_camera
from plenofir.camera.rays.camera import Camera, MainLens, MicroLensArray, Sensor
from plenofir_studies.ray_stability import (
    Outcome,
    _error,
    all_outcomes,
    condition_of,
    oracle_distance,
    oracle_extension,
)

GOAL = 1e-12
OUTCOMES = all_outcomes()


@pytest.mark.parametrize("outcome", OUTCOMES, ids=lambda o: f"{o.group}: {o.case}")
def test_extreme_case(outcome: Outcome) -> None:
    assert outcome.error <= GOAL, outcome


def test_the_cases_are_hard() -> None:
    """The thesis's formulas lose digits in them, so the cases are meaningful."""
    for group in ("a near 0, b_U = f_U", "planes near infinity", "far focus", "1:1 imaging"):
        worst = max(max(o.naive.values()) for o in OUTCOMES if o.group == group)
        assert worst > 1e-11, group


def test_condition_numbers_tell_hard_inputs_from_poor_formulas() -> None:
    condition = {o.case: (o.condition, o.naive) for o in OUTCOMES if o.group == "far focus"}
    for case, (number, naive) in condition.items():
        # The problem is easy; the quadratic formula makes it hard.
        assert number is not None, case
        assert number < 10, case
        assert max(naive.values()) > number * 2.0**-53, case
    near = [o.condition for o in OUTCOMES if o.group == "1:1 imaging"]
    assert near == sorted(near)
    assert near[-1] > 1e4
    assert condition_of(lambda x, y: x - y, 1.0, 0.75) == pytest.approx(7)


def log_uniform(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


cameras = st.builds(
    Camera,
    name=st.just("any"),
    main_lens=st.builds(
        MainLens,
        focal_length_mm=log_uniform(0, 4),
        principal_plane_separation_mm=st.floats(-50, 50),
        exit_pupil_mm=st.one_of(
            log_uniform(0, 4), log_uniform(5, 8).map(lambda d: -d), st.just(float("inf"))
        ),
    ),
    micro_lenses=st.builds(
        MicroLensArray, focal_length_mm=log_uniform(-2, 1), pitch_mm=log_uniform(-2, 0)
    ),
    sensor=st.builds(Sensor, pixel_pitch_mm=log_uniform(-3.3, -1.5)),
)


@given(
    cameras,
    st.floats(0, 12).map(lambda x: 10.0**x),
    st.integers(2, 99),
    st.floats(-30, 30),
    st.sampled_from([0, 1, -1]),
)
def test_any_camera(camera: Camera, beyond: float, size: int, a: float, border: int) -> None:
    lens = camera.main_lens
    f, separation = lens.focal_length_mm, lens.principal_plane_separation_mm
    focus = 4 * f + separation + beyond
    model = RayModel.focused(camera, focus, size)
    want = oracle_distance(model, oracle_extension(f, separation, focus), a, border)
    found = {1: model.near_border, 0: model.distance, -1: model.far_border}[border](a)
    front = model.image_distance_mm + separation
    if found.state() is State.INFINITY:
        assert want is None
    elif found.state() is State.BEYOND_INFINITY:
        assert want < front
    else:
        if abs(want) > 1e-6 * front:
            assert _error(float(found.mm), want) <= GOAL
        assert (found.state() is State.REAL) == (float(found.mm) > front)


def test_a_pole_behind_the_micro_lenses_is_no_pole() -> None:
    # The rays are parallel behind the micro lenses; they meet in the focal plane of the main lens.
    camera = load_camera("f193-mla2")
    model = RayModel.focused(camera, float("inf"), 13)
    lens = camera.main_lens
    pole = model.pixel_slope * lens.exit_pupil_mm / camera.micro_lenses.pitch_mm
    focal_plane = 2 * lens.focal_length_mm + lens.principal_plane_separation_mm
    assert float(model.distance(pole).mm) == pytest.approx(focal_plane, rel=1e-12)
