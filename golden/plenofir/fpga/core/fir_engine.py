# SPDX-License-Identifier: Apache-2.0
"""Engine of switched semi-systolic filters (``hdl/fir``)."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from plenofir.fpga.core.engine import (
    MAX_PARALLEL_ROWS,
    Generics,
    Raster,
    Scope,
    SliceEngine,
    within,
)
from plenofir.fpga.resources.memory import Memory, rom_luts
from plenofir.ground.errors import InputError
from plenofir.refocus.switches import FilterLayout

MAX_TAPS = 512

_STAGE_WAVES: tuple[Scope, ...] = (
    ("bit", "", "strobe_d1"),
    ("downto", "control/", "phase"),
    ("to", "control/", "closed"),
    ("bit", "control/", "restart"),
)


class FirEngine(SliceEngine):
    """Switched filters."""

    kind: Literal["fir"] = "fir"
    # The first output of each micro image is held for the others (`plenofir.refocus.switches`).
    hold: bool = False
    # Rows that are filtered in parallel, iota in the thesis.
    parallel_rows: Annotated[int, Field(ge=1)] = 1
    # Taps that one latch of the broadcast net drives; 0: no latches.
    broadcast_taps: Annotated[int, Field(ge=0)] = 0

    COMPONENT: ClassVar[str] = "fir_array"
    UNIT: ClassVar[str] = "taps"
    LARGEST: ClassVar[dict[str, int]] = {"taps": MAX_TAPS}

    @property
    def rows_at_once(self) -> int:
        return self.parallel_rows

    def waves(self, raster: Raster) -> tuple[Scope, ...]:
        def stages(dimension: str) -> Iterator[Scope]:
            for number in range(raster.passes):
                yield from within(f"{dimension}_pass({number})/stage", _STAGE_WAVES)

        return within(
            "fir_engine/filters",
            (
                *stages("row"),
                ("downto", "", "skewed_data"),
                *stages("column"),
                ("downto", "back_to_rows/", "row_sums"),
            ),
        )

    def layout(self, raster: Raster, number: int = 0) -> FilterLayout:
        """Taps and switches of a stage; interpolating stages do not hold outputs."""
        hold = self.hold and number % raster.passes == 0
        return replace(raster.filter_layout(number), hold=hold)

    def taps(self, raster: Raster) -> int:
        return sum(self.layout(raster, number).taps for number in range(raster.passes))

    def summary(self, raster: Raster) -> str:
        at_once = f", {self.parallel_rows} rows at once" if self.parallel_rows > 1 else ""
        return f"{self.taps(raster)} taps{at_once}"

    def pass_clocks(self, raster: Raster) -> int:
        return 2 * (3 + (self.broadcast_taps > 0))

    def column_depth(self, raster: Raster) -> int:
        """Columns whose partial sums a column module keeps."""
        return -(-raster.max_columns // self.parallel_rows)

    def least_steps(self, raster: Raster) -> int:
        # The weights of a border come from moving sums.
        sums = raster.filter_delay + 1 if raster.normalises else 1
        return max(super().least_steps(raster), sums)

    def frame_lines(self, raster: Raster, rows: int) -> int:
        return max(rows, raster.filter_delay + 1) if raster.normalises else rows

    def _kept(self, raster: Raster, number: int) -> int:
        """Partial sums that a stage keeps from step to step."""
        layout = self.layout(raster, number)
        return layout.taps - (not layout.hold)

    def _depth(self, raster: Raster, number: int) -> int:
        """Streams that a stage filters in turn."""
        return self.column_depth(raster) if number >= raster.passes else 1

    def line_buffer_bits(self, raster: Raster) -> int:
        if self.column_depth(raster) == 1:
            return 0
        words = self.parallel_rows << (self.column_depth(raster) - 1).bit_length()
        columns = range(raster.passes, 2 * raster.passes)
        bits = sum(self._kept(raster, n) * raster.words(n).sum for n in columns)
        return raster.channels * words * bits

    def check(self, raster: Raster) -> None:
        m, largest_shift = raster.micro_image_size, max(raster.shifts, key=abs)
        if self.parallel_rows > MAX_PARALLEL_ROWS:
            raise InputError(
                f"{self.parallel_rows} rows at once exceed the core's limit of {MAX_PARALLEL_ROWS}",
                where="parallel_rows",
            )
        if self.taps(raster) > MAX_TAPS:
            raise InputError(
                f"a filter of {self.taps(raster)} taps (M = {m}, a' = {largest_shift}) "
                f"exceeds the core's limit of {MAX_TAPS}",
                where="shifts",
            )
        if self.hold and not self.layout(raster).can_hold:
            raise InputError(
                "the outputs of a micro image differ, so they cannot be held; use integer a "
                "only (for even M, even a), or no hold",
                where="hold",
            )

    def generics(self, raster: Raster) -> Generics:
        return super().generics(raster) | {
            "HOLD": self.hold,
            "PARALLEL_ROWS": self.parallel_rows,
            "BROADCAST_TAPS": self.broadcast_taps,
        }

    @classmethod
    def variants(
        cls, raster: Raster, parallel_rows: int, rows: int | None
    ) -> Iterator["FirEngine"]:
        yield cls(parallel_rows=parallel_rows)
        if raster.filter_layout().can_hold:
            yield cls(parallel_rows=parallel_rows, hold=True)

    def extent(self, raster: Raster) -> int:
        return self.taps(raster)

    def lines(self, raster: Raster) -> int:
        if self.column_depth(raster) == 1:
            return 0
        return sum(self._kept(raster, number) for number in range(raster.passes))

    def without_shortcuts(self) -> "FirEngine":
        return self.model_copy(update={"hold": False})

    def savings(self, raster: Raster) -> Iterator[tuple[str, "FirEngine"]]:
        if self.hold:
            whole = self.without_shortcuts()
            yield f"{whole.taps(raster) - self.taps(raster)} taps by holding outputs", whole
        unswitched = int((~self.layout(raster).switched).sum())
        if unswitched:
            yield f"switches and adders of {unswitched} taps that no slice closes", self

    def describe(self, raster: Raster, rows: int) -> Iterator[tuple[str, str]]:
        yield (
            "filters",
            f"{self.taps(raster)} taps, {self.lines(raster)} lines of partial sums for each "
            f"channel ({self.line_buffer_bits(raster) / 1024:.0f} Kbit in all)"
            f"{', outputs held' if self.hold else ''}",
        )

    def memories(self, raster: Raster) -> Iterator[Memory]:
        lanes = self.parallel_rows * raster.channels
        for number in range(2 * raster.passes):
            words, layout = raster.words(number), self.layout(raster, number)
            kept, depth = self._kept(raster, number), self._depth(raster, number)
            if depth > 1 and kept:
                yield Memory("line buffers", (depth - 1).bit_length(), kept * words.sum, lanes)
            if words.value:
                yield Memory("stored products", words.value, words.data, lanes, rom=True)
            phase_bits = (raster.micro_image_size - 1).bit_length()
            rows = max((len(layout.shifts) - 1).bit_length(), 1) + max(phase_bits, 1)
            yield Memory("switch tables", rows, int(layout.switched.sum()), 1, rom=True)

    def structure(self, raster: Raster) -> dict[str, int]:
        n = self.parallel_rows
        lanes = n * raster.channels
        counts = {
            "core": 1,
            "register bits": 0,
            "switched bits": 0,
            "always closed bits": 0,
            "restart bits": 0,
            "rom bits": 0,
            "switches": 0,
            "skew bits": 0,
            "parallel rows": n - 1,
            "pixel bits": lanes * raster.pixel_bits,
            "address bits": (raster.max_columns - 1).bit_length(),
        }
        widest = 0
        for number in range(2 * raster.passes):
            words, layout = raster.words(number), self.layout(raster, number)
            kept, depth = self._kept(raster, number), self._depth(raster, number)
            taps, delay = layout.taps, layout.delay
            bits = lanes * words.sum
            widest = max(widest, words.sum)
            if depth > 1 and kept:
                # Word in flight, output register of the line buffers, sum.
                counts["register bits"] += bits * (2 * kept + 1)
            else:
                counts["register bits"] += bits * taps
            counts["register bits"] += 2 * lanes * words.data
            if words.value:
                counts["rom bits"] += lanes * rom_luts(words.value, words.data)
            if self.broadcast_taps:
                groups = -(-taps // self.broadcast_taps)
                counts["register bits"] += lanes * (groups * words.data + taps)
            closed = int(layout.switches.all(axis=(0, 1)).sum())
            counts["switched bits"] += bits * (int(layout.switched.sum()) - closed)
            counts["always closed bits"] += bits * closed
            counts["restart bits"] += bits * min(taps - delay, taps)
            counts["switches"] += taps * (n if number >= raster.passes else 1)
        counts["skew bits"] = (n - 1) * n * widest * raster.channels
        return counts
