# SPDX-License-Identifier: Apache-2.0
"""The constants in front of ``refocus.cu``: what a kind of picture is, and the tiles it is made in.

Code is compiled for each kind and tile, so places within a lens, lengths of loops and divisors are
constants in it.
"""

from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from itertools import product
from math import gcd

from plenofir.refocus.operator import Align, output_offset
from plenofir.refocus.sharpening import taps
from plenofir.refocus.slices import Slice

# Longest runs that are unrolled, in steps, and the most words of their rings: registers are 255.
_UNROLLED_STEPS, _UNROLLED_WORDS = 192, 128
# Outputs of a segment of a line: fewer repeat more additions, more leave threads without work.
_SEGMENT_OUTPUTS = 32
_ROW_CHOICES = (1, 2, 4, 6, 8, 10, 12, 14, 16, 20, 24, 32)
# Shared memory that code may have without asking for it when it starts.
_STATIC_BYTES = 48 * 1024
_THREAD_CHOICES = (128, 256, 384, 512)


@dataclass(frozen=True)
class Kind:
    """One kind of refocused picture: all that its code depends on."""

    micro_image_size: int  # M in pixels
    shift: int  # a' in pixels
    box: int  # B in pixels
    channels: int
    pixel_bits: int
    align: Align = "centred"
    order: int = 0  # of the interpolation
    units: int = 0  # 64 b of the sharpening
    one_pixel_a_lens: bool = False
    normalised: bool = False

    @classmethod
    def of(cls, slice_: Slice) -> "Kind":
        """The kind of a slice's pictures."""
        return cls(
            slice_.micro_image_size,
            slice_.shift,
            slice_.box,
            slice_.shape[2] if len(slice_.shape) == 3 else 1,
            slice_.pixel_bits,
            slice_.align,
            slice_.order,
            slice_.units,
            not slice_.upsample,
            slice_.normalise,
        )

    @property
    def step(self) -> int:
        """Pixels from an output to the next."""
        return self.micro_image_size if self.one_pixel_a_lens else 1

    @property
    def full(self) -> int:
        """Weight of a dimension where all views have a pixel."""
        return int(self.box ** (1 + self.order))

    @property
    def warm_steps(self) -> int:
        """Steps of a run before its first sum is complete."""
        return (self.order + 1) * (self.box // self.step - 1)

    @property
    def lens(self) -> int:
        """Distance of the sharpening's taps in outputs, 0 without sharpening."""
        return self.micro_image_size if self.units else 0

    @property
    def offset(self) -> int:
        """Index of S that output 0 takes; with one pixel a lens, that of its only place."""
        m = self.micro_image_size
        offset = output_offset(m, self.shift, self.align, self.box)
        return offset if self.step == 1 else offset - offset % m

    @property
    def unit_offset(self) -> int:
        """Index that output 0 of a moving sum of the interpolation takes."""
        return output_offset(self.micro_image_size, 1, self.align, self.box)

    def steps(self, outputs: int) -> int:
        """Steps of a run that makes so many outputs."""
        return outputs + 2 * self.lens + self.warm_steps

    @cached_property
    def column_most(self) -> int:
        """Largest size of a sum of one dimension."""
        gain = taps(self.units).centre + 2 * taps(self.units).side
        return ((1 << self.pixel_bits) - 1) * self.full * gain

    @cached_property
    def line_most(self) -> int:
        """Largest size of a sum of both dimensions, with half of its divisor."""
        filter_ = taps(self.units)
        most = self.column_most * self.full * (filter_.centre + 2 * filter_.side)
        return most + self.full**2 * filter_.scale**2

    @property
    def column_type(self) -> str:
        """The narrowest type of C for a sum of one dimension."""
        if self.column_most >> (15 if self.units else 16) == 0:
            return "short" if self.units else "unsigned short"
        return self.running_type

    @property
    def running_type(self) -> str:
        """Type of sums while a column is summed."""
        return "int" if self.column_most >> 31 == 0 else "long long"

    @property
    def line_type(self) -> str:
        """Type of C for a sum of both dimensions."""
        return "int" if self.line_most >> 31 == 0 else "long long"

    @property
    def first_views(self) -> list[int]:
        """For each p modulo M the first view u with u a' = p modulo M, -1 if there is none."""
        m = self.micro_image_size
        views = [-1] * m
        for u in range(m // gcd(self.shift, m)):
            views[u * self.shift % m] = u
        return views


_BYTES = {"short": 2, "unsigned short": 2, "int": 4, "unsigned": 4, "long long": 8}


@dataclass(frozen=True)
class Tile:
    """The part of a picture that a block of threads makes."""

    rows: int
    columns: int
    segment: int  # outputs of a line that one thread makes
    low: int  # columns of the raw picture before the first output's, and behind the last one's
    high: int
    held_columns: int  # columns of sums in shared memory
    padded: bool  # columns outside of the picture are there, as zeros
    unrolled: bool
    threads: int  # of a block
    shared_bytes: int  # that its sums and pixels take
    offset_type: str  # of C, for places in the raw picture

    def blocks(self, region: tuple[range, range]) -> tuple[int, int]:
        """Tiles beside each other and below each other that hold a region of the picture.

        The first one begins at a whole segment.
        """
        rows, columns = region
        width = columns.stop - columns.start // self.segment * self.segment
        return -(-width // self.columns), -(-len(rows) // self.rows)


def _reach(kind: Kind, segment: int) -> tuple[int, int]:
    """Columns before and behind the first output's place that a segment's sums take in."""
    m, slope = kind.micro_image_size, kind.shift - 1
    before = kind.lens + kind.warm_steps - kind.order * kind.unit_offset
    first = kind.offset - kind.step * before
    last = first + kind.step * (kind.steps(segment) - 1)
    return max(0, (m - 1) * slope) - first, last - min(0, (m - 1) * slope)


def tile_of(kind: Kind, rows: int, columns: int, shared_limit: int) -> Tile | None:
    """The tile that needs the fewest additions for pictures of a size in pixels.

    `shared_limit`: bytes of shared memory that a block may have. None: not even one row fits.
    """
    m, outputs = kind.micro_image_size, (max(1, rows // kind.step), max(1, columns // kind.step))
    unit = 1 if kind.step > 1 else m
    segment = unit * -(-_SEGMENT_OUTPUTS // unit)
    words = (kind.order + 1) * (kind.box // kind.step) + 2 * kind.lens
    unrolled = (
        kind.steps(max(segment, _ROW_CHOICES[-1])) <= _UNROLLED_STEPS and words <= _UNROLLED_WORDS
    )
    before, behind = _reach(kind, segment)
    behind -= kind.step * (segment - 1)
    column_bytes, pixel_bytes = _BYTES[kind.column_type], kind.pixel_bits // 8
    segments = -(-outputs[1] // segment)
    offset_type = "unsigned" if rows * columns * kind.channels >> 31 == 0 else "long long"
    offset_bytes = _BYTES[offset_type]
    best: tuple[float, Tile] | None = None
    for parts in range(1, segments + 1):
        width = segment * -(-segments // parts)
        padded_columns = kind.step * (width - 1) + 1 + before + behind
        for padded, height, threads in product((True, False), _ROW_CHOICES, _THREAD_CHOICES):
            held = max(0, padded_columns if padded else min(padded_columns, columns))
            samples = height * kind.channels
            shared = samples * (held * column_bytes + width * pixel_bytes)
            lines = offset_bytes * kind.steps(height)
            if shared + lines > shared_limit or lines > _STATIC_BYTES:
                continue
            # Threads without work wait for the others.
            column_rounds = -(-held * kind.channels // threads)
            line_rounds = -(-samples * (width // segment) // threads)
            work = threads * (
                column_rounds * kind.steps(height)
                + line_rounds * kind.steps(segment) * (1.5 if padded else 2)
            )
            # Blocks beside each other hide the time that memory takes.
            beside = min(shared_limit // shared, 2048 // threads)
            cost = work / (height * width) * (1 + 1 / (1 + beside * threads / 256))
            if best is None or cost < best[0]:
                tile = Tile(
                    height,
                    width,
                    segment,
                    before,
                    behind,
                    held,
                    padded,
                    unrolled,
                    threads,
                    shared,
                    offset_type,
                )
                best = cost, tile
        if width == segment:
            break
    return best[1] if best else None


def source(kind: Kind, tile: Tile) -> str:
    """The text of the kernel for one kind of picture and its tiles."""
    filter_, m = taps(kind.units), kind.micro_image_size
    whole_lenses = kind.step > 1 or tile.segment % m == 0
    numbers = {
        "M": m,
        "SHIFT": kind.shift,
        "BOX": kind.box,
        "OFFSET": kind.offset,
        "UNIT_OFFSET": kind.unit_offset,
        "ORDER": kind.order,
        "STEP": kind.step,
        "SIDE": filter_.side if kind.units else 0,
        "CENTRE": filter_.centre,
        "SCALE": filter_.scale,
        "CHANNELS": kind.channels,
        "WHITE": (1 << kind.pixel_bits) - 1,
        "TILE_ROWS": tile.rows,
        "TILE_COLUMNS": tile.columns,
        "SEGMENT": tile.segment,
        "LOW": tile.low,
        "HIGH": tile.high,
        "HELD_COLUMNS": tile.held_columns,
        "THREADS": tile.threads,
        "GROUPS": gcd(kind.shift, m),
        "VIEWS_APART": m // gcd(kind.shift, m),
    }
    choices = {
        "NORMALISED": kind.normalised,
        "PADDED": tile.padded,
        "WHOLE_LENSES": whole_lenses,
        "UNROLLED": tile.unrolled,
    }
    types = {
        "Pixel": "unsigned char" if kind.pixel_bits == 8 else "unsigned short",
        "ColumnSum": kind.column_type,
        "RunningColumn": kind.running_type,
        "LineSum": kind.line_type,
        "Offset": tile.offset_type,
    }
    lines = [
        *(f"typedef {of} {name};" for name, of in types.items()),
        *(f"constexpr int {name} = {value};" for name, value in numbers.items()),
        *(f"constexpr bool {name} = {str(value).lower()};" for name, value in choices.items()),
        f"constexpr LineSum FULL = {kind.full};",
        f"constexpr int FIRST_VIEW[M] = {{{', '.join(map(str, kind.first_views))}}};",
    ]
    text = files("plenofir.refocus.gpu").joinpath("refocus.cu").read_text("utf-8")
    return "\n".join(lines) + "\n" + text
