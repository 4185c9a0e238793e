# SPDX-License-Identifier: Apache-2.0
"""The model of the interpolation of colour filter mosaics."""

import secrets

import numpy as np
import pytest

from plenofir.camera.resampling import BAYER_ORDERS, interpolate_mosaic
from plenofir.ground.errors import InputError


def mean_of_neighbours(raw: np.ndarray, order: str, y: int, x: int, colour: str) -> int:
    """A colour of a pixel: the mean, halves up, of those in 3 x 3 pixels that are next to it."""
    rows, columns = raw.shape
    found: dict[int, list[int]] = {}
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            # Mirrored at the first and the last pixel.
            py = abs(y + dy) if y + dy < rows else 2 * (rows - 1) - y - dy
            px = abs(x + dx) if x + dx < columns else 2 * (columns - 1) - x - dx
            if order[2 * (py % 2) + px % 2] == colour:
                found.setdefault(abs(dy) + abs(dx), []).append(int(raw[py, px]))
    nearest = found[min(found)]
    return (2 * sum(nearest) + len(nearest)) // (2 * len(nearest))


@pytest.mark.parametrize("order", BAYER_ORDERS)
@pytest.mark.parametrize("shape", [(2, 2), (7, 6), (6, 9)])
def test_colours_are_means_of_the_nearest(order, shape) -> None:
    seed = secrets.randbits(32)
    print(f"seed {seed}")
    raw = np.random.default_rng(seed).integers(0, 65536, shape).astype(np.uint16)
    got = interpolate_mosaic(raw, order)
    assert got.dtype == raw.dtype
    for y, x in np.ndindex(shape):
        want = [mean_of_neighbours(raw, order, y, x, colour) for colour in "rgb"]
        assert got[y, x].tolist() == want, (y, x)


def test_what_is_no_mosaic_is_refused() -> None:
    with pytest.raises(InputError, match="one channel"):
        interpolate_mosaic(np.zeros((4, 4, 3), np.uint8), "rggb")
    with pytest.raises(InputError, match="grbg"):
        interpolate_mosaic(np.zeros((4, 4), np.uint8), "rgbg")  # type: ignore[arg-type]
