# SPDX-License-Identifier: Apache-2.0
"""Compose the light field of three pictures at three distances, from public-domain photographs.

Usage: python scripts/compose_planes.py (needs scikit-image, whose sample pictures it takes)

Each picture stands on a plane that is sharp at one focus setting a. Pixel u of a micro image sees a
plane shifted by a (u - c) micro lenses; the textures have M samples a micro lens, so that the shift
is a whole number of samples, and each pixel averages over the width of its micro lens.
"""

import numpy as np
from scipy.ndimage import uniform_filter
from skimage import data
from skimage.transform import resize

from plenofir.images import write_png
from plenofir.project import DATA

M = 5
LENSES = (80, 150)  # rows, columns
MARGIN = 20 * M
TARGET = DATA / "planes_5x5.png"

# Background first, then from far to near: texture, a' = a M, and the part of the scene in micro
# lenses (top, bottom, left, right) that it covers, None for all of it.
LAYERS = (
    (data.brick, -5, None),
    (data.coffee, -3, (14, 66, 6, 62)),
    (data.chelsea, 1, (24, 72, 46, 106)),
    (data.astronaut, 5, (10, 64, 92, 144)),
)


def layer_view(
    texture: np.ndarray, shift: int, box: tuple[int, int, int, int] | None, v: int, u: int
) -> np.ndarray:
    """Colour and coverage of one layer as pixel (v, u) of all micro images sees it."""
    c = M // 2
    top, bottom, left, right = (-8, LENSES[0] + 8, -8, LENSES[1] + 8) if box is None else box
    size = ((bottom - top) * M, (right - left) * M)
    image = texture if texture.ndim == 3 else np.repeat(texture[:, :, None], 3, axis=2)
    canvas = np.zeros((LENSES[0] * M + 2 * MARGIN, LENSES[1] * M + 2 * MARGIN, 4))
    covered = canvas[top * M + MARGIN :, left * M + MARGIN :][: size[0], : size[1]]
    covered[:, :, :3] = resize(image, size, anti_aliasing=True)
    covered[:, :, 3] = 1
    blurred = uniform_filter(canvas, (M, M, 0))
    y = np.arange(LENSES[0]) * M + M // 2 + MARGIN + shift * (v - c)
    x = np.arange(LENSES[1]) * M + M // 2 + MARGIN + shift * (u - c)
    view: np.ndarray = blurred[np.ix_(y, x)]
    return view


def main() -> None:
    """Write the raw image."""
    raw = np.zeros((LENSES[0], M, LENSES[1], M, 3))
    textures = [(load(), shift, box) for load, shift, box in LAYERS]
    for v in range(M):
        for u in range(M):
            view = np.zeros((*LENSES, 3))
            for texture, shift, box in textures:
                layer = layer_view(texture, shift, box, v, u)
                view = layer[:, :, :3] + (1 - layer[:, :, 3:]) * view
            raw[:, v, :, u] = view
    pixels = np.clip(np.round(raw.reshape(LENSES[0] * M, LENSES[1] * M, 3) * 255), 0, 255)
    write_png(TARGET, pixels.astype(np.uint8))


if __name__ == "__main__":
    main()
