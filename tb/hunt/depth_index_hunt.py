# SPDX-License-Identifier: Apache-2.0
"""Hunt of `depth_index`, without and with votes."""

import random
from typing import Any

from hunt.references.depth_index import words

ENTITY = "depth_index"
FAULTS = [
    ("sharpest_slice.vhd", "if value > most_of(s - 1) then", "if value >= most_of(s - 1) then"),
    # The ring's line is not reset.
    ("sharpest_pixels.vhd", "if reset = '1' then\n        ring_line",
     "if false then\n        ring_line"),
    ("index_vote.vhd", "if middle_at(FINAL)(0) = '1' then", "if false then", 13),
    ("depth_fraction.vhd", "WEIGHT_BEHIND(to_integer(index_1))",
     "WEIGHT_BEFORE(to_integer(index_1))"),
    # Several pixels a clock: a token that begins and ends a line's last micro image.
    ("lens_place.vhd", "place.tail      <= token_1.line_last and any;", "place.tail      <= '0';",
     20),
    ("sharpest_pixels.vhd", "index_kept when first_at(IN_FRONT + 3)(j) = '1'",
     "index_kept when false", 9),
    # The chosen slice's smaller box, also where another slice is sharper.
    ("sharpest_pixels.vhd", "if BOX_BITS > 0 and sharpest = wanted + 1 then", "if false then", 1),
    ("sharpness_index.vhd", "final_textured <= has_texture(most, least, BUILD.confidence);",
     "final_textured <= '1';", 26),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    m = rng.choice([2, 2, 3, 4, 5])
    slices, radius, vote_radius = rng.randint(1, 4), rng.randint(0, 2), rng.choice([0, 0, 1, 2, 4])
    channels, bits = rng.choice([1, 1, 3]), rng.randint(1, 12)
    scale = m * m * ((1 << bits) - 1)
    generics = {
        "MICRO_IMAGE_SIZE": m,
        "SLICES": slices,
        "RADIUS": radius,
        "CONFIDENCE": rng.choice([0, 1, scale, rng.randint(0, 4 * scale), (1 << 30) - 1]),
        "VOTE_RADIUS": vote_radius,
        "MAX_COLUMNS": rng.randint(1, 5 * m + 2),
        "CHANNELS": channels,
        "PIXEL_BITS": bits,
        "CHOSEN_TOO": rng.random() < 0.4,
        "SHIFTS": "",
    }
    if rng.random() < 0.5:
        generics["SLICES"] = slices = rng.choice([1, 2, 3, 3, 4, 5])
        shifts = sorted(rng.sample(range(-3 * m, 3 * m + 1), slices))
        if rng.random() < 0.5:
            shifts.reverse()
        generics["SHIFTS"] = " ".join(map(str, shifts))
    generics["PIXELS_PER_CLOCK"] = pixels = rng.choice([p for p in (1, 1, 2, 4) if p <= m])
    generics["MAX_COLUMNS"] += rng.choice([0, 3 * m]) * (pixels - 1)
    generics["PICTURE"] = generics["CHOSEN_TOO"] or rng.random() < 0.7
    generics["SHARP_TOO"] = generics["PICTURE"] and rng.random() < 0.3
    return {"generics": generics}


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.cores import CoreHunt

    g = bench.design["generics"]
    m = g["MICRO_IMAGE_SIZE"]
    held = (g["RADIUS"] + g["VOTE_RADIUS"] + 3) * m
    # The clocks of a scan with its votes.
    scan = 60 + 4 * (g["SLICES"] + g["RADIUS"] + g["VOTE_RADIUS"])

    def limit(columns: int, rows: int) -> int:
        return (rows + 2 * held) * (columns + scan) + 300

    def size(rng: random.Random) -> tuple[int, int]:
        most = g["MAX_COLUMNS"]
        rows = rng.choice([rng.randint(1, 3), rng.randint(1, 3 * m), m, 2 * m, 4 * m])
        return rng.choice([rng.randint(1, most), most]), rows

    await CoreHunt(
        bench,
        rng,
        words,
        size=size,
        channels=(1 + g["SHARP_TOO"]) * g["SLICES"] * g["CHANNELS"],
        bits=g["PIXEL_BITS"],
        pixels=g["PIXELS_PER_CLOCK"],
        slices=g["SLICES"] if g["CHOSEN_TOO"] else 0,
        limit=limit,
        held=held,
        stable=("picture_rows",),
    ).run()
