# SPDX-License-Identifier: Apache-2.0
"""Calibrations for a resampler: random grids, and sizes of frames that they fit."""

import random
from typing import Any

import numpy as np

from hunt.references.resampler import first_lines, lines_needed

Grid = dict[str, Any]


def draw_grid(rng: random.Random, g: dict[str, Any], rows: int, columns: int) -> Grid | None:
    """A random grid with all lens centres inside the frame; None if there are others."""
    m, one, hexagonal = g["MICRO_IMAGE_SIZE"], 1 << g["FRACTION_BITS"], g["HEXAGONAL"]

    def fixed(value: float) -> int:
        return round(value * one)

    pitch_y, pitch_x = (max(m + rng.choice([0, rng.uniform(-0.9, 2)]), 1) for _ in range(2))
    tilt = rng.choice([0, rng.uniform(-0.3, 0.3), rng.uniform(-1.2, 1.2)])
    lean = rng.choice([0, rng.uniform(-0.5, 0.5)])
    origin = [rng.uniform(-m / 2, 1.5) for _ in range(2)]
    if tilt < 0:
        origin[0] += -tilt * rng.uniform(0, columns / pitch_x)
    half = [rng.choice([1, -1]) * pitch_x / 2 * hexagonal, tilt / 2 * hexagonal]
    most_rows = int((rows - m / 2 - origin[0]) / pitch_y) + 1
    most_lenses = int((columns - m / 2 - origin[1]) / pitch_x) + 1
    if most_rows < 1 or most_lenses < 1 + hexagonal:
        return None
    grid: Grid = {
        "lenses": (rng.choice([most_rows, rng.randint(1, most_rows)]), most_lenses),
        "origin": tuple(map(fixed, origin)),
        "right": (fixed(tilt), fixed(pitch_x)),
        "down": tuple(
            (fixed(pitch_y + sign * half[1]), fixed(lean + sign * half[0])) for sign in (1, -1)
        ),
        "black": rng.choice([0, 0, rng.getrandbits(g["PIXEL_BITS"] + g["GUARD_BITS"])]) // 4,
        "outputs": most_lenses,
        "place": (0, 0),
        "step": 0,
    }
    count, lenses = grid["lenses"]
    draw = np.random.default_rng(rng.getrandbits(32))
    if g["MOVES"]:
        most = 1 << g["WEIGHT_BITS"]
        grid["moves"] = draw.integers(-most, most, (count, lenses, 2), endpoint=True)
    if g["GAINS"]:
        most = 1 << g["GAIN_BITS"]
        spread = rng.choice([2, 16])
        grid["gains"] = draw.integers(0, spread * most, (count, lenses))
        grid["profile"] = draw.integers(0, rng.choice([2, 16]) * most, (m, m))
        if count * lenses > g["LENSES"]:
            return None
    if g["MOVES"] and count * lenses > g["LENSES"]:
        return None
    if hexagonal and not _place(grid, rng, one):
        return None
    places = first_lines(grid, g)[0] >> g["WEIGHT_BITS"]
    for axis, size in enumerate((rows, columns)):
        first, last = int(places[..., axis].min()), int(places[..., axis].max())
        if first < -(m // 2) - 1 or last + m // 2 > size:
            return None
        if first < 1 - size or last + m > 2 * (size - 1):
            return None
    return grid


def _place(grid: Grid, rng: random.Random, one: int) -> bool:
    """Draw positions between lenses, for all lenses of a row."""
    lenses = grid["lenses"][1]
    grid["step"] = rng.randint(one * 2 // 3, one * 6 // 5)
    grid["place"] = tuple(rng.randrange(one) for _ in range(2))
    grid["outputs"] = ((lenses - 1) * one - 1 - max(grid["place"])) // grid["step"] + 1
    return grid["outputs"] >= 1


def limits(grid: Grid, g: dict[str, Any], rows: int, lines: int) -> tuple[int, int]:
    """Least and most lines of the raster from the first `lines` of `rows`.

    The entity rounds the distance of rows of lenses up, so it may refuse a grid that the ring could
    hold.
    """
    needed, oldest = lines_needed(grid, g, rows)
    first, second = (down[0] >> g["FRACTION_BITS"] for down in grid["down"])
    spare = 4 + abs(first - second)
    ring = g["LINES"]
    there = needed < lines
    least = there & (needed - np.maximum(oldest - spare, 0) < ring)
    most = there & (needed - oldest < ring)
    return tuple(int(np.logical_and.accumulate(n).sum()) for n in (least, most))


def grid_for(
    rng: random.Random, g: dict[str, Any], rows: int, columns: int, *, tall: bool = False
) -> Grid | None:
    """Draw a grid for a frame that fits the ring, or one that needs more lines."""
    for _ in range(40):
        grid = draw_grid(rng, g, rows, columns)
        if grid:
            lines = grid["lenses"][0] * g["MICRO_IMAGE_SIZE"]
            least, most = limits(grid, g, rows, rows)
            if (most < lines) if tall else (least == lines):
                return grid
    return None


def draw_frame_size(
    rng: random.Random, g: dict[str, Any], tries: int = 50
) -> tuple[int, int, Grid] | None:
    """Draw rows and columns of frames, and a grid for them; None if no grid was found."""
    m, most = g["MICRO_IMAGE_SIZE"], g["MAX_COLUMNS"]
    for _ in range(tries):
        rows = rng.choice([rng.randint(2, 3 * m + 6), rng.randint(2, 26), 2])
        columns = rng.choice([most, most, rng.randint(2, most)])
        if grid := grid_for(rng, g, rows, columns):
            return rows, columns, grid
    return None
