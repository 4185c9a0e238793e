# SPDX-License-Identifier: Apache-2.0
"""Focused cameras: against rays through thin lenses, and against what is published of them."""

from dataclasses import replace
from fractions import Fraction
from math import inf, isnan, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from plenofir.camera.design import design
from plenofir.camera.rays import (
    Camera,
    MicroLensArray,
    RayModel,
    State,
    blur_px,
    camera_of,
    condition_numbers,
    covering_depth,
    covering_slices,
    depth_of_field,
    extension_of_infinity,
    load_camera,
    rayleigh_limit,
    resolution_ratio,
    setting_of_virtual_depth,
    sharpest_type,
    usable_ranges,
    virtual_depth,
)
from plenofir.camera.rays.lens_types import pupil_blur_px
from plenofir.camera.rays.model import Border
from plenofir.ground.errors import InputError

F193 = load_camera("f193-mla2")
R12 = load_camera("raytrix-r12")
# Where its main lens is focused: 56.86 mm from the micro lenses (`D` of the calibration).
R12_FOCUS = 463.54174


def thin(
    spacing: float, *focal: float, main: float = 50.0, pitch: float = 0.1, pixel: float = 0.005
) -> Camera:
    """A camera whose main lens is thin."""
    return Camera.model_validate(
        {
            "name": "thin",
            "main_lens": {"focal_length_mm": main, "exit_pupil_mm": main},
            "micro_lenses": {
                "focal_length_mm": list(focal),
                "pitch_mm": pitch,
                "sensor_distance_mm": spacing,
            },
            "sensor": {"pixel_pitch_mm": pixel},
        }
    )


# Micro lenses of both kinds: b_s below and above f_s.
GALILEAN, KEPLERIAN = thin(0.4, 0.6, 0.55, 0.5), thin(0.4, 0.36, 0.34, 0.32)
KINDS = {"Galilean": GALILEAN, "Keplerian": KEPLERIAN}


class Bench:
    """Rays through a thin main lens and thin micro lenses, refracted one after the other."""

    def __init__(self, camera: Camera, image_mm: float) -> None:
        """`image_mm`: main lens to micro lenses."""
        self.main, self.image = camera.main_lens.focal_length_mm, image_mm
        array = camera.micro_lenses
        self.pitch, self.spacing = array.pitch_mm, array.spacing_mm
        self.pixel = camera.sensor.pixel_pitch_mm

    def at_micro_lenses(self, height: float, distance: float, lens: float) -> tuple[float, float]:
        """Height and slope behind the main lens of a ray that meets it at `lens`."""
        slope = (lens - height) / distance - lens / self.main
        return lens + slope * self.image, slope

    def on_sensor(
        self, height: float, distance: float, centre: float, across: float, focal: float
    ) -> float:
        """Where a point's ray through a place of a micro lens meets the sensor.

        The ray is aimed by two others: where rays arrive is linear in where they leave.
        """
        (one, _), (other, _) = (self.at_micro_lenses(height, distance, lens) for lens in (0, 1))
        lens = (centre + across - one) / (other - one)
        place, slope = self.at_micro_lenses(height, distance, lens)
        assert place == pytest.approx(centre + across, abs=1e-9)
        return place + (slope - across / focal) * self.spacing

    def micro_image_centre(self, centre: float) -> float:
        """Where the ray from the middle of the main lens goes."""
        return centre + centre / self.image * self.spacing


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("object_mm", [300.0, 480.0, 559.0, 900.0, 1e5])
@pytest.mark.parametrize("height", [0.0, 1.5])
def test_rays_through_thin_lenses(kind: str, object_mm: float, height: float) -> None:
    """Displacement between neighbours, blur of each type, virtual depth, and the distance."""
    camera = KINDS[kind]
    model = RayModel.focused(camera, 560.0, 19)
    bench = Bench(camera, model.image_distance_mm)
    from_lens = object_mm - model.image_distance_mm
    centres = np.arange(-2, 3) * bench.pitch + 0.05
    focal = camera.micro_lenses.focal_lengths_mm
    places = np.array([bench.on_sensor(height, from_lens, c, 0.0, focal[0]) for c in centres])
    inside = (places - [bench.micro_image_centre(c) for c in centres]) / bench.pixel
    moved = np.diff(inside)
    assert moved == pytest.approx(moved[0])
    # Upside down, as the micro lenses see it.
    a = float(-1 / moved[0])
    assert float(model.distance(a).mm) == pytest.approx(object_mm, rel=1e-9)
    assert float(model.focus_setting(object_mm)) == pytest.approx(a, rel=1e-9)
    # v = D / (D - (i_1 - i_2)), Heinze et al. 2016, with places on the sensor.
    depth = bench.pitch / (bench.pitch - np.diff(places)[0])
    assert float(virtual_depth(model, a)) == pytest.approx(depth, rel=1e-9)
    assert float(setting_of_virtual_depth(model, depth)) == pytest.approx(a, rel=1e-9)
    for index, f in enumerate(focal):
        rims = [
            bench.on_sensor(height, from_lens, centres[0], side * bench.pitch / 2, f)
            for side in (-1, 1)
        ]
        blur = abs(rims[1] - rims[0]) / bench.pixel
        assert blur_px(model, a)[index] == pytest.approx(blur, rel=1e-9, abs=1e-9)
        # Thin lens: 1 / f = 1 / b + 1 / (image in front).
        focus = 1 / (1 / f - 1 / bench.spacing)
        assert usable_ranges(model)[index].focus == pytest.approx(-focus / bench.spacing)


@pytest.mark.parametrize("kind", KINDS)
def test_each_type_is_sharp_from_end_to_end(kind: str) -> None:
    """The ranges' ends, by the blur alone: a pixel there, less inside, more beyond."""
    model = RayModel.focused(KINDS[kind], 400.0, 19)
    for index, part in enumerate(usable_ranges(model)):
        assert blur_px(model, setting_of_virtual_depth(model, part.focus))[index] < 1e-9
        far, near = part.settings
        assert far < near
        for end, inwards in ((far, 1), (near, -1)):
            assert float(blur_px(model, end)[index]) == pytest.approx(1)
            assert blur_px(model, end + inwards * 1e-3 * abs(end))[index] < 1
            assert blur_px(model, end - inwards * 1e-3 * abs(end))[index] > 1
        mm = float(model.distance(far).mm)
        assert part.far_mm == (inf if isnan(mm) else mm) > part.near_mm
        assert part.near_mm == float(model.distance(near).mm)
        assert part.depths == pytest.approx(virtual_depth(model, [far, near]).tolist())
        # Of both signs, as published.
        assert part.depths[0] * (1 if kind == "Galilean" else -1) > 0
    # The best type is the one whose blur is least.
    a = np.linspace(-0.9, 0.9, 37)
    best = sharpest_type(model, a)
    assert (blur_px(model, a).argmin(axis=0) == best.lens_type)[a != 0].all()
    assert (best.sharp == (blur_px(model, a).min(axis=0) <= 1.001))[a != 0].all()


def test_effective_resolution_ratio_is_the_published_one() -> None:
    """Damghanian et al. 2014: p / max(s, p) |g / z| with s = D (g (1 / f - 1 / z) - 1)."""
    for camera in KINDS.values():
        model = RayModel.focused(camera, 560.0, 19)
        array, pixel = camera.micro_lenses, camera.sensor.pixel_pitch_mm
        for depth in (-9.0, -4.0, 2.0, 3.3, 5.0, 40.0):
            z = -depth * array.spacing_mm
            ratios = []
            for f in array.focal_lengths_mm:
                s = array.pitch_mm * (array.spacing_mm * (1 / f - 1 / z) - 1)
                ratios.append(pixel / max(abs(s), pixel) * abs(array.spacing_mm / z))
            a = setting_of_virtual_depth(model, depth)
            assert float(resolution_ratio(model, a)) == pytest.approx(max(ratios))
    assert float(resolution_ratio(model, 0.0)) == 0


# Calibrations of one Raytrix R12 by COMPOTE and BLADE (their files intrinsics.js), in mm: main lens
# f and distance D, sensor distance d, focal lengths of the types, their coefficients of depth, and
# the distances from the main lens at which the types are sharpest.
CALIBRATIONS = {
    "R12-A": (
        (49.885285868753407, 56.859967077387466, 0.33712571805114777),
        (0.58266966865506242, 0.5240249316658897, 0.56057361553341034),
        (0.00079708898900074192, 0.62515220840000596, 31.51235516605901),
        (374.25376598233777, 365.64115225753659, 371.48899381538922),
    ),
    "R12-B": (
        (50.010862604694566, 52.140048198216938, 0.32671721233574402),
        (0.56638899095057971, 0.50708733610974643, 0.5424685020176635),
        (0.00023017216184680102, 0.79609141585669219, 10.912844125074178),
        (948.49686456798179, 887.9345233919538, 927.1628512041633),
    ),
}


@pytest.mark.parametrize("name", CALIBRATIONS)
def test_published_focal_planes(name: str) -> None:
    """The published distances are corrected by a polynomial of second order, twice."""
    (main, image, spacing), focal, (second, first, constant), published = CALIBRATIONS[name]
    camera = thin(spacing, *focal, main=main, pitch=0.12746416908944774, pixel=0.0055)
    model = RayModel.focused(camera, image + 1 / (1 / main - 1 / image), 23)
    assert model.image_distance_mm == pytest.approx(image)
    for part, wanted in zip(usable_ranges(model), published, strict=True):
        a = setting_of_virtual_depth(model, part.focus)
        mm = float(model.distance(a).mm) - image
        for _ in range(2):
            mm = (second * mm + first) * mm + constant
        assert mm == pytest.approx(wanted, rel=1e-9)


def test_the_shipped_camera_is_the_published_one() -> None:
    (main, image, spacing), focal, _, _ = CALIBRATIONS["R12-A"]
    assert R12.main_lens.focal_length_mm == main
    assert R12.micro_lenses.focal_lengths_mm == focal
    assert R12.micro_lenses.spacing_mm == spacing
    assert R12.micro_lenses.kinds == ("Galilean",) * 3
    model = RayModel.focused(R12, R12_FOCUS, 23)
    assert model.image_distance_mm == pytest.approx(image, rel=1e-7)
    figures = {f.name: f.value for f in design(model, 350.0, 500.0).figures}
    # Measured there: micro images 23.3136 pixels apart that touch at f/4, the lens as it was used.
    assert figures["micro_image_pitch_px"] == pytest.approx(23.3136, rel=1e-4)
    assert figures["matched_f_number"] == pytest.approx(4, rel=5e-3)
    assert figures["micro_image_fill"] == pytest.approx(1, rel=5e-3)
    # Perwass and Wietzke: three types on a hexagonal grid cover from v = 2 on.
    assert figures["covering_depth"] == 2
    # Each type begins beyond it, as the camera is meant to be focused.
    assert all(part.depths[0] > 2 for part in usable_ranges(model))


@pytest.mark.parametrize(
    ("layout", "types"),
    [("rectangular", 1), ("rectangular", 2), ("hexagonal", 1), ("hexagonal", 3)],
)
def test_micro_images_just_cover_a_picture(layout: str, types: int) -> None:
    """Discs |v| p_M wide around the lenses of one type, on a fine grid of places."""
    array = MicroLensArray.model_validate(
        {
            "focal_length_mm": [1.0] * types,
            "pitch_mm": 1.0,
            "layout": layout,
            "sensor_distance_mm": 0.9,
        }
    )
    t, s = np.mgrid[-8:9, -8:9]
    if layout == "hexagonal":
        x, y = s + t % 2 / 2, t * sqrt(3) / 2
        # Three types: none has a neighbour of its own.
        kind = (s - t // 2 - t) % 3 if types == 3 else np.zeros_like(s)
    else:
        x, y, kind = s, t, (s + t) % types
    own = np.stack([x[kind == 0], y[kind == 0]], axis=-1)
    places = np.stack(np.meshgrid(*[np.linspace(0, 3, 121)] * 2), axis=-1).reshape(-1, 1, 2)
    gaps = np.sqrt(((places - own) ** 2).sum(axis=-1)).min(axis=1)
    depth = covering_depth(array)
    assert depth is not None
    # Round micro images that touch are |v| p_M wide.
    assert 2 * gaps.max() == pytest.approx(depth, rel=0.03)
    assert covering_depth(array.model_copy(update={"other_focal_lengths_mm": (1.0,) * 6})) is None


@pytest.mark.parametrize("name", ["f193-mla2", "f90-mla1", "lytro1-wide"])
@pytest.mark.parametrize("focus", [inf, 1500.0])
def test_a_sensor_at_the_focal_length_makes_a_standard_camera(name: str, focus: float) -> None:
    known = load_camera(name)
    m = known.micro_image_size
    array = known.micro_lenses
    usual = RayModel.focused(known, focus, m)
    a = np.array([-0.6, -1 / m, -1e-9, 0.0, 1e-9, 0.3, 1.0, 2.5])
    same = camera_of(known, {"sensor_distance": array.focal_length_mm})
    for model in (RayModel.focused(same, focus, m), RayModel.focused(same, focus, m, m)):
        for way in ("distance", "near_border", "far_border", "alpha"):
            found, wanted = getattr(model, way)(a), getattr(usual, way)(a)
            pair = (found, wanted) if way == "alpha" else (found.mm, wanted.mm)
            assert np.array_equal(*pair, equal_nan=True)
        assert condition_numbers(model, 1) == condition_numbers(usual, 1)
        assert model.baseline(3) == usual.baseline(3)
    # And one that is nearly there, with the same box.
    for off in (-1e-13, 1e-13):
        nearly = camera_of(known, {"sensor_distance": array.focal_length_mm * (1 + off)})
        assert not nearly.micro_lenses.standard
        model = RayModel.focused(nearly, focus, m, m)
        far = a[np.abs(a) > 1e-3]
        for way in ("distance", "near_border", "far_border"):
            found, wanted = getattr(model, way)(far), getattr(usual, way)(far)
            assert np.array_equal(found.states, wanted.states)
            keep = wanted.mm < 1e5
            assert found.mm[keep] == pytest.approx(wanted.mm[keep], rel=1e-10)
        # Sharp nearly from infinity on, in units of M pixels: from a = 1 to infinity and back.
        (part,) = usable_ranges(replace(model, box=None))
        assert abs(part.focus) > 1e11
        assert abs(part.depths[0]) > m - 1


def test_the_planes_lie_where_the_sign_says() -> None:
    """Behind the micro lenses by a M b_s, with M = p_M / p_p and the pupil far away."""
    for camera in KINDS.values():
        far = camera.main_lens.model_copy(update={"exit_pupil_mm": inf})
        model = RayModel.focused(camera.model_copy(update={"main_lens": far}), inf, 20)
        for prime in (-30, -7, -2, -1, 1, 2, 5, 20):
            a = prime / 20
            assert float(virtual_depth(model, a)) == pytest.approx(prime)
            behind = prime * 0.4
            # The thin lens images what is so far behind the micro lenses.
            image = 50.0 + behind
            found = model.distance(a)
            if behind > 0:
                assert float(found.mm) == pytest.approx(50 + 50 * image / (image - 50))
            else:
                assert found.state() is State.BEYOND_INFINITY
            assert float(model.alpha(a)) == pytest.approx(image / 50)
    assert float(virtual_depth(model, 0)) == 0


def image_side(model: RayModel, distance_mm: float) -> float:
    """Distance from the micro lenses to the image of an object, towards the main lens."""
    f = model.camera.main_lens.focal_length_mm
    from_lens = distance_mm - model.image_distance_mm
    return model.image_distance_mm - f * from_lens / (from_lens - f)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("box", [None, 1, 4, 12])
def test_borders_of_the_depth_of_field(kind: str, box: int | None) -> None:
    """There the outermost pixels' rays are as far apart as the box and a pixel are wide."""
    m, sign = 19, 1 if kind == "Galilean" else -1
    model = RayModel.focused(KINDS[kind], 560.0, m, box)
    checked = 0
    for prime in np.arange(1.0, 8.0, 0.5):
        a = sign * prime / m
        near, far = model.near_border(a), model.far_border(a)
        if near.state() is State.BLURRED:
            assert not sharpest_type(model, a).sharp
            assert far.state() is State.BLURRED
            assert isnan(near.mm)
            assert isnan(far.mm)
            assert depth_of_field(model, Fraction(a).limit_denominator(1000)) is None
            continue
        checked += 1
        assert near.mm < model.distance(a).mm < far.mm
        half = (m - 1) / 2
        position = a * half * model.camera.micro_lenses.pitch_mm
        for border in (near, far):
            z = image_side(model, float(border.mm))
            apart = 2 * (position + float(model.chief_ray_slope(-half, position)) * z)
            samples = prime if box is None else box
            wide = samples / m * model.camera.micro_lenses.pitch_mm
            assert abs(apart) == pytest.approx(wide + abs(z) * model.pixel_slope, rel=1e-7)
        assert model.box_at(a) == (prime if box is None else box)
    assert checked > 3


@given(
    st.sampled_from(sorted(KINDS)),
    st.sampled_from([None, 1, 6, 19]),
    st.floats(-2.5, 2.5),
    st.sampled_from(["near", "far", "centre"]),
)
@settings(max_examples=60, deadline=None)
def test_settings_of_borders(kind: str, box: int | None, a: float, border: Border) -> None:
    """The distance of a border, or of a plane, belongs to one setting."""
    model = RayModel.focused(KINDS[kind], 560.0, 19, box)
    found = getattr(model, {"centre": "distance"}.get(border, f"{border}_border"))(a)
    if found.state() is State.REAL and float(found.mm) < 1e5:
        back = model.focus_setting(float(found.mm), border)
        assert float(back) == pytest.approx(a, rel=1e-6, abs=1e-9)


def test_extremes() -> None:
    """Planes in the micro lenses, at infinity, and images infinitely far behind."""
    for camera in KINDS.values():
        model = RayModel.focused(camera, 560.0, 19)
        assert virtual_depth(model, [0.0, -0.0]).tolist() == [0, 0]
        assert blur_px(model, 0.0).tolist() == [inf] * 3
        assert not sharpest_type(model, [0.0, 1e-300, -1e-300, 5e-324]).sharp.any()
        assert float(setting_of_virtual_depth(model, 0.0)) == 0
        # With a far pupil a and v grow together.
        assert float(setting_of_virtual_depth(model, inf)) == pytest.approx(
            camera.sensor.pixel_pitch_mm
            / camera.micro_lenses.pitch_mm
            / (camera.micro_lenses.spacing_mm / model.exit_pupil_mm)
        )
        a = float(model.focus_setting(inf))
        assert float(model.distance(a + 1e-9).mm) > 1e9
        assert model.distance(a - 1e-9).state() is State.BEYOND_INFINITY
    # A pupil and b_s so that the image of infinity is at the focus: exactly parallel.
    far = camera_of(F193, {"exit_pupil": inf, "sensor_distance": 2.5})
    endless = RayModel.focused(far, inf, 13)
    assert endless.distance(0.0).state() is State.INFINITY
    assert endless.near_border(0.0).state() is State.BLURRED
    assert virtual_depth(endless, 1e90) > 1e90
    nearly = camera_of(far, {"sensor_distance": np.nextafter(2.75, 3)})
    for part in usable_ranges(RayModel.focused(nearly, inf, 13)):
        # Over infinity, and back from the other side.
        assert part.depths[0] > 0 > part.depths[1]
        assert isnan(part.near_mm) or part.near_mm < part.far_mm


def test_lengths_behind_the_micro_lenses_are_those_to_the_sensor() -> None:
    """What the micro lenses' focal length was in a standard camera, as far as it was one."""
    model = RayModel.focused(R12, R12_FOCUS, 23)
    spacing = R12.micro_lenses.spacing_mm
    assert model.pixel_slope == 0.0055 / spacing
    assert rayleigh_limit(R12) == pytest.approx(1.22 * 550e-6 * spacing / 0.12746416908944774)
    standard = camera_of(
        None, {"focal_length": 50, "lens_focal_length": 0.4, "lens_pitch": 0.1, "pixel": 0.005}
    )
    moved = RayModel.focused(GALILEAN, 560.0, 19)
    usual = RayModel.focused(standard, 560.0, 19)
    assert float(moved.micro_image_centre(1.0)) == float(usual.micro_image_centre(1.0))
    assert float(moved.baseline(4)) == float(usual.baseline(4))
    assert float(moved.tilt(4)) == float(usual.tilt(4))
    assert np.array_equal(moved.distance([0.1, 0.4]).mm, usual.distance([0.1, 0.4]).mm)
    assert extension_of_infinity(GALILEAN, -0.01) == extension_of_infinity(standard, -0.01)
    numbers = condition_numbers(moved, 0.2)
    assert "f_s" not in numbers
    assert numbers["b_s"] == pytest.approx(condition_numbers(usual, 0.2)["f_s"])
    # The rim of a micro image is blurred by what the micro lens is out of focus for the pupil.
    rims = pupil_blur_px(model)
    for rim, f in zip(rims, R12.micro_lenses.focal_lengths_mm, strict=True):
        off = 1 / spacing + 1 / model.exit_pupil_mm - 1 / f
        assert rim == pytest.approx(abs(off) * spacing * 0.12746416908944774 / 0.0055)


def test_slices_are_where_a_type_is_sharp() -> None:
    for camera, focus in ((R12, R12_FOCUS), (GALILEAN, 560.0), (KEPLERIAN, 560.0)):
        m = camera.micro_image_size
        for step in (None, Fraction(1, 4 * m)):
            model = RayModel.focused(camera, focus, m)
            cover = covering_slices(model, 350.0, 900.0, step=step)
            assert cover.slices
            for part in cover.slices:
                assert sharpest_type(model, float(part.a)).sharp
                assert part == depth_of_field(model, part.a)
            # Every place is in a slice or in a gap; what other slices see is in one of these.
            grid = step or Fraction(1, m)
            for number in range(-3 * m, 3 * m):
                other = depth_of_field(model, number * grid)
                if other is None or other.near_mm > 900 or other.far_mm < 350:
                    continue
                for gap in cover.gaps:
                    low, high = max(other.near_mm, gap[0], 350), min(other.far_mm, gap[1], 900)
                    assert low >= high - 1e-9
    with pytest.raises(InputError, match="not a range"):
        covering_slices(model, 900.0, 350.0)


def test_design_of_a_focused_camera() -> None:
    model = RayModel.focused(R12, R12_FOCUS, 23)
    found = design(model)
    # From where its types begin.
    assert found.near_mm == min(part.near_mm for part in usable_ranges(model))
    (plane,) = found.planes
    assert plane.focused is not None
    assert (plane.focused.box, plane.focused.lens_type) == (3, 2)
    # A sensor's pixel is |a| micro lenses wide on the plane.
    assert plane.focused.resolution_mm == pytest.approx(3 / 23 * plane.lens_sample_mm)
    assert plane.row()["virtual_depth"] == plane.focused.virtual_depth
    wide = design(RayModel.focused(R12, R12_FOCUS, 23, 23), 380.0, 450.0).planes[0]
    assert wide.focused is not None
    assert wide.focused.resolution_mm == pytest.approx(wide.lens_sample_mm)
    assert any("no lens type is sharp" in text for text in found.warnings)
    figures = {f.name for f in design(RayModel.focused(F193, 1500.0, 13), 500.0).figures}
    assert not {"sensor_distance_mm", "covering_depth"} & figures
    # A blur of the pupil as wide as a micro image leaves no f-number at which they touch.
    blurred = camera_of(R12, {"lens_focal_length": 0.01})
    values = {f.name: f.value for f in design(RayModel.focused(blurred, inf, 23), 300.0).figures}
    assert (values["matched_f_number"], values["matched_pupil_mm"]) == (None, 0)


def test_a_description_comes_back_as_it_was() -> None:
    for camera in (R12, GALILEAN, F193):
        assert Camera.model_validate(camera.model_dump()) == camera
        assert Camera.model_validate_json(camera.model_dump_json()) == camera
    assert camera_of(R12, {}).micro_lenses == R12.micro_lenses
    changed = camera_of(R12, {"sensor_distance": 0.3}).micro_lenses
    assert changed.focal_lengths_mm == R12.micro_lenses.focal_lengths_mm
    assert KEPLERIAN.micro_lenses.kinds == ("Keplerian",) * 3
    with pytest.raises(ValidationError):
        MicroLensArray(focal_length_mm=1, pitch_mm=1, sensor_distance_mm=-1)
