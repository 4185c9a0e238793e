# SPDX-License-Identifier: Apache-2.0
"""Order and direction of the axes of views, whatever they are stored as."""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from discs import disc_view, disc_views, true_disparity
from PIL import Image as Pillow

from plenofir.camera.lightfield.indexing import compose
from plenofir.camera.recognise import Hints, LightFieldSource, recognise
from plenofir.commands.app import run
from plenofir.ground.errors import InputError
from plenofir.ground.films import write_webm
from plenofir.ground.images import encode_png, read_image, write_png
from plenofir.ground.project import DATA

VIEWS = disc_views(5)
Name = Callable[[int, int], str]


def write_views(folder: Path, name: Name, views: np.ndarray = VIEWS) -> Path:
    folder.mkdir()
    for v, u in np.ndindex(*views.shape[:2]):
        write_png(folder / f"{name(v, u)}.png", np.ascontiguousarray(views[v, u]))
    return folder


def told(source: LightFieldSource) -> tuple[str, str, bool]:
    """Text, confidence and whether every command tells it."""
    (finding,) = (one for one in source.findings if one.heading == "axes")
    return finding.text, finding.confidence, finding.notable


ORDERS: dict[str, tuple[Name, str]] = {
    "as_named": (lambda v, u: f"view_{v}_{u}", "rows from above"),
    "columns_first": (lambda v, u: f"x{u}_y{v}", "first number counts columns"),
    "rows_from_below": (lambda v, u: f"view_{4 - v:02}_{u:02}", "rows count from below"),
    "columns_from_the_right": (
        lambda v, u: f"out_{v:02}_{4 - u:02}_{60 * v:.6f}_{60 * (4 - u):.6f}_",
        "columns count from the right",
    ),
    "columns_first_from_the_right": (lambda v, u: f"{4 - u}_{v}", "columns count from the right"),
    "columns_first_rows_from_below": (lambda v, u: f"{u}_{4 - v}", "rows count from below"),
    "running_to_and_fro": (
        lambda v, u: f"frame_{5 * v + (u if v % 2 == 0 else 4 - u):03}",
        "every second row of views runs back",
    ),
    "running_down_and_up": (
        lambda v, u: f"frame_{5 * u + (v if u % 2 == 0 else 4 - v):03}",
        "every second row of views runs back, the first number counts columns",
    ),
}


@pytest.mark.parametrize("order", ORDERS)
def test_views_by_name(tmp_path: Path, order: str) -> None:
    name, text = ORDERS[order]
    source = recognise(write_views(tmp_path / order, name))
    assert np.array_equal(source.all_views().pixels, VIEWS)
    words, confidence, notable = told(source)
    assert text in words
    assert (confidence, notable) == ("measured", order != "as_named")


@pytest.mark.parametrize("order", ["columns_first", "rows_from_below", "running_to_and_fro"])
@pytest.mark.parametrize(("m", "noise"), [(3, 0), (3, 20), (4, 0), (5, 20)])
def test_few_views_and_noise(tmp_path: Path, order: str, m: int, noise: int) -> None:
    rng = np.random.default_rng(54)
    views = disc_views(m)
    views = np.clip(views + rng.normal(0, noise, views.shape), 0, 255).astype(np.uint8)
    stored = {
        "columns_first": views.swapaxes(0, 1),
        "rows_from_below": views[::-1],
        "running_to_and_fro": np.stack(
            [row[::-1] if n % 2 else row for n, row in enumerate(views)]
        ),
    }[order]
    found = recognise(write_views(tmp_path / "views", lambda v, u: f"{v}_{u}", stored))
    # Without a view far enough out, nothing tells which of two axes is reversed.
    assert np.array_equal(found.all_views().pixels, views)
    assert told(found)[2]


def test_both_reversed_is_an_option(tmp_path: Path) -> None:
    folder = write_views(tmp_path / "views", lambda v, u: f"view_{4 - v}_{4 - u}")
    source = recognise(folder)
    assert np.array_equal(source.all_views().pixels, VIEWS[::-1, ::-1])
    assert "--flip both" in told(source)[0]
    assert told(source)[2]
    flipped = recognise(folder, Hints(flip="both"))
    assert np.array_equal(flipped.all_views().pixels, VIEWS)
    assert "as --flip tells" in told(flipped)[0]


@pytest.mark.parametrize(
    ("flip", "order"), list(product(["none", "rows", "columns", "both"], ["rows", "columns"]))
)
def test_what_is_told_is_done(tmp_path: Path, flip: str, order: str) -> None:
    stored = VIEWS.swapaxes(0, 1) if order == "columns" else VIEWS
    folder = write_views(tmp_path / "views", lambda v, u: f"{v}_{u}", stored)
    found = recognise(folder, Hints(flip=flip, order=order))
    rows = slice(None, None, -1 if flip in ("rows", "both") else 1)
    columns = slice(None, None, -1 if flip in ("columns", "both") else 1)
    assert np.array_equal(found.all_views().pixels, VIEWS[rows, columns])
    assert ("contradicts" in told(found)[0]) == (flip in ("rows", "columns"))


def test_little_texture(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    views = (100 + rng.normal(0, 3, (3, 3, 64, 64))).astype(np.uint8)
    source = recognise(write_views(tmp_path / "views", lambda v, u: f"{u}_{v}", views))
    text, confidence, notable = told(source)
    assert "too little parallax to tell the order and direction" in text
    assert (confidence, notable) == ("unknown", True)


CHANGES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "exchanged": lambda views: views.swapaxes(0, 1),
    "from_below": lambda views: views[::-1],
    "from_the_right": lambda views: views[:, ::-1],
}


@pytest.mark.parametrize("change", CHANGES)
def test_rasters_and_mosaics(tmp_path: Path, change: str) -> None:
    stored = CHANGES[change](VIEWS)
    write_png(tmp_path / "raster.png", compose(stored))
    rows, columns = VIEWS.shape[2:4]
    tiles = np.moveaxis(stored, 2, 1).reshape(5 * rows, 5 * columns, 3)
    write_png(tmp_path / "mosaic.png", tiles)
    for name in ("raster.png", "mosaic.png"):
        for hints in (Hints(), Hints(5)):
            source = recognise(tmp_path / name, hints)
            assert np.array_equal(source.field().picture.pixels, compose(VIEWS))
            assert told(source)[2]


def test_a_film_to_and_fro(tmp_path: Path) -> None:
    views = np.stack([row[::-1] if n % 2 else row for n, row in enumerate(VIEWS)])
    assert write_webm(tmp_path / "film.webm", list(views.reshape(25, *VIEWS.shape[2:])), 25)
    source = recognise(tmp_path / "film.webm")
    assert "every second row of views runs back: put right" in told(source)[0]
    error = source.all_views().pixels.astype(int) - VIEWS
    assert np.abs(error).mean() < 10


def test_orientation_of_exif(tmp_path: Path) -> None:
    """Pixels lie as the sensor has them; all is turned by 90 degrees."""
    folder = tmp_path / "views"
    folder.mkdir()
    exif = Pillow.Exif()
    exif[0x0112] = 6
    for v, u in np.ndindex(5, 5):
        Pillow.fromarray(VIEWS[v, u]).save(folder / f"view_{v}_{u}.png", exif=exif)
    turned = np.rot90(VIEWS, -1, (2, 3)).swapaxes(0, 1)[:, ::-1]
    assert np.array_equal(recognise(folder).all_views().pixels, turned)


def test_real_light_fields_are_left_alone() -> None:
    for name in ("flower_detail_5x5.png", "planes_5x5.png"):
        source = recognise(DATA / name)
        assert told(source)[1:] == ("measured", False)
        assert np.array_equal(source.field().picture.pixels, read_image(DATA / name))


def test_alpha(tmp_path: Path) -> None:
    """An opaque one is dropped, another one told."""
    alpha = np.full((*VIEWS.shape[:-1], 1), 255, np.uint8)
    folder = write_views(
        tmp_path / "opaque", lambda v, u: f"{v}_{u}", np.concatenate([VIEWS, alpha], axis=-1)
    )
    source = recognise(folder)
    assert np.array_equal(source.all_views().pixels, VIEWS)
    assert all(one.heading != "alpha" for one in source.findings)
    alpha[..., :9, :, :] = 0
    raster = compose(np.concatenate([VIEWS, alpha], axis=-1))
    (tmp_path / "holes.png").write_bytes(encode_png(raster))
    source = recognise(tmp_path / "holes.png")
    assert source.micro_image_size == 5
    assert [one.notable for one in source.findings if one.heading == "alpha"] == [True]


def test_batch_does_not_turn(tmp_path: Path) -> None:
    """Frames are refocused as they lie: one that lies otherwise is refused."""
    write_png(tmp_path / "raster.png", compose(VIEWS[::-1]))
    words = ["batch", str(tmp_path / "raster.png"), "-M", "5", "-a", "0", "--out", str(tmp_path)]
    with pytest.raises(InputError, match=r"rows count from below; plenofir compose .* puts one"):
        run(words)
    with pytest.raises(InputError, match="refocused as they lie"):
        run([*words, "--order", "rows", "--flip", "rows"])


ROWS, COLUMNS = 48, 64


def stored_views(place: Path, stored_as: str) -> int:
    """Views as people have them, in a wrong order; their M."""
    m = 8 if stored_as == "mosaic.png" else 5
    views = disc_views(m, ROWS, COLUMNS)
    if stored_as == "mosaic.png":
        # Even M, grey, rows from below.
        tiles = np.moveaxis(views[::-1, ..., 1], 2, 1).reshape(m * ROWS, m * COLUMNS)
        write_png(place, np.ascontiguousarray(tiles))
    elif stored_as == "line":
        place.mkdir()
        for u in range(m):
            write_png(place / f"frame_{u:03}.png", np.ascontiguousarray(views[m // 2, u]))
    else:
        write_views(place, ORDERS[stored_as][0], views)
    return m


@pytest.mark.parametrize("stored_as", ["columns_first", "rows_from_below", "mosaic.png", "line"])
def test_depth_by_commands(
    tmp_path: Path, stored_as: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What commands make of views as they lie: three planes, sharp everywhere, told on the way."""
    place = tmp_path / stored_as
    m = stored_views(place, stored_as)
    aside = m // 2 - (m - 1) / 2
    assert run(["depth-map", str(place), "--out", str(tmp_path / "depth")]) == 0
    assert ("note: axes: " in capsys.readouterr().err) == (stored_as != "line")
    depth = np.load(tmp_path / "depth" / "disparity.npy")
    assert (np.abs(depth - true_disparity(ROWS, COLUMNS, aside)) < 0.15).mean() > 0.98
    words = ["stack", str(place), "-a", "-1", "-a", "1", "--all-in-focus", "--exposure", "off"]
    assert run([*words, "--out", str(tmp_path / "stack")]) == 0
    sharp = read_image(tmp_path / "stack" / "all_in_focus.png").astype(float)
    scale = 1 if stored_as == "line" else m
    # Seen from the middle of the pupil, where even M has no view: the edges of near things, a tenth
    # of the picture, are less exact.
    truth = disc_view(0, 0, ROWS, COLUMNS, scale)
    truth = truth[..., 1] if sharp.ndim == 2 else truth
    assert 10 * np.log10(255**2 / ((sharp - truth) ** 2).mean()) > (40 if m % 2 else 36)
