# SPDX-License-Identifier: Apache-2.0
"""A scene's light field that is kept on the chip."""

from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.fpga.devices import DEVICES
from plenofir.fpga.screen.chip_light_field import store, stored_package
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import board_packages, configure

SHIPPED = project.root() / "scenes" / "tangnano20k.toml"


def write(folder: Path, *changes: tuple[str, str]) -> Path:
    text = SHIPPED.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_shipped_scene(tmp_path: Path) -> None:
    plan = make_plan(load_scene("tangnano20k"))
    assert plan.stored is not None
    assert plan.stored.lenses == (91, 90)
    device = DEVICES[plan.device]
    assert plan.stored_needs == {
        **dict.fromkeys(device.amounts(device.total), 0),
        **plan.stored_needs,
    }
    assert not [n for n, needed in plan.needs.items() if needed > plan.available[n]]
    packages = board_packages(plan)
    assert set(packages) == {"screen_pkg", "stored_pkg"}
    configure(plan, tmp_path / "out")
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"tangnano20k_top.vhd", "tangnano20k_top.cst", "tangnano20k_top.sdc"} <= files
    assert (tmp_path / "out" / "stored_pkg.vhd").read_text() == packages["stored_pkg"]


def test_own_picture(tmp_path: Path) -> None:
    raw = np.random.default_rng(3).integers(0, 256, (33, 42), np.uint8)
    write_png(tmp_path / "own.png", raw)
    scene = write(
        tmp_path,
        ("flower_5x5.png", "own.png"),
        *(("top = 30", "top = 1"), ("left = 29", "left = 0")),
        *(("rows = 91\n", "rows = 4\n"), ("columns = 90\n", "columns = 8\n")),
        ("move_focus = 1\n", ""),
    )
    plan = make_plan(load_scene(scene))
    grey = np.repeat(raw[5:25, :40, None], 3, axis=2)
    assert plan.stored is not None
    assert np.array_equal(plan.stored.raster(), store(grey, 5).raster())
    assert board_packages(plan)["stored_pkg"] == stored_package(store(grey, 5))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rows = 91", "rows = 130", "rows 30 to 159 of the 160 of flower_5x5.png"),
        ("left = 29", "left = 1", "columns 1 to 90 of the 160"),
        ("flower_5x5.png", "none.png", "none.png"),
        ('device = "gw2ar-18"', 'device = "xc6slx45"', "480 x 480 at 60 Hz is not a mode"),
        ("rate_hz = 60.0", "rate_hz = 50.0", "480 x 480 at 50 Hz is not a mode of the Sipeed"),
        ("columns = 90", "columns = 115", "BSRAM"),
        ("move_focus = 1", "move_focus = 9", "move_focus"),
    ],
)
def test_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    scene = write(tmp_path, (old, new))
    if old == "columns = 90":
        scene.write_text(scene.read_text().replace("left = 29", "left = 10"))
    with pytest.raises(InputError) as caught:
        make_plan(load_scene(scene))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('path = "video"\n', "", "build.path = 'video'"),
        ("[build]", "[sensor]\npixel_um = 9.0\n[build]", ""),
    ],
)
def test_belongs_to_boards(tmp_path: Path, old: str, new: str, message: str) -> None:
    done = plenofir("plan", str(write(tmp_path, (old, new))))
    assert done.returncode == 2
    assert message in done.stderr


def test_on_boards_with_an_input(tmp_path: Path) -> None:
    # The same in place of the test pattern; frames are whole.
    for device in ("xc6slx45", "lfe5u-45f"):
        scene = write(
            tmp_path,
            ("columns = 480", "columns = 640"),
            ("gw2ar-18", device),
        )
        plan = make_plan(load_scene(scene))
        assert "stored_pkg" in board_packages(plan)
    # Another device: the core alone.
    plan = make_plan(load_scene(write(tmp_path), "xc7a35t"))
    assert (plan.path, plan.stored, plan.screen.overlay) == ("core", None, None)


def test_a_board_without_input_takes_its_own_frames_alone() -> None:
    assert make_plan(load_scene("tangnano20k", "gw2ar-18")).path == "video"
    for scene in ("rgb-480p", "rgb-720p"):
        plan = make_plan(load_scene(scene, "gw2ar-18"))
        assert plan.path == "core"
        assert not [n for n, needed in plan.needs.items() if needed > plan.available[n]]
