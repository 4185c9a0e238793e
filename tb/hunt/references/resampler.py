# SPDX-License-Identifier: Apache-2.0
"""Reference of `resampler`, from docs/resampling.md and the equations in its parts' headers.

Pixel (v, u) of lens (t, s) lies at origin + down(0) + ... + down(t - 1) + s right + (v, u), in
2**-FRACTION_BITS pixels; its first WEIGHT_BITS are used. With SKEWED it lies v `line` + (0, u
`pixel`) from its lens's first pixel, not (v, u). A grid is a dictionary of the registers (vectors
are (y, x)) with `black`, and `moves` (t, s, 2), `gains` (t, s), `profile` (M, M) if the generics
`g` have them.
"""

import numpy as np

LARGEST_GAIN = 10


def round_off(x: np.ndarray, bits: int) -> np.ndarray:
    """X / 2**bits, halves up."""
    return (x + (1 << bits >> 1)) >> bits


def positions(grid: dict, g: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where pixels lie in 2**-WEIGHT_BITS: y (t, v, s), and x (t, v, s, u).

    And the integer line (t, v) of each row's first lens.
    """
    (rows, lenses), bits = grid["lenses"], g["FRACTION_BITS"]
    one, v = 1 << bits, np.arange(g["MICRO_IMAGE_SIZE"])
    line, pixel = (grid["line"], grid["pixel"]) if g["SKEWED"] else ((one, 0), one)
    steps = np.array([(0, 0)] + [grid["down"][t % 2] for t in range(rows - 1)]).cumsum(axis=0)
    at = np.array(grid["origin"]) + steps[:, None] + np.arange(lenses)[:, None] * grid["right"]
    y, x = (at[:, None, :, n] + v[:, None] * line[n] for n in (0, 1))
    first, cut = y[:, :, 0] >> bits, bits - g["WEIGHT_BITS"]
    y, x = y >> cut, (x[..., None] + v * pixel) >> cut
    if g["MOVES"]:
        move = grid["moves"][:, None]
        y, x = y + move[..., 0], x + move[..., 1, None]
    return y, x, first


def reach(grid: dict, g: dict) -> tuple[int, int]:
    """Lines from the first lens of a row to the highest and the lowest one, in any of its lines."""
    y, _, first = positions(grid, g)
    apart = (y >> g["WEIGHT_BITS"]) - first[..., None]
    return int(apart.min()), int(apart.max())


def lines_needed(grid: dict, g: dict, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """The last raw line that each line of the raster needs, and the first one kept for it."""
    (up, down), last = reach(grid, g), rows - 1
    line = positions(grid, g)[2].ravel()
    span = line[:, None] + np.arange(up, down + 2)
    # A lens as low as the lowest of another row could lie beyond the mirrored frame: there is none.
    raw = np.maximum(last - np.abs(last - np.abs(span)), 0)
    oldest = np.minimum.accumulate(raw.min(axis=1)[::-1])[::-1]
    return np.minimum(np.maximum(line + 1 + down, -(line + up)), last), oldest


def raster(raw: np.ndarray, grid: dict, g: dict) -> np.ndarray:
    """Micro images (lines, columns, channels) of a raw frame (rows, columns, channels)."""
    m, w, guard, b = (g[n] for n in ("MICRO_IMAGE_SIZE", "WEIGHT_BITS", "GUARD_BITS", "GAIN_BITS"))
    y, x, _ = positions(grid, g)
    # Line and column of each pixel, and its weights: (t, v, s, u) and channels.
    whole = [(y >> w)[..., None], x >> w]
    fy, fx = ((place & ((1 << w) - 1))[..., None] for place in (y[..., None], x))
    last = np.array(raw.shape[:2]) - 1

    def pixel(dy: int, dx: int) -> np.ndarray:
        near = [np.abs(place + d) for place, d in zip(whole, (dy, dx), strict=True)]
        line, column = (end - np.abs(end - n) for end, n in zip(last, near, strict=True))
        return raw[line, column].astype(np.int64)

    one = 1 << w
    above = (one - fx) * pixel(0, 0) + fx * pixel(0, 1)
    below = (one - fx) * pixel(1, 0) + fx * pixel(1, 1)
    sample = round_off((one - fy) * above + fy * below, 2 * w - guard)
    value = np.maximum(sample - grid["black"], 0)
    if g["GAINS"]:
        gain = round_off(grid["gains"][:, None, :, None] * grid["profile"][:, None, :], b)
        value = round_off(value * np.minimum(gain, LARGEST_GAIN << b)[..., None], b)
    if g["HEXAGONAL"]:
        bits = g["FRACTION_BITS"]
        place = np.array(grid["place"])[:, None] + np.arange(grid["outputs"]) * grid["step"]
        place = place[np.arange(len(value)) % 2]
        lens = (place >> bits)[:, None, :, None, None]
        weight = (place >> (bits - w) & (one - 1))[:, None, :, None, None]
        left, right = (np.take_along_axis(value, lens + n, axis=2) for n in (0, 1))
        value = round_off((one - weight) * left + weight * right, w + guard)
    else:
        value = round_off(value, guard)
    value = np.minimum(value, (1 << g["PIXEL_BITS"]) - 1)
    return value.reshape(value.shape[0] * m, -1, raw.shape[2])


def words(grid: dict, g: dict) -> tuple[list[tuple[int, int, int]], list[tuple[int, int, int]]]:
    """(kind, address, word) for the load port: of the tables, and of the registers."""
    up, down = reach(grid, g)
    rows, lenses = grid["lenses"]
    vectors = [grid["origin"], grid["right"], *grid["down"]]
    values = [lenses << 16 | rows, grid["outputs"], *(n for vector in vectors for n in vector)]
    values += [(down & 0xFFFF) << 16 | up & 0xFFFF, grid["black"]]
    values += [*grid["line"], grid["pixel"]] if g["SKEWED"] else [*grid["place"], grid["step"]]
    registers = [(0, n, value & 0xFFFFFFFF) for n, value in enumerate(values)]
    tables = []
    mask, width = (1 << (g["WEIGHT_BITS"] + 2)) - 1, g["WEIGHT_BITS"] + 2
    gain_width = g["GAIN_BITS"] + 4 if g["GAINS"] else 0
    if g["MOVES"] or g["GAINS"]:
        for n in range(rows * lenses):
            word = int(grid["gains"].flat[n]) if g["GAINS"] else 0
            if g["MOVES"]:
                y, x = (int(move) & mask for move in grid["moves"].reshape(-1, 2)[n])
                word |= (y << width | x) << gain_width
            tables.append((1, n, word))
    if g["GAINS"]:
        tables += [(2, n, int(gain)) for n, gain in enumerate(grid["profile"].flat)]
    return tables, registers
