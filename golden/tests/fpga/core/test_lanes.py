# SPDX-License-Identifier: Apache-2.0
"""Cores with several pixels a clock: limits and resources."""

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import PixelsPerClock
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.ground.errors import InputError
from plenofir.refocus import StoredProductArithmetic

pytestmark = pytest.mark.quick


def core(m: int, shifts: tuple[int, ...], channels: int, pixels: PixelsPerClock, **more: object):
    values = {
        "micro_image_size": m,
        "shifts": shifts,
        "max_columns": 1280,
        "channels": channels,
        "engine": MovingSumEngine(pixels_per_clock=pixels),
    }
    return CoreConfiguration.model_validate(values | more)


@pytest.mark.parametrize("pixels", [2, 4, 8])
@pytest.mark.parametrize(
    ("m", "shifts", "channels"),
    [(11, (2,), 1), (11, tuple(range(-11, 12)), 1), (5, (2,), 3), (5, tuple(range(-5, 11)), 3)],
)
def test_memory_stays_and_multipliers_are_those_of_the_pixels(m, shifts, channels, pixels) -> None:
    one, several = core(m, shifts, channels, 1), core(m, shifts, channels, pixels)
    blocks = [core.blocks[0] for core in (one, several)]
    bits = [sum(memory.bits for memory in block.memories) for block in blocks]
    assert bits[1] <= 1.1 * bits[0]
    assert blocks[1].multipliers_on("spartan6") == pixels * channels


def test_lines_end_anywhere() -> None:
    several = core(5, (2,), 1, 8)
    assert [several.line_tokens(columns) for columns in (1, 8, 9, 1280)] == [1, 1, 2, 160]
    assert several.band_steps(1280) == 160
    assert several.band_steps(9) == 4


@pytest.mark.parametrize(
    ("m", "shift", "more", "where"),
    [
        (5, 2, {"arithmetic": StoredProductArithmetic()}, "arithmetic"),
        (128, 4000, {}, "shifts"),
    ],
)
def test_what_it_cannot_be_built_for_is_refused_by_name(m, shift, more, where) -> None:
    with pytest.raises(InputError) as caught:
        core(m, (shift,), 1, 8, **more).check_limits()
    assert caught.value.where == where
