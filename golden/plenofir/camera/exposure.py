# SPDX-License-Identifier: Apache-2.0
"""Pictures to be looked at: black, white and gamma. Data stay linear, in files of their own."""

from typing import NamedTuple

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image

# Percentiles of the picture that auto takes for black and white.
_BLACK, _WHITE = 0.1, 99.9
_MOST_EV = 16.0


class Exposure(NamedTuple):
    """How values of a picture are shown."""

    black: float
    white: float
    gamma: float

    def apply(self, image: Image) -> Image:
        """The picture from black to white over the range of its type, brightened by gamma."""
        most = int(np.iinfo(image.dtype).max)
        levels = (np.arange(most + 1) - self.black) / (self.white - self.black)
        table = np.rint(most * np.clip(levels, 0, 1) ** (1 / self.gamma)).astype(image.dtype)
        return np.asarray(table[image])


def exposure(raster: Image, micro_image_size: int, setting: str, gamma: float = 1.0) -> Exposure:
    """Exposure for all pictures of an aligned raw image.

    `setting`: "auto" takes black and white from the picture at a = 0 (0.1 and 99.9 % of its values
    are below); a number in EV, 1 for twice as bright, -1 for half; "off" is 0 EV. Raises
    `InputError` for anything else.
    """
    if setting == "auto":
        picture = refocus(raster, micro_image_size, 0, upsample=False)
        black, white = np.percentile(picture, [_BLACK, _WHITE])
        return Exposure(float(black), float(max(white, black + 1)), gamma)
    try:
        ev = 0.0 if setting == "off" else float(setting)
    except ValueError:
        ev = np.nan
    if not abs(ev) <= _MOST_EV:
        raise InputError(
            f"{setting!r} is no exposure; use auto, off, or a number of EV such as 1.5",
            where="exposure",
        )
    return Exposure(0.0, float(np.iinfo(raster.dtype).max) / 2**ev, gamma)
