# SPDX-License-Identifier: Apache-2.0
"""Sums along several lines at once, their division and the way back to lines, as vectors.

A vector of `LINE_BYTES` holds one sample of several lines (`column_vectors`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_

from llvmlite import ir

from plenofir.refocus.compiled.machine_code import loop
from plenofir.refocus.compiled.vector_code import (
    LINE_BYTES,
    TILE_BYTES,
    Array,
    Value,
    Variable,
    lanes_in_line,
    transposed_pieces,
)


@loop
def take_number(counter: Array, claimed: Array) -> None:
    """claimed[0] = counter[0], which becomes the next; each number is taken by one thread."""
    builder = counter.builder
    number = builder.atomic_rmw("add", counter.data, ir.Constant(ir.IntType(64), 1), "seq_cst")
    claimed.store(Value(builder, ir.Constant(ir.IntType(64), 0)), Value(builder, number))


@dataclass(frozen=True)
class _Moving:
    """Running sums of several lines at once: sums r = 0 .. count - 1.

    Sum r adds a change for each of the places with the numbers ends[first + r] to
    ends[first + r + 1] - 1, or if `several` is 0 for number first + r, where pixels enter, and the
    place of that number in `leaving`; each sample of a pixel has a sum of its own. `carry` has the
    sum before the first, and afterwards the last one.
    """

    places: Array
    leaving: Array
    ends: Array
    several: Value
    first: Value
    count: Value
    pixel: Value
    carry: Array
    lanes: int


def _moving(
    sums: _Moving, change: Callable[[Value, Value], Value], use: Callable[[Value, Value], None]
) -> None:
    """Write running sums that change by change(place, leaving); `use` gets r pixel and sum r."""
    first, count, carry, lanes = sums.first, sums.count, sums.carry, sums.lanes
    with (sums.pixel // lanes).times() as sample:
        channel = sample * lanes
        total = Variable(carry.load(channel, lanes))

        def take(number: Value) -> None:
            enters, leaves = (a.load(number) + channel for a in (sums.places, sums.leaving))
            total.set(total.get() + change(enters, leaves))

        with sums.several.is_nothing() as (one_each, any_number):
            with one_each, count.times() as r:
                take(first + r)
                use(r * sums.pixel + channel, total.get())
            with any_number, count.times() as r:
                begin = sums.ends.load(first + r)
                with (sums.ends.load(first + r + 1) - begin).times() as i:
                    take(begin + i)
                use(r * sums.pixel + channel, total.get())
        carry.store(channel, total.get())


def _box(words: Array, carry: Array, lanes_of: Array) -> Callable[[Value, Value], Value]:
    """How places change a plain sum: words[enters ...] - words[leaves ...]."""
    lanes = lanes_in_line(lanes_of)

    def change(enters: Value, leaves: Value) -> Value:
        change = words.load(enters, lanes) - words.load(leaves, lanes)
        return change.as_wide_as(carry.bits, signed=True)

    return change


def _factors(table: Array, entry: Value, lanes: int, *numbers: int) -> Sequence[Value]:
    """The requested ones of half (0), scale (1) and multiplier (2), from table[entry] on."""
    return [table.load(entry + lanes * k, lanes) for k in numbers]


def _quotient(total: Value, factors: Sequence[Value], drop: Value, most: Value) -> Value:
    """min(most, ((total + half) scale multiplier) >> drop)."""
    half, scale, multiplier = factors
    quotient = ((total + half) * scale).upper_product(multiplier) >> (drop - total.bits)
    return quotient.at_most(most) if total.bits > 16 else quotient


@loop
def running_sum(
    words: Array,
    places: Array,
    leaving: Array,
    ends: Array,
    several: Value,
    first: Value,
    count: Value,
    totals: Array,
    target: Value,
    pixel: Value,
    carry: Array,
    lanes_of: Array,
) -> None:
    """totals[target + r pixel ...], r = 0 .. count - 1, as `_moving` has them."""
    lanes = lanes_in_line(lanes_of)
    _moving(
        _Moving(places, leaving, ends, several, first, count, pixel, carry, lanes),
        _box(words, carry, lanes_of),
        lambda place, total: totals.store(target + place, total),
    )


@loop
def quotients(
    words: Array,
    places: Array,
    leaving: Array,
    ends: Array,
    several: Value,
    first: Value,
    count: Value,
    values: Array,
    pixel: Value,
    carry: Array,
    index: Array,
    from_entry: Value,
    alike: Value,
    table: Array,
    drop: Value,
    most: Value,
) -> None:
    """Sums of `running_sum`, each divided as `divide` does: values[r pixel ...]."""
    lanes = lanes_in_line(values)
    box = _box(words, carry, values)
    moving = _Moving(places, leaving, ends, several, first, count, pixel, carry, lanes)

    def store(place: Value, total: Value, factors: Sequence[Value]) -> None:
        quotient = _quotient(total, factors, drop, most)
        values.store(place, quotient.as_wide_as(values.bits))

    with alike.is_nothing() as (different, all_alike):
        with different:

            def of_place(place: Value, total: Value) -> None:
                entry = index.load(from_entry + place // lanes)
                store(place, total, _factors(table, entry, lanes, 0, 1, 2))

            _moving(moving, box, of_place)
        with all_alike:
            entry = index.load(from_entry)
            addends = _factors(table, entry, lanes, 0, 1)

            def same(place: Value, total: Value) -> None:
                # Loaded from memory, so that LLVM knows the multiplier's width.
                store(place, total, [*addends, *_factors(table, entry, lanes, 2)])

            _moving(moving, box, same)


@loop
def divide(
    totals: Array,
    place: Value,
    values: Array,
    target: Value,
    count: Value,
    index: Array,
    first: Value,
    table: Array,
    drop: Value,
    most: Value,
) -> None:
    """`count` vectors of min(most, ((totals[place ...] + half) scale multiplier) >> drop)."""
    # Vector n has half, scale and multiplier from table[index[first + n]] on.
    lanes = lanes_in_line(values)
    with count.times() as n:
        total = totals.load(place + n * lanes, lanes)
        factors = _factors(table, index.load(first + n), lanes, 0, 1, 2)
        quotient = _quotient(total, factors, drop, most)
        values.store(target + n * lanes, quotient.as_wide_as(values.bits))


@loop
def transpose_back(
    values: Array,
    index: Array,
    first: Value,
    base: Value,
    picture: Array,
    target: Value,
    pitch: Value,
    count: Value,
) -> None:
    """picture[target + l pitch + k] = values[index[first + k] - base + l], k < count, lanes l."""
    # Rounded up to whole tiles.
    lanes, width = lanes_in_line(values), _tile_samples(picture)
    with ((count + (width - 1)) // width).times() as tile:
        first_here = first + tile * width
        vectors = [values.load(index.load(first_here + i) - base, lanes) for i in range(width)]
        _store_tile(vectors, picture, target + tile * width, pitch)


def _tile_samples(picture: Array) -> int:
    """Samples of a line that are transposed back in one go."""
    return int(2 * 8 * TILE_BYTES // picture.bits)


def _store_tile(vectors: Sequence[Value], picture: Array, target: Value, pitch: Value) -> None:
    """Transpose vectors of values back: lane l of number k to picture[target + l pitch + k]."""
    together = vectors[0].bits // picture.bits
    rows = [
        reduce(or_, (vectors[i + j] << (picture.bits * j) for j in range(together)))
        for i in range(0, len(vectors), together)
    ]
    for line, piece in transposed_pieces(rows):
        picture.store(target + pitch * line, piece)


@loop
def finished_lines(
    words: Array,
    places: Array,
    leaving: Array,
    first: Value,
    count: Value,
    channels: int,
    carry: Array,
    table: Array,
    entry: Value,
    drop: Value,
    most: Value,
    half: Value,
    inverse: Value,
    picture: Array,
    target: Value,
    pitch: Value,
    lanes_of: Array,
) -> None:
    """Sums of `running_sum` at one place each, divided, then `transpose_back`, in registers."""
    # Pixels first .. first + count - 1, rounded up to whole tiles. The quotient of a sum is
    # min(most, ((sum + half) multiplier / 2^bits) >> drop): sums are kept with half. `inverse`: the
    # bits of a real number, if not 0, with which it is (sum + half) inverse.
    lanes, width = lanes_in_line(lanes_of), _tile_samples(picture)
    shift, change = drop.as_wide_as(carry.bits), _box(words, carry, lanes_of)

    def whole(total: Value) -> Value:
        # The multiplier from memory: LLVM knows then that it is no wider than that.
        quotient = total.upper_product(table.load(entry + 2 * lanes, lanes)) >> shift
        return quotient.at_most(most) if carry.bits > 16 else quotient

    def real(total: Value) -> Value:
        return total.times_real(inverse)

    def store_all(above: Value, divide: Callable[[Value], Value]) -> None:
        places_of = [count - count + c * lanes for c in range(channels)]
        totals = [Variable(carry.load(place, lanes) + above) for place in places_of]
        with ((count + (width - 1)) // width).times() as tile:
            vectors, goal = [], target + tile * (width * channels)
            for k in range(width):
                enters, leaves = (a.load(first + tile * width + k) for a in (places, leaving))
                for total, channel in zip(totals, places_of, strict=True):
                    total.set(total.get() + change(enters + channel, leaves + channel))
                    vectors.append(divide(total.get()).as_wide_as(lanes_of.bits))
                    if len(vectors) == width:
                        _store_tile(vectors, picture, goal, pitch)
                        vectors, goal = [], goal + width
        for place, total in zip(places_of, totals, strict=True):
            carry.store(place, total.get() - above)

    if carry.bits != 32:
        store_all(table.load(entry, lanes), whole)
        return
    with inverse.is_nothing() as (wide, narrow):
        with wide:
            store_all(table.load(entry, lanes), whole)
        with narrow:
            store_all(half.of_lanes(lanes, carry.bits), real)


@loop
def copy_line(
    target: Array, place: Value, source: Array, first: Value, count: Value, past: Value
) -> None:
    """target[place + k] = source[first + k], k < count; `past` 1: past the caches."""
    line, tile = (8 * size // target.bits for size in (LINE_BYTES, TILE_BYTES))

    def part(start: Value, end: Value, lanes: int, *, aligned: bool = False) -> Value:
        with ((end - start) // lanes).times() as n:
            k = start + n * lanes
            target.store(place + k, source.load(first + k, lanes), past_caches=aligned)
        return start + (end - start) // lanes * lanes

    # Whole cache lines in between, if there are any.
    head = (target.beyond_line(place) * past).at_most(count)
    start = part(part(count - count, head, tile), head, 1)
    with past.is_nothing() as (through, around):
        with through:
            part(start, count, line)
        with around:
            part(start, count, line, aligned=True)
    start = start + (count - start) // line * line
    part(part(start, count, tile), count, 1)


def _of_three_boxes(
    words: Array, enters: Value, leaves: Value, behind: Value, groups: int, lanes: int
) -> tuple[list[Value], list[Value]]:
    """Words that enter and leave S(t + M), S(t) and S(t - M), which are `behind` apart.

    In one group, B = M, what leaves a box enters the next.
    """
    entering = [words.load(enters + behind * n, lanes) for n in (1, 0, -1)]
    if groups == 1:
        return entering, [*entering[1:], words.load(leaves - behind, lanes)]
    return entering, [words.load(leaves + behind * n, lanes) for n in (1, 0, -1)]


@loop
def sharpened_start(
    words: Array,
    starts: Array,
    count: Value,
    margin: Value,
    behind: Value,
    pixel: Value,
    carry: Array,
    middle: Value,
    before: Value,
    after: Value,
    bias: Value,
    lanes_of: Array,
) -> None:
    """Set `carry` to a sharpened sum, from the pixels at `starts` and a lens beside them."""
    lanes = lanes_in_line(lanes_of)
    with (pixel // lanes).times() as sample:
        channel = sample * lanes
        total = Variable((count - count).of_lanes(lanes, carry.bits))
        with count.times() as n:
            place = starts.load(n) * pixel + margin + channel
            here, one, other = (
                words.load(at, lanes).as_wide_as(carry.bits)
                for at in (place, place - behind, place + behind)
            )
            total.set(total.get() + (here * middle - one * before - other * after))
        carry.store(channel, total.get() - bias)


@loop
def sharpened_sums(
    words: Array,
    places: Array,
    leaving: Array,
    ends: Array,
    several: Value,
    first: Value,
    count: Value,
    behind: Value,
    groups: int,
    pixel: Value,
    carry: Array,
    centre: Value,
    before: Value,
    after: Value,
    bias: Value,
    drop: Value,
    totals: Array,
    lanes_of: Array,
) -> None:
    """Sums of `running_sum`, sharpened: totals[r pixel ...] = max(0, sum >> drop), signed."""
    # A sum is centre S(t) - before S(t - M) - after S(t + M), and the pixels of S(t + M) lie
    # `behind` after those of S(t): so one running sum makes it. `bias`, a multiple of 2^drop, is
    # the largest magnitude of a negative one.
    floor = bias >> drop

    def change(enters: Value, leaves: Value) -> Value:
        three = _of_three_boxes(words, enters, leaves, behind, groups, lanes_in_line(lanes_of))
        next_, here, last = (
            one.as_wide_as(carry.bits) - other.as_wide_as(carry.bits)
            for one, other in zip(*three, strict=True)
        )
        return here * centre - (next_ * after + last * before)

    def use(place: Value, total: Value) -> None:
        totals.store(place, ((total + bias) >> drop).beyond(floor))

    lanes = lanes_in_line(lanes_of)
    moving = _Moving(places, leaving, ends, several, first, count, pixel, carry, lanes)
    _moving(moving, change, use)


@loop
def sharpened_quotients(
    words: Array,
    places: Array,
    leaving: Array,
    first: Value,
    count: Value,
    behind: Value,
    groups: int,
    pixel: Value,
    carry: Array,
    centre: Value,
    bias: Value,
    drop: Value,
    floor: Value,
    most: Value,
    multiplier: Array,
    rest: Value,
    values: Array,
    target: Value,
) -> None:
    """Sums of `sharpened_sums`, divided: min(most, max(0, n - floor)) multiplier / 2^16 >> rest.

    n = (sum + bias) >> drop. For words of 16 bits, and a side of 1.
    """
    # Two neighbouring words are taken as one number of 32 bits. A running sum of those, and one of
    # their upper words, together have the sums of both, and nothing is widened by a shuffle.
    lanes = lanes_in_line(words)
    with (pixel // lanes).times() as sample:
        channel = sample * lanes
        start = carry.load(channel, lanes) + bias
        upper = Variable(start.every_other(1))
        both = Variable(start.every_other(0) + (upper.get() << 16))
        with count.times() as r:
            enters, leaves = (a.load(first + r) + channel for a in (places, leaving))
            three = _of_three_boxes(words, enters, leaves, behind, groups, lanes)
            for total, drop_lower in ((both, 0), (upper, 16)):
                next_, here, last = (
                    (one.in_lanes_of(32) >> drop_lower) - (other.in_lanes_of(32) >> drop_lower)
                    for one, other in zip(*three, strict=True)
                )
                total.set(total.get() + (here * centre - (next_ + last)))
            lower = both.get() - (upper.get() << 16)
            dropped = (lower >> drop).lowest(1 << 16) | (upper.get() >> drop << 16)
            number = dropped.in_lanes_of(16).beyond(floor).at_most(most)
            # From memory: LLVM knows then that the multiplier is no wider than that.
            quotient = number.upper_product(multiplier.load(count - count, lanes)) >> rest
            values.store(target + r * pixel + channel, quotient)
        lower = both.get() - (upper.get() << 16)
        carry.store(channel, lower.in_turns_with(upper.get()) - bias)
