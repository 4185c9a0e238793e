# SPDX-License-Identifier: Apache-2.0
"""Engine of focal stacks (``hdl/stack``), which computes all slices at once."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field

from plenofir.fpga.core.engine import (
    Engine,
    Generics,
    PixelsPerClock,
    Raster,
    Scope,
    check_lane_delay,
    within,
)
from plenofir.fpga.core.moving_sum_engine import ADDER_WAVES, CONTROL_WAVES, row_waves
from plenofir.fpga.resources.memory import Memory, bits_for, block_sizes
from plenofir.ground.errors import InputError
from plenofir.refocus.focal_stack import StackLayout
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.sum_lanes import LaneLayout

_COLUMN_WAVES: tuple[Scope, ...] = (
    *CONTROL_WAVES,
    ("downto", "", "in_4 entering_4 leaving_4"),
    *ADDER_WAVES,
)
# stack_columns (focal_stack_pkg.STACK_COLUMN_LATENCY), and a row stage of one pixel a clock.
_COLUMN_CLOCKS = 7
_ROW_CLOCKS = 10


class StackEngine(Engine):
    """Moving sums of several slices, which share the memory of pixels."""

    kind: Literal["stack"] = "stack"
    input_lines: Annotated[int, Field(ge=1, le=128)] = 1  # that the input FIFO holds
    # Neighbouring pixels of a line in a token; above 1 without normalised borders only.
    pixels_per_clock: PixelsPerClock = 1

    ENTITY: ClassVar[str] = "focal_stack"
    COMPONENT: ClassVar[str] = "stack_array"
    # What fills a device is slower; placed ones reach 58 % at least.
    CLOCK_SHARE: ClassVar[float] = 0.5

    def layout(self, raster: Raster) -> StackLayout:
        """Schedule of the moving sums of each dimension."""
        return StackLayout(
            raster.micro_image_size, raster.shifts, raster.align, boxes=raster.slice_boxes
        )

    def summary(self, raster: Raster) -> str:
        return "moving sums, all slices in one pass"

    def waves(self, raster: Raster) -> tuple[Scope, ...]:
        signals: list[Scope] = [("bit", "columns/", "active step")]
        for number in range(len(raster.shifts)):
            signals += within(f"columns/slice({number})", _COLUMN_WAVES)
            signals += within(f"slice({number})", row_waves(self.pixels_per_clock))
        return within("stack_engine/slices", (*signals, ("downto", "", "column_data sums")))

    @property
    def pixels_at_once(self) -> PixelsPerClock:
        return self.pixels_per_clock

    def lanes(self, raster: Raster) -> tuple[LaneLayout, ...]:
        """Schedules of the row stages of several pixels a token: one slice in each."""
        p, m = self.pixels_per_clock, raster.micro_image_size
        return tuple(
            LaneLayout(SumLayout(m, (shift,), raster.align, boxes=(box,)), p)
            for shift, box in zip(raster.shifts, raster.slice_boxes, strict=True)
        )

    def row_tokens(self, raster: Raster) -> int:
        return -(-raster.filter_delay // self.pixels_per_clock)

    def line_words(self, raster: Raster) -> int:
        """Words of the longest line, each with all pixels of a token."""
        p = self.pixels_per_clock
        return raster.max_columns if p == 1 else max(-(-raster.max_columns // p), 2)

    def pass_clocks(self, raster: Raster) -> int:
        rows = _ROW_CLOCKS
        if self.pixels_per_clock > 1:
            rows = max(lane.clocks for lane in self.lanes(raster))
        return _COLUMN_CLOCKS + rows

    def history_bits(self, raster: Raster) -> int:
        """Bits of the pixels that the slices share."""
        pixels = self.line_words(raster) * self.pixels_per_clock
        return self.lines(raster) * pixels * raster.channels * raster.words(0).data

    def slice_bits(self, raster: Raster) -> int:
        """Bits that the slices keep for themselves: sums of each column."""
        layout = self.layout(raster)
        words = sum(layout.slice_words(slice_) for slice_ in range(len(raster.shifts)))
        pixels = self.line_words(raster) * self.pixels_per_clock
        return words * pixels * raster.channels * raster.words(0).sum

    def line_buffer_bits(self, raster: Raster) -> int:
        if raster.max_columns == 1 and self.pixels_per_clock == 1:
            return 0
        return self.history_bits(raster) + self.slice_bits(raster)

    def least_steps(self, raster: Raster) -> int:
        return max(super().least_steps(raster), self.row_tokens(raster) + 1)

    def lines(self, raster: Raster) -> int:
        """Lines of pixels that each channel keeps."""
        return sum(self.layout(raster).history_lines)

    def describe(self, raster: Raster, rows: int) -> Iterator[tuple[str, str]]:
        """Names and values to print."""
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
        if self.pixels_per_clock > 1 and raster.normalises:
            raise InputError(
                f"a focal stack of {self.pixels_per_clock} pixels a clock has no normalised "
                "border; use one pixel a clock, or border zero",
                where="border",
            )
        check_lane_delay(self.row_tokens(raster), self.pixels_per_clock)

    def for_video(self) -> Self:
        return self.model_copy(update={"pixels_per_clock": 1})

    def generics(self, raster: Raster) -> Generics:
        values: Generics = {"INPUT_LINES": self.input_lines}
        if self.pixels_per_clock > 1:
            values["PIXELS_PER_CLOCK"] = self.pixels_per_clock
        return values

    def memories(self, raster: Raster) -> Iterator[Memory]:
        p, layout = self.pixels_per_clock, self.layout(raster)
        pixel, columns = p * raster.channels * raster.pixel_bits, self.line_words(raster)
        sums = p * raster.channels * raster.words(0).sum
        for lines in layout.history_lines:
            if lines:
                width = lines * pixel
                yield Memory("lines of a phase", bits_for(columns - 1), width, 1, words=columns)
        words = sum(layout.slice_words(slice_) for slice_ in range(len(raster.shifts)))
        for size in block_sizes(columns, sums):
            yield Memory("sums", (size - 1).bit_length(), sums, words, words=size)
        row_pixels = raster.channels * raster.words(1).data
        if p == 1:
            copies = len(raster.shifts) * (1 + layout.pixels_leave)
            yield Memory("pixels of a line", layout.reach.bit_length(), row_pixels, copies)
            return
        for lanes in self.lanes(raster):
            yield Memory(
                "pixels of a line", (lanes.rows - 1).bit_length(), row_pixels, 2 * lanes.banks
            )

    def fifos(self, raster: Raster, array_clocks: int) -> Iterator[Memory]:
        tokens = -(-raster.max_columns // self.pixels_per_clock)
        pixel = self.pixels_per_clock * raster.channels * raster.pixel_bits
        yield Memory("input FIFO", bits_for(self.input_lines * tokens + 1), pixel + 2, 1)
        width = len(raster.shifts) * pixel + 3
        yield Memory("output FIFO", bits_for(2 * (2 + array_clocks) + 1), width, 1)

    def slices_at_once(self, raster: Raster) -> int:
        return len(raster.shifts)

    def structure(self, raster: Raster) -> dict[str, int]:
        p, slices = self.pixels_per_clock, len(raster.shifts)
        sums = slices * raster.channels * raster.words(0).sum
        row_bits = raster.channels * raster.words(1).data
        if p == 1:
            history_bits = self.lines(raster) * raster.channels * raster.pixel_bits
            return {"stack": 1, "sum bits": sums, "history bits": history_bits, "slices": slices}
        # Column sums, what they choose from, and the pixels of all banks.
        return {
            "slices of lanes": slices,
            "lane bits": p * sums,
            "lane choices": p * sums * raster.micro_image_size,
            "bank bits": sum(lane.banks for lane in self.lanes(raster)) * row_bits,
        }
