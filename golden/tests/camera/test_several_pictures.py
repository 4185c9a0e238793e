# SPDX-License-Identifier: Apache-2.0
"""Files with several pictures: which one is taken is told, or the file is refused."""

from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir
from PIL import Image as Pillow
from tifffile import TiffWriter

from plenofir.ground.images import read_image
from plenofir.ground.project import DATA

RASTER = read_image(DATA / "flower_detail_5x5.png")[:100, :100]
OTHER = np.ascontiguousarray(RASTER[::-1])
FIRST = Pillow.fromarray(RASTER)
MORE = {"save_all": True, "append_images": [Pillow.fromarray(OTHER)]}


def said(path: Path, code: int = 0) -> str:
    """What `refocus` says of a file."""
    done = plenofir("refocus", path.name, "-M", "5", "-a", "0", "--out", "out.png", cwd=path.parent)
    assert done.returncode == code, done.stderr
    return done.stderr


@pytest.mark.parametrize(
    ("name", "format_", "text"),
    [
        ("pair.jpg", "MPO", "of 2 pictures in the JPEG (MPO) the first is taken"),
        ("moving.png", "PNG", "of 2 frames of the animation (APNG) the first is taken"),
    ],
)
def test_the_first_picture_is_taken_and_told(
    tmp_path: Path, name: str, format_: str, text: str
) -> None:
    path = tmp_path / name
    FIRST.save(path, format_, **MORE)
    assert text in said(path)
    assert text in plenofir("inspect", name, "-M", "5", cwd=tmp_path).stdout
    FIRST.save(path)
    assert "note" not in said(path)


def test_batch_tells_too(tmp_path: Path) -> None:
    FIRST.save(tmp_path / "pair.jpg", "MPO", **MORE)
    words = ("-M", "5", "-a", "0", "--workers", "1")
    done = plenofir("batch", "pair.jpg", *words, cwd=tmp_path)
    assert "(MPO) the first is taken" in done.stderr


def test_a_folder_of_pairs(tmp_path: Path) -> None:
    """A stereo camera's files as views."""
    folder = tmp_path / "views"
    folder.mkdir()
    for v, u in np.ndindex(3, 3):
        view = Pillow.fromarray(np.ascontiguousarray(RASTER[v::5, u::5]).repeat(3, 0).repeat(3, 1))
        view.save(folder / f"{v}_{u}.jpg", "MPO", save_all=True, append_images=[view])
    assert "(MPO) the first is taken" in plenofir("inspect", "views", cwd=tmp_path).stdout


def test_pages_of_several_sizes(tmp_path: Path) -> None:
    """A thumbnail beside two frames."""
    path = tmp_path / "frames.tif"
    with TiffWriter(path) as file:
        file.write(RASTER[::4, ::4].copy(), photometric="rgb", metadata=None)
        for frame in (RASTER, OTHER):
            file.write(frame, photometric="rgb", metadata=None)
    done = plenofir("inspect", path.name, cwd=tmp_path)
    assert "1 pages of other sizes are left out" in done.stdout + done.stderr
    alone = tmp_path / "thumbnail.tif"
    with TiffWriter(alone) as file:
        file.write(RASTER, photometric="rgb", metadata=None)
        file.write(RASTER[::4, ::4].copy(), photometric="rgb", metadata=None)
    assert "has 2 pages; one image is needed" in said(alone, code=2)


def test_a_pyramid(tmp_path: Path) -> None:
    path = tmp_path / "pyramid.tif"
    with TiffWriter(path) as file:
        file.write(RASTER, photometric="rgb", metadata=None, subifds=1)
        file.write(RASTER[::2, ::2].copy(), photometric="rgb", metadata=None)
    assert "of a pyramid of sizes the largest is taken" in said(path)


@pytest.mark.parametrize("format_", ["WEBP", "ICO", "GIF"])
def test_other_containers_are_refused_or_films(tmp_path: Path, format_: str) -> None:
    path = tmp_path / "one.png"
    FIRST.save(path, format_, **({} if format_ == "ICO" else MORE))
    assert "no image of a known kind" in said(path, code=2)


def test_several_pictures_in_a_netpbm_file(tmp_path: Path) -> None:
    """The format allows for them (`man pnm`)."""
    path = tmp_path / "two.ppm"
    with path.open("wb") as file:
        for image in (RASTER, OTHER):
            file.write(b"P6\n100 100\n255\n" + image.tobytes())
    text = said(path, code=2)
    assert "2 pictures" in text
