# SPDX-License-Identifier: Apache-2.0
"""Calibrations for a resampler: random grids, and sizes of frames that they fit."""

import random
from collections.abc import Sequence
from typing import Any

import numpy as np

from hunt.references.resampler import lines_needed, positions

Grid = dict[str, Any]


def draw_grid(
    rng: random.Random, g: dict[str, Any], rows: int, columns: int, *, tall: bool = False
) -> Grid | None:
    """A random grid; None if it is no good.

    The centres of all lenses lie inside the frame. In skewed grids lenses may lie beside the frame,
    and those without a gain above and below it too; not with `tall`, for grids that are refused.
    """
    m, one, skewed = g["MICRO_IMAGE_SIZE"], 1 << g["FRACTION_BITS"], g["SKEWED"]
    grid = (_skewed if skewed else _upright)(rng, g, rows, columns)
    if grid is None:
        return None
    grid["black"] = rng.choice([0, 0, rng.getrandbits(g["PIXEL_BITS"] + g["GUARD_BITS"])]) // 4
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
    if g["HEXAGONAL"] and not _place(grid, rng, one):
        return None
    y, x = (place >> g["WEIGHT_BITS"] for place in positions(grid, g)[:2])
    # A position is mirrored once.
    for place, size in ((y, rows), (x, columns)):
        if place.min() < 1 - size or place.max() + 1 > 2 * (size - 1):
            return None
    if not skewed:
        return grid if _inside(y, rows, m) and _inside(x, columns, m) else None
    if g["GAINS"] and not tall:
        whole = (y >= 0) & (y < rows - 1) & ((x >= 0) & (x < columns - 1)).all(axis=-1)
        if rng.random() < 0.7:
            grid["gains"] *= whole.all(axis=1)
        y = y.swapaxes(1, 2)[grid["gains"] > 0]
    height = grid["line"][0] * (m - 1) // one + 1
    return grid if y.size and _inside(y, rows, height) else None


def _inside(places: np.ndarray, size: int, height: int) -> bool:
    """Whether micro images of a height, of which these are all lines, have their middles inside."""
    return bool(places.min() >= -(height // 2) - 1 and places.max() < size + height - height // 2)


def _upright(rng: random.Random, g: dict[str, Any], rows: int, columns: int) -> Grid | None:
    """Lenses of a rectangular or hexagonal grid."""
    m, one, hexagonal = g["MICRO_IMAGE_SIZE"], 1 << g["FRACTION_BITS"], g["HEXAGONAL"]
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
    down = [(pitch_y + sign * half[1], lean + sign * half[0]) for sign in (1, -1)]
    return {
        "lenses": (rng.choice([most_rows, rng.randint(1, most_rows)]), most_lenses),
        "origin": _fixed(origin, one),
        "right": _fixed((tilt, pitch_x), one),
        "down": tuple(_fixed(step, one) for step in down),
        "outputs": most_lenses,
        "place": (0, 0),
        "step": 0,
    }


def _skewed(rng: random.Random, g: dict[str, Any], rows: int, columns: int) -> Grid | None:
    """Lenses whose columns lean, at any distance; about M samples lead from a lens to the next.

    The rows of lenses begin beside each other, so some of them begin or end beside the frame.
    """
    m, one = g["MICRO_IMAGE_SIZE"], 1 << g["FRACTION_BITS"]
    pitch_y, pitch_x = (max(m * rng.choice([1, rng.uniform(0.5, 2.5)]), 1) for _ in range(2))
    tilt = rng.choice([0, rng.uniform(-0.3, 0.3), rng.uniform(-1.2, 1.2)])
    lean = pitch_x * rng.choice([0, 0.5, -0.5, rng.uniform(-1, 1)])
    height, width = (pitch * (m - 1) / m for pitch in (pitch_y, pitch_x))
    most_rows = int((rows - 1) / pitch_y) + 1
    count = rng.choice([most_rows, rng.randint(1, most_rows)])
    left = rng.uniform(rng.choice([-width / 2, 1 - columns]), 1.5)
    right = rng.choice([columns - width / 2, 2 * columns - 3 - width])
    lenses = int((right - left - abs(count * lean)) / pitch_x) + 1
    if lenses < 1:
        return None
    # Lenses have their middles on the first line, on the last line, or anywhere between.
    rise = tilt * (lenses - 1)
    highest = -height / 2 - min(rise, 0)
    lowest = rows - 1 - height / 2 - (count - 1) * pitch_y - max(rise, 0)
    anywhere = rng.uniform(highest, lowest)
    top = rng.choice([highest + rng.random(), lowest - rng.random(), anywhere])
    down = _fixed((pitch_y, lean), one)
    across = _fixed((tilt, pitch_x), one)
    # M lines lead to the next row of lenses, or not quite to it; pixels may end anywhere.
    share = rng.choice([1, 1, rng.uniform(0.7, 1)])
    line_y, line_x = (round(step * share / m) for step in down)
    return {
        "lenses": (count, lenses),
        "origin": _fixed((top, left - min(count * lean, 0)), one),
        "right": across,
        "down": (down, down),
        "outputs": lenses,
        "line": (line_y, line_x),
        "pixel": round(across[1] * rng.choice([1, 1, rng.uniform(0.7, 1.3)]) / m),
    }


def _fixed(vector: Sequence[float], one: int) -> tuple[int, ...]:
    return tuple(round(value * one) for value in vector)


def _place(grid: Grid, rng: random.Random, one: int) -> bool:
    """Draw positions between lenses, for all lenses of a row."""
    lenses = grid["lenses"][1]
    grid["step"] = rng.randint(one * 2 // 3, one * 6 // 5)
    grid["place"] = tuple(rng.randrange(one) for _ in range(2))
    grid["outputs"] = ((lenses - 1) * one - 1 - max(grid["place"])) // grid["step"] + 1
    return grid["outputs"] >= 1


def limits(grid: Grid, g: dict[str, Any], rows: int, lines: int) -> tuple[int, int]:
    """Least and most lines of the raster from the first `lines` of `rows`.

    The entity rounds the distance of rows of lenses up, and takes the last line of skewed micro
    images to be as low as the next row, so it may refuse a grid that the ring could hold.
    """
    needed, oldest = lines_needed(grid, g, rows)
    first, second = (down[0] >> g["FRACTION_BITS"] for down in grid["down"])
    spare = 4 + abs(first - second)
    if g["SKEWED"]:
        height = grid["line"][0] * (g["MICRO_IMAGE_SIZE"] - 1)
        spare += (grid["down"][0][0] - height >> g["FRACTION_BITS"]) + 1
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
        grid = draw_grid(rng, g, rows, columns, tall=tall)
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
