# SPDX-License-Identifier: Apache-2.0
"""Refusals of the commands from a raw capture to pictures."""

from pathlib import Path
from shutil import copy

import numpy as np
import pytest
from in_process import plenofir

from plenofir.camera.calibration import calibrate
from plenofir.camera.rays.camera import CAMERAS
from plenofir.fpga.hdmi.edid import make_edid
from plenofir.fpga.hdmi.modes import HD720
from plenofir.ground.images import write_png
from plenofir.ground.project import root
from plenofir_studies.synthetic import regular_grid, white_image


@pytest.fixture(scope="module")
def bad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bad")
    shape = (120, 140)
    white = white_image(shape, regular_grid(shape, 11.03), bits=8)
    images = {
        "white": white,
        "dim": white // 40,
        "bright": np.clip(white.astype(int) * 20, 0, 255).astype(np.uint8),
        "small": white[:50],
        "plain": np.full(shape, 90, np.uint8),
        "raw": np.random.default_rng(3).integers(0, 256, shape, np.uint8),
    }
    for name, image in images.items():
        write_png(folder / f"{name}.png", image)
    calibrate(white).save(folder / "calib.json")
    (folder / "views").mkdir()
    (folder / "linked.png").symlink_to("raw.png")
    (folder / "a").mkdir()
    for name in ("refocused_a1", "refocused", "sharpness", "view_00_00", "depth"):
        write_png(folder / "a" / f"{name}.png", images["raw"])
    scene = (root() / "scenes" / "rgb-480p.toml").read_text()
    edid = make_edid((HD720,))
    (folder / "a" / "sources.txt").write_bytes(edid)
    (folder / "a" / "plan.json").write_text(scene)
    with_edid = scene.replace("[build]", '[build]\nedid = "sources.txt"')
    (folder / "a" / "scene.toml").write_text(with_edid)
    copy(CAMERAS / "f193-mla2.toml", folder / "a" / "camera.png")
    (folder / "a" / "spots").mkdir()
    write_png(folder / "a" / "spots" / "drawn.png", white)
    (folder / "a" / "spots" / "drawn.txt").write_text("1 2\n3 4\n")
    write_png(folder / "w.png", white)
    (folder / "text.json").write_text("{}")
    for name, text in (("spots", "1 2\n3 4\n"), ("lines", "one two\n")):
        (folder / name).mkdir()
        (folder / name / "two.txt").write_text(text)
    write_png(folder / "lines" / "two.png", white)
    return folder


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("calibrate none.png", "no such file"),
        ("calibrate dim.png", "too dark"),
        ("calibrate bright.png", "too bright"),
        ("calibrate plain.png", "grid"),
        ("calibrate white.png --dark small.png", "140 x 50"),
        ("calibrate white.png --layout round", "--layout"),
        ("calibrate white.png --order 4", "--order"),
        ("calibrate white.png --order x", "--order"),
        ("calibrate white.png --out calib.txt", ".json"),
        ("calibrate white.png --out /proc/none/c.json", "cannot be written"),
        ("calibrate white.png --picture grid.gif", ".png"),
        ("decode white.png --calib none.json -M 5", "no such file"),
        ("decode white.png --calib text.json -M 5", "image_shape"),
        ("decode small.png --calib calib.json -M 5", "140 x 50"),
        ("decode white.png --calib calib.json -M 13", "pitch of"),
        ("decode white.png --calib calib.json -M five", "--micro-image: 'five'"),
        ("decode white.png --calib calib.json -M 5 --interpolation sinc", "sinc"),
        ("decode white.png --calib calib.json -M 5 --scale half", "half"),
        ("decode white.png --calib calib.json -M 5 --out views", "must end in"),
        ("decode white.png --calib calib.json -M 5 --white small.png", "white image"),
        ("views raw.png -M 0", "--micro-image: '0'"),
        ("views raw.png -M 200", "less than one micro image"),
        ("views raw.png -M 5 --out white.png/x", "white.png is not a folder"),
        ("compose views", "no image files"),
        ("compose none", "no such file or folder"),
        ("compose views --order up", "order"),
        ("refocus raw.png -M 5 -a 1/3 --interpolation linear", "not on the grid"),
        ("refocus raw.png -M 5 -a x", "not a focus setting"),
        ("stack raw.png -M 5 -a 1:0", "--a: '1:0'"),
        ("stack raw.png -M 5 -a 0:1:1/3 --depth-index", "--a: 1/3 is not on the grid"),
        ("stack raw.png -M 5 -a 0:1:0", "--a: '0:1:0'"),
        ("stack raw.png -M 5 -a 0:1000", "5001 settings"),
        ("depth-map raw.png -M 5 --camera none", "no such camera"),
        ("depth-map raw.png -M 5 --camera f197-mla2 --focus 3", "focus"),
        ("depth-map raw.png -M 5 --camera f197-mla2 --near x", "--near"),
        ("depth-map raw.png -M 5 --camera f197-mla2 --near=-2", "search"),
        ("depth-map raw.png -M 5 --camera f197-mla2 --near 1e9", "use -28 to 28"),
        ("depth-map raw.png -M 5 --near nan", "--near: nan is not a finite number"),
        ("depth-map raw.png -M 5 --focus 1500", "--focus requires --camera"),
        ("depth-map raw.png -M 5 --ply", "--ply requires --camera"),
        (
            "refocus views -M 5 -a 1",
            "no image files in the folder; give a folder of views, or a picture\n",
        ),
        # Results never replace their inputs, under whatever name.
        ("refocus raw.png -M 5 -a 1 --out raw.png", "raw.png would replace what it is made"),
        ("refocus linked.png -M 5 -a 1 --out raw.png", "raw.png would replace"),
        ("refocus raw.png -M 5 -a 1 --out views/../linked.png", "linked.png would replace"),
        ("stack a/refocused_a1.png -M 5 -a 1 --out a", "refocused_a1.png would replace"),
        ("stack a/sharpness.png -M 5 --out a", "sharpness.png would replace"),
        ("views a/view_00_00.png -M 5 --out a", "view_00_00.png would replace"),
        ("compose a --out a/view_00_00.png", "view_00_00.png would replace"),
        ("depth-map a/depth.png -M 5 --camera f197-mla2 --out a", "depth.png would replace"),
        ("decode white.png --calib calib.json -M 5 --out white.png", "white.png would replace"),
        ("decode white.png --calib calib.json -M 5 --white w.png --out w.png", "would replace"),
        ("calibrate white.png --picture white.png", "white.png would replace"),
        ("sim --raw a/refocused.png -M 5 --out a", "refocused.png would replace"),
        ("configure a/plan.json --out a", "plan.json would replace"),
        ("configure a/scene.toml --out a", "sources.txt would replace"),
        ("distance --camera a/camera.png -a 1 --plot a/camera.png", "camera.png would replace"),
        ("distance --camera f197-mla2 -a 1 --plot a/scene.toml", ".svg or .pdf or .png"),
        ("report calibration --spots a/spots --out a/spots", "is the folder of the spots"),
        ("report calibration --out /proc/none", "cannot be written"),
        ("report calibration --out r --spots none", "no NAME.txt"),
        ("report calibration --out r --spots spots", "two.png: no such file"),
        ("report calibration --out r --spots lines", "no centres"),
    ],
)
def test_bad_input(bad: Path, arguments: str, message: str) -> None:
    before = sorted(bad.rglob("*"))
    done = plenofir(*arguments.split(), cwd=bad)
    assert done.returncode == 2, done.stdout + done.stderr
    assert message in done.stderr
    assert done.stderr.startswith("plenofir: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr
    assert sorted(bad.rglob("*")) == before
