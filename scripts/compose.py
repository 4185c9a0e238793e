# SPDX-License-Identifier: Apache-2.0
"""Compose the light fields that the package ships, golden/plenofir/data.

Usage: python scripts/compose.py planes
       python scripts/compose.py flower FOLDER_OF_VIEWS

`planes` takes sample pictures of scikit-image. `flower` takes `IMG_0002_NNN_RR_CC.png` of the
repository that `golden/plenofir/data/CREDITS.md` names: RR counts horizontal steps, CC vertical.
"""

import re
import sys
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter
from skimage import data
from skimage.transform import resize

from plenofir.fpga.screen.first_light import FLOWER, FLOWER_MICRO_IMAGE_SIZE
from plenofir.fpga.simulate.request import DEFAULT_RAW
from plenofir.ground.images import read_image, write_png
from plenofir.ground.project import DATA

M = 5
LENSES = (80, 150)  # rows, columns of the planes
MARGIN = 20 * M

# Background first, then from far to near: texture, a' = a M, and the part of the scene in micro
# lenses (top, bottom, left, right) that it covers.
LAYERS = (
    (data.brick, -5, (-8, LENSES[0] + 8, -8, LENSES[1] + 8)),
    (data.coffee, -3, (14, 66, 6, 62)),
    (data.chelsea, 1, (24, 72, 46, 106)),
    (data.astronaut, 5, (10, 64, 92, 144)),
)

# Central view of the flower's folder, and the part of each view that is kept (rows, columns).
CENTRE = 5
WINDOW = (slice(74, 234), slice(46, 206))
# Rows and columns of the raw image that are its detail.
DETAIL = (slice(50, 450), slice(180, 610))


def plane_seen(
    texture: np.ndarray, shift: int, box: tuple[int, int, int, int], v: int, u: int
) -> np.ndarray:
    """Colour and coverage of a plane, as pixel (v, u) of all micro images sees it.

    It sees a plane shifted by a (u - c) micro lenses. Textures have M samples a micro lens, so that
    this is a whole number of samples; each pixel averages over the width of its micro lens.
    """
    top, bottom, left, right = box
    size = ((bottom - top) * M, (right - left) * M)
    image = texture if texture.ndim == 3 else np.repeat(texture[:, :, None], 3, axis=2)
    canvas = np.zeros((LENSES[0] * M + 2 * MARGIN, LENSES[1] * M + 2 * MARGIN, 4))
    covered = canvas[top * M + MARGIN :, left * M + MARGIN :][: size[0], : size[1]]
    covered[:, :, :3] = resize(image, size, anti_aliasing=True)
    covered[:, :, 3] = 1
    blurred = uniform_filter(canvas, (M, M, 0))
    c = M // 2
    y = np.arange(LENSES[0]) * M + c + MARGIN + shift * (v - c)
    x = np.arange(LENSES[1]) * M + c + MARGIN + shift * (u - c)
    view: np.ndarray = blurred[np.ix_(y, x)]
    return view


def planes() -> None:
    """Three pictures before a wall, each on a plane that is sharp at one focus setting a."""
    raw = np.zeros((LENSES[0], M, LENSES[1], M, 3))
    textures = [(load(), shift, box) for load, shift, box in LAYERS]
    for v in range(M):
        for u in range(M):
            for texture, shift, box in textures:
                layer = plane_seen(texture, shift, box, v, u)
                raw[:, v, :, u] = layer[:, :, :3] + (1 - layer[:, :, 3:]) * raw[:, v, :, u]
    pixels = np.clip(np.round(raw.reshape(LENSES[0] * M, LENSES[1] * M, 3) * 255), 0, 255)
    write_png(DATA / "planes_5x5.png", pixels.astype(np.uint8))


def flower(folder: Path) -> None:
    """The flower from its views, and the part of it that `make sim` refocuses."""
    reach = FLOWER_MICRO_IMAGE_SIZE // 2
    views = {}
    for path in folder.glob("IMG_*.png"):
        horizontal, vertical = map(int, re.findall(r"\d\d(?=_|\.)", path.name)[-2:])
        views[vertical - CENTRE, horizontal - CENTRE] = path
    steps = range(-reach, reach + 1)
    # Axes: pixel row, pixel column in the micro image, micro lens row, micro lens column.
    light_field = np.array([[read_image(views[v, u])[WINDOW] for u in steps] for v in steps])
    rows, columns = (FLOWER_MICRO_IMAGE_SIZE * n for n in light_field.shape[2:4])
    raw = light_field.transpose(2, 0, 3, 1, 4).reshape(rows, columns, 3)
    write_png(FLOWER, raw)
    write_png(DEFAULT_RAW, np.ascontiguousarray(raw[DETAIL]))


def main() -> int:
    """Write the light field that is asked for."""
    match sys.argv[1:]:
        case ["planes"]:
            planes()
        case ["flower", folder]:
            flower(Path(folder))
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
