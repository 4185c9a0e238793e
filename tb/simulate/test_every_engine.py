# SPDX-License-Identifier: Apache-2.0
"""One small frame through each engine by command, for the edit loop (``make check``)."""

import json
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.ground.images import write_png
from plenofir_tb.runner import simulator_name

pytestmark = pytest.mark.quick


@pytest.mark.parametrize(
    "engine", ["fir", "moving_sum --border normalise", "moving_sum --pixels 4", "stack"]
)
def test_small_frame(tmp_path: Path, engine: str) -> None:
    # Sums of an even M x M have halves between two grey levels, which are rounded up.
    raw = np.random.default_rng(0).integers(0, 256, (18, 22, 3), np.uint8)
    write_png(tmp_path / "raw.png", raw)
    words = "--raw", "raw.png", "-M", "4", "-a", "-1/2 1", "--engine", *engine.split()
    simulator = "--simulator", simulator_name()
    done = plenofir("sim", *words, *simulator, "--out", "o", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "o" / "report.json").read_text())
    assert report["mismatches"] == report["stalls"]["mismatches"] == 0
    assert report["stalls"]["pixels_compared"] == report["pixels_compared"]
    assert report["border"] == ("normalise" if "border" in engine else "zero")
    assert report["pixels_per_clock"] == (4 if "pixels" in engine else 1)
    assert report["pixels_compared"] == (4 if engine == "stack" else 2) * 18 * 22
