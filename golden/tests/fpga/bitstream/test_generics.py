# SPDX-License-Identifier: Apache-2.0
"""Generics of the board's top level, from a core's configuration and from options."""

import pytest

from plenofir.commands.bitstream import board_generics
from plenofir.fpga.bitstream import top_level
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.ground.errors import InputError
from plenofir.refocus import StoredProductArithmetic


@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(micro_image_size=3, shifts=(2, -1), max_columns=800, channels=3),
        CoreConfiguration(
            micro_image_size=5,
            shifts=(-5, 0),
            max_columns=640,
            channels=3,
            order=1,
            engine=FirEngine(hold=True),
            arithmetic=StoredProductArithmetic(fraction_bits=6, guard_bits=1),
        ),
        CoreConfiguration(
            micro_image_size=3, shifts=(1,), max_columns=64, channels=3, engine=MovingSumEngine()
        ),
        CoreConfiguration(
            micro_image_size=5, shifts=(2, -1), max_columns=64, channels=3, boxes=(2, 2)
        ),
        CoreConfiguration(
            micro_image_size=5, shifts=(2, 0), max_columns=64, channels=3, boxes=(3, 5)
        ),
    ],
)
def test_configuration_and_generics_are_one(core: CoreConfiguration) -> None:
    assert (
        top_level.configuration({**top_level.default_generics(), **top_level.board_generics(core)})
        == core
    )


@pytest.mark.parametrize(
    "change",
    [
        {"channels": 1},
        {"engine": FirEngine(parallel_rows=2)},
        {"align": "causal"},
        {"pixel_bits": 10},
    ],
)
def test_board_has_no_such_core(change: dict[str, object]) -> None:
    core = CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=64, channels=3)
    with pytest.raises(InputError, match="has no such refocuser"):
        top_level.board_generics(core.model_copy(update=change))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"micro_image": 7}, "--micro-image requires --a"),
        ({"a": ["1/2"]}, "1/2 is not on the grid of M = 5"),
        ({"fraction": 4, "arith": "exact"}, "--fraction cannot be combined with --arith exact"),
        ({"guard": 3, "fraction": 2}, "guard_bits must not exceed fraction_bits"),
    ],
)
def test_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        board_generics(options)


def test_options() -> None:
    assert board_generics({}) == {}
    assert board_generics(
        {
            "micro_image": 3,
            "a": ["-2/3", "1"],
            "arith": "stored",
            "interpolation": "linear",
            "engine": "moving_sum",
        }
    ) == {
        "MICRO_IMAGE_SIZE": 3,
        "SHIFTS": "-2 3",
        "ENGINE": "moving_sum",
        "INTERPOLATION_ORDER": 1,
        "EXACT": False,
        "FRACTION_BITS": StoredProductArithmetic().fraction_bits,
        "GUARD_BITS": StoredProductArithmetic().guard_bits,
    }
    assert board_generics({"arith": "exact"}) == {"EXACT": True}
