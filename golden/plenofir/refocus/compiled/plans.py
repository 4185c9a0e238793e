# SPDX-License-Identifier: Apache-2.0
"""The plan of a slice: parameters, divisors and loops for compiled code, and its blocks."""

from functools import cache, lru_cache
from math import gcd
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.refocus.border import arrived
from plenofir.refocus.compiled import column_vectors, row_vectors
from plenofir.refocus.compiled.parameters import Axis, Loops, Plan, Taps, Weights
from plenofir.refocus.division import Division, division
from plenofir.refocus.operator import output_offset
from plenofir.refocus.sharpening import neighbours
from plenofir.refocus.slices import Slice

# Bytes of a block's transposed sums, which fit into the second-level cache, with room for lines.
_BLOCK_BYTES = 400_000
# So many blocks for each thread: one that begins late, or is held up, takes fewer.
_BLOCKS_OF_A_THREAD = 8
# Height of a block in micro images: its first line of sums costs M additions of lines.
_BLOCK_LENSES = 4
_NONE = np.empty(0, np.int64)


class Work(NamedTuple):
    """One slice of one image, as compiled code takes it."""

    plan: Plan
    taps: Taps
    weights: Weights
    first: npt.NDArray[np.int64]  # as in `Frame`
    loops: Loops


class Sums(NamedTuple):
    """How sums are held and divided, and the numbers of `Taps` that follow."""

    line_bits: int  # of a sum of columns
    sum_bits: int  # of the last sums
    numbers: dict[str, int]


def _plain_sums(slice_: Slice) -> Sums:
    """Sums without sharpening."""
    quotients = division(slice_.divisor, slice_.white)
    narrow = quotients.bits == 32 and slice_.white * slice_.full < 1 << 15
    return Sums(16 if narrow else quotients.bits, quotients.bits, {})


def _sharpened_sums(slice_: Slice) -> Sums:
    """Sums with sharpening: all bits of its scale but one are dropped before the division."""
    filter_, white, divisor = slice_.taps, slice_.white, slice_.divisor
    drop = slice_.dropped_bits
    # Sharpened sums are above -bias.
    bias = ((4 * filter_.side * filter_.centre * white * divisor >> drop + 1) + 1) << drop + 1
    bits = division(2 * divisor, slice_.largest, slice_.sharpened_sum, least_bits=32).bits
    at_once = division(divisor, white)
    most = max(
        filter_.gain * white * slice_.full,
        (filter_.gain**2 * white * divisor >> drop + 1) + divisor + 1,
    )
    narrow = at_once.bits == 16 <= at_once.drop and most >> 16 == 0
    if narrow and slice_.order == 0 and filter_.side == 1:
        return Sums(16, bits, _narrow_numbers(slice_, at_once, bias))
    return Sums(bits, bits, {"bias": bias, "drop": drop})


def _narrow_numbers(slice_: Slice, at_once: Division, bias: int) -> dict[str, int]:
    """Numbers of `Taps` where sums of columns have 16 bits."""
    above, drop = at_once.half - slice_.divisor // 2, slice_.dropped_bits
    return {
        "zero": 2 * slice_.taps.side * slice_.white * slice_.full,
        "bias": bias,
        "drop": drop,
        "half": (slice_.divisor + 2 * above) << drop,
        "limit": (slice_.white + 1) * slice_.divisor - 1 + above,
        "multiplier": at_once.multiplier,
        "rest": at_once.drop - 16,
    }


def _groups(slice_: Slice) -> tuple[int, int]:
    """Groups of sums that an output takes in a dimension, and sums of each (`Plan`)."""
    positions = slice_.order + 1
    if not slice_.units:
        return 1, positions
    # Boxes as wide as a micro image follow each other as those of the interpolation do.
    return (1, positions + 2) if slice_.box == slice_.micro_image_size else (3, positions)


def _plan_of(slice_: Slice) -> Plan:
    """Parameters of a slice."""
    m, shift, order, box = slice_.micro_image_size, slice_.shift, slice_.order, slice_.box
    offset, common = output_offset(m, shift, slice_.align, box), gcd(shift, m)
    groups, positions = _groups(slice_)
    # Interpolation and sharpening take sums at each pixel, also where neighbours are equal.
    step, scale = 1, 1
    if not (order or slice_.units):
        step, scale = common, common if slice_.upsample else 1
    rows, columns = (
        Axis(length, len(part), part.start + offset // slice_.step, scale, offset)
        for length, part in zip(slice_.shape[:2], slice_.region, strict=True)
    )
    return Plan(
        micro_image_size=m,
        shift=shift,
        box=box,
        order=order,
        channels=slice_.shape[2] if len(slice_.shape) == 3 else 1,
        common=common,
        groups=groups,
        positions=positions,
        step=step,
        box_offset=output_offset(m, 1, slice_.align, box),
        rows=rows,
        columns=columns,
        most=slice_.white,
    )


# Planning takes a third of the time of small pictures, and frames of a film have one plan.
@lru_cache(64)
def work_of(slice_: Slice) -> Work:
    """Plan the computation of one slice; plans are kept, and their arrays shared."""
    m, full, region = slice_.micro_image_size, slice_.full, slice_.region
    sums = _sharpened_sums(slice_) if slice_.units else _plain_sums(slice_)
    reached = [np.full(n, full) for n in slice_.shape[:2]]
    if slice_.normalise:
        reached = [
            arrived(n, m, slice_.shift, slice_.order, slice_.align, slice_.box)
            for n in slice_.shape[:2]
        ]
    down, across = (
        weight[:: slice_.step][part.start : part.stop]
        for weight, part in zip(reached, region, strict=True)
    )
    different, places = across[:1], np.zeros(across.size, np.int64)
    if slice_.normalise:
        different, places = np.unique(across, return_inverse=True)
    sharp = [_NONE] * 2
    largest, twice = slice_.white, 1
    if slice_.units:
        largest, twice = slice_.largest, 2
        sharp = [
            _taps_inside(weight == full, m)[part.start : part.stop]
            for weight, part in zip(reached, region, strict=True)
        ]
    plan = _plan_of(slice_)
    return Work(
        plan,
        Taps(slice_.taps.centre, slice_.taps.side, rows=sharp[0], columns=sharp[1], **sums.numbers),
        Weights(down.copy(), places.reshape(-1), different, twice, largest.bit_length()),
        _first_pixels(m, slice_.shift),
        _loops(
            (slice_.pixel_bits, sums.line_bits, sums.sum_bits),
            plan.channels,
            slice_.order,
            (plan.groups, plan.positions),
        ),
    )


def _taps_inside(inside: npt.NDArray[np.bool_], micro_image_size: int) -> npt.NDArray[np.int64]:
    """For each output 1 if the tap before it counts, plus 2 if the one after it does."""
    pixels = np.arange(inside.size)
    before, behind = (
        inside & inside[k] & (k != pixels) for k in neighbours(inside.size, micro_image_size)
    )
    return np.asarray(before + 2 * behind, np.int64)


@cache
def _loops(bits: tuple[int, int, int], channels: int, order: int, sums: tuple[int, int]) -> Loops:
    """The loops that a slice takes; `bits` of pixels, of sums of columns and of other sums.

    `sums`: groups of them, and sums of each (`Plan`).
    """
    columns, lines = column_vectors, row_vectors
    pixel, word, total = bits
    place, last = 64, total if order else word
    groups, positions = sums
    sharp = int(groups * positions > order + 1)
    loops = {
        "pixel_bytes": pixel // 8,
        "word_bytes": word // 8,
        "sum_bytes": total // 8,
        "take_number": lines.take_number.address(place, place),
        "sum_pixels": columns.sum_lines.address(pixel, place, word),
        "next_line": columns.next_line.address(pixel, word),
        "transpose": columns.transpose.address(word, word),
        "fill_words": columns.fill.address(word),
        "fill_sums": columns.fill.address(total),
        "sum_words": columns.sum_lines.address(word, place, total),
        "narrow": columns.narrow.address(64, total),
        "transpose_back": lines.transpose_back.address(word, place, pixel),
        "copy_line": lines.copy_line.address(pixel, pixel),
    }
    kinds: tuple[int, ...]
    if order + sharp < 2:
        kinds = pixel, place, place, word, groups, positions, word
        loops["next_words"] = columns.next_words.address(*kinds)
    if order:
        loops["add_line"] = columns.add_line.address(word)
        kinds = place, place, place, total, total, word
        loops["running_words"] = lines.running_sum.address(word, *kinds)
        loops["running_sums"] = lines.running_sum.address(total, *kinds)
    if sharp:
        loops["three_lines"] = columns.three_lines.address(word)
        loops["divide"] = lines.divide.address(total, word, place, total)
        loops["sharpened_start"] = lines.sharpened_start.address(last, place, total, word)
        kinds = last, place, place, place, groups, total, total, word
        loops["sharpened_sums"] = lines.sharpened_sums.address(*kinds)
        if last == 16 and total == 32:
            kinds = last, place, place, groups, total, word, word
            loops["sharpened_quotients"] = lines.sharpened_quotients.address(*kinds)
    else:
        kinds = last, place, place, place, word, total, place, total
        loops["quotients"] = lines.quotients.address(*kinds)
        kinds = last, place, place, channels, total, total, pixel, word
        loops["finished_lines"] = lines.finished_lines.address(*kinds)
    return Loops(**{name: loops.get(name, 0) for name in Loops._fields})


@lru_cache(1000)
def _first_pixels(micro_image_size: int, shift: int) -> npt.NDArray[np.int64]:
    """For each p mod M the first pixel u with u a' = p modulo M; -1 if there is none."""
    # Further ones follow at distances of M / gcd(a', M).
    pixels = np.arange(micro_image_size // gcd(shift, micro_image_size))
    first = np.full(micro_image_size, -1)
    first[pixels * shift % micro_image_size] = pixels
    return first


def _block_size(work: Plan, word_bytes: int, threads: int) -> tuple[int, int]:
    """Rows and columns of a block."""
    m, rows, columns = work.micro_image_size, work.rows, work.columns
    beside = (m - 1) * (abs(work.shift - 1) + 1 + work.order)
    pixels = max(1, _BLOCK_BYTES // (64 * work.channels), 4 * beside)
    stride = work.step // columns.scale
    parts = max(1, round(columns.outputs * stride / pixels))
    lines = 64 // word_bytes * rows.scale
    height = -(-rows.outputs // (_BLOCKS_OF_A_THREAD * threads if threads > 1 else 1))
    return -(-max(height, _BLOCK_LENSES * m) // lines) * lines, -(-columns.outputs // parts)


def blocks_of(work: Plan, word_bytes: int, threads: int) -> npt.NDArray[np.int64]:
    """Divide the output into blocks, shape (blocks, 4); see `refocus_blocks`."""
    rows, columns = work.rows.outputs, work.columns.outputs
    height, width = _block_size(work, word_bytes, threads)
    return np.array(
        [
            (row, min(row + height, rows), column, min(column + width, columns))
            for column in range(0, columns, width)
            for row in range(0, rows, height)
        ],
        dtype=np.int64,
    )
