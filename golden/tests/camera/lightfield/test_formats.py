# SPDX-License-Identifier: Apache-2.0
"""Light fields in foreign formats, and exports, which other libraries read."""

import io
from math import inf
from pathlib import Path

import cv2
import h5py
import imageio.v2 as imageio
import numpy as np
import pytest
import tifffile
from in_process import plenofir
from plyfile import PlyData
from scipy import ndimage
from scipy.io import savemat

from plenofir.camera.calibration import calibration_of_grid, decode
from plenofir.camera.lightfield import compose, light_field_disparity, sub_aperture
from plenofir.camera.lightfield import views as views_of
from plenofir.camera.lightfield.disparity import Disparity
from plenofir.camera.lightfield.enlarged import at_sensor
from plenofir.camera.lightfield.exports import (
    encode_float_tiff,
    encode_pfm,
    encode_ply,
    mosaic,
    points,
    quilt,
    quilt_name,
    quilt_tiles,
)
from plenofir.camera.lightfield.indexing import central
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.recognise import Hints, recognise
from plenofir.camera.recognise.arrays import read_array
from plenofir.camera.recognise.benchmark import hci_scene, read_pfm
from plenofir.ground.errors import InputError
from plenofir.ground.images import read_image, write_png
from plenofir.ground.project import DATA
from plenofir_studies.synthetic import TexturedPlane, field_of_view, render

M = 5


@pytest.fixture(scope="module")
def flower() -> np.ndarray:
    """A light field of a real camera, 86 x 80 micro images of 5 x 5 pixels."""
    return read_image(DATA / "flower_detail_5x5.png")


def test_mosaic(flower: np.ndarray, tmp_path: Path) -> None:
    picture = mosaic(views_of(flower, M))
    rows, columns = 80, 86
    assert (picture[2 * rows : 3 * rows, :columns] == sub_aperture(flower, M, 2, 0)).all()
    write_png(tmp_path / "mosaic.png", picture)
    assert (imageio.imread(tmp_path / "mosaic.png") == picture).all()
    for options in ({}, {"layout": "mosaic", "micro_image": M}):
        found = recognise(tmp_path / "mosaic.png", Hints(**options))
        assert (compose(found.all_views().pixels) == flower).all()
        assert ("mosaic", "5 x 5 views of 86 x 80 pixels") in found.lines
    with pytest.raises(InputError, match=r"are no multiple of 7"):
        recognise(tmp_path / "mosaic.png", Hints(7, "mosaic"))


def test_eslf(flower: np.ndarray, tmp_path: Path) -> None:
    """14 x 14 pixels for each lens, the outer views dark, with an alpha channel."""
    field = np.zeros((80, 14, 86, 14, 3), np.uint8)
    field[:, 4:9, :, 4:9] = flower.reshape(80, M, 86, M, 3)
    picture = field.reshape(80 * 14, 86 * 14, 3)
    alpha = np.full((*picture.shape[:2], 1), 255, np.uint8)
    imageio.imwrite(tmp_path / "flowers_eslf.png", np.concatenate([picture, alpha], axis=2))
    found = recognise(tmp_path / "flowers_eslf.png")
    assert found.all_views().pixels.shape == (14, 14, 80, 86, 3)
    assert (compose(central(found.all_views().pixels, 6)[:M, :M]) == flower).all()
    write_png(tmp_path / "raster.png", flower)
    assert (compose(recognise(tmp_path / "raster.png").all_views().pixels) == flower).all()
    write_png(tmp_path / "even.png", np.full((60, 60), 7, np.uint8))
    with pytest.raises(InputError, match=r"even\.png: can't tell"):
        recognise(tmp_path / "even.png").field()
    with pytest.raises(InputError, match="views: 9 views cannot be taken of 5"):
        central(recognise(tmp_path / "raster.png").all_views().pixels, 9)


@pytest.mark.parametrize("kind", ["5", "7.3"])
def test_mat(flower: np.ndarray, tmp_path: Path, kind: str) -> None:
    """As the EPFL's: 16 bit with a weight as fourth channel."""
    views = np.moveaxis(flower.reshape(80, M, 86, M, 3), (1, 3), (0, 1)).astype(np.uint16) * 257
    field = np.concatenate([views, np.ones((*views.shape[:4], 1), np.uint16)], axis=4)
    file = tmp_path / "field.mat"

    def write(**arrays: np.ndarray) -> None:
        if kind == "5":
            savemat(file, arrays, do_compression=True)
        else:
            with h5py.File(file, "w", userblock_size=512) as content:
                for name, array in arrays.items():
                    content[name] = array.T
            with file.open("r+b") as start:
                start.write(b"MATLAB 7.3 MAT-file")

    write(LF=field, other=np.zeros((2, 2)))
    assert (read_array(file).picture.pixels == views).all()
    write(light=views[..., 0] / 65535)
    assert (read_array(file).picture.pixels == views[..., 0]).all()
    write(a=np.zeros((3, 4)))
    with pytest.raises(InputError, match="no array of views"):
        read_array(file)
    write(LF=np.concatenate([field, field[..., :1]], axis=4))
    with pytest.raises(InputError, match=r"its array has shape \(5, 5, 80, 86, 5\)"):
        read_array(file)
    whole = file.read_bytes()
    for end in (0, 100, 600, len(whole) // 2):
        file.write_bytes(whole[:end])
        with pytest.raises(InputError):
            read_array(file)


def test_hci_scene(tmp_path: Path) -> None:
    """Its names, parameters and true disparity: ours has the same sign and size."""
    rng = np.random.default_rng(23)
    texture = np.kron(rng.random((40, 40)), np.ones((4, 4)))
    y, x = np.mgrid[:64, :72].astype(np.float64)
    scene = {"focal": 100.0, "baseline": 50.0, "focus": 8.0, "size": 35.0, "pixels": 72}
    distance = 6.0
    config = (
        "[intrinsics]\nfocal_length_mm = 100.0\nimage_resolution_x_px = 72\n"
        "image_resolution_y_px = 64\nsensor_size_mm = 35.0\n"
        "[extrinsics]\nbaseline_mm = 50.0\nfocus_distance_m = 8.0\n"
    )
    (tmp_path / "parameters.cfg").write_text(config)
    # Pinhole cameras whose sensors are shifted so that what is at the focus stays in place.
    image_distance = 1 / (1 / scene["focal"] - 1 / (1000 * scene["focus"]))
    pixel = scene["size"] / scene["pixels"]
    disparity = (
        scene["baseline"]
        * image_distance
        / pixel
        * (1 / (1000 * distance) - 1 / (1000 * scene["focus"]))
    )
    for n in range(81):
        down, right = n // 9 - 4, n % 9 - 4
        places = np.stack([y + 40 + disparity * down, x + 40 + disparity * right])
        view = ndimage.map_coordinates(texture, places, order=3)
        write_png(tmp_path / f"input_Cam{n:03}.png", np.clip(view * 255, 0, 255).astype(np.uint8))
    write_png(tmp_path / "objectids_lowres.png", np.zeros((64, 72), np.uint8))
    true = np.full((64, 72), disparity)
    (tmp_path / "gt_disp_lowres.pfm").write_bytes(encode_pfm(true))
    found = recognise(tmp_path)
    assert dict(found.lines)["camera"] == "baseline 50.0 mm, focal length 100.0 mm, focus at 8.0 m"
    read = hci_scene(tmp_path)
    assert read.disparity == pytest.approx(true)
    assert disparity > 0.3
    ours = light_field_disparity(compose(found.all_views().pixels), 9).pixels_per_view[
        16:-16, 16:-16
    ]
    assert np.median(ours) == pytest.approx(disparity, rel=0.02)
    (tmp_path / "input_Cam080.png").unlink()
    with pytest.raises(InputError, match=r"80 views input_CamNNN\.png"):
        recognise(tmp_path)


def test_quilt(flower: np.ndarray, tmp_path: Path) -> None:
    """The view farthest left is at the bottom left, rows go up."""
    raw = np.kron(np.ones((6, 8), np.uint8), np.arange(36, dtype=np.uint8).reshape(6, 6))
    line = views_of(raw, 6)[3]
    picture = quilt(line, 3, 2)
    assert picture[::6, ::8].tolist() == [[21, 22, 23], [18, 19, 20]]
    assert quilt(line, 1, 1)[0, 0] == 21
    assert [quilt_tiles(m) for m in (3, 9, 15, 13)] == [(3, 1), (3, 3), (5, 3), (13, 1)]
    assert quilt_name("holo", (420, 315), 8, 6) == "holo_qs8x6a0.75"
    with pytest.raises(InputError, match="3 x 3 tiles needs more views"):
        quilt(line, 3, 3)


def test_maps_of_numbers(tmp_path: Path) -> None:
    values = np.linspace(-3, 900, 35).reshape(5, 7)
    values[1, 2] = np.nan
    (tmp_path / "map.pfm").write_bytes(encode_pfm(values))
    (tmp_path / "map.tif").write_bytes(encode_float_tiff(values))
    known = ~np.isnan(values)
    theirs = cv2.imread(str(tmp_path / "map.pfm"), cv2.IMREAD_UNCHANGED)
    assert theirs[known] == pytest.approx(values[known], rel=1e-6)
    assert np.isinf(theirs[1, 2])
    assert read_pfm(tmp_path / "map.pfm")[known] == pytest.approx(values[known], rel=1e-6)
    for image in (
        cv2.imread(str(tmp_path / "map.tif"), cv2.IMREAD_UNCHANGED),
        tifffile.imread(tmp_path / "map.tif"),
    ):
        assert image.dtype == np.float32
        assert image[known] == pytest.approx(values[known], rel=1e-6)
        assert np.isnan(image[1, 2])
    (tmp_path / "map.pfm").write_bytes(b"Pf\n3 3\n-1\nxx")
    with pytest.raises(InputError, match="damaged"):
        read_pfm(tmp_path / "map.pfm")


@pytest.mark.parametrize("m", [5, 4])
def test_point_cloud(m: int) -> None:
    """Points of a rendered plane lie where its texture has them, in mm."""
    model = RayModel.focused(load_camera("f197-mla2"), inf, m)
    distance = float(model.distance(0.4).mm)
    width = field_of_view(model, distance, 40)
    texture = np.zeros((240, 240))
    texture[60:90, 150:180] = 1
    texture += 0.4 * np.kron(np.random.default_rng(4).random((40, 40)), np.ones((6, 6)))
    grid_lenses = 30, 36
    taken = render(
        model, [TexturedPlane(texture / 1.4, distance, width)], grid_lenses, form="square"
    )
    # An aligned raster: the views of the ideal camera, one pixel for each lens.
    raw = decode(taken.raw, calibration_of_grid(taken.grid, taken.raw.shape), m, devignette=False)
    central_view = sub_aperture(raw, m, m // 2, m // 2)
    known = np.full(central_view.shape, distance)
    known[0, :3] = np.nan
    content = encode_ply(points(known, model), central_view)
    vertices = PlyData.read(io.BytesIO(content))["vertex"]
    assert len(vertices) == known.size - 3
    assert np.asarray(vertices["z"]) == pytest.approx(distance)
    bright = vertices["red"] > 0.7 * vertices["red"].max()
    side = width / 240
    # The middle of the bright square: columns 150 to 180, rows 60 to 90 of 240.
    assert np.median(vertices["x"][bright]) == pytest.approx((165 - 120) * side, abs=0.01 * width)
    assert np.median(vertices["y"][bright]) == pytest.approx((75 - 120) * side, abs=0.01 * width)


def test_commands(flower: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_png(tmp_path / "flower.png", flower)
    assert "5 x 5 views of 86 x 80" in plenofir("mosaic", "flower.png", "-M", "5").stdout
    done = plenofir("compose", "mosaic.png", "--views", "3", "--out", "inner.png")
    assert done.stdout.splitlines()[-1] == "inner.png: M = 3, 86 x 80 micro images"
    inner = flower.reshape(80, M, 86, M, 3)[:, 1:4, :, 1:4].reshape(240, 258, 3)
    assert (read_image(tmp_path / "inner.png") == inner).all()
    done = plenofir("quilt", "flower.png", "-M", "5", "--columns", "3", "--out", "holo")
    assert done.stdout == "holo_qs3x1a1.075.png: 3 x 1 views of 86 x 80 pixels\n"
    views = [sub_aperture(flower, M, 2, u) for u in (0, 2, 4)]
    assert (read_image(tmp_path / "holo_qs3x1a1.075.png") == np.concatenate(views, axis=1)).all()
    done = plenofir("quilt", "flower.png", "-M", "5", "--columns", "3", "--rows", "2")
    assert done.returncode == 0
    assert "interpolated between 5 views" in done.stdout
    words = "depth-map", "flower.png", "-M", "5", "--camera", "lytro1-wide"
    assert plenofir(*words, "--pfm", "--tiff", "--ply").returncode == 0
    known = np.load(tmp_path / "depth" / "distance_mm.npy")
    for name in ("distance_mm.pfm", "distance_mm.tif"):
        theirs = cv2.imread(str(tmp_path / "depth" / name), cv2.IMREAD_UNCHANGED)
        both = np.isfinite(theirs)
        assert (both == np.isfinite(known)).all()
        assert theirs[both] == pytest.approx(known[both], rel=1e-6)
    cloud = PlyData.read(tmp_path / "depth" / "points.ply")["vertex"]
    assert len(cloud) == int(np.isfinite(known).sum())
    # Without a camera disparities, for each micro lens or for each pixel.
    for size, shape in (("views", (80, 86)), ("sensor", (400, 430))):
        words = "depth-map", "flower.png", "-M", "5", "--resolution", size, "--out", size
        assert plenofir(*words, "--pfm", "--tiff").returncode == 0
        found = np.load(tmp_path / size / "disparity.npy")
        assert found.shape == shape
        for name in ("disparity.pfm", "disparity.tif"):
            theirs = cv2.imread(str(tmp_path / size / name), cv2.IMREAD_UNCHANGED)
            sure = np.isfinite(theirs)
            assert 0.3 < sure.mean() <= 1
            assert theirs[sure] == pytest.approx(found[sure], abs=1e-6)


@pytest.mark.parametrize("m", [4, 5])
def test_a_step_of_a_map_lies_where_the_picture_has_it(m: int) -> None:
    # A bright thing, nearer by 1, in columns 7.3 to 13.3 of the micro lenses of the central view.
    place = np.arange(20.0)
    cover = np.clip(place + 0.5 - 7.3, 0, 1) * np.clip(13.3 - (place - 0.5), 0, 1)
    view = np.rint(40 + 180 * np.tile(cover, (9, 1))).astype(np.uint8)
    depth = np.tile((cover > 0.5).astype(float), (9, 1))
    found = at_sensor(Disparity(depth, np.ones_like(depth)), view, m, (9 * m, 20 * m))
    values = found.pixels_per_view
    assert set(np.unique(values.round(9))) == {0.0, 1.0}
    # For even M the view is half a view aside, by which near things move half a micro lens.
    aside = (m // 2 - (m - 1) / 2) * 1.0
    columns = np.flatnonzero(values[4 * m] > 0.5)
    ends = (columns[[0, -1]] - (m - 1) / 2) / m + [-0.5 / m, 0.5 / m]
    assert np.abs(ends - aside - [7.3, 13.3]).max() < 0.6
    # Smooth between micro lenses of one thing.
    ramp = np.tile(0.05 * place, (9, 1))
    smooth = at_sensor(Disparity(ramp, np.ones_like(ramp)), view, 5, (45, 100)).pixels_per_view
    assert smooth[20, 2:98] == pytest.approx(0.05 * (np.arange(2, 98) - 2) / 5, abs=1e-9)
