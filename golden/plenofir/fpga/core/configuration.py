"""What the refocuser can be built for: its generics, limits, resources and latency."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from plenofir.errors import InputError
from plenofir.refocus import MAX_INTERPOLATION_ORDER
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.operator import Align
from plenofir.refocus.switches import FilterLayout

MAX_MICRO_IMAGE_SIZE = 128
MAX_SHIFT = 4096
MAX_SLICES = 256
MAX_COLUMNS = 8192
MAX_ROWS = 65535
MAX_TAPS = 512
MAX_LINE_BUFFER_BITS = 1 << 26
MAX_PRODUCT_ADDRESS_BITS = 16
MAX_PARALLEL_ROWS = 64

# The column filter's read-modify-write loop takes this many clocks (refocus_pkg.PARTIAL_SUM_LOOP).
PARTIAL_SUM_LOOP = 4
# divide_round.
_DIVIDE_CLOCKS = 3
# Input FIFO 3, sequencer 1, output FIFO 3 (refocus_pkg.STREAM_LATENCY).
_STREAM_CLOCKS = 7
# Tokens in the sequencer and the row gather.
_SEQUENCER_GATHER = 3
# video_to_stream 3, stream_to_video 1, the output's choice 1.
_VIDEO_CLOCKS = 5


Engine = Literal["fir", "moving_sum"]


class CoreConfiguration(BaseModel):
    """Generics of the raster refocuser and of the module array in it.

    Attributes
    ----------
    micro_image_size
        M in pixels.
    shifts
        The set of a' in pixels from which a slice is chosen at run time.
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
    order
        Order of the interpolation, see `plenofir.refocus.operator.interpolated_sums`.
    hold
        See `plenofir.refocus.switches.FilterLayout`.
    parallel_rows
        Degree of parallelism (iota in the thesis): rows that are filtered at once.
    broadcast_taps
        Taps that one latch of the broadcast net drives; 0 for no latches.
    engine
        "fir": semi-systolic filters; "moving_sum": moving sums (`plenofir.refocus.moving_sum`).
    any_rows
        Moving sums only: whether frames whose rows are no multiple of M follow each other without
        a pause, too, which takes a few lines of memory more.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=1)]
    shifts: Annotated[tuple[int, ...], Field(min_length=1)]
    max_columns: Annotated[int, Field(ge=1)]
    channels: Annotated[int, Field(ge=1, le=3)] = 1
    pixel_bits: Annotated[int, Field(ge=1, le=16)] = 8
    arithmetic: Arithmetic = ExactArithmetic()
    align: Align = "centred"
    order: Annotated[int, Field(ge=0, le=MAX_INTERPOLATION_ORDER)] = 0
    hold: bool = False
    parallel_rows: Annotated[int, Field(ge=1)] = 1
    broadcast_taps: Annotated[int, Field(ge=0)] = 0
    engine: Engine = "fir"
    any_rows: bool = False

    @property
    def layout(self) -> FilterLayout:
        """Taps and switches of the first filter of each dimension."""
        return FilterLayout(self.micro_image_size, self.shifts, self.align, self.hold)

    @property
    def box_layout(self) -> FilterLayout:
        """Taps of the moving sums that interpolation appends."""
        return FilterLayout(self.micro_image_size, (1,), self.align)

    @property
    def taps(self) -> int:
        """Taps of all filters of a dimension."""
        return self.layout.taps + self.order * self.box_layout.taps

    @property
    def delay(self) -> int:
        """Delay of the row filters in pixels and of the column filters in lines."""
        return self.layout.delay + self.order * self.box_layout.delay

    @property
    def column_depth(self) -> int:
        """Columns whose partial sums a column module keeps."""
        return -(-self.max_columns // self.parallel_rows)

    @property
    def sum_layout(self) -> SumLayout:
        """Schedule of the first moving sum of each dimension."""
        return SumLayout(self.micro_image_size, self.shifts, self.align, self.any_rows)

    @property
    def box_sum_layout(self) -> SumLayout:
        """Schedule of the moving sums that interpolation appends."""
        return SumLayout(self.micro_image_size, (1,), self.align, self.any_rows)

    @property
    def line_buffer_bits(self) -> int:
        """Bits that the column filters of all channels keep: partial sums, or pixels and sums."""
        if self.column_depth == 1:
            return 0
        if self.engine == "moving_sum":
            bits = 0
            for number in range(self.order + 1):
                sums = self.box_sum_layout if number else self.sum_layout
                pixel_bits, sum_bits = self._moving_sum_widths(number)
                bits += sum(sums.ring_lines) * pixel_bits + sums.sum_words * sum_bits
            return self.channels * self.max_columns * bits
        words = self.parallel_rows << (self.column_depth - 1).bit_length()
        bits = 0
        for number in range(self.order + 1):
            layout = self.box_layout if number else self.layout
            kept = layout.taps if layout.hold else layout.taps - 1
            bits += kept * self._column_sum_bits(number)
        return self.channels * words * bits

    def _moving_sum_widths(self, number: int) -> tuple[int, int]:
        """Bits of a pixel and of a sum of a column stage with moving sums, counted from 0."""
        if isinstance(self.arithmetic, ExactArithmetic):
            # Columns come first.
            largest = ((1 << self.pixel_bits) - 1) * self.micro_image_size**number
            return largest.bit_length(), (largest * self.micro_image_size).bit_length()
        sum_bits = self._column_sum_bits(number)
        largest = self.arithmetic.largest_sum(self.micro_image_size, self.pixel_bits)
        return (largest // self.micro_image_size).bit_length(), sum_bits

    def _column_sum_bits(self, number: int) -> int:
        """Width of the sums of a column filter, counted from 0."""
        if isinstance(self.arithmetic, ExactArithmetic):
            largest = ((1 << self.pixel_bits) - 1) * self.micro_image_size ** (
                self.order + 2 + number
            )
            return int(largest).bit_length()
        return self.arithmetic.largest_sum(self.micro_image_size, self.pixel_bits).bit_length()

    @property
    def array_clocks(self) -> int:
        """Clocks from a token at the module array's input to its output (array_latency)."""
        stored = isinstance(self.arithmetic, StoredProductArithmetic)
        if self.engine == "moving_sum":
            # The memory of lines (ram_blocks) takes a clock more than that of a line's last pixels.
            stages = 10 + 10 + (self.max_columns > 1)
        else:
            stages = 2 * (3 + (self.broadcast_taps > 0))
        stages += 2 * stored
        return (self.order + 1) * stages + (0 if stored else _DIVIDE_CLOCKS)

    def band_steps(self, columns: int) -> int:
        """Tokens from the beginning of a band to that of the next one at the earliest.

        Parameters
        ----------
        columns
            Line length in pixels.

        Returns
        -------
        int
            A multiple of `parallel_rows`, at least `columns`.
        """
        n = self.parallel_rows
        least = n if self.max_columns <= n else n - 1 + PARTIAL_SUM_LOOP
        if self.engine == "moving_sum":
            least = max(least, self.delay + 1)
        return -(-max(columns, least) // n) * n

    def frame_lines(self, rows: int) -> int:
        """Lines from the beginning of a frame to that of the next one at the earliest.

        Parameters
        ----------
        rows
            Rows of a frame.

        Returns
        -------
        int
            At least `rows`; lines of blanking count.
        """
        if self.engine == "fir":
            return rows
        if self.any_rows:
            return max(rows, self.delay + 1, self.sum_layout.reach)
        m = self.micro_image_size
        return -(-max(rows, self.delay + 1) // m) * m

    def full_rate(self, columns: int, rows: int) -> bool:
        """Whether frames of a size need no blanking.

        Then a source is never refused, whether it brings a pixel each clock or leaves gaps.

        Parameters
        ----------
        columns, rows
            Frame size in pixels.

        Returns
        -------
        bool
            False where lines or frames want a pause.
        """
        shortest_band = min(rows, rows % self.parallel_rows or self.parallel_rows)
        fast_bands = shortest_band * columns >= self.band_steps(columns)
        return fast_bands and self.frame_lines(rows) == rows

    def array_latency_clocks(self, columns: int, *, deskew: bool = False) -> int:
        """Clocks from the module array's first pixel in to its first pixel out.

        Bands follow each other as soon as they may: floor(D/N) bands until the one that
        holds the first line of the frame, D columns of the row filter, D mod N (the line's place
        in its band) skew registers, and the pipeline.

        Parameters
        ----------
        columns
            Line length in pixels.
        deskew
            Whether the array delays all rows alike.

        Returns
        -------
        int
            Latency in clocks.
        """
        bands, row = divmod(self.delay, self.parallel_rows)
        skew = self.parallel_rows - 1 if deskew else row
        return bands * self.band_steps(columns) + self.delay + skew + self.array_clocks

    def array_frame_clocks(self, columns: int, rows: int) -> int:
        """Clocks of the module array for each frame of a sequence.

        Parameters
        ----------
        columns, rows
            Frame size in pixels.

        Returns
        -------
        int
            Clocks from a frame to the next.
        """
        return -(-rows // self.parallel_rows) * self.band_steps(columns)

    def array_first_frame_clocks(self, columns: int, rows: int) -> int:
        """Clocks from the module array's first pixel in to the last pixel of the frame out.

        Parameters
        ----------
        columns, rows
            Frame size in pixels.

        Returns
        -------
        int
            Clocks, both ends included.
        """
        bands, row = divmod(rows - 1 + self.delay, self.parallel_rows)
        tokens = bands * self.band_steps(columns) + columns - 1 + self.delay + row
        return tokens + self.array_clocks + 1

    def latency_clocks(self, columns: int, rows: int = MAX_ROWS, frames: int = 1) -> int:
        """Clocks from the raster core's first pixel taken to its first pixel offered.

        Nothing stalls, and frames follow each other without a gap.

        Parameters
        ----------
        columns, rows
            Frame size in pixels.
        frames
            Number of frames; empty bands follow the last.

        Returns
        -------
        int
            Latency in clocks.
        """
        bands, row = divmod(self.delay, self.parallel_rows)
        start = self._band_start(bands, columns, rows, frames)
        gather = 1 if self.parallel_rows > 1 else 0
        return start + self.delay + row + self.array_clocks + _STREAM_CLOCKS + gather

    @property
    def video_delay_pixels(self) -> int:
        """Pixels that the video path is behind its input, besides lines (its DELAY_PIXELS)."""
        return self.delay + self.array_clocks + _STREAM_CLOCKS

    def video_latency_clocks(self, line_length: int) -> int:
        """Clocks from a pixel at the video path's input to the same place at its output.

        Parameters
        ----------
        line_length
            Pixels of a line, blanking included.

        Returns
        -------
        int
            The delay in lines and in pixels, the pipeline, and 5 registers of the video path.
        """
        return self.delay * line_length + self.video_delay_pixels + _VIDEO_CLOCKS

    def _band_start(self, band: int, columns: int, rows: int, frames: int) -> int:
        """Clock at which the sequencer begins the line that completes a band.

        With parallel rows an empty band waits until the lines before it are out of the array.
        """
        now = ready = 0
        steps = self.band_steps(columns)
        completed = 0
        line = 0
        while True:
            place = line % rows
            image = line < rows * frames
            completes = (
                not image or place % self.parallel_rows == self.parallel_rows - 1
            ) or place == rows - 1
            if not image and self.parallel_rows > 1:
                now += self.delay + self.parallel_rows - 1 + _SEQUENCER_GATHER + self.array_clocks
            if completes:
                now = max(now, ready)
                if completed == band:
                    return now
                completed += 1
                ready = now + steps
            now += columns
            line += 1

    def generics(self) -> dict[str, int | bool | str]:
        """Generics of the entity ``raster_refocuser``.

        Returns
        -------
        dict
            Name to value.
        """
        values: dict[str, int | bool | str] = {
            "MICRO_IMAGE_SIZE": self.micro_image_size,
            "SHIFTS": " ".join(str(shift) for shift in self.shifts),
            "CENTRED": self.align == "centred",
            "INTERPOLATION_ORDER": self.order,
            "HOLD": self.hold,
            "PARALLEL_ROWS": self.parallel_rows,
            "MAX_COLUMNS": self.max_columns,
            "CHANNELS": self.channels,
            "PIXEL_BITS": self.pixel_bits,
            "EXACT": isinstance(self.arithmetic, ExactArithmetic),
            "BROADCAST_TAPS": self.broadcast_taps,
        }
        if self.engine == "moving_sum":
            values["ENGINE"] = self.engine
        if self.any_rows:
            values["ANY_ROWS"] = True
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

        m = self.micro_image_size
        largest_shift = max(self.shifts, key=abs)
        if m > MAX_MICRO_IMAGE_SIZE:
            raise refuse(f"M = {m}", "M", f"M of at most {MAX_MICRO_IMAGE_SIZE}")
        if self.max_columns > MAX_COLUMNS:
            raise refuse(
                f"a line of {self.max_columns} pixels", "raw", f"at most {MAX_COLUMNS} columns"
            )
        if len(self.shifts) > MAX_SLICES:
            raise refuse(f"a set of {len(self.shifts)} slices", "SWEEP", f"at most {MAX_SLICES}")
        if self.parallel_rows > MAX_PARALLEL_ROWS:
            raise refuse(
                f"{self.parallel_rows} rows at once", "IOTA", f"at most {MAX_PARALLEL_ROWS}"
            )
        if self.engine == "moving_sum" and self.hold:
            raise InputError(
                "hold", where="hold", expected="no hold: moving sums hold by themselves"
            )
        if self.engine == "moving_sum" and self.parallel_rows > 1:
            raise InputError(
                f"{self.parallel_rows} rows at once",
                where="IOTA",
                expected="1 with ENGINE=moving_sum",
            )
        if self.engine != "moving_sum" and self.any_rows:
            raise InputError("any rows", where="ANY_ROWS", expected="0 without ENGINE=moving_sum")
        too_many_taps = self.engine == "fir" and self.taps > MAX_TAPS
        if abs(largest_shift) > MAX_SHIFT or too_many_taps:
            raise refuse(
                f"a filter of {self.taps} taps (M = {m}, a' = {largest_shift})",
                "A",
                f"at most {MAX_TAPS} taps",
            )
        if isinstance(self.arithmetic, ExactArithmetic):
            largest = self.arithmetic.largest_sum(m, self.pixel_bits, self.order)
            if largest + m ** (2 * self.order + 2) >= 1 << 31:
                raise refuse(
                    f"a sum of {largest.bit_length()} bits (M = {m}, interpolation of order "
                    f"{self.order}, {self.pixel_bits} bit pixels)",
                    "INTERPOLATION",
                    "sums below 2^31: a lower order, or ARITH=stored",
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
        if self.hold and not self.layout.can_hold:
            raise InputError(
                "the outputs of a micro image differ",
                where="hold",
                expected="integer a only (for even M, even a), or no hold",
            )
        if self.line_buffer_bits > MAX_LINE_BUFFER_BITS:
            raise refuse(
                f"{self.line_buffer_bits / 2**20:.1f} Mbit of line buffers "
                f"({self.taps - 1} lines of partial sums, {self.max_columns} columns)",
                "A",
                f"at most {MAX_LINE_BUFFER_BITS >> 20} Mbit: fewer columns, or a nearer to 1/M",
            )
