# SPDX-License-Identifier: Apache-2.0
"""Engine of moving sums (``hdl/moving_sum``)."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from math import gcd
from typing import ClassVar, Literal, Self

from plenofir.fpga.core.engine import (
    PARTIAL_SUM_LOOP,
    Generics,
    PixelsPerClock,
    Raster,
    Scope,
    SliceEngine,
    check_lane_delay,
    within,
)
from plenofir.fpga.resources.memory import Memory, bits_for, block_sizes, rom_luts
from plenofir.ground.errors import InputError
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.sum_lanes import LaneLayout

_STAGE_CLOCKS = 10
ADDER_WAVES: tuple[Scope, ...] = (("downto", "adder/", "first_sums running results"),)
"""Signals of ``moving_sum_adder``; the next two are those of its control and its stages."""
CONTROL_WAVES: tuple[Scope, ...] = (
    ("bit", "control/", "step_now in_first in_live out_first same"),
    ("bit", "control/", "initial_2 update_2 clear_2"),
)
STAGE_WAVES: tuple[Scope, ...] = (
    ("bit", "", "step first live"),
    ("to", "", "step_at active_at"),
    *CONTROL_WAVES,
    ("downto", "", "entering leaving"),
    *ADDER_WAVES,
    ("downto", "", "sums"),
)
LANE_WAVES: tuple[Scope, ...] = (
    ("bit", "", "first"),
    ("bit", "control/", "step_now in_first in_live out_first same"),
    ("downto", "banks/", "write_row_1 read_row_1 end_row_1 writes_2 enters_3 leaves_3"),
    ("downto", "", "differences"),
    ("to", "", "active_at take_at"),
    ("downto", "", "ahead held"),
)
"""Signals of ``lane_stage``."""


def row_waves(pixels: int) -> tuple[Scope, ...]:
    """Signals of a row stage for so many pixels a token."""
    if pixels > 1:
        return within("several_pixels/stage", LANE_WAVES)
    return within("one_pixel/stage", STAGE_WAVES)


class MovingSumEngine(SliceEngine):
    """Moving sums (`plenofir.refocus.moving_sum`)."""

    kind: Literal["moving_sum"] = "moving_sum"
    # Frames whose rows are no multiple of M can follow without a pause too; that takes a few more
    # lines of memory.
    any_rows: bool = False
    # Neighbouring pixels of a line in a token; above 1 with exact arithmetic only.
    pixels_per_clock: PixelsPerClock = 1

    COMPONENT: ClassVar[str] = "moving_sum_array"
    UNIT: ClassVar[str] = "lines of pixels"

    def layout(self, raster: Raster, number: int = 0) -> SumLayout:
        return replace(raster.sum_layout(number), any_length=self.any_rows)

    def summary(self, raster: Raster) -> str:
        return "moving sums"

    def waves(self, raster: Raster) -> tuple[Scope, ...]:
        signals: list[Scope] = []
        for stage in range(2 * raster.passes):
            pixels = 1 if stage in self._column_stages(raster) else self.pixels_per_clock
            place = f"moving_sum_engine/moving_sums/every_stage({stage})"
            signals += within(place, row_waves(pixels))
        return (*signals, ("downto", "tail/", "last_sums"))

    @property
    def pixels_at_once(self) -> PixelsPerClock:
        return self.pixels_per_clock

    def lanes(self, raster: Raster, number: int = 0) -> LaneLayout:
        """Schedule of a row stage with several pixels a token."""
        return LaneLayout(self.layout(raster, number), self.pixels_per_clock)

    def _filter_tokens(self, raster: Raster) -> int:
        """Delay of the row stages in tokens, without the sharpener."""
        if self.pixels_per_clock == 1:
            return raster.filter_delay
        return sum(self.lanes(raster, number).delay for number in range(raster.passes))

    def row_tokens(self, raster: Raster) -> int:
        sharpener = -(-raster.micro_image_size // self.pixels_per_clock) if raster.sharpens else 0
        return self._filter_tokens(raster) + sharpener

    def _words(self, raster: Raster) -> int:
        """Words of the longest line in the column stages."""
        p = self.pixels_per_clock
        return raster.max_columns if p == 1 else max(-(-raster.max_columns // p), 2)

    def pass_clocks(self, raster: Raster) -> int:
        # The memory of lines takes one clock more than that of a line's last pixels.
        return 2 * _STAGE_CLOCKS + 1

    def stages_clocks(self, raster: Raster) -> int:
        clocks = super().stages_clocks(raster)
        if self.pixels_per_clock > 1:
            lanes = (self.lanes(raster, number) for number in range(raster.passes))
            clocks += sum(lane.clocks - _STAGE_CLOCKS for lane in lanes)
        return clocks

    def _column_stages(self, raster: Raster) -> range:
        """Numbers of the column stages; with exact sums they come first."""
        return range(raster.passes) if raster.exact else range(raster.passes, 2 * raster.passes)

    def line_buffer_bits(self, raster: Raster) -> int:
        bits = 0
        for number in self._column_stages(raster):
            layout, words = self.layout(raster, number), raster.words(number)
            bits += sum(layout.ring_lines) * words.data + layout.sum_words * words.sum
        return raster.channels * self.pixels_per_clock * self._words(raster) * bits

    def least_steps(self, raster: Raster) -> int:
        # A column must not come again before its sums are written back.
        return max(PARTIAL_SUM_LOOP, self._filter_tokens(raster) + 1)

    def blank_lines(self, raster: Raster) -> int:
        return raster.micro_image_size - 1

    def frame_lines(self, raster: Raster, rows: int) -> int:
        least = max(rows, raster.filter_delay + 1)
        if self.any_rows:
            return max(least, self.layout(raster).reach)
        return -(-least // raster.micro_image_size) * raster.micro_image_size

    def for_video(self) -> Self:
        return self.model_copy(update={"any_rows": False, "pixels_per_clock": 1})

    def generics(self, raster: Raster) -> Generics:
        values = super().generics(raster) | {"ENGINE": self.kind}
        if self.any_rows:
            values["ANY_ROWS"] = True
        if self.pixels_per_clock > 1:
            values["PIXELS_PER_CLOCK"] = self.pixels_per_clock
        return values

    def check(self, raster: Raster) -> None:
        if raster.max_columns < 2:
            raise InputError("moving sums need lines of 2 pixels or more", where="max_columns")
        if self.pixels_per_clock > 1 and not raster.exact:
            raise InputError(
                f"stored products take one pixel a clock, not {self.pixels_per_clock}; use "
                "exact arithmetic",
                where="arithmetic",
            )
        check_lane_delay(self.lanes(raster).delay, self.pixels_per_clock)

    @classmethod
    def variants(
        cls, raster: Raster, parallel_rows: int, rows: int | None
    ) -> Iterator["MovingSumEngine"]:
        if parallel_rows > 1:
            return
        plain, any_rows = cls(), cls(any_rows=True)
        takes_rows = rows is not None and (
            any_rows.frame_lines(raster, rows) < plain.frame_lines(raster, rows)
        )
        yield any_rows if takes_rows else plain

    def extent(self, raster: Raster) -> int:
        return sum(self.layout(raster).ring_lines)

    def lines(self, raster: Raster) -> int:
        return sum(sum(self.layout(raster, n).ring_lines) for n in range(raster.passes))

    def describe(self, raster: Raster, rows: int) -> Iterator[tuple[str, str]]:
        yield (
            "sums",
            f"moving sums, {self.lines(raster)} lines of pixels for each channel "
            f"({self.line_buffer_bits(raster) / 1024:.0f} Kbit in all)",
        )
        if self.any_rows:
            more = self.extent(raster) - MovingSumEngine().extent(raster)
            yield (
                "rows",
                f"{rows}, no multiple of {raster.micro_image_size}: frames without blank lines "
                f"between them, for {more} lines of pixels more",
            )

    def memories(self, raster: Raster) -> Iterator[Memory]:
        for number in range(2 * raster.passes):
            layout, words = self.layout(raster, number), raster.words(number)
            p, columns = self.pixels_per_clock, self._words(raster)
            width = p * raster.channels * words.data
            if number in self._column_stages(raster) and columns > 1:
                banks = layout.bank_lines
                if sum(banks):
                    for lines, number_of in Counter(banks).items():
                        for size in block_sizes(lines * columns, width):
                            bits = (size - 1).bit_length()
                            yield Memory("lines of pixels", bits, width, number_of, words=size)
                    # One address to write, and one to read for pixels that enter and leave.
                    line_bits, reads = max(banks).bit_length(), 1 + layout.pixels_leave
                    address_bits = (max(banks) * columns - 1).bit_length()
                    yield Memory("addresses of lines", line_bits, address_bits, 1 + reads, rom=True)
                sum_bits = p * raster.channels * words.sum
                for size in block_sizes(columns, sum_bits):
                    bits = (size - 1).bit_length()
                    yield Memory("sums", bits, sum_bits, layout.sum_words, words=size)
            elif p > 1:
                lanes = self.lanes(raster, number)
                bits = (lanes.rows - 1).bit_length()
                yield Memory("pixels of a line", bits, width // p, 2 * lanes.banks, alike=2)
                continue
            else:
                bits = layout.reach.bit_length()
                copies = 1 + layout.pixels_leave
                yield Memory("pixels of a line", bits, width, copies, alike=copies)
            if words.value:
                yield Memory("stored products", words.value, words.data, raster.channels, rom=True)

    def structure(self, raster: Raster) -> dict[str, int]:
        names = ("core", "sum bits", "pixel bits", "control bits", "table bits", "delays", "rings")
        buffers = ("held lines", "block bits", "slice delays", "slice rings")
        lanes = ("banks", "bank bits", "turned bits", "exchanged bits")
        sums = ("gathered bits", "prefix bits")
        counts = Counter(dict.fromkeys((*names, *buffers, *lanes, *sums), 0))
        counts["core"] = 1
        m = raster.micro_image_size
        for number in range(2 * raster.passes):
            layout, words = self.layout(raster, number), raster.words(number)
            slices, columns = len(layout.shifts), number in self._column_stages(raster)
            p = self.pixels_per_clock if columns else 1
            width, delay = raster.channels * words.data, layout.delay
            age_bits = (layout.reach + 1).bit_length()
            counts["control bits"] += age_bits
            counts["sum bits"] += p * raster.channels * words.sum
            if self.pixels_per_clock > 1 and not columns:
                counts.update(self._lane_parts(raster, number))
                delay = self.lanes(raster, number).delay
            else:
                counts["pixel bits"] += p * width
                counts["table bits"] += slices * m * (3 * age_bits + 2 * bits_for(m - 1) + 2)
            counts["delays"] += delay
            # A slice's number waits for the outputs of its line, beside the mark of the line.
            counts["slice delays"] += delay * (slices - 1).bit_length()
            if columns:
                ring = sum(layout.ring_lines).bit_length()
                counts["rings"] += m * ring
                # Each phase's place moves by a number of lines that depends on the slice.
                counts["slice rings"] += m * ring * (slices > 1)
                # Write and read addressing; without a shift there is none.
                counts["held lines"] += ring > 0
                for lines in layout.bank_lines:
                    words_of = max(lines, 1) * self._words(raster)
                    counts["block bits"] += p * width * len(block_sizes(words_of, p * width))
            if words.value:
                counts["table bits"] += 64 * raster.channels * rom_luts(words.value, words.data)
        return counts

    def _lane_parts(self, raster: Raster, number: int) -> dict[str, int]:
        """Parts of a row stage with several pixels a token."""
        lanes, words = self.lanes(raster, number), raster.words(number)
        p, banks, slices = self.pixels_per_clock, lanes.banks, range(len(lanes.sums.shifts))
        width, difference = raster.channels * words.data, raster.channels * (words.data + 1)
        # Bits of the two rotations, of pixels to banks and of differences to outputs.
        levels = (banks // gcd(p, banks) - 1).bit_length()
        # Places of outputs and the banks that they choose from; the delay moves all alike.
        age, m = lanes.sums.entering_age, raster.micro_image_size
        places = {((i + age(s, i % m)) % banks, i) for s in slices for i in range(banks)}
        marks = 2 * p * (lanes.delay + 1)
        reads = banks * (bits_for(lanes.rows) + bits_for(banks - 1) + 1)
        return {
            "pixel bits": p * width,
            "table bits": len(slices) * (marks + reads),
            "banks": banks,
            "bank bits": banks * width,
            "turned bits": levels * banks * (width + difference),
            "exchanged bits": (len(places) - banks) * difference,
            "gathered bits": p * width * (1 + lanes.sums.begins_within_group),
            "prefix bits": p * (p - 1).bit_length() * raster.channels * words.sum,
        }
