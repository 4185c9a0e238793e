# SPDX-License-Identifier: Apache-2.0
"""Reference of `raster_refocuser`, from its definitions: docs/core.md, docs/golden-model.md.

S[k'] = sum over u of x[M floor((k' - u a') / M) + u] where (k' - u a') mod M is below the box B,
outside the picture x = 0; output pixel k is S[k + floor((M-1) a' / 2) - floor((M-B) / 2)] if
centred. Rows first, then columns; each order of interpolation is once more the operator with
a' = 1.
"""

import numpy as np


def sums(x: np.ndarray, m: int, box: int, shift: int, centred: bool) -> np.ndarray:
    """The operator along axis 0."""
    k = np.arange(len(x)) + ((m - 1) * shift // 2 - (m - box) // 2 if centred else 0)
    out = np.zeros_like(x)
    for u in range(m):
        place = m * ((k - u * shift) // m) + u
        inside = (place >= 0) & (place < len(x)) & ((k - u * shift) % m < box)
        out[inside] += x[place[inside]]
    return out


def half_up(x: np.ndarray, divisor: int) -> np.ndarray:
    """Quotient, rounded to the nearest integer, halves up."""
    return (2 * x + divisor) // (2 * divisor)


def sharpened(x: np.ndarray, m: int, side: int) -> np.ndarray:
    """64 times (-b, 1 + 2b, -b) a lens apart along axis 0, b = side / 64."""
    k = np.arange(len(x))
    before = np.where((k < m).reshape(-1, *[1] * (x.ndim - 1)), x, np.roll(x, m, 0))
    behind = np.where((k >= len(x) - m).reshape(-1, *[1] * (x.ndim - 1)), x, np.roll(x, -m, 0))
    return (64 + 2 * side) * x - side * (before + behind)


def picture_sums(x: np.ndarray, m: int, box: int, passes: list[int], centred: bool) -> np.ndarray:
    """The operator along rows, then along columns."""
    for axis in (1, 0):
        x = np.swapaxes(x, 0, axis)
        for shift in passes:
            x = sums(x, m, box, shift, centred)
        x = np.swapaxes(x, 0, axis)
    return x


def refocused(raw: np.ndarray, g: dict, slice_: int) -> np.ndarray:
    """The picture (rows, columns, channels) that the core with generics `g` makes of a frame."""
    m, bits = g["MICRO_IMAGE_SIZE"], g["PIXEL_BITS"]
    passes = [int(g["SHIFTS"].split()[slice_])] + [1] * g["INTERPOLATION_ORDER"]
    boxes = g["BOX"].split()
    box = int(boxes[slice_ if boxes[1:] else 0]) if boxes else m
    x = raw.astype(np.int64)
    if g["EXACT"]:
        if g["BORDER_NORMALISED"]:
            # Divide by the sums of a picture of ones; 0 where these are 0.
            weight = picture_sums(np.ones_like(x), m, box, passes, g["CENTRED"])
            x = picture_sums(x, m, box, passes, g["CENTRED"])
            return (2 * x + weight) // np.maximum(2 * weight, 1)
        x = picture_sums(x, m, box, passes, g["CENTRED"])
        divisor = box ** (2 * len(passes))
        side = int(g["SHARPENING"].split()[slice_]) if g["SHARPENING"] else 0
        if side:
            x = sharpened(x, m, side)
            x = np.swapaxes(sharpened(np.swapaxes(x, 0, 1), m, side), 0, 1)
            divisor *= 64 * 64
        return np.clip(half_up(x, divisor), 0, (1 << bits) - 1)
    fraction, guard = g["FRACTION_BITS"], g["GUARD_BITS"]
    steps = [(axis, shift) for axis in (1, 0) for shift in passes]
    for n, (axis, shift) in enumerate(steps):
        x = half_up(x << (fraction if n == 0 else fraction - guard), box)
        x = np.swapaxes(sums(np.swapaxes(x, 0, axis), m, box, shift, g["CENTRED"]), 0, axis)
        final = n == len(steps) - 1
        x = half_up(x, 1 << (fraction if final else fraction - guard))
        x = np.minimum(x, (1 << (bits if final else bits + guard)) - 1)
    return x


class Slices:
    """Which slice each frame gets (docs/fir-array.md, slice_select)."""

    def __init__(self, count: int) -> None:
        self.count, self.slice, self.shown = count, 0, 0

    def next(self, asked: int, sweep: int, sweep_frames: int) -> int:
        """Slice of the next frame, with these values at the ports."""
        if not sweep:
            self.slice, self.shown = min(asked, self.count - 1), 0
            return self.slice
        now = self.slice
        self.shown += 1
        if self.shown >= max(sweep_frames, 1):
            self.slice, self.shown = (now + 1) % self.count, 0
        return now
