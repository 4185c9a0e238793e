# SPDX-License-Identifier: Apache-2.0
"""What cameras may be, what is said of them, and which slices cover a range: at the limits."""

from decimal import Decimal
from fractions import Fraction
from math import inf, nextafter

import pytest
from pydantic import ValidationError

from plenofir.camera.rays import (
    Camera,
    MainLens,
    MicroLensArray,
    RayModel,
    Sensor,
    Slice,
    State,
    camera_of,
    covering_slices,
    depth_of_field,
    diffraction_note,
    gaps_between,
    load_camera,
    rayleigh_limit,
)
from plenofir.ground.errors import InputError

F193 = load_camera("f193-mla2")
MODEL = RayModel.focused(F193, 3000.0, 13)
ENDLESS = RayModel.focused(F193, inf, 13)


@pytest.mark.parametrize("length", [1e-30, 1.0, 1e30])
def test_lengths_up_to_both_ends(length: float) -> None:
    assert MicroLensArray(focal_length_mm=length, pitch_mm=length).pitch_mm == length
    for sign in (1, -1):
        lens = MainLens(
            focal_length_mm=1,
            principal_plane_separation_mm=sign * length,
            exit_pupil_mm=sign * length,
        )
        assert lens.exit_pupil_mm == sign * length


@pytest.mark.parametrize("length", [nextafter(1e-30, 0), nextafter(1e30, inf), 0.0, float("nan")])
def test_lengths_beyond_them(length: float) -> None:
    with pytest.raises(ValidationError, match="from 1e-30 to 1e"):
        MicroLensArray(focal_length_mm=1, pitch_mm=length)
    for sign in (1, -1):
        with pytest.raises(ValidationError, match="other than 0"):
            MainLens(focal_length_mm=1, exit_pupil_mm=sign * length)
        if not length < 1:
            with pytest.raises(ValidationError, match="on either side"):
                MainLens(focal_length_mm=1, principal_plane_separation_mm=sign * length)


def test_data_that_is_left_out() -> None:
    lens = MainLens(focal_length_mm=50)
    assert (lens.principal_plane_separation_mm, lens.exit_pupil_mm) == (0, 50)
    assert Sensor(pixel_pitch_mm=0.01, columns=1, rows=1).rows == 1
    for wrong in ({"columns": 0}, {"rows": 0}):
        with pytest.raises(ValidationError):
            Sensor(pixel_pitch_mm=0.01, **wrong)
    parts = F193.model_dump() | {"name": "x"}
    assert Camera(**parts).name == "x"
    with pytest.raises(ValidationError):
        Camera(**parts | {"name": ""})
    with pytest.raises(ValidationError):
        F193.sensor.pixel_pitch_mm = 1.0


def test_changed_cameras_keep_what_they_leave_out() -> None:
    given = {"focal_length": 50.0, "lens_focal_length": 2.0, "lens_pitch": 0.1, "pixel": 0.01}
    thin = camera_of(None, given)
    assert (thin.name, thin.main_lens.exit_pupil_mm) == ("camera", 50)
    longer = camera_of(thin, {"focal_length": 80.0})
    # Still a thin lens: its pupil is the lens.
    assert (longer.name, longer.main_lens.exit_pupil_mm) == ("camera, changed", 80)
    assert longer.thin_lens_note().startswith("camera, changed has no main_lens.exit_pupil_mm")
    same = camera_of(F193, {})
    assert same == F193
    assert same.thin_lens_note() == ""
    for wrong, name in (({"pixel": -1.0}, "pixel"), ({"lens_pitch": 0, "pixel": -1}, "lens_pitch")):
        with pytest.raises(InputError, match=f"^{name}: .*it should be a positive number"):
            camera_of(F193, wrong)
    with pytest.raises(InputError, match=r"^focal_length: "):
        camera_of(None, {"pixel": 0.01})


def test_a_reversed_lens() -> None:
    """The exit pupil, as the main lens images it, and as large: Newton's equation."""
    lens = F193.main_lens.model_copy(update={"entrance_pupil_diameter_mm": 30.0})
    camera = F193.model_copy(update={"main_lens": lens})
    turned = camera.reversed()
    f, from_focus = lens.focal_length_mm, lens.exit_pupil_mm
    assert turned.main_lens.exit_pupil_mm * from_focus == pytest.approx(f**2)
    assert turned.main_lens.entrance_pupil_diameter_mm == pytest.approx(30.0 * from_focus / f)
    assert turned.name == "f193-mla2 reversed"
    # Its views are as many: steps of the pupil's images are magnified as it is.
    views = [RayModel(c, Decimal(0), 13).outermost_view for c in (camera, turned.reversed())]
    assert views[0] == views[1]
    assert F193.reversed().main_lens.entrance_pupil_diameter_mm is None


@pytest.mark.parametrize(
    ("pixels", "m", "said"),
    [
        (13.5, 14, ""),
        (13.5, 13, ""),
        (13.5, 12, "hold only"),
        (13.5, 15, "are wrong"),
        (13.25, 14, "are wrong"),
        (13.0, 13, ""),
        (14.0, 14, ""),
    ],
)
def test_micro_images_half_a_pixel_smaller(pixels: float, m: int, said: str) -> None:
    sensor = F193.sensor.model_copy(update={"pixel_pitch_mm": 0.125})
    array = F193.micro_lenses.model_copy(update={"pitch_mm": 0.125 * pixels})
    camera = F193.model_copy(update={"sensor": sensor, "micro_lenses": array})
    note = RayModel(camera, Decimal(0), m).micro_image_note()
    assert said in note
    assert bool(note) == bool(said)


def test_the_smallest_micro_images() -> None:
    assert RayModel(F193, Decimal(0), 2).micro_image_size == 2
    # Pixels larger than a micro lens.
    assert camera_of(F193, {"pixel": 0.3}).micro_image_size == 1


@pytest.mark.parametrize(("limit_um", "said"), [(14.749, "14.7"), (14.751, "14.8"), (9.004, "9")])
def test_limits_are_told_in_three_digits(limit_um: float, said: str) -> None:
    length = limit_um * 1e-3 * 0.125 / (1.22 * 550e-6)
    camera = camera_of(F193, {"lens_focal_length": length, "pixel": 0.00749})
    assert rayleigh_limit(camera) == pytest.approx(limit_um * 1e-3)
    note = diffraction_note(camera)
    assert note.startswith("pixels of 7.49 um are smaller than the Rayleigh limit")
    assert f"({said} um at 550 nm)" in note


def test_the_colour_of_a_limit() -> None:
    assert rayleigh_limit(F193, 700e-6) == pytest.approx(1.22 * 700e-6 * 2.75 / 0.125)


def test_depths_of_field_by_their_borders() -> None:
    whole = depth_of_field(MODEL, Fraction(1))
    near, far = (float(way(1.0).mm) for way in (MODEL.near_border, MODEL.far_border))
    assert whole == Slice(Fraction(1), near, far)
    # The far border beyond infinity and in it; the near one too; both in the lens.
    assert ENDLESS.far_border(0.0).state() is State.BEYOND_INFINITY
    assert depth_of_field(ENDLESS, Fraction(0)) == Slice(
        Fraction(0), float(ENDLESS.near_border(0.0).mm), inf
    )
    lens = MainLens(focal_length_mm=64, exit_pupil_mm=inf)
    plain = Camera(
        name="plain",
        main_lens=lens,
        micro_lenses=MicroLensArray(focal_length_mm=2, pitch_mm=0.125),
        sensor=Sensor(pixel_pitch_mm=0.0078125),
    )
    # 4 a = 1: all products are exact.
    five = RayModel(plain, Decimal(0), 5)
    assert five.far_border(0.25).state() is State.INFINITY
    found = depth_of_field(five, Fraction(1, 4))
    assert found is not None
    assert found.far_mm == inf
    assert five.near_border(-0.25).state() is State.INFINITY
    assert depth_of_field(five, Fraction(-1, 4)) is None
    assert depth_of_field(five, Fraction(-1, 2)) is None
    assert depth_of_field(MODEL, Fraction(30)) is None


def test_gaps() -> None:
    first, second, third = (Slice(Fraction(0), *ends) for ends in ((5, 9), (3, 5), (1, 2)))
    assert gaps_between([third, first, second], 0.5, 10) == ((9, 10), (2, 3), (0.5, 1))
    assert gaps_between([first, second, third], 1, 9) == ((2, 3),)
    # A slice within another one, one that ends where the range does, and one beyond it.
    assert gaps_between([Slice(Fraction(0), 4, 6), first], 5, 9) == ()
    assert gaps_between([first], 6, 7) == ()
    assert gaps_between([third, first], 3, 12) == ((9, 12), (3, 5))
    assert gaps_between([], 1, inf) == ((1, inf),)


def test_the_fewest_slices_at_their_borders() -> None:
    one, two = (depth_of_field(MODEL, Fraction(a)) for a in (0, 1))
    assert one is not None
    assert two is not None
    assert two.far_mm < one.near_mm
    step = Fraction(1)
    # Down to the near border of a slice, and no farther.
    assert covering_slices(MODEL, one.near_mm, 3000.0, step=step).slices == (one,)
    below = covering_slices(MODEL, nextafter(two.far_mm, 0), 3000.0, step=step)
    assert below.slices == (one, two)
    assert below.gaps == ((two.far_mm, one.near_mm),)
    # A gap alone, and one that ends where a slice begins.
    middle = (two.far_mm + one.near_mm) / 2
    for near in (two.far_mm, nextafter(two.far_mm, inf)):
        empty = covering_slices(MODEL, near, middle, step=step)
        assert (empty.slices, empty.gaps) == ((), ((near, middle),))
    # From the near border of a slice on, that slice has nothing.
    assert covering_slices(MODEL, two.near_mm, one.near_mm, step=step).slices == (two,)


def test_slices_without_a_step() -> None:
    """In steps of 1 / M each begins in the one before."""
    found = covering_slices(MODEL, 400.0, 3000.0)
    assert found == covering_slices(MODEL, 400.0, 3000.0, step=Fraction(1, 13))
    third = found.slices[2].near_mm
    assert covering_slices(MODEL, third, 3000.0).slices == found.slices[:3]
    for one, other in zip(found.slices, found.slices[1:], strict=False):
        following = depth_of_field(MODEL, other.a + Fraction(1, 13))
        assert other.far_mm >= one.near_mm
        assert following is None or following.far_mm < one.near_mm


@pytest.mark.parametrize("near", [-0.5, 0.0, 3000.0, 3000.5])
def test_ranges_without_a_length(near: float) -> None:
    with pytest.raises(InputError, match="not a range of distances"):
        covering_slices(MODEL, near, 3000.0)
