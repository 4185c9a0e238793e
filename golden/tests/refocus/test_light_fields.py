# SPDX-License-Identifier: Apache-2.0
"""The light fields that the package ships: refocusing does to them what it should."""

import numpy as np
import pytest

from plenofir.ground.images import read_image
from plenofir.ground.project import DATA
from plenofir.refocus import refocus

M = 5


def sharpness(image: np.ndarray) -> float:
    """Mean squared difference between pixels one micro lens apart."""
    grey = image.astype(np.float64).mean(axis=2)
    return float(np.mean((grey[:, M:] - grey[:, :-M]) ** 2))


def test_flower_is_sharpest_where_it_lies():
    raw = read_image(DATA / "flower_5x5.png")
    assert raw.shape == (800, 800, 3)
    by_shift = {shift: sharpness(refocus(raw, M, f"{shift}/5")) for shift in range(-7, 4)}
    assert max(by_shift, key=by_shift.__getitem__) == -3


# What lies on each plane: a window in micro lenses that nothing nearer covers.
@pytest.mark.parametrize(
    ("window", "shift"),
    [
        ((slice(2, 10), slice(10, 140)), -5),
        ((slice(18, 60), slice(10, 40)), -3),
        ((slice(28, 68), slice(50, 86)), 1),
        ((slice(14, 60), slice(96, 140)), 5),
    ],
    ids=["brick", "coffee", "cat", "astronaut"],
)
def test_each_plane_is_sharpest_at_its_own_focus(window, shift):
    raw = read_image(DATA / "planes_5x5.png")
    rows, columns = (slice(part.start * M, part.stop * M) for part in window)
    by_shift = {
        s: sharpness(refocus(raw, M, f"{s}/5")[rows, columns]) for s in (-7, -5, -3, -1, 1, 3, 5, 7)
    }
    assert max(by_shift, key=by_shift.__getitem__) == shift
