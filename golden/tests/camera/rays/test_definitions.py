# SPDX-License-Identifier: Apache-2.0
"""The ray model against its definitions in exact fractions: rays that meet."""

from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from math import atan, degrees, inf, isnan, nextafter, tan

import numpy as np
import pytest

from plenofir.camera.rays import (
    Camera,
    MainLens,
    MicroLensArray,
    RayModel,
    Sensor,
    State,
    condition_numbers,
    covering_slices,
    extension_of_infinity,
    load_camera,
    measure_pupil,
    measured_focal_length,
)
from plenofir.camera.rays.distances import BEYOND, REAL
from plenofir.camera.rays.focused import Origin
from plenofir.camera.rays.precise import CONTEXT, Line, split
from plenofir.ground.errors import InputError
from plenofir_studies.intersections import image_side_distance, object_side_distance

F193 = load_camera("f193-mla2")
BORDERS = {"centre": 0, "near": 1, "far": -1}


def camera(pupil: float = 111.0324, vertex: float | None = 98.25, **lens: float) -> Camera:
    """The f193 camera with another main lens."""
    main = F193.main_lens.model_dump() | {"exit_pupil_mm": pupil, "front_vertex_mm": vertex}
    return F193.model_copy(update={"main_lens": MainLens(**{**main, **lens})})


@dataclass
class Exact:
    """The chief rays of a model, nothing rounded."""

    model: RayModel

    def __post_init__(self) -> None:
        """Its lengths."""
        known = self.model.camera
        self.f = Fraction(known.main_lens.focal_length_mm)
        self.e = Fraction(self.model.extension)
        # The object-side principal plane.
        self.front = self.f + self.e + Fraction(known.main_lens.principal_plane_separation_mm)
        self.f_s = Fraction(known.micro_lenses.focal_length_mm)
        self.pitch = Fraction(known.micro_lenses.pitch_mm)
        self.pixel = Fraction(known.sensor.pixel_pitch_mm)

    def slope(self, i: Fraction, s: Fraction) -> Fraction:
        pupil = self.model.camera.main_lens.exit_pupil_mm
        from_pupil = 0 if pupil == inf else -s / (Fraction(pupil) + self.e)
        return from_pupil - i * self.pixel / self.f_s

    def refracted(self, slope: Fraction, height: Fraction) -> tuple[Fraction, Fraction]:
        """Slope in object space, and height at both principal planes."""
        at_lens = height + slope * (self.f + self.e)
        return slope - at_lens / self.f, at_lens

    def object_ray(self, i: Fraction, s: Fraction) -> tuple[Fraction, Fraction]:
        return self.refracted(self.slope(i, s), s)

    def upper_ray(self, a: Fraction, border: str) -> tuple[Fraction, Fraction]:
        """Slope and height at the micro lenses; the other ray of the pair mirrors it."""
        c, k = Fraction(self.model.micro_image_size - 1, 2), BORDERS[border]
        position = a * c * self.pitch
        return self.slope(-(c - Fraction(k, 2)), position), position + k * self.pitch / 2

    def distance(self, a: float, border: str) -> tuple[State, Fraction | None]:
        slope, height = self.refracted(*self.upper_ray(Fraction(a), border))
        if not slope:
            return State.INFINITY, None
        place = self.front - height / slope
        vertex = Fraction(self.model.camera.main_lens.front_vertex_mm or 0)
        if place > self.front + vertex:
            return State.REAL, place
        # The upper ray rises towards the scene.
        return (State.BEYOND_INFINITY, None) if slope > 0 else (State.INSIDE_LENS, place)

    def setting(self, distance: float, border: str) -> Fraction:
        """By linear interpolation: the height at the distance is linear in a."""
        heights = []
        for a in (0, 1):
            slope, height = self.refracted(*self.upper_ray(Fraction(a), border))
            where = slope if distance == inf else height + slope * (Fraction(distance) - self.front)
            heights.append(where)
        return heights[0] / (heights[0] - heights[1])


def close(found: float, wanted: Fraction, ulps: float = 4) -> bool:
    return abs(Fraction(float(found)) - wanted) <= abs(wanted) * Fraction(ulps) / 2**53


MODELS = [
    RayModel.focused(camera(pupil, vertex), focus, size)
    for pupil, vertex, focus, size in (
        (111.0324, 98.25, inf, 13),
        (111.0324, None, 3000.0, 2),
        (inf, 98.25, inf, 13),
        (inf, None, 1500.0, 5),
        (-300.0, 98.25, 800.0, 40),
        (5000.0, -20.0, 1e9, 9),
        (17.3, 98.25, 1000.0, 14),
    )
]
# Units so that 1 mm is nearly nothing, or much.
SCALES = (2.0**-50, 2.0**50)


def scaled(known: Camera, scale: float) -> Camera:
    """The camera in other units."""
    data = known.model_dump()
    for part in data.values():
        if isinstance(part, dict):
            for name, value in part.items():
                if name.endswith("_mm") and value is not None:
                    part[name] = value * scale
    return Camera.model_validate(data)


def scaled_model(model: RayModel, scale: float) -> RayModel:
    with_unit = CONTEXT.multiply(model.extension, Decimal(scale))
    return RayModel(scaled(model.camera, scale), with_unit, model.micro_image_size)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("border", BORDERS)
def test_distances_are_where_exact_rays_meet(model: RayModel, border: str) -> None:
    """To the last digits, next to infinity too, where all but the low parts cancel."""
    exact, way = Exact(model), f"{border}_border" if border != "centre" else "distance"
    endless = float(exact.setting(inf, border))
    about = [endless * (1 + n * 2.0**-52) for n in (-3, -1, 0, 1, 3)]
    settings = [*about, *np.linspace(-4, 9, 27), 1e-9, -1e-9, 1e100, -1e100]
    found = getattr(model, way)(settings)
    for n, a in enumerate(settings):
        state, place = exact.distance(a, border)
        assert found.state(n) is state, a
        assert isnan(found.mm[n]) if place is None else close(found.mm[n], place), a


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("border", BORDERS)
def test_settings_are_those_of_exact_rays(model: RayModel, border: str) -> None:
    """Also next to the distance of plane 0 and to that which no plane has."""
    exact = Exact(model)
    ends = [exact.distance(a, border)[1] for a in (1e300, 0.0)]
    near = [float(d) * (1 + n * 2.0**-52) for d in ends if d is not None for n in (-1, 1)]
    distances = [*near, 0.0, -50.0, 300.0, 1100.0, 1e5, 1e100, -1e100, inf]
    found = model.focus_setting(distances, border)  # type: ignore[arg-type]
    for n, distance in enumerate(distances):
        assert close(found[n], exact.setting(distance, border), 8), distance


@pytest.mark.parametrize("bad", [-inf, float("nan"), nextafter(1e100, inf)])
def test_distances_without_a_setting(bad: float) -> None:
    with pytest.raises(InputError, match=r"a distance is a number of mm up to 1e\+100, or inf"):
        MODELS[0].focus_setting([1000.0, bad])


# All its products and quotients are exact: b_U' - b_U of a plane is 4 a mm, p_p / p_M / f_s 1/32.
PLAIN = Camera(
    name="plain",
    main_lens=MainLens(focal_length_mm=64.0, exit_pupil_mm=inf),
    micro_lenses=MicroLensArray(focal_length_mm=2.0, pitch_mm=0.125),
    sensor=Sensor(pixel_pitch_mm=0.0078125),
)


def plain(size: int = 13, **lens: float) -> RayModel:
    main = {"focal_length_mm": 64.0, "exit_pupil_mm": inf} | lens
    return RayModel(PLAIN.model_copy(update={"main_lens": MainLens(**main)}), Decimal(0), size)


def test_planes_exactly_at_the_limits() -> None:
    # Plane a lies at 128 + 128 / a mm.
    assert plain().distance([1.0, 2.0]).mm.tolist() == [256.0, 192.0]
    at_vertex = plain(front_vertex_mm=192.0).distance([1.0, nextafter(1.0, 0)])
    assert [at_vertex.state(n) for n in (0, 1)] == [State.INSIDE_LENS, State.REAL]
    # In the principal plane itself, with rays that open towards the scene.
    at_plane = plain().distance([-2.0, nextafter(-2.0, 0)])
    assert [at_plane.state(n) for n in (0, 1)] == [State.BEYOND_INFINITY] * 2
    assert plain().distance(nextafter(-2.0, -9)).state() is State.REAL
    # The far end of all planes is the focal point in front of the lens.
    with pytest.raises(InputError, match="no plane"):
        plain().focus_setting([500.0, 128.0])
    # Of two pixels, the inner rays of plane -1 are one: they meet anywhere, and so nowhere.
    assert plain(2).near_border(-1.0).state() is State.INFINITY


def test_more_planes_than_one_block_has() -> None:
    a = np.linspace(-2, 3, 20001)
    found = MODELS[0].distance(a)
    for n in (0, 8191, 8192, 8193, 16384, 20000):
        one = MODELS[0].distance(a[n])
        assert found.state(n) is one.state()
        assert found.mm[n] == pytest.approx(float(one.mm), rel=0, nan_ok=True)


@pytest.mark.parametrize("model", MODELS)
def test_alpha_is_a_quotient_of_image_distances(model: RayModel) -> None:
    exact, settings = Exact(model), [-0.4, 0.0, 0.3, 1.0, 2.5]
    alpha = model.alpha(settings)
    for n, a in enumerate(settings):
        slope, height = exact.upper_ray(Fraction(a), "centre")
        image = exact.f + exact.e + height / slope
        assert alpha[n] == pytest.approx(float(image / (exact.f + exact.e)), rel=1e-14)
    assert model.focus_setting_of_alpha(alpha) == pytest.approx(settings, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("focus", [inf, 800.0])
def test_image_planes_where_no_plane_lies(focus: float) -> None:
    telecentric = RayModel.focused(camera(inf), focus, 13)
    for alpha in (inf, [0.9, float("nan")]):
        with pytest.raises(InputError, match="no plane lies at this alpha"):
            telecentric.focus_setting_of_alpha(alpha)
    pupil = plain(exit_pupil_mm=-32.0)
    with pytest.raises(InputError, match="no plane lies at this alpha"):
        pupil.focus_setting_of_alpha([1.0, 1.5])
    # Pupils 1 and -1 mm away, and image planes at as much: sums of 0, 1 and -1 per mm.
    for length in (1.0, -1.0):
        for alpha in (1 - 1 / 64, 1 + 1 / 64, 1 + 1 / 128, inf):
            there = plain(exit_pupil_mm=length)
            if (alpha - 1) * 64 == -length:
                continue
            back = there.focus_setting_of_alpha(alpha)
            assert float(there.alpha(back)) == pytest.approx(alpha) or alpha == inf


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("gap", [-7, 1, 30])
def test_virtual_cameras_are_where_exact_rays_of_a_view_meet(model: RayModel, gap: int) -> None:
    exact = Exact(model)

    def meeting(first: tuple[Fraction, Fraction], second: tuple[Fraction, Fraction]) -> Fraction:
        return exact.front + (second[1] - first[1]) / (first[0] - second[0])

    one, other = (exact.object_ray(Fraction(gap), s) for s in (Fraction(0), exact.pitch))
    place = meeting(one, other)
    height = one[1] + one[0] * (place - exact.front)
    assert model.entrance_pupil_mm == pytest.approx(float(place), rel=1e-14)
    assert float(model.virtual_camera(gap)) == pytest.approx(float(height), rel=1e-13)
    assert float(model.baseline(gap)) == pytest.approx(-float(height), rel=1e-13)
    vertex = model.camera.main_lens.front_vertex_mm
    from_vertex = model.entrance_pupil_from_vertex_mm
    if vertex is None or from_vertex is None:
        assert vertex is from_vertex is None
    else:
        wanted = exact.front + Fraction(vertex) - place
        assert from_vertex == pytest.approx(float(wanted), rel=1e-14)
    slope, height = model.object_ray(gap, 0.125)
    wanted = exact.object_ray(Fraction(gap), exact.pitch)
    assert (float(slope), float(height)) == pytest.approx([float(w) for w in wanted], rel=1e-12)
    # The axis of a virtual camera is the ray of its view through the central micro lens.
    axes = {i: exact.object_ray(Fraction(i), Fraction(0))[0] for i in (0, 4, gap, 4 + gap)}
    angles = {i: atan(slope) for i, slope in axes.items()}
    assert float(model.tilt(gap)) == pytest.approx(degrees(-angles[gap]), rel=1e-12)
    assert float(model.tilt(gap, 4)) == pytest.approx(degrees(angles[4] - angles[4 + gap]), 1e-9)
    for disparity in (-1.5, 0.75, 2.0):
        seen = exact.object_ray(Fraction(gap), -Fraction(disparity) * gap * exact.pitch)
        straight = exact.object_ray(Fraction(0), Fraction(0))
        away = meeting(straight, seen) - place
        found = model.depth(disparity, gap, unit="pixels per view")
        if away > 0:
            assert (found.state(), float(found.mm)) == (State.REAL, pytest.approx(float(away)))
            # From a view beside it: the baseline over the angle between the two rays.
            step = float(model.baseline(gap) / away) - tan(angles[gap] - angles[0])
            sight = step + tan(angles[4 + gap] - angles[4])
            beside = model.depth(disparity * gap, gap, view=4)
            assert float(beside.mm) == pytest.approx(float(model.baseline(gap)) / sight, rel=1e-9)
            back = model.disparity(float(beside.mm), gap, view=4)
            assert float(back) == pytest.approx(disparity * gap)
        else:
            assert found.state() is State.BEYOND_INFINITY
            assert isnan(found.mm)
    assert (model.depth(inf, 6).state(), float(model.depth(inf, 6).mm)) == (State.REAL, 0.0)


@pytest.mark.parametrize("gap", [1, -2])
def test_infinite_disparities(gap: int) -> None:
    """An object in the pupil, reached from either side."""
    found = plain().depth([inf, -inf], gap, unit="pixels per view")
    assert found.states.tolist() == [REAL, BEYOND]


def test_baselines_at_the_exit_pupil() -> None:
    model, telecentric = (
        RayModel.focused(camera(), 900.0, 13),
        RayModel.focused(camera(inf), inf, 13),
    )
    exact = Exact(model)
    heights = [
        -exact.slope(Fraction(i), Fraction(0)) * (Fraction(111.0324) + exact.e) for i in (1, -7)
    ]
    found = model.exit_pupil_baseline([1, -7, 0])
    assert found == pytest.approx([*map(float, heights), 0.0], rel=1e-14)
    assert telecentric.exit_pupil_baseline([0, 1, -1]).tolist() == [0.0, inf, -inf]
    assert telecentric.pupil_ratio == 1.0


def test_micro_image_centres_lie_on_lines_from_their_origins() -> None:
    model = RayModel.focused(camera(aperture_stop_mm=90.0), 720.0, 13)
    e, s = model.extension_mm, 1.75
    places: dict[Origin, float] = {
        "exit pupil": 111.0324 + e,
        "principal plane": F193.main_lens.focal_length_mm + e,
        "aperture stop": 90.0 + e,
    }
    assert model.aperture_stop_mm == pytest.approx(90.0 + e)
    for origin, place in places.items():
        # From the axis there through the micro lens to the sensor.
        wanted = s * (place + 2.75) / place
        assert float(model.micro_image_centre(s, origin)) == pytest.approx(wanted, rel=1e-14)
    assert float(model.micro_image_centre(s, "ideal")) == s
    assert model.micro_lens_position([0, 3]).tolist() == [0.0, 0.375]


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("focus", [inf, 1500.0])
def test_the_intersections_of_the_thesis(border: str, focus: float) -> None:
    model = RayModel.focused(camera(), focus, 4)
    for a in (-0.3, 0.4, 1.7):
        _, place = Exact(model).distance(a, border)
        if place is not None:
            for way in (image_side_distance, object_side_distance):
                assert float(way(model, a, BORDERS[border])) == pytest.approx(float(place), 1e-9)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("model", MODELS)
def test_nothing_depends_on_the_unit(model: RayModel, scale: float) -> None:
    """A millimetre is no special length: with all lengths in another unit, results are in it."""
    other = scaled_model(model, scale)
    a = [-2.0, -0.3, -1e-3, 0.0, 1e-3, 0.7, 3.0, 8.0]
    for way in ("distance", "near_border", "far_border"):
        one, two = getattr(model, way)(a), getattr(other, way)(a)
        assert one.states.tolist() == two.states.tolist()
        assert two.mm / scale == pytest.approx(one.mm, rel=1e-14, nan_ok=True)
    for d in (260.0, 1e4, inf):
        setting = model.focus_setting(d)
        assert float(other.focus_setting(d * scale)) == pytest.approx(float(setting), rel=1e-13)
    alpha = model.alpha([0.3, 2.0])
    assert other.alpha([0.3, 2.0]) == pytest.approx(alpha, rel=1e-14)
    assert other.focus_setting_of_alpha(alpha) == pytest.approx([0.3, 2.0], rel=1e-12)
    for name in ("entrance_pupil_mm", "exit_pupil_mm", "image_distance_mm"):
        assert getattr(other, name) == pytest.approx(getattr(model, name) * scale, rel=1e-14)
    depths = [m.depth([-3.0, 0.0, 1e-3, 2.0], 5, view=-2) for m in (model, other)]
    assert depths[0].states.tolist() == depths[1].states.tolist()
    assert depths[1].mm / scale == pytest.approx(depths[0].mm, rel=1e-13, nan_ok=True)
    assert other.disparity(50 * scale, 5) == pytest.approx(model.disparity(50.0, 5), rel=1e-13)
    assert float(other.tilt(5, 1)) == pytest.approx(float(model.tilt(5, 1)), rel=1e-13)
    numbers = [condition_numbers(m, 0.7, "near") for m in (model, other)]
    assert numbers[1] == pytest.approx(numbers[0], rel=1e-12)
    covers = [covering_slices(m, 400.0 * s, 2e3 * s) for m, s in ((model, 1.0), (other, scale))]
    assert [s.a for s in covers[0].slices] == [s.a for s in covers[1].slices]
    pupils = [measure_pupil(m, 14.2, 1e-3) for m in (model, other)]
    assert pupils[1].distance_mm == pytest.approx(pupils[0].distance_mm * scale, rel=1e-12)
    assert pupils[1].error_mm == pytest.approx(pupils[0].error_mm * scale, rel=1e-12)
    assert pupils[1].agrees == pupils[0].agrees
    lengths = [
        measured_focal_length(m, replace(p, distance_mm=40 * s), m, replace(p, distance_mm=90 * s))
        for m, p, s in ((model, pupils[0], 1.0), (other, pupils[1], scale))
    ]
    assert [n / scale for n in lengths[1]] == pytest.approx(lengths[0], rel=1e-12, nan_ok=True)
    back = extension_of_infinity(other.camera, -0.2)
    assert back / scale == pytest.approx(extension_of_infinity(model.camera, -0.2), rel=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_lines_keep_their_digits_where_their_terms_cancel(seed: int) -> None:
    """One rounding of the sum, and some 2^-104 of the terms (seeds 1 and 2)."""
    rng = np.random.default_rng(seed)
    for _ in range(300):
        constant, factor = (
            CONTEXT.add(Decimal(rng.normal()), Decimal(rng.normal()) * Decimal(2.0**-53))
            for _ in range(2)
        )
        x = -float(constant / factor) * (1 + rng.integers(-2, 3) * 2.0**-52)
        x = x if rng.random() < 0.8 else rng.normal()
        found = Line.of(constant, factor).at(np.array([x]), split(np.array([x])))
        terms = Fraction(constant), Fraction(factor) * Fraction(x)
        off = abs(Fraction(float(found[0])) - sum(terms))
        assert off <= abs(sum(terms)) / 2**52 + sum(map(abs, terms)) / 2**101


def test_halves_have_26_bits() -> None:
    rng = np.random.default_rng(3)
    x = np.concatenate(
        [rng.normal(size=2000), 1 + np.arange(64) * 2.0**-52, 1 + 2.0 ** -np.arange(9, 52)]
    )
    for value, high, low in zip(x, *split(x), strict=True):
        assert Fraction(float(high)) + Fraction(float(low)) == Fraction(float(value))
        for half in (high, low):
            numerator = abs(Fraction(float(half)).numerator)
            while numerator and numerator % 2 == 0:
                numerator //= 2
            assert numerator < 2**26
