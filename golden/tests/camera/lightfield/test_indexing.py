# SPDX-License-Identifier: Apache-2.0
"""Raw image, light field and views: the same samples."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.lightfield import (
    compose,
    light_field,
    named_views,
    raw_image,
    sub_aperture,
    views,
)
from plenofir.camera.recognise import Hints, recognise
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png


@st.composite
def raws(draw) -> tuple[np.ndarray, int]:
    m = draw(st.integers(1, 7))
    t, s = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    channels = draw(st.sampled_from([(), (3,)]))
    dtype = draw(st.sampled_from([np.uint8, np.uint16]))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    return rng.integers(0, 255, (t * m, s * m, *channels)).astype(dtype), m


@given(raws())
def test_round_trips_without_copies(case) -> None:
    raw, m = case
    field = light_field(raw, m)
    assert np.shares_memory(field, raw)
    assert np.shares_memory(views(raw, m), raw)
    assert np.array_equal(raw_image(field), raw)
    assert np.shares_memory(raw_image(field), raw)
    assert np.array_equal(compose(views(raw, m)), raw)
    assert np.array_equal(sub_aperture(raw, m, m - 1, 0), raw[m - 1 :: m, ::m])


@given(raws(), st.data())
def test_equations(case, data) -> None:
    """Eqs. 3.46-3.49: k = j M + u with u = c + i, and the light field at those indices."""
    raw, m = case
    rows, columns = raw.shape[:2]
    k, line = data.draw(st.integers(0, columns - 1)), data.draw(st.integers(0, rows - 1))
    (j, u), (h, v) = divmod(k, m), divmod(line, m)
    assert np.array_equal(light_field(raw, m)[h, j, v, u], raw[line, k])


def test_remainders_are_left_out() -> None:
    assert light_field(np.zeros((11, 14), np.uint8), 5).shape == (2, 2, 5, 5)


def numbered_views(m: int) -> np.ndarray:
    """Views whose pixels encode their position."""
    v, u = np.indices((m, m))
    return np.broadcast_to((16 * v + u)[..., None, None], (m, m, 4, 6)).astype(np.uint8)


@pytest.mark.parametrize(
    "name",
    [
        "view_{v:02}_{u:02}",
        "{v}-{u}",
        "IMG_0002_{n:03}_{v:02}_{u:02}",
        "out_{v:02}_{u:02}_-776.880371_-12.107",
        "input_Cam{n:03}",
        "r{v}c{u}",
        "2020_05_17 ({v},{u})",
        "{n}",
        "frame{n:04}_exposure100",
    ],
)
def test_names(tmp_path: Path, name: str) -> None:
    m = 3
    images = numbered_views(m)
    for v in range(m):
        for u in range(m):
            write_png(
                tmp_path / (name.format(v=v + 2, u=u + 2, n=m * v + u) + ".png"), images[v, u]
            )
    assert np.array_equal(recognise(tmp_path).all_views().pixels, images)
    if "{v" in name:
        found = recognise(tmp_path, Hints(order="columns")).all_views().pixels
        assert np.array_equal(found, images.swapaxes(0, 1))


def test_views_by_files(tmp_path: Path) -> None:
    raw = np.random.default_rng(0).integers(0, 65535, (24, 36, 3)).astype(np.uint16)
    steps = []
    files = named_views(views(raw, 3))
    assert list(files)[:2] == ["view_00_00.png", "view_00_01.png"]
    for name, view in files.items():
        write_png(tmp_path / name, np.ascontiguousarray(view))
    found = recognise(tmp_path).all_views(lambda done, total: steps.append((done, total)))
    assert np.array_equal(compose(found.pixels), raw)
    assert steps[-1] == (9, 9)


def test_bad_folders(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file or folder"):
        recognise(tmp_path / "none")
    with pytest.raises(InputError, match="no image files"):
        recognise(tmp_path).all_views()
    for n in range(4):
        write_png(tmp_path / f"view{n}_{n}.png", np.zeros((4, 4), np.uint8))
    write_png(tmp_path / "view4_4.png", np.zeros((4, 4), np.uint8))
    with pytest.raises(InputError, match="5 pictures that are no captures, and no views"):
        recognise(tmp_path).all_views()
    (tmp_path / "view4_4.png").rename(tmp_path / "white.png")
    assert recognise(tmp_path).lines[0] == (
        "files",
        "left alone: white.png, named otherwise than the views",
    )
    (tmp_path / "white.png").unlink()
    write_png(tmp_path / "view3_3.png", np.zeros((4, 5), np.uint8))
    with pytest.raises(InputError, match="view3_3"):
        recognise(tmp_path).all_views()


def test_bad_light_fields() -> None:
    with pytest.raises(InputError, match="view"):
        sub_aperture(np.zeros((9, 9), np.uint8), 3, 3, 0)
    with pytest.raises(InputError, match="shape"):
        compose(np.zeros((3, 2, 4, 4), np.uint8))
