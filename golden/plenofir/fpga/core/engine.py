# SPDX-License-Identifier: Apache-2.0
"""The common part of the cores of all engines, and the interface of an engine."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from typing import Annotated, ClassVar, Literal, NamedTuple, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from plenofir.fpga.resources.memory import Memory
from plenofir.ground.errors import InputError
from plenofir.refocus import MAX_INTERPOLATION_ORDER, Border
from plenofir.refocus.arithmetic import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.operator import Align
from plenofir.refocus.sharpening import MAX_WEIGHT_UNITS
from plenofir.refocus.switches import FilterLayout

SignalKind = Literal["bit", "downto", "to"]
Scope = tuple[SignalKind, str, str]
"""Signals in a waveform: kind, instance with a slash behind it, names."""


def within(instance: str, scopes: Iterable[Scope]) -> tuple[Scope, ...]:
    """The same signals, their instances within another one."""
    return tuple((kind, f"{instance}/{scope}", names) for kind, scope, names in scopes)


Generics = dict[str, int | bool | str]

# The column filter's read-modify-write loop takes this many clocks (refocus_pkg.PARTIAL_SUM_LOOP).
PARTIAL_SUM_LOOP = 4

MAX_PARALLEL_ROWS = 64
MAX_LINE_BUFFER_BITS = 1 << 26
"""Bits of column memories, or of a depth index, that the VHDL takes (refocus_pkg)."""
PixelsPerClock = Literal[1, 2, 4, 8, 16, 32]
PIXELS_PER_CLOCK: tuple[PixelsPerClock, ...] = get_args(PixelsPerClock)
MAX_LANE_DELAY = 4096
"""Tokens of several pixels by which a row stage may delay."""


def check_lane_delay(delay: int, pixels: int) -> None:
    """Refuse a row delay in tokens that the core cannot have."""
    if pixels > 1 and delay > MAX_LANE_DELAY:
        raise InputError(
            f"a row delay of {delay} tokens of {pixels} pixels exceeds the core's limit of "
            f"{MAX_LANE_DELAY}; use focus settings a closer to 1/M",
            where="shifts",
        )


class Words(NamedTuple):
    """Bits of a stage's words, for one channel."""

    value: int  # address of the stored products; 0 without them
    data: int  # a summand
    sum: int


class Raster(BaseModel):
    """The part of a core's configuration that all engines share; see `CoreConfiguration`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=1)]  # M in pixels
    # The a' in pixels of the slices that can be selected at run time; of a stack, its slices.
    shifts: Annotated[tuple[int, ...], Field(min_length=1)]
    max_columns: Annotated[int, Field(ge=1)]  # largest line length in pixels
    channels: Annotated[int, Field(ge=1, le=3)] = 1  # 1 (grey) or 3 (RGB)
    # 8 or 16 in the golden model; the core takes 1 to 16.
    pixel_bits: Annotated[int, Field(ge=1, le=16)] = 8
    arithmetic: Arithmetic = ExactArithmetic()
    align: Align = "centred"  # see `plenofir.refocus.operator.output_offset`
    # Order of the interpolation, see `plenofir.refocus.operator.interpolated_sums`.
    order: Annotated[int, Field(ge=0, le=MAX_INTERPOLATION_ORDER)] = 0
    # Weight of each slice in 64ths (`plenofir.refocus.sharpening`); empty: no sharpener.
    sharpening: tuple[Annotated[int, Field(ge=0, le=MAX_WEIGHT_UNITS)], ...] = ()
    # Samples B of each slice's box, see `plenofir.refocus.operator`; empty: M for all.
    boxes: tuple[Annotated[int, Field(ge=1)], ...] = ()
    # How sums are divided where views are missing, see `plenofir.refocus.border`.
    border: Border = "zero"

    @model_validator(mode="after")
    def _a_weight_for_each_slice(self) -> Self:
        if self.sharpening and len(self.sharpening) != len(self.shifts):
            raise ValueError("sharpening has a weight for each slice, or none")
        return self

    @model_validator(mode="after")
    def _a_box_for_each_slice(self) -> Self:
        if self.boxes and len(self.boxes) != len(self.shifts):
            raise ValueError("boxes has a number for each slice, or none")
        return self

    @property
    def slice_boxes(self) -> tuple[int, ...]:
        """Samples B of each slice's box."""
        return self.boxes or (self.micro_image_size,) * len(self.shifts)

    @property
    def largest_box(self) -> int:
        """The largest box of a slice, whose sums are the largest."""
        return max(self.slice_boxes)

    @property
    def boxes_differ(self) -> bool:
        """Whether slices have boxes that differ, and so divisors that differ."""
        return len(set(self.slice_boxes)) > 1

    @property
    def smaller_box(self) -> bool:
        """Whether a slice has a box below M."""
        return min(self.slice_boxes) < self.micro_image_size

    @property
    def weighted(self) -> bool:
        """Whether sums are divided by weights: of the border, or of slices with other boxes."""
        return self.normalises or self.boxes_differ

    @property
    def sharpens(self) -> bool:
        """Whether there is a sharpener: a slice has a weight above 0."""
        return any(self.sharpening)

    @property
    def normalises(self) -> bool:
        """Whether sums are divided by the weights of the views they contain."""
        return self.border == "normalise"

    @property
    def weights(self) -> tuple[int, ...]:
        """Weight of each slice in 64ths."""
        return self.sharpening or (0,) * len(self.shifts)

    @property
    def exact(self) -> bool:
        """Whether sums are exact; otherwise products are stored."""
        return isinstance(self.arithmetic, ExactArithmetic)

    @property
    def passes(self) -> int:
        """Stages of a dimension."""
        return self.order + 1

    @property
    def column_bits(self) -> int:
        # A line of one column has an address, too.
        return max((self.max_columns - 1).bit_length(), 1)

    @property
    def slice_bits(self) -> int:
        return max((len(self.shifts) - 1).bit_length(), 1)

    def pass_shifts(self, number: int) -> tuple[int, ...]:
        """Set of a' of a stage; stages after the first of a dimension interpolate with a' = 1.

        Slices with one box share these stages.
        """
        if number % self.passes == 0:
            return self.shifts
        return (1,) * (len(self.shifts) if self.boxes_differ else 1)

    def filter_layout(self, number: int = 0) -> FilterLayout:
        """Taps of the switched filter that is equivalent to a stage."""
        shifts = self.pass_shifts(number)
        boxes = self.slice_boxes[: len(shifts)]
        return FilterLayout(self.micro_image_size, shifts, self.align, boxes=boxes)

    def sum_layout(self, number: int = 0) -> SumLayout:
        """Schedule of the moving sum that is equivalent to a stage."""
        shifts = self.pass_shifts(number)
        boxes = self.slice_boxes[: len(shifts)]
        return SumLayout(self.micro_image_size, shifts, self.align, boxes=boxes)

    @property
    def filter_delay(self) -> int:
        """Delay of the row stages in pixels, and of the column stages in lines."""
        return sum(self.filter_layout(number).delay for number in range(self.passes))

    @property
    def delay(self) -> int:
        """Delay with the sharpener, in pixels and in lines."""
        return self.filter_delay + self.micro_image_size * self.sharpens

    def words(self, number: int) -> Words:
        """Widths of a stage, counted from 0 in the order in which the pixels pass."""
        box = self.largest_box
        value_bits = 0
        largest = ((1 << self.pixel_bits) - 1) * box**number
        if isinstance(self.arithmetic, StoredProductArithmetic):
            guard_bits = self.arithmetic.guard_bits if number else 0
            value_bits = self.pixel_bits + guard_bits
            scale_bits = self.arithmetic.fraction_bits - guard_bits
            # The product of a white pixel, rounded half up as the ROM has it.
            largest = (((2 << value_bits) - 2 << scale_bits) + box) // (2 * box)
        return Words(value_bits, largest.bit_length(), (box * largest).bit_length())


class Engine(BaseModel, ABC):
    """How a core filters. Methods take the part of the configuration that all engines share."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: str
    ENTITY: ClassVar[str] = "raster_refocuser"
    COMPONENT: ClassVar[str]
    """Component of `refocuser` with the files of this engine alone."""
    CLOCK_SHARE: ClassVar[float] = 1
    """Share of the clock that a device's cores keep (`Device.clocks_mhz`) which this one keeps."""

    @abstractmethod
    def waves(self, raster: Raster) -> tuple[Scope, ...]:
        """Signals of the engine that a waveform shows: no records, which GHDL 2 leaves out."""

    @property
    def rows_at_once(self) -> int:
        """Rows that are filtered at once."""
        return 1

    @property
    def pixels_at_once(self) -> PixelsPerClock:
        """Neighbouring pixels of a line that come together."""
        return 1

    def row_tokens(self, raster: Raster) -> int:
        """Delay of the row stages in tokens."""
        return raster.delay

    def taps(self, raster: Raster) -> int:
        """Taps of all switched filters of a dimension, or of those that would do the same."""
        return sum(raster.filter_layout(number).taps for number in range(raster.passes))

    @abstractmethod
    def summary(self, raster: Raster) -> str:
        """The engine in a few words."""

    @abstractmethod
    def pass_clocks(self, raster: Raster) -> int:
        """Clocks of a row stage and a column stage, without stored products."""

    def stages_clocks(self, raster: Raster) -> int:
        """Clocks of all stages, without stored products."""
        return raster.passes * self.pass_clocks(raster)

    def slices_at_once(self, raster: Raster) -> int:
        """Slices of which sums come out together."""
        del raster
        return 1

    @abstractmethod
    def memories(self, raster: Raster) -> Iterator[Memory]:
        """Memories of the engine, for the estimate."""

    @abstractmethod
    def fifos(self, raster: Raster, array_clocks: int) -> Iterator[Memory]:
        """Memories of the core around the engine, whose sums come so many clocks late."""

    @abstractmethod
    def structure(self, raster: Raster) -> dict[str, int]:
        """Amounts of what takes look-up tables and flip-flops in a core, for the estimate."""

    @abstractmethod
    def line_buffer_bits(self, raster: Raster) -> int:
        """Bits that the column stages of all channels keep of lines of more than one column."""

    def least_steps(self, raster: Raster) -> int:
        """Least tokens from the beginning of a band to that of the next, for the shortest lines."""
        n = self.rows_at_once
        loop = raster.max_columns > n or raster.sharpens
        return n - 1 + PARTIAL_SUM_LOOP if loop else n

    def blank_lines(self, raster: Raster) -> int:
        """Most lines that are needed between frames, for any number of rows."""
        return 0

    @abstractmethod
    def frame_lines(self, raster: Raster, rows: int) -> int:
        """Lines from the beginning of a frame to that of the next one at the earliest.

        The frame's rows, but for the plan's `min_bands` and `modulus` in VHDL.
        """

    def for_video(self) -> Self:
        """The same engine for video, which has blanking between lines and frames."""
        return self

    def check(self, raster: Raster) -> None:
        """Refuse what the engine cannot be built for, with an InputError that names the field."""

    @abstractmethod
    def generics(self, raster: Raster) -> Generics:
        """Generics of `ENTITY` besides those that all cores have."""


class SliceEngine(Engine):
    """An engine for one slice at a time, with the methods that planner and estimate call."""

    UNIT: ClassVar[str]
    """What `extent` counts."""
    LARGEST: ClassVar[dict[str, int]] = {}
    """Limits of names in its VHDL, for the linter's arithmetic."""

    def generics(self, raster: Raster) -> Generics:
        values: Generics = {"INTERPOLATION_ORDER": raster.order, "EXACT": raster.exact}
        if isinstance(raster.arithmetic, StoredProductArithmetic):
            values["FRACTION_BITS"] = raster.arithmetic.fraction_bits
            values["GUARD_BITS"] = raster.arithmetic.guard_bits
        if raster.sharpens:
            values["SHARPENING"] = " ".join(map(str, raster.weights))
        return values

    @classmethod
    @abstractmethod
    def variants(
        cls, raster: Raster, parallel_rows: int, rows: int | None
    ) -> Iterator["SliceEngine"]:
        """Engines for a core, the simplest first; with `rows`, for such frames back to back."""

    @abstractmethod
    def extent(self, raster: Raster) -> int:
        """Taps or lines that grow with the set of slices."""

    @abstractmethod
    def lines(self, raster: Raster) -> int:
        """Lines that each channel keeps."""

    def without_shortcuts(self) -> "SliceEngine":
        """The same engine without what is only possible for this set of slices."""
        return self

    def savings(self, raster: Raster) -> Iterator[tuple[str, "SliceEngine"]]:
        """What the engine leaves out, each with the engine that includes it."""
        yield from ()

    @abstractmethod
    def describe(self, raster: Raster, rows: int) -> Iterator[tuple[str, str]]:
        """Names and values to print, for frames of a number of rows."""

    def fifos(self, raster: Raster, array_clocks: int) -> Iterator[Memory]:
        n, tokens = self.rows_at_once, -(-raster.max_columns // self.pixels_at_once)
        data_bits = self.pixels_at_once * raster.channels * raster.pixel_bits
        yield Memory("input FIFO", (tokens + 2 * n - 1).bit_length(), data_bits + 2, 1)
        under_way = 2 + 2 * (n > 1) + array_clocks
        output_words = (2 * raster.max_columns + n if n > 1 else 0) + 2 * (under_way + 1)
        width = data_bits + 2 + raster.slice_bits + 1
        yield Memory("output FIFO", (output_words - 1).bit_length(), width, n)
        if n > 1:
            yield Memory("row buffers", raster.column_bits, data_bits, n - 1)
