# SPDX-License-Identifier: Apache-2.0
"""Energy: what switches is counted right, and weighed."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.simulate.toggles import Activity, count_activity, read_toggles
from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir_studies import energy
from plenofir_studies.report_parts import Report

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


def test_energy_is_the_sum_of_its_parts(tmp_path: Path) -> None:
    core = CoreConfiguration(micro_image_size=3, shifts=(1,), max_columns=100)
    load = energy.Load("core", core, np.zeros((1, 10, 100), np.uint8), 1000, 100)
    activity = Activity(FIGURES, clocks=1000, pixels=1000, nets=50, toggles=5000, inside=0)
    found = energy.energy_of(load, activity)
    assert activity.rate == pytest.approx(0.1)
    assert found.nets == pytest.approx(5 * energy.NET_PJ)
    assert found.clocks == pytest.approx(100 * energy.CLOCK_PJ)
    assert found.block_rams == pytest.approx(2.5 * energy.BLOCK_RAM_PJ)
    assert found.multipliers == pytest.approx(energy.MULTIPLIER_PJ)
    assert found.frame_mj == pytest.approx(found.total * 1e5 * 1e-9)
    report = Report(tmp_path, "energy.md")
    energy.energies(report, [found])
    text = report.write().read_text()
    assert f"| core | 1000 x 100 | {found.frame_mj:.2g} |" in text
    # Scaled down from 150 nm and 1.5 V, a net takes less than there: 0.3 of the size, 0.64 of V^2.
    assert pytest.approx(5.9 * 0.76 * 0.3 * 0.64) == energy.NET_PJ
