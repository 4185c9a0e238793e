# SPDX-License-Identifier: Apache-2.0
"""Micro lenses: thesis Table 5.1, and the thick lens against ray transfer matrices."""

import math

import mpmath as mp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.ground.errors import InputError
from plenofir_studies.micro_lens_glass import MICRO_LENS_CAUCHY
from plenofir_studies.thick_lens import ThickLens, plano_convex

focal_lengths = st.floats(0.01, 1e5)
thicknesses = st.floats(0, 1e3)
indices = st.floats(1.01, 4)


@pytest.mark.parametrize(
    ("focal_length", "radius", "sensor_distance"),
    [(1.25, 0.70325, 0.546045), (2.75, 1.54715, 2.046045)],
)
@pytest.mark.parametrize("index", [1.5626, float(MICRO_LENS_CAUCHY.index(550))])
def test_table_5_1(index, focal_length, radius, sensor_distance):
    lens = plano_convex(focal_length, 1.1, index)
    assert round(lens.front_radius_mm, 5) == radius
    assert lens.back_radius_mm == math.inf
    assert round(lens.principal_plane_separation_mm, 6) == 0.396045
    assert round(lens.sensor_distance_mm, 6) == sensor_distance
    assert lens.front_principal_plane_mm == 0
    # The other way round the sensor is f_s behind the curved vertex.
    turned = plano_convex(focal_length, 1.1, index, curved_side="back")
    assert round(-turned.back_radius_mm, 5) == radius
    assert turned.sensor_distance_mm == pytest.approx(focal_length, rel=1e-15)
    assert round(turned.principal_plane_separation_mm, 6) == 0.396045


@given(focal_lengths, thicknesses, indices, st.sampled_from(["front", "back"]))
def test_plano_convex_has_its_focal_length(focal_length, thickness, index, side):
    lens = plano_convex(focal_length, thickness, index, curved_side=side)
    assert lens.focal_length_mm == pytest.approx(focal_length, rel=1e-15)
    assert lens.principal_plane_separation_mm == pytest.approx(
        thickness * (1 - 1 / index), rel=1e-11, abs=1e-300
    )


@given(st.floats(1e-3, 10), st.floats(-10, -1e-3), st.floats(0, 0.05), indices)
def test_biconvex_lens_against_matrices(front, back, thickness, index):
    lens = ThickLens(
        front_curvature_per_mm=front,
        back_curvature_per_mm=back,
        thickness_mm=thickness,
        index=index,
    )
    with mp.workdps(50):
        n, t = mp.mpf(index), mp.mpf(thickness)
        first = mp.matrix([[1, 0], [-(n - 1) * mp.mpf(front), 1]])
        last = mp.matrix([[1, 0], [-(1 - n) * mp.mpf(back), 1]])
        m = last * mp.matrix([[1, t / n], [0, 1]]) * first
        a, c, d = m[0, 0], m[1, 0], m[1, 1]
        assert lens.focal_length_mm == pytest.approx(float(-1 / c), rel=1e-12)
        assert lens.front_principal_plane_mm == pytest.approx(float((d - 1) / c), rel=1e-12)
        assert lens.back_principal_plane_mm == pytest.approx(float((1 - a) / c), rel=1e-12)
        # From the back vertex to the focus; f_s and H_2s may nearly cancel.
        focus = float(-a / c)
        assert lens.sensor_distance_mm == pytest.approx(
            focus, rel=1e-12, abs=1e-15 * lens.focal_length_mm
        )


def test_no_power_is_an_error():
    plate = ThickLens(front_curvature_per_mm=0, back_curvature_per_mm=0, thickness_mm=1, index=1.5)
    assert plate.power_per_mm == 0
    for quantity in ("focal_length_mm", "sensor_distance_mm", "principal_plane_separation_mm"):
        with pytest.raises(InputError, match="no power"):
            getattr(plate, quantity)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ((0.0, 1.1, 1.5), "focal length"),
        ((math.inf, 1.1, 1.5), "focal length"),
        ((1.25, -1.0, 1.5), "thickness"),
        ((1.25, 1.1, 1.0), "index"),
        ((1.25, 1.1, math.nan), "index"),
    ],
)
def test_no_micro_lens(arguments, field):
    with pytest.raises(InputError, match=field):
        plano_convex(*arguments)
