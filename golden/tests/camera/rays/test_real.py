# SPDX-License-Identifier: Apache-2.0
"""The ray model against real rays through lenses from their prescriptions."""

import numpy as np
import pytest

from plenofir.camera.optics.paraxial import entrance_pupil
from plenofir.camera.optics.prescription import shipped_lenses
from plenofir.camera.rays import RayModel
from plenofir.camera.rays.real import (
    compare_distances,
    compare_virtual_cameras,
    real_camera,
    real_micro_image_centres,
)
from plenofir_studies.thesis_tables import load_table

SETTINGS = np.array([0.5, 1.0, 2.0, 3.0, 4.0])


@pytest.mark.parametrize("number", ["5.3", "5.4"])
def test_micro_image_centres_of_the_f100_lens(number: str) -> None:
    part = load_table(number).part("a")
    extension = part.settings["b_u_mm"] - 99.5044
    for row in part.rows:
        position = np.array([row["s_over_p_m"] * 0.125])
        found = float(real_micro_image_centres("f100", position, extension)[0])
        assert found == pytest.approx(row["simulated_mm"], abs=2e-4)


@pytest.mark.parametrize("lens", shipped_lenses())
@pytest.mark.parametrize("border", [1, 0, -1])
@pytest.mark.parametrize("extension", [0.0, 3.5])
def test_predicted_distances_of_shipped_lenses(lens: str, border: int, extension: float) -> None:
    found = compare_distances(lens, SETTINGS, 13, border=border, extension_mm=extension)
    assert np.isfinite(found.real).all()
    # 0.35 % is what the text finds for its lenses; Metrogon is made for wide angles.
    assert np.abs(found.deviation_percent).max() < (0.5 if lens == "metrogon" else 0.35)


def test_real_rays_of_the_f100_lens() -> None:
    # Distances from an independent ray tracer (optiland): micro lenses (II), M = 13, infinity.
    found = compare_distances("f100", SETTINGS[1:], 13).real
    assert found == pytest.approx([333.3431, 203.7625, 160.5408, 138.9036], abs=5e-4)


def test_small_micro_images_approach_the_paraxial_plane() -> None:
    wide = compare_distances("f100", SETTINGS, 13).deviation_percent
    narrow = compare_distances("f100", SETTINGS, 2).deviation_percent
    assert (np.abs(narrow) < np.abs(wide)).all()


def test_paraxial_data_of_the_f100_lens() -> None:
    lens = real_camera("f100").camera.main_lens
    assert lens.focal_length_mm == pytest.approx(99.5044, abs=1e-4)
    assert lens.principal_plane_separation_mm == pytest.approx(-33.4236, abs=1e-4)


@pytest.mark.parametrize("lens", shipped_lenses())
@pytest.mark.parametrize("focus", [np.inf, 3000.0, 1500.0])
def test_virtual_cameras_of_shipped_lenses(lens: str, focus: float) -> None:
    extension = RayModel.focused(real_camera(lens).camera, focus, 13).extension_mm
    per_view = (1.0, 2.0) if focus == np.inf else (0.0, 1.0, 2.0)
    found = compare_virtual_cameras(lens, 6, extension_mm=extension, per_view=per_view)
    assert (found.disparities == 6 * np.array(per_view)).all()
    # What the text finds for its lenses; Metrogon is made for wide angles, not for little blur.
    bounds = {"pupil": 0.91, "baseline": 0.138, "tilt": 0.28, "depths": 0.34}
    if lens == "metrogon":
        bounds |= {"tilt": 2.5, "depths": 2.5}
    for name, deviation in found.deviations_percent.items():
        if name == "tilt" and focus == np.inf:
            assert np.isnan(deviation)
            assert abs(found.real_tilt_deg) < 1e-3
        else:
            assert np.abs(deviation).max() < bounds[name], name


def test_virtual_cameras_next_to_the_axis() -> None:
    near = compare_virtual_cameras("f100", 1, per_view=(1.0,))
    far = compare_virtual_cameras("f100", 6, per_view=(1.0,))
    for name in ("pupil", "baseline", "depths"):
        assert np.abs(near.deviations_percent[name]) < np.abs(far.deviations_percent[name]) / 10
    # The model's pupil is the paraxial image of the stop.
    pupil = entrance_pupil(real_camera("f100").system)
    assert near.predicted_pupil_mm == pytest.approx(pupil.position_mm)


def test_stop_and_pupil_of_the_f100_lens() -> None:
    camera = real_camera("f100").camera
    assert camera.main_lens.aperture_stop_mm == pytest.approx(91.8816, abs=1e-4)
    # Views of one micro image of 13 pixels lie in the pupil, which is 34 mm wide.
    assert camera.main_lens.entrance_pupil_diameter_mm == pytest.approx(34.1424, abs=1e-4)
    assert RayModel.focused(camera, np.inf, 13).outermost_view == 52
