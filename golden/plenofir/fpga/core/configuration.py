# SPDX-License-Identifier: Apache-2.0
"""Configuration of a core: its generics, limits, memory and latency."""

from fractions import Fraction
from itertools import chain, count
from typing import Annotated

import numpy as np
from pydantic import Field

from plenofir.fpga.core.border import border_blocks, check_border, scaler_clocks, weights_clocks
from plenofir.fpga.core.engine import MAX_LINE_BUFFER_BITS as MAX_LINE_BUFFER_BITS
from plenofir.fpga.core.engine import PARTIAL_SUM_LOOP as PARTIAL_SUM_LOOP
from plenofir.fpga.core.engine import Generics, PixelsPerClock, Raster, SliceEngine
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.sharpener import (
    SHARPENER_CLOCKS,
    check_sharpener,
    sharpener_bits,
    sharpener_blocks,
)
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import Device
from plenofir.fpga.names import DEFAULT_ENGINE, SliceEngineName
from plenofir.fpga.resources.estimate import Block
from plenofir.ground.errors import InputError
from plenofir.refocus.arithmetic import ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.operator import Image, box_size
from plenofir.refocus.sharpening import WEIGHT_UNITS

MAX_MICRO_IMAGE_SIZE = 128
MAX_SHIFT = 4096
MAX_SLICES = 256
MAX_COLUMNS = 8192
MAX_ROWS = 65535
MAX_PRODUCT_ADDRESS_BITS = 16

# Input FIFO 3, sequencer 1, output FIFO 3 (refocus_pkg.STREAM_LATENCY).
STREAM_CLOCKS = 7
# Tokens in the sequencer and the row gather.
_SEQUENCER_GATHER = 4

SLICE_ENGINES: dict[SliceEngineName, type[FirEngine] | type[MovingSumEngine]] = {
    "fir": FirEngine,
    "moving_sum": MovingSumEngine,
}
"""Engines that are set to one slice at a time; `StackEngine` gives all slices at once."""


class CoreConfiguration(Raster):
    """Generics of a core: of the raster refocuser, or of a focal stack."""

    # The engine, with the fields that only it has.
    engine: Annotated[FirEngine | MovingSumEngine | StackEngine, Field(discriminator="kind")] = (
        SLICE_ENGINES[DEFAULT_ENGINE]()
    )

    @property
    def unbuilt(self) -> frozenset[str]:
        """Components of ``refocuser`` that the core does without, with all that they need."""
        names = {engine.COMPONENT for engine in (*SLICE_ENGINES.values(), StackEngine)}
        names -= {self.engine.COMPONENT}
        if not self.normalises:
            names.add("border_weights")
        if not self.sharpens:
            names.add("lens_sharpener")
        if self.pixels_per_clock == 1:
            names.add("lane_stage")
        return frozenset(names)

    @property
    def parallel_rows(self) -> int:
        """Rows that are filtered at once."""
        return self.engine.rows_at_once

    @property
    def pixels_per_clock(self) -> PixelsPerClock:
        """Neighbouring pixels of a line that come together."""
        return self.engine.pixels_at_once

    def line_tokens(self, columns: int) -> int:
        """Tokens of a line of so many pixels."""
        return -(-columns // self.pixels_per_clock)

    def kept_mhz(self, device: Device) -> float:
        """Clock in MHz that the core keeps on a device; 0 if it is not known."""
        return self.engine.CLOCK_SHARE * device.clock_mhz(self.pixels_per_clock)

    @property
    def taps(self) -> int:
        """Taps of all switched filters of a dimension; for moving sums, of equivalent filters."""
        return self.engine.taps(self)

    @property
    def line_buffer_bits(self) -> int:
        """Bits that the column stages of all channels keep: partial sums, or pixels and sums."""
        sharpener = sharpener_bits(self, self.pixels_per_clock)
        return self.engine.line_buffer_bits(self) + sharpener

    @property
    def error_bound(self) -> Fraction:
        """Largest possible distance from the real-valued operator, in grey levels."""
        if self.sharpens or self.normalises:
            # One rounding; an even divisor can be off by exactly one half.
            return Fraction(1, 2)
        return max(
            self.arithmetic.error_bound(box, self.pixel_bits, self.order)
            for box in self.slice_boxes
        )

    @property
    def array_clocks(self) -> int:
        """Clocks from a token at the array's input to its output (array_latency)."""
        products = 0 if self.exact else 2 * self.passes
        stages = self.engine.stages_clocks(self) + products
        if self.normalises:
            # If the weights take longer than the sums, tokens wait for them.
            stages = max(stages, weights_clocks(self, self.pixels_per_clock))
        sharpener = SHARPENER_CLOCKS if self.sharpens else 0
        return stages + sharpener + (scaler_clocks(self) if self.exact else 0)

    def band_steps(self, columns: int) -> int:
        """Least tokens from the beginning of a band to that of the next one.

        A multiple of `parallel_rows`, at least `columns`.
        """
        n = self.parallel_rows
        return -(-max(self.line_tokens(columns), self.engine.least_steps(self)) // n) * n

    def frame_lines(self, rows: int) -> int:
        """Least lines from a frame's beginning to the next one's, blanking included."""
        return self.engine.frame_lines(self, rows)

    def full_rate(self, columns: int, rows: int) -> bool:
        """Whether frames of a size need no blanking.

        Then a source never has to wait, whether it sends a pixel each clock or leaves gaps.
        """
        shortest_band = min(rows, rows % self.parallel_rows or self.parallel_rows)
        fast_bands = shortest_band * self.line_tokens(columns) >= self.band_steps(columns)
        return fast_bands and self.frame_lines(rows) == rows

    def latency_clocks(self, columns: int, rows: int = MAX_ROWS, frames: int = 1) -> int:
        """Clocks from the core's first pixel taken to its first pixel offered.

        Without stalls, and with frames back to back; empty bands follow the last frame.
        """
        bands, row = divmod(self.delay, self.parallel_rows)
        start = self._band_start(bands, columns, rows, frames)
        gather = 2 if self.parallel_rows > 1 else 0
        tokens = self.engine.row_tokens(self) + row
        return start + tokens + self.array_clocks + STREAM_CLOCKS + gather

    @property
    def video_delay_pixels(self) -> int:
        """Delay of the video path in pixels, besides that in lines (its DELAY_PIXELS)."""
        return self.delay + self.array_clocks + STREAM_CLOCKS

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
            now += self.line_tokens(columns)
            line += 1

    def golden(self, raw: Image) -> Image:
        """Refocus a raw image to all slices, as the core does: shape (slices, rows, columns[, 3]).

        InputError if the sums could wrap around.
        """
        return np.stack([self.golden_slice(raw, slice_) for slice_ in range(len(self.shifts))])

    def golden_slice(self, raw: Image, slice_: int) -> Image:
        """Refocus a raw image to one slice, as the core does; errors as `golden`."""
        return self.arithmetic.refocus(
            raw,
            self.micro_image_size,
            shift=self.shifts[slice_],
            align=self.align,
            order=self.order,
            sharpen=Fraction(self.weights[slice_], WEIGHT_UNITS),
            border=self.border,
            box=self.slice_boxes[slice_],
        )

    def generics(self) -> Generics:
        """Generics of the engine's entity, ``raster_refocuser`` or ``focal_stack``."""
        values: Generics = {
            "MICRO_IMAGE_SIZE": self.micro_image_size,
            "SHIFTS": " ".join(str(shift) for shift in self.shifts),
            "CENTRED": self.align == "centred",
            "MAX_COLUMNS": self.max_columns,
            "CHANNELS": self.channels,
            "PIXEL_BITS": self.pixel_bits,
        }
        # A box of more than M samples, which Python refuses, is the VHDL's to refuse too.
        if set(self.slice_boxes) != {self.micro_image_size}:
            boxes = self.slice_boxes if self.boxes_differ else self.slice_boxes[:1]
            values["BOX"] = " ".join(map(str, boxes))
        if self.normalises:
            values["BORDER_NORMALISED"] = True
        return values | self.engine.generics(self)

    @property
    def slice_engine(self) -> SliceEngine:
        """The engine, of cores for one slice at a time."""
        assert isinstance(self.engine, SliceEngine), self.engine.kind
        return self.engine

    def _products(self) -> tuple[tuple[int, int, int], ...]:
        """Number of products with a reciprocal, and the bits of both factors.

        None for stored products and for B of a power of two; divisions by weights are in
        `border_blocks`.
        """
        box = self.largest_box
        divisor = box ** (2 * self.order + 2)
        shifted = divisor & (divisor - 1) == 0
        if not isinstance(self.arithmetic, ExactArithmetic) or self.weighted or shifted:
            return ()
        largest = self.arithmetic.largest_sum(box, self.pixel_bits, self.order)
        number = self.channels * self.parallel_rows * self.pixels_per_clock
        slices = self.engine.slices_at_once(self)
        return ((number * slices, *reciprocal_bits(largest, divisor)),)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks for the estimate: the engine with the core around it, then what is behind it."""
        engine, p = self.engine, self.pixels_per_clock
        # The FIFO of slices beside the input FIFO.
        parts = {**engine.structure(self), "waiting slices": int(len(self.shifts) > 1)}
        memories = (*engine.memories(self), *engine.fifos(self, self.array_clocks))
        borders = (
            border_blocks(self, p * self.parallel_rows) for _ in range(engine.slices_at_once(self))
        )
        return (
            Block(engine.kind, parts, memories, self._products()),
            *sharpener_blocks(self, p),
            *chain.from_iterable(borders),
        )

    def _check_plan(self) -> None:
        """Refuse numbers of an engine with which no core would give the golden model's picture."""
        engine, p = self.engine, self.pixels_per_clock
        if engine.row_tokens(self) * p < self.delay:
            raise InputError(
                f"{engine.kind}: row_tokens, {engine.row_tokens(self)} of {p} pixels, are shorter "
                f"than the delay of {self.delay} pixels",
                where="engine",
            )

    def _check_boxes(self) -> None:
        """Refuse boxes with what cannot have them."""
        if self.boxes_differ and not self.exact:
            raise InputError(
                "must be the same for all slices with stored products; use exact arithmetic",
                where="box",
            )
        if self.boxes_differ and self.sharpens:
            raise InputError(
                "must be the same for all slices with sharpening; use one box, or no sharpening",
                where="box",
            )

    def check_limits(self) -> None:
        """Refuse what the core cannot be built for, by field and limit."""

        def refuse(size: str, field: str, limit: str) -> InputError:
            return InputError(f"{size} exceeds the core's limit of {limit}", where=field)

        m = self.micro_image_size
        largest_shift = max(self.shifts, key=abs)
        if m > MAX_MICRO_IMAGE_SIZE:
            raise refuse(f"M = {m}", "micro_image_size", f"{MAX_MICRO_IMAGE_SIZE}")
        if self.max_columns > MAX_COLUMNS:
            size = f"a line of {self.max_columns} pixels"
            raise refuse(size, "max_columns", f"{MAX_COLUMNS} columns")
        if len(self.shifts) > MAX_SLICES:
            size = f"a set of {len(self.shifts)} slices"
            raise refuse(size, "shifts", f"{MAX_SLICES}")
        for shift, box in zip(self.shifts, self.slice_boxes, strict=True):
            box_size(m, shift, box)
        self._check_boxes()
        self.engine.check(self)
        self._check_plan()
        if self.sharpens:
            check_sharpener(self, self.engine.kind, self.parallel_rows)
        if self.normalises:
            check_border(self, self.parallel_rows)
        if abs(largest_shift) > MAX_SHIFT:
            raise refuse(f"a' = {largest_shift}", "shifts", f"-{MAX_SHIFT} to {MAX_SHIFT}")
        if isinstance(self.arithmetic, ExactArithmetic):
            box = self.largest_box
            largest = self.arithmetic.largest_sum(box, self.pixel_bits, self.order)
            # A natural of VHDL has 31 bits, and rounding adds to the sum before it is divided.
            if largest + box ** (2 * self.order + 2) >= 1 << 31:
                of_box = f", a box of {box}" if box < m else ""
                raise refuse(
                    f"a sum of {largest.bit_length()} bits (M = {m}{of_box}, interpolation of "
                    f"order {self.order}, {self.pixel_bits} bit pixels)",
                    "order",
                    "31 bits; use a lower order, or stored products",
                )
        if isinstance(self.arithmetic, StoredProductArithmetic):
            address_bits = self.pixel_bits + self.arithmetic.guard_bits
            if address_bits > MAX_PRODUCT_ADDRESS_BITS:
                raise refuse(
                    f"a stored-product ROM of 2^{address_bits} words "
                    f"({self.pixel_bits} bit pixels, {self.arithmetic.guard_bits} guard bits)",
                    "arithmetic",
                    f"2^{MAX_PRODUCT_ADDRESS_BITS}; use fewer guard bits, or exact arithmetic",
                )
            white = ((1 << self.pixel_bits) - 1) << self.arithmetic.fraction_bits
            # A product of the largest pixel rounds to 0 then: such a core is black.
            if 2 * white < self.largest_box:
                raise InputError(
                    f"all stored products would be 0 (M = {m}, {self.pixel_bits} bit pixels, "
                    f"{self.arithmetic.fraction_bits} fraction bits); use more fraction bits, or "
                    "exact arithmetic",
                    where="arithmetic",
                )
        if self.line_buffer_bits > MAX_LINE_BUFFER_BITS:
            raise refuse(
                f"{self.line_buffer_bits / 2**20:.1f} Mbit of line buffers "
                f"(a filter of {self.taps} taps, {self.max_columns} columns)",
                "shifts",
                f"{MAX_LINE_BUFFER_BITS >> 20}; use fewer columns, or focus settings a "
                "closer to 1/M",
            )


def reciprocal_bits(value_max: int, divisor: int) -> tuple[int, int]:
    """Bits of both factors of divide_round: value + half the divisor, and the reciprocal."""
    largest = value_max + divisor // 2
    exponent = next(t for t in count() if (-(1 << t)) % divisor * largest < 1 << t)
    return largest.bit_length(), (-(-(1 << exponent) // divisor)).bit_length()
