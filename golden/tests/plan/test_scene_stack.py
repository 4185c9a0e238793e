# SPDX-License-Identifier: Apache-2.0
"""Scenes whose core gives all slices at once: what comes out, what it takes, what is refused."""

from pathlib import Path

import pytest
from in_process import plenofir
from written_scenes import write

from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.resources.estimate import estimate
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import package_text, top_text
from plenofir.plan.ip.components import components
from plenofir.plan.plan import Plan

STACK = """
name = "test"
[camera]
micro_image_size = 5
[frame]
columns = 320
rows = 240
rate_hz = 60.0
colour = "rgb"
[depth]
slices = ["-1/5", "0", "1/5"]
[stack]
output = "slices"
[build]
device = "lfe5u-45f"
pixels_per_clock = 4
"""


def plan_of(folder: Path, *changes: tuple[str, str]) -> Plan:
    return make_plan(load_scene(write(folder, STACK, *changes)))


def test_the_shipped_scene() -> None:
    """1080p60 needs 31 MHz with four pixels a clock, and fills the block RAM of the device."""
    plan = make_plan(load_scene("stack-1080p"))
    assert plan.core.engine == StackEngine(pixels_per_clock=4)
    assert (plan.frame_clocks, plan.clock_mhz) == (480 * 1080, pytest.approx(31.104))
    assert plan.latency_lines == plan.core.delay == 8
    assert (plan.needs["block RAM (18 Kbit)"], plan.needs["MULT18X18D"]) == (104, 60)


NO_VOTES = '"\nvote_radius = 0 #'


@pytest.mark.parametrize(
    ("first", "last", "blocks"),
    [(-1, 1, (74, 93, 91, 256, 168)), (-1, 2, (86, 110, 108, 328, 211)),
     (-2, 2, (104, 133, 131, 406, 259))],
)  # fmt: skip
def test_block_ram_at_1080p(tmp_path: Path, first: int, last: int, blocks: tuple[int, ...]) -> None:
    """As the page on stacks tells it; an LFE5U-45F has 108, an LFE5U-85F 208."""
    size = [("columns = 320", "columns = 1920"), ("rows = 240", "rows = 1080")]
    device = ("lfe5u-45f", "xc7a200t")
    slices = ", ".join(f'"{a}/5"' for a in range(first, last + 1))
    outputs = ("slices", "depth", f"depth{NO_VOTES}", "all-in-focus")
    for output, wanted in zip(
        (*outputs, f"all-in-focus{NO_VOTES[:-1]}\nradius = 0 #"), blocks, strict=True
    ):
        changes = (*size, device, ('"-1/5", "0", "1/5"', slices), ('"slices"', f'"{output}"'))
        plan = plan_of(tmp_path, *changes)
        usage = estimate(plan.screen.blocks(plan.core), "ecp5")
        assert usage.block_rams == wanted, output


def test_outputs_take_more_in_turn(tmp_path: Path) -> None:
    slices, depth, focus = (
        plan_of(tmp_path, ('"slices"', f'"{output}"'), ("columns = 320", "columns = 160"))
        for output in ("slices", "depth", "all-in-focus")
    )
    assert all(
        less.needs[name] <= more.needs[name]
        for less, more in ((slices, depth), (depth, focus))
        for name in slices.needs
    )
    # Of a pixel: slices in colour; a byte of the index; both the index and a pixel.
    assert [p.screen.stack_pixel_bits(p.core) for p in (slices, depth, focus)] == [72, 8, 32]
    assert [part.what for part in slices.left_out][-1] == "depth index"
    assert [part.what for part in depth.left_out][-1] == "picture in focus"
    index = focus.screen.index(focus.core)
    assert depth.latency_lines == focus.latency_lines == focus.core.delay + index.delay
    assert depth.latency_clocks > slices.latency_clocks


def test_pixels_a_clock_are_the_fewest_that_keep_the_rate(tmp_path: Path) -> None:
    auto = ("pixels_per_clock = 4", "")
    assert plan_of(tmp_path, auto).core.pixels_per_clock == 1
    rate = ("rate_hz = 60.0", "rate_hz = 900.0")
    plan = plan_of(tmp_path, auto, rate)
    assert plan.core.pixels_per_clock == 2
    assert plan.clock_mhz == pytest.approx(160 * 240 * 900 / 1e6)


def test_top_level(tmp_path: Path) -> None:
    plan = plan_of(tmp_path)
    assert "entity work.focal_stack" in top_text(plan)
    assert "depth_index" not in top_text(plan) + package_text(plan)
    assert "sweep" not in top_text(plan)
    judged = ('"slices"', '"depth"\nvote_radius = 0\nbetween_slices = true')
    between = plan_of(tmp_path, judged)
    text = top_text(between)
    assert text.index("entity work.focal_stack") < text.index("entity work.depth_index")
    assert "m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * 24 - 1 downto 0)" in text
    package = package_text(between)
    assert "constant INDEX_PICTURE : boolean := false;" in package
    assert 'constant INDEX_SHIFTS : string := "-1 0 1";' in package


SHARP = ('"slices"', '"all-in-focus"\nsharp_box = 3')
GREY = (
    *(('"rgb"', '"grey"'), ("pixels_per_clock = 4", "pixels_per_clock = 1")),
    *(("lfe5u-45f", "xc6slx45-3csg324"), ("rate_hz = 60.0", "")),
)


def test_a_smaller_box_in_focus(tmp_path: Path) -> None:
    """The core has each slice twice, the plan's tables once."""
    plan = plan_of(tmp_path, *GREY, SHARP)
    assert plan.core.shifts == (-1, -1, 0, 0, 1, 1)
    # Views of an integer a meet in groups of M.
    assert plan.core.slice_boxes == (5, 3, 5, 5, 5, 3)
    assert [(part.shift, part.box) for part in plan.slices] == [(-1, 5), (0, 5), (1, 5)]
    assert plan.full_build.startswith("11 slices, ")
    spare = next(part for part in plan.left_out if "slices" in part.what)
    assert spare.what.startswith("8 of 11 slices, ")
    without = plan_of(tmp_path, *GREY, ('"slices"', '"all-in-focus"'))
    assert len(plan.screen.in_pairs(without.core).shifts) == 6
    assert plan.latency_lines == without.latency_lines
    behind = [components(p)[1].generics for p in (plan, without)]
    assert behind[0]["SHIFTS"] == "-1 -1 0 0 1 1"
    assert [generics.get("SHARP_TOO", False) for generics in behind] == [True, False]
    package = package_text(plan)
    assert "constant INDEX_SLICES : natural := 3;" in package
    assert "constant INDEX_SHARP_TOO : boolean := true;" in package
    assert "entity work.depth_index" in top_text(plan)


def test_index_of_two_boxes_as_counted(tmp_path: Path) -> None:
    """Of `plenofir.data`: 1248 LUT and 21 block RAM without it, 1427 and 36 with it."""
    size = ("columns = 320", "columns = 640")
    votes = "\nvote_radius = 0"
    once, pairs = (
        plan_of(tmp_path, *GREY, size, (SHARP[0], f'"all-in-focus"{votes}{box}'))
        for box in ("", "\nsharp_box = 3")
    )
    found = [
        estimate((p.screen.index(p.core).block(chosen_too=False),), "spartan6")
        for p in (once, pairs)
    ]
    assert [usage.block_rams for usage in found] == [21, 36]
    assert [usage.lut for usage in found] == [pytest.approx(n, rel=0.17) for n in (1248, 1427)]


def test_a_box_that_lies_beside_is_told(tmp_path: Path) -> None:
    even = plan_of(tmp_path, *GREY, (SHARP[0], SHARP[1].replace("3", "2")))
    beside = [note for note in even.notes if "half a pixel beside" in note]
    assert [note.split(" lies")[0] for note in beside] == ["a = -1/5", "a = 1/5"]
    assert not plan_of(tmp_path, *GREY, SHARP).notes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([('"slices"', '"index"')], "stack.output = 'index' should be 'slices', 'all-in-focus'"),
        ([("output =", "radius = 1\noutput =")], "stack: radius needs the output 'all-in-focus'"),
        ([("pixels_per_clock = 4", 'path = "video"')], "stack needs build.path = 'core'"),
        (
            [("pixels_per_clock = 4", 'arithmetic = "stored"')],
            "stack needs build.arithmetic = 'exact'",
        ),
        ([("pixels_per_clock = 4", 'engine = "fir"')], "stack needs all slices in one pass"),
        ([("pixels", 'interpolation = "linear"\npixels')], "stack needs build.interpolation"),
        ([("pixels", 'sharpen = "auto"\npixels')], "stack needs build.sharpen = 'off'"),
        (
            [("pixels_per_clock = 4", "parallel_rows = 3")],
            "stack needs build.parallel_rows = 1",
        ),
        ([("pixels", 'border = "normalise"\npixels')], "a focal stack of 4 pixels a clock has no"),
        ([('"-1/5", "0", ', ""), ('"slices"', '"depth"')], "at least two slices, not 1 of M = 5"),
        (
            [('"slices"', '"depth"'), ("clock = 4", "clock = 8")],
            "takes at most M pixels a clock (M = 5), not 8",
        ),
        (
            [("columns = 320", "columns = 1920"), ('"slices"', '"all-in-focus"')],
            "of 108 block RAM (18 Kbit); use fewer slices, columns or votes, stack.output",
        ),
        ([("output =", "sharp_box = 3\noutput =")], "stack: sharp_box needs the output 'all-in-"),
        ([(SHARP[0], f"{SHARP[1]}#".replace("3#", "0"))], "stack.sharp_box = 0 should be greater"),
        *(
            ([(SHARP[0], f"{SHARP[1]}#".replace("3#", box))], f"has a box of {box} samples or more")
            for box in ("5", "6")
        ),
        ([SHARP, ('"-1/5", "0", "1/5"', '"0", "1"')], "no slice of M = 5 has a box of 3 samples"),
        *(
            (
                [SHARP, ("pixels_per", f"{wish}\npixels_per")],
                "stack.sharp_box: sharp_box needs slices",
            )
            for wish in ("resolution = 0.5", "noise = 0.3")
        ),
        ([("rate_hz = 60.0", "rate_hz = 6000.0")], "240 at 6000 Hz needs 115.2 MHz at 4 pixels"),
    ],
)
def test_refused(tmp_path: Path, changes: list[tuple[str, str]], message: str) -> None:
    done = plenofir("plan", str(write(tmp_path, STACK, *changes)))
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
