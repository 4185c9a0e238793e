# SPDX-License-Identifier: Apache-2.0
"""Engine of focal stacks (``hdl/stack``): all slices come out at once."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from plenofir.fpga.core.engine import Engine, Generics, Raster
from plenofir.ground.errors import InputError
from plenofir.refocus.focal_stack import StackLayout

# stack_columns (focal_stack_pkg.STACK_COLUMN_LATENCY), a row stage.
_PASS_CLOCKS = 7 + 10


class StackEngine(Engine):
    """Moving sums of several slices, which share the memory of pixels."""

    kind: Literal["stack"] = "stack"
    input_lines: Annotated[int, Field(ge=1, le=128)] = 1  # that the input FIFO holds

    ENTITY: ClassVar[str] = "focal_stack"

    def layout(self, raster: Raster) -> StackLayout:
        """Schedule of the moving sums of each dimension."""
        return StackLayout(raster.micro_image_size, raster.shifts, raster.align)

    def summary(self, raster: Raster) -> str:
        return "moving sums, all slices in one pass"

    def pass_clocks(self, raster: Raster) -> int:
        return _PASS_CLOCKS

    def history_bits(self, raster: Raster) -> int:
        """Bits of the pixels that the slices share."""
        return self.lines(raster) * raster.max_columns * raster.channels * raster.words(0).data

    def slice_bits(self, raster: Raster) -> int:
        """Bits that the slices keep for themselves: sums of each column."""
        layout = self.layout(raster)
        words = sum(layout.slice_words(slice_) for slice_ in range(len(raster.shifts)))
        return words * raster.max_columns * raster.channels * raster.words(0).sum

    def line_buffer_bits(self, raster: Raster) -> int:
        if raster.max_columns == 1:
            return 0
        return self.history_bits(raster) + self.slice_bits(raster)

    def least_steps(self, raster: Raster) -> int:
        return max(super().least_steps(raster), raster.filter_delay + 1)

    def lines(self, raster: Raster) -> int:
        """Lines of pixels that each channel keeps."""
        return sum(self.layout(raster).history_lines)

    def describe(self, raster: Raster, rows: int) -> Iterator[tuple[str, str]]:
        """Name and value of what a person is told."""
        del rows
        yield (
            "stack",
            f"all slices in one pass, {self.lines(raster)} lines of pixels for each channel "
            f"({self.line_buffer_bits(raster) / 1024:.0f} Kbit in all)",
        )

    def blank_lines(self, raster: Raster) -> int:
        return raster.micro_image_size - 1

    def frame_lines(self, raster: Raster, rows: int) -> int:
        least = max(rows, raster.filter_delay + 1)
        return -(-least // raster.micro_image_size) * raster.micro_image_size

    def check(self, raster: Raster) -> None:
        if not raster.exact:
            raise InputError("a focal stack has exact sums, no stored products", where="arithmetic")
        if raster.order:
            raise InputError(
                f"a focal stack takes the nearest pixel, not interpolation of order {raster.order}",
                where="order",
            )

    def generics(self, raster: Raster) -> Generics:
        return {"INPUT_LINES": self.input_lines}
