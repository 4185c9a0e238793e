# SPDX-License-Identifier: Apache-2.0
"""What a plan leaves out of the full build, and what that saves and costs."""

from pathlib import Path

import pytest
from written_scenes import scene

from plenofir.commands.plan_lines import print_plan
from plenofir.fpga.resources.estimate import estimate
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.loaded_scene import scene_files
from plenofir.plan.omissions import full_core
from plenofir.plan.placements import placed_beside_full


def test_border_is_weighed(tmp_path: Path) -> None:
    slices = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["3/5", "1"]')
    plain = make_plan(scene(tmp_path, slices))
    (spared,) = [part for part in plain.left_out if part.what == "normalised border"]
    assert "BORDER_NORMALISED" not in plain.core.generics()
    whole = make_plan(scene(tmp_path, slices, build='border = "normalise"'))
    assert whole.core.generics()["BORDER_NORMALISED"] is True
    assert whole.core.exact
    # The difference of the two is what is reported as left out.
    for name, amount in spared.saves.items():
        assert whole.needs[name] - plain.needs[name] == amount
    assert whole.error_bound == 0.5
    assert not any("border" in part.what for part in whole.left_out)


def test_smaller_boxes_need_less(tmp_path: Path) -> None:
    slices = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["3/5", "-1/5"]')
    plain, boxed = (
        make_plan(scene(tmp_path, slices, build=f'engine = "fir"\n{more}'))
        for more in ("", "box = [2, 3]")
    )
    assert boxed.core.slice_boxes == (2, 3)
    assert boxed.core.generics()["BOX"] == "2 3"
    assert "BOX" not in plain.core.generics()
    assert boxed.core.taps < plain.core.taps
    assert boxed.core.line_buffer_bits < plain.core.line_buffer_bits
    with pytest.raises(InputError, match=r"^build\.box: has 3 numbers for 2 slices"):
        make_plan(scene(tmp_path, slices, build="box = [2, 3, 1]"))
    # Views of a whole number a meet in groups of M.
    whole = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["1"]')
    with pytest.raises(InputError, match=r"^build\.box: must be a multiple of gcd"):
        make_plan(scene(tmp_path, whole, build="box = 2"))


def test_sharpening_is_weighed(tmp_path: Path) -> None:
    slices = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["3/5", "1"]')
    plain = make_plan(scene(tmp_path, slices))
    (spared,) = [part for part in plain.left_out if part.what.startswith("sharpening")]
    assert "SHARPENING" not in plain.core.generics()
    sharp = make_plan(scene(tmp_path, slices, build='sharpen = "auto"'))
    assert sharp.core.sharpening == (4, 0)
    assert sharp.core.generics()["SHARPENING"] == "4 0"
    assert sharp.core.exact
    # What the one leaves out is what the other takes; ten lines of sums of 13 bits.
    for name, amount in spared.saves.items():
        assert sharp.needs[name] - plain.needs[name] == amount
    more = 10 * 640 * 3 * 13
    assert sharp.core.line_buffer_bits - plain.core.line_buffer_bits == more
    assert sharp.latency_lines == plain.latency_lines + 5
    assert sharp.error_bound == 0.5
    assert not any("sharpening" in part.what for part in sharp.left_out)
    # Where all views meet at one place, there is nothing to sharpen, and no hardware for it.
    whole = make_plan(scene(tmp_path, (slices[0], 'slices = ["1", "2"]'), build='sharpen = "auto"'))
    assert not whole.core.sharpens
    large = ("columns = 640", "columns = 3201")
    assert make_plan(scene(tmp_path, slices, large)).needs["block RAM (18 Kbit)"] <= 116
    with pytest.raises(InputError, match=r"needs \d+ of 116 block RAM .*xc6slx"):
        make_plan(scene(tmp_path, slices, large, build='sharpen = "auto"'))


def test_what_leaving_out_costs_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Selecting between a few slices can cost logic that the full grid does not need."""
    plan = make_plan(load_scene("rgb-480p"))
    for part in plan.left_out:
        assert not set(part.saves) & set(part.costs)
    more = {name: n - plan.full[name] for name, n in plan.needs.items() if n > plan.full[name]}
    slices = plan.left_out[0]
    assert "slices" in slices.what
    assert more == {name: slices.costs[name] for name in more} != {}
    print_plan(plan, None)
    text = ", ".join(f"{n} {name}" for name, n in more.items())
    printed = capsys.readouterr().out
    assert f"takes {text} less than this scene" in printed
    assert (
        "lines of pixels: -4 block RAM (3.4 %), -7 LUT (0.0 %), +59 flip-flops (0.1 %)" in printed
    )
    assert "(5.2 %); the scene wants border = 'zero', which is another picture\n" in printed


def test_what_costs_more_than_it_saves_has_a_reason() -> None:
    """By the largest share of the device, of each part of each shipped scene."""
    costly = []
    for file in scene_files():
        plan = make_plan(load_scene(file))
        for part in plan.left_out:
            saved, cost = (
                max((n / plan.available[name] for name, n in amounts.items()), default=0.0)
                for amounts in (part.saves, part.costs)
            )
            assert bool(part.reason) == (cost >= saved and cost > 0), part
            if part.reason:
                costly.append((file.stem, part.what))
    assert ("rgb-480p", "normalised border") in costly
    assert not any("slices" in what for _, what in costly)


def test_placed_cores_stand_beside_their_full_builds(tmp_path: Path) -> None:
    """Recorded and estimated; a changed scene of the same name has no record."""
    compared = 0
    for file in scene_files():
        plan = make_plan(load_scene(file))
        found = placed_beside_full(plan)
        if found is None:
            continue
        compared += 1
        assert list(found.scene) == list(found.full)
        for placed, core in ((found.scene, plan.core), (found.full, full_core(plan.core))):
            for name, amount in estimate(core.blocks, "ecp5").amounts("ecp5").items():
                margin = 0.15 if name in ("LUT4", "flip-flops") else 0
                assert placed[name] == pytest.approx(amount, rel=margin), (file.stem, name)
    assert compared >= 3
    text = next(file for file in scene_files() if file.stem == "grey-microscope").read_text()
    other = tmp_path / "grey-microscope.toml"
    other.write_text(text.replace("micro_image_size = 5", "micro_image_size = 3"))
    assert placed_beside_full(make_plan(load_scene(other))) is None
