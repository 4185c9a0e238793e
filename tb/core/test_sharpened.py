# SPDX-License-Identifier: Apache-2.0
"""The raster core with a sharpener behind either engine: stalls, gaps, faults, slices."""

import random

import pytest
from test_raster_refocuser import raster_case

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir_tb.runner import draw_seed, run_cases

SUMS = MovingSumEngine()
SMALL = [
    CoreConfiguration(micro_image_size=2, shifts=(1,), max_columns=6, channels=3, sharpening=(3,)),
    CoreConfiguration(
        micro_image_size=3, shifts=(2, 3, 1), max_columns=8, sharpening=(4, 0, 5), engine=SUMS
    ),
]
MORE = [
    CoreConfiguration(
        micro_image_size=5, shifts=(-3,), max_columns=17, channels=3, sharpening=(11,)
    ),
    CoreConfiguration(
        micro_image_size=4,
        shifts=(2, 1),
        max_columns=13,
        sharpening=(3, 4),
        engine=SUMS,
        channels=3,
    ),
    CoreConfiguration(micro_image_size=2, shifts=(1,), max_columns=9, order=1, sharpening=(6,)),
    CoreConfiguration(
        micro_image_size=5, shifts=(3, 1), boxes=(2, 2), max_columns=17, sharpening=(4, 0)
    ),
    CoreConfiguration(
        micro_image_size=3,
        shifts=(2, 4),
        max_columns=22,
        sharpening=(4, 4),
        engine=MovingSumEngine(pixels_per_clock=4),
    ),
]


@pytest.mark.parametrize(
    "cores", [SMALL, pytest.param(MORE, marks=pytest.mark.slow)], ids=["small", "more"]
)
def test_stalls_gaps_faults(cores: list[CoreConfiguration]) -> None:
    run_cases([raster_case(core, thorough=True) for core in cores])


@pytest.mark.slow
def test_any_sharpened_core() -> None:
    seed = draw_seed()
    print(f"configurations drawn with seed {seed}")
    rng = random.Random(seed)
    m = rng.randint(1, 5)
    shifts = tuple(rng.randint(-4, 5) for _ in range(rng.choice([1, 2])))
    core = CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=rng.randint(max(m, 2), 2 * m + 6),
        align=rng.choice(["centred", "causal"]),
        sharpening=(*(rng.randint(0, 16) for _ in shifts[1:]), rng.randint(1, 16)),
        engine=rng.choice([MovingSumEngine(), MovingSumEngine(any_rows=True)]),
    )
    run_cases([raster_case(core, thorough=True)])
