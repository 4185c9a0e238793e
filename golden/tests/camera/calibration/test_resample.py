# SPDX-License-Identifier: Apache-2.0
"""Resampling to the M x M raster: one interpolation, exact where it should be."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from plenofir.camera.calibration import (
    Calibration,
    Grid,
    calibrate,
    calibration_of_grid,
    decode,
    hexagonal_to_rectangular,
)
from plenofir.camera.calibration.resample import raster_window
from plenofir.camera.synthetic import regular_grid, white_image
from plenofir.ground.errors import InputError

SHAPE = (130, 170)
# All samples of 7 x 7 lenses are inside, with the largest pitch and rotation.
RAMP_SHAPE = (140, 180)


def calibration_of(
    grid: Grid,
    lenses: tuple[int, int],
    first: tuple[int, int],
    shape: tuple[int, int] = SHAPE,
) -> Calibration:
    """Part of a known grid."""
    whole = calibration_of_grid(grid.moved(*first), shape)
    return whole.model_copy(update={"lenses": lenses, "grid": grid.moved(*first)})


@settings(max_examples=30)
@example(16.0, 4.0, 4, (4.0, 0.0), "bilinear", "fit", "hexagonal-columns")
@given(
    pitch=st.floats(9.2, 16.0),
    rotation=st.floats(-6, 6),
    m=st.integers(1, 9),
    slopes=st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    interpolation=st.sampled_from(["bilinear", "cubic"]),
    scale=st.sampled_from(["native", "fit"]),
    layout=st.sampled_from(["rectangular", "hexagonal-rows", "hexagonal-columns"]),
)
def test_linear_ramps_are_exact(pitch, rotation, m, slopes, interpolation, scale, layout) -> None:
    """Rotation, pitch and fraction at once: a ramp stays a ramp, to the rounding of the result."""
    grid = regular_grid(RAMP_SHAPE, pitch, rotation_degrees=rotation, layout=layout)
    calibration = calibration_of(grid, (7, 7), (-3, -3), RAMP_SHAPE)
    y, x = np.indices(RAMP_SHAPE)
    ramp = np.rint(30000 + slopes[0] * (y - 65) + slopes[1] * (x - 85)).astype(np.uint16)
    raster = decode(
        ramp, calibration, m, interpolation=interpolation, scale=scale, devignette=False
    )
    light_field = raster.reshape(raster.shape[0] // m, m, -1, m).astype(np.float64)
    # Cubic splines see that the ramp was rounded, and ring a little at the image's borders.
    slack = 0.6 if interpolation == "bilinear" else 2.0
    if slopes[0] % 1 or slopes[1] % 1:
        slack += 1.0
    angle = np.radians(rotation)
    unit = 1.0 if scale == "native" else pitch / m
    down = slopes[0] * np.cos(angle) - slopes[1] * np.sin(angle)
    right = slopes[0] * np.sin(angle) + slopes[1] * np.cos(angle)
    steps = np.arange(m) - (m - 1) / 2
    middle = light_field - unit * (down * steps[:, None, None] + right * steps)
    assert np.abs(middle - middle[:, :1, :, :1]).max() <= 2 * slack
    # Lenses are one pitch apart; hexagonal ones sit on a square raster of the rows' distance.
    step = pitch if layout == "rectangular" else pitch * np.sqrt(0.75)
    centres = middle[:, 0, :, 0]
    lens_t, lens_s = np.indices(centres.shape)
    difference = centres - centres[0, 0] - step * (down * lens_t + right * lens_s)
    assert np.abs(difference).max() <= 2 * slack


@pytest.mark.parametrize("m", [1, 2, 5, 10, 11])
def test_centre_of_a_micro_image(m) -> None:
    """Odd M has the centre on its middle pixel, even M between the middle two."""
    calibration = calibration_of(regular_grid(SHAPE, 11.0), (3, 3), (-1, -1))
    y, x = np.indices(SHAPE)
    raster = decode((100 * x + y).astype(np.uint16), calibration, m, devignette=False)
    assert raster.shape == (3 * m, 3 * m)
    centres = 100 * calibration.centres[..., 1] + calibration.centres[..., 0]
    steps = np.arange(m) - (m - 1) / 2
    want = centres[:, None, :, None] + 100 * steps + steps[:, None, None]
    assert np.abs(raster - want.reshape(3 * m, 3 * m)).max() <= 0.51


def test_one_pass_beats_two() -> None:
    """Rotation followed by a second interpolation blurs more than a single one."""
    from scipy import ndimage

    rng = np.random.default_rng(1)
    raw = np.rint(ndimage.gaussian_filter(rng.normal(0, 1, SHAPE), 1.0) * 40000 + 30000)
    grid = regular_grid(SHAPE, 11.3, rotation_degrees=4)
    calibration = calibration_of(grid, (7, 7), (-3, -3))
    once = decode(raw.astype(np.uint16), calibration, 9, devignette=False).astype(float)
    best = decode(
        raw.astype(np.uint16), calibration, 9, devignette=False, interpolation="cubic"
    ).astype(float)
    turned = ndimage.rotate(raw, 4, reshape=False, order=1)
    straight = calibration_of(regular_grid(SHAPE, 11.3), (7, 7), (-3, -3))
    twice = decode(np.clip(turned, 0, 65535).astype(np.uint16), straight, 9, devignette=False)
    assert np.abs(once - best).std() < 0.8 * np.abs(twice - best).std()


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows", "hexagonal-columns"])
@pytest.mark.parametrize("with_white", [False, True])
def test_white_image_becomes_even(layout, with_white) -> None:
    shape = (300, 400)
    grid = regular_grid(shape, 13.889, rotation_degrees=0.4, layout=layout)
    white = white_image(shape, grid, noise=0.002, softness=1.5)
    calibration = calibrate(white)
    raster = decode(white, calibration, 7, white=white if with_white else None)
    raster = raster / np.median(raster)
    assert np.abs(raster - 1).mean() < (0.001 if with_white else 0.01)
    assert raster.std() < (0.002 if with_white else 0.02)


def test_results_saturate_where_the_capture_does() -> None:
    shape = (200, 220)
    white = white_image(shape, regular_grid(shape, 11.03), level=0.05, noise=0)
    bright = np.minimum(white.astype(np.int64) * 4, 4095).astype(np.uint16)
    calibration = calibrate(white)
    assert decode(bright, calibration, 7).max() > 4095
    assert decode(bright, calibration, 7, full_scale=4095).max() == 4095


def test_dark_and_colours() -> None:
    shape = (200, 220)
    grid = regular_grid(shape, 11.03)
    white = white_image(shape, grid, level=0.5, noise=0)
    dark = np.full(shape, 500, np.uint16)
    calibration = calibrate(white)
    plain = decode(white, calibration, 5)
    assert np.array_equal(
        decode((white + dark).astype(np.uint16), calibration, 5, dark=dark), plain
    )
    colour = np.stack([white, white // 2, white // 4], axis=2).astype(np.uint16)
    raster = decode(colour, calibration, 5)
    assert raster.shape == (*plain.shape, 3)
    assert np.array_equal(raster[..., 0], plain)
    assert np.abs(raster[..., 1] - plain / 2).max() <= 2
    # Own white and dark frames, grey or not: vignetting goes, colours stay.
    colours = raster.reshape(-1, 3).mean(axis=0)
    for own_dark in (None, np.zeros(shape, np.uint16), np.zeros((*shape, 3), np.uint16)):
        for own_white in (white, colour):
            even = decode(colour, calibration, 5, white=own_white, dark=own_dark)
            assert even.reshape(-1, 3).mean(axis=0) == pytest.approx(colours, rel=0.02)
            assert (even.std(axis=(0, 1)) < 0.002 * colours).all()
            alone = decode(white, calibration, 5, white=own_white, dark=own_dark)
            assert alone.std() < 0.002 * colours[0]
    byte = decode((white >> 8).astype(np.uint8), calibration, 5)
    assert byte.dtype == np.uint8
    # Dark borders, whose low bits are lost, are amplified at most tenfold.
    assert np.abs(byte.astype(float) - plain / 257).mean() < 1.5


def test_raster_window_leaves_out_the_ragged_border() -> None:
    shape = (440, 600)
    grid = regular_grid(shape, 11.03, rotation_degrees=3.0)
    calibration = calibrate(white_image(shape, grid))
    rows, columns = raster_window(calibration)
    assert calibration.inside[rows, columns].all()
    lenses = (rows.stop - rows.start) * (columns.stop - columns.start)
    assert lenses > 0.75 * calibration.inside.sum()


def test_hexagonal_ramp_is_exact() -> None:
    """A ramp over a hexagonal grid is the same ramp over a rectangular one (Eqs. 4.12, 4.13)."""
    for first in (0, 1):
        t, s = np.mgrid[:6, :9]
        x = s + 0.5 * ((t + first) % 2)
        samples = 3 * x + 2 * t
        for order in (1, 3):
            result = hexagonal_to_rectangular(samples, first, order=order)
            n = np.arange(result.shape[1])
            want = 3 * (0.5 + n * np.sqrt(0.75)) + 2 * np.arange(6)[:, None]
            assert result == pytest.approx(want, abs=1e-12)
            assert 0.5 + n[-1] * np.sqrt(0.75) <= 8 < 0.5 + (n[-1] + 1) * np.sqrt(0.75)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"m": 0}, "M = 0"),
        ({"m": 13}, "pitch of"),
        ({"m": 99, "scale": "fit"}, "M = 99"),
        ({"m": 5, "scale": "half"}, "'half'"),
        ({"m": 5, "interpolation": "none"}, "'none'"),
        ({"m": 5, "dark": np.zeros((3, 3), np.uint16)}, "dark frame: has 3 x 3"),
        ({"m": 5, "white": np.zeros((3, 3), np.uint16)}, "white image: has 3 x 3"),
        ({"m": 5, "raw": np.zeros((3, 4), np.uint16)}, "raw capture: has 4 x 3"),
    ],
)
def test_bad_input(arguments, message) -> None:
    calibration = calibration_of(regular_grid(SHAPE, 11.0), (3, 3), (-1, -1))
    arguments = {"raw": np.zeros(SHAPE, np.uint16), **arguments}
    with pytest.raises(InputError, match=message):
        decode(arguments.pop("raw"), calibration, arguments.pop("m"), **arguments)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows", "hexagonal-columns"])
def test_known_grid(layout) -> None:
    """The lenses of a known grid are those that calibration finds."""
    grid = regular_grid(SHAPE, 10.7, rotation_degrees=2, layout=layout)
    known = calibration_of_grid(grid, SHAPE)
    found = calibrate(white_image(SHAPE, grid, noise=0))
    assert known.lenses == found.lenses
    assert known.centres == pytest.approx(found.centres, abs=0.02, nan_ok=True)
    with pytest.raises(InputError, match="no micro lens"):
        calibration_of_grid(grid, (0, 0))


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows", "hexagonal-columns"])
def test_nearest_takes_pixels_of_the_capture(layout) -> None:
    """The pixel that the exact place lies in, of the nearest lens where rows are staggered."""
    grid = regular_grid(SHAPE, 11.3, rotation_degrees=0.7, layout=layout)
    calibration = calibration_of(grid, (7, 7), (-3, -3))
    y, x = np.indices(SHAPE)
    index = (200 * y + x).astype(np.uint16)
    raster = decode(index, calibration, 5, interpolation="nearest", devignette=False)
    if layout != "rectangular":
        assert np.isin(raster, index).all()
        return
    found = np.stack(np.divmod(raster.astype(int), 200), axis=-1)
    angle = np.radians(0.7)
    steps = np.arange(5) - 2.0
    down = np.array([np.cos(angle), -np.sin(angle)])
    right = np.array([np.sin(angle), np.cos(angle)])
    places = (
        calibration.centres[:, None, :, None]
        + steps[:, None, None, None] * down
        + steps[:, None] * right
    )
    assert np.abs(found - places.reshape(35, 35, 2)).max() <= 0.501
