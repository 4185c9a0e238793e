# SPDX-License-Identifier: Apache-2.0
"""Compose the flower light field from its views, and the part that ``make sim`` refocuses.

Usage: python scripts/compose_flower.py FOLDER_OF_VIEWS

The views are ``IMG_0002_NNN_RR_CC.png`` of the credited repository (see
``golden/plenofir/data/CREDITS.md``): RR counts horizontal steps, CC vertical ones.
"""

import re
import sys
from pathlib import Path

import numpy as np

from plenofir.fpga.simulate.run import DEFAULT_RAW, FLOWER, FLOWER_MICRO_IMAGE_SIZE
from plenofir.images import read_image, write_png

# Central view of the folder, and the part of each view that is kept (rows, columns).
CENTRE = 5
WINDOW = (slice(74, 234), slice(46, 206))
# Rows and columns of the raw image that are its detail.
DETAIL = (slice(50, 450), slice(180, 610))


def main() -> None:
    """Write the raw image and its detail."""
    folder = Path(sys.argv[1])
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


if __name__ == "__main__":
    main()
