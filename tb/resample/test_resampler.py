# SPDX-License-Identifier: Apache-2.0
"""The resampler in VHDL, against its bit-true model; the hunter tests the colour mosaic."""

import random

import pytest

from plenofir.plan.sensor.resampler import ResamplerConfiguration
from plenofir_tb.runner import Case, draw_seed, run_cases


def resampler(options: dict, *, thorough: bool = True, bench: str = "resample_bench") -> Case:
    core = ResamplerConfiguration.model_validate(options)
    case = {"core": core.model_dump(), "thorough": thorough}
    return Case("resampler", f"resample.{bench}", core.generics(), case)


# Line lengths of a power of two and one more; rows with more lenses than a power of two.
SMALL = (
    {
        "micro_image_size": 3,
        "max_columns": 17,
        "lines": 8,
        "channels": 3,
        "moves": True,
        "gains": True,
        "lenses": 160,
    },
    {
        "micro_image_size": 2,
        "max_columns": 64,
        "lines": 8,
        "hexagonal": True,
        # Values that become white only by rounding.
        "gains": True,
        "lenses": 600,
    },
    # A focused camera, with lenses beside the frame.
    {"micro_image_size": 4, "max_columns": 30, "lines": 14, "skewed": True},
)


@pytest.mark.parametrize("number", range(len(SMALL)), ids=("moved", "hexagonal", "skewed"))
@pytest.mark.drawn(2, "grids of a resampler")
def test_grids(number: int) -> None:
    run_cases([resampler(SMALL[number], thorough=False)], long=True)


def test_loads_and_few_pixels() -> None:
    benches = {
        "loads_bench": {"micro_image_size": 2, "max_columns": 21, "lines": 8},
        "narrow_bench": {"micro_image_size": 1, "max_columns": 3, "lines": 4},
    }
    cases = [resampler(o, thorough=False, bench=bench) for bench, o in benches.items()]
    core = ResamplerConfiguration.model_validate({**benches["loads_bench"], "channels": 3})
    generics = {**core.generics(), "MOSAIC": True}
    case = {"core": core.model_dump(), "thorough": False, "mosaic": True}
    run_cases([*cases, Case("sensor_raster", "resample.loads_bench", generics, case)])


@pytest.mark.slow
def test_grids_and_registers_that_change() -> None:
    larger = {"micro_image_size": 5, "max_columns": 44, "lines": 10}
    run_cases([resampler(options) for options in (*SMALL, larger)])


def run_random(number: int) -> None:
    rng = random.Random(draw_seed() + number)
    m = rng.choice([1, 2, 3, 4, 5, 7])
    tables = rng.random() < 0.5
    options = {
        "micro_image_size": m,
        **rng.choice(({}, {}, {"hexagonal": True}, {"skewed": True})),
        "max_columns": rng.randint(4 * m + 12, 7 * m + 20),
        "lines": 2 * rng.randint(m // 2 + 3, m // 2 + 6),
        "lenses": 1500 if tables else 2,
        "moves": tables and rng.random() < 0.7,
        "gains": tables,
        "channels": rng.choice([1, 1, 3]),
        "pixel_bits": rng.choice([8, 8, 10, 16]),
        "fraction_bits": rng.randint(12, 17),
        "weight_bits": rng.randint(2, 8),
        "guard_bits": rng.randint(1, 3),
        "gain_bits": rng.randint(4, 14),
    }
    print(options)
    run_cases([resampler(options)])


@pytest.mark.slow
@pytest.mark.parametrize("number", range(12))
def test_random_grids(number: int) -> None:
    run_random(number)
