# SPDX-License-Identifier: Apache-2.0
"""Pictures to be looked at: levels, gamma, files."""

import numpy as np
import pytest

from plenofir.camera.exposure import exposure
from plenofir.ground.errors import InputError

pytestmark = pytest.mark.quick


def dark_field(m: int = 5) -> np.ndarray:
    """A light field that uses 300 of 65536 levels."""
    lenses = np.linspace(100, 400, 400).reshape(20, 20).astype(np.uint16)
    return lenses.repeat(m, 0).repeat(m, 1)


def test_auto_takes_black_and_white_from_the_picture() -> None:
    raster = dark_field()
    shown = exposure(raster, 5, "auto").apply(raster)
    assert shown.dtype == raster.dtype
    assert (shown.min(), shown.max()) == (0, 65535)
    # In proportion: the middle stays in the middle.
    assert abs(int(np.median(shown)) - 32768) < 700


def test_a_number_is_ev_and_gamma_brightens() -> None:
    values = np.arange(0, 256, 5, dtype=np.uint8).reshape(4, 13)
    twice = exposure(values, 2, "1").apply(values)
    assert np.array_equal(twice, np.minimum(2 * values.astype(int), 255))
    assert np.array_equal(exposure(values, 2, "off").apply(values), values)
    brighter = exposure(values, 2, "off", 2.2).apply(values)
    assert np.array_equal(brighter, np.rint(255 * (values / 255) ** (1 / 2.2)).astype(np.uint8))


def test_even_picture_has_levels() -> None:
    raster = np.full((20, 20), 7, np.uint8)
    assert (exposure(raster, 4, "auto").apply(raster) == 0).all()


@pytest.mark.parametrize("setting", ["bright", "nan", "17", "-1e9", ""])
def test_other_exposures_are_refused(setting: str) -> None:
    with pytest.raises(InputError, match="is no exposure; use auto, off, or a number of EV"):
        exposure(np.zeros((8, 8), np.uint8), 2, setting)
