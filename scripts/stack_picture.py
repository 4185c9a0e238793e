# SPDX-License-Identifier: Apache-2.0
"""Put the all-in-focus picture and the depth index of ``make sim STACK=`` side by side.

Usage: python scripts/stack_picture.py PICTURE.jpg OUT

For instance, after make sim RAW=golden/plenofir/data/planes_5x5.png M=5 STACK="-1 -3/5 1/5 1"
RADIUS=2 OUT=build/planes: python scripts/stack_picture.py docs/images/stack.jpg build/planes
"""

import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np

from plenofir.images import read_image

GAP = 8


def main() -> None:
    """Write the picture."""
    target, folder = Path(sys.argv[1]), Path(sys.argv[2])
    sharp = read_image(folder / "all_in_focus.png")
    index = read_image(folder / "depth_index.png")
    gap = np.full((sharp.shape[0], GAP, 3), 255, np.uint8)
    iio.imwrite(target, np.hstack([sharp, gap, np.dstack([index] * 3)]), quality=85)


if __name__ == "__main__":
    main()
