# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/focus.gif, the picture that moves in the README: the focus from plane to plane.

Usage: python scripts/focus_picture.py
"""

import numpy as np
from PIL import Image as PillowImage

from plenofir import project
from plenofir.images import read_image
from plenofir.refocus import refocus

M = 5
SCALE = 2
MILLISECONDS = 140


def main() -> None:
    """Write the picture."""
    raw = read_image(project.DATA / "planes_5x5.png")
    frames = []
    for shift in (*range(-M, M + 1), *range(M - 1, -M, -1)):
        image = refocus(raw, M, f"{shift}/{M}")
        rows, columns = (size // SCALE for size in image.shape[:2])
        blocks = image[: rows * SCALE, : columns * SCALE].astype(np.uint16)
        small = blocks.reshape(rows, SCALE, columns, SCALE, 3).mean(axis=(1, 3)).round()
        frames.append(PillowImage.fromarray(small.astype(np.uint8)))
    # One palette for all, so that nothing but the focus changes.
    width, height = frames[0].size
    sheet = PillowImage.new("RGB", (width, height * len(frames)))
    for number, frame in enumerate(frames):
        sheet.paste(frame, (0, number * height))
    palette = sheet.quantize(128)
    first, *others = [f.quantize(palette=palette, dither=PillowImage.Dither.NONE) for f in frames]
    first.save(
        project.root() / "docs" / "images" / "focus.gif",
        save_all=True,
        append_images=others,
        duration=MILLISECONDS,
        loop=0,
    )


if __name__ == "__main__":
    main()
