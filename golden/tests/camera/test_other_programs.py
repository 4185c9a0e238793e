# SPDX-License-Identifier: Apache-2.0
"""Files as other cameras and programs write them: what is read, and what the refusals say."""

import json
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
from drawn_views import drawn
from in_process import plenofir
from PIL import Image as Pillow

from plenofir.ground.errors import InputError
from plenofir.ground.films import write_webm
from plenofir.refocus.batch import dask_client

VIEWS = drawn(9, 9)[0]


def said(path: Path) -> str:
    """What `inspect` says; nothing of it is an error of the program."""
    done = plenofir("inspect", path.name, cwd=path.parent)
    assert done.returncode in (0, 2)
    return done.stdout + done.stderr


def test_the_cross_of_the_hci_benchmark(tmp_path: Path) -> None:
    """Its central row and column alone; the row is a line of views, as the refusal says."""
    folder = tmp_path / "cross"
    folder.mkdir()
    for number, (v, u) in enumerate(np.ndindex(9, 9)):
        if 4 in (v, u):
            Pillow.fromarray(VIEWS[v, u]).save(folder / f"input_Cam{number:03}.png")
    text = said(folder)
    assert "17 views input_CamNNN.png" in text
    assert "the middle row in a folder of its own" in text
    row = tmp_path / "row"
    row.mkdir()
    for u in range(9):
        Pillow.fromarray(VIEWS[4, u]).save(row / f"view_{u:03}.png")
    assert "9 views in one line" in said(row)


def test_a_film_of_quilts(tmp_path: Path) -> None:
    quilt = VIEWS[4].reshape(3, 3, 48, 64, 3)[::-1].transpose(0, 2, 1, 3, 4).reshape(144, 192, 3)
    path = tmp_path / "clip_qs3x3a1.33.webm"
    assert write_webm(path, 3 * [np.ascontiguousarray(quilt)], 10)
    assert "frames are quilts of 3 x 3 views, by its name" in said(path)
    Pillow.fromarray(quilt).save(tmp_path / "frame_qs3x3a1.33.png")
    assert "9 views of 64 x 48 pixels in a line" in said(tmp_path / "frame_qs3x3a1.33.png")


def test_photographs_in_a_folder(tmp_path: Path) -> None:
    """A camera's JPEG files are no rasters with M = 8, the size of their blocks."""
    folder = tmp_path / "photos"
    folder.mkdir()
    for number in range(4):
        view = VIEWS[4, 4].repeat(4, 0).repeat(4, 1)
        Pillow.fromarray(view).save(folder / f"photo_{number}.jpg", quality=60)
    assert "aligned raster" not in said(folder)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (".zgroup", "a Zarr array, which is not read"),
        ("zarr.json", "a Zarr array, which is not read"),
        ("view_0_0.exr", "pictures that are not read: *.exr"),
        ("view_0_0.webp", "pictures that are not read: *.webp"),
        ("notes.txt", "no image files in the folder"),
    ],
)
def test_folders_of_what_is_not_read(tmp_path: Path, name: str, text: str) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / name).write_text(json.dumps({"zarr_format": 2}))
    assert text in said(folder)


def test_the_sensors_data_behind_a_jpeg(tmp_path: Path) -> None:
    """As raspistill -r writes them."""
    path = tmp_path / "pi.jpg"
    Pillow.fromarray(VIEWS[4, 4]).save(path)
    assert "left out" not in said(path)
    with path.open("ab") as file:
        file.write(b"BRCMo" + bytes(32763))
    assert "the sensor's data behind the JPEG are left out" in said(path)


def test_pipes(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    assert "is a pipe, which can be read once only" in said(tmp_path / "pipe.png")


def test_a_folder_for_temporary_files_that_is_no_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", os.fsdecode(b"/tmp/\xff"))
    with pytest.raises(InputError, match="is no text"), dask_client("local", 1):
        pass
