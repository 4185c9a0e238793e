# SPDX-License-Identifier: Apache-2.0
"""Paths of the documentation's pictures, and functions to compose them."""

import imageio.v3 as iio
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from plenofir.camera.plots import figure_pixels
from plenofir.ground import project
from plenofir.ground.images import write_png

IMAGES = project.root() / "docs" / "images"


PLANES = project.DATA / "planes_5x5.png"


FLOWER = project.DATA / "flower_5x5.png"


JPEG_QUALITY = 85


Pixels = npt.NDArray[np.integer]


def save(name: str, picture: Pixels | Figure) -> None:
    """Write a picture; its name says the format."""
    pixels = figure_pixels(picture) if isinstance(picture, Figure) else picture
    if name.endswith(".png"):
        write_png(IMAGES / name, pixels)
    else:
        iio.imwrite(IMAGES / name, pixels, quality=JPEG_QUALITY)


def side_by_side(*panels: Pixels, gap: int = 8) -> Pixels:
    """Pictures of one height in a row, white between them; grey ones among them become RGB."""
    coloured = [np.dstack([panel] * 3) if panel.ndim == 2 else panel for panel in panels]
    white = np.full((panels[0].shape[0], gap, 3), 255, np.uint8)
    return np.hstack([part for panel in coloured for part in (white, panel)][1:])


def reduced(image: Pixels, times: int = 2) -> npt.NDArray[np.uint8]:
    """Means of blocks of pixels."""
    rows, columns = (size // times for size in image.shape[:2])
    blocks = image[: rows * times, : columns * times].astype(np.uint16)
    means = blocks.reshape(rows, times, columns, times, 3).mean(axis=(1, 3))
    return np.asarray(means.round(), dtype=np.uint8)


def enlarged(image: Pixels, times: int) -> Pixels:
    """Picture with larger pixels."""
    return image.repeat(times, axis=0).repeat(times, axis=1)


def captioned(pictures: dict[str, Pixels], part: tuple[slice, slice]) -> Pixels:
    """A square part of pictures side by side, enlarged, with their names below."""
    size = 400
    sheet = Image.new("RGB", (len(pictures) * (size + 8) - 8, size + 28), "white")
    for x, (name, picture) in zip(range(0, sheet.width, size + 8), pictures.items(), strict=True):
        sheet.paste(Image.fromarray(picture[part]).resize((size, size), 0), (x, 0))
        ImageDraw.Draw(sheet).text((x + 4, size + 3), name, "black", ImageFont.load_default(18))
    return np.asarray(sheet)
