# SPDX-License-Identifier: Apache-2.0
"""Properties of the ray model."""

from decimal import Decimal
from fractions import Fraction
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.rays import (
    RayModel,
    State,
    abbe_limit,
    airy_radius,
    camera_names,
    camera_of,
    condition_numbers,
    covering_slices,
    depth_of_field,
    diffraction_note,
    gaps_between,
    load_camera,
    rayleigh_limit,
)
from plenofir.camera.rays.distances import STATES, lens_extension
from plenofir.ground.errors import InputError
from plenofir_studies.intersections import (
    image_side_distance,
    iterated_image_distance,
    object_side_distance,
)

F193 = load_camera("f193-mla2")


def model(focus: float = 3000.0, size: int = 13, camera: str = "f193-mla2") -> RayModel:
    return RayModel.focused(load_camera(camera), focus, size)


@given(st.floats(-0.9, 6), st.sampled_from([1500.0, 3000.0, 1e5]), st.integers(2, 40))
def test_three_ways_agree(a, focus, size):
    m = model(focus, size)
    for border, way in ((0, m.distance), (1, m.near_border), (-1, m.far_border)):
        found = way(a)
        if found.state() is State.REAL and float(found.mm) < 1e6:
            assert float(image_side_distance(m, a, border)) == pytest.approx(
                float(found.mm), rel=1e-7
            )
            assert float(object_side_distance(m, a, border)) == pytest.approx(
                float(found.mm), rel=1e-7
            )


@given(st.floats(230, 1e7), st.sampled_from([inf, 1500.0, 3000.0]))
def test_focus_setting_inverts_distance(distance, focus):
    m = model(focus)
    for border, way in (("centre", m.distance), ("near", m.near_border), ("far", m.far_border)):
        a = float(m.focus_setting(distance, border))
        assert float(way(a).mm) == pytest.approx(distance, rel=1e-9)


def test_focus_setting_of_infinity():
    assert float(model(inf).focus_setting(inf)) == 0
    assert float(model(1500.0).focus_setting(inf)) == pytest.approx(-1.1037848, rel=1e-6)
    assert float(model(1500.0).focus_setting(1500.0)) == pytest.approx(0, abs=1e-14)


@given(st.floats(-0.1, 3.5))
def test_borders_enclose_the_plane(a):
    planes = model().planes(a)
    near, centre, far = (float(d.mm) for d in (planes.near, planes.centre, planes.far))
    assert near < centre
    assert np.isnan(far) or centre < far


def test_depth_of_field_shrinks_as_micro_images_grow():
    depths = [
        float(model(size=m).far_border(1).mm - model(size=m).near_border(1).mm)
        for m in (5, 9, 13, 99)
    ]
    assert depths == sorted(depths, reverse=True)


def test_the_plane_does_not_depend_on_the_micro_image_size():
    want = pytest.approx(float(model().distance(1.0).mm), rel=1e-14)
    for size in (2, 5, 99):
        assert float(model(size=size).distance(1.0).mm) == want


def test_states():
    m = model(inf)
    found = m.planes([0.0, -1.0, 1.0, 4.0, 8.0])
    states = [STATES[s] for s in found.centre.states]
    assert states == [
        State.INFINITY,
        State.BEYOND_INFINITY,
        State.REAL,
        State.REAL,
        State.INSIDE_LENS,
    ]
    # Between the two last ones the near border passes the front vertex (Table 5.5, a = 4).
    assert found.near.state(3) is State.INSIDE_LENS
    assert np.isnan(found.centre.mm[:2]).all()
    assert np.isfinite(found.centre.mm[2:]).all()


def test_arrays_keep_their_shape():
    a = np.linspace(0.1, 3, 12).reshape(3, 4)
    m = model()
    distances = m.distance(a)
    assert distances.mm.shape == distances.states.shape == (3, 4)
    for index in np.ndindex(3, 4):
        assert distances.mm[index] == float(m.distance(float(a[index])).mm)


@given(st.floats(1e3, 1e9))
def test_focus_from_iteration_and_closed_form(focus):
    lens = F193.main_lens
    settled, _ = iterated_image_distance(
        lens.focal_length_mm, lens.principal_plane_separation_mm, focus
    )
    m = RayModel.focused(F193, focus, 13)
    assert m.image_distance_mm == pytest.approx(settled, rel=1e-10)
    # Conjugate distances, f_U^2 = (a_U - f_U) (b_U - f_U).
    object_distance = focus - m.image_distance_mm - lens.principal_plane_separation_mm
    product = (object_distance - lens.focal_length_mm) * m.extension_mm
    assert product == pytest.approx(lens.focal_length_mm**2, rel=1e-9)


def test_one_to_one_imaging_is_the_nearest_focus():
    lens = F193.main_lens
    nearest = 4 * lens.focal_length_mm + lens.principal_plane_separation_mm
    m = RayModel.focused(F193, nearest + 1e-9, 13)
    assert m.image_distance_mm == pytest.approx(2 * lens.focal_length_mm, rel=1e-5)
    with pytest.raises(InputError, match="nearer than the main lens can focus"):
        RayModel.focused(F193, nearest - 1e-6, 13)


def test_rays_of_a_view_meet_at_its_virtual_camera():
    m = model(1500.0)
    positions = m.micro_lens_position([-50, 0, 20])
    from_plane = (
        m.entrance_pupil_mm - m.image_distance_mm - F193.main_lens.principal_plane_separation_mm
    )
    for i in (-6, 0, 3):
        slope, height = m.object_ray(i, positions)
        assert slope * from_plane + height == pytest.approx(float(m.virtual_camera(i)), abs=1e-10)


@given(
    st.floats(-2, 9), st.sampled_from([inf, 1500.0, 4000.0]), st.integers(1, 8), st.integers(-6, 0)
)
def test_disparity_inverts_depth(disparity, focus, gap, view):
    m = model(focus)
    found = m.depth(disparity, gap, view=view)
    if found.state() is State.REAL and float(found.mm) < 1e8:
        back = float(m.disparity(float(found.mm), gap, view=view))
        assert back == pytest.approx(disparity, rel=1e-6, abs=1e-6)


def test_disparity_units():
    m = model(inf)
    one = m.depth(12.0, 6)
    assert float(m.depth(2.0, 6, unit="pixels per view").mm) == float(one.mm)
    assert float(m.disparity(one.mm, 6, unit="pixels per view")) == pytest.approx(2.0)
    assert m.depth(0.0, 6).state() is State.INFINITY
    assert m.depth(-1.0, 6).state() is State.BEYOND_INFINITY
    with pytest.raises(InputError, match="unit"):
        m.depth(1.0, 6, unit="mm")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="gap"):
        m.depth(1.0, 0)


def test_zero_disparity_lies_on_the_focused_plane():
    m = model(1500.0)
    assert float(m.depth(0.0, 4).mm) + m.entrance_pupil_mm == pytest.approx(1500.0, rel=1e-12)


def test_refocusing_and_triangulation_agree():
    # A point on plane a shows a disparity of a micro lenses for each view between the two.
    m = model(1500.0)
    for a in (-0.5, 0.5, 1.0, 2.0):
        depth = float(m.distance(a).mm) - m.entrance_pupil_mm
        assert float(m.disparity(depth, 6, unit="pixels per view")) == pytest.approx(a, rel=1e-9)


def test_micro_image_centres():
    m = model(inf)
    s = m.micro_lens_position([0, 14, -14])
    assert m.micro_image_centre(s, "ideal").tolist() == s.tolist()
    exit_pupil = m.micro_image_centre(s)
    assert exit_pupil[0] == 0
    # Their slopes lead back to the exit pupil.
    slopes = (s - exit_pupil) / 2.75
    assert slopes[1:] * m.exit_pupil_mm == pytest.approx(-s[1:], rel=1e-12)
    assert m.chief_ray_slope(0, s) == pytest.approx(slopes, rel=1e-9)


def test_diffraction_limits():
    # The numbers of sections 2.2.2 and 3.3.2: D = 250 nm for 700 nm and NA 1.4.
    assert float(abbe_limit(700e-6, 1.4)) == pytest.approx(250e-6)
    assert float(airy_radius(550e-6, 100.0, 50.0)) == pytest.approx(1.22 * 2 * 550e-6)


@given(st.floats(300, 5000), st.floats(1.05, 50), st.sampled_from([inf, 1500.0]), st.booleans())
def test_cover_has_gaps_exactly_where_no_slice_of_the_grid_reaches(near, ratio, focus, whole):
    m = model(focus)
    step = Fraction(1) if whole else Fraction(1, 13)
    cover = covering_slices(m, near, near * ratio, step=step)
    assert all(part.a % step == 0 for part in cover.slices)
    assert [part.a for part in cover.slices] == sorted(part.a for part in cover.slices)
    # No other slice of the grid would close a gap.
    for low, high in cover.gaps:
        middle = (low + high) / 2
        centre = int(float(m.focus_setting(middle)) / float(step))
        for index in range(centre - 3, centre + 4):
            part = depth_of_field(m, index * step)
            assert part is None or not part.near_mm < middle < part.far_mm
    # Every slice is needed.
    for index in range(len(cover.slices)):
        rest = [s for i, s in enumerate(cover.slices) if i != index]
        assert gaps_between(rest, near, near * ratio) != cover.gaps or len(cover.slices) == 1


def test_cover_to_infinity():
    cover = covering_slices(model(inf), 1000.0, inf)
    assert cover.slices[0].far_mm == inf
    assert cover.slices[-1].near_mm <= 1000.0
    assert not cover.gaps


@pytest.mark.parametrize(
    ("near", "far"),
    [(500, 400), (-1, 100), (0, 100), (5, 5), (float("nan"), 9), (9, float("nan")), (inf, inf)],
)
def test_bad_ranges(near, far):
    with pytest.raises(InputError, match="not a range of distances"):
        covering_slices(model(), near, far)


def in_pupil(diameter: float) -> RayModel:
    """f193 at infinity focus with an entrance pupil; its views are 0.6326 mm apart."""
    lens = F193.main_lens.model_copy(update={"entrance_pupil_diameter_mm": diameter})
    return RayModel(F193.model_copy(update={"main_lens": lens}), Decimal(0), 13)


@given(st.floats(-0.9, 3), st.sampled_from([inf, 1500.0, 3000.0]))
def test_alpha_is_the_image_distance_of_the_plane(a, focus):
    m = model(focus)
    alpha = float(m.alpha(a))
    assert float(m.focus_setting_of_alpha(alpha)) == pytest.approx(a, rel=1e-9, abs=1e-12)
    found = m.distance(a)
    if found.state() is State.REAL and float(found.mm) < 1e6:
        image, f = alpha * m.image_distance_mm, F193.main_lens.focal_length_mm
        front = m.image_distance_mm + F193.main_lens.principal_plane_separation_mm
        assert front + image * f / (image - f) == pytest.approx(float(found.mm), rel=1e-6)


def test_alpha_at_its_ends():
    m = model()
    assert float(m.alpha(0)) == 1
    assert float(m.alpha(m.focus_setting(inf))) == pytest.approx(
        F193.main_lens.focal_length_mm / m.image_distance_mm
    )
    assert abs(float(m.alpha(m.focus_setting_of_alpha(inf)))) > 1e12
    for alpha in (float("nan"), 1 - m.exit_pupil_mm / m.image_distance_mm):
        with pytest.raises(InputError, match="alpha"):
            m.focus_setting_of_alpha(alpha)


def test_baseline_at_the_exit_pupil():
    m = model()
    # Eq. 3.51 as it stands: slope of the chief ray times d_A'.
    apart = (m.chief_ray_slope(-6, 0.0) - m.chief_ray_slope(0, 0.0)) * m.exit_pupil_mm
    assert float(m.exit_pupil_baseline(6)) == pytest.approx(float(apart))
    lens = F193.main_lens
    pupils = lens.exit_pupil_mm / lens.focal_length_mm
    assert float(m.exit_pupil_baseline(6)) == pytest.approx(pupils * float(m.baseline(6)))


def test_views_beyond_the_entrance_pupil():
    step = float(model(inf).baseline(1))
    assert model().outermost_view is None
    assert model().vignetting_note(99) == ""
    assert [in_pupil(2 * step * n).outermost_view for n in (0.99, 1, 3.5)] == [0, 1, 3]
    assert in_pupil(1e300).outermost_view == 10**9
    narrow = in_pupil(7.0)
    assert narrow.vignetting_note(-5, 0) == ""
    assert "more than 5 from the central one" in narrow.vignetting_note(0, -6)


def test_pixels_against_the_rayleigh_limit():
    # Micro lenses f/22 and f/10 at 550 nm, pixels of 9 um.
    assert rayleigh_limit(F193) == pytest.approx(1.22 * 550e-6 * 22)
    assert "smaller than the Rayleigh limit" in diffraction_note(F193)
    assert rayleigh_limit(load_camera("f193-mla1")) == pytest.approx(1.22 * 550e-6 * 10)
    assert diffraction_note(load_camera("f193-mla1")) == ""


def test_micro_image_centres_from_an_unknown_stop():
    with pytest.raises(InputError, match="aperture_stop_mm"):
        model(camera="f197-mla2").micro_image_centre(1.0, "aperture stop")


def test_shipped_cameras():
    assert {"f193-mla1", "f193-mla2", "f90-mla2", "f197-mla2", "f100-mla2"} <= set(camera_names())
    for name in camera_names():
        assert load_camera(name).name == name


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("focal_length_mm = 193.2935", "focal_length_mm = -1"), "main_lens.focal_length_mm = -1"),
        (("pitch_mm = 0.125", "pitch_mm = 0"), "micro_lenses.pitch_mm = 0"),
        (("pitch_mm = 0.125", 'pitch_mm = "wide"'), "micro_lenses.pitch_mm = 'wide'"),
        (("exit_pupil_mm", "exit_pupi_mm"), "main_lens.exit_pupi_mm"),
        (("focal_length_mm = 193.2935\n", ""), "main_lens.focal_length_mm"),
        (("exit_pupil_mm = 111.0324", "exit_pupil_mm = 0"), "main_lens.exit_pupil_mm = 0"),
        (("exit_pupil_mm = 111.0324", "exit_pupil_mm = -inf"), "main_lens.exit_pupil_mm = -inf"),
        (("pitch_mm = 0.125", "pitch_mm = inf"), "micro_lenses.pitch_mm = inf"),
        (("[sensor]", "[sensors]"), "sensor"),
        (("[sensor]", "[sensor"), "cannot be read"),
    ],
)
def test_bad_camera_files(tmp_path, change, message):
    from plenofir.camera.rays.camera import CAMERAS

    text = (CAMERAS / "f193-mla2.toml").read_text()
    assert change[0] in text
    path = tmp_path / "camera.toml"
    path.write_text(text.replace(*change))
    with pytest.raises(InputError) as caught:
        load_camera(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_camera_names_the_known_ones():
    with pytest.raises(InputError, match="f193-mla2"):
        load_camera("f50")


@pytest.mark.parametrize("size", [1, 0, -3, 2.5, True])
def test_bad_micro_image_sizes(size):
    with pytest.raises(InputError, match="2 or more"):
        RayModel(F193, Decimal(0), size)


@pytest.mark.parametrize("a", [inf, -inf, float("nan"), 1e101])
def test_bad_focus_settings(a):
    with pytest.raises(InputError, match="finite"):
        model().distance(a)


def test_never_a_silent_infinity():
    tiny = 5e-324
    m = model(inf)
    for found in (m.distance(tiny), m.distance(-tiny), m.depth(tiny, 6), m.depth(-tiny, 6)):
        assert np.isnan(float(found.mm))
        assert found.state() in (State.INFINITY, State.BEYOND_INFINITY)
    far = m.distance(1e100)
    assert far.state() is State.INSIDE_LENS
    assert np.isfinite(float(far.mm))


def test_a_camera_that_contradicts_m():
    """Micro images of 13.9 pixels: decoding takes 13, or crops them; 15 they never have."""
    camera = load_camera("f193-mla2")
    notes = {m: RayModel.focused(camera, inf, m).micro_image_note() for m in (5, 13, 14, 15)}
    assert notes[13] == notes[14] == ""
    assert notes[5].endswith(
        "f193-mla2 have 13.9 pixels, not 5; distances hold only if the picture has their middle "
        "pixels, as decode crops them"
    )
    assert notes[15].endswith("have 13.9 pixels, not 15; distances are wrong")


@pytest.mark.parametrize("pupil", [111.0324, inf, -300.0])
@pytest.mark.parametrize("focus", [inf, 3000.0])
@pytest.mark.parametrize("border", ["centre", "near", "far"])
def test_condition_numbers_are_what_errors_of_the_data_do(pupil, focus, border):
    lens = F193.main_lens.model_copy(update={"exit_pupil_mm": pupil})
    camera = F193.model_copy(update={"main_lens": lens})
    step = 1e-6

    def distance(part, field, extension, a, off):
        data = getattr(camera, part)
        update = {field: getattr(data, field) * (1 + off)} if field else {}
        changed = camera.model_copy(update={part: data.model_copy(update=update)})
        way = {"centre": "distance", "near": "near_border", "far": "far_border"}[border]
        return float(getattr(RayModel(changed, extension, 13), way)(a * (1 + off * (not field))).mm)

    m = RayModel.focused(camera, focus, 13)
    for a in (0.3, 1.0, 2.5):
        found = condition_numbers(m, a, border)
        for name, part, field in (
            ("a", "sensor", ""),
            ("p_p", "sensor", "pixel_pitch_mm"),
            ("p_M", "micro_lenses", "pitch_mm"),
            ("f_s", "micro_lenses", "focal_length_mm"),
            ("H1H2", "main_lens", "principal_plane_separation_mm"),
            # At infinity focus e is 0; else a longer lens takes its pupil along.
            ("f_U", "main_lens", "focal_length_mm"),
        ):
            low, high = (distance(part, field, m.extension, a, off) for off in (-step, step))
            middle = distance(part, field, m.extension, a, 0.0)
            assert found[name] == pytest.approx(abs(high - low) / (2 * step * middle), rel=1e-4)
        moved = [
            distance("sensor", "pixel_pitch_mm", m.extension + Decimal(off), a, 0.0)
            for off in (-1e-4, 1e-4)
        ]
        share = 2e-4 / m.image_distance_mm * float(distance("sensor", "", m.extension, a, 0.0))
        assert found["b_U"] == pytest.approx(abs(moved[1] - moved[0]) / share, rel=1e-4)
        assert found["all"] == pytest.approx(sum(v for k, v in found.items() if k != "all"))


def test_planes_at_infinity_have_no_finite_condition():
    assert condition_numbers(model(inf), 0)["all"] == inf
    # Next to it the place of the main lens counts most: 1 / a.
    near = condition_numbers(model(inf), 1e-9)
    assert near["b_U"] == max(v for k, v in near.items() if k != "all") > 1e9


# These notice mutants that no other test does.


@pytest.mark.parametrize(("pixels", "m"), [(13.9, 13), (13.0, 13), (12.99, 11), (1.2, 1), (4, 3)])
def test_micro_image_size_is_the_largest_odd_number(pixels, m):
    sensor = F193.sensor.model_copy(update={"pixel_pitch_mm": F193.micro_lenses.pitch_mm / pixels})
    assert F193.model_copy(update={"sensor": sensor}).micro_image_size == m


def test_diffraction_note_names_its_numbers():
    note = diffraction_note(F193)
    for text in ("pixels of 9 um", "(14.8 um at 550 nm)"):
        assert text in note


def test_no_diffraction_note_where_pixels_are_the_limit():
    limit = {"pixel": rayleigh_limit(F193)}
    assert diffraction_note(camera_of(F193, limit)) == ""


def test_cameras_of_other_lengths():
    changed = camera_of(F193, {"pixel": 0.004, "rows": 100})
    assert (changed.sensor.pixel_pitch_mm, changed.sensor.rows) == (0.004, 100)
    assert (changed.name, changed.main_lens) == ("f193-mla2, changed", F193.main_lens)


def test_ranges_from_less_than_a_millimetre():
    """They end in the main lens."""
    assert covering_slices(model(), 0.5, 1000.0).slices[-1].near_mm > 0.5


def test_one_to_one_imaging_can_be_focused():
    assert lens_extension(100.0, 3.0, 403.0) == 100
