# SPDX-License-Identifier: Apache-2.0
"""The constants in front of a slice's text: those of a slice, and of the tiles it is made in.

Code is compiled for them, so places within a lens, lengths of loops and divisors are constants.
Slices of a stack have tiles of one size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise, product
from math import gcd, lcm, prod

from plenofir.refocus.sharpness import Search, curvature_bits, slice_weight
from plenofir.refocus.slices import Slice

# Longest runs that are unrolled, in steps, and the most words of their rings: registers are 255.
_UNROLLED_STEPS, _UNROLLED_WORDS = 192, 128
# Outputs of a segment of a line: fewer repeat more additions, more leave threads without work.
_SEGMENT_OUTPUTS = 64
_ROW_CHOICES = (1, 2, 4, 6, 8, 10, 12, 14, 16, 20, 24, 32, 40, 48, 64)
_THREAD_CHOICES = (128, 256, 384, 512)
_BOTH = True, False
_WORD = 4
# Words with the last samples of a picture are read with the one behind them.
_BEHIND_BYTES = 2 * _WORD
LENS_TILE = 16, 16
"""Rows and columns of the lenses that a block has, a thread for each."""


def _warm_steps(slice_: Slice) -> int:
    """Steps of a run before its first sum is complete."""
    return (slice_.order + 1) * (slice_.box // slice_.step - 1)


def run_steps(slice_: Slice, outputs: int) -> int:
    """Steps of a run that makes so many outputs."""
    return outputs + 2 * slice_.lens + _warm_steps(slice_)


def _offset(slice_: Slice) -> int:
    """Index of S that output 0 takes; with one pixel a lens, that of its only place."""
    return slice_.offset if slice_.upsample else slice_.offset - slice_.offset % slice_.step


@dataclass(frozen=True)
class _Sums:
    """The types of C that hold a slice's sums."""

    column: str  # of one dimension, as they are kept: the narrowest type
    running: str  # of one dimension, while a column is summed
    line: str  # of both dimensions, with half of their divisor

    @classmethod
    def of(cls, slice_: Slice) -> "_Sums":
        """The types for the largest sums that a slice's pixels can have."""
        filter_ = slice_.taps
        gain = filter_.centre + 2 * filter_.side
        column = slice_.white * slice_.full * gain
        line = column * slice_.full * gain + slice_.divisor * filter_.scale**2
        running = "int" if column >> 31 == 0 else "long long"
        narrow = "short" if slice_.units else "unsigned short"
        fits = column >> (15 if slice_.units else 16) == 0
        stored = "int" if _packed(slice_) and slice_.units else narrow if fits else running
        return cls(stored, running, "int" if line >> 31 == 0 else "long long")


def _packed(slice_: Slice) -> bool:
    """Whether four columns can be summed at once: the frame's bits must be numbers of 32 bits.

    Sums have 16 bits; for the sharpening those of two have 15, with weights of 7 bits.
    """
    words = 2 * (slice_.order + 1) * (slice_.box // slice_.step) + 4 * slice_.lens
    bits = 14 if slice_.units else 16
    short = slice_.white * slice_.full >> bits == 0 and slice_.taps.centre >> 7 == 0
    fits = words <= _UNROLLED_WORDS and prod(slice_.shape) < 1 << 28
    return slice_.pixel_bits == 8 and short and fits


def _paired(slice_: Slice) -> bool:
    """Whether the sums of both dimensions can be made for two rows at once."""
    most = slice_.white * slice_.full**2 + slice_.full**2 // 2
    return _packed(slice_) and not (slice_.normalise or slice_.units) and most < 1 << 16


def _first_views(slice_: Slice) -> list[int]:
    """For each p modulo M the first view u with u a' = p modulo M, -1 if there is none."""
    m = slice_.micro_image_size
    views = [-1] * m
    for u in range(m // gcd(slice_.shift, m)):
        views[u * slice_.shift % m] = u
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
    packed: bool  # a thread sums four columns
    threads: int  # of a block
    shared_bytes: int  # that its places of lines, sums and pixels take
    offset_type: str  # of C, for places in the raw picture
    cost: float  # instructions for a picture, and more where few threads hide how long each takes

    def blocks(self, slices: int, region: tuple[range, range]) -> tuple[int, int]:
        """Blocks beside each other and below each other that make a region of a stack.

        The first tile begins at a whole segment.
        """
        rows, columns = region
        width = columns.stop - columns.start // self.segment * self.segment
        return slices * -(-width // self.columns), -(-len(rows) // self.rows)


def _reach(slice_: Slice, segment: int) -> tuple[int, int]:
    """Columns before and behind the first output's place that a segment's sums take in."""
    m, slope = slice_.micro_image_size, slice_.shift - 1
    before = slice_.lens + _warm_steps(slice_) - slice_.order * slice_.unit_offset
    first = _offset(slice_) - slice_.step * before
    last = first + slice_.step * (run_steps(slice_, segment) - 1)
    return max(0, (m - 1) * slope) - first, last - min(0, (m - 1) * slope)


def _segment(slice_: Slice) -> int:
    """Outputs of a line that one thread makes.

    Whole lenses, so that their places are constants, and whole words where two rows are made.
    """
    unit = slice_.micro_image_size if slice_.upsample else 1
    if _paired(slice_):
        unit = lcm(unit, _WORD)
    return unit * -(-_SEGMENT_OUTPUTS // unit)


def _tile(
    slice_: Slice, width: int, padded: bool, height: int, threads: int, shared_limit: int
) -> Tile | None:
    """A tile of `height` by `width` outputs; None if it takes too much shared memory."""
    step, channels, segment = slice_.step, slice_.channels, _segment(slice_)
    rows, columns = slice_.shape[:2]
    words = (slice_.order + 1) * (slice_.box // step) + 2 * slice_.lens
    unrolled = (
        run_steps(slice_, max(segment, _ROW_CHOICES[-1])) <= _UNROLLED_STEPS
        and words <= _UNROLLED_WORDS
    )
    before, behind = _reach(slice_, segment)
    behind -= step * (segment - 1)
    column_bytes, pixel_bytes = _BYTES[_Sums.of(slice_).column], slice_.pixel_bits // 8
    offset_type = "unsigned" if rows * columns * channels >> 31 == 0 else "long long"
    padded_columns = step * (width - 1) + 1 + before + behind
    held = max(0, padded_columns if padded else min(padded_columns, columns))
    packed = _packed(slice_) and unrolled and height % 2 == 0
    if packed:
        held += _WORD - 1
    # An odd number of words, or of fours of them: then few lines share a bank of the memory.
    unit = _WORD if packed else max(1, _WORD // column_bytes)
    held = unit * (-(-held // unit) | 1)
    samples = height * channels
    line_bytes = 2 * _WORD if packed else _BYTES[offset_type]
    lines = -(-line_bytes * run_steps(slice_, height) // 16) * 16
    m = slice_.micro_image_size
    # The picture, or in its place a number for each lens that the tile cuts, and one more.
    lenses = ((height + m - 2) // m + 1) * (width // m) if slice_.upsample else 0
    behind_sums = max(samples * width * pixel_bytes, _WORD * (1 + lenses))
    shared = lines + samples * held * column_bytes + behind_sums + _BEHIND_BYTES
    if shared > shared_limit:
        return None
    # Threads without work wait for the others.
    columns_each, rows_each = (_WORD if packed else 1), (2 if packed and _paired(slice_) else 1)
    column_rounds = -(-held * channels // (columns_each * threads))
    line_rounds = -(-samples * (width // segment) // (rows_each * threads))
    column_steps, line_steps = run_steps(slice_, height), run_steps(slice_, segment)
    taps = 3 if slice_.units else 0
    work = threads * (
        60
        + column_rounds * (column_steps * (17 if packed else 8) + height * taps * columns_each)
        + line_rounds
        * (line_steps * (3 if padded else 5) + segment * (5 + 3 * (rows_each - 1) + taps))
    ) + 32 * height * (60 + width * channels / 25)
    across, down = (-(-max(1, n // step) // part) for n, part in ((columns, width), (rows, height)))
    # Blocks beside each other hide the time that memory takes; shared_limit is half of it.
    beside = max(1, min(shared_limit // shared, 640 // threads))
    cost = work * across * down * (1 + 1 / (1 + beside * threads / 256))
    return Tile(
        height,
        width,
        segment,
        before,
        behind,
        held,
        padded,
        unrolled,
        packed,
        threads,
        shared,
        offset_type,
        cost,
    )


def tiles_of(slices: Sequence[Slice], shared_limit: int) -> list[Tile] | None:
    """The tile of each slice of a stack, of one size, that need the fewest additions.

    `shared_limit`: bytes of shared memory that a block may have. None: not even one row fits.
    """
    segment = _segment(slices[0])
    outputs = max(1, slices[0].shape[1] // slices[0].step)
    segments = -(-outputs // segment)
    widths = sorted({segment * -(-segments // parts) for parts in range(1, segments + 1)})
    best: list[Tile] | None = None
    # In whole lenses, so that a lens of a stack lies in one tile, and in pairs of rows.
    m = slices[0].micro_image_size
    heights = sorted({*_ROW_CHOICES, *range(lcm(2, m), _ROW_CHOICES[-1] + 1, lcm(2, m))})
    for width, height, threads in product(widths, heights, _THREAD_CHOICES):
        tiles = []
        for slice_ in slices:
            both = (_tile(slice_, width, padded, height, threads, shared_limit) for padded in _BOTH)
            fitting = [tile for tile in both if tile is not None]
            if not fitting:
                break
            tiles.append(min(fitting, key=_cost))
        else:
            if best is None or sum(map(_cost, tiles)) < sum(map(_cost, best)):
                best = tiles
    return best


def _cost(tile: Tile) -> float:
    return tile.cost


def _text(name: str) -> str:
    return files("plenofir.refocus.gpu").joinpath(name).read_text("utf-8")


def source(slices: Sequence[Slice], tiles: Sequence[Tile]) -> str:
    """The text of the kernel for a stack's tiles, which slices of other sizes may share."""
    body = "\n".join(map(_text, ("sums.cu", "words.cu", "refocus.cu")))
    parts = [
        f"namespace slice{number} {{\n{_constants(slice_, tile)}\n{body}}}"
        for number, (slice_, tile) in enumerate(zip(slices, tiles, strict=True))
    ]
    cases = (f"case {n}: slice{n}::tile({n}, ARGUMENTS); break;" for n in range(len(slices)))
    head = [
        f"constexpr int SLICES = {len(slices)};",
        f"constexpr int THREADS = {tiles[0].threads};",
        f"typedef {_pixel(slices[0])} Pixel;",
        f"#define CASES {' '.join(cases)}",
    ]
    return "\n".join([*head, *parts, _text("stack.cu")])


def depth_source(slices: Sequence[Slice], search: Search) -> str:
    """The text of the kernels that find the sharpest slice of each lens."""
    count, shifts = len(slices), search.shifts
    weights = [slice_weight(shift, slices[0].micro_image_size) for shift in shifts] or [16] * count
    steps = [1, *(abs(b - a) for a, b in pairwise(shifts or range(count))), 1]
    numbers = {
        "int SLICES": count,
        "int TILE_ROWS": LENS_TILE[0],
        "int TILE_COLUMNS": LENS_TILE[1],
        "int RADIUS": search.radius,
        "int VOTE_RADIUS": search.vote_radius,
        "int LEAST": search.confidence,
        "int CURVATURE_BITS": curvature_bits(search.confidence),
        "bool BETWEEN": str(bool(shifts)).lower(),
        f"int WEIGHT[{count}]": f"{{{', '.join(map(str, weights))}}}",
        f"int STEPS[{count + 1}]": f"{{{', '.join(map(str, steps))}}}",
    }
    one = slices[0]
    # Luma counts green twice; a Laplacian has four differences.
    luma = one.white * one.micro_image_size**2 * (4 if one.channels > 1 else 1)
    most = 4 * luma * (2 * search.radius + 1) ** 2 * max(weights)
    head = [f"typedef {'int' if most >> 31 == 0 else 'long long'} Sharpness;"]
    head += [f"constexpr {name} = {value};" for name, value in numbers.items()]
    return "\n".join([*head, _text("depth.cu")])


def lens_grid(slices: Sequence[Slice]) -> tuple[int, int]:
    """Blocks beside each other and below each other that have all lenses."""
    one = slices[0]
    rows, columns = (-(-length // one.micro_image_size) for length in one.shape[:2])
    return -(-columns // LENS_TILE[1]), -(-rows // LENS_TILE[0])


def _pixel(slice_: Slice) -> str:
    return "unsigned char" if slice_.pixel_bits == 8 else "unsigned short"


def _constants(slice_: Slice, tile: Tile) -> str:
    """What stands in front of ``sums.cu``; ``refocus.cu`` explains it."""
    filter_, m, sums = slice_.taps, slice_.micro_image_size, _Sums.of(slice_)
    whole_lenses = not slice_.upsample or tile.segment % m == 0
    numbers = {
        "M": m,
        "SHIFT": slice_.shift,
        "BOX": slice_.box,
        "OFFSET": _offset(slice_),
        "UNIT_OFFSET": slice_.unit_offset,
        "ORDER": slice_.order,
        "STEP": slice_.step,
        "SIDE": filter_.side,
        "CENTRE": filter_.centre,
        "SCALE": filter_.scale,
        "CHANNELS": slice_.channels,
        "WHITE": slice_.white,
        "TILE_ROWS": tile.rows,
        "TILE_COLUMNS": tile.columns,
        "SEGMENT": tile.segment,
        "LOW": tile.low,
        "HIGH": tile.high,
        "HELD_COLUMNS": tile.held_columns,
        "GROUPS": gcd(slice_.shift, m),
        "VIEWS_APART": m // gcd(slice_.shift, m),
    }
    choices = {
        "NORMALISED": slice_.normalise,
        "PADDED": tile.padded,
        "WHOLE_LENSES": whole_lenses,
        "UNROLLED": tile.unrolled,
        "PACKED": tile.packed,
        "PAIRED": tile.packed and _paired(slice_),
    }
    types = {
        "ColumnSum": sums.column,
        "RunningColumn": sums.running,
        "LineSum": sums.line,
        "Offset": tile.offset_type,
    }
    lines = [
        *(f"typedef {of} {name};" for name, of in types.items()),
        *(f"constexpr int {name} = {value};" for name, value in numbers.items()),
        *(f"constexpr bool {name} = {str(value).lower()};" for name, value in choices.items()),
        f"constexpr LineSum FULL = {slice_.full};",
        f"constexpr int FIRST_VIEW[M] = {{{', '.join(map(str, _first_views(slice_)))}}};",
    ]
    return "\n".join(lines)
