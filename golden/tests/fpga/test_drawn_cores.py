# SPDX-License-Identifier: Apache-2.0
"""Estimates beside counts of drawn cores, that weights are fitted to and that check them."""

import pytest

from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.families import Family
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import load_record
from plenofir_studies.drawn_cores import CHECKED, DRAWN_FAMILIES, FITTED, drawn_cores

CORES = {cores[0]: dict(drawn_cores(*cores)) for cores in (FITTED, CHECKED)}


RECORDED = [
    (family, name)
    for family in DRAWN_FAMILIES
    for cores in CORES.values()
    for name in cores
    if name in load_record().counted[family]
]


@pytest.mark.parametrize(("family", "name"), RECORDED)
def test_estimates_of_drawn_cores(family: Family, name: str) -> None:
    """Multipliers are exact, and block RAM; look-up tables and flip-flops within what is told.

    With eight pixels a clock a Cyclone V has one M10K more, 7 series are 16 % off, ECP5 24 %.
    """
    found, core = load_record().counted[family][name].usage, CORES[name.split()[0]][name]
    usage = estimate(core.blocks, family)
    more = family == "cyclonev" and core.pixels_per_clock == 8
    assert (usage.block_rams + more, usage.dsp) == (found.block_rams, found.dsp)
    assert usage.lut == pytest.approx(found.lut, rel=usage.within)
    assert usage.flip_flops == pytest.approx(found.flip_flops, rel=usage.within)
    assert usage.within <= {"ecp5": 0.241, "series7": 0.161}.get(family, 0.151)


def test_drawn_cores_are_always_the_same_and_differ_by_seed() -> None:
    fitted, checked = CORES.values()
    assert [core for _, core in drawn_cores(*FITTED)] == list(fitted.values())
    assert not set(fitted.values()) & set(checked.values())
    for cores in CORES.values():
        lanes = {core.pixels_per_clock for core in cores.values()}
        assert lanes == {1, 2, 4, 8}
        assert {isinstance(core.engine, FirEngine) for core in cores.values()} == {True, False}
        assert all(3 <= core.micro_image_size <= 15 for core in cores.values())
        assert all(1 <= len(core.shifts) <= 9 for core in cores.values())
