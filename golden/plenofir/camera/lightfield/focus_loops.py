# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of the picture that is sharp everywhere.

Arrays are filled element by element, as in `plenofir.refocus.compiled.parameters`. Lines hold the
samples of all channels, one pixel after the other.
"""

from typing import Any

import numpy as np

from plenofir.ground.kept_code import compiled


@compiled
def add_slice(image: Any, shifts: Any, shift: Any, top: Any, left: Any, picture: Any) -> None:
    """Add a part of a slice, times the share that it has at each sample's own shift.

    `top`, `left`: line and sample of the picture where the part begins.
    """
    one, place = np.float32(1), np.float32(shift)
    for y in range(image.shape[0]):
        line, shift_line, result = image[y], shifts[top + y], picture[top + y]
        for k in range(line.size):
            share = max(one - abs(shift_line[left + k] - place), np.float32(0))
            result[left + k] += share * np.float32(line[k])


@compiled
def sharpened_in_range(
    soft: Any,
    enlarged: Any,
    first: Any,
    rows: Any,  # a lens, in lines
    samples: Any,  # and along a line
    weight: Any,
    out: Any,
) -> None:
    """Sharpen lines of `soft` from `first` on, within the range of what lies a lens around.

    `enlarged`, lines of the central view, widens the range.
    """
    height, width, channels = soft.shape[0], out.shape[1], samples // rows
    gain, two = np.float32(weight), np.float32(2)
    down = np.empty(width + 2 * samples, np.float32)
    middle = np.empty(width + 2 * samples, np.float32)
    for number in range(out.shape[0]):
        r = first + number
        before, here, after = soft[max(r - rows, 0)], soft[r], soft[min(r + rows, height - 1)]
        for k in range(width):
            down[samples + k] = here[k] + gain * (two * here[k] - before[k] - after[k])
            middle[samples + k] = here[k]
        for k in range(samples):
            # Beyond the border lies the pixel at the border.
            low, high = samples + k % channels, samples + width - channels + k % channels
            down[k], middle[k] = down[low], middle[low]
            down[samples + width + k] = down[high]
            middle[samples + width + k] = middle[high]
        view, result = enlarged[number], out[number]
        for k in range(width):
            value = down[samples + k]
            value += gain * (two * value - down[k] - down[2 * samples + k])
            smallest = min(min(before[k], after[k]), min(middle[k], middle[2 * samples + k]))
            largest = max(max(before[k], after[k]), max(middle[k], middle[2 * samples + k]))
            low_end = min(np.float64(min(smallest, here[k])), view[k])
            high_end = max(np.float64(max(largest, here[k])), view[k])
            result[k] = min(max(np.float64(value), low_end), high_end)
