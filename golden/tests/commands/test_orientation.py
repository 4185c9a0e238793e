# SPDX-License-Identifier: Apache-2.0
"""Pictures that their files say are to be turned: by every command, once, in all eight ways.

What an orientation means comes from Pillow. A camera stores its sensor's rows whichever way it is
held, so a calibration fits the stored pixels, and what is decoded is turned at the end.
"""

from pathlib import Path

import numpy as np
import pytest
from camera.captures.own_camera import OwnCamera, words
from in_process import plenofir
from PIL import Image as Pillow
from PIL import ImageOps
from tifffile import imwrite

from plenofir.fpga.simulate.request import core_for_image
from plenofir.ground.images import Picture, read_image, read_picture, upright, write_png
from plenofir.ground.project import DATA

CAMERA = OwnCamera(shape=(124, 165), pitch=10.3, offset=(1.1, -2.3))
M = 5
WAYS = range(1, 9)
BACK = {6: 8, 8: 6}


def exif(way: int) -> Pillow.Exif:
    tags = Pillow.Exif()
    tags[0x0112] = way
    return tags


def looked_at(pixels: np.ndarray, way: int) -> np.ndarray:
    """What Pillow makes of stored pixels; 8 bit grey or RGB."""
    image = Pillow.fromarray(pixels)
    image.getexif()[0x0112] = way
    return np.asarray(ImageOps.exif_transpose(image))


def turned(pixels: np.ndarray, way: int) -> np.ndarray:
    """The same for pixels of any type, by their places."""
    places = np.arange(pixels.shape[0] * pixels.shape[1], dtype=np.int32)
    of_place = looked_at(places.reshape(pixels.shape[:2]), way)
    return pixels.reshape(-1, *pixels.shape[2:])[of_place]


def stored(path: Path, pixels: np.ndarray, way: int) -> None:
    """A file whose picture looks like `pixels` if its orientation is applied."""
    lying = turned(pixels, BACK.get(way, way))
    if path.suffix == ".tif":
        photometric = "rgb" if pixels.ndim == 3 else "minisblack"
        tags = [(274, 3, 1, way, True)]
        imwrite(path, lying, photometric=photometric, metadata=None, extratags=tags)
    else:
        Pillow.fromarray(lying).save(path, exif=exif(way), quality=100)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("ending", ["png", "tif", "jpg"])
def test_pictures_are_read_upright(tmp_path: Path, way: int, ending: str) -> None:
    pixels = np.random.default_rng(way).integers(0, 256, (5, 8), np.uint8)
    path = tmp_path / f"x.{ending}"
    stored(path, pixels, way)
    error = read_image(path).astype(int) - pixels
    assert np.abs(error).max() <= 2 * (ending == "jpg")
    assert read_picture(path, as_stored=True).orientation == way


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("shape", [(4, 6), (5, 6), (4, 7), (5, 7)])
def test_the_mosaic_of_a_turned_sensor(tmp_path: Path, way: int, shape: tuple[int, int]) -> None:
    names = np.tile(np.array(list("rggb")).reshape(2, 2), (4, 4))[: shape[0], : shape[1]]
    picture = upright(Picture(np.zeros(shape, np.uint8), 255, mosaic="rggb", orientation=way))
    assert picture.mosaic == "".join(turned(names, way)[:2, :2].ravel())


@pytest.fixture(scope="module")
def rasters(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An aligned raw image and a mosaic of views, as they look and lying."""
    folder = tmp_path_factory.mktemp("rasters")
    raster = read_image(DATA / "flower_detail_5x5.png")[:100, :140]
    mosaic = np.ascontiguousarray(raster.reshape(20, 5, 28, 5, 3).transpose(1, 0, 3, 2, 4))
    for name, pixels in (("raster", raster), ("mosaic", mosaic.reshape(100, 140, 3))):
        write_png(folder / f"{name}.png", pixels)
        for way in WAYS:
            stored(folder / f"{name}{way}.png", pixels, way)
    return folder


COMMANDS = {
    "refocus": ("refocus", "-M", "5", "-a", "1/2"),
    "stack": ("stack", "-M", "5"),
    "depth-map": ("depth-map", "-M", "5"),
    "views": ("views", "-M", "5"),
    "compose": ("compose", "-M", "5"),
    "view": ("view", "-M", "5"),
}


def made(folder: Path, command: str, source: str, out: Path) -> dict[str, bytes]:
    """What a command writes, by its names."""
    name, *options = COMMANDS[command]
    ending = {"refocus": ".png", "compose": ".png", "view": ".html"}.get(command, "")
    to = "--export" if command == "view" else "--out"
    done = plenofir(name, source, *options, to, f"{out}{ending}", cwd=folder)
    assert done.returncode == 0, done.stderr
    written = [out.with_name(out.name + ending)] if ending else sorted(out.rglob("*"))
    return {
        file.name.replace(Path(source).stem, "NAME").replace(out.name, "NAME"): file.read_bytes()
        for file in written
        if file.suffix in (".png", ".npy", ".html")
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_rasters_are_turned_by_every_command(rasters: Path, command: str, tmp_path: Path) -> None:
    expected = made(rasters, command, "raster.png", tmp_path / "as_it_looks")
    way = 6 if command != "refocus" else 7
    lying = made(rasters, command, f"raster{way}.png", tmp_path / "lying")
    assert lying.keys() == expected.keys()
    for name, content in expected.items():
        if not name.endswith(".html"):
            assert lying[name] == content, name
    if command == "view":
        (page,), (other,) = expected.values(), lying.values()
        assert page.replace(b"raster.png", b"") == other.replace(b"raster6.png", b"")


def test_batch(rasters: Path, tmp_path: Path) -> None:
    files = "raster.png", "raster7.png"
    words_ = ("-M", "5", "-a", "1", "--workers", "1", "--out", str(tmp_path))
    done = plenofir("batch", *files, *words_, cwd=rasters)
    assert done.returncode == 0, done.stderr
    plain, lying = sorted(tmp_path.glob("*.png"))
    assert plain.read_bytes() == lying.read_bytes()


@pytest.mark.parametrize("way", WAYS)
def test_mosaics_are_turned(rasters: Path, way: int) -> None:
    options = ("--layout", "mosaic", "-M", "5", "--out", "out.png")
    done = plenofir("compose", f"mosaic{way}.png", *options, cwd=rasters)
    assert done.returncode == 0, done.stderr
    assert (f"turned as its file says (EXIF orientation {way})" in done.stdout) == (way != 1)
    assert np.array_equal(read_image(rasters / "out.png"), read_image(rasters / "raster.png"))


def test_simulations_take_them_upright(rasters: Path) -> None:
    assert (
        core_for_image(rasters / "raster6.png", "core", micro_image_size=5, shifts=(5,)).max_columns
        == 140
    )


def test_inspect_tells(rasters: Path) -> None:
    said = plenofir("inspect", "raster8.png", cwd=rasters).stdout
    assert "orientation   turned as its file says (EXIF orientation 8)" in said
    assert "140 x 100 pixels" in said
    assert "aligned raster" in said


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """White images and captures with each tag, sensors turned in each way, and calibrations."""
    folder = tmp_path_factory.mktemp("captures")
    for name, image in zip(("raw", "white"), map(words, CAMERA.take(3, 0.7)), strict=True):
        for way in WAYS:
            tags = [(274, 3, 1, way, True)]
            told, really = folder / f"{name}_told{way}.tif", folder / f"{name}_turned{way}.tif"
            imwrite(told, image, photometric="rgb", metadata=None, extratags=tags)
            imwrite(really, turned(image, way), photometric="rgb", metadata=None)
    for way in (1, 6):
        white = f"white_told{way}.tif"
        done = plenofir("calibrate", white, "--out", f"calib{way}.json", cwd=folder)
        assert done.returncode == 0, done.stderr
    return folder


def decoded(folder: Path, raw: str, calib: str = "calib1.json") -> tuple[np.ndarray, str]:
    """The aligned raw image of a capture, and what was said on standard error."""
    done = plenofir("decode", raw, "--calib", calib, "-M", "5", "--out", "out.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    return read_image(folder / "out.png"), done.stderr


@pytest.mark.parametrize("way", WAYS)
def test_captures_of_a_camera_held_in_each_way(captures: Path, way: int) -> None:
    """The sensor stores the same pixels; only what is decoded is turned."""
    expected, _ = decoded(captures, "raw_told1.tif")
    for calib in ("calib1.json", "calib6.json"):
        picture, said = decoded(captures, f"raw_told{way}.tif", calib)
        assert np.array_equal(picture, turned(expected, way))
        assert "against" not in said


@pytest.mark.parametrize("way", range(2, 9))
def test_captures_that_a_program_has_turned(captures: Path, way: int) -> None:
    expected, _ = decoded(captures, "raw_told1.tif")
    for calib in ("calib1.json", "calib6.json"):
        picture, said = decoded(captures, f"raw_turned{way}.tif", calib)
        assert "against the calibration" in said
        assert np.abs(picture.astype(int) - turned(expected, way)).max() < 200


def test_calibrations_keep_the_orientation(captures: Path) -> None:
    plain, told = ((captures / f"calib{way}.json").read_text() for way in (1, 6))
    assert "orientation" not in plain
    assert '"orientation": 6' in told
    assert told.replace(',\n  "orientation": 6', "") == plain


def test_other_commands_on_captures(captures: Path, tmp_path: Path) -> None:
    expected, _ = decoded(captures, "raw_told6.tif")
    words_ = ("--white", "white_told3.tif", "-M", "5", "--slices", "1", "--out", str(tmp_path))
    done = plenofir("develop", "raw_told6.tif", *words_, cwd=captures)
    assert done.returncode == 0, done.stderr
    assert np.array_equal(read_image(tmp_path / "aligned.png"), expected)
    said = plenofir("inspect", "raw_told6.tif", cwd=captures).stdout
    assert "as the sensor lies; what is made of it is turned (EXIF orientation 6)" in said
    assert "165 x 124 pixels" in said
