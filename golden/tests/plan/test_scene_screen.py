# SPDX-License-Identifier: Apache-2.0
"""The screen of a scene: outputs, texts, colours, resources."""

import itertools
from math import inf
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir
from written_scenes import write

from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.screen.board_screen import Screen, screen_package
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import board_packages, configure
from plenofir.plan.plan import Plan
from plenofir.plan.scene_screen import scene_overlay, slice_colours

DEPTH = """
name = "test"
[camera]
model = "f193-mla2"
focus_mm = 5000.0
micro_image_size = 3
[frame]
columns = 640
rows = 480
rate_hz = 60.0
colour = "rgb"
[depth]
slices = ["-1/3", "0", "1/3", "2/3"]
[screen]
output = ["refocused", "all-in-focus", "depth"]
overlay = true
[build]
path = "video"
"""


def plan_of(folder: Path, *changes: tuple[str, str]) -> Plan:
    return make_plan(load_scene(write(folder, DEPTH, *changes)))


def test_texts_of_the_ray_model() -> None:
    model = RayModel.focused(load_camera("f193-mla2"), 5000.0, 5)
    overlay = scene_overlay((-2, 0, 4), 5, model)
    assert overlay.texts == (
        "a = -2/5   beyond inf   25.6 m to inf",
        "a = 0   5.00 m   2.13 to 104 m",
        "a = 4/5   1.09 m   0.75 to 1.61 m",
        "all in focus   0.75 m to inf",
        "depth   0.75 m to inf",
        "input as it is",
    )
    assert overlay.labels == ("> inf", "5000 mm", "1090 mm")


def test_texts_at_infinity_and_near() -> None:
    far = RayModel.focused(load_camera("f193-mla2"), inf, 5)
    assert scene_overlay((0,), 5, far).texts[0] == "a = 0   inf   3.26 m to inf"
    # All below a metre: mm.
    near = RayModel.focused(load_camera("f90-mla1"), 600.0, 5)
    overlay = scene_overlay((0, 60), 5, near)
    assert overlay.texts[0] == "a = 0   600 mm   512 to 682 mm"
    assert overlay.texts[1].startswith("a = 12   ")
    assert overlay.labels[0] == "600 mm"


def test_texts_without_a_camera(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, ('model = "f193-mla2"\n', ""), ("focus_mm = 5000.0\n", ""))
    assert plan.screen.overlay is not None
    assert plan.screen.overlay.texts[0] == "a = -1/3"
    assert plan.screen.overlay.labels == ("-1/3", "0", "1/3", "2/3")


def test_colours_go_evenly_from_far_to_near() -> None:
    colours = slice_colours((2, -1, 0, 5))
    assert colours[1] == (68, 1, 84)
    assert colours[3] == (253, 231, 37)
    # Lightness (CIE 1976) grows in equal steps.
    light = []
    for colour in (colours[i] for i in (1, 2, 0, 3)):
        linear = [((c / 255 + 0.055) / 1.055) ** 2.4 if c > 10 else c / 3295 for c in colour]
        y = sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
        light.append(116 * y ** (1 / 3) - 16)
    steps = [b - a for a, b in itertools.pairwise(light)]
    assert min(steps) > 0.8 * max(steps)


def test_depth_is_coloured_between_slices(tmp_path: Path) -> None:
    plain = plan_of(tmp_path)
    plan = plan_of(tmp_path, ("overlay", "between_slices = true\noverlay"))
    assert (len(plain.screen.colours), len(plan.screen.colours)) == (4, 32)
    # Those of a slice lie around its own; beyond the ends there is no more.
    assert plan.screen.colours[:5] == plan.screen.colours[:1] * 4 + plan.screen.colours[4:5]
    # The legend has colours of the depth picture: the fifth of eight.
    assert plan.screen.overlay.texts == plain.screen.overlay.texts
    black = np.zeros((*plan.screen.overlay.size, 3), np.uint8)
    drawn = plan.screen.overlay.draw(black, "depth", 0)
    seen = {tuple(colour) for colour in drawn.reshape(-1, 3)}
    assert set(plan.screen.colours[4::8]) <= seen
    assert plan.screen.index(plan.core).shifts == plan.core.shifts
    (package,) = (f for f in configure(plan, tmp_path / "out") if f.stem == "screen_pkg")
    assert bytes(plan.screen.colours[-1]).hex() in package.read_text()


def test_a_smaller_box_in_focus(tmp_path: Path) -> None:
    """The board's core has each slice twice; texts, colours and the plan's table have it once."""
    three = (', "2/3"]', "]")
    without = plan_of(tmp_path, three)
    plan = plan_of(tmp_path, three, ("overlay", "sharp_box = 1\noverlay"))
    generics = board_generics(plan.core, "atlys_top")
    assert generics["SHIFTS"] == "-1 -1 0 0 1 1"
    assert generics["BOX"] == "3 1 3 3 3 1"
    assert (plan.screen.overlay, plan.screen.colours) == (
        without.screen.overlay,
        without.screen.colours,
    )
    assert [part.box for part in plan.slices] == [3] * 3
    assert "SHARP_TOO        : boolean := true;" in screen_package(plan.screen)
    assert "SHARP_TOO        : boolean := false;" in screen_package(without.screen)
    assert plan.needs["block RAM (18 Kbit)"] > without.needs["block RAM (18 Kbit)"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([('"depth"]', '"index"]')], "screen.output.2 = 'index' should be 'refocused', 'all-in-"),
        ([('"depth"]', '"refocused"]')], "screen: give each output once"),
        ([("output = [", "output = [] # [")], "screen.output = () "),
        ([("overlay = true", "overlay = 1")], "screen.overlay = 1 should be a valid boolean"),
        ([("overlay = true", "vote_radius = 5")], "screen.vote_radius = 5 should be less than or"),
        ([("overlay = true", "confidence = -1.0")], "screen.confidence = -1.0 should be greater"),
        ([("overlay = true", "texts = 1")], "there is no field screen.texts"),
        (
            [(', "all-in-focus", "depth"]', "]"), ("overlay", "radius = 1 #")],
            "screen: radius needs the output 'all-in-focus' or 'depth'",
        ),
        (
            [(', "depth"]', "]"), ("overlay", "between_slices = true #")],
            "screen: between_slices needs the output 'depth'",
        ),
        (
            [('"0", "1/3", "2/3"]', '"2/3", "0"]'), ("overlay", "between_slices = true #")],
            "depth between slices needs three or more, going up or down, not 3 of a' = -1 2 0",
        ),
        ([('path = "video"', "")], "screen needs build.path = 'video'"),
        (
            [('"all-in-focus", ', ""), ("overlay", "sharp_box = 1\noverlay")],
            "screen: sharp_box needs the output 'all-in-focus'",
        ),
        ([("overlay", "sharp_box = 3\noverlay")], "screen.sharp_box: no slice of M = 3 has a box"),
        (
            [("overlay", "sharp_box = 1\noverlay"), ("[build]", "[build]\nnoise = 0.5")],
            "screen.sharp_box: sharp_box needs slices",
        ),
        (
            [('path = "video"', 'path = "video"\narithmetic = "stored"')],
            "screen.output needs build.arithmetic = 'exact'",
        ),
        (
            [('path = "video"', 'path = "video"\ninterpolation = "linear"')],
            "screen.output needs build.interpolation = 'nearest'",
        ),
        (
            [('path = "video"', 'path = "video"\nengine = "fir"')],
            "all slices in one pass: build.engine = 'auto'",
        ),
        (
            [('slices = ["-1/3", "0", "1/3", "2/3"]', 'slices = ["1/3"]')],
            "at least two slices, not 1 of M = 3",
        ),
        (
            [('"2/3"]', '"2/3", "1", "4/3", "5/3", "2", "7/3"]'), ('"refocused", ', "")],
            "of 116 block RAM (18 Kbit); use fewer slices, columns or votes",
        ),
        (
            [("micro_image_size = 3", "micro_image_size = 5"), ('"-1/3", "0", "1/3", "2/3"',
             '"-1/5", "0", "1/5", "2/5", "4/5"'), ('path = "video"',
             'path = "video"\ndevice = "lfe5u-45f"')],
            "the LFE5U-45F is too small: it needs 174 of 108 block RAM (18 Kbit)",
        ),
    ],
)  # fmt: skip
def test_refused(tmp_path: Path, changes: list[tuple[str, str]], message: str) -> None:
    done = plenofir("plan", str(write(tmp_path, DEPTH, *changes)))
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_text_larger_than_the_picture(tmp_path: Path) -> None:
    many = ", ".join(f'"{n}/11"' for n in range(-40, 24))
    changes = [("micro_image_size = 3", "micro_image_size = 11"), ('"refocused", "all', '"all')]
    changes += [('"-1/3", "0", "1/3", "2/3"', many), ("overlay", "radius = 1\noverlay")]
    with pytest.raises(
        InputError, match=r"a text of .* pixels does not fit on a picture of 640 x 480"
    ):
        plan_of(tmp_path, *changes)


def test_what_it_takes(tmp_path: Path) -> None:
    whole = plan_of(tmp_path)
    assert whole.core.engine.kind == "stack"
    assert whole.screen.outputs == "rad"
    assert whole.screen_needs is not None
    # 6 grey levels, luma of 4, 9 pixels, a window of 9.
    assert whole.screen.confidence == 6 * 4 * 9 * 9
    assert whole.latency_lines == whole.core.delay + 4 * 3 + 2
    slices = ('output = ["refocused", "all-in-focus", "depth"]\n', "")
    plain = plan_of(tmp_path, slices)
    bare = plan_of(tmp_path, slices, ("overlay = true", ""))
    assert bare.screen == Screen()
    # Outputs that are not requested are left out, and listed as such.
    for name, needed in bare.needs.items():
        assert whole.needs[name] >= plain.needs[name] >= needed
    assert plain.needs["LUT"] == bare.needs["LUT"] + plain.screen_needs["LUT"]
    left = [part.what for part in bare.left_out]
    assert "all-in-focus and depth: focal stack, depth index" in left
    assert "text over the picture" in left
    assert not any("text" in part.what for part in whole.left_out)


def test_package_of_a_scene(tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    sources = configure(plan, tmp_path / "out")
    own = tmp_path / "out" / "screen_pkg.vhd"
    assert own in sources
    assert own.read_text() == screen_package(plan.screen)
    # Long texts take several lines.
    text = own.read_text().replace('" &\n    "', "")
    assert "a = 1/3   2.01 m   0.75 to 11.2 m" in text
    assert '"440154' in text
    generics = board_generics(plan.core)
    assert generics == {"MICRO_IMAGE_SIZE": 3, "SHIFTS": "-1 0 1 2", "MAX_COLUMNS": 640}
    assert list(board_packages(plan)) == ["screen_pkg"]
    changes = ('output = ["refocused", "all-in-focus", "depth"]\n', ""), ("overlay = true", "")
    bare = plan_of(tmp_path, *changes)
    assert board_packages(bare) == {}
    assert not any(tmp_path in source.parents and source.stem == "screen_pkg"
                   for source in configure(bare, tmp_path / "bare"))  # fmt: skip


def test_shipped_scene() -> None:
    plan = make_plan(load_scene("ulx3s-depth"))
    assert (plan.screen.outputs, len(plan.slices)) == ("rad", 5)
    said = plenofir("plan", "ulx3s-depth").stdout
    assert "a = 4/5   1.09 m   0.75 to 1.61 m" in said
    assert "refocused, all-in-focus, depth" in said
