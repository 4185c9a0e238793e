# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the search for disparity: costs of candidates, paths, smoothing.

H. Hirschmüller, Stereo processing by semiglobal matching and mutual information, IEEE TPAMI 30(2),
2008: costs of neighbouring pixels are joined along straight paths from eight sides, on which small
changes of depth cost little, and large ones no more than a jump.

Arrays are filled element by element, as in `plenofir.refocus.compiled.parameters`.
"""

from functools import partial

import numpy as np
import numpy.typing as npt

from plenofir.ground.kept_code import compiled

Floats32 = npt.NDArray[np.float32]

# No cost or sum is infinite or no number, so least values can be found in vectors.
_compiled = partial(compiled, fastmath={"nnan", "nsz", "contract"})
_WAYS = 4
_BIG = np.float32(1e30)


@_compiled
def match_costs(
    # Shape (views, t + 2 pad, s + 2 pad), interpolated by cubic B-splines without a prefilter.
    views: Floats32,
    gaps: npt.NDArray[np.float64],  # (rows, columns) of each view from the central one
    pad: int,
    rows: npt.NDArray[np.int64],  # lines to compute; the result has as many
    # The central view, interpolated as the others at whole pixels, and the inverse of the variance
    # that its differences to another view have; shape (t, s).
    seen: Floats32,
    inverse: Floats32,
    candidates: npt.NDArray[np.float64],
    most: np.float32,
    unseen: np.float32,
    costs: Floats32,  # result, shape (rows, s, candidates)
) -> None:
    """Mean over the views of min(difference^2 x `inverse`, `most`), for each candidate.

    The share of the views that a point lies outside of costs `unseen` times that.
    """
    height, width = seen.shape
    line = np.empty(width + 4, np.float32)
    sums = np.empty(width, np.float32)
    outside = np.empty(width, np.int32)
    for number in range(len(rows)):
        y = rows[number]
        for c in range(len(candidates)):
            for x in range(width):
                sums[x], outside[x] = 0, len(views)
            for k in range(len(views)):
                # The point at x is at x - disparity gap in the other view.
                down, right = -candidates[c] * gaps[k, 0], -candidates[c] * gaps[k, 1]
                first = max(0, int(np.ceil(-0.5 - right)))
                length = min(width, int(np.floor(width - 0.5 - right)) + 1) - first
                if y + down < -0.5 or y + down > height - 0.5 or length <= 0:
                    continue
                top, left = int(np.floor(down)), int(np.floor(right))
                v0, v1, v2, v3 = _weights(down - top)
                h0, h1, h2, h3 = _weights(right - left)
                top += y + pad - 1
                left += first + pad - 1
                a0 = views[k, top, left : left + length + 3]
                a1 = views[k, top + 1, left : left + length + 3]
                a2 = views[k, top + 2, left : left + length + 3]
                a3 = views[k, top + 3, left : left + length + 3]
                for x in range(length + 3):
                    line[x] = v0 * a0[x] + v1 * a1[x] + v2 * a2[x] + v3 * a3[x]
                here = seen[y, first : first + length]
                scale = inverse[y, first : first + length]
                part = sums[first : first + length]
                for x in range(length):
                    off = (
                        h0 * line[x] + h1 * line[x + 1] + h2 * line[x + 2] + h3 * line[x + 3]
                    ) - here[x]
                    off = off * off * scale[x]
                    part[x] += off if off < most else most
                for x in range(first, first + length):
                    outside[x] -= 1
            for x in range(width):
                seeing = len(views) - outside[x]
                mean = sums[x] / seeing if seeing else most
                costs[number, x, c] = mean + unseen * outside[x] / len(views)


@_compiled
def _weights(t: float) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Weights of a cubic B-spline at t of 0 to 1 behind the second of four samples."""
    return (
        np.float32((1 - t) ** 3 / 6),
        np.float32((3 * t**3 - 6 * t**2 + 4) / 6),
        np.float32((-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6),
        np.float32(t**3 / 6),
    )


@_compiled
def refined(
    views: Floats32,
    gaps: npt.NDArray[np.float64],
    pad: int,
    seen: Floats32,
    inverse: Floats32,
    slopes: Floats32,  # the central view's slopes down and right, shape (2, t, s)
    values: Floats32,  # disparities to begin with, shape (t, s)
    most: np.float32,
) -> tuple[Floats32, Floats32, Floats32]:
    """Disparities that fit best near given ones, to first order, and the bend of their cost there.

    The third result is the mean of the other views there, of those that fit.

    The slope of the central view stands for that of the others: noise of a view at a pixel and of
    the slope there are independent, so the mean of the result has no bias by how much the
    interpolation smooths them. Parameters that `match_costs` has as well are the same.
    """
    height, width = seen.shape
    better, bends, means = values.copy(), np.zeros_like(values), seen.copy()
    for y in range(height):
        for x in range(width):
            moves, bend, difference, fitting = 0.0, 0.0, 0.0, 0
            for k in range(len(gaps)):
                down, right = -values[y, x] * gaps[k, 0], -values[y, x] * gaps[k, 1]
                if not (-0.5 <= y + down <= height - 0.5 and -0.5 <= x + right <= width - 0.5):
                    continue
                top, left = int(np.floor(down)), int(np.floor(right))
                v = _weights(down - top)
                h = _weights(right - left)
                top += y + pad - 1
                left += x + pad - 1
                off = -seen[y, x]
                for i in range(4):
                    line = views[k, top + i]
                    off += v[i] * (
                        h[0] * line[left]
                        + h[1] * line[left + 1]
                        + h[2] * line[left + 2]
                        + h[3] * line[left + 3]
                    )
                if off * off * inverse[y, x] < most:
                    slope = gaps[k, 0] * slopes[0, y, x] + gaps[k, 1] * slopes[1, y, x]
                    moves += slope * off
                    bend += slope * slope
                    difference += off
                    fitting += 1
            if bend > 0:
                better[y, x] += moves / bend
                bends[y, x] = 2 * bend * inverse[y, x] / len(gaps)
            if fitting:
                means[y, x] += difference / fitting
    return better, bends, means


@_compiled
def _apart(one: Floats32, other: Floats32) -> np.float32:
    """Square of the distance of two colours."""
    total = np.float32(0)
    for k in range(len(one)):
        total += (one[k] - other[k]) * (one[k] - other[k])
    return total


@_compiled
def add_paths(
    costs: Floats32,  # shape (t, s, candidates)
    guide: Floats32,  # colours, in units of a step that separates two things; (t, s, colours)
    # Costs of the next candidate, and of any other where the brightness is even.
    change: np.float32,
    jump: np.float32,
    sums: Floats32,  # the result is added to it; shape of `costs`
) -> None:
    """Add least costs of the paths from eight sides that end in each candidate of each pixel."""
    height, width, count = costs.shape
    for back in range(2):
        step = 1 - 2 * back
        # The ways from above (left, straight, right) keep the line before and this one, the way
        # along the line keeps the pixel before and this one.
        lines = np.full((2, _WAYS, width, count + 2), _BIG, np.float32)
        least = np.zeros((2, _WAYS, width), np.float32)
        for i in range(height):
            y = i if back == 0 else height - 1 - i
            for j in range(width):
                x = j if back == 0 else width - 1 - j
                own, total = costs[y, x], sums[y, x]
                for way in range(_WAYS):
                    across, up = (way - 1, 1) if way < 3 else (-1, 0)
                    now = lines[i % 2, way, j]
                    lowest = _BIG
                    if i < up or j + across < 0 or j + across >= width:
                        for c in range(count):
                            value = own[c]
                            now[c + 1] = value
                            total[c] += value
                            lowest = value if value < lowest else lowest
                    else:
                        before = lines[(i - up) % 2, way, j + across]
                        base = least[(i - up) % 2, way, j + across]
                        edge = _apart(guide[y, x], guide[y - step * up, x + step * across])
                        top = max(jump / (np.float32(1) + edge), change)
                        for c in range(count):
                            near = before[c] if before[c] < before[c + 2] else before[c + 2]
                            near = near + change
                            value = before[c + 1]
                            value = (value if value < near else near) - base
                            value = own[c] + (value if value < top else top)
                            now[c + 1] = value
                            total[c] += value
                            lowest = value if value < lowest else lowest
                    least[i % 2, way, j] = lowest


@_compiled
def joined(
    values: Floats32,
    weights: Floats32,
    guide: Floats32,
    stiffness: np.float32,
    step: np.float32,
    times: int,
) -> Floats32:
    """Values drawn to those of their neighbours, where they are less sure than these.

    `weights`: of the values themselves. `guide`: as in `add_paths`. `stiffness`: weight of an equal
    neighbour. `step`: difference from which on neighbours are two things. `times`: iterations.
    """
    height, width = values.shape
    one = np.float32(1)
    # With a margin that has no weight. Links lead to the right and down.
    now = np.zeros((height + 2, width + 2), np.float32)
    then, across, down = np.zeros_like(now), np.zeros_like(now), np.zeros_like(now)
    for y in range(height):
        for x in range(width):
            now[y + 1, x + 1] = values[y, x]
    for turn in range(times):
        if turn % 4 == 0:
            for y in range(height):
                for x in range(width):
                    if x + 1 < width:
                        edge = one + _apart(guide[y, x], guide[y, x + 1])
                        apart = (now[y + 1, x + 1] - now[y + 1, x + 2]) / step
                        fit = one + apart * apart
                        across[y + 1, x + 1] = stiffness / (edge * fit * fit)
                    if y + 1 < height:
                        edge = one + _apart(guide[y, x], guide[y + 1, x])
                        apart = (now[y + 1, x + 1] - now[y + 2, x + 1]) / step
                        fit = one + apart * apart
                        down[y + 1, x + 1] = stiffness / (edge * fit * fit)
        for y in range(height):
            above, here, below, result = now[y], now[y + 1], now[y + 2], then[y + 1]
            right, lower, upper = across[y + 1], down[y + 1], down[y]
            for x in range(width):
                share = weights[y, x] + np.float32(1e-6)
                total = share * values[y, x]
                total += right[x] * here[x] + right[x + 1] * here[x + 2]
                total += upper[x + 1] * above[x + 1] + lower[x + 1] * below[x + 1]
                share += right[x] + right[x + 1] + upper[x + 1] + lower[x + 1]
                result[x + 1] = total / share
        now, then = then, now
    return now[1:-1, 1:-1].copy()
