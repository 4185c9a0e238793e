# SPDX-License-Identifier: Apache-2.0
"""`plenofir design`: figures of a camera, each against its definition or real rays."""

import csv
import json
from fractions import Fraction
from math import atan, degrees, inf
from pathlib import Path

import pytest
from in_process import plenofir

from plenofir.camera.design import design
from plenofir.camera.design.figures import depth_error, lens_sample, resolved_step
from plenofir.camera.rays import RayModel, camera_of, covering_slices, load_camera
from plenofir.ground.errors import InputError

F193 = load_camera("f193-mla2")
# A thin lens: all of its figures are simple.
THIN = camera_of(
    None,
    {
        "focal_length": 50,
        "lens_focal_length": 1.0,
        "lens_pitch": 0.05,
        "pixel": 0.005,
        "pupil": 2.0,
        "columns": 3280,
        "rows": 2464,
    },
)


def figures(model: RayModel, *words: float) -> dict[str, float | int | None]:
    return {f.name: f.value for f in design(model, *words).figures}


def test_figures_of_a_thin_lens() -> None:
    found = figures(RayModel.focused(THIN, inf, 9), 300.0)
    # The pitch of micro images is that of chief rays from the lens, 50 mm away.
    pitch = 0.05 * (1 + 1 / 50)
    assert found["micro_image_pitch_px"] == pytest.approx(pitch / 0.005)
    assert found["pixels_per_lens"] == 10
    assert found["micro_lens_f_number"] == 20
    # The image of the pupil by a micro lens is D f_s / d_A' wide.
    assert found["matched_pupil_mm"] == pytest.approx(pitch * 50 / 1)
    assert found["matched_f_number"] == pytest.approx(50 / (pitch * 50))
    assert found["f_number"] == 25
    assert found["micro_image_fill"] == pytest.approx(2.0 / (pitch * 50))
    assert found["view_columns"] == int(3280 * 0.005 / pitch)
    assert found["raster_rows"] == 9 * int(2464 * 0.005 / pitch)
    half = 3280 * 0.005 / 2 / (1 + 1 / 50)
    assert found["field_of_view_x_deg"] == pytest.approx(2 * degrees(atan(half / 50)))
    assert found["rayleigh_limit_um"] == pytest.approx(1.22 * 0.55 * 20)
    # At infinity focus a view is p_p / f_s times f_U from the next; 8 views are 2 mm, the pupil.
    assert found["baseline_1_mm"] == pytest.approx(0.005 / 1 * 50)
    assert found["baseline_mm"] == pytest.approx(8 * 0.25)
    assert found["a_far"] == 0


def test_matched_pupil_just_fills_the_micro_images() -> None:
    for camera, focus in ((F193, inf), (F193, 1500.0), (load_camera("f90-mla2"), 3000.0)):
        model = RayModel.focused(camera, focus, 13)
        found = figures(model, 500.0, 5000.0)
        m = found["micro_image_pitch_px"]
        assert m is not None
        # The outermost views stand at the rim of that pupil.
        assert found["matched_pupil_mm"] == pytest.approx(2 * abs(model.virtual_camera(m / 2)))
        assert found["matched_f_number"] == pytest.approx(
            camera.main_lens.focal_length_mm / found["matched_pupil_mm"]
        )


def test_lens_sample_is_what_the_field_of_view_shares() -> None:
    model = RayModel.focused(THIN, inf, 9)
    for distance in (300.0, 1000.0, 1e5):
        seen = lens_sample(model, distance)
        # Through the middle of the lens, 50 mm from the micro lenses.
        assert seen == pytest.approx(0.05 / 50 * (distance - 50))


def test_depth_error_is_the_slope_of_the_distance() -> None:
    model = RayModel.focused(F193, 1500.0, 13)
    for distance in (500.0, 1500.0, 4000.0):
        z = distance - model.entrance_pupil_mm
        small = depth_error(model, distance, 12, 1e-4)
        step = 0.01
        slope = abs(float(model.disparity(z + step, 12)) - float(model.disparity(z - step, 12))) / (
            2 * step
        )
        assert small == pytest.approx(1e-4 / slope, rel=1e-5)
    assert depth_error(model, 1e9, 12, 0.1) == inf


def test_planes_are_those_of_the_ray_model() -> None:
    model = RayModel.focused(F193, 1500.0, 13)
    found = design(model, 500.0, 5000.0)
    cover = covering_slices(model, 500.0, 5000.0)
    assert [p.a for p in found.planes] == [s.a for s in reversed(cover.slices)]
    for plane in found.planes:
        a = float(plane.a)
        assert plane.distance_mm == float(model.distance(a).mm)
        assert plane.near_mm == float(model.near_border(a).mm)
        assert plane.depth_of_field_mm == plane.far_mm - plane.near_mm
        # The a of a plane is the disparity of neighbouring views.
        assert plane.disparity_px == pytest.approx(12 * a, abs=1e-9)


def test_resolved_step_separates_depths_of_field() -> None:
    model = RayModel.focused(F193, 1500.0, 13)
    for a in (-0.3, 0.5, 2.0):
        step = resolved_step(model, a)
        assert float(model.far_border(a + float(step)).mm) <= float(model.near_border(a).mm)
        closer = a + float(step - Fraction(1, 13))
        assert float(model.far_border(closer).mm) > float(model.near_border(a).mm)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"pupil": 20.0}, "micro images overlap by 6"),
        ({"pupil": 1.0}, "fill 39 % of their distance"),
        ({"pixel": 0.03}, "too few directions"),
        ({"pixel": 0.005}, "smaller than the Rayleigh limit"),
        ({}, "a thin lens is assumed"),
    ],
)
def test_warnings(changes: dict[str, float], text: str) -> None:
    camera = camera_of(THIN, changes)
    model = RayModel.focused(camera, inf, max(2, camera.micro_image_size))
    assert any(text in warning for warning in design(model, 300.0).warnings)


def test_views_beyond_the_pupil_do_not_count() -> None:
    narrow = RayModel.focused(camera_of(THIN, {"pupil": 1.0}), inf, 9)
    found = design(narrow, 300.0)
    # Views 2 and -2 stand at the rim of 1 mm: 0.25 mm apart.
    assert found.gap == 4
    assert any("outside the entrance pupil" in warning for warning in found.warnings)


def test_command_writes_all_its_forms(tmp_path: Path) -> None:
    base = ("design", "--camera", "f193-mla2", "--focus", "1500", "--near", "500", "--far", "5000")
    ran = plenofir(*base, "--json", "--csv", str(tmp_path / "planes.csv"))
    assert ran.returncode == 0, ran.stderr
    content = json.loads(ran.stdout)
    model = RayModel.focused(F193, 1500.0, 13)
    assert content["figures"] == figures(model, 500.0, 5000.0)
    rows = list(csv.DictReader((tmp_path / "planes.csv").open()))
    assert [row["a"] for row in rows] == [plane["a"] for plane in content["planes"]]
    assert float(rows[0]["distance_mm"]) == content["planes"][0]["distance_mm"]
    for suffix, head in ((".svg", b"<?xml"), (".pdf", b"%PDF"), (".png", b"\x89PNG")):
        drawings = []
        # The same bytes each time, although SVG by default has a date and random names.
        for _ in range(2 if suffix == ".svg" else 1):
            file = tmp_path / f"plot{suffix}"
            assert plenofir(*base, "--plot", str(file)).returncode == 0
            drawings.append(file.read_bytes())
        assert drawings[0].startswith(head)
        assert drawings[0] == drawings[-1]
    text = plenofir(*base).stdout
    for part in ("16.6882", "28/13", "Rayleigh limit"):
        assert part in text


def test_the_range_begins_at_the_plane_a_2_if_not_given() -> None:
    ran = plenofir("design", "--camera", "f193-mla2", "--json")
    assert ran.returncode == 0, ran.stderr
    figures_found = json.loads(ran.stdout)["figures"]
    assert figures_found["a_near"] == pytest.approx(2)
    assert str(figures_found["a_far"]) == "0.0"
    # A lens that is longer than the distances of all planes: none is in front of it.
    long_lens = F193.main_lens.model_copy(update={"front_vertex_mm": 1e9})
    model = RayModel.focused(F193.model_copy(update={"main_lens": long_lens}), inf, 13)
    with pytest.raises(InputError, match="no plane a = 2 lies in front"):
        design(model)


def test_camera_from_lengths_alone() -> None:
    lengths = ("--focal-length", "50", "--lens-focal-length", "1", "--lens-pitch", "0.05")
    ran = plenofir("design", *lengths, "--pixel", "0.005", "--near", "300", "--json")
    assert ran.returncode == 0, ran.stderr
    content = json.loads(ran.stdout)
    assert content["figures"]["M"] == 9
    assert content["planes"][-1]["far_mm"] is None
    telecentric = plenofir(
        "design", *lengths, "--pixel", "0.005", "--near", "300", "--exit-pupil", "inf", "--json"
    )
    assert telecentric.returncode == 0, telecentric.stderr
    assert json.loads(telecentric.stdout)["figures"]["exit_pupil_mm"] is None


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--near", "300"), "give --camera, or --focal-length, --lens-focal-length"),
        (("--near", "300", "--camera", "f193-mla2", "--pixel", "-1"), "--pixel: -1.0"),
        (("--near", "3000", "--far", "300", "--camera", "f193-mla2"), "3000 to 300"),
        (("--near", "300", "--camera", "f193-mla2", "--disparity-error", "0"), "positive number"),
        (("--near", "300", "--camera", "f193-mla2", "--plot", "a.jpg"), "must end in .svg"),
        (("--near", "300", "--camera", "f193-mla2", "--exit-pupil", "0"), "--exit-pupil: 0.0"),
        (("--near", "300", "--camera", "f193-mla2", "--page", "--json"), "--json; the page shows"),
        (("--near", "300", "--camera", "f193-mla2", "--port", "8080"), "--port requires --page"),
        (("--near", "300", "--camera", "f193-mla2", "--no-browser"), "requires --page"),
        (("--near", "300", "--camera", "f193-mla2", "--pixel", "1e-9"), "M is more than 10000"),
        (("--near", "300", "--camera", "f193-mla2", "-M", "9" * 400), "M is more than 10000"),
        (("--near", "300", "--camera", "f193-mla2", "-M", "1"), "2 or more"),
    ],
)
def test_wrong_calls(words: tuple[str, ...], text: str) -> None:
    ran = plenofir("design", *words)
    assert ran.returncode == 2
    assert text in ran.stderr
    assert ran.stderr.count("\n") == 1


def test_a_disparity_error_has_to_be_positive() -> None:
    with pytest.raises(InputError, match="positive number of pixels"):
        design(RayModel.focused(F193, inf, 13), 300.0, disparity_error_px=-1)
