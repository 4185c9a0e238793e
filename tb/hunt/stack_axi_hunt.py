# SPDX-License-Identifier: Apache-2.0
"""Hunt of `stack_axi`, also with a depth index: streams, and a rude master at its registers."""

import random
from typing import Any

import numpy as np

from hunt import focal_stack_hunt, raster_refocuser_hunt
from hunt.raster_refocuser_hunt import draw_box
from hunt.references import depth_index
from hunt.references.focal_stack import stack

ENTITY = "stack_axi"
FAULTS = [
    # An event in the clock of its clearing write is lost.
    ("event_registers.vhd", "(held_happened and not clear_happened) or new_happened;",
     "(held_happened or new_happened) and not clear_happened;"),
    # A bus of 64 bits reads two words, also where one of them can only be written.
    ("refocuser_registers.vhd", "if read_place = i and PAIRED(i) = '1' then",
     "if read_place = i and READS(i) = '1' then"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    g = focal_stack_hunt.draw(rng)["generics"]
    del g["FLUSH"], g["CHOSEN_TOO"]
    g["DEPTH_INDEX"] = g["MICRO_IMAGE_SIZE"] > 1 and rng.random() < 0.5
    if g["DEPTH_INDEX"]:
        g["PIXELS_PER_CLOCK"] = min(g["PIXELS_PER_CLOCK"], g["MICRO_IMAGE_SIZE"] // 2 * 2, 2)
    g["PIXELS_PER_CLOCK"] = max(g["PIXELS_PER_CLOCK"], 1)
    g["RADIUS"], g["VOTE_RADIUS"] = rng.randint(0, 1), rng.choice([0, 0, 1])
    g["CONFIDENCE"] = rng.choice([0, 1, 1000])
    g["SHARP_TOO"] = g["DEPTH_INDEX"] and rng.random() < 0.4
    if g["SHARP_TOO"]:
        m, shifts = g["MICRO_IMAGE_SIZE"], [s for s in g["SHIFTS"].split() for _ in range(2)]
        g["SHIFTS"] = " ".join(shifts)
        g["BOX"] = draw_box(rng, m, [int(s) for s in shifts], one=False)
    return {"generics": g}


def words(raw: np.ndarray, g: dict[str, Any], slice_: int) -> list[list[int]]:
    from hunt.cores import pack

    slices = stack(raw, g)
    if not g["DEPTH_INDEX"]:
        return pack(slices, g["PIXEL_BITS"], g["PIXELS_PER_CLOCK"])
    count = len(g["SHIFTS"].split()) // (1 + g["SHARP_TOO"])
    own = {**g, "SLICES": count, "SHIFTS": "", "PICTURE": True, "CHOSEN_TOO": False}
    return depth_index.words(slices, own, 0)


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.axi_cores import AxiHunt

    g = bench.design["generics"]
    m = g["MICRO_IMAGE_SIZE"]
    held = raster_refocuser_hunt.delay({**g, "INTERPOLATION_ORDER": 0}) + 2 * m
    held += (g["RADIUS"] + g["VOTE_RADIUS"] + 3) * m * g["DEPTH_INDEX"]
    await AxiHunt(
        bench,
        rng,
        words,
        {"stack", *(["depth_index"] if g["DEPTH_INDEX"] else [])},
        channels=g["CHANNELS"],
        bits=g["PIXEL_BITS"],
        pixels=g["PIXELS_PER_CLOCK"],
        slices=0,
        held=held,
        **raster_refocuser_hunt.sizes(g, held + 20 * g["DEPTH_INDEX"]),
    ).run()
