# SPDX-License-Identifier: Apache-2.0
"""Mean micro images, sizes of spots, focus at infinity, and the pictures of an inspection."""

import numpy as np
import pytest
from test_lattice import LAYOUTS

from plenofir.camera.calibration import (
    calibration_of_grid,
    focus_score,
    infinity_focus,
    inspect_white,
    measure_spots,
    pictures,
)
from plenofir.camera.calibration.inspection import (
    fill_factor,
    mean_micro_image,
    neighbours,
    nowhere_dark,
    unevenness,
)
from plenofir.camera.calibration.spots import SIDES, Spots, best_position, spot_radius
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.rays.measured import measure_pupil
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import regular_grid, white_image

SHAPE = (110, 120)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("pitch", [14.3, 24.7])
def test_the_mean_micro_image_is_that_of_each(layout, pitch) -> None:
    """Turned with the grid, without the light of the lenses."""
    radius = 0.15
    grid = regular_grid(SHAPE, pitch, rotation_degrees=3, layout=layout)
    image = white_image(SHAPE, grid, form="spot", radius=radius, shading=0.0, noise=0.0)
    known = calibration_of_grid(grid, SHAPE).model_copy(update={"shading": (np.log(2.0),)})
    mean = mean_micro_image(image.astype(np.float32), known)
    assert (mean.places[0], mean.places[-1]) == pytest.approx((-0.75, 0.75))
    assert pitch * (mean.places[1] - mean.places[0]) <= 0.51
    y, x = np.meshgrid(mean.places, mean.places, indexing="ij")
    # A pixel's area adds a twelfth of a square pixel, and linear interpolation a sixth.
    blur = 0.25 / pitch**2
    expected = np.exp(-(y**2 + x**2) / 2 / (radius**2 + blur)) * 0.8 * 65535 / 2
    inner = np.hypot(y, x) < 0.45
    assert mean.values[inner] == pytest.approx(
        expected[inner], abs=(0.02 + 0.5 / pitch) * expected.max()
    )
    near = neighbours(layout)
    assert len(near) == (4 if layout == "rectangular" else 6)
    assert np.linalg.norm(near, axis=1) == pytest.approx(1)
    assert np.linalg.norm(near - (grid.vectors[1] / pitch @ turn(-3)), axis=1).min() < 0.51
    points = np.stack([y, x], axis=-1)
    away = np.linalg.norm(points[..., np.newaxis, :] - near, axis=-1).min(axis=-1)
    clear = np.abs(away - np.hypot(y, x)) > 1e-6
    assert (mean.cell == (np.hypot(y, x) < away))[clear].all()
    assert mean.at(np.array([[0.1, -0.2]])) == pytest.approx(
        np.exp(-0.05 / 2 / (radius**2 + blur)) * 0.8 * 65535 / 2, rel=0.04 + 0.3 / pitch
    )
    assert spot_radius(mean) == pytest.approx(np.sqrt(radius**2 + blur), rel=0.12)


def turn(degrees: float) -> np.ndarray:
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_gaps_and_overlaps_from_the_mean_micro_image() -> None:
    """Discs of a known diameter; black between them in few pixels and in many."""
    grid = regular_grid(SHAPE, 14.3)
    for radius, verdict in ((0.3, "gaps"), (0.4, "gaps"), (0.52, "touching")):
        image = white_image(SHAPE, grid, radius=radius, shading=0, noise=0, softness=0.5)
        fill = fill_factor(mean_micro_image(image + 3000.0, calibration_of_grid(grid, SHAPE)), 14.3)
        assert fill.verdict == verdict
        if verdict == "gaps":
            assert fill.diameter == pytest.approx(2 * radius, abs=0.035)
            assert fill.share == pytest.approx(np.pi * radius**2, abs=0.04)
            assert fill.stops_to_touch == pytest.approx(-2 * np.log2(2 * radius), abs=0.2)
            assert fill.darkest == pytest.approx(3000 / (3000 + 0.8 * 65535), abs=0.01)
            assert fill.between == pytest.approx(fill.darkest, abs=0.04)
    for layout, pitch, darkest in (
        ("rectangular", 7.0, 0.22), ("hexagonal-rows", 7.0, 0.5), ("hexagonal-columns", 9.0, 0.5),
        ("rectangular", 6.9, 0.6), ("hexagonal-rows", 6.9, 0.6),
    ):  # fmt: skip
        assert [nowhere_dark(layout, pitch, darkest + d) for d in (-0.01, 0.01)] == [False, True]


def test_unevenness_is_the_robust_scatter_of_lenses() -> None:
    grid = regular_grid(SHAPE, 8.0)
    known = calibration_of_grid(grid, SHAPE)
    t, s, _ = grid.nearest(np.moveaxis(np.indices(SHAPE), 0, -1).astype(float))
    gains = 1 + np.random.default_rng(0).normal(0, 0.03, (40, 40))
    image = white_image(SHAPE, grid, shading=0, noise=0) * gains[t + 20, s + 20]
    assert unevenness(image.astype(np.float32), known) == pytest.approx(0.03, rel=0.2)


@pytest.mark.parametrize("count", [4, 7])
def test_errors_of_a_best_position_are_those_made(count) -> None:
    """Noise of a percent of each radius; from 3.4 pitches beside the vertex it is not bracketed."""
    rng = np.random.default_rng(2)
    z = np.linspace(0, 0.9, count)
    for vertex in (0.3, 0.5):
        true = np.sqrt(0.01 + 0.2 * (z - vertex) ** 2)
        found = [best_position(z, true * (1 + rng.normal(0, 0.01, count))) for _ in range(150)]
        made = np.std([one.position for one in found])
        claimed = np.sqrt(np.mean([one.error**2 for one in found]))
        assert np.mean([one.position for one in found]) == pytest.approx(vertex, abs=0.01)
        assert made / claimed == pytest.approx(1, abs=0.3)
        assert all(one.bracketed for one in found)
    for vertex, bracketed in ((-0.02, False), (0.02, True), (0.88, True), (0.92, False)):
        one = best_position(z, np.sqrt(0.01 + 0.2 * (z - vertex) ** 2))
        assert (one.position, one.bracketed) == (pytest.approx(vertex), bracketed)
    assert best_position(z, np.full(count, 0.3)) is None
    assert best_position(z[:3], [0.3, 0.2, 0.3]).error is None
    with pytest.raises(InputError, match="at least 3 different distances, not 2"):
        best_position([0.0, 0.0, 1.0], [1.0, 1.0, 2.0])


def test_halves_of_an_array_have_spots_of_their_own() -> None:
    grid = regular_grid(SHAPE, 11.3)
    known = calibration_of_grid(grid, SHAPE)
    small, large = (white_image(SHAPE, grid, form="spot", radius=r, noise=0) for r in (0.1, 0.16))
    y, x = np.indices(SHAPE)
    for side, part in zip(SIDES, (x < 59.5, x > 59.5, y < 54.5, y > 54.5), strict=True):
        found = measure_spots(np.where(part, large, small).astype(np.float32), known, 0.7)
        opposite = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}[side]
        assert found.sides[side] > 1.3 * found.sides[opposite]
        assert found.radius_px == pytest.approx(11.3 * found.radius)
        assert found.position == 0.7


def star(a: float, diameter: float, pitch: float = 12.3) -> tuple[np.ndarray, np.ndarray]:
    """A picture of a star sharp in slice a, and a dark frame."""
    shape = (90, 100)
    grid = regular_grid(shape, pitch, rotation_degrees=1)
    t, s, off = grid.nearest(np.moveaxis(np.indices(shape), 0, -1).astype(float))
    # Pixel i of lens j is lit where j = -a i.
    lens = (grid.centres(t, s) - grid.centres(0, 0)) / pitch
    light = np.exp(-np.square(off + lens / a if a else off).sum(axis=-1) / 4)
    inside = np.hypot(*np.moveaxis(off, -1, 0)) < diameter / 2
    light *= inside & (np.hypot(*np.moveaxis(lens, -1, 0)) < (0.5 if not a else 9))
    dark = np.random.default_rng(0).normal(40, 2, shape)
    return np.rint(3000 * light + dark).astype(np.uint16), np.rint(dark).astype(np.uint16)


@pytest.mark.parametrize("a", [0.0, 0.3, -0.5])
def test_a_star_tells_how_the_main_lens_is_focused(a) -> None:
    known = calibration_of_grid(regular_grid((90, 100), 12.3, rotation_degrees=1), (90, 100))
    picture, dark = star(a, 10.0)
    for frame in (None, dark):
        found = infinity_focus(picture, known, 10.0, frame)
        assert found.a == pytest.approx(a, abs=0.1)
        assert found.resolution == pytest.approx(0.1)
        assert found.in_focus == (a == 0)
        assert (found.lenses > 4) == (a != 0)
        assert abs(found.a - a) < max(4 * found.error, 0.1)
    with pytest.raises(InputError, match=r"dark.png: has 99 x 90 pixels"):
        infinity_focus(picture, known, 10.0, dark[:, 1:], dark_where="dark.png")


def test_light_on_equal_lenses_counts_them() -> None:
    """Each has the same light; a slope of one lens a step of pixels."""
    grid = regular_grid((90, 100), 12.3)
    known = calibration_of_grid(grid, (90, 100))
    picture = np.zeros((90, 100), np.uint16)
    for j in (-2, -1, 0, 1, 2):
        y, x = np.rint(grid.centres(0, j) - np.array([0, 2 * j])).astype(int)
        picture[y, x] = 1000
    found = infinity_focus(picture, known, 8.0)
    assert found.lenses == pytest.approx(5)
    assert found.a == pytest.approx(0.5, abs=0.03)
    lone = np.where(np.indices((90, 100))[1] == 50, picture, 0).astype(np.uint16)
    one = infinity_focus(lone, known, 8.0)
    assert (one.a, one.error, one.lenses) == (0, 0, 1)


def shown(monkeypatch, picture, *arguments):
    """The axes of a picture."""
    figures = []
    monkeypatch.setattr(pictures, "figure_pixels", lambda figure: figures.append(figure))
    picture(*arguments)
    return figures[0].axes


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows"])
def test_picture_of_a_mean_micro_image(monkeypatch, layout) -> None:
    """Its brightness towards the neighbours, up to the next lens, and towards the gaps."""
    grid = regular_grid(SHAPE, 11.3, layout=layout)
    found = inspect_white(white_image(SHAPE, grid, radius=0.4, mixed=True))
    image, curves, _ = shown(monkeypatch, pictures.micro_image_picture, found)
    assert image.images[0].get_extent() == pytest.approx([-0.75, 0.75, 0.75, -0.75])
    middle = found.mean.at(np.zeros((1, 2)))[0]
    assert np.array(image.images[0].get_array()) == pytest.approx(found.mean.values / middle)
    near = neighbours(layout)[0]
    between = neighbours(layout)[0] + neighbours(layout)[2 if len(neighbours(layout)) == 4 else 1]
    for line, direction, name in zip(
        curves.lines[:2], (near, between / np.linalg.norm(between)),
        ("towards the neighbours", "towards the gaps"), strict=True,
    ):  # fmt: skip
        length, values = line.get_xdata(), line.get_ydata()
        assert line.get_label() == name
        assert (length[0], values[0]) == pytest.approx((0, 1))
        assert 0.7 < length[-1] < 1.07
        alone = found.mean.at(length[:, np.newaxis] * direction) / middle
        assert values == pytest.approx(alone, abs=0.1)
    half, level = curves.lines[2:]
    assert half.get_xdata()[0] == 0.5
    assert level.get_ydata()[0] == pytest.approx((1 + found.fill.darkest) / 2)
    assert curves.get_title() == f"gaps: {100 * found.fill.share:.0f} % of the sensor lit"
    assert curves.get_ylim()[0] == 0


def test_picture_of_chief_rays(monkeypatch) -> None:
    """Nine rays through a row of lenses meet in the pupil measured, and in the predicted one."""
    rays = RayModel.focused(load_camera("f197-mla2"), float("inf"), 11)
    array = rays.camera.micro_lenses
    for pitch in (14.0, 13.95):
        pupil = measure_pupil(rays, pitch, 0.01)
        (axes,) = shown(monkeypatch, pictures.chief_ray_picture, rays, pupil, 31)
        lines = [line for line in axes.lines if len(line.get_xdata()) == 2 and line.get_color()
                 in ("tab:red", "tab:blue") and line.get_linestyle() == "-"]  # fmt: skip
        assert len(lines) == 18
        for line, distance in zip(
            lines, [pupil.distance_mm] * 9 + [pupil.predicted_mm] * 9, strict=True
        ):
            (z, end), (y, far) = line.get_xdata(), line.get_ydata()
            assert z == -array.focal_length_mm
            # Straight through the lens's middle to the axis at the pupil.
            height = y + (far - y) * (0 - z) / (end - z)
            assert height * (1 - z / distance) == pytest.approx(y)
            assert abs(height) <= 15.5 * array.pitch_mm + 1e-9
        assert [text.get_text() for text in axes.get_legend().get_texts()] == [
            "measured", "from the camera's data",
        ]  # fmt: skip
        assert "chief rays meet in the pupil" in axes.get_title()
        assert axes.texts[0].get_position()[0] == 0


def test_picture_of_sizes_of_spots(monkeypatch) -> None:
    sizes = np.sqrt(0.01 + 0.3 * (np.arange(4) * 0.1 - 0.17) ** 2)
    spots = [Spots(0.1 * n, 9 * r, r, {side: r + 0.01 for side in SIDES}) for n, r in
             enumerate(sizes)]  # fmt: skip
    (axes,) = shown(monkeypatch, pictures.focus_picture, focus_score(spots[::-1]))
    whole, *halves, best = axes.lines
    assert whole.get_xdata() == pytest.approx([0, 0.1, 0.2, 0.3])
    assert whole.get_ydata() == pytest.approx(sizes)
    assert [half.get_label() for half in halves] == list(SIDES)
    assert all(half.get_ydata() == pytest.approx(sizes + 0.01) for half in halves)
    assert best.get_xdata()[0] == pytest.approx(0.17)
    assert axes.get_ylim()[0] == 0
    flat = [Spots(one.position, 1.0, 0.1, one.sides) for one in spots]
    (axes,) = shown(monkeypatch, pictures.focus_picture, focus_score(flat))
    assert len(axes.lines) == 5
