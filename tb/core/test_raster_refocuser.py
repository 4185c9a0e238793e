# SPDX-License-Identifier: Apache-2.0
"""The raster core against the bit-true model, for all M, a' and both arithmetics."""

import math
import random
from itertools import product

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir_tb.runner import Case, draw_seed, run_cases

MICRO_IMAGE_SIZES = (1, 2, 3, 4, 5, 7, 11)
SHIFTS = range(-5, 13)
STORED_VARIANTS = (
    StoredProductArithmetic(fraction_bits=0, guard_bits=0),
    StoredProductArithmetic(fraction_bits=4, guard_bits=4),
    StoredProductArithmetic(fraction_bits=8, guard_bits=2),
)


def raster_case(core: CoreConfiguration, *, thorough: bool = False) -> Case:
    core.check_limits()
    return Case(
        "raster_refocuser",
        "core.raster_bench",
        core.generics(),
        {"core": core.model_dump(mode="json"), "thorough": thorough},
    )


@pytest.mark.drawn(2)
@pytest.mark.parametrize(
    "m",
    [pytest.param(m, marks=[pytest.mark.slow] if m > 5 else []) for m in MICRO_IMAGE_SIZES],
)
def test_every_slice(m: int) -> None:
    cases = []
    for kind, shift in product(("exact", "stored"), SHIFTS):
        # Variants of stored products, grey and RGB alternate along the grid.
        turn = MICRO_IMAGE_SIZES.index(m) + shift
        stored = STORED_VARIANTS[turn % len(STORED_VARIANTS)]
        core = CoreConfiguration(
            micro_image_size=m,
            shifts=(shift,),
            max_columns=2 * m + 5,
            channels=3 if (turn + (kind == "stored")) % 3 == 0 else 1,
            arithmetic=ExactArithmetic() if kind == "exact" else stored,
        )
        cases.append(raster_case(core))
    run_cases(cases)


# Cases share simulations, whose start-up takes most of the time.
FAULTS = [
    CoreConfiguration(micro_image_size=1, shifts=(2,), max_columns=6),
    CoreConfiguration(micro_image_size=2, shifts=(-1,), max_columns=16, channels=3),
    CoreConfiguration(micro_image_size=3, shifts=(2,), max_columns=32, align="causal"),
    CoreConfiguration(micro_image_size=3, shifts=(-2,), max_columns=9, align="causal"),
    CoreConfiguration(micro_image_size=4, shifts=(0,), max_columns=20, pixel_bits=16),
    CoreConfiguration(micro_image_size=5, shifts=(-3,), max_columns=23, channels=3),
    CoreConfiguration(
        micro_image_size=5, shifts=(7,), max_columns=16, arithmetic=STORED_VARIANTS[2]
    ),
    CoreConfiguration(
        micro_image_size=3,
        shifts=(4,),
        max_columns=17,
        channels=3,
        arithmetic=STORED_VARIANTS[0],
    ),
    CoreConfiguration(
        micro_image_size=2,
        shifts=(3,),
        max_columns=12,
        pixel_bits=16,
        arithmetic=STORED_VARIANTS[0],
    ),
    CoreConfiguration(micro_image_size=7, shifts=(1,), max_columns=7),
    # Without a delay.
    CoreConfiguration(
        micro_image_size=3,
        shifts=(1,),
        max_columns=10,
        align="causal",
        engine=MovingSumEngine(pixels_per_clock=2),
    ),
]
ARRAYS = [
    CoreConfiguration(
        micro_image_size=3, shifts=(-3, 0, 3), max_columns=12, engine=FirEngine(hold=True)
    ),
    CoreConfiguration(
        micro_image_size=3, shifts=(0,), max_columns=14, channels=3, engine=FirEngine(hold=True)
    ),
    CoreConfiguration(micro_image_size=3, shifts=(-2, 1, 4), max_columns=14, order=1),
    CoreConfiguration(micro_image_size=2, shifts=(3,), max_columns=14, order=3),
    CoreConfiguration(
        micro_image_size=3, shifts=(2,), max_columns=12, order=2, arithmetic=STORED_VARIANTS[2]
    ),
    CoreConfiguration(
        micro_image_size=5,
        shifts=(-3, 7),
        max_columns=13,
        channels=3,
        engine=FirEngine(broadcast_taps=4),
    ),
    CoreConfiguration(micro_image_size=3, shifts=(-4, 5), max_columns=15, align="causal"),
    CoreConfiguration(
        micro_image_size=4,
        shifts=tuple(range(-4, 5)),
        max_columns=15,
        arithmetic=STORED_VARIANTS[1],
    ),
    CoreConfiguration(
        micro_image_size=3, shifts=(-1, 2), max_columns=18, engine=FirEngine(parallel_rows=3)
    ),
    CoreConfiguration(
        micro_image_size=3,
        shifts=(2,),
        max_columns=7,
        channels=3,
        engine=FirEngine(parallel_rows=5),
    ),
    CoreConfiguration(
        micro_image_size=2, shifts=(0, 2), max_columns=5, engine=FirEngine(parallel_rows=8)
    ),
    CoreConfiguration(
        micro_image_size=5,
        shifts=(-5, 0, 5),
        max_columns=12,
        engine=FirEngine(parallel_rows=2, hold=True, broadcast_taps=1),
        order=1,
        arithmetic=STORED_VARIANTS[2],
    ),
    # Boxes: of each slice, with views in groups; with interpolation; of products; causal.
    CoreConfiguration(
        micro_image_size=4,
        shifts=(2, -1, 3, 4),
        boxes=(2, 3, 1, 4),
        max_columns=15,
        channels=3,
        engine=FirEngine(parallel_rows=2),
    ),
    CoreConfiguration(micro_image_size=3, shifts=(-2, 4), boxes=(1, 2), max_columns=14, order=1),
    CoreConfiguration(
        micro_image_size=5,
        shifts=(3, -3),
        boxes=(2, 2),
        max_columns=16,
        arithmetic=STORED_VARIANTS[2],
    ),
    CoreConfiguration(
        micro_image_size=6, shifts=(-3,), boxes=(3,), max_columns=17, align="causal", order=1
    ),
]


@pytest.mark.drawn(1)
@pytest.mark.parametrize("part", range(2))
def test_stalls_gaps_faults(part: int) -> None:
    run_cases([raster_case(core, thorough=True) for core in FAULTS[part::2]])


@pytest.mark.drawn(1)
@pytest.mark.parametrize("part", range(3))
def test_array_slices_interpolation(part: int) -> None:
    run_cases([raster_case(core, thorough=True) for core in ARRAYS[part::3]])


def draw_boxes(
    rng: random.Random, m: int, shifts: tuple[int, ...], *, one: bool
) -> tuple[int, ...]:
    """A box for each slice, with `one` the same; or none."""
    steps = [math.gcd(shift, m) for shift in shifts]
    if rng.random() < 0.5:
        return ()
    if one:
        shared = [box for box in range(1, m + 1) if not any(box % step for step in steps)]
        return (rng.choice(shared),) * len(shifts)
    return tuple(step * rng.randint(1, m // step) for step in steps)


def random_core(rng: random.Random) -> CoreConfiguration:
    """Draw a configuration of any kind."""
    m = rng.randint(1, 7)
    guard = rng.randint(0, 4)
    arithmetic = rng.choice(
        [
            ExactArithmetic(),
            StoredProductArithmetic(guard_bits=guard, fraction_bits=rng.randint(guard, 12)),
        ]
    )
    shifts = tuple(rng.randint(-9, 11) for _ in range(rng.choice([1, 1, 2, 5])))
    align = rng.choice(["centred", "causal"])
    hold = rng.random() < 0.3
    if hold:
        shifts = tuple(2 * m * (shift // 6) for shift in shifts)
    rows = rng.choice([1, 1, 2, 3, m, rng.randint(1, 12)])
    boxes = draw_boxes(rng, m, shifts, one=not isinstance(arithmetic, ExactArithmetic))
    return CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        boxes=boxes,
        max_columns=rng.randint(max(m, 4, 2 * rows), 3 * m + 8 + 2 * rows),
        channels=rng.choice([1, 3]),
        align=align,
        arithmetic=arithmetic,
        order=rng.choice([0, 0, 0, 1, 2]),
        engine=FirEngine(
            hold=hold, parallel_rows=rows, broadcast_taps=rng.choice([0, 0, 1, 5, 1000])
        ),
    )


@pytest.mark.slow
@pytest.mark.parametrize("number", range(8))
def test_random_configurations(number: int) -> None:
    """In `make test` the hunter (`tb/hunt`) draws such cases."""
    seed = draw_seed()
    print(f"configurations drawn with SEED={seed}")
    rng = random.Random(seed + number)
    run_cases([raster_case(random_core(rng), thorough=True) for _ in range(8)])
