# SPDX-License-Identifier: Apache-2.0
"""Configuration of the resampler, and the words for its load port."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from plenofir.fpga.families import Family
from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.resources.memory import Memory, block_sizes

Load = tuple[int, int, int]
"""Kind, address, word."""
KINDS = {"register": 0, "lens": 1, "profile": 2, "commit": 3}
REGISTERS = (
    "lenses",
    "outputs",
    "origin_y",
    "origin_x",
    "right_y",
    "right_x",
    "down_even_y",
    "down_even_x",
    "down_odd_y",
    "down_odd_x",
    "reach",
    "black",
    "place_even",
    "place_odd",
    "step",
)
"""Registers by their addresses, as in ``hdl/resample/resample_pkg.vhd``."""
MAX_LINES = 256
_GAIN_INTEGER_BITS = 4
# Multipliers of the raster's size, M times the numbers of lenses; for Nexus Yosys takes only one.
_SIZE_MULTIPLIERS: dict[Family, int] = {"spartan6": 2, "series7": 2, "ecp5": 2, "nexus": 1}


class ResamplerConfiguration(BaseModel):
    """Generics of the entity ``resampler``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=1, le=128)]  # M in pixels
    hexagonal: bool = False  # rows of lenses are interpolated to a rectangular raster
    # Registers hold the steps between lines and pixels of a micro image (focused cameras).
    skewed: bool = False
    max_columns: Annotated[int, Field(ge=2, le=8192)] = 2048  # of the longest raw line
    # Raw lines that the ring holds.
    lines: Annotated[int, Field(ge=4, le=MAX_LINES, multiple_of=2)] = 8
    lenses: Annotated[int, Field(ge=2, le=1 << 20)] = 2  # of the table, if there are moves or gains
    moves: bool = False  # the table moves lenses from the even grid
    gains: bool = False  # the table has gains
    channels: Annotated[int, Field(ge=1, le=3)] = 1
    pixel_bits: Annotated[int, Field(ge=1, le=16)] = 8
    fraction_bits: Annotated[int, Field(ge=8, le=17)] = 16  # of positions
    weight_bits: Annotated[int, Field(ge=2, le=8)] = 8  # of weights
    guard_bits: Annotated[int, Field(ge=1, le=3)] = 3  # of samples
    gain_bits: Annotated[int, Field(ge=4, le=14)] = 12  # of gains

    def generics(self) -> dict[str, int | bool | str]:
        return {name.upper(): value for name, value in self.model_dump().items()}

    def register_loads(self, registers: Mapping[str, int]) -> list[Load]:
        """Words that set registers (names of `REGISTERS`); they take effect with the next frame."""
        words = [
            (KINDS["register"], address, registers[name] & 0xFFFFFFFF)
            for address, name in enumerate(REGISTERS)
        ]
        return [*words, (KINDS["commit"], 0, 0)]

    def table_loads(
        self,
        gains: Sequence[int],
        moves: Sequence[Sequence[int]],
        profile: Sequence[int],
    ) -> list[Load]:
        """Words that fill the tables.

        `gains` and `moves` (y, x) have an entry for each lens, row by row, or none; `profile` is
        the gain of each pixel of a micro image, row by row.
        """
        width = self.weight_bits + 2
        mask = (1 << width) - 1
        words = []
        for number in range(max(len(gains), len(moves))):
            word = shift = 0
            if self.gains:
                word, shift = gains[number], self.gain_bits + 4
            if self.moves:
                y, x = moves[number]
                word |= ((y & mask) << width | x & mask) << shift
            words.append((KINDS["lens"], number, word))
        return words + [(KINDS["profile"], number, gain) for number, gain in enumerate(profile)]


@dataclass(frozen=True)
class SensorLogic:
    """The entity ``sensor_raster``: the resampler, behind a mosaic's interpolation if there is one.

    Of its estimate multipliers are exact.
    """

    core: ResamplerConfiguration
    mosaic: bool

    @property
    def blocks(self) -> tuple[Block, ...]:
        """One block, for the estimate."""
        core, m = self.core, self.core.micro_image_size
        bits = core.channels * core.pixel_bits
        parts = {
            "whole": 1,
            "pixel bits": bits,
            "hexagonal bits": core.hexagonal * bits,
            "skewed": int(core.skewed),
            "moves": int(core.moves),
            "gains": int(core.gains),
            "mosaic bits": self.mosaic * core.pixel_bits,
            "lines": core.lines,
        }
        # A product with a power of two is a shift.
        sizes = _SIZE_MULTIPLIERS if m & (m - 1) else {}
        return (Block("sensor", parts, tuple(self._memories()), self._products(), sizes),)

    def _memories(self) -> Iterator[Memory]:
        core, m = self.core, self.core.micro_image_size
        bits = core.channels * core.pixel_bits
        values = core.channels * (core.pixel_bits + core.guard_bits + _GAIN_INTEGER_BITS)
        if self.mosaic:
            columns, pair = core.max_columns, 2 * core.pixel_bits
            yield Memory("lines of a mosaic", (columns - 1).bit_length(), pair, 1, words=columns)
            yield Memory("output FIFO of the mosaic", 4, 3 * core.pixel_bits + 3, 1)
        yield Memory("input FIFO", 4, bits + 2, 1)
        words = core.lines // 2 * -(-core.max_columns // 2)
        for size in block_sizes(words, bits):
            yield Memory("ring of raw lines", (size - 1).bit_length(), bits, 4, words=size)
        yield Memory("registers", 6, 32, 1)
        width = core.gains * (core.gain_bits + _GAIN_INTEGER_BITS)
        width += core.moves * 2 * (core.weight_bits + 2)
        if width:
            address_bits = (core.lenses - 1).bit_length()
            yield Memory("table of lenses", address_bits, width, 1, words=core.lenses)
        if core.gains:
            profile_bits = max((m * m - 1).bit_length(), 1)
            yield Memory("profile", profile_bits, core.gain_bits + _GAIN_INTEGER_BITS, 1)
        yield Memory("output FIFO", 6, (values if core.hexagonal else bits) + 2, 1)
        if core.hexagonal:
            yield Memory("lenses of a row", max((m - 1).bit_length(), 1) + 1, values, 2)
            yield Memory("FIFO behind them", 4, bits + 2, 1)

    def _products(self) -> tuple[tuple[int, int, int], ...]:
        core = self.core
        gain = core.gain_bits + _GAIN_INTEGER_BITS
        sample = core.pixel_bits + core.guard_bits
        products = (
            # Interpolation in two columns, and between them.
            (2 * core.channels, core.pixel_bits, core.weight_bits),
            (core.channels, core.pixel_bits + core.weight_bits, core.weight_bits),
            # The gain, and that of a lens and of a place in it.
            (core.channels * core.gains, sample, gain),
            (core.gains, gain, gain),
            # Interpolation between two lenses.
            (core.channels * core.hexagonal, sample + _GAIN_INTEGER_BITS, core.weight_bits),
        )
        return tuple(product for product in products if product[0])
