# SPDX-License-Identifier: Apache-2.0
"""Hunt of `focal_stack`."""

import random
from typing import Any

import numpy as np

from hunt.raster_refocuser_hunt import delay, draw_box
from hunt.references.focal_stack import stack

ENTITY = "focal_stack"
FAULTS = [
    ("focal_stack_pkg.vhd", "plan.keeps_modulus := true;", "plan.keeps_modulus := false;"),
    ("stack_columns.vhd", "entering_age(GEOMETRY, slice, v)", "entering_age(GEOMETRY, 0, v)"),
    # Lines of one pixel.
    ("focal_stack_pkg.vhd", "plan.row_tokens + 1);", "1);", 209853),
    ("border_weights.vhd", "choose(SLICES > 1, s, - 1)", "choose(SLICES > 1, 0, - 1)"),
    ("stack_array.vhd", "FIXED_SLICE => s,", "FIXED_SLICE => choose(P > 1, 0, s),"),
]


def draw(rng: random.Random) -> dict[str, Any]:
    m = rng.choice([1, 2, 2, 3, 3, 4, 5])
    shifts = [rng.randint(-m - 1, m + 2) for _ in range(rng.choice([1, 2, 2, 3, 4]))]
    generics = {
        "MICRO_IMAGE_SIZE": m,
        "SHIFTS": " ".join(map(str, shifts)),
        "BOX": draw_box(rng, m, shifts, one=False),
        "CENTRED": rng.random() < 0.8,
        "MAX_COLUMNS": rng.randint(1, 3 * m + 8),
        "CHANNELS": rng.choice([1, 1, 3]),
        "PIXEL_BITS": rng.randint(1, 16),
        "INPUT_LINES": rng.choice([1, m]),
        "FLUSH": rng.random() < 0.8,
        "BORDER_NORMALISED": rng.random() < 0.3,
        "CHOSEN_TOO": rng.random() < 0.5,
    }
    pixels = 1 if generics["BORDER_NORMALISED"] else rng.choice([1, 1, 2, 4, 8])
    generics["PIXELS_PER_CLOCK"] = pixels
    generics["MAX_COLUMNS"] += rng.choice([0, 1, 2]) * (pixels - 1)
    return {"generics": generics}


def _words(raw: np.ndarray, g: dict[str, Any], slice_: int) -> list[list[int]]:
    from hunt.cores import pack

    return pack(stack(raw, g), g["PIXEL_BITS"], g["PIXELS_PER_CLOCK"])


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.cores import CoreHunt

    g = bench.design["generics"]
    m = g["MICRO_IMAGE_SIZE"]
    held = delay({**g, "INTERPOLATION_ORDER": 0}) + 2 * m

    def limit(columns: int, rows: int) -> int:
        return (rows + 2 * held) * (columns + held + 16) + 300

    def size(rng: random.Random) -> tuple[int, int]:
        most = g["MAX_COLUMNS"]
        rows = rng.choice([rng.randint(1, 3), rng.randint(1, 2 * m + 4), m, 2 * m])
        return rng.choice([rng.randint(1, most), most]), rows

    await CoreHunt(
        bench,
        rng,
        _words,
        size=size,
        channels=g["CHANNELS"],
        bits=g["PIXEL_BITS"],
        pixels=g["PIXELS_PER_CLOCK"],
        slices=len(g["SHIFTS"].split()) if g["CHOSEN_TOO"] else 0,
        limit=limit,
        held=held,
        flush=g["FLUSH"],
    ).run()
