# SPDX-License-Identifier: Apache-2.0
"""Netlists with block RAM in Verilator: the golden model's frames, and changes of their nets."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import yosys_version
from plenofir.refocus import StoredProductArithmetic
from plenofir_studies.toggles import simulate_activity
from plenofir_tb.tools import or_skip

STORED = StoredProductArithmetic(fraction_bits=0, guard_bits=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "core",
    [
        # RAMB16BWER; RAMB8BWER with products in ROMs; RAMB8BWER of 36 bits, one port for each side.
        CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=640),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(1,),
            max_columns=640,
            arithmetic=STORED,
            engine=FirEngine(parallel_rows=3),
        ),
        CoreConfiguration(
            micro_image_size=3,
            shifts=(2,),
            max_columns=200,
            channels=3,
            engine=MovingSumEngine(),
        ),
    ],
    ids=["exact", "stored", "rgb"],
)
def test_netlist_with_block_ram(tmp_path: Path, core: CoreConfiguration) -> None:
    with or_skip():
        simulator = find_simulator("verilator")
        yosys_version()
    shape = (2, 18, 60, *((3,) if core.channels == 3 else ()))
    frames = np.random.default_rng(5).integers(0, 256, shape, np.uint8)
    # Raises if a frame is not the golden model's.
    found = simulate_activity(simulator, core, frames, tmp_path / "busy")
    assert found.figures.usage.block_rams > 0
    assert found.pixels == 2 * 18 * 60
    assert found.nets > found.figures.flip_flops / 2
    assert 0.05 < found.rate < 0.5
