# SPDX-License-Identifier: Apache-2.0
"""Waveforms of the same frame from different simulators, formats and sources, compared."""

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.simulate import file_bench
from plenofir.fpga.simulate.dump_compare import DumpComparison, compare_dumps
from plenofir.fpga.tools.simulators import Simulator, find_simulator
from plenofir.ground import project
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name
from plenofir_tb.tools import or_skip

CORE = CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=12)
FRAME = np.random.default_rng(0).integers(0, 255, (1, 6, 12), np.uint8, endpoint=True)


FORMATS = {"ghdl": ["ghw", "fst"], "nvc": ["fst"]}


def dump(simulator: Simulator, path: Path) -> Path:
    """Run the frame and write its waveform."""
    folder = path.parent / f"work-{path.name}"
    file_bench.run_bench(simulator, CORE, FRAME, folder, stall_percent=20, waves=path)
    return path


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """VCD of the frame, from the simulator that the tests run on."""
    folder = tmp_path_factory.mktemp("good")
    return dump(find_simulator(simulator_name(), brief=True), folder / "good.vcd")


def check_equal(found: DumpComparison) -> None:
    assert found.equal, found.differences[0]
    assert found.signals == len(file_bench.wave_signals(FirEngine())) - 1
    assert found.samples > FRAME.size
    assert found.clock is not None
    assert found.clock.endswith("clk")
    assert found.only_in_a == found.only_in_b == found.not_comparable == ()


def test_simulators_agree(good: Path, tmp_path: Path) -> None:
    with or_skip():
        other = find_simulator("nvc" if simulator_name() == "ghdl" else "ghdl")
    path = dump(other, tmp_path / "other.vcd")
    check_equal(compare_dumps(good, path))
    check_equal(compare_dumps(path, good))


@pytest.mark.parametrize("suffix", FORMATS[simulator_name()])
def test_formats_agree(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    if suffix == "fst":
        # Of GHDL 5, the one that does not compile (mcode) writes all signals into an FST.
        monkeypatch.delenv("GHDL_BACKEND", raising=False)
    path = dump(find_simulator(simulator_name()), tmp_path / f"other.{suffix}")
    check_equal(compare_dumps(good, path))


@pytest.mark.parametrize(
    ("file", "old", "new", "signal"),
    [
        (
            "switch_control.vhd",
            "switches and mask when live_held",
            "switches when live_held",
            "core.fir_engine.filters.row_pass[0].stage.control.closed",
        ),
        (
            "switched_fir.vhd",
            "carried + to_integer(unsigned(pixels(w / GROUP_TAPS)))",
            "carried + to_integer(unsigned(pixels(w / GROUP_TAPS))) / 2 * 2",
            "core.fir_engine.filters.skewed_data",
        ),
        (
            "divide_round.vhd",
            "NUMERATOR_BITS) + HALF;",
            "NUMERATOR_BITS);",
            "core.result_data",
        ),
    ],
)
def test_a_planted_fault_is_named(good, tmp_path, monkeypatch, file, old, new, signal) -> None:
    sources = plant(tmp_path / "hdl", file_bench.core_sources(), file, old, new)
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    bad = dump(find_simulator(simulator_name()), tmp_path / "bad.vcd")
    found = compare_dumps(good, bad)
    assert not found.equal
    first = found.differences[0]
    assert first.signal.endswith(signal)
    assert first.value_a != first.value_b
    # Up to there, the files agree.
    assert compare_dumps(good, bad, end=first.cycle - 1).equal
    if file == "switch_control.vhd" and simulator_name() == "ghdl":
        page = (project.root() / "docs/simulation.md").read_text()
        shown = re.search(r"(?:^    .*\n)*^    result .*different\n", page, flags=re.M)
        assert shown is not None
        command = [sys.executable, "-m", "plenofir", "waves", "compare", str(good), str(bad)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert textwrap.dedent(shown[0]) == done.stdout
