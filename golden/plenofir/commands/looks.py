# SPDX-License-Identifier: Apache-2.0
"""How commands show pictures of a light field: made of finer values, exposed, rounded once."""

import re
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from fractions import Fraction

    from plenofir.camera.exposure import Exposure
    from plenofir.ground.images import Image, Picture
    from plenofir.refocus import Aperture


class Look(NamedTuple):
    """How pictures of a light field are shown."""

    field: "Picture"
    source: "Image"  # pixels that pictures are to be made of
    unit: int = 1  # values of the source for one of the field
    exposure: "Exposure | None" = None  # None for values as they are

    def __call__(self, image: "Image") -> "Picture":
        """A picture made of the source, with the field's number of bits."""
        if self.exposure is None:
            return self.field.like(image)
        return self.exposure.shown(self.field, image, self.unit)

    def of_field(self, image: "Image") -> "Picture":
        """A picture whose values are the field's own: a view say."""
        return self(image.astype(self.source.dtype) * self.source.dtype.type(self.unit))

    def words(self) -> str:
        """For the user; empty if nothing is changed."""
        return (
            f"exposed: {self.exposure.words()} (--exposure off: as it is)" if self.exposure else ""
        )


def look_of(field: "Picture", exposure: "Exposure | None") -> Look:
    """How a light field is shown with an exposure, None for values as they are."""
    from plenofir.camera.exposure import finer

    if exposure is None or exposure.as_stored(field):
        return Look(field, field.pixels)
    return Look(field, *finer(field), exposure)


def look_for(field: "Picture", m: int, setting: str, gamma: float | None) -> Look:
    """How a light field is shown with the options for exposure."""
    from plenofir.camera.exposure import exposure

    if setting == "off" and gamma is None:
        return look_of(field, None)
    return look_of(field, exposure(field, m, setting, gamma))


def _reals(text: str, option: str, counts: tuple[int, ...], form: str) -> list[float]:
    """Numbers of an option, separated by commas or blanks."""
    try:
        numbers = [float(word) for word in re.split(r"[,\s]+", text.strip())]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not all(map(isfinite, numbers)):
        raise InputError(f"{text!r} is not understood; write {form}", where=option)
    return numbers


def aperture_of(text: str | None) -> "Aperture | None":
    """Aperture of its option; None for all views."""
    from plenofir.refocus import Aperture

    if text is None:
        return None
    form = "SIZE or SIZE,RIGHT,DOWN such as 0.4 or 0.3,-0.5,0"
    size, *centre = _reals(text, "aperture", (1, 3), form)
    if not 0 <= size <= 1 or any(abs(place) > 1 for place in centre):
        raise InputError(
            f"{text} is not in the pupil; SIZE is 0 to 1, RIGHT and DOWN are -1 to 1",
            where="aperture",
        )
    return Aperture(size, *centre)


def tilt_of(text: str | None) -> tuple[float, float]:
    """Rises of a to the right and downwards, of its option."""
    if text is None:
        return 0.0, 0.0
    right, down = _reals(text, "tilt", (2,), "RIGHT,DOWN such as 0.3,0")
    return right, down


def setting_text(a: "Fraction", micro_image_size: int) -> str:
    """A focus setting as the user would write it: a fraction on the grid of M, else a decimal."""
    return str(a) if (a * micro_image_size).denominator == 1 else f"{float(a):.6g}"
