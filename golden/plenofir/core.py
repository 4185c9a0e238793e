"""What the raster refocuser can be built for: its generics, limits, resources and latency."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from plenofir.errors import InputError
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.operator import Align
from plenofir.refocus.switches import output_delay, tap_count

MAX_MICRO_IMAGE_SIZE = 128
MAX_SHIFT = 4096
MAX_COLUMNS = 8192
MAX_ROWS = 65535
MAX_TAPS = 512
MAX_LINE_BUFFER_BITS = 1 << 26
MAX_PRODUCT_ADDRESS_BITS = 16

# The column filter's read-modify-write loop takes this many clocks; shorter lines are
# lengthened by empty steps (refocus_pkg.MIN_LINE_STEPS).
MIN_LINE_STEPS = 4
# Input FIFO 2, sequencer 1, row stage 3, column stage 3, output FIFO 2.
_STAGE_CLOCKS = 11


class CoreConfiguration(BaseModel):
    """Generics of the raster refocuser.

    Attributes
    ----------
    micro_image_size
        M in pixels.
    shift
        a' in pixels.
    max_columns
        Largest line length in pixels.
    channels
        1 (grey) or 3 (RGB).
    pixel_bits
        8 or 16 in the golden model; the core takes 1 to 16.
    arithmetic
        Exact or stored products.
    align
        See `plenofir.refocus.operator.output_offset`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=1)]
    shift: int
    max_columns: Annotated[int, Field(ge=1)]
    channels: Annotated[int, Field(ge=1, le=3)] = 1
    pixel_bits: Annotated[int, Field(ge=1, le=16)] = 8
    arithmetic: Arithmetic = ExactArithmetic()
    align: Align = "centred"

    @property
    def taps(self) -> int:
        """Taps of each filter."""
        return tap_count(self.micro_image_size, self.shift)

    @property
    def delay(self) -> int:
        """Delay of the row filter in pixels and of the column filter in lines."""
        return output_delay(self.micro_image_size, self.shift, self.align)

    @property
    def line_buffer_bits(self) -> int:
        """Bits of partial sums that the column filters of all channels keep."""
        depth = 1 << (self.max_columns - 1).bit_length()
        largest = self.arithmetic.largest_sum(self.micro_image_size, self.pixel_bits)
        return self.channels * (self.taps - 1) * largest.bit_length() * depth

    def latency_clocks(self, columns: int) -> int:
        """Clocks from the first pixel taken to the first pixel offered, nothing stalling.

        Parameters
        ----------
        columns
            Line length in pixels.

        Returns
        -------
        int
            Latency in clocks.
        """
        scaling = 3 if isinstance(self.arithmetic, ExactArithmetic) else 2
        return self.delay * (max(columns, MIN_LINE_STEPS) + 1) + _STAGE_CLOCKS + scaling

    def generics(self) -> dict[str, int | bool]:
        """Generics of the entity ``raster_refocuser``.

        Returns
        -------
        dict
            Name to value.
        """
        values: dict[str, int | bool] = {
            "MICRO_IMAGE_SIZE": self.micro_image_size,
            "SHIFT": self.shift,
            "CENTRED": self.align == "centred",
            "MAX_COLUMNS": self.max_columns,
            "CHANNELS": self.channels,
            "PIXEL_BITS": self.pixel_bits,
            "EXACT": isinstance(self.arithmetic, ExactArithmetic),
        }
        if isinstance(self.arithmetic, StoredProductArithmetic):
            values["FRACTION_BITS"] = self.arithmetic.fraction_bits
            values["GUARD_BITS"] = self.arithmetic.guard_bits
        return values

    def check_limits(self) -> None:
        """Refuse what the core cannot be built for.

        Raises
        ------
        InputError
            Naming the limit that is exceeded.
        """

        def refuse(what: str, where: str, limit: str) -> InputError:
            return InputError(f"{what} exceeds the core's limit", where=where, expected=limit)

        m, shift = self.micro_image_size, self.shift
        if m > MAX_MICRO_IMAGE_SIZE:
            raise refuse(f"M = {m}", "M", f"M of at most {MAX_MICRO_IMAGE_SIZE}")
        if self.max_columns > MAX_COLUMNS:
            raise refuse(
                f"a line of {self.max_columns} pixels", "raw", f"at most {MAX_COLUMNS} columns"
            )
        if abs(shift) > MAX_SHIFT or self.taps > MAX_TAPS:
            raise refuse(
                f"a filter of {self.taps} taps (M = {m}, a' = {shift})",
                "A",
                f"at most {MAX_TAPS} taps",
            )
        if isinstance(self.arithmetic, StoredProductArithmetic):
            address_bits = self.pixel_bits + self.arithmetic.guard_bits
            if address_bits > MAX_PRODUCT_ADDRESS_BITS:
                raise refuse(
                    f"a stored-product ROM of 2^{address_bits} words "
                    f"({self.pixel_bits} bit pixels, {self.arithmetic.guard_bits} guard bits)",
                    "ARITH",
                    f"at most 2^{MAX_PRODUCT_ADDRESS_BITS} words: fewer guard bits, "
                    "or exact arithmetic",
                )
        if self.line_buffer_bits > MAX_LINE_BUFFER_BITS:
            raise refuse(
                f"{self.line_buffer_bits / 2**20:.1f} Mbit of line buffers "
                f"({self.taps - 1} lines of partial sums, {self.max_columns} columns)",
                "A",
                f"at most {MAX_LINE_BUFFER_BITS >> 20} Mbit: fewer columns, or a nearer to 1/M",
            )
