# SPDX-License-Identifier: Apache-2.0
"""Configuration of the resampler, and the words for its load port."""

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

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


class ResamplerConfiguration(BaseModel):
    """Generics of the entity ``resampler``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=1, le=128)]  # M in pixels
    hexagonal: bool = False  # rows of lenses are interpolated to a rectangular raster
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
