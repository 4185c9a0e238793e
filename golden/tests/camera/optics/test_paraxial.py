# SPDX-License-Identifier: Apache-2.0
"""Paraxial optics: the thesis's lens, an oracle of 50 digits, and lenses without focus or pupil."""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.optics import (
    AIR,
    Constant,
    Glass,
    Prescription,
    Surface,
    cardinal_points,
    entrance_pupil,
    exit_pupil,
    is_afocal,
    load_prescription,
    paraxial_properties,
    shipped_lenses,
)
from plenofir.ground.errors import InputError

GLASS = Glass(name="glass", dispersion=Constant(value=1.5))


def lens_of(*surfaces):
    """Surfaces as (curvature, thickness, glass, stop)."""
    return Prescription(
        name="made",
        surfaces=tuple(
            Surface(curvature_per_mm=c, thickness_mm=t, glass=glass, semi_aperture_mm=5, stop=stop)
            for c, t, glass, stop in surfaces
        ),
    )


def stop_at(thickness):
    return (0.0, thickness, AIR, True)


def oracle_matrix(system, first=0, last=None, *, up_to_vertex=False):
    """Ray transfer matrix of 50 digits from vertex `first` to `last`."""
    last = len(system.curvatures) - 1 if last is None else last
    m = mp.eye(2)
    for k in range(first, last + 1):
        if k > first:
            gap = mp.mpf(float(system.gaps[k - 1])) / mp.mpf(float(system.indices[k]))
            m = mp.matrix([[1, gap], [0, 1]]) * m
        if k == last and up_to_vertex:
            break
        step = mp.mpf(float(system.indices[k + 1])) - mp.mpf(float(system.indices[k]))
        m = mp.matrix([[1, 0], [-step * mp.mpf(float(system.curvatures[k])), 1]]) * m
    return m


def assert_matches_oracle(system, rel):
    with mp.workdps(50):
        m = oracle_matrix(system)
        a, c, d = m[0, 0], m[1, 0], m[1, 1]
        front, back = (d - 1) / c, (1 - a) / c
        length = mp.fsum(mp.mpf(float(g)) for g in system.gaps)
        want = {
            "focal_length_mm": -1 / c,
            "front_focal_point_mm": d / c,
            "back_focal_distance_mm": -a / c,
            "front_principal_plane_mm": front,
            "back_principal_plane_mm": back,
            "principal_plane_separation_mm": length + back - front,
        }
    points = cardinal_points(system)
    for name, value in want.items():
        assert getattr(points, name) == pytest.approx(float(value), rel=rel), name


def test_f100():
    system = load_prescription("f100").at(550)
    points = cardinal_points(system)
    # Fig. 5.2 and Table 5.2; H1H2 as it follows from the thesis's distances.
    assert points.focal_length_mm == pytest.approx(99.5044, abs=6e-5)
    assert points.principal_plane_separation_mm == pytest.approx(-33.4236, abs=6e-5)
    # From the prescription's image plane and from the paraxial focus; the thesis prints 108.1293.
    pupil = exit_pupil(system)
    assert system.image_distance_mm - pupil.position_mm == pytest.approx(108.1239, abs=6e-5)
    assert points.back_focal_distance_mm - pupil.position_mm == pytest.approx(108.2937, abs=1e-4)
    assert entrance_pupil(system).position_mm == pytest.approx(59.0015, abs=1e-4)
    assert points.back_focal_distance_mm == pytest.approx(57.4843, abs=1e-4)


@pytest.mark.parametrize("name", shipped_lenses())
@pytest.mark.parametrize("factor", [1e-3, 1, 1e3])
def test_shipped_lenses_against_oracle(name, factor):
    system = load_prescription(name).scaled(factor).at(550)
    assert_matches_oracle(system, 1e-12)


@pytest.mark.parametrize("name", shipped_lenses())
def test_pupils_against_oracle(name):
    system = load_prescription(name).at(550)
    with mp.workdps(50):
        front = oracle_matrix(system, 0, system.stop, up_to_vertex=True)
        behind = oracle_matrix(system, system.stop)
        want_in, want_out = front[0, 1] / front[0, 0], -behind[0, 1] / behind[1, 1]
        scale_in, scale_out = 1 / front[0, 0], 1 / behind[1, 1]
    entrance, exit_ = entrance_pupil(system), exit_pupil(system)
    assert entrance.position_mm == pytest.approx(float(want_in), rel=1e-12)
    assert exit_.position_mm == pytest.approx(float(want_out), rel=1e-12)
    assert entrance.magnification == pytest.approx(float(scale_in), rel=1e-12)
    assert exit_.magnification == pytest.approx(float(scale_out), rel=1e-12)
    radius = float(system.semi_apertures[system.stop])
    assert exit_.semi_diameter_mm == pytest.approx(float(abs(scale_out)) * radius, rel=1e-12)


@given(st.floats(1e3, 1e7), st.floats(0.1, 10), st.floats(0.2, 0.8))
def test_principal_planes_of_a_weak_thin_lens(focal_length, thickness, share):
    # The principal planes lie in a lens 1e8 times thinner than its focal length.
    power = 1 / focal_length
    front, back = 2 * power * share, -2 * power * (1 - share)
    system = lens_of((front, thickness, GLASS, False), (back, 0, AIR, False)).at(550)
    assert_matches_oracle(system, 1e-12)


@pytest.mark.parametrize("curvature", [0.0, 0.02])
def test_plane_surfaces_and_a_plane_plate(curvature):
    # f = 1 / ((n - 1) c); a plane plate in front changes nothing but the position.
    system = lens_of(
        (0.0, 3, GLASS, False),
        (0.0, 2, AIR, False),
        (curvature, 4, GLASS, False),
        (0.0, 0, AIR, False),
    ).at(550)
    assert is_afocal(system) == (curvature == 0)
    if curvature:
        points = cardinal_points(system)
        assert points.focal_length_mm == pytest.approx(100, rel=1e-15)
        # H_2 lies t / n in front of the back vertex; H_1 appears t (1 - 1 / n) in front of
        # the curved vertex because of the plate.
        assert points.back_principal_plane_mm == pytest.approx(-4 / 1.5, rel=1e-14)
        assert points.front_principal_plane_mm == pytest.approx(5 - 3 * (1 - 1 / 1.5), rel=1e-14)
    else:
        with pytest.raises(InputError, match="made: is afocal"):
            cardinal_points(system)


def test_telescope_is_named_afocal():
    # Two plano-convex lenses of 100 and 30 mm, focal points together.
    objective, eyepiece = 1 / 50, -1 / 15
    system = lens_of(
        (objective, 0, GLASS, False),
        (0.0, 130, AIR, False),
        (0.0, 0, GLASS, False),
        (eyepiece, 0, AIR, False),
    ).at(550)
    assert is_afocal(system)
    with pytest.raises(InputError, match="afocal"):
        cardinal_points(system)


@given(st.floats(5, 500), st.floats(-0.95, 0.95))
def test_exit_pupil_of_a_stop_before_a_thin_lens(focal_length, part):
    # The stop inside the focal length is a virtual image: 1/x = 1/f - 1/t.
    before = focal_length * (1 + part) / 2
    curvature = 1 / (focal_length * 0.5)
    system = lens_of(stop_at(before), (curvature, 0, GLASS, False), (0.0, 0, AIR, False)).at(550)
    pupil = exit_pupil(system)
    want = 1 / (1 / focal_length - 1 / before)
    assert pupil.position_mm == pytest.approx(want, rel=1e-12)
    assert pupil.magnification == pytest.approx(-want / before, rel=1e-12)
    assert entrance_pupil(system).position_mm == 0
    assert entrance_pupil(system).semi_diameter_mm == 5
    # Behind the lens instead, the pupils change places.
    turned = lens_of((0.0, 0, GLASS, False), (-curvature, before, AIR, False), stop_at(0)).at(550)
    assert entrance_pupil(turned).position_mm == pytest.approx(-want, rel=1e-12)
    assert exit_pupil(turned).position_mm == 0


def test_telecentric_pupils_are_named():
    telecentric = lens_of(stop_at(100), (0.02, 0, GLASS, False), (0.0, 0, AIR, False)).at(550)
    assert exit_pupil(telecentric).position_mm == -np.inf
    turned = lens_of((0.0, 0, GLASS, False), (-0.02, 100, AIR, False), stop_at(0)).at(550)
    with pytest.raises(InputError, match="entrance pupil is at infinity"):
        entrance_pupil(turned)


def test_no_stop_no_pupil():
    system = lens_of((0.02, 4, GLASS, False), (0.0, 0, AIR, False)).at(550)
    for pupil in (entrance_pupil, exit_pupil):
        with pytest.raises(InputError, match="no aperture stop"):
            pupil(system)


def test_properties_by_name():
    properties = paraxial_properties(load_prescription("f100"), 550)
    assert properties["focal_length_mm"] == pytest.approx(99.5044, abs=6e-5)
    assert properties["exit_pupil_distance_mm"] == pytest.approx(108.2937, abs=1e-4)
    # From the stop's surface to the last one, and to the focal plane.
    behind = 12.4281291 + 3.77696589 + 10.8339285 + 0.5 + 6.85817491
    assert properties["aperture_stop_distance_mm"] == pytest.approx(
        behind + properties["back_focal_distance_mm"]
    )
    plate = paraxial_properties(lens_of((0.0, 3, GLASS, False), (0.0, 0, AIR, False)))
    assert all(value is None for value in plate.values())
    no_stop = paraxial_properties(lens_of((0.02, 3, GLASS, False), (0.0, 0, AIR, False)))
    assert no_stop["focal_length_mm"] == pytest.approx(100, rel=1e-14)
    assert no_stop["exit_pupil_mm"] is None
    assert no_stop["exit_pupil_distance_mm"] is None
    assert no_stop["aperture_stop_distance_mm"] is None
    assert all(value is None or math.isfinite(value) for value in no_stop.values())
