# SPDX-License-Identifier: Apache-2.0
"""Compiled loops: weighted sums of pixels and of their distances in windows, samples, spots."""

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.grid import Floats, Indices
from plenofir.ground.kept_code import compiled


@compiled
def add_windows(
    image: npt.NDArray[np.float32],
    positions: Floats,
    halves: Floats,
    sides: Indices,
    keys_y: Floats,
    keys_x: Floats,
    moved: bool,
    result: Floats,
) -> None:
    """Sums of pixels in raised-cosine windows around positions.

    `halves` are the windows' half widths, `sides` the pixels on each side that count, all along y
    and x. Each pixel has `len(keys)` places at which the window is evaluated; row j of `keys` has
    the weights of place j for the pixels from 2 before to 2 after. A row of `result` holds the sum
    of the weights, and of the pixels times weight times 1, dy, dx, dy^2, dx^2;
    those with distances are left out unless `moved`.
    """
    rows, columns = 2 * sides[0] + 1, 2 * sides[1] + 1
    longest = 2 * max(sides) + 5
    weights, sums = np.empty((2, 3, longest)), np.empty((3, columns))
    for n in range(len(positions)):
        for axis in range(2):
            side = sides[axis]
            half = halves[axis]
            keys = keys_y if axis == 0 else keys_x
            count = len(keys)
            pixels = 2 * side + 1
            own = weights[axis]
            own[:, : pixels + 4] = 0.0
            off = positions[n, axis] - np.rint(positions[n, axis])
            # Rotated from place to place: cheaper than a cosine for each.
            angle = np.pi / half * (0.5 / count - 0.5 - side - off)
            turn = np.pi / half / count
            real, imaginary = np.cos(angle), np.sin(angle)
            turn_real, turn_imaginary = np.cos(turn), np.sin(turn)
            for middle in range(pixels):
                for place in range(count):
                    distance = middle - side - off + ((place + 0.5) / count - 0.5)
                    if -half < distance < half:
                        value = 0.5 + 0.5 * real
                        moment = value * distance
                        square = moment * distance
                        for k in range(5):
                            # Two more on each side than there are pixels.
                            own[0, middle + k] += value * keys[place, k]
                            own[1, middle + k] += moment * keys[place, k]
                            own[2, middle + k] += square * keys[place, k]
                    real, imaginary = (
                        real * turn_real - imaginary * turn_imaginary,
                        real * turn_imaginary + imaginary * turn_real,
                    )
        top = int(np.rint(positions[n, 0])) - sides[0]
        left = int(np.rint(positions[n, 1])) - sides[1]
        total_y = total_x = one = dy = dx = dyy = dxx = 0.0
        down, right = weights[0, :, 2 : rows + 2], weights[1, :, 2 : columns + 2]
        # Summed over the lines first, so that the inner loop runs along a line and vectorises.
        sums[:, :columns] = 0.0
        line, line_y, line_yy = sums[0], sums[1], sums[2]
        if not moved:
            for i in range(rows):
                total_y += down[0, i]
                pixel = image[top + i, left : left + columns]
                for j in range(columns):
                    line[j] += down[0, i] * pixel[j]
            for j in range(columns):
                total_x += right[0, j]
                one += right[0, j] * line[j]
            result[n, 0] = total_y * total_x
            result[n, 1] = one
            continue
        for i in range(rows):
            total_y += down[0, i]
            pixel = image[top + i, left : left + columns]
            for j in range(columns):
                line[j] += down[0, i] * pixel[j]
                line_y[j] += down[1, i] * pixel[j]
                line_yy[j] += down[2, i] * pixel[j]
        for j in range(columns):
            total_x += right[0, j]
            one += right[0, j] * line[j]
            dx += right[1, j] * line[j]
            dxx += right[2, j] * line[j]
            dy += right[0, j] * line_y[j]
            dyy += right[0, j] * line_yy[j]
        result[n, 0] = total_y * total_x
        result[n, 1] = one
        result[n, 2] = dy
        result[n, 3] = dx
        result[n, 4] = dyy
        result[n, 5] = dxx


@compiled
def smooth_into(
    image: npt.NDArray[np.float32], taps: npt.NDArray[np.float32], result: npt.NDArray[np.float32]
) -> None:
    """Add an image, convolved with an odd number of `taps` along both axes, to `result`.

    What lies outside of the image counts as the nearest pixel.
    """
    rows, columns = image.shape
    reach = len(taps) // 2
    line = np.empty(columns + 2 * reach, np.float32)
    for y in range(rows):
        line[:] = 0.0
        for k in range(len(taps)):
            above = image[min(max(y + k - reach, 0), rows - 1)]
            for x in range(columns):
                line[reach + x] += taps[k] * above[x]
        line[:reach] = line[reach]
        line[reach + columns :] = line[reach + columns - 1]
        for k in range(len(taps)):
            for x in range(columns):
                result[y, x] += taps[k] * line[k + x]


@compiled
def sample(
    image: npt.NDArray[np.float32],
    positions: Floats,
    down: Floats,
    right: Floats,
    result: npt.NDArray[np.float32],
) -> None:
    """Samples of an image around positions, line by line, interpolated linearly.

    They lie at the distances `down` and `right`, which rise; a line of `result` has those of a
    position. What lies outside of the image counts as the nearest pixel.
    """
    last_row, last_column = image.shape[0] - 1, image.shape[1] - 1
    count = len(right)
    # Unsigned indices are taken as they are, others may count from the end.
    left, next_ = np.empty(count, np.uintp), np.empty(count, np.uintp)
    share = np.empty(count, np.float32)
    for n in range(len(positions)):
        for j in range(count):
            x = min(max(positions[n, 1] + right[j], 0.0), float(last_column))
            place = int(x)
            left[j], next_[j] = place, min(place + 1, last_column)
            share[j] = x - place
        for i in range(len(down)):
            y = min(max(positions[n, 0] + down[i], 0.0), float(last_row))
            top = int(y)
            low = np.float32(y - top)
            above, below = image[top], image[min(top + 1, last_row)]
            line = result[n, i * count : (i + 1) * count]
            for j in range(count):
                k, after, part = left[j], next_[j], share[j]
                first = above[k] + part * (above[after] - above[k])
                second = below[k] + part * (below[after] - below[k])
                line[j] = first + low * (second - first)


@compiled
def add_spots(
    image: npt.NDArray[np.float32], places: Floats, levels: Floats, spot: Floats, step: float
) -> None:
    """Add a round spot at each place, multiplied by its brightness."""
    reach = step * (len(spot) - 1)
    for n in range(len(places)):
        if levels[n] == 0.0:
            continue
        top = max(0, int(np.ceil(places[n, 0] - reach)))
        bottom = min(image.shape[0] - 1, int(np.floor(places[n, 0] + reach)))
        left = max(0, int(np.ceil(places[n, 1] - reach)))
        right = min(image.shape[1] - 1, int(np.floor(places[n, 1] + reach)))
        for y in range(top, bottom + 1):
            dy = y - places[n, 0]
            for x in range(left, right + 1):
                dx = x - places[n, 1]
                away = np.sqrt(dy * dy + dx * dx) / step
                low = int(away)
                if low < len(spot) - 1:
                    share = away - low
                    value = (1 - share) * spot[low] + share * spot[low + 1]
                    image[y, x] += levels[n] * value


@compiled
def add_spot_system(
    places: Floats, levels: Floats, values: Floats, weights: Floats, system: Floats, right: Floats
) -> None:
    """Add to the normal equations of a round spot's profile, 0 at its end, from pixels.

    Each pixel is a sum of spots: `places` are its distances from their centres in steps of the
    profile, nearest first, infinite where there is none, and `levels` the spots' brightness, both
    of shape (pixels, spots). `system` and `right`: the equations of the profile's samples.
    """
    count = len(right)
    where, amounts = np.empty(2 * places.shape[1], np.int64), np.empty(2 * places.shape[1])
    for n in range(len(values)):
        used = 0
        for k in range(places.shape[1]):
            place = places[n, k]
            if not place < count:
                break
            low = int(place)
            where[used], amounts[used] = low, levels[n, k] * (low + 1 - place)
            used += 1
            if low + 1 < count:
                where[used], amounts[used] = low + 1, levels[n, k] * (place - low)
                used += 1
        for i in range(used):
            amount = weights[n] * amounts[i]
            right[where[i]] += amount * values[n]
            for j in range(used):
                system[where[i], where[j]] += amount * amounts[j]


@compiled
def spot_values(places: Floats, levels: Floats, profile: Floats) -> Floats:
    """Pixels that are sums of spots, see `add_spot_system`; `profile` ends with 0."""
    result = np.zeros(len(places))
    for n in range(len(places)):
        for k in range(places.shape[1]):
            place = places[n, k]
            if not place < len(profile) - 1:
                break
            low = int(place)
            share = place - low
            result[n] += levels[n, k] * ((1 - share) * profile[low] + share * profile[low + 1])
    return result
