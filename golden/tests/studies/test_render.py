# SPDX-License-Identifier: Apache-2.0
"""The synthetic camera: every pixel sees the point predicted by the ray model."""

from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.rays import RayModel, load_camera
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import (
    TexturedPlane,
    field_of_view,
    micro_image_pitch,
    pinhole_view,
    render,
    with_pitch,
)
from plenofir_studies.synthetic.render import box_kernel


def camera(focus_mm: float = inf, m: int = 5) -> RayModel:
    return RayModel.focused(load_camera("f197-mla2"), focus_mm, m)


def test_pitch() -> None:
    """Micro images lie farther apart than micro lenses: rays leave the exit pupil."""
    model = camera()
    assert micro_image_pitch(model) == pytest.approx(0.125 / 0.009 * (1 + 2.75 / 100.5))
    other = with_pitch(model, 11.03)
    assert micro_image_pitch(other) == pytest.approx(11.03)
    assert other.camera.micro_lenses == model.camera.micro_lenses


@given(st.floats(0.5, 30))
def test_box_kernel(width: float) -> None:
    kernel = box_kernel(width)
    assert kernel.sum() == pytest.approx(1)
    assert len(kernel) % 2 == 1
    # Its second moment is that of a box, up to the samples' own.
    x = np.arange(len(kernel)) - len(kernel) // 2
    if width >= 1:
        assert abs((kernel * x**2).sum() - width**2 / 12) <= 0.18


@settings(max_examples=12)
@given(
    focus=st.sampled_from([inf, 4000.0, 2500.0]),
    a=st.floats(-0.3, 1.3),
    rotation=st.floats(-4, 4),
    layout=st.sampled_from(["rectangular", "hexagonal-rows", "hexagonal-columns"]),
)
def test_a_ramp_is_seen_where_the_rays_hit_it(focus, a, rotation, layout) -> None:
    """A ramp stays a ramp through any averaging: each pixel holds the place that its ray hits."""
    model = camera(focus)
    distance = model.distance(a).mm
    if np.isnan(distance):
        distance = 20000.0
    width = 4 * field_of_view(model, float(distance), 12) + 50
    ramp = np.linspace(0, 1, 801) * np.ones((801, 1))
    capture = render(
        model,
        [TexturedPlane(ramp, float(distance), width)],
        (9, 9),
        rotation_degrees=rotation,
        layout=layout,
        form="square",
        radius=9.0,
        level=1.0,
    )
    step = width / 801
    for y, x in ((40, 50), (63, 31), (8, 70)):
        t, s, offset = capture.grid.nearest(np.array([float(y), float(x)]))
        centre = capture.grid.centres(t, s)
        middle = (np.array(capture.raw.shape) - 1) / 2
        pixel = 0.009
        # Back from the micro image's centre to the micro lens (Eq. 3.22).
        position = (centre - middle) * pixel / (1 + 2.75 / model.exit_pupil_mm)
        slope, height = model.object_ray(offset, position)
        lens = model.camera.main_lens
        z = distance - model.image_distance_mm - lens.principal_plane_separation_mm
        hit = slope[1] * z + height[1]
        chief = model.chief_ray_slope(offset, position)
        light = 1 / (1 + (chief**2).sum()) ** 2
        want = light * (0.5 - hit / (step * 800))
        assert capture.raw[y, x] / 65535 == pytest.approx(want, abs=2e-4)


def test_truth_of_the_calibration() -> None:
    """The grid found in the rendered white image is the one that was put in."""
    capture = render(
        camera(), [], (30, 40), rotation_degrees=-0.7, noise=0.01, dark_level=0.02, shading=0.3
    )
    calibration = calibrate(capture.white, capture.dark)
    assert calibration.dark_level == pytest.approx(0.02 * 65535, rel=0.01)
    centres = calibration.centres.reshape(-1, 2)
    _, _, offset = capture.grid.nearest(centres[~np.isnan(centres[:, 0])])
    assert np.linalg.norm(offset, axis=1).mean() < 0.004


def test_nearer_planes_cover_farther_ones() -> None:
    model = camera()
    far, near = (
        TexturedPlane(np.full((4, 4), 0.25), 5000.0, 900.0),
        TexturedPlane(np.full((4, 4), 0.75), 1000.0, 900.0),
    )
    for planes in ([far, near], [near, far]):
        capture = render(model, planes, (6, 6), radius=0.6, softness=0.1)
        y, x = np.rint(capture.grid.centres(0, 0)).astype(int)
        middle = capture.raw[y, x] / capture.white[y, x]
        assert middle == pytest.approx(0.75, abs=0.01)


def test_colours_depth_and_noise() -> None:
    model = camera()
    texture = np.zeros((4, 4, 3), np.uint8)
    texture[:, :, 0] = 255
    plane = TexturedPlane(texture, 3000.0, 900.0)
    capture = render(model, [plane], (8, 8), bits=8, noise=0.05, level=0.5, form="square", seed=3)
    assert capture.raw.dtype == np.uint8
    assert capture.raw.shape[2] == 3
    red = capture.raw[:, :, 0].astype(float) - capture.white
    inside = capture.white > 100
    assert red[inside].std() == pytest.approx(0.05 * 0.5 * 255 * np.sqrt(2), rel=0.1)
    again = render(model, [plane], (8, 8), bits=8, noise=0.05, level=0.5, form="square", seed=3)
    assert np.array_equal(again.raw, capture.raw)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows", "hexagonal-columns"])
def test_views_show_the_plane(layout) -> None:
    """Capture, calibrate, decode: the central view is the texture, however the lenses lie."""
    model = camera(m=5)
    distance = float(model.distance(0.4).mm)
    size = field_of_view(model, distance, 60)
    y, x = np.mgrid[-1:1:400j, -1:1:400j]
    texture = 0.5 + 0.4 * np.sin(9 * x + 4 * y)
    plane = TexturedPlane(texture, distance, size)
    capture = render(
        model, [plane], (24, 26), rotation_degrees=1.0, layout=layout, form="square", radius=0.45
    )
    raster = decode(capture.raw, calibrate(capture.white), 5)
    view = raster[2::5, 2::5] / raster.max()
    # Along the wave's front nothing changes; fit the wave.
    t, s = np.indices(view.shape)
    lens = np.sqrt(0.75) if layout != "rectangular" else 1.0
    angle = np.radians(1.0)
    down = lens * (s * np.sin(angle) + t * np.cos(angle)) / 30
    right = lens * (s * np.cos(angle) - t * np.sin(angle)) / 30
    phase = 9 * right + 4 * down
    terms = np.stack([np.ones_like(phase), np.sin(phase), np.cos(phase)], -1).reshape(-1, 3)
    left = view.ravel() - terms @ np.linalg.lstsq(terms, view.ravel(), rcond=None)[0]
    assert left.std() < 0.02
    assert view.std() > 0.2


@pytest.mark.parametrize(
    "plane",
    [
        TexturedPlane(np.zeros((3, 3)), 100.0, 10.0),
        TexturedPlane(np.zeros((3, 3)), 1000.0, 0.0),
        TexturedPlane(np.zeros(3), 1000.0, 10.0),
    ],
)
def test_bad_planes(plane) -> None:
    with pytest.raises(InputError, match=r"a plane at|a texture"):
        render(camera(), [plane], (4, 4))


def test_bad_pitch() -> None:
    with pytest.raises(InputError, match="pitch"):
        with_pitch(camera(), 0.0)


def test_pinhole_view_is_what_the_central_view_sees() -> None:
    """A tilted plane with a hole before an even one: brightness and distance of each micro lens."""
    m, lenses = 5, (24, 30)
    model = with_pitch(RayModel.focused(load_camera("f197-mla2"), inf, m), float(m))
    far, near = (float(model.distance(a).mm) for a in (0.2, 0.8))
    ramp = np.tile(np.linspace(0.2, 0.9, 200), (200, 1))
    y, x = np.mgrid[:200, :200] - 99.5
    ring = (np.hypot(y, x) > 40).astype(float)
    planes = [
        TexturedPlane(np.full((4, 4), 0.5), far, field_of_view(model, far, 90)),
        TexturedPlane(ramp, near, field_of_view(model, near, 16), (0.0, 5.0), (0.0, 3.0), ring),
    ]
    raw = render(model, planes, lenses, form="square", radius=1.0, level=1.0).raw / 65535
    seen, distance = pinhole_view(model, planes, lenses)
    assert seen.shape == distance.shape == lenses
    assert np.abs(raw[m // 2 :: m, m // 2 :: m] - seen)[2:-2, 2:-2].mean() < 0.01
    # Right is farther, by 3 mm for each mm; through the hole and beside it the wall is seen.
    on_it = np.abs(distance - far) > 1
    assert distance[on_it].min() < near < distance[on_it].max()
    row = distance[4][on_it[4]]
    assert (np.diff(row) > 0).all()
    assert 0.35 < on_it.mean() / (16 * 16 / (24 * 30)) < 1.1
    # A point of it lies where its disparity says, in every view.
    left = raw[m // 2 :: m, 0::m]
    a = np.asarray(model.focus_setting(distance))
    t, s = np.nonzero(on_it & np.roll(on_it, 1, 1) & np.roll(on_it, -1, 1))
    there = s + 2 * a[t, s]
    known = (there > 1) & (there < lenses[1] - 2) & (s > 3)
    found = ndimage.map_coordinates(left, [t[known], there[known]], order=1)
    assert np.median(np.abs(found - seen[t[known], s[known]])) < 0.02
    fine, _ = pinhole_view(model, planes, lenses, 3)
    assert fine.shape == (72, 90)
    with pytest.raises(InputError, match="coverage"):
        pinhole_view(model, [TexturedPlane(ramp, near, 9.0, coverage=ring[:5])], lenses)
