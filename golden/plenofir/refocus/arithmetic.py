# SPDX-License-Identifier: Apache-2.0
"""Bit-true model of the hardware: the operator in the hardware's arithmetic.

Two arithmetics exist. `ExactArithmetic` adds integers and divides once by M^2 at the end.
`StoredProductArithmetic` multiplies by 1/M through a ROM before each dimension (section 6.2 of the
thesis) with F fraction bits, and keeps G guard bits in the intermediate image; F = G = 0 is the
thesis. Sums of rounded products can exceed full scale; they saturate.
"""

from fractions import Fraction
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator

from plenofir.ground.errors import InputError
from plenofir.refocus.border import (
    Border,
    arrived,
    check_border,
    sharpened_inside,
    weighted_quotients,
)
from plenofir.refocus.checks import check_align, check_pixels, interpolation_order, whole_number
from plenofir.refocus.operator import (
    Align,
    Image,
    Sums,
    box_size,
    check_sums,
    clamped_shift,
    divide_half_up,
    gather_sums,
    output_offset,
    refocus_sums,
)
from plenofir.refocus.sharpening import (
    Sharpen,
    sharpened_picture,
    sharpened_sums,
    sharpening_units,
    taps,
)


def scaled_quotient(values: Sums, scale_bits: int, divisor: int) -> Sums:
    """Contents of a stored-product ROM."""
    return divide_half_up(values << scale_bits, divisor)


def round_saturate(values: Sums, drop_bits: int, result_bits: int) -> Sums:
    """Drop fraction bits with rounding (halves up) and limit to a width."""
    return np.minimum(divide_half_up(values, 1 << drop_bits), (1 << result_bits) - 1)


def _checked(
    raw: Image, micro_image_size: int, shift: int, order: int
) -> tuple[Image, int, int, int]:
    """Arguments as the arithmetics take them; frames may be smaller than a micro image."""
    if not isinstance(raw, np.ndarray):
        raise InputError(f"must be a NumPy array, not {type(raw).__name__}", where="raw")
    m, raw = whole_number(micro_image_size, "M", 1), check_pixels(raw)
    shift = clamped_shift(m, whole_number(shift, "shift"), raw.shape)
    return raw, m, shift, interpolation_order(order, where="order")


class ExactArithmetic(BaseModel):
    """Integer sums and one correctly rounded division by M^(2 + 2 order), halves up."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["exact"] = "exact"

    def refocus(
        self,
        raw: Image,
        micro_image_size: int,
        *,
        shift: int,
        align: Align = "centred",
        order: int = 0,
        sharpen: Sharpen = "off",
        border: Border = "zero",
        box: int | None = None,
    ) -> Image:
        """Refocus an image as the hardware does.

        `raw`: raw image, shape (rows, columns[, channels]), uint8 or uint16. `shift`: a' = a M in
        pixels (`refocus` takes a). `sharpen`: see `plenofir.refocus.sharpening`; one rounding for
        sums and sharpening together. `border`: see `plenofir.refocus.border`. `box`: samples B of
        the box, M if None. Result: size and type of `raw`. Raises `InputError` if an argument
        cannot be used, or the sums could wrap around.
        """
        check_border(border)
        asked = shift
        raw, micro_image_size, shift, order = _checked(raw, micro_image_size, shift, order)
        box = box_size(micro_image_size, asked, box)
        units = sharpening_units(sharpen, micro_image_size, asked, order, box=box)
        largest = self.largest_sum(box, 8 * raw.dtype.itemsize, order)
        # Sharpening subtracts neighbours, so sums of both signs must fit.
        check_sums(largest * (taps(units).centre + 2 * taps(units).side) ** 2)
        sums = refocus_sums(raw, micro_image_size, shift=shift, align=align, order=order, box=box)
        divisor = box ** (2 * (order + 1))
        white = int(np.iinfo(raw.dtype).max)
        if border == "normalise":
            scale, full = taps(units).scale, box ** (order + 1)
            down, across = (
                arrived(length, micro_image_size, shift, order, align, box)
                for length in raw.shape[:2]
            )
            sums = sharpened_inside(sums, (down, across), full, micro_image_size, units)
            picture = weighted_quotients(sums, (scale * down, scale * across), white)
            return picture.astype(raw.dtype)
        return sharpened_picture(sums, divisor, white, micro_image_size, units).astype(raw.dtype)

    def largest_sum(self, micro_image_size: int, pixel_bits: int, order: int = 0) -> int:
        """Largest number that the arithmetic's sums can reach.

        With a box of B samples B takes the place of M. Result: the largest sum of the last column
        filter.
        """
        return int(micro_image_size ** (2 * (order + 1))) * ((1 << pixel_bits) - 1)

    def error_bound(self, micro_image_size: int, pixel_bits: int, order: int = 0) -> Fraction:
        """Largest possible distance from the real-valued operator, in grey levels.

        With a box of B samples B takes the place of M. Result: half a grey level (odd divisors
        stay below it).
        """
        divisor = micro_image_size ** (2 * (order + 1))
        return Fraction(divisor // 2, divisor)


class StoredProductArithmetic(BaseModel):
    """Products from a ROM, rounded sums: the thesis's arithmetic for F = G = 0."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["stored"] = "stored"
    fraction_bits: Annotated[int, Field(ge=0, le=12)] = 8
    guard_bits: Annotated[int, Field(ge=0)] = 2

    @model_validator(mode="after")
    def _guard_bits_are_fraction_bits(self) -> "StoredProductArithmetic":
        if self.guard_bits > self.fraction_bits:
            raise ValueError("guard_bits must not exceed fraction_bits")
        return self

    def _products(self, micro_image_size: int, value_bits: int, scale_bits: int) -> Sums:
        # The ROM's whole content: a product for each value of a pixel.
        values = np.arange(1 << value_bits, dtype=np.int64)
        return scaled_quotient(values, scale_bits, micro_image_size)

    def refocus(
        self,
        raw: Image,
        micro_image_size: int,
        *,
        shift: int,
        align: Align = "centred",
        order: int = 0,
        sharpen: Sharpen = "off",
        border: Border = "zero",
        box: int | None = None,
    ) -> Image:
        """Refocus an image as the hardware does.

        Parameters, result and errors as `ExactArithmetic.refocus`; rounded products can neither be
        sharpened nor normalised.
        """
        check_border(border)
        if border != "zero":
            raise InputError(
                "stored products cannot be normalised: they are divided by M before they are "
                "summed; use exact sums",
                where="border",
            )
        asked = shift
        raw, micro_image_size, shift, order = _checked(raw, micro_image_size, shift, order)
        box = box_size(micro_image_size, asked, box)
        if sharpening_units(sharpen, micro_image_size, asked, order, box=box):
            raise InputError("stored products cannot be sharpened; use exact sums", where="sharpen")
        check_align(align)
        pixel_bits = 8 * raw.dtype.itemsize
        # Between the passes sums keep the guard bits; the last one drops them.
        middle_bits = pixel_bits + self.guard_bits
        drop_bits = self.fraction_bits - self.guard_bits
        passes = [(axis, s) for axis in (1, 0) for s in (shift, *[1] * order)]
        first, last = 0, len(passes) - 1

        image: Sums = raw.astype(np.int64)
        for number, (axis, pass_shift) in enumerate(passes):
            products = (
                self._products(box, pixel_bits, self.fraction_bits)
                if number == first
                else self._products(box, middle_bits, drop_bits)
            )[image]
            offset = output_offset(micro_image_size, pass_shift, align, box)
            sums = gather_sums(
                products, micro_image_size, pass_shift, axis=axis, offset=offset, box=box
            )
            image = (
                round_saturate(sums, self.fraction_bits, pixel_bits)
                if number == last
                else round_saturate(sums, drop_bits, middle_bits)
            )
        return image.astype(raw.dtype)

    def largest_sum(self, micro_image_size: int, pixel_bits: int, order: int = 0) -> int:
        """Largest number that the arithmetic's sums can reach.

        Parameters and result as `ExactArithmetic.largest_sum`.
        """
        # The columns' products: with guard bits white is larger.
        products = self._products(
            micro_image_size,
            pixel_bits + self.guard_bits,
            self.fraction_bits - self.guard_bits,
        )
        return micro_image_size * int(products[-1])

    def error_bound(self, micro_image_size: int, pixel_bits: int, order: int = 0) -> Fraction:
        """Largest possible distance from the real-valued operator, in grey levels.

        M rounded products are off by at most M times the worst product, the intermediate image
        by half its last bit more (when bits are dropped); each later pass averages that error and
        adds its own. Saturation only reduces it, because the true value is within full scale.

        Parameters and result as `ExactArithmetic.error_bound`.
        """
        m = micro_image_size
        unit = Fraction(1, 1 << self.fraction_bits)

        def worst_product(value_bits: int, scale_bits: int) -> Fraction:
            scaled = np.arange(1 << value_bits, dtype=np.int64) << scale_bits
            products = self._products(m, value_bits, scale_bits)
            return Fraction(int(np.abs(products * m - scaled).max()), m)

        def rounding(drop_bits: int, last_bit: Fraction) -> Fraction:
            return last_bit / 2 if drop_bits > 0 else Fraction(0)

        drop_bits = self.fraction_bits - self.guard_bits
        first_pass = m * worst_product(pixel_bits, self.fraction_bits) * unit
        later_pass = m * worst_product(pixel_bits + self.guard_bits, drop_bits) * unit
        between = rounding(drop_bits, Fraction(1, 1 << self.guard_bits))
        later_passes = 2 * order + 1
        return (
            first_pass
            + later_passes * (between + later_pass)
            + rounding(self.fraction_bits, Fraction(1))
        )


Arithmetic = Annotated[ExactArithmetic | StoredProductArithmetic, Field(discriminator="kind")]


def error_against_operator(
    image: Image,
    raw: Image,
    micro_image_size: int,
    *,
    shift: int,
    align: Align = "centred",
    order: int = 0,
    units: int = 0,
    border: Border = "zero",
    box: int | None = None,
) -> npt.NDArray[np.float64]:
    """Distance of a refocused image from the real-valued operator, S2 / B^2 without interpolation.

    `image`: refocused image. `raw`: the raw image it was made from. `units`: 64 b of the
    sharpening; what it makes of the operator is limited to the range of the pixels. `border`:
    normalised (without sharpening), S2 is divided by the weight that reached it. `box`: samples B
    of the box, M if None. Result: image - S2 / B^(2 + 2 order) in grey levels, shape of `image`.
    """
    box = box_size(micro_image_size, shift, box)
    sums = refocus_sums(raw, micro_image_size, shift=shift, align=align, order=order, box=box)
    if border == "normalise":
        ones = np.ones(raw.shape[:2] + (1,) * (raw.ndim - 2), np.uint8)
        weights = refocus_sums(
            ones, micro_image_size, shift=shift, align=align, order=order, box=box
        )
        return image.astype(np.int64) - sums / np.maximum(weights, 1)
    sums = sharpened_sums(sums, micro_image_size, units)
    divisor = int(box ** (2 * (order + 1))) * taps(units).scale ** 2
    sums = np.clip(sums, 0, divisor * int(np.iinfo(raw.dtype).max))
    return (image.astype(np.int64) * divisor - sums) / divisor
