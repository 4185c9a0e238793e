# SPDX-License-Identifier: Apache-2.0
"""Pictures to be looked at: black, white, gamma, colours. Data stay linear, in files of their own.

Commands and the viewer show values v as 2^(EV / 2.2) ((v - black) / (white - black))^(1 / gamma) of
what the screen can. One EV is twice the light there, as screens have a gamma of 2.2.
"""

import io
import re
from typing import Any, NamedTuple

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.images import SCREEN_GAMMA, Image, Picture

# Percentiles of the picture that auto takes for black and white.
_BLACK, _WHITE = 0.1, 99.9
# What reaches this share of white is exposed already, unless it is linear.
_BRIGHT = 0.5
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

    def apply(self, image: Image, dtype: type[np.integer] | None = None) -> Image:
        """The picture as it is shown, over the range of its type, or of another one."""
        kind = np.dtype(dtype or image.dtype)
        most = int(np.iinfo(kind).max)
        levels = (np.arange(_most(image) + 1) - self.black) / (self.white - self.black)
        shown = 2 ** (self.ev / SCREEN_GAMMA) * np.maximum(levels, 0) ** (1 / self.gamma)
        # Halves up, as the viewer rounds.
        table = np.floor(most * np.minimum(shown, 1) + 0.5).astype(kind)
        return np.asarray(table[image])

    def as_stored(self, picture: Picture) -> bool:
        """Whether values are shown as they are."""
        return self == (0, picture.full_scale, 1, 0) and self.white == _most(picture.pixels)

    def shown(self, picture: Picture) -> Picture:
        """The picture as it is shown, with what its numbers mean then."""
        gamma = None if picture.gamma is None else picture.gamma * self.gamma
        return Picture(self.apply(picture.pixels), _most(picture.pixels), gamma, picture.profile)

    def words(self) -> str:
        """For a summary."""
        ev = f", {self.ev:+g} EV" if self.ev else ""
        return f"black {self.black:.0f}, white {self.white:.0f}, gamma {self.gamma:g}{ev}"


def exposure(
    picture: Picture, micro_image_size: int, setting: str = "auto", gamma: float | None = None
) -> Exposure:
    """Exposure for all pictures of an aligned raw image.

    `setting`: "off" is 0 EV. "auto" takes black and white from the picture at a = 0 (0.1 and 99.9 %
    of its values are below), and leaves as it is what is even, or not linear and reaches half of
    white. A number is EV from values as they are: 1 for twice the light, -1 for half; "auto+1" adds
    EV to auto. `gamma`: None takes 2.2 for linear light, and 1 for what is not known. A picture
    that is no light field has M = 1. Raises `InputError` for another setting.
    """
    linear = picture.gamma is not None and SCREEN_GAMMA / picture.gamma > 1.5
    brighter = SCREEN_GAMMA / (picture.gamma or SCREEN_GAMMA) if gamma is None else gamma
    found = _SETTING.fullmatch("0" if setting == "off" else setting)
    ev = float(found[2] or 0) if found and setting else np.nan
    if not abs(ev) <= _MOST_EV:
        raise InputError(
            f"{setting!r} is not an exposure; use auto, off, or a number of EV such as 1.5",
            where="exposure",
        )
    stored = Exposure(0.0, float(picture.full_scale), brighter, ev)
    if found is None or not found[1]:
        return stored
    middle = _binned(picture.pixels, micro_image_size)
    black, white = (float(level) for level in np.percentile(middle, [_BLACK, _WHITE]))
    even = white - black < 1
    if even or (not linear and white >= _BRIGHT * picture.full_scale):
        return stored
    return stored._replace(black=black, white=white)


def _binned(image: Image, m: int) -> Image:
    """The picture at a = 0, a pixel for each micro lens: means of M x M pixels, or of the views."""
    if image.ndim > 3:
        count = image.shape[0] * image.shape[1]
        return np.asarray((image.sum((0, 1), np.int64) + count // 2) // count)
    rows, columns = (n // m for n in image.shape[:2])
    lenses = image[: rows * m, : columns * m].reshape(rows, m, columns, m, *image.shape[2:])
    return np.asarray((lenses.sum((1, 3), np.int64) + m**2 // 2) // m**2)


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
    except Exception as error:  # It raises whatever a damaged profile leads it to.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"its colour profile cannot be used ({reason}); save the picture in sRGB or "
            "without a profile",
            where=where,
        ) from None
    return Picture(pixels, picture.full_scale, SCREEN_GAMMA)
