# SPDX-License-Identifier: Apache-2.0
"""Depth index and all-in-focus picture in VHDL, against the bit-true model."""

import random
from typing import Any

import pytest

from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir_tb.drawn import drawn
from plenofir_tb.runner import Case, draw_seed, run_cases


def index_case(options: dict, resets: int = 0) -> Case:
    """A case of the raster core's bench for depth indices, or one with many resets."""
    tests = {"thorough": False, "resets": resets} if resets else {"thorough": True}
    core = DepthIndexConfiguration.model_validate(options)
    case = {"core": core.model_dump(mode="json"), "kind": "depth_index", **tests}
    return Case("depth_index", "core.raster_bench", core.generics(), case)


def run_indices(*cases: dict) -> None:
    """Run benches side by side."""
    run_cases([index_case(options) for options in cases])


def test_index_and_picture() -> None:
    cases: list[dict] = [
        {"micro_image_size": 3, "slices": 3, "max_columns": 16, "channels": 3},
        # Sums that fill their words; a power of two of micro images a line, the last one cut. Depth
        # between unequally spaced slices.
        {"micro_image_size": 2, "slices": 3, "max_columns": 15, "radius": 3, "shifts": (5, 2, 0)},
        {
            "micro_image_size": 4,
            "slices": 1,
            "max_columns": 22,
            "radius": 0,
            "confidence": 1,
            "vote_radius": 1,
        },
        # Votes with few micro images with texture, and without any. A division takes longer.
        {
            "micro_image_size": 2,
            "slices": 3,
            "max_columns": 41,
            "radius": 0,
            "confidence": 4000,
            "vote_radius": 1,
            "shifts": (-3, 0, 1),
        },
        {
            "micro_image_size": 3,
            "slices": 2,
            "max_columns": 40,
            "channels": 3,
            "radius": 1,
            "confidence": 30000,
            "vote_radius": 2,
        },
        # A confidence above any possible sharpness.
        {
            "micro_image_size": 2,
            "slices": 2,
            "max_columns": 28,
            "radius": 0,
            "confidence": 131072,
            "vote_radius": 3,
        },
        # Depth between slices takes less time than votes of many slices.
        {
            "micro_image_size": 2,
            "slices": 6,
            "max_columns": 36,
            "radius": 0,
            "confidence": 300,
            "vote_radius": 2,
            "shifts": (-3, -2, -1, 1, 2, 7),
        },
        # Lines shorter than the window.
        {"micro_image_size": 2, "slices": 2, "max_columns": 17, "radius": 8},
    ]
    # Several pixels a clock: a line's last token begins and ends a micro image; M equals P.
    several: list[dict] = [
        {
            "micro_image_size": 5,
            "slices": 3,
            "max_columns": 62,
            "pixels_per_clock": 4,
            "channels": 3,
            "shifts": (-3, 0, 1),
        },
        {
            "micro_image_size": 3,
            "slices": 2,
            # The line ends with a micro image, in the first pixel of a token.
            "max_columns": 51,
            "pixels_per_clock": 2,
            "radius": 0,
            "confidence": 900,
            "vote_radius": 1,
        },
        {"micro_image_size": 4, "slices": 2, "max_columns": 45, "pixels_per_clock": 4},
    ]
    # Without the picture no pixel waits.
    alone: list[dict] = [
        {
            "micro_image_size": 5,
            "slices": 3,
            "max_columns": 62,
            "pixels_per_clock": 4,
            "channels": 3,
            "shifts": (-3, 0, 1),
            "picture": False,
        },
        {"micro_image_size": 3, "slices": 2, "max_columns": 22, "picture": False},
    ]
    # Each slice with a smaller box beside it, without votes and with them.
    small: list[dict] = [
        {"micro_image_size": 3, "slices": 3, "max_columns": 22, "confidence": 900, "radius": 0},
        {
            "micro_image_size": 4,
            "slices": 3,
            "max_columns": 45,
            "pixels_per_clock": 4,
            "channels": 3,
            "confidence": 9000,
            "shifts": (-3, 0, 1),
        },
        {
            "micro_image_size": 2,
            "slices": 2,
            "max_columns": 51,
            "pixels_per_clock": 2,
            "confidence": 600,
            "radius": 0,
            "vote_radius": 1,
        },
    ]
    small = [{**options, "sharp_too": True} for options in small]
    cases = [*drawn(cases, 1), *drawn([*several, *alone], 1), *drawn(small, 1), random_options(0)]
    votes = {"vote_radius": 1, "confidence": 600, "radius": 0}
    resets = {"micro_image_size": 2, "slices": 3, "max_columns": 28, **votes}
    run_cases([*map(index_case, cases), index_case(resets, resets=12)], long=True)


@pytest.mark.slow
def test_more_indices_and_pictures() -> None:
    run_indices(
        {"micro_image_size": 2, "slices": 3, "max_columns": 16},
        {"micro_image_size": 3, "slices": 2, "max_columns": 22, "channels": 3, "radius": 2},
        {"micro_image_size": 5, "slices": 5, "max_columns": 22, "channels": 3},
        {"micro_image_size": 4, "slices": 4, "max_columns": 25, "radius": 0, "pixel_bits": 16},
    )


@pytest.mark.slow
def test_several_pixels_a_clock() -> None:
    run_indices(
        {"micro_image_size": 9, "slices": 2, "max_columns": 118, "pixels_per_clock": 8},
        {"micro_image_size": 8, "slices": 1, "max_columns": 97, "pixels_per_clock": 8},
        {
            "micro_image_size": 2,
            "slices": 4,
            "max_columns": 71,
            "pixels_per_clock": 2,
            "channels": 3,
            "pixel_bits": 16,
            "confidence": 3000,
            "vote_radius": 2,
            "shifts": (4, 1, 0, -3),
        },
        {"micro_image_size": 7, "slices": 3, "max_columns": 60, "pixels_per_clock": 4, "radius": 2},
    )


def random_options(number: int) -> dict[str, Any]:
    rng = random.Random(draw_seed() + number)
    m = rng.choice([2, 2, 3, 4, 5, 6])
    pixels = rng.choice([p for p in (1, 1, 2, 4) if p <= m])
    radius = rng.randint(0, 3)
    slices = rng.randint(1, 6)
    shifts = sorted(rng.sample(range(-9, 10), slices)) if rng.random() < 0.5 else []
    options: dict[str, Any] = {
        "micro_image_size": m,
        "slices": slices,
        "shifts": tuple(shifts),
        "radius": radius,
        "vote_radius": rng.randint(0, 3),
        "confidence": rng.choice([0, 2000, 1 << rng.randint(10, 20)]),
        "channels": rng.choice([1, 1, 3]),
        "pixel_bits": rng.choice([8, 8, 16]),
        "pixels_per_clock": pixels,
        "sharp_too": rng.random() < 0.3,
    }
    # Lines that are taken without a pause, and shorter ones.
    shortest = DepthIndexConfiguration(**options, max_columns=1).band_steps(1)
    options["max_columns"] = max(2 * m, shortest * pixels) + rng.randint(0, 4 * m)
    print(options)
    return options


@pytest.mark.slow
@pytest.mark.parametrize("number", range(10))
def test_more_random_windows(number: int) -> None:
    run_indices(*(random_options(100 + 3 * number + n) for n in range(3)))
