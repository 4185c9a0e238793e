"""The raster core with moving sums, against the bit-true model, as that with taps."""

import random

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir_tb.runner import draw_seed, run_case

SHIFTS = range(-5, 13)
STORED_VARIANTS = (
    StoredProductArithmetic(fraction_bits=0, guard_bits=0),
    StoredProductArithmetic(fraction_bits=4, guard_bits=4),
    StoredProductArithmetic(fraction_bits=8, guard_bits=2),
)


def run_engine(*, thorough: bool, spare: int = 4, **options: object) -> None:
    """Run the raster core's bench, with lines that the engine takes without a pause, or shorter."""
    core = CoreConfiguration.model_validate({"engine": "moving_sum", "max_columns": 8, **options})
    core = core.model_copy(
        update={"max_columns": max(core.delay + 1, 2 * core.micro_image_size, 4) + spare}
    )
    core.check_limits()
    run_case(
        "raster_refocuser",
        "core.raster_bench",
        generics=core.generics(),
        case={"core": core.model_dump(mode="json"), "thorough": thorough},
    )


def grid(sizes: tuple[int, ...]) -> list[tuple[int, int]]:
    return [(m, shift) for m in sizes for shift in SHIFTS]


def run_slice(m: int, shift: int, *, stored: bool) -> None:
    turn = m + shift
    run_engine(
        thorough=False,
        micro_image_size=m,
        shifts=(shift,),
        channels=3 if (turn + stored) % 3 == 0 else 1,
        arithmetic=STORED_VARIANTS[turn % 3] if stored else ExactArithmetic(),
    )


@pytest.mark.parametrize(("m", "shift"), [*grid((3, 4)), *grid((1, 2, 5))[::4]])
def test_every_slice(m: int, shift: int) -> None:
    # The arithmetics take turns along the grid.
    run_slice(m, shift, stored=(m + shift // 2) % 2 == 0)


@pytest.mark.slow
@pytest.mark.parametrize(("m", "shift"), grid((1, 2, 3, 4, 5, 6, 7, 11)))
@pytest.mark.parametrize("stored", [False, True])
def test_every_slice_of_larger_micro_images(m: int, shift: int, stored: bool) -> None:
    run_slice(m, shift, stored=stored)


@pytest.mark.parametrize(
    "options",
    [
        {"micro_image_size": 5, "shifts": (-5, -3, 0, 4, 10), "channels": 3, "any_rows": True},
        {"micro_image_size": 4, "shifts": (2, -2, 1), "pixel_bits": 16},
        {"micro_image_size": 3, "shifts": (3, 0, -3)},
        {"micro_image_size": 3, "shifts": (-1, 2), "order": 1, "any_rows": True},
        {"micro_image_size": 2, "shifts": (2,), "order": 2},
        {"micro_image_size": 4, "shifts": (4, 2), "align": "causal"},
        {"micro_image_size": 7, "shifts": (-2,), "arithmetic": STORED_VARIANTS[2]},
        {"micro_image_size": 3, "shifts": (1, -4), "arithmetic": STORED_VARIANTS[1], "order": 1},
    ],
    ids=lambda options: "_".join(str(value) for value in options.values()).replace(" ", ""),
)
def test_sets_stalls_and_faults(options: dict) -> None:
    run_engine(thorough=True, **options)


@pytest.mark.parametrize(("m", "shifts"), [(5, (10,)), (4, (-5, 2)), (4, (5,))])
def test_frames_of_any_rows(m: int, shifts: tuple[int, ...]) -> None:
    run_engine(thorough=False, micro_image_size=m, shifts=shifts, any_rows=True)


def draw(rng: random.Random) -> dict[str, object]:
    m = rng.choice([1, 2, 3, 4, 5, 6, 7])
    stored = rng.random() < 0.4
    return {
        "micro_image_size": m,
        "shifts": tuple(rng.sample(range(-2 * m - 1, 2 * m + 3), rng.randint(1, 4))),
        "channels": rng.choice([1, 1, 3]),
        "align": rng.choice(["centred", "centred", "causal"]),
        "order": rng.choice([0, 0, 1]) if m < 6 else 0,
        "any_rows": rng.random() < 0.5,
        "arithmetic": rng.choice(STORED_VARIANTS) if stored else ExactArithmetic(),
        "spare": rng.choice([0, 3, 9]),
    }


@pytest.mark.parametrize("number", range(6))
def test_random_sets(number: int) -> None:
    rng = random.Random(draw_seed() + number)
    options = draw(rng)
    print(options)
    run_engine(thorough=number % 2 == 0, **options)
