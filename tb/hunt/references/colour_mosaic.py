# SPDX-License-Identifier: Apache-2.0
"""Reference of `colour_mosaic`: bilinear in 3 x 3 pixels, mirrored at the borders, halves up.

A colour that a pixel's filter blocks is the mean of those neighbours that have it. In
a frame of a single line or column, that line or column stands for its neighbours.
"""

import numpy as np


def colours(raw: np.ndarray, red_line: int, red_column: int) -> np.ndarray:
    """Red, green, blue (rows, columns, 3) of a mosaic (rows, columns)."""
    index = []
    for size in raw.shape:
        n = np.arange(-1, size + 1)
        index.append(np.abs(size - 1 - np.abs(size - 1 - np.abs(n))) if size > 1 else n * 0)
    wide = raw[np.ix_(*index)].astype(np.int64)
    rows, columns = raw.shape
    # The filters' pattern continues beyond the borders: 0 red, 1 green, 2 blue.
    y = (np.arange(-1, rows + 1) + red_line) % 2
    x = (np.arange(-1, columns + 1) + red_column) % 2
    filters = y[:, None] + x
    out = np.empty((rows, columns, 3), np.int64)
    for colour in range(3):
        has = (filters == colour).astype(np.int64)
        sums, count = np.zeros(raw.shape, np.int64), np.zeros(raw.shape, np.int64)
        for dy in range(3):
            for dx in range(3):
                part = slice(dy, dy + rows), slice(dx, dx + columns)
                sums += has[part] * wide[part]
                count += has[part]
        own = filters[1:-1, 1:-1] == colour
        out[..., colour] = np.where(own, raw, (2 * sums + count) // np.maximum(2 * count, 1))
    return out
