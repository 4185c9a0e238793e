# SPDX-License-Identifier: Apache-2.0
"""Pictures to be looked at: black, white, gamma, colours. Data stay linear, in files of their own.

Commands and the viewer show values v, x = (v - black) / (white - black), as 2^(EV / 2.2)
(x (g + x) / (1 + g x))^(1 / gamma) of what the screen can. One EV is twice the light there, as
screens have a gamma of 2.2. The shoulder g brightens dark values g times and leaves black and white
where they are: 1 changes nothing. Pictures are made of `finer` values and rounded once, here.
"""

import io
import re
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError
from plenofir.ground.images import SCREEN_GAMMA, Image, Picture

Floats = npt.NDArray[np.float64]

# Percentiles of the picture that auto takes for black and white.
_BLACK, _WHITE = 0.1, 99.9
# What reaches this share of white is exposed already, unless it is linear.
_BRIGHT = 0.5
# Auto brings the median of what has contrast to this share of the screen's white, if it is darker,
# and by at most so many EV.
_KEY, _MOST_LIFT = 0.35, 3.0
# 16 EV take the least level of 16 bits to white: larger numbers are slips of the hand.
_MOST_EV = 24.0
_SETTING = re.compile(r"(auto)?([+-]?\d+\.?\d*|[+-]?\.\d+)?")


def _most(image: Image) -> int:
    return int(np.iinfo(image.dtype).max)


class Exposure(NamedTuple):
    """How values of a picture are shown."""

    black: float
    white: float
    gamma: float  # values are brightened by it
    ev: float = 0.0
    shoulder: float = 1.0  # g

    def apply(self, image: Image, dtype: npt.DTypeLike | None = None, unit: int = 1) -> Image:
        """The picture as it is shown, over the range of its type, or of another one.

        `unit` values of the picture are one of those that black and white are given in.
        """
        kind = np.dtype(image.dtype if dtype is None else dtype)
        most = int(np.iinfo(kind).max)
        levels = np.arange(_most(image) + 1) / unit - self.black
        lightness = 2 ** (self.ev / SCREEN_GAMMA) * self._curve(levels / (self.white - self.black))
        # Halves up, as the viewer rounds.
        table = np.floor(most * np.minimum(lightness, 1) + 0.5).astype(kind)
        return np.asarray(table[image])

    def _curve(self, shares: Floats) -> Floats:
        """What the screen shows without EV, of shares between black and white."""
        light, g = np.maximum(shares, 0), self.shoulder
        return np.asarray((light * (g + light) / (1 + g * light)) ** (1 / self.gamma))

    def lifted(self, values: Floats) -> "Exposure":
        """With the shoulder that values (rows, columns[, 3]) need which are too dark for people.

        Contrast is what people look at: an even sky, and an even background, do not count.
        """
        grey = values.mean(-1) if values.ndim > 2 else values
        if min(grey.shape) < 2:
            return self
        lightness = np.minimum(
            self._curve((grey - self.black) / (self.white - self.black)), 1
        ).ravel()
        weights = np.hypot(*np.gradient(lightness.reshape(grey.shape))).ravel()
        order = np.argsort(lightness)
        below = np.cumsum(weights[order])
        key = float(lightness[order][np.searchsorted(below, below[-1] / 2)])
        if not 0 < key < _KEY:
            return self
        most = 2 ** (_MOST_LIFT * self.gamma / SCREEN_GAMMA)
        x, y = key**self.gamma, _KEY**self.gamma
        # The g whose curve has y at x.
        return self._replace(shoulder=min((y - x**2) / (x * (1 - y)), most))

    def as_stored(self, picture: Picture) -> bool:
        """Whether values are shown as they are."""
        return self == (0, picture.full_scale, 1, 0, 1) and self.white == _most(picture.pixels)

    def shown(self, picture: Picture, image: Image, unit: int = 1) -> Picture:
        """An image of a light field as it is shown, of the field's type; `unit` as in `apply`."""
        gamma = None if picture.gamma is None else picture.gamma * self.gamma
        pixels = self.apply(image, picture.pixels.dtype, unit)
        return Picture(pixels, _most(pixels), gamma, picture.profile)

    def words(self) -> str:
        """For a summary."""
        ev = f", {self.ev:+g} EV" if self.ev else ""
        lift = f", dark parts {self.shoulder:.1f} times" if self.shoulder > 1 else ""
        return f"black {self.black:.0f}, white {self.white:.0f}, gamma {self.gamma:g}{lift}{ev}"


def finer(picture: Picture) -> tuple[Image, int]:
    """Pixels in words of 16 bit that use all of it, and how many of their values one was.

    What is made of them, means of views say, keeps what a rounding to the picture's own values
    would lose.
    """
    largest = max(picture.full_scale, int(picture.pixels.max(initial=0)), 1)
    unit = max(1, 65535 // largest)
    pixels = picture.pixels
    return (pixels if unit == 1 else pixels.astype(np.uint16) * np.uint16(unit)), unit


def exposure(
    picture: Picture, micro_image_size: int, setting: str = "auto", gamma: float | None = None
) -> Exposure:
    """Exposure for all pictures of an aligned raw image.

    `setting`: "off" is 0 EV. "auto" takes black and white from the picture at a = 0 (0.1 and 99.9 %
    of its values are below), leaves both where they are in what is even, or not linear and reaches
    half of white, and brightens what is dark by a shoulder (`Exposure.lifted`). A number
    is EV from values as they are: 1 for twice the light, -1 for half; "auto+1" adds EV to auto.
    `gamma`: None takes 2.2 for linear light, and 1 for what is not known. A picture that is no
    light field has M = 1. Raises `InputError` for another setting.
    """
    return one_exposure([(picture, micro_image_size)], setting, gamma)


def one_exposure(
    pictures: Iterable[tuple[Picture, int]], setting: str = "auto", gamma: float | None = None
) -> Exposure:
    """Exposure for several light fields, each with its M: frames of a film say.

    What their values mean is alike. Auto takes the least of their blacks, the largest of their
    whites, and the shoulder of the brightest one, so that a film that fades does so.
    """
    look: Exposure | None = None
    auto = linear = False
    ends, brightest = [], np.zeros((0, 0))
    for picture, m in pictures:
        if look is None:
            look, auto = _asked_for(picture, setting, gamma)
            linear = picture.gamma is not None and SCREEN_GAMMA / picture.gamma > 1.5
        # Only auto looks at the pixels: frames of a long film need not be read for the rest.
        if not auto:
            break
        middle = _binned(picture.pixels, m)
        ends.append(np.percentile(middle, [_BLACK, _WHITE]))
        if brightest.size == 0 or middle.mean() > brightest.mean():
            brightest = middle
    if look is None:
        raise InputError("there is no picture to expose", where="exposure")
    if not auto:
        return look
    black, white = float(min(low for low, _ in ends)), float(max(high for _, high in ends))
    if white - black < 1:
        return look
    if linear or white < _BRIGHT * look.white:
        look = look._replace(black=black, white=white)
    return look.lifted(brightest)


def _asked_for(picture: Picture, setting: str, gamma: float | None) -> tuple[Exposure, bool]:
    """Exposure of values as they are, and whether auto was asked for."""
    brighter = SCREEN_GAMMA / (picture.gamma or SCREEN_GAMMA) if gamma is None else gamma
    match = _SETTING.fullmatch("0" if setting == "off" else setting)
    ev = float(match[2] or 0) if match and setting else np.nan
    if match is None or not abs(ev) <= _MOST_EV:
        raise InputError(
            f"{setting!r} is not an exposure; use auto, off, or a number of EV such as 1.5",
            where="exposure",
        )
    return Exposure(0.0, float(picture.full_scale), brighter, ev), bool(match[1])


def _binned(image: Image, m: int) -> Floats:
    """The picture at a = 0, a pixel for each micro lens: means of M x M pixels, or of the views."""
    if image.ndim > 3:
        return np.asarray(image.mean((0, 1)))
    rows, columns = (n // m for n in image.shape[:2])
    lenses = image[: rows * m, : columns * m].reshape(rows, m, columns, m, *image.shape[2:])
    return np.asarray(lenses.mean((1, 3)))


def to_srgb(picture: Picture, where: str) -> Picture:
    """The picture with the colours of sRGB, where it has another profile.

    Raises `InputError` for a damaged one; `where` is the picture's name.
    """
    if picture.profile is None:
        return picture
    from imagecodecs import cms_profile, cms_transform
    from PIL.ImageCms import ImageCmsProfile, getProfileDescription

    shape = picture.pixels.shape
    kind = "rgb" if len(shape) in (3, 5) else "gray"
    options: Any = {"colorspace": kind, "outcolorspace": kind}
    try:
        name = getProfileDescription(ImageCmsProfile(io.BytesIO(picture.profile)))
        pixels = picture.pixels
        if "sRGB" not in name or "linear" in name.lower():
            to = cms_profile("srgb" if kind == "rgb" else "gray", gamma=SCREEN_GAMMA)
            # Views below each other.
            tall = picture.pixels.reshape(-1, *shape[3:]) if len(shape) > 3 else picture.pixels
            pixels = cms_transform(tall, picture.profile, to, **options).reshape(shape)
    except Exception as error:  # the library raises anything at a damaged profile
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"its colour profile cannot be used ({reason}); save the picture in sRGB or "
            "without a profile",
            where=where,
        ) from None
    return Picture(pixels, picture.full_scale, SCREEN_GAMMA)
