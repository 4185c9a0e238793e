# SPDX-License-Identifier: Apache-2.0
"""Sharpening with three taps a lens apart, against the operator's blur.

With g = gcd(a', M) the shifted micro images meet an output pixel at M/g places, g/M of a lens
apart. Their mean is a box with the second moment (1 - g^2/M^2) / 12 in lenses squared; each order
of interpolation adds a box of M pixels, (1 - 1/M^2) / 12. The filter (-b, 1 + 2b, -b), whose taps
are a lens (M pixels) apart, has the second moment -2b. So b of half the operator's moment cancels
it; for natural pictures, whose power falls with the square of the frequency up to half a cycle a
lens, three quarters of it are best (`plenofir_studies.sharpening`). For an integer a all views meet
at one place, so there is no blur, and b is 0.
"""

import re
from fractions import Fraction
from math import gcd
from typing import Literal, NamedTuple

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Sums, divide_half_up

Sharpen = Literal["auto", "off"] | str | float | Fraction
"""How a picture is sharpened: by name, or the weight b, a multiple of 1/64 from 0 to 1/4."""

WEIGHT_UNITS = 64
"""Weights b are whole numbers of 1/64, for shifts and adds in hardware."""
MAX_WEIGHT_UNITS = 16
_NUMBER = re.compile(r"[0-9]{1,3}(/[0-9]{1,3}|\.[0-9]{1,9})?")
WEIGHT_ADVICE = f"use auto, off, or a multiple of 1/{WEIGHT_UNITS} from 0 to 1/4"


class Taps(NamedTuple):
    """The filter in whole numbers: (-side, 2^bits + 2 side, -side) / 2^bits."""

    side: int
    bits: int

    @property
    def centre(self) -> int:
        """Weight of the pixel itself."""
        return (1 << self.bits) + 2 * self.side

    @property
    def scale(self) -> int:
        """Gain of the integer filter for a flat picture, in each dimension."""
        return 1 << self.bits

    @property
    def gain(self) -> int:
        """Sum of the weights' magnitudes."""
        return self.centre + 2 * self.side


def taps(units: int) -> Taps:
    """The filter for b = units / 64, in its smallest whole numbers."""
    share = Fraction(units, WEIGHT_UNITS)
    return Taps(share.numerator, share.denominator.bit_length() - 1)


def derived_moment(
    micro_image_size: int, shift: int, order: int = 0, box: int | None = None
) -> Fraction:
    """Second moment of the operator along a dimension, in lenses squared.

    `box`: samples B of the box, M if None. Result: ((B^2 - g^2) + order (B^2 - 1)) / (12 M^2) with
    g = gcd(a', M).
    """
    m, common = micro_image_size, gcd(shift, micro_image_size)
    square = (m if box is None else box) ** 2
    return Fraction(square - common**2 + order * (square - 1), 12 * m**2)


def automatic_units(
    micro_image_size: int, shift: int, order: int = 0, box: int | None = None
) -> int:
    """Weight that `auto` takes, in 64ths: three quarters of the second moment; 0 for an integer a.

    Result: 64 b: with nearest neighbour 0 for an integer a, 3 where M/g = 2, 4 (b = 1/16)
    elsewhere.
    """
    if shift % micro_image_size == 0:
        return 0
    share = Fraction(3, 4) * derived_moment(micro_image_size, shift, order, box)
    return int(share * WEIGHT_UNITS + Fraction(1, 2))


def _fixed_units(sharpen: Sharpen, where: str) -> int | None:
    """Weight of an option, in 64ths; None for "auto", whose weight depends on the focus."""
    if isinstance(sharpen, str) and sharpen in ("auto", "off"):
        return None if sharpen == "auto" else 0
    bad = InputError(f"{sharpen!r} is not a weight; {WEIGHT_ADVICE}", where=where)
    if isinstance(sharpen, bool) or (isinstance(sharpen, str) and not _NUMBER.fullmatch(sharpen)):
        raise bad
    try:
        units = Fraction(sharpen) * WEIGHT_UNITS
    except (TypeError, ValueError, OverflowError, ZeroDivisionError):
        raise bad from None
    if units.denominator != 1 or not 0 <= units <= MAX_WEIGHT_UNITS:
        raise InputError(f"b = {sharpen} is not a weight; {WEIGHT_ADVICE}", where=where)
    return int(units)


def sharpening_units(
    sharpen: Sharpen,
    micro_image_size: int,
    shift: int,
    order: int = 0,
    *,
    box: int | None = None,
    where: str = "sharpen",
) -> int:
    """Weight b of an option, in 64ths.

    `sharpen`: "auto", "off", or b itself, as a number or as text such as "1/16". `box`: samples B
    of the box, M if None. Result: 64 b, 0 to 16. Raises `InputError` if there is no such
    sharpening.
    """
    units = _fixed_units(sharpen, where)
    return automatic_units(micro_image_size, shift, order, box) if units is None else units


def check_sharpen(sharpen: Sharpen, where: str = "sharpen") -> Sharpen:
    """Refuse a sharpening that no focus setting could have; the same."""
    _fixed_units(sharpen, where)
    return sharpen


def neighbours(length: int, distance: int) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
    """Indices of the pixels a distance before and after each; its own if there is none."""
    pixels = np.arange(length)
    before = np.where(pixels >= distance, pixels - distance, pixels)
    behind = np.where(pixels + distance < length, pixels + distance, pixels)
    return before, behind


def sharpened_sums(sums: Sums, micro_image_size: int, units: int) -> Sums:
    """The filter along both dimensions of a picture of sums, in whole numbers.

    A tap, M pixels away, outside the picture counts as the pixel itself. `units` are 64 b; the
    sums come multiplied by ``taps(units).scale`` squared.
    """
    side, centre = taps(units).side, taps(units).centre
    for axis in (0, 1):
        before, behind = neighbours(sums.shape[axis], micro_image_size)
        around = np.take(sums, before, axis=axis) + np.take(sums, behind, axis=axis)
        sums = centre * sums - side * around
    return sums


def sharpened_picture(
    sums: Sums, divisor: int, largest: int, micro_image_size: int, units: int
) -> Sums:
    """Sharpen sums and divide them, with one rounding, halves up, and limited to the pixels' range.

    `divisor` makes them grey levels; `units` are 64 b.
    """
    scale = taps(units).scale ** 2
    picture = divide_half_up(sharpened_sums(sums, micro_image_size, units), scale * divisor)
    return np.clip(picture, 0, largest)
