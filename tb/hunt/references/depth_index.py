# SPDX-License-Identifier: Apache-2.0
"""What `depth_index` must do, from docs/stack.md: sharpness of micro images, votes, the picture."""

import numpy as np


def _window(x: np.ndarray, radius: int) -> np.ndarray:
    """Sums over (2 radius + 1)^2 micro images; beyond the edges there is nothing."""
    rows, columns = x.shape
    padded = np.pad(x, radius)
    reach = range(2 * radius + 1)
    return sum(padded[t : t + rows, s : s + columns] for t in reach for s in reach)


def sharpness(image: np.ndarray, m: int, radius: int) -> np.ndarray:
    """Of each micro image (t, s) of a slice (rows, columns, channels)."""
    luma = image @ np.array([1, 2, 1]) if image.shape[2] == 3 else image[:, :, 0]
    rows, columns = (-(-length // m) for length in luma.shape)
    whole = np.zeros((rows * m, columns * m), dtype=np.int64)
    whole[: luma.shape[0], : luma.shape[1]] = luma
    level = whole.reshape(rows, m, columns, m).sum((1, 3))
    bend = np.zeros_like(level)
    for axis in (0, 1):
        step = np.diff(level, axis=axis)
        before, behind = ([(1, 0) if a == axis else (0, 0) for a in (0, 1)] for _ in range(2))
        behind[axis] = (0, 1)
        bend += np.pad(step, before) - np.pad(step, behind)
    return _window(np.abs(bend), radius)


def indices(slices: np.ndarray, g: dict) -> np.ndarray:
    """The slice of each micro image; slices: (slices, rows, columns, channels)."""
    all_of_them = np.stack([sharpness(s, g["MICRO_IMAGE_SIZE"], g["RADIUS"]) for s in slices])
    index = all_of_them.argmax(0)
    if not g["VOTE_RADIUS"]:
        return index
    sure = np.ptp(all_of_them, axis=0) >= g["CONFIDENCE"]
    votes = np.stack([_window((index == s) & sure, g["VOTE_RADIUS"]) for s in range(len(slices))])
    found = index.copy()
    for t, s in np.argwhere(~sure):
        if votes[:, t, s].any():
            found[t, s] = votes[:, t, s].argmax()
        elif t or s:
            found[t, s] = found[t - 1, s] if t else found[t, s - 1]
    return found


def words(raw: np.ndarray, g: dict, chosen: int) -> list[list[int]]:
    """Words of the picture: the pixel of the index, the index, the pixel of the chosen slice."""
    rows, columns, _ = raw.shape
    m, channels, bits = g["MICRO_IMAGE_SIZE"], g["CHANNELS"], g["PIXEL_BITS"]
    slices = np.moveaxis(raw.reshape(rows, columns, g["SLICES"], channels), 2, 0)
    index = indices(slices, g).repeat(m, 0).repeat(m, 1)[:rows, :columns]
    lines = []
    for y in range(rows):
        line = []
        for x in range(columns):
            fields = [*slices[index[y, x], y, x]]
            word = sum(int(v) << (n * bits) for n, v in enumerate(fields))
            word |= int(index[y, x]) << (channels * bits)
            if g["CHOSEN_TOO"]:
                beside = sum(int(v) << (n * bits) for n, v in enumerate(slices[chosen, y, x]))
                word |= beside << (channels * bits + 8)
            line.append(word)
        lines.append(line)
    return lines
