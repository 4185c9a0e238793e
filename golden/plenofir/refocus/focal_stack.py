# SPDX-License-Identifier: Apache-2.0
"""Schedule of several slices at once from one column memory.

The slices of a stack share their pixels and their delay; each has its own sums. Ages of pixels
depend only on phase and slice (`plenofir.refocus.moving_sum`). So if the lines of each phase form a
shift register, which advances with each line of the phase, each slice finds its pixels at fixed
places, and the column is the only address. For that, frames must begin a multiple of M lines apart.
The VHDL (``hdl/stack/focal_stack_pkg.vhd``) has the same functions.
"""

from functools import cached_property

from plenofir.refocus.moving_sum import SumLayout


class StackLayout(SumLayout):
    """Schedule of the moving sums of a stack: slice n is number n of `shifts`."""

    @cached_property
    def history_lines(self) -> tuple[int, ...]:
        """Lines of each phase that the column memory keeps, for all slices together."""
        m = self.micro_image_size
        return tuple(-(-self.oldest(v) // m) for v in range(m))

    def slice_words(self, slice_: int) -> int:
        """Sums that a slice keeps of each column: running, first, and where needed held ones."""
        return 2 + (self.group_size(slice_) > 1) + (not self.begins_group(slice_, 0))

    def least_steps(self, length: int, *, columns: bool) -> int:
        """Least steps between line starts, see `SumLayout`; for columns a multiple of M."""
        steps = max(length, self.delay + 1)
        m = self.micro_image_size
        return -(-steps // m) * m if columns else steps
