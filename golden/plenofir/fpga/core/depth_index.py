# SPDX-License-Identifier: Apache-2.0
"""Configuration of a depth index after a focal stack: generics, memory and latency."""

from collections.abc import Iterator
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from plenofir.fpga.core.engine import MAX_LINE_BUFFER_BITS, Generics, PixelsPerClock, Scope, within
from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.resources.memory import Memory, bits_for
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import (
    FRACTION_BITS,
    MAX_CONFIDENCE,
    MAX_SHARPNESS_RADIUS,
    MAX_VOTE_RADIUS,
    DepthIndex,
    depth_index,
    has_order,
)

# One bit of the fraction per clock, after the falls, the slopes and their sum (FRACTION_LATENCY).
_FRACTION_CLOCKS = 3 + FRACTION_BITS


class DepthIndexConfiguration(BaseModel):
    """Generics of the entity ``depth_index``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    micro_image_size: Annotated[int, Field(ge=2, le=128)]  # M in pixels
    slices: Annotated[int, Field(ge=1, le=256)]
    # See `plenofir.refocus.sharpness.local_sharpness`.
    radius: Annotated[int, Field(ge=0, le=MAX_SHARPNESS_RADIUS)] = 1
    # See `plenofir.refocus.sharpness.depth_index`, as `vote_radius`.
    confidence: Annotated[int, Field(ge=0, le=MAX_CONFIDENCE)] = 0
    vote_radius: Annotated[int, Field(ge=0, le=MAX_VOTE_RADIUS)] = 0
    max_columns: Annotated[int, Field(ge=1, le=8192)]  # largest line length in pixels
    pixels_per_clock: PixelsPerClock = 1  # neighbours in a line that come together, M at most
    channels: Annotated[int, Field(ge=1, le=3)] = 1  # 1 (grey) or 3 (RGB)
    pixel_bits: Annotated[int, Field(ge=1, le=16)] = 8
    # The slices' a', if there is to be depth between them.
    shifts: tuple[int, ...] = ()
    # Whether the picture in focus comes out, too: then the pixels of all slices wait inside.
    picture: bool = True
    # Whether each slice comes twice, with its box of M and beside it with a smaller one
    # (`plenofir.refocus.by_place`), which the picture takes where there is texture.
    sharp_too: bool = False

    @property
    def boxes(self) -> int:
        """Pictures of each slice that come in."""
        return 1 + self.sharp_too

    @property
    def pictures(self) -> int:
        """Pictures of all slices that come in."""
        return self.slices * self.boxes

    @property
    def delay(self) -> int:
        """Delay of a pixel in lines (sharpness_delay)."""
        return (self.radius + 2 + self.vote_radius) * self.micro_image_size

    @property
    def index_latency(self) -> int:
        """Clocks from the end of a row of micro images to its first index (index_latency)."""
        waits = self.vote_radius + self.slices + 5 if self.vote_radius else self.boxes - 1
        if self.shifts:
            waits = 1 + max(waits, _FRACTION_CLOCKS)
        several = self.pixels_per_clock > 1
        return 11 + several + self.radius + self.slices + waits

    @property
    def waves(self) -> tuple[Scope, ...]:
        """Signals that a waveform shows."""
        signals: list[Scope] = [("bit", "place_token/", "inside_now")]
        for number in range(self.slices):
            signals += [
                ("downto", f"slice({number})/", "sum"),
                ("downto", f"slice({number})/judge/", "laplacian row_sum total"),
            ]
        return within(
            "find",
            (
                *signals,
                ("bit", "", "complete_live complete_start scan_on"),
                ("downto", "", "energies best most least"),
                ("bit", "", "final_write final_textured"),
                ("downto", "", "final_lens final_index"),
                ("bit", "", "index_write"),
                ("downto", "", "index_lens index"),
            ),
        )

    @property
    def lens_bits(self) -> int:
        """Bits of the sum of a micro image (sharpness_pkg)."""
        weight = 1 if self.channels == 1 else 4
        return (weight * ((1 << self.pixel_bits) - 1) * self.micro_image_size**2).bit_length()

    @property
    def row_bits(self) -> int:
        """Bits of the sharpness along a row (row_sharpness_bits)."""
        return self.lens_bits + 2 + max(1, (2 * self.radius).bit_length())

    @property
    def memory_bits(self) -> tuple[int, int]:
        """Bits of the lines that delay the slices' pixels, and of the sharpness sums."""
        m, slices = self.micro_image_size, self.slices
        pixels = self.line_tokens(self.max_columns) * self.pixels_per_clock
        waiting = self.delay * pixels * self.pictures * self.channels * self.pixel_bits
        lens, row = self.lens_bits, self.row_bits
        index = max(1, (slices - 1).bit_length())
        lenses = -(-self.max_columns // m)
        votes = 2 * self.vote_radius * (index + 1) + index if self.vote_radius else 0
        between = 2 * FRACTION_BITS * (1 + self.vote_radius) if self.shifts else 0
        judged = slices * (4 * lens + 2 * self.radius * row) + index + self.sharp_too
        judged += votes + between
        return waiting * self.picture, lenses * judged

    def check_limits(self) -> None:
        """Refuse the same generics as the entity."""
        if self.channels == 2:
            raise InputError("2 channels have no luma; use 1 or 3", where="channels")
        if self.pixels_per_clock > self.micro_image_size:
            raise InputError(
                f"a depth index judges one micro image each clock, so it takes at most M pixels a "
                f"clock (M = {self.micro_image_size}), not {self.pixels_per_clock}; use fewer, "
                "or a scene with stack.output = 'slices'",
                where="pixels_per_clock",
            )
        if self.sharp_too and not self.picture:
            raise InputError(
                "a smaller box is for the picture in focus; leave it out, or have the picture",
                where="sharp_too",
            )
        if self.shifts and not (len(self.shifts) == self.slices and has_order(self.shifts)):
            raise InputError(
                f"depth between slices needs a' of each of {self.slices}, going up or down",
                where="shifts",
            )
        if max(self.memory_bits) > MAX_LINE_BUFFER_BITS:
            raise InputError(
                f"{max(self.memory_bits) / 2**20:.1f} Mbit for the depth index of "
                f"{self.slices} slices (M = {self.micro_image_size}, {self.max_columns} "
                f"columns) exceed the limit of {MAX_LINE_BUFFER_BITS >> 20}; use fewer "
                "slices or columns",
                where="slices",
            )

    def line_tokens(self, columns: int) -> int:
        """Clocks that the pixels of a line take."""
        return -(-columns // self.pixels_per_clock)

    def band_steps(self, columns: int) -> int:
        """Least clocks from the beginning of a line to that of the next one."""
        least = self.index_latency if self.vote_radius else 8 + self.radius
        return max(self.line_tokens(columns), least)

    def frame_lines(self, rows: int) -> int:
        """Least lines from the beginning of a frame to that of the next one."""
        return -(-rows // self.micro_image_size) * self.micro_image_size

    def full_rate(self, columns: int, rows: int) -> bool:
        """Whether frames of a size need no blanking."""
        return (
            self.band_steps(columns) == self.line_tokens(columns) and self.frame_lines(rows) == rows
        )

    def latency_clocks(self, columns: int, rows: int, frames: int = 1) -> int:
        """Clocks from the first pixel taken to the first one offered, when nothing stalls."""
        del rows, frames
        return self.delay * self.band_steps(columns) + self.index_latency + 7

    def golden(self, stack: Image) -> DepthIndex:
        """Result for a focal stack by the golden model.

        With `sharp_too` each slice with its box of M is followed by the same with a smaller one.
        """
        return depth_index(
            stack[:: self.boxes],
            self.micro_image_size,
            self.radius,
            confidence=self.confidence,
            vote_radius=self.vote_radius,
            shifts=self.shifts,
            sharp=stack[1::2] if self.sharp_too else None,
        )

    def generics(self) -> Generics:
        # One pixel a clock, the picture and slices that come once are the entity's defaults.
        python_fields = {"shifts"} | ({"pixels_per_clock"} if self.pixels_per_clock == 1 else set())
        python_fields |= {"picture"} if self.picture else set()
        python_fields |= set() if self.sharp_too else {"sharp_too"}
        fields = self.model_dump(exclude=python_fields)
        values: Generics = {name.upper(): value for name, value in fields.items()}
        return values | ({"SHIFTS": " ".join(map(str, self.shifts))} if self.shifts else {})

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The entity ``depth_index`` alone, for the estimate."""
        return (self.block(),)

    def block(self, *, chosen_too: bool = True) -> Block:
        """The part of a picture that is the entity ``depth_index``, for the estimate.

        `chosen_too`: the chosen slice comes out besides that in focus.
        """
        window = (2 * self.vote_radius + 1) ** 2
        parts = {
            "index": 1,
            "pixel bits": self.pictures * self.pixels_per_clock * self.channels * self.pixel_bits,
            "judged bits": (self.slices - 1) * self.row_bits,
            "vote bits": self.slices * window.bit_length() if self.vote_radius else 0,
        }
        return Block("stack", parts, tuple(self._memories(chosen_too=chosen_too)))

    def _memories(self, *, chosen_too: bool) -> Iterator[Memory]:
        slices, p = self.slices, self.pixels_per_clock
        pixel = p * self.channels * self.pixel_bits
        lenses = -(-self.max_columns // self.micro_image_size)
        places, number = bits_for(lenses - 1), bits_for(slices - 1)

        def of_lenses(name: str, width: int, copies: int = 1) -> Memory:
            return Memory(name, places, width, copies, words=lenses)

        yield of_lenses("sums of micro images", self.lens_bits, 2 * slices)
        yield of_lenses("rows of micro images", 2 * self.lens_bits, slices)
        if self.radius:
            yield of_lenses("rows of sharpness", 2 * self.radius * self.row_bits, slices)
        if self.vote_radius:
            yield of_lenses("rows of votes", 2 * self.vote_radius * (number + 1))
            yield of_lenses("slices above", number)
        between = 2 * FRACTION_BITS if self.shifts else 0
        if between and self.vote_radius:
            yield of_lenses("depths that wait", between * self.vote_radius)
        words = self.delay * self.line_tokens(self.max_columns)
        if self.picture:
            width = self.pictures * pixel
            yield Memory("waiting pixels", bits_for(words - 1), width, 1, words=words)
        yield of_lenses("index of each lens", number + self.sharp_too + between)
        under_way = 2 + self.index_latency + 4
        out = (self.picture + chosen_too) * pixel + p * (8 + between) + 3
        out += number if chosen_too else 0
        yield Memory("output FIFO", bits_for(2 * under_way + 1), out, 1)
