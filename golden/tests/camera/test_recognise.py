# SPDX-License-Identifier: Apache-2.0
"""Results of inspect for pictures of known kind."""

import io
import re
from math import inf
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from PIL import Image as PillowImage
from skimage import data

from kinds_by_commands import USES, table
from plenofir.camera.calibration import calibration_of_grid, decode
from plenofir.camera.calibration.grid import Layout
from plenofir.camera.lightfield import views
from plenofir.camera.lightfield.exports import encode_pfm, mosaic
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.recognise import recognise
from plenofir.camera.recognise.picture import recognise_picture
from plenofir.camera.recognise.source import Kind
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, read_image, write_png
from plenofir.ground.project import DATA
from plenofir.refocus import refocus
from plenofir_studies.synthetic import TexturedPlane, field_of_view, regular_grid, render
from plenofir_studies.synthetic.render import with_pitch

MICROSCOPE = DATA / "microscope"


@pytest.mark.parametrize(
    ("name", "m"), [("flower_5x5.png", 5), ("flower_detail_5x5.png", 5), ("planes_5x5.png", 5)]
)
def test_rasters(name: str, m: int) -> None:
    found = recognise(DATA / name)
    assert (found.kind, found.micro_image_size) == ("aligned raster", m)
    assert f"-M {m}" in found.advice[0]


def test_the_microscope() -> None:
    assert recognise(MICROSCOPE / "white.png").kind == "white image"
    dark = recognise(MICROSCOPE / "dark.png")
    assert (dark.kind, "a dark frame?" in dark.findings[1][1]) == ("can't tell", True)
    raw = recognise(MICROSCOPE / "raw.png")
    assert raw.kind == "raw capture"
    # By its white image 15.397 pixels.
    assert raw.pitch_px == pytest.approx(15.397, rel=0.005)
    assert "-M 13" in raw.advice[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "pitch", "turn"),
    [("hexagonal-rows", 11.3, 0.4), ("rectangular", 14.6, -0.7), ("hexagonal-columns", 13.1, 0.2)],
)
def test_raw_captures(layout: str, pitch: float, turn: float) -> None:
    model = with_pitch(RayModel.focused(load_camera("f197-mla2"), inf, 5), pitch)
    distance = float(model.distance(0.3).mm)
    plane = TexturedPlane(data.chelsea(), distance, field_of_view(model, distance, 30))
    grid = regular_grid((300, 300), pitch, rotation_degrees=turn, layout=layout)
    count = int(300 / pitch)
    taken = render(model, [plane], (count, count), grid=grid, radius=0.48, noise=0.01)
    found = recognise_picture(Picture(taken.raw, 65535), "x.png")
    assert found.kind == "raw capture"
    assert found.pitch_px == pytest.approx(pitch, rel=0.01)
    assert layout in found.findings[1][1]


def capture(shares: tuple[float, float], layout: Layout, start: int, rim: float) -> np.ndarray:
    """Content that moves by a share of the pitch from lens to lens, one above and one below."""
    rng = np.random.default_rng(8)
    texture = np.kron(rng.random((300, 300)) ** 3, np.ones((3, 3))) * 200 + 20
    grid = regular_grid((480, 480), 24.0, layout=layout)
    y, x = np.mgrid[:480, :480].astype(np.float64)
    _, _, offset = grid.nearest(np.stack([y, x], axis=-1))
    centre = np.stack([y, x], axis=-1) - offset
    share = np.where(centre[..., 0] < 240, *shares)
    place = start + centre * share[..., np.newaxis] + offset
    picture = texture[place[..., 0].astype(int), place[..., 1].astype(int)]
    light = np.where(np.hypot(*np.moveaxis(offset, -1, 0)) < 12, 1.0, rim)
    return np.asarray((picture * light).astype(np.uint8))


def test_a_focused_camera() -> None:
    """Micro images that are small pictures, moved by another parallax at each depth."""
    picture = capture((0.12, 0.28), "hexagonal-rows", 60, 0.75)
    found = recognise_picture(Picture(picture, 255), "x.png")
    assert found.kind == "raw capture of a focused (2.0) camera", found


def test_content_that_repeats_around_the_pitch() -> None:
    """Slow micro lenses see the same content in many neighbours, at pitches of its own."""
    picture = capture((0.04, -0.04), "rectangular", 300, 0.4)
    found = recognise_picture(Picture(picture, 255), "x.png")
    assert found.kind == "raw capture", found
    assert found.pitch_px == pytest.approx(24, rel=0.01)


def test_mosaics_and_pictures(tmp_path: Path) -> None:
    flower = read_image(DATA / "flower_detail_5x5.png")
    write_png(tmp_path / "mosaic.png", mosaic(views(flower, 5)))
    found = recognise(tmp_path / "mosaic.png")
    assert (found.kind, found.micro_image_size) == ("mosaic of views", 5)
    write_png(tmp_path / "slice.png", refocus(flower, 5, 1))
    assert recognise(tmp_path / "slice.png").kind == "refocused picture"
    write_png(tmp_path / "slice.png", refocus(flower, 5, "-3/5"))
    assert recognise(tmp_path / "slice.png").kind == "no light field"
    for number, picture in enumerate((data.chelsea()[:240, :320],)):
        PillowImage.fromarray(picture).save(tmp_path / f"{number}.jpg", quality=60)
        found = recognise(tmp_path / f"{number}.jpg")
        assert found.kind in ("no light field", "can't tell"), (number, found)
        assert not found.advice
    write_png(tmp_path / "small.png", flower[:20, :20])
    assert recognise(tmp_path / "small.png").kind == "can't tell"


def test_folders_and_other_files(tmp_path: Path) -> None:
    views = tmp_path / "views"
    views.mkdir()
    assert recognise(views).kind == "can't tell"
    for v, u in np.ndindex(3, 3):
        write_png(views / f"view_{v}_{u}.png", np.full((4, 6), 9, np.uint8))
    found = recognise(views)
    assert (found.kind, found.micro_image_size) == ("folder of views", 3)
    write_png(views / "view_2_2.png", np.zeros((5, 6), np.uint8))
    with pytest.raises(InputError, match=r"view_2_2\.png: has 6 x 5 pixels, grey, uint8"):
        recognise(views).all_views()
    hci = tmp_path / "hci"
    hci.mkdir()
    write_png(hci / "input_Cam000.png", np.zeros((4, 4), np.uint8))
    (hci / "gt_disp_lowres.pfm").write_bytes(encode_pfm(np.zeros((4, 4))))
    assert recognise(hci).lines[0] == ("views", "1 x 1 of the HCI benchmark, with true disparity")
    grid = regular_grid((90, 90), 9.0)
    calibration_of_grid(grid, (90, 90)).save(tmp_path / "calib.json")
    assert recognise(tmp_path / "calib.json").kind == "calibration"


@pytest.mark.parametrize("name", ["flower_detail_5x5.png", "planes_5x5.png"])
def test_which_number_counts_columns(name: str, tmp_path: Path) -> None:
    images = views(read_image(DATA / name), 5)
    for order in ("rows", "columns"):
        folder = tmp_path / order
        folder.mkdir()
        for v, u in np.ndindex(5, 5):
            first, second = (v, u) if order == "rows" else (u, v)
            write_png(folder / f"a_{first}_{second}.png", np.ascontiguousarray(images[v, u]))
        found = recognise(folder)
        text, confidence, _ = found.findings[-1][1:]
        assert confidence == "measured"
        assert ("first number counts columns" in text) == (order == "columns")
        assert np.array_equal(found.all_views().pixels, images)


@pytest.mark.drawn(1)
@pytest.mark.parametrize(("name", "m"), [("antleg", 27), ("seaurchin", 15)])
def test_microscopes_whose_lenses_are_slow(name: str, m: int) -> None:
    """Standard cameras, though one has lenses of f/20; few lenses tell the pitch to 2 %."""
    raw = recognise(DATA / name / "raw.png")
    assert raw.kind == "raw capture"
    assert raw.pitch_px == pytest.approx({"antleg": 27.53, "seaurchin": 17.20}[name], rel=0.025)
    assert f"-M {m}" in raw.advice[1]
    assert recognise(DATA / name / "white.png").kind == "white image"


def test_every_kind_has_a_row_of_what_commands_do() -> None:
    assert set(get_args(Kind)) <= USES.keys()
    assert len(table()) == len(get_args(Kind)) + 2


@pytest.mark.parametrize(
    "name", ["flower_detail_5x5.png", "microscope/raw.png", "microscope/dark.png"]
)
def test_what_commands_do_is_so(name: str) -> None:
    source = recognise(DATA / name)
    if USES[source.kind].is_light_field:
        assert source.field().micro_image_size == source.micro_image_size
        return
    with pytest.raises(InputError, match=re.escape(source.kind)):
        source.field()


def test_folders_of_frames(tmp_path: Path) -> None:
    raster = read_image(DATA / "flower_detail_5x5.png")
    for number in range(4):
        write_png(tmp_path / f"frame_{number}.png", raster)
    found = recognise(tmp_path)
    assert (found.kind, found.micro_image_size) == ("folder of pictures", 5)
    assert "4 pictures; the first of them, frame_0.png: aligned raster" in found.findings[0][1]
    assert found.advice == (f"plenofir batch '{tmp_path}/*.png' -M 5 -a 0",)


def test_rows_of_micro_images_are_no_line_of_views() -> None:
    """Two rows of lenses are alike along a picture, but joints divide them, on both axes."""
    rng = np.random.default_rng(24)
    model = RayModel.focused(load_camera("f197-mla2"), inf, 11)
    width = field_of_view(model, 1500.0, 1.3 * 27)
    plane = TexturedPlane(np.kron(rng.random((9, 11)), np.ones((8, 8))), 1500.0, width)
    taken = render(model, [plane], (22, 27), dark_level=0.02, bits=8)
    aligned = decode(taken.raw, calibration_of_grid(taken.grid, taken.raw.shape), 11)
    assert recognise_picture(Picture(aligned, 255), "aligned.png").kind != "mosaic of views"


def test_blocks_of_a_jpeg_do_not_hide_views() -> None:
    """A coarse JPEG has joints of its own on both axes, here with 8 pixels in views of 160."""
    coarse = io.BytesIO()
    picture = mosaic(views(read_image(DATA / "flower_5x5.png"), 5))
    PillowImage.fromarray(picture).save(coarse, "JPEG", quality=15)
    pixels = np.asarray(PillowImage.open(coarse))
    kind = recognise_picture(Picture(pixels, 255), "x.jpg", is_jpeg=True).kind
    assert kind == "mosaic of views"
