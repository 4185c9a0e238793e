# SPDX-License-Identifier: Apache-2.0
"""The ray model against real rays through lenses from their prescriptions."""

from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.optics.paraxial import cardinal_points, entrance_pupil
from plenofir.camera.optics.prescription import load_prescription, shipped_lenses
from plenofir.camera.rays import Camera, RayModel, load_camera
from plenofir.ground.errors import InputError
from plenofir.ground.project import DATA
from plenofir_studies.real_rays import (
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
    # 0.35 % is what the thesis finds for its lenses; Metrogon is made for wide angles.
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
    # What the thesis finds for its lenses; Metrogon is made for wide angles, not for little blur.
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


# Stops in front of the f100 lens, by how far outside its front focal point they stand: where that
# is 0 the lens is telecentric, farther out the exit pupil lies behind the sensor.
@pytest.mark.parametrize(("outside_mm", "sign"), [(0.0, 0), (60.0, -1), (-20.0, 1)])
def test_pupils_at_infinity_and_behind_the_sensor(
    tmp_path: Path, outside_mm: float, sign: int
) -> None:
    prescription = load_prescription("f100")
    points = cardinal_points(prescription.at(550))
    front_focus = points.focal_length_mm - points.front_principal_plane_mm
    lines = []
    for line in (DATA / "lenses" / "f100.csv").read_text().splitlines()[1:]:
        radius, thickness, material, *_ = line.split(";")
        if not radius and material == "air":
            # The lens's own stop is air.
            before = lines[-1].split(";")
            before[1] = str(float(before[1]) + float(thickness))
            lines[-1] = ";".join(before)
            continue
        lines.append(line)
        if radius == "radius":
            lines.append(f";{front_focus + outside_mm!r};air;5")
    file = tmp_path / "stopped.csv"
    file.write_text("\n".join(lines))
    lens = real_camera(str(file)).camera.main_lens
    assert lens.focal_length_mm == pytest.approx(points.focal_length_mm)
    # Newton's equation: the pupils' distances from the focal points multiply to f_U^2.
    if sign:
        wanted = -(lens.focal_length_mm**2) / outside_mm
        assert lens.exit_pupil_mm == pytest.approx(wanted, rel=1e-9)
    else:
        assert lens.exit_pupil_mm == np.inf
    for extension in (0.0, 3.5):
        for border in (1, 0, -1):
            found = compare_distances(
                str(file), SETTINGS, 13, border=border, extension_mm=extension
            )
            assert np.isfinite(found.real).all()
            assert np.abs(found.deviation_percent).max() < 0.5
        cameras = compare_virtual_cameras(str(file), 6, extension_mm=extension)
        assert np.abs(cameras.deviations_percent["depths"]).max() < 0.7
        # The entrance pupil is the stop itself, the foremost surface.
        assert cameras.predicted_pupil_mm == pytest.approx(0, abs=1e-9)
        assert cameras.real_pupil_mm == pytest.approx(0, abs=0.3)


def test_telecentric_lens_equals_the_limit_of_far_pupils() -> None:
    camera = load_camera("f193-mla2")

    def model(pupil_mm: float, focus: float) -> RayModel:
        lens = camera.main_lens.model_copy(update={"exit_pupil_mm": pupil_mm})
        return RayModel.focused(camera.model_copy(update={"main_lens": lens}), focus, 13)

    for focus in (np.inf, 3000.0):
        telecentric = model(np.inf, focus)
        for far in (1e18, -1e18):
            limit = model(far, focus)
            for way in ("distance", "near_border", "far_border"):
                one, other = (getattr(m, way)(SETTINGS) for m in (telecentric, limit))
                np.testing.assert_allclose(one.mm, other.mm, rtol=1e-12)
                assert (one.states == other.states).all()
            for way in ("baseline", "tilt"):
                assert getattr(telecentric, way)(6) == pytest.approx(getattr(limit, way)(6))
            assert telecentric.entrance_pupil_mm == pytest.approx(limit.entrance_pupil_mm)
        alpha = telecentric.alpha(SETTINGS)
        np.testing.assert_allclose(telecentric.focus_setting_of_alpha(alpha), SETTINGS)
        distances = telecentric.distance(SETTINGS).mm
        np.testing.assert_allclose(telecentric.focus_setting(distances), SETTINGS)


def test_a_pupil_in_the_micro_lenses_is_refused() -> None:
    camera = load_camera("f193-mla2")
    lens = camera.main_lens.model_copy(update={"exit_pupil_mm": -13.5})
    with pytest.raises(InputError, match="exit pupil lies in the micro lenses"):
        RayModel(camera.model_copy(update={"main_lens": lens}), Decimal("13.5"), 13)


def test_without_an_exit_pupil_the_lens_is_thin() -> None:
    known = load_camera("f193-mla2").model_dump()
    del known["main_lens"]["exit_pupil_mm"]
    camera = Camera.model_validate(known)
    assert camera.main_lens.exit_pupil_mm == camera.main_lens.focal_length_mm
    assert "thin lens" in camera.thin_lens_note()
    assert load_camera("f193-mla2").thin_lens_note() == ""


def test_deviations_are_shares_of_what_was_predicted() -> None:
    planes = compare_distances("f100", SETTINGS, 13)
    assert planes.deviation_percent == pytest.approx(100 - 100 * planes.real / planes.predicted)
    # Left out: focused to infinity, objects of one and two micro lenses a view.
    views = compare_virtual_cameras("f100", 6)
    assert views.disparities.tolist() == [6.0, 12.0]
    assert views.predicted_tilt_deg == 0
    other, views = (compare_virtual_cameras("f100", gap, extension_mm=3.5) for gap in (6, -6))
    # The other view across the axis is its mirror image.
    assert other.real_tilt_deg == pytest.approx(-views.real_tilt_deg, rel=1e-12)
    wanted = {
        "pupil": views.real_pupil_mm / views.predicted_pupil_mm,
        "baseline": views.real_baseline_mm / views.predicted_baseline_mm,
        "tilt": views.real_tilt_deg / views.predicted_tilt_deg,
        "depths": views.real_depths_mm / views.predicted_depths_mm,
    }
    for name, share in wanted.items():
        assert views.deviations_percent[name] == pytest.approx(100 - 100 * share)
        assert np.abs(views.deviations_percent[name]).max() < 0.5
