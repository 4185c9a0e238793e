# SPDX-License-Identifier: Apache-2.0
"""Resampling to the M x M raster: one interpolation, exact where it should be."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scipy.interpolate import make_interp_spline

from plenofir.camera.calibration import (
    Calibration,
    Grid,
    calibrate,
    calibration_of_grid,
    decode,
    hexagonal_to_rectangular,
)
from plenofir.camera.calibration.resample import (
    check_micro_image_size,
    largest_odd_size,
    odd_size_within,
    profile_at,
    raster_window,
)
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import regular_grid, white_image

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


def test_one_pass_beats_two() -> None:
    """Rotation followed by a second interpolation blurs more than a single one."""
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


def sharp_edged(calibration: Calibration) -> Calibration:
    """With a profile, vignetting, uneven lenses and a dark level."""
    side = 1 - 0.8 * np.abs(np.linspace(-1, 1, 13)) ** 3
    return calibration.model_copy(
        update={
            "profile": tuple(map(tuple, np.outer(side, side).tolist())),
            "shading": (0.0, 0.1, -0.3), "uneven": ((2, 3, 0.8), (4, 4, 1.1)), "dark_level": 200.0,
        }
    )  # fmt: skip


def by_definition(raw, calibration, m, order, scale, dark, white=None) -> np.ndarray:
    """Each pixel of each lens from SciPy's interpolation at its place; then rows made straight."""
    grid, (rows, columns) = calibration.grid, raster_window(calibration)
    t, s = np.mgrid[rows, columns]
    down, right = grid.vectors
    units = [v / np.linalg.norm(v) for v in (down, right)]
    lengths = [1.0, 1.0]
    if scale == "fit":
        lengths = [np.linalg.norm(v) / m for v in (down, right)]
        if grid.layout != "rectangular":
            lengths = [max(lengths)] * 2
    steps = np.arange(m) - (m - 1) / 2
    v, u = np.meshgrid(steps * lengths[0], steps * lengths[1], indexing="ij")
    places = (
        grid.centres(t, s)[:, :, None, None] + v[..., None] * units[0] + u[..., None] * units[1]
    )
    at = np.moveaxis(places, -1, 0)
    image = np.asarray(raw, float) - dark
    values = ndimage.map_coordinates(image, at, order=order, mode="mirror")
    if white is None:
        light = (
            profile_at(calibration, m, scale)
            * calibration.lens_brightness[rows, columns][:, :, None, None]
        )
    else:
        above = np.asarray(white, float) - dark
        light = ndimage.map_coordinates(above, at, order=order, mode="mirror")
        light /= np.percentile(above, 99.5)
    values = values / np.maximum(light, 0.1)
    if grid.layout == "hexagonal-columns":
        values = values.swapaxes(0, 1)
    if grid.layout != "rectangular":
        lens = values.shape[1]
        step = min(grid.pitch) / max(grid.pitch)
        where = 0.5 + step * np.arange(int((lens - 1.5) / step) + 1)
        begin = rows.start if grid.layout == "hexagonal-rows" else columns.start
        moved = [0.5 * ((n + begin + grid.stagger) % 2) for n in range(len(values))]
        values = np.stack([
            part[np.floor(where - by + 0.5).astype(int)] if order == 0
            else make_interp_spline(np.arange(lens), part, order)(where - by)
            for part, by in zip(values, moved, strict=True)
        ])  # fmt: skip
    if grid.layout == "hexagonal-columns":
        values = values.swapaxes(0, 1)
    height, width = values.shape[:2]
    return values.transpose(0, 2, 1, 3).reshape(height * m, width * m)


@pytest.mark.parametrize("layout", ["rectangular", "hexagonal-rows", "hexagonal-columns"])
@pytest.mark.parametrize("stagger", [0, 1])
def test_decoding_is_interpolation_at_each_pixels_place(layout, stagger) -> None:
    rng, shape = np.random.default_rng(6), (70, 84)
    y, x = np.indices(shape)
    raw = 20000 + 9000 * np.sin(y / 3) * np.cos(x / 4) + rng.uniform(0, 900, shape)
    raw = raw.astype(np.uint16)
    white = (45000 - 9 * ((y - 30) ** 2 + (x - 40) ** 2)).astype(np.uint16)
    grid = regular_grid(shape, 9.3, rotation_degrees=2, layout=layout)
    known = sharp_edged(calibration_of_grid(grid.model_copy(update={"stagger": stagger}), shape))
    for m, how, scale in (
        (1, "nearest", "native"), (5, "bilinear", "native"), (6, "cubic", "fit"),
        (8, "nearest", "fit"), (4, "cubic", "native"),
    ):  # fmt: skip
        order = {"nearest": 0, "bilinear": 1, "cubic": 3}[how]
        found = decode(raw, known, m, interpolation=how, scale=scale)
        expected = np.clip(by_definition(raw, known, m, order, scale, 200.0), 0, 65535)
        assert np.abs(found - expected).max() < 1.0
    dark = (raw // 90).astype(np.uint16)
    found = decode(raw, known, 5, white=white, dark=dark, full_scale=30000)
    expected = np.clip(by_definition(raw, known, 5, 1, "native", dark, white), 0, 30000)
    assert np.abs(found - expected).max() < 1.0
    # Channels alike, with factors of their own.
    colour = np.stack([raw, raw // 2, raw // 3], axis=2)
    found = decode(colour, known, 5, gains=(1.0, 0.5, 2.0))
    for k, gain in enumerate((1.0, 0.5, 2.0)):
        expected = gain * by_definition(colour[..., k], known, 5, 1, "native", 200.0)
        assert np.abs(found[..., k] - np.clip(expected, 0, 65535)).max() < 1.5


@pytest.mark.parametrize(("lenses", "order"), [(1, 0), (1, 1), (3, 3)])
def test_rows_of_too_few_lenses(lenses, order) -> None:
    samples = np.random.default_rng(0).uniform(0, 1, (5, lenses + 1))
    fewest = max(2, order + 1)
    with pytest.raises(InputError, match=f"at least {fewest} lenses .* has {lenses}"):
        hexagonal_to_rectangular(samples[:, :lenses], 0, order=order)
    assert len(hexagonal_to_rectangular(samples, 0, order=order)) == 5


def test_profile_of_a_micro_image() -> None:
    """Stored from -0.6 to 0.6 pitches; constant beyond."""
    known = calibration_of(regular_grid(SHAPE, 10.0), (3, 3), (-1, -1))
    ramp = np.linspace(0, 1.2, 7)
    known = known.model_copy(
        update={"profile": tuple(map(tuple, (ramp[:, None] + 0 * ramp).tolist()))}
    )
    for m, scale, step in ((5, "native", 0.1), (4, "fit", 0.25), (17, "native", 0.1)):
        offsets = (np.arange(m) - (m - 1) / 2) * step
        expected = np.clip(offsets + 0.6, 0, 1.2)[:, np.newaxis] + np.zeros(m)
        assert profile_at(known, m, scale) == pytest.approx(expected)


def test_sizes_of_micro_images() -> None:
    """The largest odd one leaves out the mixed border, and is half as bright at its ends."""
    assert [odd_size_within(p) for p in (1.0, 2.69, 4.69, 4.71, 6.71, 8.69, 8.71, 11.0)] == [
        1, 1, 3, 3, 5, 7, 7, 9,
    ]  # fmt: skip
    grid = regular_grid(SHAPE, 11.0)
    known = calibration_of(grid, (3, 3), (-1, -1))
    assert largest_odd_size(known) == 9
    line = 1 - np.abs(np.linspace(-0.6, 0.6, 13))
    for reach_y, reach_x, size in ((1, 1.2, 9), (1.6, 1, 7), (1, 1.6, 7), (1, 9, 1), (9, 1, 1)):
        y, x = (np.clip(1 - (1 - line) * n, 0, 1) for n in (reach_y, reach_x))
        profile = tuple(map(tuple, np.outer(y, x).tolist()))
        assert largest_odd_size(known.model_copy(update={"profile": profile})) == size
    for side in range(4):
        one = np.rot90(np.concatenate([np.zeros((3, 13)), np.ones((10, 13))]), side)
        profile = tuple(map(tuple, one.tolist()))
        assert largest_odd_size(known.model_copy(update={"profile": profile})) == 7
    for m, scale in ((11, "native"), (44, "fit"), (1, "native")):
        check_micro_image_size(known, m, scale)
    for m, scale, message in (
        (12, "native", "use at most 11, or scale fit"), (45, "fit", "use at most 44"),
        (0, "fit", "at least 1 pixel"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            check_micro_image_size(known, m, scale)
