# SPDX-License-Identifier: Apache-2.0
"""The raster of a focused camera's micro images, and the square operator on it."""

from functools import cache

import numpy as np
import pytest
from focused_scenes import scene
from scipy import ndimage

from plenofir.camera.calibration import calibrate
from plenofir.camera.calibration.grid import Layout
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.captures.prepare import prepared
from plenofir.camera.focused import FocusedCapture, focused_capture, focused_raster
from plenofir.camera.resampling import grid_registers, lit_pixels, resample, tables_of
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir.refocus import refocus


@cache
def captured(layout: Layout) -> FocusedCapture:
    truth = scene((3.0,), lenses=(14, 16), layout=layout, rotation_degrees=0.6, noise=0.0)
    calibration = calibrate(truth.capture.white)
    types = LensTypes(pattern=(0, 1, 2), sharpest=(0.4, 0.35, 0.3))
    if layout == "rectangular":
        types = LensTypes(pattern=(0,), sharpest=(0.35,))
    of_types = calibration.model_copy(update={"lens_types": types})
    return focused_capture(prepared(Picture(truth.capture.raw, 65535, 1.0), of_types))


@pytest.mark.parametrize("layout", ["hexagonal-rows", "hexagonal-columns", "rectangular"])
def test_the_square_operator_serves_all_layouts(layout: Layout) -> None:
    """The operator with a' = v and a box of |v| shows what is rendered of the capture itself."""
    capture = captured(layout)
    raster = focused_raster(capture)
    m, v = raster.m, 3
    assert m == 23
    sums = refocus(raster.pixels.astype(np.uint16), m, f"{v}/{m}", box=v).astype(float)
    shares = refocus((raster.lenses > 0).astype(np.uint16) * 65535, m, f"{v}/{m}", box=v)
    shares = shares.astype(float) / 65535
    straight = raster.straight(np.dstack([sums, shares]), capture.shape(), 2)
    image = straight[..., :3] / np.maximum(straight[..., 3:], 1e-6)
    alike = capture.layers(1 / v, 2, lenses=capture.lenses(alike=True))
    expected = alike.sums / np.maximum(alike.shares, 1e-6)[..., np.newaxis]
    inner = np.zeros(capture.shape(), bool)
    inner[24:-24, 24:-24] = True
    assert (straight[..., 3][inner] > 0.2).all()
    off = (image - expected)[inner] / 65535
    assert -10 * np.log10((off**2).mean()) > 40
    # Half a pixel beside it is worse: the pictures lie at the same place.
    beside = (ndimage.shift(image, (0.25, 0.25, 0), order=1) - expected)[inner] / 65535
    assert (beside**2).mean() > 1.2 * (off**2).mean()


@pytest.mark.parametrize("layout", ["hexagonal-rows", "rectangular"])
def test_the_chip_has_the_same_raster(layout: Layout) -> None:
    """All samples of lenses that lie in the frame, at the same places."""
    capture = captured(layout)
    calibration = capture.calibration
    raster = focused_raster(capture)
    chip, accuracy = grid_registers(calibration, raster.m)
    tables = tables_of(calibration, chip)
    assert accuracy.rounding_px < 2.0**-9
    aligned = resample(capture.picture.pixels, chip, tables)
    first = (np.array(chip.origin) / 2**16 - raster.origin) @ np.linalg.inv(raster.steps)
    row, column = np.rint(first).astype(int)
    part = slice(row, row + aligned.shape[0]), slice(column, column + aligned.shape[1])
    lit = lit_pixels(tables)
    assert not aligned[~lit].any()
    # The software leaves out whole pixels at the rim, the chip lenses that the frame cuts.
    both = lit & (raster.lenses[part] > 0)
    assert 0.95 * lit.sum() < both.sum()
    assert both.sum() > 0.7 * (raster.lenses > 0).sum()
    off = (aligned.astype(float) - raster.pixels[part])[both] / 65535
    # Lines of samples follow the sensor's lines, by 0.6 degrees.
    assert accuracy.turn_px < 0.13
    assert -20 * np.log10(np.sqrt((off**2).mean())) > 44


@pytest.mark.parametrize("layout", ["hexagonal-rows", "hexagonal-columns"])
def test_samples_know_their_lens(layout: Layout) -> None:
    capture = captured(layout)
    raster = focused_raster(capture, 12)
    grid, types = capture.calibration.grid, capture.calibration.lens_types
    assert types is not None
    i, j = np.nonzero(raster.lenses)
    places = raster.origin + np.stack([i, j], axis=-1) @ raster.steps
    t, s, away = grid.nearest(places)
    # Whole micro images lie within the capture.
    assert (np.hypot(*away.T) <= capture.pitch / 2).all()
    assert (types.at(grid, t, s) + 1 == raster.lenses[i, j]).all()
    assert sorted(set(raster.lenses.ravel().tolist())) == [0, 1, 2, 3]
    with pytest.raises(InputError, match="M = 1 is not possible"):
        focused_raster(capture, 1)
