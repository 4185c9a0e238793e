# SPDX-License-Identifier: Apache-2.0
"""Calibration: accuracy on images with known centres, damage, bad input, the file."""

import json
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_info, threadpool_limits

from plenofir.camera.calibration import Calibration, Grid, calibrate, load_calibration
from plenofir.camera.calibration.fit import fit_grid
from plenofir.camera.calibration.frames import clipped_share, grey
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import centres_within, regular_grid, white_image
from plenofir_studies.thesis_calibration import (
    binary,
    normalised,
    regression,
    rotated,
    thesis_calibration,
)

SHAPE = (440, 600)


def errors(calibration: Calibration, truth: np.ndarray) -> np.ndarray:
    """Distance from each true centre to the nearest one found."""
    found = calibration.centres[~np.isnan(calibration.centres).any(axis=2)]
    return cKDTree(found).query(truth)[0]


def tilted_grid(shape: tuple[int, int], pitch: float, bend: float) -> Grid:
    """Grid of a tilted array: the pitch changes across the image by about four bends."""
    grid = regular_grid(shape, pitch, rotation_degrees=-2)
    centre, down, right = grid.coefficients
    turned = (-down[1] * bend, down[0] * bend)
    return Grid(
        layout="rectangular",
        order=2,
        middle=(0.0, 0.0),
        scale=1.0,
        coefficients=(centre, down, right, (0.0, bend), turned, (bend, 0.0)),
    )


@pytest.mark.drawn(5)
@pytest.mark.parametrize(
    ("pitch", "rotation", "options"),
    [
        (11.03, 0.1, {}),
        (11.03, 0.1, {"noise": 0.0, "form": "spot", "radius": 0.2}),
        (11.03, 0.1, {"radius": 0.5, "softness": 0.3}),
        (11.03, 0.1, {"layout": "hexagonal-rows"}),
        (11.03, 2.0, {"layout": "hexagonal-columns"}),
        (13.889, -3.0, {"form": "square", "radius": 0.46}),
        (15.4, 1.0, {"form": "square", "radius": 0.485, "softness": 0.5}),
        (15.4, 0.3, {"form": "spot", "radius": 0.1}),
        (5.3, 12.0, {}),
        (4.1, 0.5, {"layout": "hexagonal-rows", "radius": 0.4}),
        (34.9, 0.0, {}),
        (11.03, 0.1, {"noise": 0.1, "level": 0.3, "bits": 8}),
    ],
)
def test_centres(pitch, rotation, options) -> None:
    """Mean error below the goals (0.006 px), no lens missed, none too many."""
    layout = options.pop("layout", "rectangular")
    grid = regular_grid(SHAPE, pitch, rotation_degrees=rotation, layout=layout, offset=(0.3, -0.2))
    calibration = calibrate(white_image(SHAPE, grid, **options))
    truth = centres_within(grid, SHAPE)
    distance = errors(calibration, truth)
    assert distance.mean() < 0.006
    assert distance.max() < 0.02
    found = calibration.centres[~np.isnan(calibration.centres[..., 0])]
    assert np.linalg.norm(grid.nearest(found)[2], axis=1).max() < 0.02
    # Centres on the very border may count as inside.
    inside = ((found >= -0.5) & (found <= np.array(SHAPE) - 0.5)).all(axis=1)
    assert abs(inside.sum() - len(truth)) <= 1
    assert len(found) - len(truth) <= 4
    assert calibration.missing == ()
    assert calibration.grid.layout == layout
    assert calibration.grid.order == 1
    assert calibration.grid.pitch == pytest.approx(grid.pitch, rel=1e-4)
    assert calibration.grid.rotation_degrees == pytest.approx(rotation, abs=0.01)


@pytest.mark.slow
def test_peers_white_image() -> None:
    """Pitch 11.03, rotated by 0.1 degree, 1100 x 1100, 1 % noise: the best peer has 0.006 px."""
    shape = (1100, 1100)
    grid = regular_grid(shape, 11.03, rotation_degrees=0.1)
    calibration = calibrate(white_image(shape, grid))
    distance = errors(calibration, centres_within(grid, shape))
    assert distance.mean() < 0.001
    assert distance.max() < 0.006


@pytest.mark.slow
def test_large_white_image() -> None:
    shape = (3201, 3201)
    grid = regular_grid(shape, 11.0)
    calibration = calibrate(white_image(shape, grid))
    distance = errors(calibration, centres_within(grid, shape))
    assert len(distance) == 291**2
    assert distance.mean() < 0.006


@pytest.mark.slow
def test_tilt() -> None:
    shape = (400, 400)
    grid = tilted_grid(shape, 7.69, 0.003)
    assert grid.pitch[0] == pytest.approx(7.69)
    calibration = calibrate(white_image(shape, grid))
    assert calibration.grid.order == 2
    assert errors(calibration, centres_within(grid, shape)).mean() < 0.006
    with pytest.raises(InputError, match="no regular grid"):
        calibrate(white_image(shape, grid), order=1)


@pytest.mark.slow
@pytest.mark.parametrize("bend", [-1.5, 1.5])
def test_distortion(bend: float) -> None:
    """Barrel and pincushion: the third order models errors that grow with the cube of distance."""
    shape = (400, 480)
    flat = regular_grid(shape, 9.37, rotation_degrees=1.0)
    # Scaled so that at 25 lenses centres are `bend` pixels off along the radius.
    first, *steps = flat.coefficients
    vectors = [(25 * y, 25 * x) for y, x in steps]
    down, right = ((bend / 9.37 * y, bend / 9.37 * x) for y, x in steps)
    grid = Grid(
        layout="rectangular",
        order=3,
        middle=(0.0, 0.0),
        scale=25.0,
        coefficients=(first, *vectors, *[(0.0, 0.0)] * 3, down, right, down, right),
    )
    calibration = calibrate(white_image(shape, grid))
    truth = centres_within(grid, shape)
    assert calibration.grid.order == 3
    assert errors(calibration, truth).mean() < 0.006
    assert errors(calibration, truth).max() < 0.03
    with_tilt_only = calibrate(white_image(shape, grid), order=2)
    assert errors(with_tilt_only, truth).max() > 0.1


def test_damaged_micro_images() -> None:
    """Missing, dim and merged micro images do not bend the grid."""
    grid = regular_grid(SHAPE, 11.03, rotation_degrees=1)
    image = white_image(SHAPE, grid).astype(np.float64)
    centres = centres_within(grid, SHAPE)
    order = np.random.default_rng(3).permutation(len(centres))
    missing, dim, merged = np.split(centres[order[:240]], [40, 100])
    for group, change in ((missing, 0.0), (dim, 0.15)):
        for y, x in np.rint(group).astype(int):
            image[max(0, y - 5) : y + 6, max(0, x - 5) : x + 6] *= change
    for y, x in np.rint(merged).astype(int):
        image[max(0, y - 3) : y + 4, max(0, x) : x + 12] = 0.8 * 65535
    calibration = calibrate(np.rint(image).astype(np.uint16))
    found = calibration.model_centres[calibration.inside]
    assert cKDTree(found).query(centres)[0].max() < 0.01
    lost = errors(calibration, centres) > 1
    # A merged neighbour may light up a missing micro image.
    assert 30 <= len(calibration.missing) == lost.sum() <= 40
    assert (cKDTree(missing).query(centres[lost])[0] < 0.01).all()
    uneven = {(t, s) for t, s, _ in calibration.uneven}
    t, s, _ = calibration.grid.nearest(dim)
    assert len(uneven & set(zip(t.tolist(), s.tolist(), strict=True))) > 50


def test_dark_frame_and_colours() -> None:
    grid = regular_grid((200, 240), 10.3)
    white = white_image((200, 240), grid, level=0.5)
    dark = np.full(white.shape, 3000, dtype=np.uint16)
    lifted = (white + dark).astype(np.uint16)
    with_dark = calibrate(lifted, dark)
    assert with_dark.dark_level == 3000
    centres = calibrate(white).centres
    assert with_dark.centres == pytest.approx(centres, abs=2e-3, nan_ok=True)
    colour = np.stack([white, white // 2, white // 3], axis=2).astype(np.uint16)
    assert calibrate(colour).centres == pytest.approx(centres, abs=2e-3, nan_ok=True)
    assert grey(colour).shape == white.shape


def test_clipped_share() -> None:
    """Pixels clip at the full scale that the file tells, else at that of a camera's bits."""
    for largest, full_scale, share in (
        (1000, 1000, 0.5),
        (1000, None, 0.0),
        (4095, None, 0.5),
        (4095, 65535, 0.5),
        (4095, 4096, 0.0),
        (65535, 65535, 0.5),
    ):
        image = np.array([[largest, largest - 1]], dtype=np.uint16)
        assert clipped_share(image, full_scale) == share
    assert clipped_share(np.array([[255, 254]], dtype=np.uint8)) == 0.5
    white = np.minimum(white_image((120, 120), regular_grid((120, 120), 11)), 1000)
    with pytest.raises(InputError, match=r"too bright: .* at full scale \(1000\)"):
        calibrate(white, full_scale=1000)


def test_profile_of_a_micro_image() -> None:
    """From -0.6 to 0.6 pitches along the grid's axes, without the light."""
    shape = (110, 120)
    grid = regular_grid(shape, 18.4, rotation_degrees=2)
    known = calibrate(white_image(shape, grid, form="spot", radius=0.2, noise=0))
    places = np.linspace(-0.6, 0.6, len(known.profile))
    away = np.hypot(*np.meshgrid(places, places))
    alone = away < 0.45  # Beyond, there are neighbours.
    expected = np.exp(-0.5 * (away / 0.205) ** 2)
    assert np.array(known.profile)[alone] == pytest.approx(expected[alone], abs=0.04)


def test_few_micro_images() -> None:
    grid = regular_grid((300, 300), 60.0, layout="hexagonal-rows", offset=(3.0, 5.0))
    calibration = calibrate(white_image((300, 300), grid))
    assert errors(calibration, centres_within(grid, (300, 300))).max() < 0.2


def test_file(tmp_path: Path) -> None:
    shape = (200, 240)
    grid = regular_grid(shape, 11.03, rotation_degrees=8.0)
    calibration = calibrate(white_image(shape, grid))
    path = tmp_path / "calib.json"
    calibration.save(path)
    assert path.stat().st_size < 50_000
    read = load_calibration(path)
    assert read == calibration
    assert np.array_equal(read.centres, calibration.centres, equal_nan=True)
    assert read.centres.shape == (*read.lenses, 2)
    assert np.isnan(read.centres).any(), "a turned grid has corners outside the image"
    # Rows go down, columns to the right.
    assert np.nanmin(np.diff(read.centres[:, :, 0], axis=0)) > 0
    assert np.nanmin(np.diff(read.centres[:, :, 1], axis=1)) > 0


def test_older_file(tmp_path: Path) -> None:
    """Files without evidence load."""
    path = tmp_path / "calib.json"
    small_calibration().save(path)
    content = json.loads(path.read_text())
    assert content.pop("evidence")["missing_share"] == 0
    path.write_text(json.dumps(content))
    assert load_calibration(path).evidence is None


@cache
def small_calibration() -> Calibration:
    return calibrate(white_image((120, 120), regular_grid((120, 120), 11)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "x"}, "format"),
        ({"lenses": [0, 3]}, "lenses"),
        ({"extra": 1}, "extra"),
        ({"grid": {}}, "grid"),
        ({"lenses": [10**9, 3]}, "lenses"),
        ({"lenses": [300, 3]}, "more than the image has pixels"),
        ({"image_shape": [10**12, 120]}, "image_shape"),
        ({"missing": [[100, 0]]}, "outside the"),
        ({"uneven": [[0, 0, float("nan")]]}, "finite"),
        ({"dark_level": float("inf")}, "finite"),
        ({"dark_level": 1e300}, "dark_level"),
        ({"shading": [0.0, 1.0]}, "2 shading coefficients"),
        ({"shading": [1e9]}, "too large"),
        ({"profile": [[1.0, 1e9], [1.0, 1.0]]}, "profile.0.1: .* less than or equal to 1000"),
        ({"shading": []}, "0 shading coefficients"),
        ({"profile": []}, "profile"),
        ({"profile": [[1.0, 1.0], [1.0]]}, "profile"),
        ({"residual_px": float("nan")}, "finite"),
        ({"used": 0}, "used"),
        ({"evidence": {}}, "evidence"),
    ],
)
def test_bad_file(tmp_path: Path, change, message) -> None:
    path = tmp_path / "calib.json"
    small_calibration().save(path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError, match=message):
        load_calibration(path)
    path.write_text("no json")
    with pytest.raises(InputError, match="cannot be read"):
        load_calibration(path)
    path.write_text("[" * 100_000)
    with pytest.raises(InputError, match="cannot be read"):
        load_calibration(path)
    with pytest.raises(InputError, match="no such file"):
        load_calibration(tmp_path / "none.json")


def test_largest_numbers_of_a_file() -> None:
    """What is just within the limits loads, what is just beyond does not."""
    content = small_calibration().model_dump()
    for change, beyond in (
        ({"lenses": (244, 3)}, {"lenses": (245, 3)}),
        ({"image_shape": (1 << 16, 120)}, {"image_shape": ((1 << 16) + 1, 120)}),
        ({"shading": (1e6,)}, {"shading": (1e6 + 0.5,)}),
        ({"profile": ((1.0, 1.0), (1.0, 1.0))}, {"profile": ((1.0, 1.0),)}),
        ({"profile": ((1.0,) * 3,) * 2}, {"profile": ((1.0,), (1.0,))}),
        ({"shading": (0.0,) * 15}, {"shading": (0.0,) * 21}),
        ({"missing": ((10, 10),)}, {"missing": ((11, 10),)}),
        ({"missing": ((10, 10),)}, {"missing": ((10, 11),)}),
        ({"dark_level": 65535}, {"dark_level": 65535.5}),
        ({"used": 1}, {"used": 0}),
        ({"clipped_share": 1.0}, {"clipped_share": 1.1}),
        ({"residual_px": 0.0}, {"residual_px": -0.1}),
    ):
        Calibration.model_validate({**content, **change})
        with pytest.raises(ValueError, match="validation error"):
            Calibration.model_validate({**content, **beyond})


@cache
def bad_whites() -> dict[str, np.ndarray]:
    good = white_image(SHAPE, regular_grid(SHAPE, 11.03), bits=8)
    rng = np.random.default_rng(0)
    x = np.arange(SHAPE[1]) * np.ones((SHAPE[0], 1))
    return {
        "black": np.zeros(SHAPE, np.uint8),
        "dark": good // 30,
        "bright": np.clip(good.astype(int) * 20, 0, 255),
        "full": np.full(SHAPE, 65535, np.uint16),
        "noise": rng.integers(0, 255, SHAPE),
        "even": np.full(SHAPE, 100),
        "ramp": x * 255 // 600,
        "stripes": (127 + 100 * np.sin(x * 0.6)).astype(int),
        "few": good[:44, :44],
        "small": good[:10, :10],
    }


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("black", "too dark"),
        ("dark", "too dark"),
        ("bright", "too bright"),
        ("full", "too bright"),
        ("noise", "grid"),
        ("even", "grid"),
        ("ramp", "grid"),
        ("stripes", "grid"),
        ("few", "at least 5 x 5 of them"),
        ("small", "10 x 10 pixels"),
    ],
)
def test_bad_white_image(name, message) -> None:
    image = bad_whites()[name]
    with pytest.raises(InputError, match=message) as error:
        calibrate(image if name == "full" else image.astype(np.uint8), where="white.tif")
    assert str(error.value).startswith("white.tif: ")


@pytest.mark.parametrize("name", ["brick", "camera", "grass", "gravel", "text", "moon"])
def test_pictures_have_no_grid(name) -> None:
    from skimage import data

    with pytest.raises(InputError, match="a white image shows"):
        calibrate(getattr(data, name)())


def test_dark_frame_of_another_size() -> None:
    white = white_image(SHAPE, regular_grid(SHAPE, 11.03))
    with pytest.raises(InputError, match="599 x 440 pixels"):
        calibrate(white, np.zeros((440, 599), np.uint16))


def test_thesis_method() -> None:
    """The thesis's method finds all regions of a clean image, but with less accuracy."""
    shape = (220, 300)
    grid = regular_grid(shape, 11.03, rotation_degrees=0.5)
    image = white_image(shape, grid)
    found = thesis_calibration(grey(image))
    truth = centres_within(grid, shape)
    whole = ((truth > 6) & (truth < np.array(shape) - 7)).all(axis=1)
    distance = cKDTree(found.centroids).query(truth[whole])[0]
    assert distance.max() < 0.5
    assert distance.mean() > 5 * errors(calibrate(image), truth).mean()
    assert found.pitch == pytest.approx(11.03, abs=0.05)
    assert found.rotation_degrees == pytest.approx(0.5, abs=0.05)
    assert len(found.row) in range(25, 29)


def test_equations_of_the_text() -> None:
    image = np.array([[10.0, 20.0], [30.0, 50.0]], dtype=np.float32)
    assert normalised(image) == pytest.approx(np.array([[1, 64.75], [128.5, 256]]))
    assert (normalised(np.ones((2, 2), np.float32)) == 1).all()
    with np.errstate(all="raise"):
        assert binary(np.ones((2, 2), np.float32)).all()
    # Variances between the classes, times 4: 1633, 2500, 2700 for 1, 2, 3 pixels below.
    assert (binary(image) == [[False, False], [False, True]]).all()
    points = np.array([[1.0, 0.0], [3.0, 1.0], [5.0, 2.0]])
    assert regression(points) == pytest.approx((1.0, 2.0))
    ramp = np.arange(5, dtype=np.float32)
    assert normalised(ramp, 9) == pytest.approx([1, 3, 5, 7, 9])
    scattered = np.random.default_rng(0).normal(0, 1, (9, 2))
    line = np.polyfit(scattered[:, 1], scattered[:, 0], 1)
    assert regression(scattered) == pytest.approx(line[::-1])
    # A lone region has no row.
    lone = thesis_calibration(np.eye(3, dtype=np.float32) * 9)
    assert len(lone.row) == 1
    assert np.isnan([lone.pitch, lone.rotation_degrees]).all()
    middle = np.array([[50.0, 60.0]])
    assert rotated(middle, 33.0, (100, 120)) == pytest.approx(middle)
    right, down = np.array([[50.0, 61.0]]), np.array([[51.0, 60.0]])
    assert rotated(right, 90.0, (100, 120)) == pytest.approx(down)


def test_linear_algebra_has_one_thread(monkeypatch) -> None:
    """Threads of OpenBLAS wait by spinning; the caller's limit holds again afterwards."""
    seen = []

    def observed(*arguments, **options):
        seen.extend(blas_threads())
        return fit_grid(*arguments, **options)

    def blas_threads() -> list[int]:
        return [n["num_threads"] for n in threadpool_info() if n["user_api"] == "blas"]

    monkeypatch.setattr(sys.modules[calibrate.__module__], "fit_grid", observed)
    image = white_image((60, 60), regular_grid((60, 60), 10.4, rotation_degrees=2.0))
    with threadpool_limits(limits=2, user_api="blas"):
        calibrate(image)
        assert set(blas_threads()) == {2}
    assert set(seen) == {1}
