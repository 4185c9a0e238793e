# SPDX-License-Identifier: Apache-2.0
"""Several slices at once in VHDL, against the bit-true model."""

import random

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import PixelsPerClock
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir_tb.drawn import drawn
from plenofir_tb.runner import Case, draw_seed, run_cases


def configuration(
    spare: int = 4, pixels: PixelsPerClock = 1, **options: object
) -> CoreConfiguration:
    """Core with lines that it takes without a pause, or with shorter ones."""
    core = CoreConfiguration.model_validate({"max_columns": 8, "engine": StackEngine(), **options})
    m = core.micro_image_size
    tokens = max(-(-core.delay // pixels) + 1, 4)
    columns = max(pixels * tokens, 2 * m) + spare
    engine = StackEngine(input_lines=m, pixels_per_clock=pixels)
    core = core.model_copy(update={"max_columns": columns, "engine": engine})
    core.check_limits()
    return core


def stack_case(core: CoreConfiguration, *, thorough: bool) -> Case:
    """The raster core's bench on a stack."""
    case = {"core": core.model_dump(mode="json"), "thorough": thorough, "kind": "focal_stack"}
    return Case("focal_stack", "core.raster_bench", core.generics(), case)


# Cases share simulations, whose start-up takes most of the time.
STACKS: list[dict] = [
    {"micro_image_size": 5, "shifts": (-3, 0, 3), "channels": 3},
    {"micro_image_size": 3, "shifts": (-3, 3)},
    # A phase of which no line is kept.
    {"micro_image_size": 3, "shifts": (3,)},
    {"micro_image_size": 4, "shifts": (2, -2, 1), "pixel_bits": 16},
    {"micro_image_size": 2, "shifts": (-3, -1, 0, 1, 4)},
    # Several pixels a clock: slices that hold outputs, and others; a line that ends in a token.
    {"micro_image_size": 3, "shifts": (0, 2, -1), "channels": 3, "pixels": 4},
    # None that holds outputs, which would take a clock more.
    {"micro_image_size": 3, "shifts": (2, -1), "pixels": 2},
    # A box of each slice.
    # Pairs with two boxes, for a depth index with SHARP_TOO; others beside them.
    {"micro_image_size": 5, "shifts": (3, 3, -3, -3, 0), "boxes": (5, 2, 5, 4, 5)},
    {"micro_image_size": 4, "shifts": (2, -3, 1, 1), "boxes": (2, 1, 4, 3), "pixels": 4},
    {"micro_image_size": 3, "shifts": (1, -2), "boxes": (1, 2), "border": "normalise"},
]
MORE_STACKS: list[dict] = [
    {"micro_image_size": 3, "shifts": (3, 0, -3, 1), "channels": 3},
    {"micro_image_size": 4, "shifts": (4, 2), "align": "causal"},
    {"micro_image_size": 1, "shifts": (0,)},
    {"micro_image_size": 7, "shifts": (5,)},
    {"micro_image_size": 5, "shifts": (0, 2, -3), "channels": 3, "pixels": 4},
    {"micro_image_size": 2, "shifts": (-2, 1), "pixels": 8, "spare": 5},
    {"micro_image_size": 4, "shifts": (-2, 1, 4), "pixels": 2, "channels": 3},
    {"micro_image_size": 7, "shifts": (5, -1), "pixels": 16},
    {"micro_image_size": 1, "shifts": (0,), "pixels": 2},
]


@pytest.mark.parametrize("stacks", [STACKS, pytest.param(MORE_STACKS, marks=pytest.mark.slow)])
def test_stacks_stalls_and_faults(stacks: list[dict]) -> None:
    cores = [configuration(**options) for options in drawn(stacks, 3)] + [random_core(0, 300)]
    run_cases([stack_case(core, thorough=True) for core in cores], long=True)


def draw(rng: random.Random) -> dict[str, object]:
    m = rng.choice([1, 2, 3, 4, 5, 6, 7])
    return {
        "micro_image_size": m,
        "shifts": tuple(rng.sample(range(-2 * m - 1, 2 * m + 3), rng.randint(1, 5))),
        "channels": rng.choice([1, 1, 3]),
        "align": rng.choice(["centred", "centred", "causal"]),
        "spare": rng.choice([0, 3, 9]),
        "pixels": rng.choice([1, 1, 2, 4, 8]),
    }


def sums_of_a_line(core: CoreConfiguration) -> int:
    """Estimate of a simulation's time."""
    return core.max_columns * core.micro_image_size * len(core.shifts) * core.channels


def random_core(number: int, most: int) -> CoreConfiguration:
    rng = random.Random(draw_seed() + number)
    core = configuration(**draw(rng))
    while sums_of_a_line(core) > most:
        core = configuration(**draw(rng))
    print(core)
    return core


@pytest.mark.slow
@pytest.mark.parametrize("number", range(10))
def test_more_random_stacks(number: int) -> None:
    cores = [random_core(100 + 4 * number + n, 10**6) for n in range(4)]
    run_cases([stack_case(core, thorough=n % 2 == 0) for n, core in enumerate(cores)])
