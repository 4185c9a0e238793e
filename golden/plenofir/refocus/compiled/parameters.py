# SPDX-License-Identifier: Apache-2.0
"""What compiled code is told: integers and arrays, in named tuples that numba takes in.

Arrays are filled element by element in all compiled code of this folder: assignments of whole
arrays take seconds more to compile, because of their error messages about shapes.
"""

from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

PAD = 32
"""Samples behind a line that may be read, and written over."""
# numba compiles a function anew for a literal argument.
ZERO = cast("int", np.int64(0))

Integers = npt.NDArray[Any]


class Axis(NamedTuple):
    """Parameters of one dimension, all integers."""

    length: int  # pixels of the input
    outputs: int  # pixels of the output
    # output o takes the sum number floor((o + base) / scale)
    base: int
    scale: int
    offset: int  # sum number of the picture's pixel 0


class Plan(NamedTuple):
    """Parameters of one slice of one image, all integers."""

    micro_image_size: int  # M
    shift: int  # a'
    box: int  # samples of the re-ordered line that a sum adds
    order: int  # of the interpolation
    channels: int
    common: int  # gcd(a', M): S changes at its multiples only
    # An output takes sums S in a dimension: groups that are M apart, each of sums that are B apart
    groups: int
    positions: int
    step: int  # sum number t is S[step t]
    box_offset: int  # offset of the moving sums that interpolation appends
    rows: Axis
    columns: Axis
    most: int  # largest result


class Taps(NamedTuple):
    """Sharpening; without it `side` is 0."""

    centre: int
    side: int
    # for each output, 1 if the tap before it counts, + 2 if that after it does
    rows: Integers
    columns: Integers
    # added to sums of columns, so that none is negative: if they have 16 bits, with a side of 1
    zero: int = 0
    # the result is (sharpened sum + bias) >> drop, less as much for the bias
    bias: int = 0
    drop: int = 0
    # with 16 bits: min((sharpened sum + half) >> drop + 1, limit) multiplier / 2^16 >> rest
    half: int = 0
    limit: int = 0
    multiplier: int = 0
    rest: int = 0


class Weights(NamedTuple):
    """Divisors of sums: the weight of the row times that of the column times `twice`."""

    rows: Integers
    # for each column the index of its weight in the next, which has each weight once
    places: Integers
    columns: Integers
    twice: int  # a factor of the divisor
    bits: int  # of pixels


class Loops(NamedTuple):
    """Bytes of numbers, and addresses of the loops for them; 0 where a picture does not take it.

    Words are sums of columns. The last moving sum of a line is one of words, or with interpolation
    one of sums.
    """

    pixel_bytes: int
    word_bytes: int
    sum_bytes: int
    take_number: int
    sum_pixels: int
    next_line: int
    next_words: int
    add_line: int
    three_lines: int
    transpose: int
    fill_words: int
    fill_sums: int
    sum_words: int
    running_words: int
    running_sums: int
    narrow: int
    quotients: int
    finished_lines: int
    transpose_back: int
    copy_line: int
    divide: int
    sharpened_start: int
    sharpened_sums: int
    sharpened_quotients: int


class Frame(NamedTuple):
    """One slice of one image, for all threads."""

    pixels: Integers  # bytes of the raw image
    plan: Plan
    taps: Taps
    weights: Weights
    # for each p mod M the first pixel u with u a' = p modulo M, or -1
    first: Integers
    loops: Loops
