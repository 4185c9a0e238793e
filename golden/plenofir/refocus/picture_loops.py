# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of `plenofir.refocus.pictures`."""

from typing import Any

import numpy as np

from plenofir.refocus.kernels import compiled


@compiled
def _corrected(before: Any, here: Any, after: Any, weight: Any, result: Any) -> None:
    """Sharpened values, from those a lens before and after."""
    zero = np.float32(0)
    for k in range(here.size):
        x = here[k]
        one, other = x - before[k], x - after[k]
        more = weight * (one + other)
        same = one * other > zero
        one, other = (one if one > zero else -one), (other if other > zero else -other)
        limit = one if one < other else other
        limit = limit + limit if same else limit
        more = more if more < limit else limit
        more = more if more > -limit else -limit
        result[k] = x + more


@compiled
def _corrected_bytes(before: Any, here: Any, after: Any, scale: Any, result: Any) -> None:
    """`_corrected` in 32nds of a grey level, which 16 bits hold.

    Values come in units of `scale` 32nds.
    """
    for k in range(here.size):
        x = np.int16(here[k] * scale)
        one, other = np.int16(x - before[k] * scale), np.int16(x - after[k] * scale)
        both = np.int16(one + other)
        # b = 7/64.
        more = np.int16((both >> 3) - (both >> 6))
        # All ones where both have one sign.
        same = np.int16(~np.int16(np.int16(one ^ other) >> 15))
        one, other = np.int16(abs(one)), np.int16(abs(other))
        limit = np.int16(min(one, other))
        limit = np.int16(limit + np.int16(limit & same))
        more = np.int16(min(more, limit))
        more = np.int16(max(more, np.int16(-limit)))
        result[k] = np.int16(x + more)


@compiled
def sharpened_bytes(picture: Any, rows: Any, samples: Any, start: Any, out: Any) -> None:
    """`sharpened_lines` of a single picture of 8 bits."""
    height, width = picture.shape
    down, across = np.empty(width, np.int16), np.empty(width, np.int16)
    for number in range(out.shape[0]):
        r = start + number
        before = picture[r - rows] if r >= rows else picture[r]
        after = picture[r + rows] if r + rows < height else picture[r]
        _corrected_bytes(before, picture[r], after, np.int16(32), down)
        line = down
        if width > 2 * samples:
            across[:samples] = down[:samples]
            across[width - samples :] = down[width - samples :]
            _corrected_bytes(
                down[: width - 2 * samples],
                down[samples : width - samples],
                down[2 * samples :],
                np.int16(1),
                across[samples : width - samples],
            )
            line = across
        result = out[number]
        for k in range(width):
            value = np.int16(np.int16(line[k] + np.int16(16)) >> 5)
            result[k] = np.uint8(max(min(value, np.int16(255)), np.int16(0)))


@compiled
def sharpened_lines(
    low: Any,
    high: Any,
    share: Any,
    rows: Any,  # a lens, in lines
    samples: Any,  # and along a line
    start: Any,
    weight: Any,
    most: Any,
    out: Any,
) -> None:
    """Mix two pictures, sharpen the mixture and round it, from line `start` on."""
    height, width = low.shape
    lines = np.empty((3, width), np.float32)
    down, across = np.empty(width, np.float32), np.empty(width, np.float32)
    part, gain, half = np.float32(share), np.float32(weight), np.float32(0.5)
    limit, zero = np.float32(most), np.float32(0)
    for number in range(out.shape[0]):
        r = start + number
        for n in range(3):
            # A tap outside the picture counts as the pixel itself.
            place = r + (n - 1) * rows
            if place < 0 or place >= height:
                place = r
            line, one, other = lines[n], low[place], high[place]
            if part == zero:
                for k in range(width):
                    line[k] = np.float32(one[k])
            else:
                for k in range(width):
                    value = np.float32(one[k])
                    line[k] = value + part * (np.float32(other[k]) - value)
        _corrected(lines[0], lines[1], lines[2], gain, down)
        across[:] = down
        if width > 2 * samples:
            inner = across[samples : width - samples]
            _corrected(
                down[: width - 2 * samples],
                down[samples : width - samples],
                down[2 * samples :],
                gain,
                inner,
            )
        result = out[number]
        for k in range(width):
            value = across[k] + half
            value = value if value > zero else zero
            value = value if value < limit else limit
            result[k] = np.uint16(np.int32(value))


@compiled
def views_of_lines(
    raw: Any,
    m: Any,
    a: Any,
    right: Any,
    down: Any,
    rows_of: Any,  # of each view its row, its column and its share
    columns_of: Any,
    shares: Any,
    top: Any,
    left: Any,
    out: Any,
) -> None:
    """A region of the picture that begins at a place, from the views that count."""
    height, width, channels = raw.shape
    c = (m - 1) / 2
    sums = np.empty(channels, np.float64)
    for r in range(out.shape[0]):
        y = top + r
        for k in range(out.shape[1]):
            x = left + k
            # From -1 to 1 over the picture.
            here = a + right * (2 * x + 1 - width) / width + down * (2 * y + 1 - height) / height
            sums[:] = 0.0
            whole = 0.0
            for n in range(shares.size):
                v, u = rows_of[n], columns_of[n]
                # Of the object at a pixel, the lens that view (v, u) sees it through.
                t = (y - c) / m - here * (v - c)
                s = (x - c) / m - here * (u - c)
                t_first, s_first = int(np.floor(t)), int(np.floor(s))
                t_rest, s_rest = t - t_first, s - s_first
                for j in range(2):
                    row = (t_first + j) * m + v
                    if row < 0 or row >= height:
                        continue
                    share = shares[n] * (t_rest if j else 1 - t_rest)
                    for i in range(2):
                        column = (s_first + i) * m + u
                        if column < 0 or column >= width:
                            continue
                        weight = share * (s_rest if i else 1 - s_rest)
                        whole += weight
                        for channel in range(channels):
                            sums[channel] += weight * raw[row, column, channel]
            for channel in range(channels):
                out[r, k, channel] = np.float32(sums[channel] / whole) if whole > 0 else 0
