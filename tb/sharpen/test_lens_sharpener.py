# SPDX-License-Identifier: Apache-2.0
"""The sharpener by itself, for any number of pixels a clock, against the golden model."""

import random
from math import gcd

from plenofir.fpga.core.engine import Generics
from plenofir_studies.part_wrapper import core_call
from plenofir_tb.runner import Case, draw_seed, run_cases


def sharpener_case(
    m: int,
    weights: tuple[int, ...],
    *,
    pixels: int = 1,
    channels: int = 1,
    divisor: int | None = None,
    white: int = 255,
    columns: int = 30,
    turns: int = 4,
) -> Case:
    divisor = m * m if divisor is None else divisor
    shifts, texts = " ".join(["1"] * len(weights)), " ".join(map(str, weights))
    core: Generics = {
        "MICRO_IMAGE_SIZE": m,
        "SHIFTS": shifts,
        "INTERPOLATION_ORDER": 0 if divisor == m * m else 1,
        "PIXELS_PER_CLOCK": pixels,
        "MAX_COLUMNS": columns,
        "CHANNELS": channels,
        "PIXEL_BITS": white.bit_length(),
        "ENGINE": "moving_sum",
        "SHARPENING": texts,
    }
    generics: Generics = {"CORE": core_call(core)}
    case = {
        "m": m,
        "weights": weights,
        "scale_units": gcd(*weights, 16),
        "pixels": pixels,
        "channels": channels,
        "sum_max": white * divisor,
        "divisor": divisor,
        "columns": columns,
        "turns": turns,
    }
    return Case("lens_sharpener", "sharpen.sharpener_bench", generics, case)


def test_sizes_weights_and_pixels_a_clock() -> None:
    run_cases(
        [
            sharpener_case(5, (4,), channels=3),
            sharpener_case(1, (16,), columns=9),
            sharpener_case(2, (3, 0, 4), columns=12),
            sharpener_case(4, (0, 4), divisor=256),
            sharpener_case(3, (15,), white=1),
            sharpener_case(2, (11,), columns=8),
            sharpener_case(2, (3,), columns=8),
            sharpener_case(5, (8,), pixels=4, columns=31),
            sharpener_case(3, (4, 0), pixels=8, columns=40),
            sharpener_case(4, (1,), pixels=2, channels=3, columns=14),
            sharpener_case(7, (4,), white=65535, columns=20),
        ]
    )


def test_any_sharpener() -> None:
    seed = draw_seed()
    print(f"sharpeners drawn with seed {seed}")
    rng = random.Random(seed)
    cases = []
    for _ in range(2):
        m = rng.randint(1, 9)
        weights = [rng.randint(0, 16) for _ in range(rng.choice([1, 1, 2, 3]))]
        weights[0] = weights[0] or 5
        cases.append(
            sharpener_case(
                m,
                tuple(weights),
                pixels=rng.choice([1, 2, 4, 8]),
                channels=rng.choice([1, 3]),
                divisor=m ** rng.choice([2, 4]),
                columns=rng.randint(4, 30),
                turns=3,
            )
        )
    run_cases(cases)
