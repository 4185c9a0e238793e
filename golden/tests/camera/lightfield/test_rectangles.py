# SPDX-License-Identifier: Apache-2.0
"""Lines and rectangles of views: their layout by motion, depth, refocusing, views between them."""

import numpy as np
import pytest
from drawn_views import drawn, snr, texture
from scipy import ndimage

from plenofir.camera.lightfield.between import views_between
from plenofir.camera.lightfield.disparity import search_views
from plenofir.camera.lightfield.shift_and_add import refocus_views
from plenofir.camera.recognise.sequences import SequenceLayout, sequence_layout


@pytest.mark.parametrize(
    ("rows", "columns"), [(1, 15), (1, 4), (9, 1), (3, 7), (2, 2), (5, 5), (6, 8)]
)
def test_the_motion_tells_how_many_views_stand_in_a_row(rows: int, columns: int) -> None:
    views, _ = drawn(rows, columns)
    count = rows * columns
    size = views.shape[2:]
    across: str = "columns" if columns == 1 else "rows"
    found = sequence_layout(list(views.reshape(count, *size)))
    assert found == SequenceLayout(rows, columns, across, serpentine=False)
    if min(rows, columns) == 1:
        return
    found = sequence_layout(list(views.swapaxes(0, 1).reshape(count, *size)))
    assert found == SequenceLayout(rows, columns, "columns", serpentine=False)
    to_and_fro = views.copy()
    to_and_fro[1::2] = to_and_fro[1::2, ::-1]
    found = sequence_layout(list(to_and_fro.reshape(count, *size)))
    assert found == SequenceLayout(rows, columns, "rows", serpentine=True)
    places = [found.place(n) for n in range(count)]
    back = [to_and_fro.reshape(count, *size)[n] for n in range(count)]
    assert all((views[place] == one).all() for place, one in zip(places, back, strict=True))


def test_what_is_no_parallax_has_no_layout() -> None:
    y, x = np.mgrid[:48, :64].astype(float)

    def film(turn: float, zoom: float, count: int = 9) -> list[np.ndarray]:
        frames = []
        for n in range(count):
            cos, sin = np.cos(turn * n), np.sin(turn * n)
            right, down = (x - 32) * (1 + zoom * n), (y - 24) * (1 + zoom * n)
            image = texture(right * cos + down * sin, down * cos - right * sin, 3)
            frames.append(np.rint(255 * image).astype(np.uint8))
        return frames

    assert sequence_layout(film(0, 0.02)) is None
    assert sequence_layout(film(0.02, 0)) is None
    rng = np.random.default_rng(3)
    still = film(0, 0, 2)[0].astype(int)
    noisy = [np.clip(still + rng.normal(0, 3, still.shape), 0, 255) for _ in range(9)]
    assert sequence_layout([one.astype(np.uint8) for one in noisy]) is None
    others = [np.rint(255 * texture(x, y, seed)).astype(np.uint8) for seed in range(9)]
    assert sequence_layout(others) is None
    # Steps that tell no motion: equal pictures, and pictures of one level.
    black, white = (np.full((48, 64), level, np.uint8) for level in (0, 255))
    for frames in ([*others[:1] * 2, *others], [black, white, black], [black, black, *others]):
        assert sequence_layout(frames) is None


@pytest.mark.parametrize(("rows", "columns"), [(1, 9), (9, 1), (3, 5)])
def test_depth_and_refocusing_along_what_there_is(rows: int, columns: int) -> None:
    views, truth = drawn(rows, columns)
    found = search_views(views)
    right = np.abs(found.disparity.pixels_per_view - truth) < 0.15
    assert right.mean() > 0.98
    centre = views[rows // 2, columns // 2]
    for a in (-1.0, 0.0, 1.0):
        inside = ndimage.binary_erosion(truth == a, iterations=4)
        if a < 0:
            # What stands in front hides it from some of the views.
            inside &= ndimage.distance_transform_edt(truth < 0) > 10
        picture = refocus_views(views, a)
        assert picture.shape == centre.shape
        assert picture.dtype == centre.dtype
        assert snr(picture[inside], centre[inside]) > 40
        outside = ndimage.binary_erosion(truth == -a if a else truth < 0, iterations=4)
        assert snr(picture[outside], centre[outside]) < 33


def test_refocusing_between_settings_and_at_the_border() -> None:
    views, _ = drawn(1, 5, step=0.25)
    at = refocus_views(views, -0.25)
    assert snr(at[:10, 4:-4], views[0, 2][:10, 4:-4]) > 40
    even = np.full((2, 3, 16, 20), 1000, np.uint16)
    assert (refocus_views(even, 2.3) == 1000).all()


def test_views_between_views() -> None:
    views, truth = drawn(1, 5)
    fine, _ = drawn(1, 17, step=0.25)
    places = [0.25 * n for n in range(17)]
    for place, view, true in zip(
        places, views_between(views[0], truth, places), fine[0], strict=True
    ):
        if place == round(place):
            assert (view == true).all()
        # The middle of a view is no view's place: within the discs' rims something is guessed.
        assert snr(view, true) > 32
        nearest = views[0, round(place)]
        assert place == round(place) or snr(view, true) > snr(nearest, true) + 2
