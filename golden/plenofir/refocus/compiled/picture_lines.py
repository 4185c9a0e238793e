# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of `plenofir.refocus.pictures`.

Arrays are filled element by element, as in `plenofir.refocus.compiled.parameters`.
"""

from typing import Any

import numpy as np

from plenofir.ground.kept_code import compiled


@compiled
def _corrected(before: Any, near: Any, here: Any, next_: Any, after: Any, b: Any, out: Any) -> None:
    """Sharpened values, from those a lens and half a lens before and after."""
    for k in range(here.size):
        x, one, other = here[k], before[k], after[k]
        half, second = near[k], next_[k]
        more = b * ((x - one) + (x - other))
        large, small = (one, other) if one > other else (other, one)
        # A peak is raised by up to twice its height over the higher neighbour.
        peak, hollow = x - large, x - small
        large = half if half > large else large
        large = second if second > large else large
        small = half if half < small else small
        small = second if second < small else small
        high, low = large - x, small - x
        high = peak + peak if peak + peak > high else high
        low = hollow + hollow if hollow + hollow < low else low
        more = more if more < high else high
        more = more if more > low else low
        out[k] = x + more


@compiled
def _corrected_bytes(
    before: Any, near: Any, here: Any, next_: Any, after: Any, scale: Any, out: Any
) -> None:
    """`_corrected` in 32nds of a grey level, which 16 bits hold.

    Values come in units of `scale` 32nds.
    """
    for k in range(here.size):
        x, one = np.int16(here[k] * scale), np.int16(before[k] * scale)
        other = np.int16(after[k] * scale)
        half, second = np.int16(near[k] * scale), np.int16(next_[k] * scale)
        both = np.int16(np.int16(x - one) + np.int16(x - other))
        # b = 7/64.
        more = np.int16((both >> 3) - (both >> 6))
        large, small = np.int16(max(one, other)), np.int16(min(one, other))
        peak, hollow = np.int16(x - large), np.int16(x - small)
        large = np.int16(max(large, np.int16(max(half, second))))
        small = np.int16(min(small, np.int16(min(half, second))))
        high = np.int16(max(np.int16(large - x), np.int16(peak + peak)))
        low = np.int16(min(np.int16(small - x), np.int16(hollow + hollow)))
        more = np.int16(max(np.int16(min(more, high)), low))
        out[k] = np.int16(x + more)


@compiled
def sharpened_bytes(picture: Any, rows: Any, samples: Any, start: Any, out: Any) -> None:
    """`sharpened_lines` of a single picture of 8 bits."""
    height, width = picture.shape
    half, last = samples // rows * (rows // 2), width - samples
    down, across = np.empty(width, np.int16), np.empty(width, np.int16)
    for number in range(out.shape[0]):
        r = start + number
        before = picture[r - rows] if r >= rows else picture[r]
        near = picture[r - rows // 2] if r >= rows // 2 else picture[r]
        next_ = picture[r + rows // 2] if r + rows // 2 < height else picture[r]
        after = picture[r + rows] if r + rows < height else picture[r]
        _corrected_bytes(before, near, picture[r], next_, after, np.int16(32), down)
        line = down
        if width > 2 * samples:
            for k in range(samples):
                across[k], across[last + k] = down[k], down[last + k]
            _corrected_bytes(
                down[: last - samples],
                down[samples - half : last - half],
                down[samples:last],
                down[samples + half : last + half],
                down[2 * samples :],
                np.int16(1),
                across[samples:last],
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
    steps = np.array([-rows, -(rows // 2), 0, rows // 2, rows])
    half, last = samples // rows * (rows // 2), width - samples
    lines = np.empty((5, width), np.float32)
    down, across = np.empty(width, np.float32), np.empty(width, np.float32)
    part, gain, rounding = np.float32(share), np.float32(weight), np.float32(0.5)
    limit, zero = np.float32(most), np.float32(0)
    for number in range(out.shape[0]):
        r = start + number
        for n in range(5):
            # A tap outside the picture counts as the pixel itself.
            place = r + steps[n]
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
        _corrected(lines[0], lines[1], lines[2], lines[3], lines[4], gain, down)
        for k in range(width):
            across[k] = down[k]
        if width > 2 * samples:
            _corrected(
                down[: last - samples],
                down[samples - half : last - half],
                down[samples:last],
                down[samples + half : last + half],
                down[2 * samples :],
                gain,
                across[samples:last],
            )
        result = out[number]
        for k in range(width):
            value = across[k] + rounding
            value = value if value > zero else zero
            value = value if value < limit else limit
            result[k] = np.uint16(np.int32(value))


@compiled
def means_of_four(picture: Any, samples: Any, out: Any) -> None:
    """Means of each pixel, the next ones right and below, and the one between these.

    `samples`: of a pixel, along a line.
    """
    rows, width = out.shape
    quarter = np.float32(0.25)
    for r in range(rows):
        line, next_, result = picture[r], picture[r + 1], out[r]
        for k in range(width):
            both = np.int32(line[k]) + np.int32(line[k + samples])
            both += np.int32(next_[k]) + np.int32(next_[k + samples])
            result[k] = quarter * np.float32(both)


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
            for channel in range(channels):
                sums[channel] = 0.0
            whole = 0.0
            for n in range(shares.size):
                v, u = rows_of[n], columns_of[n]
                # The lens through which view (v, u) sees the object at this pixel.
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
