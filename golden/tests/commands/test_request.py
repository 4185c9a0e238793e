# SPDX-License-Identifier: Apache-2.0
"""What people ask for beyond what a file holds: a part of it, other colours, heights in um."""

import re
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir
from PIL import Image as Pillow
from tifffile import imread

from plenofir.camera.rays import Microscope, MicroscopeModel, load_instrument
from plenofir.camera.recognise.request import as_asked
from plenofir.camera.recognise.source import Hints
from plenofir.ground.images import Picture, read_image, read_picture
from plenofir.ground.project import DATA
from plenofir.refocus import best_picture

M = 5
PLANES = str(DATA / "planes_5x5.png")
STEEP = """
name = "steep"
[objective]
magnification = 40
numerical_aperture = 1.2
immersion_index = 1.33
[micro_lenses]
pitch_mm = 0.1
f_number = 15.5
[sensor]
pixel_pitch_mm = 0.0103
"""


def run(folder: Path, *words: str) -> str:
    done = plenofir(*words, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("gamma", [1.0, 2.2, None])
def test_light_of_colours_is_multiplied(gamma: float | None) -> None:
    rng = np.random.default_rng(3)
    pixels = rng.integers(0, 20000, (10, 15, 3)).astype(np.uint16)
    pixels[0, 0] = 40000
    picture = Picture(pixels, 40000, gamma)
    hints = Hints(white_balance="2,0.5")
    power = 1 / (gamma or 2.2)
    # Red, green and blue are 2 : 1 : 1/2, and the least of the factors is 1.
    expected = np.minimum(pixels * np.array([4.0, 2.0, 1.0]) ** power, 40000)
    found = as_asked(picture, M, hints).pixels
    assert np.abs(found - expected).max() <= 0.5
    assert (found[0, 0] == 40000).all()
    views = picture._replace(pixels=pixels[np.newaxis, np.newaxis])
    assert (as_asked(views, M, hints).pixels == found).all()


def test_a_part_is_that_of_the_picture(tmp_path: Path) -> None:
    """In whole micro images; away from its border, where views are missing, to the bit."""
    whole = read_image(Path(PLANES))
    crop = ("--crop", "103,52,198,149")
    run(tmp_path, "refocus", PLANES, "-M", "5", "-a", "1", "--exposure", "off", *crop)
    rows, columns = slice(50, 205), slice(100, 305)
    found = read_image(tmp_path / "refocused.png")
    assert found.shape == (155, 205, 3)
    np.testing.assert_array_equal(found, best_picture(whole[rows, columns], M, 1))
    inner = slice(20, -20), slice(20, -20)
    np.testing.assert_array_equal(found[inner], best_picture(whole, M, 1)[rows, columns][inner])
    run(tmp_path, "views", PLANES, "-M", "5", "--out", "seen", *crop)
    view = read_image(next((tmp_path / "seen").glob("*.png")))
    assert view.shape == (31, 41, 3)
    # A pixel of a view is one of the part.
    rectangle = Picture(np.zeros((1, 3, 20, 30), np.uint8), 255)
    assert as_asked(rectangle, 3, Hints(crop="7,2,11,5")).pixels.shape == (1, 3, 5, 11)


def test_films_and_volumes_are_balanced_and_cropped(tmp_path: Path) -> None:
    asked = ("--white-balance", "2,1", "--crop", "100,50,60,40")
    run(tmp_path, "batch", PLANES, "-M", "5", "-a", "0", "--out", "x.tif", *asked)
    field = as_asked(read_picture(Path(PLANES)), M, Hints(white_balance=asked[1], crop=asked[3]))
    expected = best_picture(field.pixels.astype(np.uint16) * 257, M, 0)
    with Pillow.open(tmp_path / "x.tif") as file:
        assert file.size == (60, 40)
    # Colours are the first axis.
    found = np.moveaxis(imread(tmp_path / "x.tif").squeeze(), 0, -1)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("refocus RAW -M 5 -a 0 --white-balance 2", "RED,BLUE"),
        ("refocus RAW -M 5 -a 0 --white-balance 0,1", "RED,BLUE"),
        ("refocus RAW -M 5 -a 0 --white-balance nan,1", "RED,BLUE"),
        ("refocus GREY -M 5 -a 0 --white-balance 2,1", "it has no colours to balance"),
        ("refocus RAW -M 5 -a 0 --crop 1,2,3", "LEFT,TOP,WIDTH,HEIGHT"),
        ("refocus RAW -M 5 -a 0 --crop ²,0,5,5", "LEFT,TOP,WIDTH,HEIGHT"),
        ("refocus RAW -M 5 -a 0 --crop 0,0,0,9", "does not lie within"),
        ("refocus RAW -M 5 -a 0 --crop 700,0,51,9", "within the picture of 750 x 400"),
        ("batch RAW -M 5 --out b --crop 0,0,9,9", "for captures and volumes"),
        ("inspect RAW --crop 0,0,9,9", "for pictures that are made"),
        ("depth-map RAW -M 5 --camera steep.toml --ply", "leave it out for a microscope"),
        ("depth-map RAW -M 5 --camera f193-mla2 --ply --crop 0,0,99,99", "--crop"),
        ("develop RAW -M 5 --camera steep.toml --focus 9", "by its stage"),
    ],
)
def test_bad_calls(tmp_path: Path, words: str, said: str) -> None:
    (tmp_path / "steep.toml").write_text(STEEP)
    Pillow.fromarray(np.zeros((50, 50), np.uint8)).save(tmp_path / "grey.png")
    words = words.replace("RAW", PLANES).replace("GREY", "grey.png")
    done = plenofir(*words.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_heights_of_a_microscope(tmp_path: Path) -> None:
    """By the model, over the plane in focus, in every file that tells depth."""
    (tmp_path / "steep.toml").write_text(STEEP)
    asked = ("-M", "5", "--camera", "steep.toml", "--crop", "100,100,150,150")
    instrument = load_instrument(tmp_path / "steep.toml")
    assert isinstance(instrument, Microscope)
    model = MicroscopeModel(instrument, M)
    said = run(tmp_path, "depth-map", PLANES, *asked, "--pfm", "--out", "maps")
    assert "um over the plane in focus" in said
    run(tmp_path, "develop", PLANES, *asked, "--slices", "2", "--out", "all")
    for folder in (tmp_path / "maps", tmp_path / "all"):
        heights = np.load(folder / "height_um.npy")
        known = ~np.isnan(heights)
        assert known.mean() > 0.5
        a = np.load(folder / "disparity.npy")
        np.testing.assert_allclose(heights[known], model.um_per_a * a[known])
        assert not list(folder.glob("distance*"))
    assert (tmp_path / "maps" / "height_um.pfm").exists()
    assert " um</figcaption>" in (tmp_path / "all" / "index.html").read_text()
    run(tmp_path, "refocus", PLANES, *asked, "-a", "3/5", "--out", "x.png")
    with Pillow.open(tmp_path / "x.png") as file:
        facts = dict(re.findall(r':(\w+)="([^"]*)"', file.info["XML:com.adobe.xmp"]))
    assert facts["Model"] == "steep"
    assert float(facts["z_um"]) == pytest.approx(0.6 * model.um_per_a, rel=1e-5)
