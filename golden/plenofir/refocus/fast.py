# SPDX-License-Identifier: Apache-2.0
"""The fast refocuser: bit-exact, with a cost that depends on neither M nor a'.

Rows and columns of a block are summed in one go while the block is in the processor's cache, and
blocks are shared out to threads; see `plenofir.refocus.kernels` for the loops. Only the
region asked for is computed.
"""

import threading
from collections.abc import Callable
from itertools import pairwise
from math import gcd
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.refocus.border import arrived, complete, divide_by_weights, sharpened_inside
from plenofir.refocus.kernels import Axis, Plan, refocus_blocks
from plenofir.refocus.operator import (
    Align,
    Image,
    Sums,
    check_sums,
    output_offset,
    refocus_sums,
)
from plenofir.refocus.sharp_kernels import Filter, sharpened_blocks
from plenofir.refocus.sharpening import sharpened_picture, taps
from plenofir.refocus.threads import processors
from plenofir.refocus.vectors import LINE_BYTES

# Bytes of sums in a line of a block: all of its lines fit into the second-level cache.
_BLOCK_BYTES = 6600
# Lines of sums in a block; the first of them costs M line additions, the others two.
_BLOCK_LINES = 64
# A thread's sums need this many bytes at most, or this part of the frame, whichever is more.
_LEAST_MEMORY, _SHARE_OF_FRAME = 12 << 20, 64
# Below this many samples a second thread is not worth its start.
_SAMPLES_FOR_A_THREAD = 1 << 19
# The border is made in strips of so many pixels; fewer than the other number are one thread's.
_BORDER_PIXELS, _SAMPLES_OF_A_BORDER = 1 << 16, 1 << 16


class Field(NamedTuple):
    """How sums are held and divided."""

    kind: type[np.unsignedinteger]
    # floor(n / divisor) is (n * multiplier) >> drop; 0 if there is no such multiplier
    drop: int
    multiplier: int


def field(largest: int, divisor: int) -> Field:
    """Narrowest type for sums in which they can be divided exactly."""
    # floor(n / d) is (n * multiplier) >> drop with multiplier = ceil(2^drop / d) if
    # (multiplier * d - 2^drop) n < 2^drop for the largest n.
    check_sums(largest)
    numerator = largest + divisor // 2
    for kind in (np.uint16, np.uint32):
        bits = 8 * np.dtype(kind).itemsize
        # As large as the multiplier may be; a power of two of a product of two fields.
        drop = bits + divisor.bit_length() - 1
        multiplier = -(-(1 << drop) // divisor)
        if multiplier >= 1 << bits:
            drop, multiplier = drop - 1, (multiplier + 1) // 2
        excess = multiplier * divisor - (1 << drop)
        if numerator < 1 << bits and excess * numerator < 1 << drop:
            return Field(kind, drop, multiplier)
    return Field(np.uint64, 0, 0)


def plan(
    shape: tuple[int, ...],
    pixel_bits: int,
    micro_image_size: int,
    shift: int,
    *,
    align: Align,
    order: int,
    region: tuple[range, range],
    upsample: bool,
) -> tuple[Plan, npt.NDArray[Any]]:
    """Work out one slice."""
    m = micro_image_size
    offset = output_offset(m, shift, align)
    common = gcd(shift, m)
    if order > 0:
        step, scale = 1, 1
    else:
        step, scale = common, common if upsample else 1
    axes = []
    for length, part in zip(shape[:2], region, strict=True):
        base = part.start + (offset if upsample else offset // m)
        axes.append(Axis(length, len(part), part.start, base, scale))
    divisor = m ** (2 + 2 * order)
    half = divisor // 2
    largest = divisor * ((1 << pixel_bits) - 1)
    chosen = field(largest, divisor)
    work = Plan(
        micro_image_size=m,
        shift=shift,
        order=order,
        channels=shape[2] if len(shape) == 3 else 1,
        common=common,
        step=step,
        box_offset=output_offset(m, 1, align),
        rows=axes[0],
        columns=axes[1],
        half=half,
        divisor=divisor,
        multiplier=chosen.multiplier,
        drop=chosen.drop,
    )
    return work, np.empty(0, chosen.kind)


def _blocks(work: Plan, sample_bytes: int, most: int, threads: int) -> npt.NDArray[np.int64]:
    """Divide the output into blocks, shape (blocks, 4); see `refocus_blocks`."""
    # `most`: bytes of sums in a block.
    m, rows, columns = work.micro_image_size, work.rows, work.columns
    together = LINE_BYTES // sample_bytes
    # Input pixels on both sides of a block's columns that it takes, too.
    beside = (m - 1) * (abs(work.shift - 1) + 1 + work.order)
    pixels = max(_BLOCK_BYTES // (sample_bytes * work.channels), 4 * beside)
    # Input pixels that an output moves on by.
    stride = work.step // columns.scale
    parts = max(1, round(columns.outputs * stride / pixels))
    width = -(-columns.outputs // parts)
    lines = max(_BLOCK_LINES, 4 * m)
    taken = min(columns.length, width * stride + beside) * work.channels * sample_bytes
    if work.order > 0:
        # Lines above and below, and both before and after interpolation.
        most, taken = most - 2 * work.order * (m - 1) * taken, 2 * taken
    lines = max(together, min(lines, most // max(taken, 1)))
    # With one value a micro image, no line of sums builds on the one above.
    if work.common == m:
        lines = together
    height = lines * rows.scale
    height = min(height, -(-rows.outputs // threads))
    return np.array(
        [
            (row, min(row + height, rows.outputs), column, min(column + width, columns.outputs))
            for row in range(0, rows.outputs, height)
            for column in range(0, columns.outputs, width)
        ],
        dtype=np.int64,
    )


def _share_out(
    work: Callable[[npt.NDArray[np.int64]], None], blocks: npt.NDArray[np.int64], threads: int
) -> None:
    """Work on blocks in several threads, which take the next few when they are done."""
    chunks = iter(np.array_split(blocks, min(len(blocks), 4 * threads if threads > 1 else 1)))
    failures: list[BaseException] = []

    def take() -> None:
        try:
            for chunk in chunks:
                work(chunk)
        except Exception as failure:
            failures.append(failure)

    helpers = [threading.Thread(target=take) for _ in range(threads - 1)]
    for helper in helpers:
        helper.start()
    take()
    for helper in helpers:
        helper.join()
    if failures:
        raise failures[0]


def _sharpen(
    raw: Image,
    image: Image,
    work: Plan,
    like: npt.NDArray[Any],
    units: int,
    threads: int | None,
) -> None:
    """Refocus and sharpen."""
    m = work.micro_image_size
    if like.itemsize == 8 or m == 1:
        # Sums of more than 32 bits (M or order large) and M = 1 are rare: by the definition.
        align: Align = "centred" if output_offset(m, 1, "centred") == work.box_offset else "causal"
        sums = refocus_sums(raw, m, shift=work.shift, align=align, order=work.order)
        white = int(np.iinfo(raw.dtype).max)
        picture = sharpened_picture(sums, work.divisor, white, m, units)
        rows, columns = (slice(a.start, a.start + a.outputs) for a in (work.rows, work.columns))
        image[...] = picture[rows, columns]
        return
    filter_ = taps(units)
    scale = filter_.scale**2
    numbers = Filter(
        side=filter_.side,
        bits=filter_.bits,
        half=scale * work.divisor // 2,
        most=int(np.iinfo(raw.dtype).max) * work.divisor + work.divisor // 2,
    )
    # Words are as wide as what is divided needs. Compiled variants are few: wide words of 8 bit
    # pixels are made as those of 16 bit.
    reach = (filter_.centre + 2 * filter_.side) ** 2 * (numbers.most + 1)
    wide = np.empty(0, np.int32 if reach < 1 << 31 else np.int64)
    kind = np.uint8 if raw.dtype == np.uint8 and wide.itemsize == 4 else np.uint16
    if kind == np.uint16:
        wide = np.empty(0, np.int64)
    x = np.ascontiguousarray(raw, kind).reshape(raw.shape[0], -1)
    x.flags.writeable = False
    flat = image if raw.dtype == kind else np.empty(image.shape, kind)
    flat = flat.reshape(image.shape[0], -1)
    count = processors() if threads is None else threads
    count = max(1, min(count, image.size // _SAMPLES_FOR_A_THREAD))
    strips = _strips(work, like.itemsize, count)
    _share_out(
        lambda chunk: sharpened_blocks(x, flat, work, numbers, chunk, like, wide), strips, count
    )
    if flat.dtype != image.dtype:
        image[...] = flat.reshape(image.shape)


def _strips(work: Plan, sample_bytes: int, threads: int) -> npt.NDArray[np.int64]:
    """Divide the output into high blocks, of which each keeps its last lines at hand."""
    rows, columns, m = work.rows, work.columns, work.micro_image_size
    beside = m * (abs(work.shift - 1) + 3 + work.order)
    pixels = max(_BLOCK_BYTES // (sample_bytes * work.channels), 4 * beside)
    parts = max(1, round(columns.outputs / pixels))
    width = -(-columns.outputs // parts)
    heights = 2 * threads if threads > 1 else 1
    height = max(-(-rows.outputs // heights), min(rows.outputs, 8 * m))
    return np.array(
        [
            (row, min(row + height, rows.outputs), column, min(column + width, columns.outputs))
            for row in range(0, rows.outputs, height)
            for column in range(0, columns.outputs, width)
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
    # The only view is everywhere.
    normalise = normalise and m > 1
    if m == 1 and units == 0:
        rows, columns = (slice(part.start, part.stop) for part in region)
        np.copyto(image, raw[rows, columns])
        return image
    work, like = plan(
        raw.shape,
        8 * raw.dtype.itemsize,
        m,
        shift,
        align=align,
        order=order,
        region=region,
        upsample=upsample,
    )
    inside = None
    if normalise:
        full, step = m ** (1 + order), 1 if upsample else m
        down, across = (arrived(n, m, shift, order, align)[::step] for n in raw.shape[:2])
        rows_inside = _within(complete(down, full, m, units), region[0])
        inside = rows_inside, _within(complete(across, full, m, units), region[1])
    if units:
        _sharpen(raw, image, work, like, units, threads)
    elif inside is None or all(inside):
        _refocus_into(raw, image, work, like, threads, inside)
    if inside is not None:
        _normalise_border(raw, image, work, like, units, (down, across), inside, threads)
    return image


def _refocus_into(
    raw: Image,
    image: Image,
    work: Plan,
    like: npt.NDArray[Any],
    threads: int | None,
    part: tuple[range, range] | None = None,
) -> None:
    """Fill a part of a result; with a plan that does not divide, of the type of `like`, with sums.

    `part`: rows and columns of the result, all of them if None.
    """
    rows, columns = part or (range(work.rows.outputs), range(work.columns.outputs))
    # One compiled variant for arrays that may and may not be written, and for wide sums that are
    # rarely needed (M or order large) only that of 16 bit pixels: each takes seconds to compile.
    wide = like.itemsize == 8 and image.dtype == np.uint8
    x = np.ascontiguousarray(raw, np.uint16 if like.itemsize == 8 else None)
    x = x.reshape(raw.shape[0], -1)
    x.flags.writeable = False
    flat = np.empty(image.shape, np.uint16) if wide else image
    flat = flat.reshape(image.shape[0], -1)
    count = processors() if threads is None else threads
    samples = len(rows) * len(columns) * work.channels * (work.step // work.rows.scale) ** 2
    count = max(1, min(count, samples // _SAMPLES_FOR_A_THREAD))
    most = max(_LEAST_MEMORY, raw.nbytes // _SHARE_OF_FRAME)
    of_part = work._replace(
        rows=work.rows._replace(outputs=len(rows)),
        columns=work.columns._replace(outputs=len(columns)),
    )
    blocks = _blocks(of_part, like.itemsize, most, count)
    blocks += np.array([rows.start, rows.start, columns.start, columns.start])
    _share_out(lambda chunk: refocus_blocks(x, flat, work, chunk, like), blocks, count)
    if wide:
        within = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
        image[within] = flat.reshape(image.shape)[within]


def _normalise_border(
    raw: Image,
    image: Image,
    work: Plan,
    like: npt.NDArray[Any],
    units: int,
    weights: tuple[Sums, Sums],
    inside: tuple[range, range],
    threads: int | None,
) -> None:
    """Fill what lies around the complete rows and columns of a result."""
    strips = _border_strips(*inside, image)
    if not len(strips):
        return

    def fill(chunk: npt.NDArray[np.int64]) -> None:
        for strip in chunk:
            _normalise(raw, image, work, like, units, weights, strip)

    count = processors() if threads is None else threads
    samples = int(((strips[:, 1] - strips[:, 0]) * (strips[:, 3] - strips[:, 2])).sum())
    _share_out(fill, strips, max(1, min(count, len(strips), samples // _SAMPLES_OF_A_BORDER)))


def _within(part: range, region: range) -> range:
    """What a region has of some outputs, counted from its first."""
    start, stop = max(part.start, region.start), min(part.stop, region.stop)
    return range(start - region.start, max(start, stop) - region.start)


def _border_strips(rows: range, columns: range, image: Image) -> npt.NDArray[np.int64]:
    """Strips of a result around what is complete, shape (strips, 4): as blocks are."""
    height, width = image.shape[:2]
    if not rows or not columns:
        rows, columns = range(height), range(0)
    sides = [(0, rows.start, 0, width), (rows.stop, height, 0, width)]
    sides += [(rows.start, rows.stop, 0, columns.start)]
    sides += [(rows.start, rows.stop, columns.stop, width)]
    found = []
    for top, bottom, left, right in sides:
        if bottom > top and right > left:
            parts = -(-(bottom - top) * (right - left) // _BORDER_PIXELS)
            ends = np.unique(np.linspace(top, bottom, parts + 1).astype(np.int64))
            found += [(a, b, left, right) for a, b in pairwise(ends.tolist())]
    return np.array(found, np.int64).reshape(-1, 4)


def _normalise(
    raw: Image,
    image: Image,
    work: Plan,
    like: npt.NDArray[Any],
    units: int,
    weights: tuple[Sums, Sums],
    strip: npt.NDArray[np.int64],
) -> None:
    """Fill a strip of a result with sums over the weights that reached them."""
    m, full = work.micro_image_size, work.micro_image_size ** (1 + work.order)
    axes = work.rows, work.columns
    place = slice(strip[0], strip[1]), slice(strip[2], strip[3])
    # Pixels of the image, with taps those that they reach, too.
    parts = [range(a.start + k.start, a.start + k.stop) for a, k in zip(axes, place, strict=True)]
    reach = m if units else 0
    taken = [
        range(max(0, part.start - reach), min(len(weight), part.stop + reach))
        for part, weight in zip(parts, weights, strict=True)
    ]
    down, across = (w[k.start : k.stop] for w, k in zip(weights, taken, strict=True))
    sums: Sums = np.empty((len(down), len(across), *raw.shape[2:]), like.dtype)
    rows, columns = (
        axis._replace(outputs=len(part), start=part.start, base=axis.base - axis.start + part.start)
        for axis, part in zip(axes, taken, strict=True)
    )
    undivided = {"half": 0, "divisor": 1, "multiplier": 0, "drop": 0}
    of_strip = work._replace(rows=rows, columns=columns, **undivided)
    _refocus_into(raw, sums, of_strip, like, 1)
    if units:
        scale = taps(units).scale
        wide = sharpened_inside(sums.astype(np.int64), (down, across), full, m, units)
        top, left = (part.start - more.start for part, more in zip(parts, taken, strict=True))
        rows_of, columns_of = slice(top, top + len(parts[0])), slice(left, left + len(parts[1]))
        sums = np.ascontiguousarray(wide[rows_of, columns_of])
        down, across = scale * down[rows_of], scale * across[columns_of]
    made = np.empty(sums.shape, raw.dtype)
    divide_by_weights(sums, (down, across), made)
    image[place] = made
