# SPDX-License-Identifier: Apache-2.0
"""``refocuser_axi``: registers beside running video, pixel by pixel."""

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.refocus import StoredProductArithmetic
from plenofir_tb.runner import Case, run_cases

pytest.importorskip("cocotbext.axi", reason="cocotbext-axi is missing: scripts/setup.sh tests")

CORES = (
    CoreConfiguration(micro_image_size=2, shifts=(-1, 0, 2), max_columns=17, border="normalise"),
    CoreConfiguration(
        micro_image_size=3, shifts=(1, -2), max_columns=12, channels=3, pixel_bits=5, boxes=(2, 3)
    ),
    CoreConfiguration(
        micro_image_size=3,
        shifts=(2, -1, 0),
        max_columns=22,
        pixel_bits=10,
        engine=MovingSumEngine(pixels_per_clock=4),
    ),
    CoreConfiguration(
        micro_image_size=2,
        shifts=(3, 1),
        max_columns=16,
        align="causal",
        engine=FirEngine(parallel_rows=2),
        arithmetic=StoredProductArithmetic(fraction_bits=4, guard_bits=2),
    ),
)


def case(core: CoreConfiguration, frames: int) -> Case:
    core.check_limits()
    document = {"core": core.model_dump(mode="json"), "frames": frames}
    return Case("refocuser_axi", "axi.video_bench", core.generics(), document)


def test_refocuser_axi() -> None:
    run_cases([case(core, 6) for core in CORES])


@pytest.mark.slow
def test_long() -> None:
    run_cases([case(core, 60) for core in CORES])
