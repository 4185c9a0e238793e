"""The raster core against the bit-true model, for all M, a' and both arithmetics."""

import random

import pytest

from plenofir.core import MIN_LINE_STEPS, CoreConfiguration
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir_tb.runner import draw_seed, run_case

MICRO_IMAGE_SIZES = (1, 2, 3, 4, 5, 7, 11)
SHIFTS = range(-5, 13)
STORED_VARIANTS = (
    StoredProductArithmetic(fraction_bits=0, guard_bits=0),
    StoredProductArithmetic(fraction_bits=4, guard_bits=4),
    StoredProductArithmetic(fraction_bits=8, guard_bits=2),
)


def run_raster(core: CoreConfiguration, *, thorough: bool = False) -> None:
    core.check_limits()
    run_case(
        "raster_refocuser",
        "refocus.raster_bench",
        generics=core.generics(),
        case={"core": core.model_dump(mode="json"), "thorough": thorough},
    )


@pytest.mark.parametrize("m", MICRO_IMAGE_SIZES)
@pytest.mark.parametrize("shift", SHIFTS)
@pytest.mark.parametrize("kind", ["exact", "stored"])
def test_every_slice(m: int, shift: int, kind: str) -> None:
    # The variants of stored products, grey and RGB take turns along the grid.
    turn = MICRO_IMAGE_SIZES.index(m) + shift
    stored = STORED_VARIANTS[turn % len(STORED_VARIANTS)]
    run_raster(
        CoreConfiguration(
            micro_image_size=m,
            shift=shift,
            max_columns=2 * m + 5,
            channels=3 if (turn + (kind == "stored")) % 3 == 0 else 1,
            arithmetic=ExactArithmetic() if kind == "exact" else stored,
        )
    )


@pytest.mark.parametrize(
    "core",
    [
        CoreConfiguration(micro_image_size=1, shift=2, max_columns=6),
        CoreConfiguration(micro_image_size=2, shift=-1, max_columns=16, channels=3),
        CoreConfiguration(micro_image_size=3, shift=2, max_columns=32, align="causal"),
        CoreConfiguration(micro_image_size=3, shift=-2, max_columns=9, align="causal"),
        CoreConfiguration(micro_image_size=4, shift=0, max_columns=20, pixel_bits=16),
        CoreConfiguration(micro_image_size=5, shift=-3, max_columns=23, channels=3),
        CoreConfiguration(
            micro_image_size=5, shift=7, max_columns=16, arithmetic=STORED_VARIANTS[2]
        ),
        CoreConfiguration(
            micro_image_size=3, shift=4, max_columns=17, channels=3, arithmetic=STORED_VARIANTS[0]
        ),
        CoreConfiguration(
            micro_image_size=2,
            shift=3,
            max_columns=12,
            pixel_bits=16,
            arithmetic=STORED_VARIANTS[0],
        ),
        CoreConfiguration(micro_image_size=7, shift=1, max_columns=7),
    ],
    ids=lambda core: (
        f"M{core.micro_image_size}_shift{core.shift}_{core.arithmetic.kind}"
        f"_{core.channels}x{core.pixel_bits}_{core.align}"
    ),
)
def test_stalls_gaps_faults(core: CoreConfiguration) -> None:
    run_raster(core, thorough=True)


@pytest.mark.parametrize(
    "count", [3, *(pytest.param(10, marks=pytest.mark.slow, id=f"long{i}") for i in range(8))]
)
def test_random_configurations(count: int) -> None:
    seed = draw_seed()
    print(f"configurations drawn with seed {seed}")
    rng = random.Random(seed)
    for _ in range(count):
        m = rng.randint(1, 9)
        guard = rng.randint(0, 4)
        arithmetic = rng.choice(
            [
                ExactArithmetic(),
                StoredProductArithmetic(guard_bits=guard, fraction_bits=rng.randint(guard, 12)),
            ]
        )
        run_raster(
            CoreConfiguration(
                micro_image_size=m,
                shift=rng.randint(-12, 15),
                max_columns=rng.randint(max(m, MIN_LINE_STEPS), 3 * m + 8),
                channels=rng.choice([1, 3]),
                align=rng.choice(["centred", "causal"]),
                arithmetic=arithmetic,
            ),
            thorough=True,
        )
