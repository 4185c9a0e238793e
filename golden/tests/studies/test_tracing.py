# SPDX-License-Identifier: Apache-2.0
"""Real rays: an oracle of 40 digits, lost rays, and the thesis's simulation of f100."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plenofir.camera.optics import (
    AIR,
    Constant,
    Glass,
    Prescription,
    Surface,
    cardinal_points,
    exit_pupil,
    load_prescription,
    shipped_lenses,
)
from plenofir.ground.errors import InputError
from plenofir_studies.chief_rays import chief_rays, micro_image_centres
from plenofir_studies.tracing import (
    Rays,
    RayState,
    intersect,
    meridional_rays,
    refocused_planes,
    trace,
    trace_to_object,
)

GLASS = Glass(name="glass", dispersion=Constant(value=1.5))
PITCH = 0.125  # p_M, mm
KAPPA = 0.009 / 2.75  # p_p / f_s with micro lens (II)


def lens_of(*surfaces, semi_aperture=5.0):
    """Surfaces as (curvature, thickness, glass)."""
    return Prescription(
        name="made",
        surfaces=tuple(
            Surface(curvature_per_mm=c, thickness_mm=t, glass=glass, semi_aperture_mm=semi_aperture)
            for c, t, glass in surfaces
        ),
    ).at(550)


# An oracle that squares the radius needs one that is not astronomical.
curvatures = st.sampled_from([0.0, 1e-9, -1e-9]) | st.floats(-0.05, 0.05).map(
    lambda c: c if abs(c) > 1e-10 else 0.0
)


@st.composite
def systems(draw):
    surfaces = []
    for _ in range(draw(st.integers(1, 5))):
        index = draw(st.sampled_from([1.0, 1.33, 1.5, 1.500001, 1.9]))
        surfaces.append(
            (
                draw(curvatures),
                draw(st.floats(0.1, 20)),
                Glass(name=f"n{index}", dispersion=Constant(value=index)),
            )
        )
    surfaces.append((draw(curvatures), 0.0, AIR))
    return lens_of(*surfaces)


def oracle_trace(system, point, direction):
    """Points on the surfaces and the last direction, in 40 digits; None when the ray is lost."""
    # Written from the sphere's equation and the angles, unlike the code.
    p = [mp.mpf(float(v)) for v in point]
    d = [mp.mpf(float(v)) for v in direction]
    length = mp.sqrt(mp.fsum(v * v for v in d))
    d = [v / length for v in d]
    z, points = mp.mpf(0), []
    for k, curvature in enumerate(system.curvatures):
        if k > 0:
            z += mp.mpf(float(system.gaps[k - 1]))
        before, behind = (mp.mpf(float(system.indices[i])) for i in (k, k + 1))
        if curvature == 0:
            t = (z - p[2]) / d[2]
            normal = [mp.mpf(0), mp.mpf(0), mp.mpf(1)]
        else:
            radius = 1 / mp.mpf(float(curvature))
            from_centre = [p[0], p[1], p[2] - z - radius]
            half = mp.fsum(a * b for a, b in zip(from_centre, d, strict=True))
            squared = half**2 - mp.fsum(v * v for v in from_centre) + radius**2
            if squared < 0:
                return None
            # Of the two intersections the one on the vertex's half.
            t = -half - mp.sign(radius) * mp.sqrt(squared)
            on = [a + t * b for a, b in zip(from_centre, d, strict=True)]
            normal = [-v / radius for v in on]
            if normal[2] <= 0:
                return None
        p = [a + t * b for a, b in zip(p, d, strict=True)]
        points.append([+v for v in p])
        cosine = mp.fsum(a * b for a, b in zip(d, normal, strict=True))
        across = [a - cosine * b for a, b in zip(d, normal, strict=True)]
        bent = [v * before / behind for v in across]
        sine_squared = mp.fsum(v * v for v in bent)
        if cosine <= 0 or sine_squared > 1:
            return None
        d = [a + mp.sqrt(1 - sine_squared) * b for a, b in zip(bent, normal, strict=True)]
    return points, d


@settings(max_examples=60)
@given(
    systems(),
    st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-50, 0)),
    st.tuples(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15)),
)
def test_rays_against_oracle(system, point, slopes):
    direction = np.array([*slopes, 1.0])
    direction /= np.linalg.norm(direction)
    got = trace(system, Rays(np.array([point]), direction[np.newaxis]))
    with mp.workdps(40):
        want = oracle_trace(system, point, direction)
    if want is None:
        assert not got.passed[0]
        return
    assert got.passed[0]
    points, last = want
    assert got.points[:, 0] == pytest.approx(np.array(points, dtype=float), abs=1e-11, rel=1e-11)
    assert got.rays.directions[0] == pytest.approx(np.array(last, dtype=float), abs=1e-12)


@given(systems(), st.floats(-4, 4), st.floats(-0.15, 0.15))
def test_light_goes_back_the_same_way(system, height, slope):
    there = trace(system, meridional_rays(height, slope))
    if not there.passed[0]:
        return
    end = system.length_mm
    point, direction = there.rays.points[0].copy(), there.rays.directions[0]
    point[2] = end - point[2]
    back = trace(system.reversed(), Rays(point[np.newaxis], (direction * [-1, -1, 1])[np.newaxis]))
    assert back.passed[0]
    assert -back.rays.slopes[0, 1] == pytest.approx(slope, abs=1e-9)
    # Reversed, z counts from the other end.
    assert back.rays.at(end)[0, 1] == pytest.approx(height, abs=1e-9)


@pytest.mark.parametrize("name", shipped_lenses())
def test_rays_near_the_axis_are_paraxial(name):
    system = load_prescription(name).at(550)
    points = cardinal_points(system)
    ray = trace(system, meridional_rays(1e-4, 0.0)).rays
    z = system.length_mm + points.back_focal_distance_mm
    assert ray.slopes[0, 1] == pytest.approx(-1e-4 / points.focal_length_mm, rel=1e-9)
    assert ray.at(z)[0, 1] == pytest.approx(0, abs=1e-12)


def test_states_of_lost_rays():
    # Rays beside the sphere miss it; the last one that meets it cannot leave the plane side.
    dome = lens_of((1 / 10, 5, GLASS), (0.0, 0, AIR), semi_aperture=3.0)
    heights = np.array([0.0, 2.0, 4.0, 9.99, 10.01, -11.0])
    got = trace(dome, meridional_rays(heights, 0.0, -3.0))
    fates = [RayState.PASSED] * 3 + [RayState.TOTAL_REFLECTION] + [RayState.MISSED] * 2
    assert got.states.tolist() == fates
    assert got.lost_at.tolist() == [-1, -1, -1, 1, 0, 0]
    clipped = trace(dome, meridional_rays(heights, 0.0, -3.0), clip=True)
    assert list(clipped.states[:4]) == [RayState.PASSED] * 2 + [RayState.VIGNETTED] * 2
    for trace_ in (got, clipped):
        for values in (trace_.rays.points, trace_.rays.directions):
            assert np.array_equal(np.isfinite(values).all(axis=1), trace_.passed)
            assert np.array_equal(np.isnan(values).any(axis=1), ~trace_.passed)

    # A steep ray that meets the sphere behind its equator does not meet the lens's surface.
    steep = trace(dome, meridional_rays(-20.0, [10.0, 2.0], [12.0, -2.0]))
    assert (steep.states[0], steep.lost_at[0]) == (RayState.MISSED, 0)
    assert steep.states[1] != RayState.MISSED

    # Out of glass through a plane the limit is sin I = 1 / 1.5.
    plate = lens_of((0.0, 5, GLASS), (0.0, 0, AIR))
    inside = plate.section(1, 1)
    limit = np.tan(np.arcsin(1 / 1.5))
    got = trace(inside, meridional_rays(0.0, [limit * (1 - 1e-9), limit * (1 + 1e-9)]))
    assert list(got.states) == [RayState.PASSED, RayState.TOTAL_REFLECTION]
    assert list(got.lost_at) == [-1, 0]
    # The point where it happened is known, the ray behind it is not.
    assert np.isfinite(got.points[0, 1]).all()
    assert np.isnan(got.rays.directions[1]).all()


def test_rays_across_or_against_the_axis_are_named():
    plate = lens_of((0.02, 5, GLASS), (0.0, 0, AIR))
    directions = np.array([[0, 1.0, 0], [0, 0, -1.0], [np.nan] * 3, [0, 1.0, 1e-300]])
    with np.errstate(all="raise"):
        got = trace(plate, Rays(np.tile([0.0, 1.0, -5.0], (4, 1)), directions))
    assert list(got.states) == [RayState.MISSED] * 4
    with pytest.raises(InputError, match="finite"):
        meridional_rays([0.0, np.inf], 0.0)


def test_intersections_by_hand():
    def rays(points, directions):
        d = np.array(directions, dtype=float)
        return Rays(np.array(points, dtype=float), d / np.linalg.norm(d, axis=1, keepdims=True))

    first = rays(
        [[0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, 0], [np.nan, 0, 0]],
        [[0, -1, 4], [0, 0, 1], [0, 1, 4], [0, 0, 1], [0, 0, 1]],
    )
    second = rays(
        [[0, -1, 0], [0, -1, 0], [0, -1, 0], [1, 3, 7], [0, 0, 0]],
        [[0, 1, 4], [0, 0, 1], [0, -1, 4], [1, 0, 0], [0, 0, 1]],
    )
    got = intersect(first, second)
    # Meeting, parallel, meeting backwards, crossing 3 mm apart, lost.
    assert list(got.real) == [True, False, False, False, False]
    assert list(got.parallel) == [False, True, False, False, False]
    assert list(got.behind) == [False, False, True, True, False]
    assert list(got.lost) == [False, False, False, False, True]
    assert got.points[[0, 2, 3]] == pytest.approx(
        np.array([[0, 0, 4], [0, 0, -4], [0, 1.5, 7]]), abs=1e-14
    )
    assert got.gaps_mm[[0, 2, 3]] == pytest.approx([0, 0, 3], abs=1e-14)
    assert np.isnan(got.points[[1, 4]]).all()


def moved(focal_length, image_distance):
    """b_U with the lens moved: what Table 5.4 (focus at 3 m) adds to infinity focus."""
    return image_distance - focal_length


@pytest.mark.parametrize(
    ("b_u", "simulated"),
    [
        # Tables 5.3 (a) and 5.4 (a): s / p_M = 14, 28, 56, micro lens (II).
        (99.5044, [1.7945, 3.5890, 7.1773]),
        (103.0019, [1.7931, 3.5862, 7.1718]),
    ],
)
def test_micro_image_centres_of_f100(b_u, simulated):
    system = load_prescription("f100").at(550)
    image_distance = system.image_distance_mm + moved(99.5044, b_u)
    got = micro_image_centres(system, PITCH * np.array([14, 28, 56]), image_distance, 2.75)
    assert np.all(got.states == RayState.PASSED)
    assert got.positions_mm == pytest.approx(simulated, abs=2e-4)


def paraxial_distances(system, settings_a, half_views=6):
    """d_a of the ray model at infinity focus, from the cardinal points, M = 13."""
    points = cardinal_points(system)
    focal_length = points.focal_length_mm
    exit_distance = points.back_focal_distance_mm - exit_pupil(system).position_mm
    a = np.asarray(settings_a, dtype=float)
    heights = half_views * a * PITCH
    slopes = -heights / exit_distance + half_views * KAPPA
    # The pair meets on the axis at b_U' from the image-side principal plane.
    b = focal_length + heights / slopes
    object_distance = focal_length * b / (b - focal_length)
    return focal_length + points.principal_plane_separation_mm + object_distance, heights, slopes


def test_refocused_planes_of_f100():
    system = load_prescription("f100").at(550)
    predicted, heights, slopes = paraxial_distances(system, [1, 2, 3, 4])
    focus = cardinal_points(system).back_focal_distance_mm
    got = refocused_planes(system, (heights, slopes), (-heights, -slopes), focus)
    assert got.meetings.real.all()
    # Another ray tracer with the same lens gave the first of these; it was set up by hand.
    assert got.distances_mm == pytest.approx([333.3431, 203.7625, 160.5408, 138.9036], abs=3e-4)
    assert predicted == pytest.approx([333.3863, 203.7715, 160.5666, 138.9641], abs=4e-4)
    deviation = 100 * (predicted / got.distances_mm - 1)
    assert deviation == pytest.approx([0.013, 0.0044, 0.016, 0.0436], abs=5e-4)


@pytest.mark.parametrize("name", shipped_lenses())
def test_prediction_deviates_less_than_the_thesis_says(name):
    # Section 5.2.2: below 0.35 %.
    system = load_prescription(name).at(550)
    predicted, heights, slopes = paraxial_distances(system, [1, 2, 3, 4])
    focus = cardinal_points(system).back_focal_distance_mm
    got = refocused_planes(system, (heights, slopes), (-heights, -slopes), focus)
    assert got.meetings.real.all()
    assert np.all(np.abs(predicted / got.distances_mm - 1) < 0.0035)
    # Closer to the axis there is no aberration left.
    near = refocused_planes(
        system, (1e-3 * heights, 1e-3 * slopes), (-1e-3 * heights, -1e-3 * slopes), focus
    )
    assert near.distances_mm == pytest.approx(predicted, rel=1e-7)


def test_rays_that_meet_inside_the_lens_or_never():
    system = load_prescription("f100").at(550)
    focus = cardinal_points(system).back_focal_distance_mm
    plate = lens_of((0.0, 5, GLASS), (0.0, 0, AIR))
    never = refocused_planes(plate, (1.0, 0.1), (-1.0, 0.1), 20.0)
    assert never.meetings.parallel.tolist() == [True]
    assert np.isnan(never.distances_mm).all()
    # Pairs that diverge towards the object beyond infinity focus.
    beyond = refocused_planes(system, (0.75, -0.001), (-0.75, 0.001), focus + 1)
    assert beyond.meetings.real.tolist() == [True]
    _, heights, slopes = paraxial_distances(system, [-1])
    virtual = refocused_planes(system, (heights, slopes), (-heights, -slopes), focus)
    assert virtual.meetings.behind.tolist() == [True]
    assert virtual.meetings.real.tolist() == [False]
    lost = refocused_planes(system, (0.0, 5.0), (0.0, -5.0), focus)
    assert lost.meetings.lost.tolist() == [True]


@pytest.mark.parametrize("name", shipped_lenses())
def test_chief_rays_go_through_the_middle_of_the_stop(name):
    system = load_prescription(name).at(550)
    heights = np.array([-7.0, -0.125, 0.0, 1e-6, 1.75, 7.0, 15.0])
    rays = chief_rays(system, heights, system.image_distance_mm)
    assert rays.passed.all()
    # Send them through the whole lens from the object side; their frame looks the other way.
    points = rays.object_rays.points * [1, 1, -1]
    directions = rays.object_rays.directions * [-1, -1, 1]
    whole = trace(system, Rays(points, directions))
    assert whole.passed.all()
    assert whole.points[system.stop, :, 1] == pytest.approx(0, abs=1e-11)
    z = system.length_mm + system.image_distance_mm
    assert whole.rays.at(z)[:, 1] == pytest.approx(heights, rel=1e-10, abs=1e-14)
    assert whole.rays.slopes[:, 1] == pytest.approx(rays.image_slopes, rel=1e-10, abs=1e-14)
    # Close to the axis they come from the exit pupil.
    pupil = system.image_distance_mm - exit_pupil(system).position_mm
    assert rays.image_slopes[3] == pytest.approx(1e-6 / pupil, rel=1e-9)


def test_heights_that_no_chief_ray_reaches_are_named():
    system = load_prescription("f100").at(550)
    got = chief_rays(system, [1.0, 1e5], system.image_distance_mm)
    assert got.states.tolist() == [RayState.PASSED, RayState.NOT_AIMED]
    assert np.isnan(got.image_slopes[1])
    assert np.isnan(got.object_rays.points[1]).all()
    centres = micro_image_centres(system, [1.0, 1e5], system.image_distance_mm, 2.75)
    assert np.isfinite(centres.positions_mm).tolist() == [True, False]
    with pytest.raises(InputError, match="finite"):
        chief_rays(system, [np.nan], system.image_distance_mm)
    with pytest.raises(InputError, match="no aperture stop"):
        chief_rays(lens_of((0.02, 5, GLASS), (0.0, 0, AIR)), [1.0], 50.0)


def test_trace_to_object_uses_the_sensor_frame():
    system = load_prescription("f100").at(550)
    focus = cardinal_points(system).back_focal_distance_mm
    # From the focus on the axis: parallel to it in object space (but for aberration).
    got = trace_to_object(system, 0.0, [1e-5, -1e-5], focus)
    assert got.rays.slopes[:, 1] == pytest.approx([0, 0], abs=1e-12)
    assert got.rays.points[:, 1] == pytest.approx(
        np.array([1e-5, -1e-5]) * cardinal_points(system).focal_length_mm, rel=1e-7
    )
