"""Waveforms of the same frame from different simulators, formats and sources, compared."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.core import CoreConfiguration
from plenofir.errors import InputError
from plenofir.simulation import pump
from plenofir.simulation.dump_compare import DumpComparison, compare_dumps
from plenofir.simulation.simulators import Simulator, find_simulator
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name

CORE = CoreConfiguration(micro_image_size=3, shift=2, max_columns=12)
FRAME = np.random.default_rng(0).integers(0, 255, (1, 6, 12), np.uint8, endpoint=True)


def installed(name: str) -> Simulator:
    try:
        return find_simulator(name)
    except InputError as error:
        pytest.skip(str(error))


def dump(simulator: Simulator, path: Path) -> Path:
    """Run the frame and write its waveform."""
    folder = path.parent / f"work-{path.name}"
    pump.run_pump(simulator, CORE, FRAME, folder, stall_percent=20, waves=path)
    return path


def check_equal(found: DumpComparison) -> None:
    assert found.equal, found.differences[0]
    assert found.signals == len(pump.WAVE_SIGNALS) - 1
    assert found.samples > FRAME.size
    assert found.clock is not None
    assert found.clock.endswith("clk")
    assert found.only_in_a == found.only_in_b == found.not_comparable == ()


def test_simulators_agree(tmp_path: Path) -> None:
    """Two simulators' waveforms of one frame are the same, each in the format of the other too."""
    a = dump(installed("ghdl"), tmp_path / "ghdl.fst")
    b = dump(installed("nvc"), tmp_path / "nvc.vcd")
    check_equal(compare_dumps(a, b))
    check_equal(compare_dumps(b, a))


@pytest.mark.parametrize("suffix", ["vcd", "ghw"])
def test_formats_agree(tmp_path: Path, suffix: str) -> None:
    simulator = installed("ghdl")
    a = dump(simulator, tmp_path / "a.fst")
    b = dump(simulator, tmp_path / f"b.{suffix}")
    check_equal(compare_dumps(a, b))


@pytest.mark.parametrize(
    ("file", "old", "new", "signal"),
    [
        (
            "switch_control.vhd",
            "closed <= switches and mask;",
            "closed <= switches;",
            "core.row_stage.control.closed",
        ),
        (
            "switched_fir.vhd",
            "next_sums(w) := carried + pixel;",
            "next_sums(w) := carried + pixel - pixel mod 2;",
            "core.row_sums",
        ),
        ("divide_round.vhd", "NUMERATOR_BITS) + HALF;", "NUMERATOR_BITS);", "m_axis_tdata"),
    ],
)
def test_a_planted_fault_is_named(tmp_path, monkeypatch, file, old, new, signal) -> None:
    simulator = find_simulator(simulator_name())
    good = dump(simulator, tmp_path / "good.fst")
    sources = plant(tmp_path / "hdl", pump.pump_sources(), file, old, new)
    monkeypatch.setattr(pump, "pump_sources", lambda: sources)
    bad = dump(simulator, tmp_path / "bad.fst")
    found = compare_dumps(good, bad)
    assert not found.equal
    first = found.differences[0]
    assert first.signal.endswith(signal)
    assert first.value_a != first.value_b
    # Up to there, the files agree.
    assert compare_dumps(good, bad, end=first.cycle - 1).equal
