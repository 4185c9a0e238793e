# SPDX-License-Identifier: Apache-2.0
"""Engine of direct sums, added by the recipe of CONTRIBUTING.md."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from plenofir.fpga.core.engine import Generics, Raster, Scope, SliceEngine
from plenofir.fpga.resources.memory import Memory
from plenofir.ground.errors import InputError

_PASS_CLOCKS = 3


class DirectEngine(SliceEngine):
    """Direct sums: each output adds its M pixels anew."""

    kind: Literal["direct"] = "direct"

    COMPONENT: ClassVar[str] = "direct_array"
    UNIT: ClassVar[str] = "lines of pixels"

    def _steps(self, raster: Raster) -> int:
        """Lines or pixels that a pass remembers."""
        m, delay = raster.micro_image_size, raster.filter_delay
        oldest = delay
        for shift in raster.shifts:
            offset = (m - 1) * shift // 2 if raster.align == "centred" else 0
            for p in range(m):
                away = p * (shift - 1) - offset
                oldest = max(oldest, *(delay + away + (q - away - p) % m for q in range(m)))
        return oldest + 1

    def summary(self, raster: Raster) -> str:
        return "direct sums"

    def waves(self, raster: Raster) -> tuple[Scope, ...]:
        return ()

    def pass_clocks(self, raster: Raster) -> int:
        return 2 * _PASS_CLOCKS

    def least_steps(self, raster: Raster) -> int:
        return 1

    def frame_lines(self, raster: Raster, rows: int) -> int:
        return rows

    def line_buffer_bits(self, raster: Raster) -> int:
        return raster.channels * raster.max_columns * self._steps(raster) * raster.words(1).data

    def check(self, raster: Raster) -> None:
        if raster.micro_image_size > 3:
            raise InputError("direct sums are for M up to 3", where="micro_image_size")
        if raster.order or not raster.exact or raster.normalises:
            raise InputError("direct sums are exact, of order 0", where="arithmetic")

    def generics(self, raster: Raster) -> Generics:
        return super().generics(raster) | {"ENGINE": self.kind}

    @classmethod
    def variants(
        cls, raster: Raster, parallel_rows: int, rows: int | None
    ) -> Iterator["DirectEngine"]:
        if parallel_rows == 1:
            yield cls()

    def extent(self, raster: Raster) -> int:
        return self._steps(raster)

    def lines(self, raster: Raster) -> int:
        return self._steps(raster)

    def describe(self, raster: Raster, rows: int) -> Iterator[tuple[str, str]]:
        yield "sums", f"direct sums, {self.lines(raster)} lines for each channel"

    def memories(self, raster: Raster) -> Iterator[Memory]:
        bits = (raster.max_columns - 1).bit_length()
        width = raster.channels * self._steps(raster) * raster.words(1).data
        yield Memory("lines of pixels", bits, width, 1)

    def structure(self, raster: Raster) -> dict[str, int]:
        return {"core": 1, "sum bits": raster.channels * raster.words(1).sum}
