"""What a focal stack can be built for: its generics, limits, resources and latency."""

from typing import Annotated

import numpy as np
from pydantic import Field

from plenofir.core import CoreConfiguration, Engine
from plenofir.errors import InputError
from plenofir.refocus.arithmetic import ExactArithmetic
from plenofir.refocus.focal_stack import StackLayout
from plenofir.refocus.operator import Image

# column_sum (focal_stack_pkg.STACK_COLUMN_LATENCY), a row stage, divide_round.
_ARRAY_CLOCKS = 7 + 10 + 3


class StackConfiguration(CoreConfiguration):
    """Generics of the entity ``focal_stack``: a core whose slices all come out at once.

    Attributes
    ----------
    input_lines
        Lines that the input FIFO holds.
    """

    engine: Engine = "sums"
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
        if self.engine != "sums":
            raise InputError(self.engine, where="ENGINE", expected="sums with STACK")
