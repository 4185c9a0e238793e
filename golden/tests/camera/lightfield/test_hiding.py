# SPDX-License-Identifier: Apache-2.0
"""What hides what, in scenes that are drawn with truth."""

import numpy as np
import pytest
from scipy import ndimage

from plenofir.camera.lightfield.disparity import search_views
from plenofir.camera.lightfield.hiding import larger_hides
from plenofir.camera.recognise.axes import find_axes
from plenofir.camera.recognise.source import Hints
from plenofir.ground.images import Picture

# Below -1 disparities reach farther than the search begins with, above 0 they are symmetric.
OFFSETS = [-1.2, -0.3, 0.4]


def discs(count: int, step: float, offset: float, seed: int) -> np.ndarray:
    """Views of discs before a plane, each nearer by `step`; shape (9, 9, 100, 120)."""
    rng = np.random.default_rng(seed)
    m, rows, columns = 9, 100, 120
    textures = [
        ndimage.gaussian_filter(rng.normal(0, 1, (rows + 80, columns + 80)), 1.5)
        for _ in range(count + 1)
    ]
    places = [(*rng.uniform(0.2, 0.8, 2), rng.uniform(15, 30)) for _ in range(count)]
    views = np.empty((m, m, rows, columns), np.uint8)
    y, x = np.mgrid[:rows, :columns].astype(float)
    for v, u in np.ndindex(m, m):
        image = np.zeros((rows, columns))
        for number, waves in enumerate(textures):
            a = offset + number * step
            place = y + a * (v - m // 2), x + a * (u - m // 2)
            shown = ndimage.map_coordinates(waves, [k + 40 for k in place], order=3)
            share = np.ones_like(image)
            if number:
                down, right, radius = places[number - 1]
                share = radius + 0.5 - np.hypot(place[0] - down * rows, place[1] - right * columns)
            image += np.clip(share, 0, 1) * (128 + 30 * shown / waves.std() - image)
        views[v, u] = np.clip(np.rint(image + rng.normal(0, 2, image.shape)), 0, 255)
    return views


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("step", [0.4, 0.8])
def test_near_discs_hide_what_is_behind(step: float, offset: float) -> None:
    views = discs(2, step, offset, seed=3)
    for images, sign in ((views, 1), (views[::-1, ::-1], -1)):
        assert sign * larger_hides(images, search_views(images).disparity) > 0.4


@pytest.mark.parametrize("offset", OFFSETS)
def test_a_plane_hides_nothing(offset: float) -> None:
    views = discs(0, 0, offset, seed=4)
    assert larger_hides(views, search_views(views).disparity) == 0


def test_near_and_far_exchanged_is_told_of_small_steps() -> None:
    views = discs(2, 0.4, -0.8, seed=5)

    def told(images: np.ndarray) -> str:
        def view(v: int, u: int) -> Picture:
            return Picture(np.ascontiguousarray(images[v, u]), 255)

        finding = find_axes(view, (9, 9), Hints()).finding
        return "" if finding is None else finding.text

    assert "--flip both" in told(views[::-1, ::-1])
    assert "rows from above" in told(views)
