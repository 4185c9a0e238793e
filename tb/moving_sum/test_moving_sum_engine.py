# SPDX-License-Identifier: Apache-2.0
"""The raster core with moving sums, against the bit-true model."""

import itertools
import random

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import PixelsPerClock
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir_tb.runner import Case, draw_seed, run_cases

SHIFTS = range(-5, 13)
STORED_VARIANTS = (
    StoredProductArithmetic(fraction_bits=0, guard_bits=0),
    StoredProductArithmetic(fraction_bits=4, guard_bits=4),
    StoredProductArithmetic(fraction_bits=8, guard_bits=2),
)


def engine_case(
    *,
    thorough: bool,
    spare: int = 4,
    any_rows: bool = False,
    pixels: PixelsPerClock = 1,
    **options: object,
) -> Case:
    """Lines are as long as the engine takes without a pause, or shorter."""
    engine = MovingSumEngine(any_rows=any_rows, pixels_per_clock=pixels)
    core = CoreConfiguration.model_validate(
        {"engine": engine, "max_columns": 8 * pixels, **options}
    )
    tokens = max(engine.least_steps(core), -(-2 * core.micro_image_size // pixels))
    core = core.model_copy(update={"max_columns": (tokens - 1) * pixels + 1 + spare})
    core.check_limits()
    return Case(
        "raster_refocuser",
        "core.raster_bench",
        core.generics(),
        {"core": core.model_dump(mode="json"), "thorough": thorough},
    )


def slice_case(m: int, shift: int, *, stored: bool) -> Case:
    turn = m + shift
    return engine_case(
        thorough=False,
        micro_image_size=m,
        shifts=(shift,),
        channels=3 if (turn + stored) % 3 == 0 else 1,
        arithmetic=STORED_VARIANTS[turn % 3] if stored else ExactArithmetic(),
    )


@pytest.mark.drawn(2)
@pytest.mark.parametrize("m", [1, 2, 3, 4, 5])
def test_every_slice(m: int) -> None:
    # The arithmetics take turns along the grid.
    run_cases([slice_case(m, shift, stored=(m + shift // 2) % 2 == 0) for shift in SHIFTS])


@pytest.mark.slow
@pytest.mark.parametrize("m", [1, 2, 3, 4, 5, 6, 7, 11])
@pytest.mark.parametrize("stored", [False, True])
def test_every_slice_of_larger_micro_images(m: int, stored: bool) -> None:
    run_cases([slice_case(m, shift, stored=stored) for shift in SHIFTS])


# Cases share simulations, whose start-up takes most of the time.
SETS: list[dict] = [
    {"micro_image_size": 5, "shifts": (-5, -3, 0, 4, 5), "channels": 3, "any_rows": True},
    {"micro_image_size": 4, "shifts": (2, -2, 1), "pixel_bits": 16},
    {"micro_image_size": 3, "shifts": (3, 0, -3)},
    {"micro_image_size": 3, "shifts": (-1, 2), "order": 1, "any_rows": True},
    {"micro_image_size": 2, "shifts": (2,), "order": 2},
    {"micro_image_size": 4, "shifts": (4, 2), "align": "causal"},
    {"micro_image_size": 7, "shifts": (-2,), "arithmetic": STORED_VARIANTS[2]},
    {"micro_image_size": 3, "shifts": (1, -4), "arithmetic": STORED_VARIANTS[1], "order": 1},
    # Boxes: of each slice, one of M among them; with interpolation; of products; a group of views.
    {"micro_image_size": 4, "shifts": (2, -1, 3, 4), "boxes": (2, 3, 1, 4), "channels": 3},
    {"micro_image_size": 3, "shifts": (-2, 4), "boxes": (1, 2), "order": 1, "any_rows": True},
    {"micro_image_size": 5, "shifts": (3,), "boxes": (3,), "arithmetic": STORED_VARIANTS[2]},
    {"micro_image_size": 4, "shifts": (2, -6), "boxes": (2, 2), "border": "normalise"},
]


@pytest.mark.drawn(1)
@pytest.mark.parametrize("part", range(2))
def test_sets_stalls_and_faults(part: int) -> None:
    run_cases([engine_case(thorough=True, **options) for options in SETS[part::2]], long=True)


# Several pixels a clock: lines that fill their last token, and others.
LANES: list[dict] = [
    {"micro_image_size": 6, "shifts": (2, 3), "boxes": (4, 3), "pixels": 4, "spare": 1},
    {"micro_image_size": 3, "shifts": (2, 3), "pixels": 4, "spare": 3},
    {"micro_image_size": 2, "shifts": (2,), "pixels": 8, "spare": 1, "sharpening": (5,)},
    {"micro_image_size": 5, "shifts": (-5, -3, 4), "channels": 3, "pixels": 8, "any_rows": True},
    {"micro_image_size": 3, "shifts": (2,), "pixels": 2, "spare": 1},
    {"micro_image_size": 4, "shifts": (2, 1), "pixels": 2, "pixel_bits": 16, "spare": 1},
    {"micro_image_size": 3, "shifts": (-1, 3), "pixels": 4, "order": 1},
    {"micro_image_size": 1, "shifts": (3,), "pixels": 8, "align": "causal"},
    {"micro_image_size": 11, "shifts": (-3, 2, 11), "pixels": 8, "spare": 5},
    {"micro_image_size": 2, "shifts": (2,), "pixels": 4, "order": 2},
    {"micro_image_size": 6, "shifts": (3, -4), "pixels": 2, "align": "causal"},
    {"micro_image_size": 5, "shifts": (3, 1), "pixels": 4, "channels": 3, "sharpening": (4, 3)},
    {"micro_image_size": 4, "shifts": (5,), "pixels": 16, "any_rows": True},
    {"micro_image_size": 7, "shifts": (4,), "pixels": 16, "channels": 3, "spare": 12},
    {"micro_image_size": 3, "shifts": (-4, 6), "pixels": 32, "spare": 31, "any_rows": True},
]


@pytest.mark.parametrize(
    "part",
    [
        slice(0, 2),
        *(pytest.param(slice(n, n + 2), marks=pytest.mark.slow) for n in range(2, 16, 2)),
    ],
)
def test_lanes_stalls_and_faults(part: slice) -> None:
    run_cases([engine_case(thorough=True, **options) for options in LANES[part]])


def lane_case(m: int, shift: int, pixels: PixelsPerClock) -> Case:
    turn = m + shift
    return engine_case(
        thorough=False,
        micro_image_size=m,
        shifts=(shift,),
        channels=3 if turn % 5 == 0 else 1,
        pixels=pixels,
        spare=turn % pixels,
    )


def test_every_slice_with_lanes() -> None:
    # The pixels a clock take turns along the grid.
    lanes: tuple[PixelsPerClock, ...] = (2, 4, 8)
    run_cases([lane_case(m, s, lanes[(m + s) % 3]) for m in (2, 3, 5) for s in (-2, 0, 2, 3)])


@pytest.mark.slow
@pytest.mark.parametrize("pixels", [2, 4, 8, 16, 32])
@pytest.mark.parametrize("m", [1, 2, 3, 4, 5, 6, 7, 11])
def test_every_slice_with_all_lanes(m: int, pixels: PixelsPerClock) -> None:
    run_cases([lane_case(m, shift, pixels) for shift in SHIFTS])


def test_frames_of_any_rows() -> None:
    run_cases(
        [
            engine_case(thorough=False, micro_image_size=m, shifts=shifts, any_rows=True)
            for m, shifts in [(5, (10,)), (4, (-5, 2)), (4, (5,))]
        ]
    )


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
        "pixels": 1 if stored else rng.choice([1, 1, 2, 4, 8]),
    }


def frame_values(options: dict[str, object]) -> int:
    """Number of values of a frame; a simulation takes a second for about 60."""
    core = CoreConfiguration.model_validate(engine_case(thorough=True, **options).case["core"])
    rows = core.frame_lines(1) + core.micro_image_size
    return core.max_columns * rows * core.channels


@pytest.mark.parametrize(
    ("thorough", "most"),
    [(False, 2000), (True, 300), pytest.param(True, 10**6, marks=pytest.mark.slow)],
)
def test_random_sets(thorough: bool, most: int) -> None:
    rng = random.Random(draw_seed() + thorough)
    drawn = (draw(rng) for _ in itertools.count())
    sets = list(itertools.islice((one for one in drawn if frame_values(one) <= most), 3))
    print(sets)
    run_cases([engine_case(thorough=thorough, **options) for options in sets])


def test_control() -> None:
    cases = []
    for m, shifts in [(3, (2, -1)), (4, (3,)), (2, (0, 2, -2))]:
        core = CoreConfiguration(
            micro_image_size=m, shifts=shifts, max_columns=200, engine=MovingSumEngine()
        )
        generics = {"MICRO_IMAGE_SIZE": m, "SHIFTS": " ".join(map(str, shifts))}
        case = {"delay": core.delay, "slices": len(shifts)}
        cases.append(Case("control_ports", "moving_sum.control_bench", generics, case))
    run_cases(cases)
