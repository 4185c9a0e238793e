# SPDX-License-Identifier: Apache-2.0
"""Estimates beside counts of drawn cores."""

import pytest

from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.families import Family
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import load_record
from plenofir_studies.drawn_cores import DRAWN_FAMILIES, DRAWS, counted_for, drawn_cores

CORES = dict(drawn_cores())
RECORDED = [(f, name) for f in DRAWN_FAMILIES for name in CORES if name in load_record().counted[f]]


@pytest.mark.parametrize(("family", "name"), RECORDED)
def test_estimates_of_drawn_cores(family: Family, name: str) -> None:
    """Multipliers are exact, and block RAM; look-up tables and flip-flops within 15 %.

    With eight pixels a clock a Cyclone V has one M10K more.
    """
    found, core = load_record().counted[family][name].usage, CORES[name]
    usage = estimate(core.blocks, family)
    more = family == "cyclonev" and core.pixels_per_clock == 8
    assert (usage.block_rams + more, usage.dsp) == (found.block_rams, found.dsp)
    assert usage.lut == pytest.approx(found.lut, rel=0.15)
    assert usage.flip_flops == pytest.approx(found.flip_flops, rel=0.15)


def test_what_is_usual_is_told_of_both_engines_and_of_each_family() -> None:
    errors = load_record().drawn_errors
    assert set(errors) == {"lut", "flip_flops"}
    for number, worst, usual in errors.values():
        assert number == len(RECORDED)
        assert 0 < usual < min(worst, 0.2)
    assert {family for family, _ in RECORDED} == set(DRAWN_FAMILIES)
    assert {CORES[name].engine.kind for _, name in RECORDED} == {"fir", "moving_sum"}


def test_drawn_cores_are_always_the_same_and_differ_by_seed() -> None:
    assert dict(drawn_cores()) == CORES
    assert len(set(CORES.values())) == len(CORES) == sum(DRAWS.values())
    assert {counted_for(name) for name in CORES} == set(DRAWN_FAMILIES)
    assert {core.pixels_per_clock for core in CORES.values()} == {1, 2, 4, 8}
    assert {isinstance(core.engine, FirEngine) for core in CORES.values()} == {True, False}
    assert all(3 <= core.micro_image_size <= 15 for core in CORES.values())
    assert all(1 <= len(core.shifts) <= 9 for core in CORES.values())
