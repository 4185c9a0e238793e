# SPDX-License-Identifier: Apache-2.0
"""Hunt of `resampler`: all generics, grids of all kinds, loads at any moment."""

import random
from typing import Any

ENTITY = "resampler"
FAULTS = [
    ("lens_registers.vhd", "writing <= other_than(newest_now, waiting_now, used_now);",
     "writing <= other_than(newest_now, newest_now, used_now);"),
    # A commit acts on a frame whose first pixel waits.
    ("lens_registers.vhd", "used_now := waiting;", "used_now := newest;"),
    ("lens_registers.vhd", "missing := missing or not written(i);", "null;"),
    ("raw_window.vhd", "mirrored(line_now + 1, frame", "mirrored(line_now, frame"),
    ("hexagonal_rows.vhd", "row_odd    <= not row_odd;", "row_odd    <= row_odd;"),
    # Only skewed grids show: sums of lines instead of rows; the raw lines of upright micro images
    # are waited for; pixels lie a raw pixel apart.
    ("lens_rows.vhd", "line_y <= y + signed(held(REGISTER_DOWN_EVEN_Y));",
     "line_y <= line_y + signed(held(REGISTER_LINE_Y));", 40),
    ("lens_rows.vhd", "whole(std_logic_vector(line_y));",
     "whole(std_logic_vector(y)) + line_index;", 40),
    ("lens_walk.vhd", "x + step_x;", "x + shift_left(to_signed(1, 32), BUILD.fraction_bits);", 9),
]  # fmt: skip


def draw_generics(rng: random.Random) -> dict[str, Any]:
    """Draw generics of a resampler for which there are grids."""
    from hunt.grids import draw_frame_size

    while True:
        generics = _draw(rng)
        if all(draw_frame_size(rng, generics) for _ in range(3)):
            return generics


def _draw(rng: random.Random) -> dict[str, Any]:
    m = rng.choice([1, 2, 2, 3, 3, 4, 5])
    gains, moves, layout = rng.random() < 0.3, rng.random() < 0.3, rng.random()
    return {
        "MICRO_IMAGE_SIZE": m,
        "HEXAGONAL": layout < 0.35,
        "SKEWED": 0.35 <= layout < 0.65,
        "MAX_COLUMNS": rng.randint(2, 4 * m + 10),
        "LINES": 2 * rng.choice([2, rng.randint(2, 12), rng.randint(m + 2, m + 8)]),
        "LENSES": rng.choice([40, 64, 100]) if moves or gains else 2,
        "MOVES": moves,
        "GAINS": gains,
        "CHANNELS": rng.choice([1, 1, 3]),
        "PIXEL_BITS": rng.randint(1, 16),
        "FRACTION_BITS": rng.randint(8, 17),
        "WEIGHT_BITS": rng.randint(2, 8),
        "GUARD_BITS": rng.randint(1, 3),
        "GAIN_BITS": rng.randint(4, 14),
    }


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": draw_generics(rng)}


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.sensors import SensorHunt

    await SensorHunt(bench, rng).run()
