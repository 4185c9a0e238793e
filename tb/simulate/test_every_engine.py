# SPDX-License-Identifier: Apache-2.0
"""One small frame through each engine by command, for the edit loop (``make check``)."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_process import plenofir

from plenofir.fpga.simulate import file_bench
from plenofir.ground.errors import EXIT_MISMATCH
from plenofir.ground.images import write_png
from plenofir_tb.faults import plant
from plenofir_tb.runner import simulator_name


def run_small_frame(tmp_path: Path, engine: str) -> tuple[int, Any]:
    """Run the command on a small frame; result: exit code and report."""
    # Sums of an even M x M have halves between two grey levels, which are rounded up.
    raw = np.random.default_rng(0).integers(0, 256, (18, 22, 3), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    words = "--raw", "raw.png", "-M", "4", "-a", "-1/2 1", "--engine", *engine.split()
    simulator = "--simulator", simulator_name()
    done = plenofir("sim", *words, *simulator, "--out", "o", cwd=tmp_path)
    return done.returncode, json.loads((tmp_path / "o" / "report.json").read_text())


@pytest.mark.quick
@pytest.mark.parametrize(
    "engine", ["fir", "moving_sum --border normalise", "moving_sum --pixels 4", "stack"]
)
def test_small_frame(tmp_path: Path, engine: str) -> None:
    code, report = run_small_frame(tmp_path, engine)
    assert code == 0
    assert report["mismatches"] == report["stalls"]["mismatches"] == 0
    assert report["stalls"]["pixels_compared"] == report["pixels_compared"]
    assert report["border"] == ("normalise" if "border" in engine else "zero")
    assert report["pixels_per_clock"] == (4 if "pixels" in engine else 1)
    assert report["pixels_compared"] == (4 if engine == "stack" else 2) * 18 * 22


@pytest.mark.parametrize(
    ("engine", "file", "old", "new"),
    [
        ("fir", "divide_round.vhd", ":= DIVISOR / 2;", ":= (DIVISOR - 1) / 2;"),
        ("stack", "divide_round.vhd", ":= DIVISOR / 2;", ":= (DIVISOR - 1) / 2;"),
        (
            "moving_sum --border normalise",
            "divide_weighted.vhd",
            "shift_right(unsigned(weight), 1);",
            "shift_right(unsigned(weight) - 1, 1);",
        ),
    ],
)
def test_halves_that_are_rounded_down_are_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str, file: str, old: str, new: str
) -> None:
    sources = plant(tmp_path / "hdl", file_bench.core_sources(), file, old, new)
    monkeypatch.setattr(file_bench, "core_sources", lambda: sources)
    code, report = run_small_frame(tmp_path, engine)
    assert code == EXIT_MISMATCH
    assert report["mismatches"] > 0
