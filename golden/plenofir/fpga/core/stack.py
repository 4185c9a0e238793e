"""What a focal stack can be built for: its generics, limits, resources and latency."""

from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from plenofir.errors import InputError
from plenofir.fpga.core.configuration import CoreConfiguration, Engine
from plenofir.refocus.arithmetic import ExactArithmetic
from plenofir.refocus.focal_stack import StackLayout
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import MAX_SHARPNESS_RADIUS, DepthIndex, depth_index

# stack_columns (focal_stack_pkg.STACK_COLUMN_LATENCY), a row stage, divide_round.
_ARRAY_CLOCKS = 7 + 10 + 3


class StackConfiguration(CoreConfiguration):
    """Generics of the entity ``focal_stack``: a core whose slices all come out at once.

    Attributes
    ----------
    input_lines
        Lines that the input FIFO holds.
    """

    engine: Engine = "moving_sum"
    input_lines: Annotated[int, Field(ge=1)] = 1

    @property
    def sum_layout(self) -> StackLayout:
        """Schedule of the moving sums of each dimension."""
        return StackLayout(self.micro_image_size, self.shifts, self.align)

    @property
    def history_bits(self) -> int:
        """Bits of the pixels that the slices share."""
        lines = sum(self.sum_layout.history_lines)
        return lines * self.max_columns * self.channels * self.pixel_bits

    def slice_bits(self, slice_: int) -> int:
        """Bits that a slice keeps for itself: sums of each column.

        Parameters
        ----------
        slice_
            Number of the slice.

        Returns
        -------
        int
            Bits.
        """
        _, sum_bits = self._moving_sum_widths(0)
        words = self.sum_layout.slice_words(slice_)
        return words * self.max_columns * self.channels * sum_bits

    @property
    def line_buffer_bits(self) -> int:
        """Bits of the column memory: shared pixels and all slices' sums."""
        if self.max_columns == 1:
            return 0
        return self.history_bits + sum(self.slice_bits(s) for s in range(len(self.shifts)))

    @property
    def array_clocks(self) -> int:
        """Clocks from a token at the stack array's input to its output (stack_array_latency)."""
        return _ARRAY_CLOCKS

    def golden(self, raw: Image) -> Image:
        """What comes out for a raw image.

        Parameters
        ----------
        raw
            Raw image.

        Returns
        -------
        Image
            Shape (slices, rows, columns[, 3]).
        """
        m = self.micro_image_size
        return np.stack(
            [self.arithmetic.refocus(raw, m, shift, align=self.align) for shift in self.shifts]
        )

    def generics(self) -> dict[str, int | bool | str]:
        """Generics of the entity ``focal_stack``.

        Returns
        -------
        dict
            Name to value.
        """
        names = (
            "MICRO_IMAGE_SIZE",
            "SHIFTS",
            "CENTRED",
            "MAX_COLUMNS",
            "CHANNELS",
            "PIXEL_BITS",
        )
        values = super().generics()
        return {**{name: values[name] for name in names}, "INPUT_LINES": self.input_lines}

    def check_limits(self) -> None:
        """Refuse what a focal stack cannot be built for.

        Raises
        ------
        InputError
            Naming the limit that is exceeded.
        """
        super().check_limits()
        if not isinstance(self.arithmetic, ExactArithmetic):
            raise InputError("stored products", where="ARITH", expected="exact with STACK")
        if self.order:
            raise InputError(
                f"interpolation of order {self.order}",
                where="INTERPOLATION",
                expected="nearest with STACK",
            )
        if self.engine != "moving_sum":
            raise InputError(self.engine, where="ENGINE", expected="moving_sum with STACK")


class SharpnessConfiguration(BaseModel):
    """Generics of the entity ``depth_index``.

    Attributes
    ----------
    micro_image_size
        M in pixels.
    slices
        Slices of the stack.
    radius
        See `plenofir.refocus.sharpness.local_sharpness`.
    max_columns
        Largest line length in pixels.
    channels
        1 (grey) or 3 (RGB).
    pixel_bits
        8 or 16.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=2)]
    slices: Annotated[int, Field(ge=1, le=256)]
    radius: Annotated[int, Field(ge=0, le=MAX_SHARPNESS_RADIUS)] = 1
    max_columns: Annotated[int, Field(ge=1)]
    channels: Annotated[int, Field(ge=1, le=3)] = 1
    pixel_bits: Annotated[int, Field(ge=1, le=16)] = 8

    @property
    def delay(self) -> int:
        """Lines from a pixel's coming in to its coming out (sharpness_delay)."""
        return (self.radius + 2) * self.micro_image_size

    @property
    def memory_bits(self) -> tuple[int, int]:
        """Bits of the lines in which the slices' pixels wait, and of all that is judged."""
        m, slices = self.micro_image_size, self.slices
        waiting = self.delay * self.max_columns * slices * self.channels * self.pixel_bits
        largest = (1 if self.channels == 1 else 4) * ((1 << self.pixel_bits) - 1) * m * m
        lens = largest.bit_length()
        row = lens + 2 + max(1, (2 * self.radius).bit_length())
        index = max(1, (slices - 1).bit_length())
        lenses = -(-self.max_columns // m)
        return waiting, lenses * (slices * (4 * lens + 2 * self.radius * row) + index)

    def band_steps(self, columns: int) -> int:
        """Clocks from the beginning of a line to that of the next one at the earliest.

        Parameters
        ----------
        columns
            Line length in pixels.

        Returns
        -------
        int
            At least `columns`.
        """
        return max(columns, 8 + self.radius)

    def frame_lines(self, rows: int) -> int:
        """Lines from the beginning of a frame to that of the next one at the earliest.

        Parameters
        ----------
        rows
            Rows of a frame.

        Returns
        -------
        int
            At least `rows`.
        """
        return -(-rows // self.micro_image_size) * self.micro_image_size

    def full_rate(self, columns: int, rows: int) -> bool:
        """Whether frames of a size need no blanking.

        Parameters
        ----------
        columns, rows
            Frame size in pixels.

        Returns
        -------
        bool
            False where lines or frames want a pause.
        """
        return self.band_steps(columns) == columns and self.frame_lines(rows) == rows

    def latency_clocks(self, columns: int, rows: int, frames: int = 1) -> int:
        """Clocks from the first pixel taken to the first one offered, when nothing stalls.

        Parameters
        ----------
        columns, rows, frames
            Size and number of the frames, which does not matter.

        Returns
        -------
        int
            Latency in clocks.
        """
        del rows, frames
        return self.delay * self.band_steps(columns) + self.radius + self.slices + 18

    def golden(self, stack: Image) -> DepthIndex:
        """What comes out for a focal stack.

        Parameters
        ----------
        stack
            Shape (slices, rows, columns[, 3]).

        Returns
        -------
        DepthIndex
            Index and picture.
        """
        return depth_index(stack, self.micro_image_size, self.radius)

    def generics(self) -> dict[str, int | bool | str]:
        """Generics of the entity ``depth_index``.

        Returns
        -------
        dict
            Name to value.
        """
        return {name.upper(): value for name, value in self.model_dump().items()}
