# SPDX-License-Identifier: Apache-2.0
"""Depth maps: the range that is searched, and how the map is drawn."""

from typing import get_args

import numpy as np
import pytest
from matplotlib import colormaps

from plenofir.camera.depth_picture import Unit, depth_picture, distance_ticks
from plenofir.camera.lightfield.disparity import LEAST_CONFIDENCE, MANY, search_disparity
from plenofir.camera.lightfield.matching import RIGHT
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.ground.viridis import VIRIDIS


def test_the_planes_of_the_demo_are_told_apart() -> None:
    """The wall at a = -1 lies at the end of the range: it is widened."""
    found = search_disparity(read_image(project.DATA / "planes_5x5.png"), 5)
    assert found.search == (-2, 2)
    assert max(found.at_ends) < 0.01
    disparity = found.disparity.pixels_per_view
    for a in (-1, -0.6, 0.2, 1):
        assert (np.abs(disparity - a) < 0.05).mean() > 0.1


@pytest.mark.parametrize("a", [-2.6, 2.6])
def test_range_grows_unless_it_is_given(a: float) -> None:
    """One view shows a texture, the next the same moved by a."""
    row = np.arange(40)[:, np.newaxis]
    rng = np.random.default_rng(4)
    waves = [(rng.uniform(0.2, 1.2, 2), phase) for phase in rng.uniform(0, 6, 12)]
    raw = np.zeros((40 * 3, 40 * 3), np.uint8)
    for v, u in np.ndindex(3, 3):
        y, x = row + a * (v - 1), row.T + a * (u - 1)
        texture = sum(np.sin(slope[0] * y + slope[1] * x + phase) for slope, phase in waves)
        raw[v::3, u::3] = np.clip(128 + 20 * texture, 0, 255)
    found = search_disparity(raw, 3)
    assert np.median(found.disparity.pixels_per_view) == pytest.approx(a, abs=0.1)
    assert max(found.at_ends) < MANY
    found = search_disparity(raw, 3, smallest=-1, largest=2)
    assert found.search == (-1, 2)
    assert found.at_ends[int(a > 0)] > MANY


def test_depth_of_what_is_empty_is_unknown() -> None:
    """A textured disc in the dark, with noise: what is far from it has no depth, near its own."""
    m, lenses, a, radius, noise = 5, 64, 0.5, 12, 0.01
    rng = np.random.default_rng(5)
    row = np.arange(lenses)[:, np.newaxis] - lenses // 2
    waves = [(rng.uniform(0.2, 1.2, 2), phase) for phase in rng.uniform(0, 6, 12)]
    raw = np.empty((lenses * m, lenses * m), np.uint16)
    for v, u in np.ndindex(m, m):
        y, x = row + a * (v - m // 2), row.T + a * (u - m // 2)
        texture = 0.5 + 0.04 * sum(np.sin(s[0] * y + s[1] * x + p) for s, p in waves)
        view = np.where(np.hypot(y, x) < radius, texture, 0.1)
        view = view + rng.normal(0, noise, view.shape)
        raw[v::m, u::m] = np.rint(65535 * np.clip(view, 0, 1))
    disparity = search_disparity(raw, m).disparity
    away, known = np.hypot(row, row.T), disparity.confidence >= LEAST_CONFIDENCE
    disc = away < radius - 2
    assert known[disc].mean() > 0.95
    assert np.abs(disparity.pixels_per_view - a)[disc].max() < RIGHT
    assert known[away > radius + 8].mean() < 0.03


def _parts(picture: np.ndarray, colour: tuple[float, ...]) -> float:
    """Part of a picture that has a colour."""
    wanted = np.rint(255 * np.array(colour[:3]))
    return float((np.abs(picture - wanted) <= 2).all(axis=2).mean())


def test_colours_are_even_in_one_over_distance() -> None:
    depth = np.repeat([[1000.0, 1500, 3000, np.nan, -5]], 4, axis=0).repeat(3, axis=1)
    viridis = colormaps["viridis"]
    picture = depth_picture(depth, "mm")
    # 1/1500 is half way between 1/1000 and 1/3000; unknown distances are grey.
    shares = [_parts(picture, viridis(place)) for place in (1.0, 0.5, 0.0)]
    assert min(shares) > 0.05
    assert _parts(picture, (0.6, 0.6, 0.6)) > 1.8 * shares[1]
    # A disparity may be negative, and is linear.
    picture = depth_picture(np.repeat([[-1.0, 0, 1]], 4, axis=0))
    assert min(_parts(picture, viridis(place)) for place in (1.0, 0.5, 0.0)) > 0.1
    assert (np.rint(255 * viridis(np.arange(256))[:, :3]) == VIRIDIS).all()
    for unit in get_args(Unit):
        nothing = depth_picture(np.full((3, 4), np.nan), unit)
        assert _parts(nothing, (0.6, 0.6, 0.6)) > 0.5


@pytest.mark.parametrize(
    ("near", "far", "want"),
    [
        (795, 15891, [800, 1000, 1200, 1500, 2000, 2500, 4000, 6000, 12000]),
        (990, 2010, [1000, 1200, 1500, 2000]),
        (1499, 1516, [1500, 1505, 1510, 1515]),
    ],
)
def test_scale_has_round_distances(near: float, far: float, want: list[float]) -> None:
    assert distance_ticks(near, far) == want
