# SPDX-License-Identifier: Apache-2.0
"""Colours of own cameras: mosaics named or noticed, hot pixels, white balance."""

from dataclasses import replace

import numpy as np
import pytest
from own_camera import OwnCamera, mosaic, words

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.calibration.moving import PixelMap
from plenofir.camera.captures.colours import (
    colours_of_white,
    even_mosaic,
    noticed_mosaic,
    order_before,
    order_of_mosaic,
    without_hot_pixels,
)
from plenofir.camera.captures.prepare import CaptureHints, calibrated, prepared
from plenofir.camera.lightfield import sub_aperture
from plenofir.camera.resampling import BayerOrder
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture, bare

CAMERA = OwnCamera(shape=(150, 190), pitch=9.3)
IMAGE, WHITE = (words(one) for one in CAMERA.take(7))
ORDERS = ("rggb", "bggr", "grbg", "gbrg")
GRID = calibration_of_grid(CAMERA.grid(), CAMERA.shape)


@pytest.mark.parametrize("order", ORDERS)
def test_an_unnamed_mosaic_is_noticed(order: str) -> None:
    for picture in (IMAGE, WHITE, (IMAGE >> 8).astype(np.uint8)):
        assert order in noticed_mosaic(mosaic(picture, order))
    with pytest.raises(InputError, match=f"--bayer .*{order}.*--bayer none"):
        order_of_mosaic(bare(mosaic(IMAGE, order)), None, "x")


@pytest.mark.parametrize("pitch", [4.0, 5.3, 6.0, 8.0, 11.7])
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_grey_captures_have_no_mosaic(pitch: float, turn: float) -> None:
    camera = replace(CAMERA, pitch=pitch, turn_degrees=turn, shape=(120, 150))
    for picture in camera.take(11, 1.2):
        assert noticed_mosaic(words(picture.mean(axis=2))) == ()
    assert order_of_mosaic(bare(words(picture.mean(axis=2))), None, "x") is None


def test_what_is_told_decides() -> None:
    picture = bare(mosaic(IMAGE))
    assert order_of_mosaic(picture, "none", "x") is None
    assert order_of_mosaic(picture, "bggr", "x") == "bggr"
    assert order_of_mosaic(picture._replace(mosaic="grbg"), None, "x") == "grbg"
    with pytest.raises(InputError, match="has colours already"):
        order_of_mosaic(bare(IMAGE), "rggb", "x")
    with pytest.raises(InputError, match="no mosaic 'rgbg'"):
        order_of_mosaic(picture, "rgbg", "x")


def test_colours_of_white() -> None:
    expected = pytest.approx(CAMERA.colours, rel=0.01)
    assert colours_of_white(WHITE, None, 65535) == expected
    for order in ORDERS:
        assert colours_of_white(mosaic(WHITE, order), order, 65535) == expected  # type: ignore[arg-type]
    assert colours_of_white(WHITE[..., 1], None, 65535) is None
    dark = np.full_like(WHITE, 3000)
    assert colours_of_white(WHITE + dark, None, 65535, dark) == expected
    # Where green is clipped, nothing is known of it.
    assert colours_of_white(np.minimum(WHITE, 30000), None, 30000) is None


def test_white_is_white() -> None:
    """A grey scene has no cast, by RGB and by mosaic; data keep theirs with "off"."""
    scene = (WHITE * 0.7).astype(np.uint16)
    for white, capture, told in (
        (bare(WHITE), bare(scene), CaptureHints()),
        (bare(mosaic(WHITE)), bare(mosaic(scene)), CaptureHints("rggb")),
        (bare(WHITE[..., 1]), bare(scene)._replace(neutral=CAMERA.colours), CaptureHints()),
    ):
        calibration = calibrated(white, bayer=told.bayer)
        ready = prepared(capture, calibration, told)
        assert ready.notes == ()
        raster, m = ready.decoded(5, "x")
        means = sub_aperture(raster.pixels, m, 2, 2).mean(axis=(0, 1))
        assert np.abs(means / means[1] - 1).max() < 0.02
        plain, _ = prepared(capture, calibration, told._replace(white_balance="off")).decoded(5, "")
        cast = sub_aperture(plain.pixels, 5, 2, 2).mean(axis=(0, 1))
        assert np.abs(cast / cast[1] - CAMERA.colours).max() < 0.02


def test_a_mosaic_keeps_the_picture() -> None:
    """The central view of a mosaic is that of the same capture in RGB."""
    central = []
    for capture, told in ((IMAGE, CaptureHints()), (mosaic(IMAGE), CaptureHints("rggb"))):
        raster, m = prepared(bare(capture), GRID, told).decoded(5, "x")
        central.append(sub_aperture(raster.pixels, m, 2, 2) / 65535)
    error = np.mean((central[0] - central[1]) ** 2)
    assert -10 * np.log10(error) > 35


@pytest.mark.parametrize("order", [None, "rggb"])
@pytest.mark.parametrize("by_dark", [False, True])
def test_hot_pixels(order: str | None, by_dark: bool) -> None:
    draw = np.random.default_rng(20_261_127)
    image = words(CAMERA.take(7, level=0.5)[0])
    clean = image[..., 1] if order is None else mosaic(image, order)
    places = draw.permutation(clean.size)[:15]
    hot = clean.copy()
    hot.ravel()[places] = 65535
    dark = None
    if by_dark:
        dark = draw.normal(500, 20, clean.shape).astype(np.uint16)
        dark.ravel()[places] = 20000
    found, count = without_hot_pixels(hot, 65535, mosaic=order is not None, dark=dark)
    assert count == 15
    away = np.abs(found.astype(int) - clean).ravel()
    assert np.delete(away, places).max() == 0
    assert np.median(away[places]) < 0.1 * 65535
    assert without_hot_pixels(clean, 65535, mosaic=order is not None)[1] == 0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("channels", [(), (3,)])
@pytest.mark.parametrize("lone", [0, 1])
def test_hot_pixels_among_hot_ones_stay(channels: tuple[int, ...], lone: int) -> None:
    pixels, dark = np.full((120, 120, *channels), 900, np.uint16), np.zeros((120, 120), np.uint16)
    dark[10:13, 20:23] = dark[50, 60] = 20000
    if not lone:
        # The middle alone, whose neighbours are those of a corner too.
        dark[:] = 0
        dark[:2, :2] = 20000
    pixels[dark > 0] = 65535
    found, count = without_hot_pixels(pixels, 65535, mosaic=False, dark=dark)
    assert count == (dark > 0).sum()
    stays = {(11, 21)} if lone else {(0, 0)}
    assert {(y, x) for y, x in np.argwhere(found.reshape(120, 120, -1)[..., 0] != 900)} == stays


def test_many_bright_pixels_are_no_defects() -> None:
    noise = np.random.default_rng(3).random((60, 60)) < 0.05
    pixels = np.where(noise, 65535, 900).astype(np.uint16)
    assert without_hot_pixels(pixels, 65535, mosaic=False)[1] == 0


def test_even_mosaic_of_a_line_has_two_colours() -> None:
    assert even_mosaic(np.array([[10, 40, 10, 40]], np.uint8), 255).tolist() == [[40] * 4]
    assert even_mosaic(np.array([[10]], np.uint8), 255).tolist() == [[10]]


def test_even_mosaic_has_one_level() -> None:
    even = even_mosaic(mosaic(WHITE), 65535).astype(float)
    means = [even[y::2, x::2].mean() for y in (0, 1) for x in (0, 1)]
    assert np.ptp(means) < 2


@pytest.mark.parametrize("order", ORDERS)
def test_order_of_a_white_image_by_that_of_a_capture(order: BayerOrder) -> None:
    """A part of the sensor begins with another colour, and so does a mirrored one."""
    white = mosaic(WHITE, order)
    rows, columns = white.shape
    cut = order_before(order, PixelMap(np.eye(2), np.array([-1.0, -2.0]), (rows - 1, columns - 2)))
    assert (mosaic(WHITE, cut)[1:, 2:] == mosaic(WHITE[1:, 2:], order)).all()
    flip = PixelMap(np.diag([1.0, -1.0]), np.array([0.0, columns - 1.0]), white.shape)
    mirrored = order_before(order, flip)
    assert (mosaic(WHITE, mirrored)[:, ::-1] == mosaic(WHITE[:, ::-1], order)).all()
    moved = PixelMap(np.eye(2), np.array([1.3, 0.2]), white.shape)
    assert order_before(order, moved) == order


def test_dark_frames_and_white_images_of_a_part() -> None:
    """A dark frame of the capture's size, a white image of the sensor's: each in its place."""
    part = np.s_[10:, 14:]
    picture = Picture(IMAGE[part] + np.uint16(700), 65535)
    dark = bare(np.full(picture.pixels.shape[:2], 700, np.uint16))
    ready = prepared(picture, GRID, CaptureHints(roi="14,10"), white=bare(WHITE + 700), dark=dark)
    assert ready.notes == ()
    assert ready.divisor is not None
    assert (ready.divisor == WHITE[part] + 700).all()
    plain = prepared(bare(IMAGE[part]), GRID, CaptureHints(roi="14,10"), white=bare(WHITE))
    apart = ready.decoded(5, "x")[0].pixels.astype(int) - plain.decoded(5, "x")[0].pixels
    assert np.abs(apart).max() <= 1
    for text in ("14", "14,x", "-1,2"):
        with pytest.raises(InputError, match="no column and row"):
            prepared(picture, GRID, CaptureHints(roi=text))
