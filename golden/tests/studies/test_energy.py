# SPDX-License-Identifier: Apache-2.0
"""Energy: counts of switching activity, and their weights."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.resources.record import Figures
from plenofir_studies import energy
from plenofir_studies.toggles import count_activity, read_toggles

FIGURES = Figures(lut=10, flip_flops=100, ramb16=2, ramb8=1, dsp=1, carry=0, path=1)


def cell(kind: str, inputs: dict[str, list[int]], outputs: dict[str, list[int]]) -> dict:
    directions = {**dict.fromkeys(inputs, "input"), **dict.fromkeys(outputs, "output")}
    return {"type": kind, "port_directions": directions, "connections": {**inputs, **outputs}}


NETLIST = {
    "ports": {
        "clk": {"direction": "input", "bits": [2]},
        "q": {"direction": "output", "bits": [6, "0"]},
    },
    "netnames": {
        "clk": {"bits": [2]},
        "n1": {"bits": [3, 4], "offset": 1},
        "n2": {"bits": [5]},
        "n3": {"bits": [6]},
        "unread": {"bits": [7]},
    },
    "cells": {
        "lut": cell("LUT2", {"I0": [6], "I1": [4]}, {"O": [3]}),
        # Its only reader is a flip-flop's D: inside the slice.
        "register": cell("FDRE", {"C": [2], "D": [3], "CE": ["1"]}, {"Q": [4]}),
        "lut_2": cell("LUT1", {"I0": [4]}, {"O": [5]}),
        "shared": cell("FDRE", {"C": [2], "D": [5]}, {"Q": [6]}),
        "shared_2": cell("FDRE", {"C": [2], "D": [5]}, {"Q": [7]}),
    },
}


def test_nets_are_counted_by_where_they_go() -> None:
    toggles = {"clk": 1000, "n1[1]": 7, "n1[2]": 20, "n2": 300, "n3": 4000, "unread": 50000}
    # Bits 4, 5 (two readers) and 6 (a port, a LUT) go out; bit 3 stays; the clock does not count.
    assert count_activity(NETLIST, toggles) == (3, 4320, 7)


def test_changes_in_both_directions_are_added(tmp_path: Path) -> None:
    parts = "C '\x01f\x02a.v\x01l\x02{}\x01t\x02toggle\x01o\x02{}\x01h\x02TOP.top' {}\n"
    text = "# SystemC::Coverage-3\n"
    for line, (name, count) in enumerate((("n1[3]:0->1", 5), ("n1[3]:1->0", 4), ("n2:0->1", 1))):
        text += parts.format(line, name, count)
    (tmp_path / "toggles.dat").write_text(text)
    assert read_toggles(tmp_path / "toggles.dat") == {"n1[3]": 9, "n2": 1}


MEASURED = energy.Measured(
    figures=FIGURES, clocks=1000, input_pixels=2000, pixels=4000, nets=50, toggles=5000
)


def test_energy_is_the_sum_of_its_parts():
    found = energy.energy_of(MEASURED)
    # A quarter of a clock for each refocused pixel: two come in with a clock, for two slices.
    assert found.nets == pytest.approx(5 / 4 * energy.NET_PJ)
    assert found.clocks == pytest.approx(100 / 4 * energy.CLOCK_PJ)
    assert found.block_rams == pytest.approx(2.5 / 4 * energy.BLOCK_RAM_PJ)
    assert found.multipliers == pytest.approx(energy.MULTIPLIER_PJ / 4)
    assert found.total == pytest.approx(sum(found.parts))
    assert pytest.approx(0.5) == MEASURED.clocks_a_pixel
    # Scaled down from 150 nm and 1.5 V, a net takes less than there: 0.3 of the size, 0.64 of V^2.
    assert pytest.approx(5.9 * 0.76 * 0.3 * 0.64) == energy.NET_PJ


def test_a_sum_of_several_kinds_is_surer_than_one():
    alone = energy.Energy(10, 0, 0, 0).factor
    assert alone == pytest.approx(np.exp(np.hypot(np.log(2), np.log(energy.CONTENT))))
    assert energy.CONTENT < energy.Energy(5, 0, 5, 0).factor < alone


def test_counters_of_whole_packages(tmp_path):
    assert energy.joules(tmp_path) is None
    for name, count in (("intel-rapl:0", 3), ("intel-rapl:0:1", 50), ("intel-rapl:1", 4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "energy_uj").write_text(f"{count}000000\n")
    assert energy.joules(tmp_path) == pytest.approx(7)


def test_recorded_designs_are_those_that_are_measured():
    found = energy.load_measured()
    assert [design.name for design in energy.designs()] == energy.names()
    assert found.keys() <= set(energy.names())
    base = energy.name_of(energy.grey())
    assert base in found
    text = "\n".join(energy.page(found, None))
    assert f"| {base} | {found[base].figures.lut} |" in text
    assert "no energy counters" in text
    assert "by its counters: 1200 pJ" in "\n".join(energy.page(found, 1234.0))


@pytest.mark.slow
def test_a_design_is_measured():
    design = energy.Design("small", energy.grey(m=3, columns=64), np.zeros((1, 9, 60), np.uint8))
    measured = energy.measure(design)
    assert measured.pixels == measured.input_pixels == 540
    assert measured.clocks >= 540
    assert measured.toggles > 0
