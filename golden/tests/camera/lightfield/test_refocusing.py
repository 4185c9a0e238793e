# SPDX-License-Identifier: Apache-2.0
"""Focal stacks, sharpness, Fourier slices, disparity."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from plenofir.camera.lightfield import (
    FocalStack,
    all_in_focus,
    compose,
    focal_stack,
    light_field_disparity,
    peak,
    sharpness,
    sharpness_curve,
    sub_aperture,
    views,
)
from plenofir.camera.lightfield.disparity import views_disparity
from plenofir.camera.lightfield.enlarged import Cubics, enlarged_view
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.errors import InputError
from plenofir.refocus import best_picture, refocus
from plenofir.refocus.sharpness import depth_index
from plenofir_studies.absolute_differences import sad_disparity
from plenofir_studies.fourier import (
    aperture_weights,
    fourier_slice,
    kaiser_bessel,
    kaiser_bessel_transform,
    shifted_views,
)


def texture(shape: tuple[int, int], seed: int = 0, blur: float = 1.0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 1, shape)
    smooth = ndimage.gaussian_filter(noise, blur)
    return (smooth - smooth.min()) / np.ptp(smooth)


def plane_light_field(m: int, a: float, shape: tuple[int, int] = (30, 40)) -> np.ndarray:
    """Raw image of one textured plane that is sharp at a."""
    fine = texture((shape[0] * 8 + 320, shape[1] * 8 + 320), blur=8.0)
    spline = ndimage.spline_filter(fine, 3)
    c = (m - 1) / 2
    images = np.empty((m, m, *shape))
    for v in range(m):
        for u in range(m):
            y = 160 + 8 * (np.arange(shape[0]) + a * (v - c))
            x = 160 + 8 * (np.arange(shape[1]) + a * (u - c))
            place = np.stack(np.meshgrid(y, x, indexing="ij"))
            images[v, u] = ndimage.map_coordinates(spline, place, order=3, prefilter=False)
    return compose(np.clip(np.rint(60000 * images), 0, 65535).astype(np.uint16))


@settings(max_examples=20)
@given(m=st.integers(2, 6), a=st.floats(-1.5, 1.5), seed=st.integers(0, 99), colour=st.booleans())
def test_fourier_slice_approximates_shifted_views(m, a, seed, colour) -> None:
    shape = (7 * m, 9 * m, 3) if colour else (7 * m, 9 * m)
    raw = np.random.default_rng(seed).integers(0, 65536, shape).astype(np.uint16)
    want = shifted_views(raw, m, a) / 65535
    assert want.shape == (7, 9, *shape[2:])
    # The narrow window of the thesis, and wider ones.
    for width, bound in ((3.5, 4e-3), (5.0, 2e-4), (6.0, 1e-5)):
        found = fourier_slice(raw, m, a, width=width) / 65535
        assert np.abs(found - want).max() < bound


def test_focus_settings_as_text() -> None:
    """As `refocus` takes them."""
    raw = np.random.default_rng(7).integers(0, 256, (6 * 9, 7 * 9)).astype(np.uint8)
    for method in (fourier_slice, shifted_views):
        want = method(raw, 9, 1 / 3)
        assert (method(raw, 9, "3/9") == want).all()
        assert (method(raw, 9, Fraction(3, 9)) == want).all()
        with pytest.raises(InputError, match="'much' is not a focus setting"):
            method(raw, 9, "much")


def test_shifted_views_at_whole_settings() -> None:
    """Where views move by whole lenses, Eq. 3.50 is a sum of moved views."""
    m = 3
    raw = np.random.default_rng(4).integers(0, 256, (8 * m, 9 * m)).astype(np.uint8)
    padded = np.zeros((3, 3, 10, 11))
    want = np.zeros((8, 9))
    for v in range(m):
        for u in range(m):
            padded[v, u, 1:-1, 1:-1] = sub_aperture(raw, m, v, u)
            want += padded[v, u, 1 - (v - 1) : 9 - (v - 1), 1 - (u - 1) : 10 - (u - 1)]
    assert shifted_views(raw, m, 1) == pytest.approx(want / 9, abs=1e-9)
    # And so is the golden refocuser: each micro image of its output holds one value.
    integer = refocus(raw, m, 1).astype(float)
    assert np.abs(integer[1::m, 1::m] - want / 9).max() <= 0.5
    with pytest.raises(InputError):
        shifted_views(raw, m, np.inf)


def test_weighted_views() -> None:
    """Eq. 2.9: A cos^4. The weighted mean is that of moved views; a round aperture cuts views."""
    m = 5
    model = RayModel.focused(load_camera("f193-mla2"), np.inf, m)
    step = float(model.baseline(1))
    weights = aperture_weights(model, 4.2 * step)
    assert (weights > 0).sum() == 13  # two views to each side, one where both coordinates differ
    slope = 0.009 / 2.75
    assert weights[2, 2] == 1
    assert weights[1, 1] == pytest.approx(np.cos(np.arctan(np.sqrt(2) * slope)) ** 4)
    assert (aperture_weights(model) > 0).all()  # its pupil is not known
    raw = np.random.default_rng(6).integers(0, 256, (8 * m, 9 * m)).astype(np.uint8)
    want = np.zeros((8, 9))
    for v, u in np.argwhere(weights > 0):
        moved = np.zeros((12, 13))
        moved[2:-2, 2:-2] = sub_aperture(raw, m, v, u)
        want += weights[v, u] * moved[4 - v : 12 - v, 4 - u : 13 - u]
    found = shifted_views(raw, m, 1, weights)
    assert found == pytest.approx(want / weights.sum(), abs=1e-9)
    assert shifted_views(raw, m, 1, np.full((m, m), 3.0)) == pytest.approx(
        shifted_views(raw, m, 1), abs=1e-9
    )
    for wrong in (np.ones((4, 5)), -np.ones((m, m)), np.zeros((m, m)), np.full((m, m), np.nan)):
        with pytest.raises(InputError, match="weights must be 5 x 5"):
            shifted_views(raw, m, 1, wrong)
    with pytest.raises(InputError, match="no view lies"):
        aperture_weights(RayModel.focused(load_camera("f193-mla2"), np.inf, 4), 0.1 * step)


def test_kaiser_bessel_transform_is_its_transform() -> None:
    x = np.linspace(-2, 2, 40001)
    for frequency in (0.0, 0.1, 0.3, 0.6):
        values = kaiser_bessel(x, 3.5, 7.0) * np.cos(2 * np.pi * frequency * x)
        want = kaiser_bessel_transform(np.array([frequency]), 3.5, 7.0)[0]
        assert np.trapezoid(values, x) == pytest.approx(want, rel=1e-3)


def test_blur_metric() -> None:
    """Eqs. 5.20-5.23 by hand, and its order: less blur, more sharpness."""
    region = texture((40, 50))
    spectrum = np.abs(np.fft.fft2(region)) ** 2
    total = spectrum[:20, :25].sum()
    assert sharpness(region) == pytest.approx((total - spectrum[:2, :2].sum()) / total, rel=1e-4)
    assert sharpness(region, low=0.2) == pytest.approx(
        (total - spectrum[:5, :6].sum()) / total, rel=1e-4
    )
    values = [sharpness(ndimage.gaussian_filter(region, s)) for s in (0, 1, 2, 4)]
    assert values == sorted(values, reverse=True)
    assert sharpness(np.full((9, 9), 7)) == pytest.approx(0, abs=1e-12)
    assert sharpness(np.zeros((9, 9))) == 0
    fine = np.kron(region, np.ones((3, 3)))
    assert sharpness(fine, 3) < sharpness(fine)
    with pytest.raises(InputError, match="3 x 9"):
        sharpness(np.zeros((9, 3)))
    with pytest.raises(InputError, match="at least 12 x 12"):
        sharpness(np.zeros((9, 9)), 3)


@given(st.floats(-0.4, 0.4), st.floats(0.1, 5))
def test_peak(place: float, bend: float) -> None:
    positions = np.arange(-4, 5) / 7
    curve = 3 - bend * (positions - place) ** 2
    assert peak(positions, curve) == pytest.approx(place, abs=1e-9)
    assert peak([0, 1, 2], np.array([3.0, 2, 1])) == 0


@pytest.mark.parametrize(("m", "a"), [(5, "-3/5"), (5, "2/5"), (4, "3/4"), (3, "1")])
def test_stack_is_sharpest_where_the_plane_is(m: int, a: str) -> None:
    number = int(a.split("/")[0]) / (int(a.split("/")[1]) if "/" in a else 1)
    raw = plane_light_field(m, number)
    settings_ = [f"{k}/{m}" for k in range(-m, 2 * m)]
    stack = focal_stack(raw, m, settings_)
    inside = (slice(6 * m, -6 * m),) * 2
    curve = sharpness_curve(stack, inside, m)
    assert curve.max() == 1
    assert settings_[int(np.argmax(curve))] == (a if "/" in a else f"{m}/{m}")
    with pytest.raises(InputError, match="no focus settings"):
        focal_stack(raw, m, [])


@pytest.mark.parametrize(("m", "rgb"), [(5, False), (4, True)])
def test_all_in_focus(m: int, rgb: bool) -> None:
    """Left half at -2/5, right half at 4/5: sharper than any slice, without the lenses' squares."""
    left, right = plane_light_field(m, -0.4), plane_light_field(m, 0.8)
    raw = np.where(np.arange(left.shape[1]) < left.shape[1] // 2, left, right)
    raw = np.stack([raw, raw // 2, raw], axis=2) if rgb else raw
    done: list[tuple[int, int]] = []
    found = all_in_focus(raw, m, progress=lambda *told: done.append(told))
    assert (found.shape, found.dtype) == (raw.shape, raw.dtype)
    assert done[-1] == (len(raw), len(raw))
    inside = (slice(6 * m, -6 * m),) * 2
    slices = focal_stack(raw, m, [f"{k}/{m}" for k in range(-m, m + 1)])
    sharpest = max(sharpness(image[inside], m) for image in slices)
    assert sharpness(found[inside], m) > sharpest
    central = sub_aperture(raw, m, m // 2, m // 2).repeat(m, 0).repeat(m, 1)
    assert sharpness(found[inside], m) > 0.9 * sharpness(central[inside], m)
    grey_ = found[inside].astype(float).reshape(*found[inside].shape[:2], -1)[..., 0]
    steps = np.abs(np.diff(grey_, axis=1)).mean(0)
    between = steps[m - 1 :: m].mean() / steps.mean()
    assert 0.7 < between < 1.4


@pytest.mark.parametrize("m", [4, 5, 6])
def test_all_in_focus_lies_over_the_refocused_pictures(m: int) -> None:
    """Two planes, each over that of its own picture: no part jumps from one to the other."""
    settings_ = -0.5, 1.0
    raws = [plane_light_field(m, a) for a in settings_]
    left = np.arange(raws[0].shape[1]) < raws[0].shape[1] // 2
    raw = np.where(left, *raws)
    lenses = np.where(left[::m], *settings_) * np.ones((raw.shape[0] // m, 1))
    found = all_in_focus(raw, m, lenses).astype(float)
    for a, columns in zip(settings_, (slice(6 * m, -26 * m), slice(26 * m, -6 * m)), strict=True):
        part = slice(6 * m, -6 * m), columns
        want = best_picture(raw, m, a)[part].astype(float)
        # Least squares of a small move: difference over slope.
        for axis, slope in enumerate(np.gradient(want)):
            moved = ((found[part] - want) * slope).sum() / (slope**2).sum()
            assert abs(moved) < 0.15, (a, axis)


def test_all_in_focus_takes_the_central_view_where_slices_differ() -> None:
    """Wrong settings in a quarter of the picture do not reduce sharpness there."""
    m = 5
    raw = plane_light_field(m, 0.6)
    right = np.full((30, 40), 0.6)
    wrong = np.where(np.arange(40) < 10, -1.5, right)
    good, bad = (all_in_focus(raw, m, settings).astype(float) for settings in (right, wrong))
    view = ndimage.zoom(sub_aperture(raw, m, 2, 2).astype(float), m, grid_mode=True, mode="nearest")
    # Away from the border, where views are missing, and from the change.
    there = slice(30, -30), slice(25, 40)
    assert np.abs(bad - view)[there].mean() < 1.2 * np.abs(good - view)[there].mean()
    slices = refocus(raw, m, "-7/5", interpolation=1).astype(float)
    assert np.abs(slices - view)[there].mean() > 3 * np.abs(bad - view)[there].mean()
    # Right parts hardly change: the noise level is taken from the best quarter of the lenses.
    assert np.abs(bad - good)[30:-30, 70:-30].mean() < 0.1 * np.abs(good - view)[there].mean()
    with pytest.raises(InputError, match="less than one micro image"):
        all_in_focus(np.zeros((4, 4), np.uint8), 5)


@pytest.mark.parametrize("m", [15, 16])
def test_all_in_focus_has_no_squares_beside_a_bright_disc(m: int) -> None:
    rng = np.random.default_rng(2)
    rows, columns = np.mgrid[:24, :26]
    disc = np.where(np.hypot(rows - 11.3, columns - 12.6) < 6, 220, 40)
    view = np.rint(disc + rng.normal(0, 4, disc.shape)).astype(np.uint8)
    # All views alike: pixels beside each other differ little, also where lenses meet.
    picture = all_in_focus(view.repeat(m, 0).repeat(m, 1), m, np.zeros(view.shape))
    for lines in (picture, picture.T):
        steps = np.abs(np.diff(lines.astype(int), axis=1))
        assert (steps[:, 1:-1] - np.maximum(steps[:, :-2], steps[:, 2:])).max() < 5


@pytest.mark.parametrize("focus", [-1.0, 0.0, 0.6])
def test_all_in_focus_stays_black_where_cubics_fall_below_it(focus: float) -> None:
    m, white = 5, 65535
    view = np.zeros((24, 28))
    view[5:9, 6:11] = white
    raw = view.repeat(m, 0).repeat(m, 1) + np.random.default_rng(0).normal(0, 655, (24 * m, 28 * m))
    raw = np.clip(raw, 0, white).astype(np.uint16)
    # Black pixels whose value fell below 0 were the brightest ones.
    assert all_in_focus(raw, m, np.full(view.shape, focus))[12 * m :].max() < white / 4


@pytest.mark.parametrize("m", [3, 4])
@pytest.mark.parametrize("lenses", [(1, 1), (1, 9), (9, 1), (2, 2)])
def test_all_in_focus_of_few_lenses(m: int, lenses: tuple[int, int]) -> None:
    raw = np.full((lenses[0] * m, lenses[1] * m, 3), 90, np.uint8)
    assert np.array_equal(all_in_focus(raw, m, np.zeros(lenses)), raw)


@given(st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_even_cubics_stay_between_lines_and_meet_in_them(count: int, seed: int) -> None:
    lines = np.random.default_rng(seed).normal(0, 1, (count, 3))
    cubics = Cubics(lines, even=True)
    places = np.arange(-8, 8 * count + 9) / 8
    values = cubics.at(places)
    before = np.clip(np.floor(places), 0, count - 1).astype(int)
    after = np.clip(np.ceil(places), 0, count - 1).astype(int)
    ends = lines[before], lines[after]
    assert (values >= np.minimum(*ends) - 1e-12).all()
    assert (values <= np.maximum(*ends) + 1e-12).all()
    assert np.abs(cubics.at(np.arange(count)) - lines).max() < 1e-12


def test_even_cubics_are_splines_where_these_do_not_overshoot() -> None:
    lines = np.arange(20.0)[:, np.newaxis] ** 1.5
    places = np.linspace(5, 14, 50)
    splines = ndimage.map_coordinates(lines[:, 0], [places], order=3)
    assert np.abs(Cubics(lines, even=True).at(places)[:, 0] - splines).max() < 1e-3


@pytest.mark.parametrize("rgb", [False, True])
def test_slices_made_one_by_one_give_the_same(rgb: bool) -> None:
    m, places = 5, [f"{k}/5" for k in range(-3, 4)]
    grey_ = np.where(np.arange(200) < 100, plane_light_field(m, -0.4), plane_light_field(m, 0.4))
    raw = np.stack([grey_, grey_ // 2, 65535 - grey_], axis=2) if rgb else grey_
    done: list[tuple[int, int]] = []
    lazy = FocalStack(raw, m, places, lambda *told: done.append(told))
    stack = focal_stack(raw, m, places)
    assert len(lazy) == len(stack)
    for one, other in zip(lazy, stack, strict=True):
        assert np.array_equal(one, other)
    assert done == [(number, 7) for number in range(1, 8)]
    assert np.array_equal(
        sharpness_curve(lazy, micro_image_size=m), sharpness_curve(stack, micro_image_size=m)
    )
    done.clear()
    assert np.array_equal(depth_index(lazy, m).image, depth_index(stack, m).image)
    # All slices, then those of two bands.
    shares = [number / there for number, there in done[7:]]
    assert len(shares) == 14
    assert shares == sorted(shares)
    assert (shares[6], shares[-1]) == (128 / len(raw), 1)


@settings(max_examples=8)
@given(a=st.floats(-0.4, 1.2), m=st.integers(3, 7))
def test_disparity_of_a_plane(a: float, m: int) -> None:
    """Disparity between neighbouring views is the focus setting, between samples too."""
    found = light_field_disparity(plane_light_field(m, a), m, search=(-0.7, 1.5))
    inside = found.pixels_per_view[10:-10, 10:-10]
    # Small M has small gaps between views, and so less resolution.
    assert np.median(inside) == pytest.approx(a, abs=0.01 + 0.03 / (m // 2))
    assert np.abs(inside - a).mean() < 0.01 + 0.04 / (m // 2)
    assert np.median(found.confidence) > (0.7 if m > 5 else 0.5)


def test_absolute_differences_of_a_plane() -> None:
    images = views(plane_light_field(5, 0.37), 5)
    others = [(images[2, 0], (0.0, -2.0)), (images[4, 2], (2.0, 0.0))]
    found = sad_disparity(images[2, 2], others, search=(-0.7, 1.5))[10:-10, 10:-10]
    assert np.median(found) == pytest.approx(0.37, abs=0.02)


def test_edges_bound_disparity() -> None:
    """A dark plane before a bright one: its outline is not moved."""
    m, rows, columns = 5, 40, 50
    near, far = (
        plane_light_field(m, 0.9, (rows, columns)),
        plane_light_field(m, 0.1, (rows, columns)),
    )
    raw = 32000 + far // 3
    c = (m - 1) // 2
    for v, u in np.ndindex(m, m):
        t, s = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
        there = np.hypot(t - 20 + 0.9 * (v - c), s - 25 + 0.9 * (u - c)) < 10
        raw[v::m, u::m][there] = near[v::m, u::m][there] // 3
    t, s = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    true = np.where(np.hypot(t - 20, s - 25) < 10, 0.9, 0.1)
    found = light_field_disparity(raw, m).pixels_per_view
    assert (np.abs(found - true) > 0.1)[6:-6, 6:-6].mean() < 0.04


@pytest.mark.parametrize("level", [0, 90, 255])
def test_disparity_of_nothing(level: int) -> None:
    found = light_field_disparity(np.full((60, 60), level, np.uint8), 3)
    assert (found.confidence == 0).all()
    assert (found.pixels_per_view == 0).all()


def test_disparity_of_noise_is_not_sure() -> None:
    """Noise that no view shares, and dark views in the corners, as round micro images have."""
    raw = np.random.default_rng(5).normal(30000, 3000, (40 * 5, 40 * 5)).astype(np.uint16)
    found = light_field_disparity(raw, 5)
    assert (found.confidence > 0.9).mean() < 0.02
    raw = plane_light_field(5, 0.5)
    for v, u in ((0, 0), (0, 4), (4, 0), (4, 4)):
        raw[v::5, u::5] //= 50
    found = light_field_disparity(raw, 5)
    inside = found.pixels_per_view[10:-10, 10:-10]
    assert np.abs(inside - 0.5).mean() < 0.02


def test_large_pictures_are_matched_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts with a margin give what the whole gives."""
    images = views(plane_light_field(3, 0.4, (140, 70)), 3)
    whole, told = views_disparity(images), list[tuple[int, int]]()
    monkeypatch.setattr("plenofir.camera.lightfield.disparity._MOST_COSTS", 1)
    parts = views_disparity(images, progress=lambda *done: told.append(done))
    assert told[-1] == (6, 6)
    assert np.abs(parts.pixels_per_view - whole.pixels_per_view).max() < 0.03


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"others": []}, "no other view"),
        ({"gap": (0, 0)}, "no other view"),
        ({"window": 4}, "odd"),
        ({"search": (1.0, 1.0)}, "smaller"),
        ({"search": (0.0, np.inf)}, "smaller"),
        ({"search": (0.0, 10.0)}, "beyond the views"),
        ({"shape": (4, 4)}, "must have one size"),
    ],
)
def test_bad_disparity(change, message) -> None:
    other = np.zeros(change.pop("shape", (9, 9)), np.uint8)
    others = change.pop("others", [(other, change.pop("gap", (0, 1)))])
    change = {"search": (-1.0, 2.0), **change}
    with pytest.raises(InputError, match=message):
        sad_disparity(np.zeros((9, 9), np.uint8), others, **change)


def test_one_view_has_no_disparity() -> None:
    with pytest.raises(InputError, match="M = 1"):
        light_field_disparity(np.zeros((9, 9), np.uint8), 1)
    with pytest.raises(InputError, match="no other view"):
        views_disparity(np.zeros((1, 1, 9, 9), np.uint8))


@pytest.mark.parametrize("times", [1, 3, 4])
@pytest.mark.parametrize(("shape", "kind"), [((30, 21), np.uint16), ((1, 9, 3), np.uint8)])
def test_enlarged_view_is_that_of_scipy(times: int, shape: tuple[int, ...], kind: type) -> None:
    most = np.iinfo(kind).max
    view = np.random.default_rng(times).integers(0, most, shape, endpoint=True).astype(kind)
    zoom = (times, times, 1)[: len(shape)]
    want = ndimage.zoom(view.astype(float), zoom, order=3, mode="nearest", grid_mode=True)
    found = enlarged_view(view, times)
    assert found.dtype == kind
    assert np.abs(found - np.clip(want, 0, most)).max() < 0.501
