# SPDX-License-Identifier: Apache-2.0
"""Many pixels a clock: what was placed keeps what the planner counts on, and the goals."""

from statistics import median

import pytest

from plenofir.fpga.devices import DEVICES
from plenofir.fpga.resources.estimate import estimate
from plenofir.plan import load_scene, make_plan
from plenofir_studies.many_pixels import (
    PLACEMENTS,
    SCENE,
    load_placed,
    load_spreads,
    rows,
    scene_core,
)


def test_placed_cores_keep_the_clocks_of_the_planner() -> None:
    device = DEVICES["lfe5u-85f"]
    for pixels, placed in load_placed().items():
        assert placed.fmax_mhz >= device.clock_mhz(pixels), pixels


def test_most_placements_reach_the_clock_of_the_planner() -> None:
    for name, cores in load_spreads().items():
        for pixels, clocks in cores.items():
            known = [clock for clock in clocks if clock is not None]
            assert 1 <= len(known) <= len(clocks) <= PLACEMENTS
            assert median(known) >= DEVICES[name].clock_mhz(int(pixels)), (name, pixels)


def test_estimates_of_an_ecp5_against_placed_cores() -> None:
    plan = make_plan(load_scene(SCENE))
    for pixels, placed in load_placed().items():
        usage = estimate(scene_core(plan, pixels).blocks, "ecp5")
        assert (usage.block_rams, usage.dsp) == (placed.block_rams, placed.multipliers), pixels
        assert usage.lut == pytest.approx(placed.lut, rel=0.25), pixels
        assert usage.flip_flops == pytest.approx(placed.flip_flops, rel=0.25), pixels


def test_eight_pixels_a_clock_reach_the_goals() -> None:
    found = {row.pixels: row for row in rows()}
    one, eight = found[1], found[8]
    assert eight.frames >= 60
    assert eight.pixels_a_second >= 615e6
    assert eight.placed.fmax_mhz >= 0.85 * one.placed.fmax_mhz
    assert eight.placed.lut / 8 <= one.placed.lut / 2
    assert eight.placed.flip_flops / 8 <= one.placed.flip_flops / 2
    assert eight.placed.multipliers == 8
    plan = make_plan(load_scene(SCENE))
    blocks = [scene_core(plan, p).blocks[0] for p in (1, 8)]
    bits = [sum(memory.bits for memory in block.memories if not memory.rom) for block in blocks]
    assert bits[1] <= 1.1 * bits[0]
