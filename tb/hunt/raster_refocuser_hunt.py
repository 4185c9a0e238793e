# SPDX-License-Identifier: Apache-2.0
"""Hunt of `raster_refocuser`: both engines, all generics."""

import math
import random
from typing import Any

import numpy as np

from hunt.references.raster_refocuser import refocused

ENTITY = "raster_refocuser"
FAULTS = [
    ("frame_sequencer.vhd", "to_logic(step.frame.rows_left = 1);",
     "to_logic(step.frame.rows_left = 2);"),
    # A complete frame does not come out if stray pixels follow.
    ("frame_sequencer.vhd", "elsif s_axis_tvalid = '0' or stray = '1' then",
     "elsif s_axis_tvalid = '0' or (stray = '1' and excess = '0') then"),
    ("slice_select.vhd", "LAST when unsigned(slice) >= SLICES",
     "LAST when unsigned(slice) > SLICES"),
    # The slice behind the input FIFO, late by what waits there.
    ("stream_shell.vhd", "resize(unsigned(slice_out), slice_t'length)",
     "resize(slice_in, slice_t'length)"),
    # A mark of start that lasts two pixels begins two frames.
    ("frame_sequencer.vhd", "s_axis_tuser and not state.start_lasts;", "s_axis_tuser;"),
    # As if all views reached every line.
    ("border_weights.vhd", "row_down(0)  <= down(PASSES)", "row_down(0)  <= down(0)"),
    # Halves of an even M are rounded down.
    ("divide_round.vhd", "HALF           : natural  := DIVISOR / 2;",
     "HALF           : natural  := (DIVISOR - 1) / 2;"),
    ("divide_weighted.vhd", "if unsigned(weight) = 0 then", "if unsigned(weight) = 1 then"),
    # The box of slice 0 for all.
    ("sum_tail.vhd", "CORE.geometry.boxes(s) ** (2", "CORE.geometry.boxes(0) ** (2"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    while True:
        generics = _draw(rng)
        if work(generics) < 9000:
            return {"generics": generics}


def draw_box(rng: random.Random, m: int, shifts: list[int], *, one: bool) -> str:
    """Text of BOX: none, one number for all slices, or one for each."""
    steps = [math.gcd(shift, m) for shift in shifts]
    shared = [box for box in range(1, m + 1) if not any(box % step for step in steps)]
    kind = rng.choice(["none", "all", "all" if one else "each"])
    if kind == "each":
        return " ".join(str(step * rng.randint(1, m // step)) for step in steps)
    return "" if kind == "none" else str(rng.choice(shared))


def _draw(rng: random.Random) -> dict[str, Any]:
    m = rng.choice([1, 2, 2, 3, 3, 4, 5, 6, 7])
    engine = rng.choice(["fir", "moving_sum", "moving_sum"])
    exact = rng.random() < 0.7
    order = rng.choice([0, 0, 0, 1, 2, 3])
    hold = engine == "fir" and rng.random() < 0.2
    step = m * (1 + (m % 2 == 0)) if hold else 1
    shifts = [step * rng.randint(-2 * m // step, (2 * m + 3) // step) for _ in range(4)]
    shifts = shifts[: rng.choice([1, 1, 2, 4])]
    pixels = rng.choice([1, 1, 2, 4, 8, 16, 32]) if engine == "moving_sum" and exact else 1
    parallel = rng.choice([1, 1, 2, 3, 5, m]) if engine == "fir" else 1
    sharpening = ""
    if exact and parallel == 1 and rng.random() < 0.3:
        sharpening = " ".join(str(rng.choice([0, 1, 4, 16])) for _ in shifts)
    sharpens = any(map(int, sharpening.split()))
    plain = exact and parallel == 1 and not sharpens
    box = draw_box(rng, m, shifts, one=not exact or sharpens)
    guard = 0 if exact else rng.randint(0, 4)
    return {
        "MICRO_IMAGE_SIZE": m,
        "SHIFTS": " ".join(map(str, shifts)),
        "CENTRED": rng.random() < 0.8,
        "INTERPOLATION_ORDER": order,
        "HOLD": hold,
        "PARALLEL_ROWS": parallel,
        "PIXELS_PER_CLOCK": pixels,
        # A core of moving sums cannot have lines of one pixel.
        "MAX_COLUMNS": rng.randint(1 + (engine == "moving_sum"), 3 * m + 8 + 2 * pixels),
        "CHANNELS": rng.choice([1, 1, 3]),
        "PIXEL_BITS": rng.randint(1, 16) if exact else rng.randint(1, 12 - guard),
        "EXACT": exact,
        "FRACTION_BITS": 0 if exact else rng.randint(guard, 10),
        "GUARD_BITS": guard,
        "ENGINE": engine,
        "ANY_ROWS": engine == "moving_sum" and rng.random() < 0.5,
        "SHARPENING": sharpening,
        "BOX": box,
        "BORDER_NORMALISED": plain and rng.random() < 0.3,
        "BROADCAST_TAPS": rng.choice([0, 0, 1, 3]) if engine == "fir" else 0,
    }


def delay(g: dict[str, Any]) -> int:
    """Upper bound of the lines that a core holds back."""
    m = g["MICRO_IMAGE_SIZE"]
    largest = max(abs(int(shift)) for shift in g["SHIFTS"].split())
    return (m - 1) * (largest + 1 + g["INTERPOLATION_ORDER"]) + 2 * m


def work(g: dict[str, Any]) -> int:
    """Estimated work of the simulator for a frame."""
    lanes = g["CHANNELS"] * g["PARALLEL_ROWS"] * g["PIXELS_PER_CLOCK"]
    each = delay(g) if g["ENGINE"] == "fir" else 8
    tokens = g["MAX_COLUMNS"] / g["PIXELS_PER_CLOCK"] + 4
    return int(tokens * (delay(g) + g["MICRO_IMAGE_SIZE"]) * each * lanes)


def words(raw: np.ndarray, g: dict[str, Any], slice_: int) -> list[list[int]]:
    from hunt.cores import pack

    return pack(refocused(raw, g, slice_), g["PIXEL_BITS"], g["PIXELS_PER_CLOCK"])


def sizes(g: dict[str, Any], held: int) -> dict[str, Any]:
    """How sizes of frames are drawn, and the clocks in which a frame's lines come out."""

    def limit(columns: int, rows: int) -> int:
        return (rows + 2 * held) * (columns + held + 16) + 300

    def size(rng: random.Random) -> tuple[int, int]:
        m, most = g["MICRO_IMAGE_SIZE"], g["MAX_COLUMNS"]
        rows = rng.choice([rng.randint(1, 3), rng.randint(1, 2 * m + 4), m, 2 * m])
        return rng.choice([rng.randint(1, most), most, most]), rows

    return {"limit": limit, "size": size}


async def stream(bench: Any, rng: random.Random) -> None:
    from hunt.cores import CoreHunt

    g = bench.design["generics"]
    held = delay(g) + g["PARALLEL_ROWS"]
    await CoreHunt(
        bench,
        rng,
        words,
        channels=g["CHANNELS"],
        bits=g["PIXEL_BITS"],
        pixels=g["PIXELS_PER_CLOCK"],
        slices=len(g["SHIFTS"].split()),
        held=held,
        **sizes(g, held),
    ).run()
