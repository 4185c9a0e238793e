# SPDX-License-Identifier: Apache-2.0
"""One slice of one image: the settings that every refocuser takes, and the size of its sums."""

from dataclasses import dataclass
from functools import cached_property

from plenofir.refocus.checks import Align
from plenofir.refocus.operator import check_sums, output_offset
from plenofir.refocus.sharpening import Taps, taps


@dataclass(frozen=True)
class Slice:
    """Settings of a slice, checked by the caller (`plenofir.refocus.refocus`).

    Raises `InputError` if its sums need more than 64 bits.
    """

    shape: tuple[int, ...]  # of the raw image
    pixel_bits: int
    micro_image_size: int  # M in pixels
    shift: int  # a' in pixels
    region: tuple[range, range]  # rows and columns of the result
    align: Align = "centred"
    order: int = 0  # of the interpolation
    units: int = 0  # sharpening weight in 64ths
    upsample: bool = True
    normalise: bool = False  # divide the border by the weights there (`plenofir.refocus.border`)
    box_samples: int | None = None  # B of a box that is smaller than a micro image

    def __post_init__(self) -> None:
        """Refuse sums that do not fit, whoever adds them."""
        check_sums(self.white * self.divisor)
        if self.units:
            # Sharpened quotients have twice the divisor, for one more bit of the sum.
            check_sums(max(2 * self.largest * self.divisor, self.sharpened_sum))

    @property
    def white(self) -> int:
        """Largest pixel."""
        return (1 << self.pixel_bits) - 1

    @property
    def box(self) -> int:
        """Samples of the re-ordered line that a sum adds, B: S = box * y."""
        return self.micro_image_size if self.box_samples is None else self.box_samples

    @property
    def full(self) -> int:
        """Weight of a pixel's sum in one dimension, with each order of interpolation B times."""
        return int(self.box ** (1 + self.order))

    @property
    def divisor(self) -> int:
        """Sum of an image of ones in both dimensions."""
        return self.full**2

    @cached_property
    def taps(self) -> Taps:
        """The sharpening filter; without sharpening its side is 0."""
        return taps(self.units)

    @property
    def largest(self) -> int:
        """Largest quotient before it is limited to the pixels' range."""
        return -(-self.white * self.taps.gain**2 >> 2 * self.taps.bits)

    @property
    def dropped_bits(self) -> int:
        """Bits of the filter's scale, in both dimensions, that are dropped: all but one."""
        return 2 * self.taps.bits - 1

    @property
    def sharpened_sum(self) -> int:
        """Largest magnitude of a sharpened sum, and room for its rounding."""
        return self.taps.gain**2 * self.white * self.divisor + (2 << self.dropped_bits)

    @property
    def step(self) -> int:
        """Pixels of the operator's picture from one output to the next."""
        return 1 if self.upsample else self.micro_image_size

    @property
    def channels(self) -> int:
        """Samples of a pixel."""
        return self.shape[2] if len(self.shape) == 3 else 1

    @property
    def lens(self) -> int:
        """Distance of the sharpening's taps in pixels, 0 without sharpening."""
        return self.micro_image_size if self.units else 0

    @property
    def offset(self) -> int:
        """Index of S that output 0 takes, in pixels."""
        return output_offset(self.micro_image_size, self.shift, self.align, self.box)

    @property
    def unit_offset(self) -> int:
        """Index that output 0 of a moving sum of the interpolation takes, in pixels."""
        return output_offset(self.micro_image_size, 1, self.align, self.box)

    def passes(self, outputs: range, length: int) -> tuple[range, list[range]]:
        """Indices of S that the operator makes for outputs of a dimension, and each interpolation.

        `length`: samples of the dimension. Each moving sum of the interpolation takes indices of
        the sums before it, counted from the first that these made.
        """
        low, high = outputs.start * self.step, (outputs.stop - 1) * self.step + 1
        # Ranges that the moving sums need, the last one first.
        ranges = [(low, high)]
        for _ in range(self.order):
            low = max(0, low + self.unit_offset - self.box + 1)
            high = min(length, high + self.unit_offset)
            ranges.append((low, high))
        low, high = ranges.pop()
        first = range(low + self.offset, high + self.offset, self.step)
        further = []
        for begin, end in reversed(ranges):
            further.append(range(begin + self.unit_offset - low, end + self.unit_offset - low))
            low = begin
        return first, further

    @property
    def result_shape(self) -> tuple[int, ...]:
        """Shape of the result."""
        return (len(self.region[0]), len(self.region[1]), *self.shape[2:])
