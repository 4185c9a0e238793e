# SPDX-License-Identifier: Apache-2.0
"""Pictures by real rays: a tracer of its own, and what its pictures say of the closed forms."""

from math import inf

import numpy as np
import pytest

from plenofir.camera.optics.prescription import load_prescription
from plenofir_studies.lens_camera import WAVELENGTH_NM, capture, lens_camera
from plenofir_studies.lens_pictures import (
    CASES,
    FILL,
    GAP,
    Case,
    M,
    closed_form,
    deviations,
    load_recorded,
    measure,
    model_of,
    summary,
)
from plenofir_studies.tracing import trace_to_object


@pytest.mark.parametrize("lens", ["f100", "metrogon"])
def test_two_tracers_agree(lens: str) -> None:
    """Rays of any height and slope that pass, against the package's tracer."""
    rng = np.random.default_rng(7)
    heights, slopes = rng.uniform(-3, 3, 500), rng.uniform(-0.05, 0.05, 500)
    camera = lens_camera(lens, "II")
    places = np.stack([0 * heights, heights, 0 * heights])
    rays = camera.to_objects(places, np.stack([0 * slopes, slopes]))
    system = load_prescription(lens).at(WAVELENGTH_NM)
    behind = float(camera.lens.z[0])
    other = trace_to_object(system, heights, slopes, behind, clip=True)
    assert (rays.passed == other.passed).all()
    assert rays.passed.sum() > 300
    for z in (behind + system.length_mm, 1000.0):
        own, theirs = rays.at(z)[1], other.rays.at(z - behind)[:, 1]
        assert own[rays.passed] == pytest.approx(theirs[other.passed], abs=1e-9)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_paraxial_rays_are_those_of_the_closed_forms(case: Case) -> None:
    """Image distance, exit pupil, and what neighbouring lenses see."""
    model = model_of(case)
    camera = lens_camera(case.lens, case.mla, focus_mm=case.focus_mm)
    plane = model.image_distance_mm + model.camera.main_lens.principal_plane_separation_mm
    assert camera.pupil_z == pytest.approx(model.exit_pupil_mm, rel=1e-9)
    for distance in case.distances_mm:
        slope, height = (float(v) for v in model.object_ray(0.0, 0.125))
        seen = slope * (distance - plane) + height
        assert camera.object_spacing(distance) == pytest.approx(abs(seen), rel=1e-6)


def test_micro_images_are_as_wide_as_the_stop_leaves_them() -> None:
    camera = lens_camera("f100", "I").stopped(FILL)
    light = capture(camera, (3, 3), rays=16)
    pitch = light.shape[1] / 3
    share = (light.white > light.white.max() / 2).mean()
    assert 2 * pitch * np.sqrt(share / np.pi) == pytest.approx(FILL * pitch, rel=0.03)


def test_few_pictures_measure_what_the_closed_form_says() -> None:
    case = Case("f100", "II", inf, (450.0, 900.0))
    closed, real = closed_form(case), measure(case, paraxial=False, lenses=(26, 32), rays=4)
    off = deviations(real, closed)
    assert abs(off.baseline) < 0.6
    assert abs(off.by_disparity) < 0.8
    assert abs(off.by_focus) < 1.5
    assert abs(off.tilt) < 0.003


def test_recorded_pictures() -> None:
    """The closed forms are today's; measuring costs little, aberrations less at f/22."""
    recorded = load_recorded()
    assert tuple(result.case for result in recorded) == CASES
    for result in recorded:
        for name, value in vars(closed_form(result.case)).items():
            assert getattr(result.closed, name) == pytest.approx(value, rel=1e-12)
        measured = deviations(result.paraxial, result.closed)
        aberrations = deviations(result.real, result.paraxial)
        assert abs(measured.baseline) < 0.2
        assert abs(measured.by_disparity) < 0.5
        assert abs(measured.by_focus) < 2
        assert result.real != result.paraxial
        if result.case.mla == "II":
            assert abs(aberrations.by_focus) < 0.2
            assert abs(aberrations.baseline) < 0.05
    assert len(summary(recorded)) == 2 + len(CASES)
    assert M % 2 == 1
    assert GAP < M


@pytest.mark.slow
def test_pictures_are_those_recorded() -> None:
    result = load_recorded()[0]
    for paraxial, known in ((True, result.paraxial), (False, result.real)):
        found = measure(result.case, paraxial=paraxial)
        assert found.baseline_mm == pytest.approx(known.baseline_mm, rel=1e-6)
        assert found.by_focus_mm == pytest.approx(known.by_focus_mm, rel=1e-5)
        assert found.by_disparity_mm == pytest.approx(known.by_disparity_mm, rel=1e-5)
