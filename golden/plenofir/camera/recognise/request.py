# SPDX-License-Identifier: Apache-2.0
"""Requests of a person beyond a file's content: a part of the light field, other colours."""

import numpy as np

from plenofir.camera.captures.colours import Colours, gains_of_text
from plenofir.camera.recognise.source import Hints
from plenofir.ground.errors import InputError
from plenofir.ground.images import SCREEN_GAMMA, Image, Picture
from plenofir.ground.whole_numbers import whole_numbers


def as_asked(picture: Picture, micro_image_size: int, hints: Hints, where: str = "") -> Picture:
    """A light field cropped, and balanced by numbers, as the hints say.

    `picture`: an aligned raw image, or views (v, u, t, s[, 3]) that are no square. Raises
    `InputError` for a part that lies outside, or colours of a grey light field; `where` is its
    name.
    """
    pixels, gains = picture.pixels, gains_of_text(hints.white_balance)
    if hints.crop is not None:
        pixels = _cropped(pixels, micro_image_size, hints.crop)
    if gains is not None:
        if pixels.ndim not in (3, 5):
            raise InputError(
                f"{where}: is grey, it has no colours to balance" if where else "is for colours",
                where="white_balance",
            )
        pixels = _balanced(picture, pixels, gains)
    return picture._replace(pixels=pixels)


def _cropped(pixels: Image, m: int, text: str) -> Image:
    """A part in pixels of a refocused picture, LEFT,TOP,WIDTH,HEIGHT, in whole micro images."""
    numbers = whole_numbers(text, 4)
    if numbers is None:
        raise InputError(
            f"{text!r} is no part of a picture; write LEFT,TOP,WIDTH,HEIGHT as in 200,100,640,480",
            where="crop",
        )
    left, top, width, height = numbers
    # Each pixel of a view is one of the picture.
    is_views = pixels.ndim > 3
    step = 1 if is_views else m
    rows, columns = pixels.shape[2:4] if is_views else pixels.shape[:2]
    if not (width and height) or left + width > columns or top + height > rows:
        raise InputError(
            f"{text} does not lie within the picture of {columns} x {rows} pixels", where="crop"
        )
    part = tuple(
        slice(first // step * step, -(-(first + count) // step) * step)
        for first, count in ((top, height), (left, width))
    )
    return np.ascontiguousarray(pixels[:, :, *part] if is_views else pixels[part])


def _balanced(picture: Picture, pixels: Image, gains: Colours) -> Image:
    """Pixels whose light is multiplied by gains, as much as there is room for below white."""
    most = max(picture.full_scale, int(picture.pixels.max(initial=0)))
    levels = np.arange(np.iinfo(pixels.dtype).max + 1, dtype=np.float64)
    result = np.empty_like(pixels)
    for channel, gain in enumerate(gains):
        raised = np.minimum(np.rint(levels * gain ** (1 / (picture.gamma or SCREEN_GAMMA))), most)
        result[..., channel] = raised.astype(pixels.dtype)[pixels[..., channel]]
    return result
