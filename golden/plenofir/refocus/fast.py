# SPDX-License-Identifier: Apache-2.0
"""The fast refocuser: bit-exact, with a cost that depends on neither M nor a'.

Rows and columns of a block are summed together while its lines are in the processor's cache, and
blocks are distributed to threads; see `plenofir.refocus.kernels` for the loops. Only the requested
region is computed.
"""

from functools import cache, lru_cache
from math import gcd
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.refocus import row_vectors, vectors
from plenofir.refocus.blocks import Weights, refocus_blocks
from plenofir.refocus.border import arrived
from plenofir.refocus.kernels import Axis, Plan, Steps, Taps
from plenofir.refocus.operator import Align, Image, check_sums, output_offset
from plenofir.refocus.sharpening import neighbours, taps
from plenofir.refocus.threads import in_threads, processors

# Bytes of a block's transposed sums, which fit into the second-level cache, with room for lines.
_BLOCK_BYTES = 400_000
# Fewer samples are not worth the start of a second thread.
_SAMPLES_FOR_A_THREAD = 1 << 19
# So many blocks for each thread: one that begins late, or is held up, takes fewer.
_BLOCKS_OF_A_THREAD = 8
# Height of a block in micro images: its first line of sums costs M additions of lines.
_BLOCK_LENSES = 4
# Larger pictures, in bytes, bypass the caches when written: the next frame would evict them.
_PAST_CACHES = 4 << 20
_NONE = np.empty(0, np.int64)


class Division(NamedTuple):
    """How sums are held and divided: floor((n + half) multiplier / 2^drop)."""

    bits: int
    half: int
    multiplier: int
    drop: int


def division(divisor: int, most: int, *numbers: int, least_bits: int = 16) -> Division:
    """Narrowest words for sums, and constants for exact quotients, halves rounded up.

    `most`: largest quotient. `numbers`: what the words must hold besides.
    """
    # With d = divisor 2^t and multiplier = (2^k + e) / d, |e| <= d / 2, the quotient n 2^t / d is
    # right if e n < 2^k; or, for e < 0 and n + 1 in the place of n, if -e (n + 1) <= 2^k. d is at
    # most 2^(bits of a word - those of a quotient), and more than half of it.
    quotient_bits = most.bit_length()
    largest = max((most * divisor, *numbers))
    check_sums(largest)
    bits = least_bits
    while divisor << quotient_bits > 1 << bits or largest >> bits:
        bits *= 2
    scale = ((1 << bits - quotient_bits) // divisor).bit_length() - 1
    scaled, drop = divisor << scale, 2 * bits - quotient_bits - 1
    multiplier, rest = divmod(1 << drop, scaled)
    half, above = divisor // 2, 2 * rest >= scaled
    if rest and not above:
        half += 1
    return Division(bits, half, multiplier + above, drop - scale)


class Work(NamedTuple):
    """One slice of one image: arguments of `refocus_blocks`, and the width of its words."""

    plan: Plan
    taps: Taps
    weights: Weights
    line_bits: int
    sum_bits: int


# Planning takes a third of the time of small pictures, and frames of a film have one plan.
@lru_cache(64)
def plan(
    shape: tuple[int, ...],
    pixel_bits: int,
    micro_image_size: int,
    shift: int,
    *,
    align: Align,
    order: int,
    units: int,
    region: tuple[range, range],
    upsample: bool,
    normalise: bool,
) -> Work:
    """Plan the computation of one slice; plans are kept, and their arrays shared."""
    m = micro_image_size
    offset, common = output_offset(m, shift, align), gcd(shift, m)
    step, scale = (1, 1) if order or units else (common, common if upsample else 1)
    rows, columns = (
        Axis(length, len(part), part.start + (offset if upsample else offset // m), scale, offset)
        for length, part in zip(shape[:2], region, strict=True)
    )
    full, white, filter_ = m ** (1 + order), (1 << pixel_bits) - 1, taps(units)
    divisor = full**2
    made = division(divisor, white)
    line_bits = 16 if made.bits == 32 and white * full < 1 << 15 else made.bits
    most, numbers = white, (0,) * 7
    if units:
        # All bits of the scale but one are dropped from sharpened sums, which are above -bias.
        gain, drop = (filter_.centre + 2 * filter_.side) ** 2, 2 * filter_.bits - 1
        bias = ((4 * filter_.side * filter_.centre * white * divisor >> drop + 1) + 1) << drop + 1
        most = -(-white * gain >> 2 * filter_.bits)
        at_once = made
        made = division(2 * divisor, most, gain * white * divisor + (2 << drop), least_bits=32)
        line_bits, numbers = made.bits, (0, bias, drop, 0, 0, 0, 0)
        largest = max(
            (filter_.centre + 2 * filter_.side) * white * full,
            (gain * white * divisor >> drop + 1) + divisor + 1,
        )
        narrow = at_once.bits == 16 <= at_once.drop and largest >> 16 == 0
        if narrow and order == 0 and filter_.side == 1:
            line_bits, above = 16, at_once.half - divisor // 2
            zero, half = 2 * filter_.side * white * full, (divisor + 2 * above) << drop
            limit = (white + 1) * divisor - 1 + above
            numbers = zero, bias, drop, half, limit, at_once.multiplier, at_once.drop - 16
        divisor *= 2
    reached = [np.full(n, full) for n in shape[:2]]
    if normalise:
        reached = [arrived(n, m, shift, order, align) for n in shape[:2]]
    each = 1 if upsample else m
    down, across = (
        weight[::each][part.start : part.stop] for weight, part in zip(reached, region, strict=True)
    )
    different, places = across[:1], np.zeros(across.size, np.int64)
    if normalise:
        different, places = np.unique(across, return_inverse=True)
    weights = Weights(
        down.copy(), places.reshape(-1), different, divisor // full**2, most.bit_length()
    )
    sharp = (
        [
            _taps_inside(weight == full, m)[k.start : k.stop]
            for weight, k in zip(reached, region, strict=True)
        ]
        if units
        else [_NONE] * 2
    )
    return Work(
        Plan(
            micro_image_size=m,
            shift=shift,
            order=order,
            channels=shape[2] if len(shape) == 3 else 1,
            common=common,
            positions=order + 1 + 2 * int(units > 0),
            step=step,
            box_offset=output_offset(m, 1, align),
            rows=rows,
            columns=columns,
            most=white,
        ),
        Taps(filter_.centre, filter_.side, *numbers, *sharp),
        weights,
        line_bits,
        made.bits,
    )


def _taps_inside(inside: npt.NDArray[np.bool_], micro_image_size: int) -> npt.NDArray[np.int64]:
    """For each output 1 if the tap before it counts, plus 2 if the one after it does."""
    own = np.arange(inside.size)
    before, behind = neighbours(inside.size, micro_image_size)
    there = [inside & inside[k] & (k != own) for k in (before, behind)]
    return np.asarray(there[0] + 2 * there[1], np.int64)


@cache
def _steps(pixel: int, word: int, total: int, channels: int, order: int, sharp: int) -> Steps:
    """The loops that a slice takes: pixels, sums of columns and other sums have so many bits."""
    columns, lines, place, last = vectors, row_vectors, 64, total if order else word
    steps = {
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
        kinds = pixel, place, place, word, order, sharp, word
        steps["next_words"] = columns.next_words.address(*kinds)
    if order:
        steps["add_line"] = columns.add_line.address(word)
        kinds = place, place, total, total, word
        steps["running_words"] = lines.running_sum.address(word, *kinds)
        steps["running_sums"] = lines.running_sum.address(total, *kinds)
    if sharp:
        steps["three_lines"] = columns.three_lines.address(word)
        steps["divide"] = lines.divide.address(total, word, place, total)
        steps["sharpened_start"] = lines.sharpened_start.address(last, place, total, word)
        kinds = last, place, place, total, total, word
        steps["sharpened_sums"] = lines.sharpened_sums.address(*kinds)
        if last == 16 and total == 32:
            kinds = last, place, total, word, word
            steps["sharpened_quotients"] = lines.sharpened_quotients.address(*kinds)
    else:
        kinds = last, place, place, word, total, place, total
        steps["quotients"] = lines.quotients.address(*kinds)
        kinds = last, place, channels, total, total, pixel, word
        steps["finished_lines"] = lines.finished_lines.address(*kinds)
    return Steps(**{name: steps.get(name, 0) for name in Steps._fields})


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


def _blocks(work: Plan, word_bytes: int, threads: int) -> npt.NDArray[np.int64]:
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


def fast_refocus(
    raw: Image,
    micro_image_size: int,
    shift: int,
    *,
    align: Align = "centred",
    order: int = 0,
    units: int = 0,
    region: tuple[range, range],
    upsample: bool = True,
    normalise: bool = False,
    out: Image | None = None,
    threads: int | None = None,
) -> Image:
    """Refocus an image, arguments checked by the caller (`plenofir.refocus.refocus`).

    `normalise`: divide the border by the weights there (`plenofir.refocus.border`).
    """
    m = micro_image_size
    shape = (len(region[0]), len(region[1]), *raw.shape[2:])
    image: Image = np.empty(shape, raw.dtype) if out is None else out
    if image.size == 0:
        return image
    if m == 1 and units == 0:
        rows, columns = (slice(part.start, part.stop) for part in region)
        np.copyto(image, raw[rows, columns])
        return image
    work = plan(
        raw.shape,
        8 * raw.dtype.itemsize,
        m,
        shift,
        align=align,
        order=order,
        units=units,
        region=region,
        upsample=upsample,
        normalise=normalise,
    )
    x = np.ascontiguousarray(raw).reshape(-1).view(np.uint8)
    # One variant, whether the caller may write there or not.
    x.flags.writeable = False
    flat = image.reshape(-1).view(np.uint8)
    count = processors() if threads is None else threads
    samples = image.size * (work.plan.step // work.plan.rows.scale) ** 2
    count = max(1, min(count, samples // _SAMPLES_FOR_A_THREAD))
    past = int(flat.nbytes > _PAST_CACHES)
    blocks = _blocks(work.plan, work.line_bits // 8, count)
    number, first = np.zeros(1, np.int64), _first_pixels(m, shift)
    bits = 8 * raw.dtype.itemsize, work.line_bits, work.sum_bits
    steps = _steps(*bits, work.plan.channels, order, int(units > 0))
    in_threads(
        lambda: refocus_blocks(
            x, flat, work.plan, work.taps, work.weights, first, blocks, number, past, steps
        ),
        count,
    )
    return image
