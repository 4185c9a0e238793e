# SPDX-License-Identifier: Apache-2.0
"""The design that tests itself on a board, against the golden model."""

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.synthesis.self_test import TOP, self_test_generics
from plenofir.refocus import StoredProductArithmetic
from plenofir_tb.runner import run_case

COLUMNS, ROWS = 20, 12


@pytest.mark.parametrize(
    ("channels", "arithmetic"), [(3, None), (1, StoredProductArithmetic(fraction_bits=4))]
)
@pytest.mark.parametrize("wrong", [0, 1])
def test_self_test(channels: int, arithmetic, wrong: int) -> None:
    core = CoreConfiguration(
        micro_image_size=3,
        shifts=(2,),
        max_columns=COLUMNS,
        channels=channels,
        **({"arithmetic": arithmetic} if arithmetic else {}),
    )
    generics = self_test_generics(core, ROWS)
    generics["EXPECTED_LOW"] ^= wrong
    generics["BLINK_BITS"] = 1
    pixels = COLUMNS * ROWS
    latency = core.latency_clocks(COLUMNS, ROWS)
    case = {
        "clocks": latency + 5 * pixels,
        "latency": latency,
        "passes": int(not wrong),
        "pixels": pixels,
    }
    run_case(TOP, "selftest.bench", generics=generics, case=case)
