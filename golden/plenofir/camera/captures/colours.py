# SPDX-License-Identifier: Apache-2.0
"""Colours of a sensor: its filter mosaic, hot pixels, and what it sees of white."""

from typing import cast

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.moving import PixelMap
from plenofir.camera.resampling.mosaic import BAYER_ORDERS, BayerOrder, interpolate_mosaic
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir.refocus.operator import Image

# Sides of the blocks in which the four colours of a mosaic are compared, and how many of them.
_BLOCK, _MOST_BLOCKS = 16, 4000
# Greens differ from red and blue by this share of the brightness, and by this many times what they
# differ from each other.
_COLOURED, _GREENS_ALIKE = 0.03, 3.0
# A hot pixel is above all its neighbours by this share of full scale and so many times as bright,
# or by the second share; in a dark frame above its median by so many standard deviations. More than
# a share of all pixels are no defects.
_ABOVE, _FAR_ABOVE, _TIMES, _DEVIATIONS, _MOST_HOT = 0.08, 0.35, 2.5, 10.0, 1e-3
# Parts of a white image that are brighter than this share of the brightest tell its colours;
# unless more than a share of them is clipped.
_BRIGHT, _CLIPPED = 0.5, 0.02
# Largest factor of a colour over green.
_LARGEST_GAIN = 20.0

Colours = tuple[float, float, float]


def noticed_mosaic(pixels: Image) -> tuple[BayerOrder, ...]:
    """The orders of colours that a grey picture's pixels speak for; none if it has no mosaic.

    `pixels`: shape (rows, columns). Green lies on one of the two diagonals, and both greens are
    alike; which of the others is red cannot be seen. All four orders if micro images of a few
    pixels hide the diagonal.
    """
    if pixels.ndim != 2 or min(pixels.shape) < 2 * _BLOCK:
        return ()
    rows, columns = (n // _BLOCK for n in pixels.shape)
    step = max(1, rows * columns // _MOST_BLOCKS)
    parts = pixels[: rows * _BLOCK, : columns * _BLOCK]
    blocks = parts.reshape(rows, _BLOCK, columns, _BLOCK).swapaxes(1, 2).reshape(-1, _BLOCK, _BLOCK)
    few = blocks[::step].astype(np.float32)
    means = np.array([few[:, y::2, x::2].mean(axis=(1, 2)) for y in (0, 1) for x in (0, 1)])
    level = float(np.sqrt((means.mean(axis=0) ** 2).mean()))
    likely: list[BayerOrder] = []
    orders: tuple[tuple[tuple[int, ...], tuple[BayerOrder, BayerOrder]], ...] = (
        ((1, 2, 0, 3), ("rggb", "bggr")),
        ((0, 3, 1, 2), ("grbg", "gbrg")),
    )
    for (one, other, first, second), names in orders:
        greens = float(np.sqrt(((means[one] - means[other]) ** 2).mean()))
        middle = (means[one] + means[other] - means[first] - means[second]) / 2
        apart = float(np.sqrt((middle**2).mean()))
        if apart > _COLOURED * level and apart > _GREENS_ALIKE * greens:
            likely += names
    return tuple(likely)


def order_of_mosaic(picture: Picture, hint: str | None, where: str) -> BayerOrder | None:
    """Order of a capture's colour mosaic: as told, or as its file has it; None if it has none.

    `hint`: an order, "none", or None. Raises `InputError` if the pixels have a mosaic whose order
    is not known, or what is told does not go with the file.
    """
    order = hint or picture.mosaic
    if order in (None, "none"):
        orders = noticed_mosaic(picture.pixels) if hint is None else ()
        if orders:
            raise InputError(
                "its pixels have a colour mosaic whose order its file does not tell; give --bayer "
                f"{' or '.join(orders)}, whichever shows red as red, or --bayer none",
                where=where,
            )
        return None
    if order not in BAYER_ORDERS:
        raise InputError(f"there is no mosaic {order!r}; use rggb, grbg, gbrg or bggr")
    if picture.pixels.ndim != 2:
        if hint:
            raise InputError(
                "has colours already, and a mosaic has one channel; leave out --bayer", where=where
            )
        return None
    return order


def even_mosaic(pixels: Image, full_scale: int) -> Image:
    """A mosaic whose four colours are made as bright as the brightest: grey levels."""
    # A single row or column has two of the colours only.
    rows, columns = (range(min(length, 2)) for length in pixels.shape)
    parts = [np.s_[down::2, right::2] for down in rows for right in columns]
    means = [float(pixels[part].mean()) for part in parts]
    result = np.empty_like(pixels)
    for part, mean in zip(parts, means, strict=True):
        scaled = np.rint(pixels[part].astype(np.float32) * (max(means) / max(mean, 1e-3)))
        result[part] = np.minimum(scaled, full_scale)
    return result


def grey_of(pixels: Image, order: BayerOrder | None, full_scale: int) -> Image32:
    """Grey levels of a capture, of all pixels of a mosaic."""
    return grey(pixels if order is None else even_mosaic(pixels, full_scale))


def order_before(order: BayerOrder, place: PixelMap) -> BayerOrder:
    """Order of a white image's mosaic by the capture's: it begins elsewhere, or is turned.

    The same where pixels are added up, or micro lenses alone were moved.
    """
    matrix, shift, _ = place
    is_turned = any((np.abs(matrix) == one).all() for one in (np.eye(2), np.eye(2)[::-1]))
    if not is_turned or (shift != np.rint(shift)).any():
        return order
    places = [matrix @ divmod(n, 2) + shift for n in range(4)]
    return cast(BayerOrder, "".join(order[int(y % 2) * 2 + int(x % 2)] for y, x in places))


def developed(pixels: Image, order: BayerOrder | None, where: str) -> Image:
    """RGB of a mosaic; other pictures as they are."""
    return pixels if order is None else interpolate_mosaic(pixels, order, where=where)


def hot_in_dark(dark: Image) -> Image:
    """Which pixels of a dark frame are hot, by their scatter."""
    levels = dark if dark.ndim == 2 else dark.max(axis=2)
    middle = float(np.median(levels))
    spread = 1.4826 * float(np.median(np.abs(levels - middle)))
    return np.asarray(levels > middle + max(_DEVIATIONS * spread, _DEVIATIONS))


def without_hot_pixels(
    pixels: Image, full_scale: int, *, mosaic: bool, dark: Image | None = None
) -> tuple[Image, int]:
    """A capture whose hot pixels are replaced by the median of their neighbours, and their number.

    `pixels`: as the sensor has them. `dark`: a dark frame, which tells them. Without one they are
    those that are far above all 24 around them, each colour of a mosaic made equally bright; in RGB
    none, as other programs smeared them.
    """
    if dark is not None:
        hot = hot_in_dark(dark)
    elif pixels.ndim == 3:
        return pixels, 0
    else:
        levels = grey_of(pixels, "rggb" if mosaic else None, full_scale)
        around = np.ones((5, 5), bool)
        around[2, 2] = False
        most = ndimage.maximum_filter(levels, footprint=around, mode="mirror")
        low, high = most + _ABOVE * full_scale, most + _FAR_ABOVE * full_scale
        hot = levels > np.minimum(np.maximum(_TIMES * most, low), high)
    places = np.argwhere(hot)
    if not len(places) or len(places) > max(_MOST_HOT * hot.size, 1):
        return pixels, 0
    step = 2 if mosaic else 1
    result = pixels.copy()
    moves = np.array(
        [(y, x) for y in (-step, 0, step) for x in (-step, 0, step) if (y, x) != (0, 0)]
    )
    near = places[:, np.newaxis] + moves
    end = np.array(hot.shape) - 1
    near = np.abs(near)
    near = np.minimum(near, 2 * end - near)
    values = pixels[near[..., 0], near[..., 1]].astype(np.float32)
    values[hot[near[..., 0], near[..., 1]]] = np.nan
    # Hot pixels whose neighbours are all hot stay.
    is_measured = ~np.isnan(values.reshape(len(values), len(moves), -1)).all((1, 2))
    rows, columns = places[is_measured].T
    result[rows, columns] = np.rint(np.nanmedian(values[is_measured], axis=1))
    return result, len(places)


def colours_of_white(
    white: Image, order: BayerOrder | None, full_scale: int, dark: Image | None = None
) -> Colours | None:
    """What a sensor sees of white: red, green and blue, the largest of them 1.

    `white`: RGB, or a mosaic of that order. None if it is grey, or clipped where it tells.
    """
    if white.ndim == 2 and order is None:
        return None
    levels = white.astype(np.float32)
    if dark is not None:
        levels = levels - (dark if dark.ndim == white.ndim else dark[..., np.newaxis])
    light = grey_of(white, order, full_scale) if order else levels.mean(axis=2)
    bright = light > _BRIGHT * np.percentile(light, 99.5)
    # A channel that is clipped looks weaker than it is: its gain would tint every picture.
    if (white[bright] >= full_scale).mean() > _CLIPPED:
        return None
    means = np.zeros(3)
    for number, colour in enumerate("rgb"):
        if order is None:
            part = levels[..., number][bright]
        else:
            places = [divmod(n, 2) for n, name in enumerate(order) if name == colour]
            of_colour = [np.s_[y::2, x::2] for y, x in places]
            part = np.concatenate([levels[one][bright[one]] for one in of_colour])
        means[number] = part.mean() if part.size else 0.0
    if means.min() <= 0:
        return None
    red, green, blue = (round(float(value), 5) for value in means / means.max())
    return red, green, blue


def gains_of_text(white_balance: str) -> Colours | None:
    """Factors of a white balance by numbers, RED,BLUE over green; None for auto and off.

    The least of the three is 1, so that what is clipped stays white. Raises `InputError` for other
    words and for numbers that no light has.
    """
    if white_balance in ("auto", "off"):
        return None
    try:
        red, blue = map(float, white_balance.split(","))
    except ValueError:
        red = blue = 0.0
    if not all(1 / _LARGEST_GAIN <= gain <= _LARGEST_GAIN for gain in (red, blue)):
        raise InputError(
            f"{white_balance!r} is no white balance; use auto, off, or what red and blue are "
            f"multiplied by, RED,BLUE from {1 / _LARGEST_GAIN:g} to {_LARGEST_GAIN:g}: 1.9,1.4",
            where="white_balance",
        )
    least = min(red, 1.0, blue)
    return red / least, 1 / least, blue / least


def gains_for(colours: Colours) -> Colours:
    """Factors that make white white; the colour that is amplified least keeps its full scale."""
    top = max(colours)
    return top / colours[0], top / colours[1], top / colours[2]
