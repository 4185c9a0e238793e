# SPDX-License-Identifier: Apache-2.0
"""Put the results of several runs of ``make sim`` side by side: the picture in the README.

Usage: python scripts/readme_picture.py PICTURE.jpg SCALE OUT...

SCALE is the whole number by which the images are made smaller.

For instance, after make sim A=-3/5 OUT=build/a, A=0 OUT=build/b and A=3/5 OUT=build/c:
python scripts/readme_picture.py docs/images/flower.jpg 2 build/a build/b build/c
"""

import sys
from pathlib import Path

import imageio.v3 as iio
import numpy as np

from plenofir.images import read_image

GAP = 8


def main() -> None:
    """Write the picture."""
    target, scale = Path(sys.argv[1]), int(sys.argv[2])
    panels = []
    for folder in map(Path, sys.argv[3:]):
        image = read_image(folder / "refocused.png").astype(np.float64)
        rows, columns = (size // scale * scale for size in image.shape[:2])
        blocks = image[:rows, :columns].reshape(rows // scale, scale, columns // scale, scale, -1)
        panels.append(blocks.mean(axis=(1, 3)).round().astype(np.uint8))
        panels.append(np.full((panels[-1].shape[0], GAP, 3), 255, np.uint8))
    iio.imwrite(target, np.hstack(panels[:-1]), quality=88)


if __name__ == "__main__":
    main()
