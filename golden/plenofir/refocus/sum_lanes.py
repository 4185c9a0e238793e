# SPDX-License-Identifier: Apache-2.0
"""Many pixels a clock: the moving sum of a row for P neighbouring outputs at once.

Output o takes in pixel e(o) = o + offset(o mod M), whose offset depends on o mod M alone
(`plenofir.refocus.moving_sum`), and gives back l(o) = e(o - B), B the box, which is e(o) - M for a
box of M. So the P outputs of a token are the sum after the previous token plus the prefix sums of

    d(o) = x[e(o)] - x[e(o - B)],    x = 0 outside the line.

Pixels lie in N banks, N the smallest multiple of M that is not less than P: pixel i in bank
i mod N, row i div N. P neighbouring pixels lie in different banks, and so do the pixels that enter
with P neighbouring outputs, because e(o + M) = e(o) + M. The bank of the pixel that enters with
output o depends only on o mod N: a fixed permutation for each slice, and a rotation by the token's
position in the N outputs.

The VHDL (``hdl/moving_sum/sum_lanes_pkg.vhd``) has the same functions.
"""

from dataclasses import dataclass
from functools import cached_property

from plenofir.refocus.moving_sum import SumLayout


@dataclass(frozen=True)
class LaneLayout:
    """Schedule of a row's moving sum with several pixels a token."""

    sums: SumLayout  # schedule with one pixel a token
    pixels: int  # P, pixels of a token

    @cached_property
    def delay(self) -> int:
        """Tokens from a token to the outputs of the same pixels."""
        return -(-self.sums.delay // self.pixels)

    @cached_property
    def banks(self) -> int:
        """N, a multiple of M."""
        m = self.sums.micro_image_size
        return -(-self.pixels // m) * m

    def offset(self, slice_: int, output: int) -> int:
        """Index of the pixel that enters with an output, counted from the output."""
        phase = self.sums.entering_phase(slice_, output % self.sums.micro_image_size)
        return self.sums.delay - self.sums.entering_age(slice_, phase)

    def bank(self, slice_: int, place: int) -> int:
        """Bank of the pixel that enters with outputs of the same o mod N."""
        return (place + self.offset(slice_, place)) % self.banks

    def row(self, slice_: int, place: int) -> int:
        """Row of that pixel, relative to the output's o div N."""
        return (place + self.offset(slice_, place)) // self.banks

    @property
    def clocks(self) -> int:
        """Clocks of the stage, besides the delay in tokens."""
        several = len(self.sums.shifts) > 1
        return 7 + (self.pixels - 1).bit_length() + several + self.sums.holds_outputs

    @cached_property
    def rows(self) -> int:
        """Rows of a bank, a power of two.

        They hold pixels from the newest back to the oldest that leaves, with incomplete rows at
        ends of lines.
        """
        oldest = self.delay * self.pixels - self.sums.delay + self.pixels - 1 + self.sums.reach
        rows = -(-oldest // self.banks) + 3
        return 1 << (rows - 1).bit_length()
