# SPDX-License-Identifier: Apache-2.0
"""Compiled loops of focused cameras: micro images, enlarged by v, laid over each other.

The pixel at d from the centre C of its micro image is at C + v d of the picture that is refocused
to v. Each micro image is read where the places of the picture within its reach have it.

Arrays are filled element by element, as in `plenofir.refocus.compiled.parameters`.
"""

import numpy as np
import numpy.typing as npt

from plenofir.ground.kept_code import compiled

Floats32 = npt.NDArray[np.float32]
Floats = npt.NDArray[np.float64]


@compiled
def lay_over(
    pixels: Floats32,  # raw capture without its dark level, shape (rows, columns, channels)
    # What share of the light its pixels get, shape (rows, columns); 0 for those that do not count.
    light: Floats32,
    # For each micro image (y, x) of its centre, the inverse virtual depth at which its lens is
    # sharpest, and 0, or 1 if all depths are alike to it; shape (n, 4).
    lenses: Floats,
    reach: float,  # radius within which pixels of a micro image count
    pitch: float,  # distance of micro images in pixels
    inverse: Floats32,  # 1 / v at each place of the picture; nan where there is none
    widest: float,  # largest |v| in the picture
    # Pixels of the capture from one place to the next; the first is half a step less half a pixel
    # from the capture's first.
    step: float,
    # Results are added to: pixels and light times the lens's weight; if `squares` has places,
    # squares of the first channel over the light times the weight, and squares of light times
    # weight.
    sums: Floats32,
    shares: Floats32,
    squares: Floats32,
) -> None:
    """Add up what the micro images show at each place of a picture."""
    rows, columns = inverse.shape
    height, width, channels = pixels.shape
    first = (step - 1) / 2
    for n in range(lenses.shape[0]):
        y, x, best, alike = lenses[n]
        far = reach * widest
        top = max(0, int(np.ceil((y - far - first) / step)))
        bottom = min(rows - 1, int(np.floor((y + far - first) / step)))
        left = max(0, int(np.ceil((x - far - first) / step)))
        right = min(columns - 1, int(np.floor((x + far - first) / step)))
        for r in range(top, bottom + 1):
            down = first + r * step - y
            for c in range(left, right + 1):
                q = np.float64(inverse[r, c])
                dy, dx = down * q, (first + c * step - x) * q
                if not dy * dy + dx * dx <= reach * reach:
                    continue
                py, px = y + dy, x + dx
                j, i = int(np.floor(py)), int(np.floor(px))
                if j < 0 or i < 0 or j + 1 >= height or i + 1 >= width:
                    continue
                fy, fx = py - j, px - i
                w00, w01 = (1 - fy) * (1 - fx), (1 - fy) * fx
                w10, w11 = fy * (1 - fx), fy * fx
                if (
                    light[j, i] <= 0
                    or light[j, i + 1] <= 0
                    or light[j + 1, i] <= 0
                    or light[j + 1, i + 1] <= 0
                ):
                    continue
                lit = (
                    w00 * light[j, i]
                    + w01 * light[j, i + 1]
                    + w10 * light[j + 1, i]
                    + w11 * light[j + 1, i + 1]
                )
                weight = 1.0
                if alike == 0:
                    blur = pitch * (best - q)
                    weight = 1 / max(blur * blur, 0.25) ** 2
                for k in range(channels):
                    value = (
                        w00 * pixels[j, i, k]
                        + w01 * pixels[j, i + 1, k]
                        + w10 * pixels[j + 1, i, k]
                        + w11 * pixels[j + 1, i + 1, k]
                    )
                    sums[r, c, k] += weight * value
                    if k == 0 and squares.size > 0:
                        squares[r, c, 0] += weight * value * value / lit
                        squares[r, c, 1] += weight * weight * lit * lit
                shares[r, c] += weight * lit
