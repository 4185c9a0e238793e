"""Centroids of micro images in a smooth window around where they are expected.

The window (a raised cosine, a little wider than the pitch) weighs the dark gaps on both sides of a
micro image evenly, so a window that is in the right place has its centroid in the middle however
bright the background and the neighbours are; no threshold and no labels are needed. Off the right
place, the centroid follows the micro image in proportion, and one factor for all of them, measured
by moving the windows a little, turns it into a distance.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.grid import Floats

Image32 = npt.NDArray[np.float32]

HALF_WIDTH = 0.6
"""Half width of the window in pitches."""
CORE_HALF_WIDTH = 0.35
"""Half width of the window over the middle of a micro image, in pitches."""
_BLOCK_PIXELS = 1 << 21
_TRIAL = 0.05
_TRIAL_LENSES = 1000


@dataclass(frozen=True)
class Moments:
    """Weighted moments of windows."""

    sums: Floats  # mean of the window, shape (n,)
    offsets: Floats  # centroid from the window's middle, (y, x) in pixels, shape (n, 2)
    variances: Floats  # second moments along y and x in square pixels, shape (n, 2)


def reach(pitch: float) -> float:
    """Pixels around a centre that its window needs."""
    # The trial moves of `response` included.
    return float(np.ceil((HALF_WIDTH + _TRIAL) * pitch)) + 1


def _window(distance: Floats, half_width: float) -> Floats:
    inside = np.abs(distance) < half_width
    return np.where(inside, 0.5 + 0.5 * np.cos(np.pi / half_width * distance), 0.0)


def windowed_moments(
    image: Image32, positions: Floats, pitch: tuple[float, float], half_width: float = HALF_WIDTH
) -> Moments:
    """Moments of an image in windows."""
    halves = [half_width * p for p in pitch]
    sides = [int(np.ceil(h)) for h in halves]
    steps = [np.arange(-n, n + 1) for n in sides]
    windows = np.lib.stride_tricks.sliding_window_view(image, [len(s) for s in steps])
    corners = np.round(positions).astype(np.int64)
    n = len(positions)
    sums, offsets, variances = np.empty(n), np.empty((n, 2)), np.empty((n, 2))
    block = max(1, _BLOCK_PIXELS // (len(steps[0]) * len(steps[1])))
    for start in range(0, n, block):
        part = slice(start, start + block)
        corner = corners[part]
        pixels = windows[corner[:, 0] - sides[0], corner[:, 1] - sides[1]]
        weights, distances = [], []
        for axis in (0, 1):
            distance = steps[axis] - (positions[part, axis] - corner[:, axis])[:, np.newaxis]
            weights.append(_window(distance, halves[axis]))
            distances.append(distance)
        right = np.stack(
            [weights[1], weights[1] * distances[1], weights[1] * distances[1] ** 2], axis=-1
        )
        lines = np.matmul(pixels, right.astype(np.float32)).astype(np.float64)
        w, d = weights[0], distances[0]
        total = np.einsum("ni,nik->nk", w, lines)
        mass = np.where(np.abs(total[:, 0]) > 1e-9, total[:, 0], 1e-9)
        down = np.einsum("ni,ni->n", w * d, lines[:, :, 0])
        down2 = np.einsum("ni,ni->n", w * d**2, lines[:, :, 0])
        sums[part] = mass / (w.sum(axis=1) * weights[1].sum(axis=1))
        offsets[part] = np.stack([down / mass, total[:, 1] / mass], axis=-1)
        variances[part] = np.stack([down2 / mass, total[:, 2] / mass], axis=-1)
    return Moments(sums, offsets, variances)


def core_brightness(image: Image32, positions: Floats, pitch: tuple[float, float]) -> Floats:
    """Mean brightness of the middle of micro images."""
    return windowed_moments(image, positions, pitch, CORE_HALF_WIDTH).sums


def response(
    image: Image32,
    positions: Floats,
    pitch: tuple[float, float],
    half_width: float = HALF_WIDTH,
) -> Floats:
    """How far a window's centroid moves when the window moves by one pixel."""
    step = max(1, len(positions) // _TRIAL_LENSES)
    chosen = positions[::step]
    factors = np.empty(2)
    for axis in (0, 1):
        move = np.zeros(2)
        move[axis] = _TRIAL * pitch[axis]
        ahead = windowed_moments(image, chosen + move, pitch, half_width).offsets[:, axis]
        behind = windowed_moments(image, chosen - move, pitch, half_width).offsets[:, axis]
        factors[axis] = np.median(behind - ahead) / (2 * move[axis])
    return factors
