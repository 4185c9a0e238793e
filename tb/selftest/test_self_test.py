# SPDX-License-Identifier: Apache-2.0
"""The design that tests itself on a board, against the golden model."""

from itertools import product

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.refocus import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir_tb.runner import Case, run_cases
from self_test import TOP, self_test_generics

COLUMNS, ROWS = 20, 12


def self_test(channels: int, arithmetic: Arithmetic, wrong: int) -> Case:
    core = CoreConfiguration(
        micro_image_size=3,
        shifts=(2,),
        max_columns=COLUMNS,
        channels=channels,
        arithmetic=arithmetic,
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
    return Case(TOP, "selftest.bench", generics, case)


def test_self_test() -> None:
    kinds = [(3, ExactArithmetic()), (1, StoredProductArithmetic(fraction_bits=4))]
    run_cases([self_test(*kind, wrong) for kind, wrong in product(kinds, (0, 1))])
