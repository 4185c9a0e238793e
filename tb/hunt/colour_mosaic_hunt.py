# SPDX-License-Identifier: Apache-2.0
"""Hunt of `colour_mosaic`."""

import random
from typing import Any

import numpy as np

from hunt.references.colour_mosaic import colours

ENTITY = "colour_mosaic"
FAULTS = [
    ("mosaic_engine.vhd", "right := centre;", "null;"),
    ("mosaic_engine.vhd", "now.above := now.middle;", "null;"),
    ("mosaic_engine.vhd", "if token_2.pixel = '1' and token_2.line_first = '1' then",
     "if token_2.line_first = '1' then"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {"MAX_COLUMNS": rng.randint(2, 20), "PIXEL_BITS": rng.randint(1, 16)}}


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.cores import CoreHunt, pack

    g = bench.design["generics"]
    red = rng.randrange(4)
    bench.set(red_place=red)

    def words(raw: np.ndarray, g: dict[str, Any], slice_: int) -> list[list[int]]:
        return pack(colours(raw[:, :, 0], *divmod(red, 2)), g["PIXEL_BITS"])

    def size(rng: random.Random) -> tuple[int, int]:
        most = g["MAX_COLUMNS"]
        return rng.choice([1, 2, rng.randint(1, most), most]), rng.choice([1, 2, rng.randint(1, 9)])

    await CoreHunt(
        bench,
        rng,
        words,
        size=size,
        channels=1,
        bits=g["PIXEL_BITS"],
        pixels=1,
        slices=0,
        held=2,
        limit=lambda columns, rows: (rows + 4) * (columns + 8) + 100,
    ).run()
