# SPDX-License-Identifier: Apache-2.0
"""Reference of `depth_index`, from docs/stack.md: sharpness of micro images, votes, the picture."""

import numpy as np


def _window(x: np.ndarray, radius: int) -> np.ndarray:
    """Sums over (2 radius + 1)^2 micro images; 0 beyond the edges."""
    rows, columns = x.shape
    padded = np.pad(x, radius)
    reach = range(2 * radius + 1)
    return sum(padded[t : t + rows, s : s + columns] for t in reach for s in reach)


def sharpness(image: np.ndarray, m: int, radius: int) -> np.ndarray:
    """Sharpness of each micro image (t, s) of a slice (rows, columns, channels)."""
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


def between(curves: np.ndarray, shifts: list[int], level: int) -> tuple[np.ndarray, np.ndarray]:
    """Position of each peak, 0 to 255, and its confidence; curves: sharpness (slices, t, s).

    In Python's integers, with the vertex of a parabola through three points.
    """
    place, sure = np.full(curves.shape[1:], 128), np.zeros(curves.shape[1:], dtype=int)
    drop = 1 << max(level.bit_length() - 5, 0)
    for t, s in np.ndindex(*place.shape):
        curve = [int(v) for v in curves[:, t, s]]
        i = curve.index(max(curve))
        if not 0 < i < len(curve) - 1:
            continue
        # Lagrange's parabola through three points, and its vertex over / under.
        (x0, x1, x2), (y0, y1, y2) = shifts[i - 1 : i + 2], curve[i - 1 : i + 2]
        over = y0 * (x1**2 - x2**2) + y1 * (x2**2 - x0**2) + y2 * (x0**2 - x1**2)
        under = 2 * (y0 * (x1 - x2) + y1 * (x2 - x0) + y2 * (x0 - x1))
        # Relative position from the middle of the first two to that of the last two.
        place[t, s] = min(256 * (2 * over - (x0 + x1) * under) // (under * (x2 - x0)), 255)
        bend = 2 * curve[i] - curve[i - 1] - curve[i + 1]
        sure[t, s] = min(max(bend // drop, 1), 255)
    return place, sure


def weight(shift: int, m: int) -> int:
    """Weight of a slice in sixteenths."""
    return {0: 12}.get(shift % m, 15 if 2 * shift % m == 0 else 16)


def indices(slices: np.ndarray, g: dict) -> tuple[np.ndarray, ...]:
    """The slice of each micro image, whether it has texture, with shifts its depth between slices.

    slices: (slices, rows, columns, channels).
    """
    m, shifts = g["MICRO_IMAGE_SIZE"], [int(word) for word in g["SHIFTS"].split()]
    all_of_them = np.stack([sharpness(s, m, g["RADIUS"]) for s in slices])
    if shifts:
        weights = np.array([weight(shift, m) for shift in shifts])
        all_of_them = all_of_them * weights[:, np.newaxis, np.newaxis] // 16
    index = all_of_them.argmax(0)
    sure = np.ptp(all_of_them, axis=0) >= g["CONFIDENCE"]
    depth = between(all_of_them, shifts, g["CONFIDENCE"]) if shifts else ()
    if not g["VOTE_RADIUS"]:
        return index, sure, *depth
    # Micro images without a slice of their own have no depth between slices.
    depth = tuple(np.where(sure, part, none) for part, none in zip(depth, (128, 0), strict=False))
    votes = np.stack([_window((index == s) & sure, g["VOTE_RADIUS"]) for s in range(len(slices))])
    found = index.copy()
    for t, s in np.argwhere(~sure):
        if votes[:, t, s].any():
            found[t, s] = votes[:, t, s].argmax()
        elif t or s:
            found[t, s] = found[t - 1, s] if t else found[t, s - 1]
    return found, sure, *depth


def words(raw: np.ndarray, g: dict, chosen: int) -> list[list[int]]:
    """Words of the picture: pixel of the index (or none), index, depth, pixel of the chosen slice.

    Neighbouring pixels together, with zeros after a line's last one.
    """
    rows, columns, _ = raw.shape
    m, channels, bits = g["MICRO_IMAGE_SIZE"], g["CHANNELS"], g["PIXEL_BITS"]
    # With two boxes each slice comes twice; its smaller box is shown where the slice is in focus.
    boxes = 1 + g["SHARP_TOO"]
    slices = np.moveaxis(raw.reshape(rows, columns, g["SLICES"] * boxes, channels), 2, 0)
    of_lenses = indices(slices[::boxes], g)
    index, sure, *depth = (part.repeat(m, 0).repeat(m, 1)[:rows, :columns] for part in of_lenses)
    sharp = sure * g["SHARP_TOO"]
    together = g["PIXELS_PER_CLOCK"]
    width = (g["PICTURE"] + g["CHOSEN_TOO"]) * channels * bits + 8 * (1 + len(depth))
    lines = []
    for y in range(rows):
        line = [0] * -(-columns // together)
        for x in range(columns):
            best, here = index[y, x], sharp[y, x]
            fields = [*slices[best * boxes + here, y, x]] if g["PICTURE"] else []
            word = sum(int(v) << (n * bits) for n, v in enumerate(fields))
            above = len(fields) * bits
            for part in (index, *depth):
                word |= int(part[y, x]) << above
                above += 8
            if g["CHOSEN_TOO"]:
                shown = slices[chosen * boxes + (here and best == chosen), y, x]
                beside = sum(int(v) << (n * bits) for n, v in enumerate(shown))
                word |= beside << above
            line[x // together] |= word << x % together * width
        lines.append(line)
    return lines
