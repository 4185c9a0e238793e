# SPDX-License-Identifier: Apache-2.0
"""The test picture for a board: marks, sizes, and the board's verdict."""

from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.fpga.hdmi import marks
from plenofir.fpga.screen.first_light import flower_picture, screen_picture
from plenofir.ground.errors import InputError
from plenofir.ground.images import read_image
from plenofir.plan import load_scene


@pytest.mark.parametrize("columns", [320, 640, 801, 1280])
def test_changes_of_a_marked_line_are_told_apart(columns: int) -> None:
    line = marks.mark_line(columns)
    assert marks.judge(line) == 2
    assert columns < 256 or all(len(set(line[:, c])) == 256 for c in range(3))
    # Limited range and back again, another gamma, a colour profile of another monitor.
    limited = np.round(16 + line / 255 * 219)
    gamma = np.round(255 * (line / 255) ** (2.2 / 2.1))
    mixed = np.clip(np.round(line @ np.array([[0.95, 0.03, 0.02], [0, 1, 0], [0, 0, 1]])), 0, 255)
    for changed in (limited, np.round((limited - 16) * 255 / 219 - 1), gamma, mixed):
        assert marks.judge(np.clip(changed, 0, 255).astype(np.uint8)) == 1
    # Scaled by any factor, moved, mirrored, with an overscan, another picture.
    places = np.arange(columns)
    for scale in (0.5, 0.95, 0.99, 1.01, 1.5, 2.0):
        assert marks.judge(line[np.round(places * scale).astype(int) % columns]) == 0
    for other in (np.roll(line, 1, 0), line[::-1], np.roll(line, -9, 0), np.zeros_like(line)):
        assert marks.judge(other) == 0


@pytest.mark.parametrize("m", [1, 2, 3, 5, 7, 11, 15])
@pytest.mark.parametrize(("columns", "rows"), [(640, 480), (1280, 720), (64, 36)])
def test_flower_fills_any_screen(columns: int, rows: int, m: int) -> None:
    picture = flower_picture(columns, rows, m)
    assert picture.shape == (rows, columns, 3)
    # Where the flower's own micro images fit, they are its views, to the bit.
    if m == 5 and columns <= 800:
        flower = read_image(Path(__file__).parents[3] / "plenofir" / "data" / "flower_5x5.png")
        assert np.array_equal(picture, flower[:rows, :columns])


def test_light_fields_of_users() -> None:
    raw = np.random.default_rng(7).integers(0, 256, (25, 33), np.uint8)
    picture = screen_picture(raw, 40, 20, 5, where="raw")
    assert np.array_equal(picture[:, :30, 1], raw[:20, :30])
    assert not picture[:, 30:].any()
    with pytest.raises(InputError, match="raw: has more than 8 bits"):
        screen_picture(raw.astype(np.uint16), 40, 20, 5, where="raw")
    with pytest.raises(InputError, match="smaller than a micro image"):
        screen_picture(raw, 40, 20, 26, where="raw")


def test_command(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = plenofir("board", "picture", "--size", "320x200", "-M", "5", "--out", str(out))
    assert done.returncode == 0, done.stderr
    shown = read_image(out / "picture.png")
    assert shown.shape == (200, 320, 3)
    assert marks.judge(shown[0]) == 2
    page = (out / "picture.html").read_text()
    assert "320 / ratio" in page
    assert "200 / ratio" in page
    # Without options what the page builds; with a scene its own.
    for options in ([], ["--scene", "ulx3s-480p"]):
        assert plenofir("board", "picture", *options, "--out", str(out)).returncode == 0
    assert read_image(out / "picture.png").shape == (480, 640, 3)
    # A scene that keeps a light field: the same one, its focus moved as on the chip.
    assert plenofir("board", "picture", "--scene", "flower-480p", "--out", str(out)).returncode == 0
    shown, kept = read_image(out / "picture.png"), load_scene("flower-480p").stored
    assert kept is not None
    # Kept from micro image (30, 29) on; the picture begins 2 micro images within.
    part, raster = shown[140:480, 135:585].astype(int), kept.raster()[:340].astype(int)
    assert np.abs(part - raster).mean() < 8
    assert np.abs(part - np.roll(raster, 5, 1)).mean() > np.abs(part - raster).mean() + 1
    again = plenofir("board", "picture", str(out / "picture.png"), "--out", str(tmp_path / "own"))
    assert again.returncode == 0, again.stderr
    refused = plenofir("board", "picture", "--size", "640", "--out", str(tmp_path / "no"))
    assert (refused.returncode, (tmp_path / "no").exists()) == (2, False)
    assert "640x480" in refused.stderr
