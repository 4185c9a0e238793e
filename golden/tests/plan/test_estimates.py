# SPDX-License-Identifier: Apache-2.0
"""Estimates of resources beside synthesis results."""

import itertools
from collections.abc import Iterable

import pytest

from plenofir.fpga.bitstream.top_level import TOP as BOARD
from plenofir.fpga.core.configuration import CoreConfiguration, reciprocal_bits
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.devices import Usage
from plenofir.fpga.resources import estimate as estimates
from plenofir.fpga.resources.estimate import VIDEO, Estimate, estimate
from plenofir.fpga.resources.memory import Memory, block_sizes
from plenofir.fpga.resources.record import ECP5_SLOWEST, Figures, Placed, load_record
from plenofir.plan import DEVICES, load_scene, make_plan
from plenofir_studies.engine_cells import ENGINES, SETS, Cell, measured_cells, placed_cells, widest
from plenofir_studies.recorded_designs import (
    CORE,
    Design,
    core_designs,
    designs,
    picture_designs,
    sensor_design,
    stack_core_designs,
)
from plenofir_studies.records import load_builds


def check_logic(usage: Estimate, figures: Figures | Placed, name: str) -> None:
    """Look-up tables and flip-flops are as near as the estimate says, 15 % at most.

    The class of error may be larger: it is that of all cores, those of eight pixels a clock too.
    """
    within = min(usage.within, 0.151)
    assert usage.lut == pytest.approx(figures.lut, rel=within), name
    assert usage.flip_flops == pytest.approx(figures.flip_flops, rel=within), name


def test_estimates_against_synthesis() -> None:
    # Block RAM and multipliers equal Yosys's; LUTs and flip-flops are within some percent.
    # The board is its core, and the video path around it.
    known = load_record().counted["spartan6"]
    compared = 0
    for design in designs():
        scene = design.plan is not None and design.plan.sensor is None
        if not scene and design.top != CORE:
            continue
        figures, board = known[design.name], design.top == BOARD
        usage = estimate((*design.core.blocks, VIDEO) if board else design.core.blocks)
        assert (usage.ramb16, usage.ramb8, usage.dsp) == (
            figures.ramb16,
            figures.ramb8,
            figures.dsp,
        ), design.name
        check_logic(usage, figures, design.name)
        compared += 1
    # The cells of the comparison, below, are four times as many as these.
    assert compared >= 7


def test_estimates_of_an_ecp5_against_placed_cores() -> None:
    """Block RAM and multipliers exactly, look-up tables and flip-flops within 15 %."""
    known = load_record().placed[ECP5_SLOWEST]
    cores = {cell.name: cell.core() for cell in placed_cells() if cell.name in known}
    cores |= {design.name.removesuffix(" core"): design.core for design in core_designs()}
    assert len(cores) >= 90
    for name, core in cores.items():
        found = known[name]
        usage = estimate(core.blocks, "ecp5")
        assert (usage.block_rams, usage.dsp) == (found.block_rams, found.multipliers), name
        check_logic(usage, found, name)


def test_estimates_of_stacks_against_placed_ones() -> None:
    compared = 0
    for design in stack_core_designs():
        assert design.plan is not None
        found, needs = load_record().placed[ECP5_SLOWEST][design.name], design.plan.needs
        assert needs["block RAM (18 Kbit)"] == found.block_rams
        assert needs["MULT18X18D"] == found.multipliers
        assert needs["LUT4"] == pytest.approx(found.lut, rel=0.15)
        assert needs["flip-flops"] == pytest.approx(found.flip_flops, rel=0.15)
        compared += 1
    assert compared == 1


def test_estimates_of_boards_against_their_builds() -> None:
    builds = load_builds()
    assert {"ulx3s-480p", "ulx3s-csi", "lifcl40", "lifcl40-360"} <= set(builds)
    for scene, build in builds.items():
        plan = make_plan(load_scene(scene.partition(" on ")[0], build.device))
        logic = 0.15 if plan.screen.needs_stack or plan.camera is not None else 0.05
        for name, estimated in plan.needs.items():
            margin = logic if name in ("LUT4", "flip-flops") else 0
            assert estimated == pytest.approx(build.utilisation[name][0], rel=margin), (scene, name)


def test_estimates_of_both_engines_against_synthesis() -> None:
    known = load_record().counted["spartan6"]
    measured = [cell for cell in measured_cells() if cell.name in known]
    assert {cell.engine for cell in measured} == set(ENGINES)
    assert len(measured) >= 60
    for cell in measured:
        figures, usage = known[cell.name], estimate(cell.core().blocks)
        counted = figures.usage
        assert (usage.block_rams, usage.dsp) == (counted.block_rams, figures.dsp), cell.name
        check_logic(usage, figures, cell.name)


@pytest.mark.parametrize(
    ("chosen", "most"),
    [
        ([sensor_design("grey")], 2),
        ([sensor_design("focused camera, M = 35, 1200 columns, 18 lines")], 2),
        (picture_designs(), 5),
    ],
    ids=["sensor", "focused camera", "picture"],
)
def test_estimates_of_parts_against_synthesis(chosen: Iterable[Design], most: int) -> None:
    known = load_record().counted["spartan6"]
    for design in chosen:
        figures, usage = known[design.name], estimate(design.blocks)
        assert 0 <= usage.block_rams - figures.usage.block_rams <= most, design.name
        assert usage.dsp == figures.dsp, design.name
        check_logic(usage, figures, design.name)


def test_the_error_class_is_the_share_of_each_block() -> None:
    """A plain core is within 15 %; parts that were not fitted for a family are less certain."""
    core = CoreConfiguration(micro_image_size=5, shifts=(2,), max_columns=640)
    usual = {name: most for name, (*_, most) in load_record().drawn_errors.items()}
    assert estimate(core.blocks, "nexus").error_class == (
        f"LUTs and flip-flops within 15% (cores alone, 95 % of those fitted: LUTs "
        f"{usual['lut']:.0%}, flip-flops {usual['flip_flops']:.0%}), block RAM exact"
    )
    sharp = core.model_copy(update={"sharpening": (4,)})
    assert 0.15 < estimate(sharp.blocks, "nexus").within < 0.33
    assert estimate(sharp.blocks).within == pytest.approx(0.15)
    assert "up to 2 too many" in make_plan(load_scene("lytro1-raw")).error_class


def test_goals_of_moving_sums() -> None:
    # 1280 columns with any slice chosen at run time; what the frames' memory takes less.
    device = DEVICES["xc6slx45"]
    for part in SETS:
        taps, sums = (Cell(*part, engine) for engine in ENGINES)
        assert device.overflow(estimate(taps.core().blocks))
        assert not device.overflow(estimate(sums.core().blocks))
        assert widest(sums, device) >= 1280 > widest(taps, device)
    for m, shift, channels, ratio in ((5, 10, 3, 2.5), (11, 11, 1, 3.0)):
        taps, sums = (Cell(m, (shift,), channels, engine) for engine in ENGINES)
        assert taps.core(1024).line_buffer_bits >= ratio * sums.core(1024).line_buffer_bits


@pytest.mark.parametrize(
    ("address_bits", "width", "ramb16", "ramb8"),
    [
        (5, 100, 0, 0),
        (7, 36, 0, 1),
        (7, 37, 0, 2),
        (10, 9, 0, 1),
        (10, 10, 1, 0),
        (10, 19, 0, 3),
        (11, 10, 0, 3),
        (11, 27, 3, 0),
        (13, 9, 4, 0),
        (13, 10, 5, 0),
        (13, 45, 20, 0),
    ],
)
def test_memories_as_yosys_maps_them(
    address_bits: int, width: int, ramb16: int, ramb8: int
) -> None:
    usage = Memory("", address_bits, width, 1).usage()
    assert (usage.ramb16, usage.ramb8) == (ramb16, ramb8)


def test_blocks_of_deep_memories_take_no_more_block_rams() -> None:
    for width in (1, 8, 9, 11, 24, 48):
        for words in (1, 513, 1500, 4097, 23040, 70400):
            sizes = block_sizes(words, width)
            assert sum(sizes) == words
            bases = itertools.accumulate([0, *sizes[:-1]])
            for base, size in zip(bases, sizes, strict=True):
                assert base % (1 << (size - 1).bit_length()) == 0
            parts = [Memory("", (n - 1).bit_length(), width, 1, words=n).usage() for n in sizes]
            whole = Memory("", (words - 1).bit_length(), width, 1, words=words).usage()
            assert sum(parts, Usage()).block_rams <= whole.block_rams, (words, width)


def test_reciprocal_is_exact() -> None:
    for divisor in (3, 9, 25, 49, 121, 625):
        largest = 255 * divisor
        bits, factor_bits = reciprocal_bits(largest, divisor)
        numerator = largest + divisor // 2
        assert bits == numerator.bit_length()
        exponent = next(t for t in range(64) if (-(1 << t)) % divisor * numerator < 1 << t)
        factor = -(-(1 << exponent) // divisor)
        assert factor.bit_length() == factor_bits
        for n in range(0, numerator + 1, 7):
            assert n * factor >> exponent == n // divisor


def test_hold_is_smaller() -> None:
    core = CoreConfiguration(micro_image_size=5, shifts=(-5, 0, 5), max_columns=640)
    held = core.model_copy(update={"engine": FirEngine(hold=True)})
    assert estimate(held.blocks).lut < estimate(core.blocks).lut


def test_an_engine_is_weighed_when_its_sizes_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """A new engine has no weights: the planner says so, and takes another one."""
    assert make_plan(load_scene("grey-microscope")).core.engine.kind == "moving_sum"
    weights = {k: rows for k, rows in load_record().weights.items() if k != "moving_sum"}
    record = load_record().model_copy(update={"weights": weights})
    monkeypatch.setattr(estimates, "load_record", lambda: record)
    plan = make_plan(load_scene("grey-microscope"))
    assert plan.core.engine.kind == "fir"
    (option,) = (option for option in plan.engines if option.engine == "moving_sum")
    assert option.needs is None
    assert "never synthesised" in option.refused
