# SPDX-License-Identifier: Apache-2.0
"""Steps of the fast refocuser with explicit vectors, where numba does not vectorise by itself.

A vector of `LINE_BYTES` holds one sample of several lines.
"""

from collections.abc import Callable, Sequence
from functools import reduce
from operator import or_

from llvmlite import ir

from plenofir.refocus.vector_code import (
    LINE_BYTES,
    TILE_BYTES,
    Array,
    Value,
    Variable,
    generated,
    join_vectors,
    lanes_in_line,
    transposed,
    transposed_pieces,
)

AHEAD_BYTES = 1024
"""How far ahead in its line a pixel is asked for."""


@generated
def take_number(counter: Array, taken: Array) -> None:
    """taken[0] = counter[0], which becomes the next; each number is taken by one thread."""
    builder = counter.builder
    number = builder.atomic_rmw("add", counter.data, ir.Constant(ir.IntType(64), 1), "seq_cst")
    taken.store(Value(builder, ir.Constant(ir.IntType(64), 0)), Value(builder, number))


@generated
def sum_lines(
    x: Array,
    lines: Array,
    begin: Value,
    middle: Value,
    end: Value,
    left: Value,
    sums: Array,
    base: Value,
    target: Value,
    count: Value,
) -> None:
    """sums[target + k] = sums[base + k] + lines that enter - lines that leave, k < count."""
    # Lines enter at x[left + lines[begin .. middle - 1] + k], leave at those of middle .. end - 1.
    done = count - count
    most = 8 * LINE_BYTES // x.bits
    for lanes in (most, 8, 1):
        with ((count - done) // lanes).times() as n:
            k = done + n * lanes
            total = Variable(sums.load(base + k, lanes))
            with (middle - begin).times() as i:
                place = lines.load(begin + i) + left + k
                if lanes == most:
                    x.prefetch(place + 8 * AHEAD_BYTES // x.bits)
                total.set(total.get() + x.load(place, lanes).as_wide_as(sums.bits))
            with (end - middle).times() as i:
                place = lines.load(middle + i) + left + k
                total.set(total.get() - x.load(place, lanes).as_wide_as(sums.bits))
            sums.store(target + k, total.get())
        done = done + (count - done) // lanes * lanes


@generated
def next_line(
    x: Array,
    enters: Value,
    leaves: Value,
    ahead: Value,
    sums: Array,
    base: Value,
    target: Value,
    count: Value,
) -> None:
    """As `sum_lines` for one entering and one leaving line; prefetches those at `ahead`."""
    done = count - count
    most = 8 * LINE_BYTES // x.bits
    for lanes in (most, 8, 1):
        with ((count - done) // lanes).times() as n:
            k = done + n * lanes
            if lanes == most:
                x.prefetch(ahead + k)
            change = x.load(enters + k, lanes).as_wide_as(sums.bits)
            change = change - x.load(leaves + k, lanes).as_wide_as(sums.bits)
            sums.store(target + k, sums.load(base + k, lanes) + change)
        done = done + (count - done) // lanes * lanes


@generated
def next_words(
    x: Array,
    found: Array,
    coming: Array,
    left: Value,
    sums: Array,
    state: Value,
    span: Value,
    order: Value,
    centre: Value,
    side: Value,
    tiles: Value,
    words: Array,
) -> None:
    """Sums for as many lines as lanes, then `transpose`, in registers.

    For nearest neighbour, linear interpolation (order 1), or sharpened nearest neighbour.
    """
    # With line l of position p x[left + found[2 (p lanes + l)] ...] enters, and that of the next
    # number leaves, which enters at the next position. sums[state + p span ...] becomes the last
    # sum of each, and behind them that of their moving sum. It asks for what is at coming[l].
    # Samples: twice as many a tile as lanes.
    lanes, size = lanes_in_line(words), 2 * 8 * TILE_BYTES // words.bits

    def loop(positions: int, result: Callable[[list[Variable]], Value], kept: int = 0) -> None:
        with tiles.times() as tile:
            for half in range(2):
                k = tile * (2 * lanes) + half * lanes
                states = [state + span * n + k for n in range(positions + kept)]
                totals = [Variable(sums.load(place, lanes)) for place in states]
                with (tiles - tiles + lanes // size).times() as group:
                    rows = []
                    for line in range(size):
                        number = group * size + line
                        if half == 0:
                            x.prefetch(coming.load(number) + left + k)
                        own = number * 2
                        places = [own, *(own + (2 * lanes * p + 1) for p in range(positions))]
                        pixels = [
                            x.load(found.load(place) + left + k, lanes).as_wide_as(sums.bits)
                            for place in places
                        ]
                        for p in range(positions):
                            totals[p].set(totals[p].get() + (pixels[p] - pixels[p + 1]))
                        rows.append(result(totals))
                    for sample, piece in transposed_pieces(rows):
                        words.store((k + sample) * lanes + group * size, piece)
                for place, total in zip(states, totals, strict=True):
                    sums.store(place, total.get())

    def box(totals: list[Variable]) -> Value:
        totals[2].set(totals[2].get() + (totals[0].get() - totals[1].get()))
        return totals[2].get()

    def sharp(totals: list[Variable]) -> Value:
        around = totals[0].get() + totals[2].get()
        return totals[1].get() * centre.as_wide_as(sums.bits) - around * side.as_wide_as(sums.bits)

    with side.is_nothing() as (plain, sharpened):
        with plain, order.is_nothing() as (nearest, linear):
            with nearest:
                loop(1, lambda totals: totals[0].get())
            with linear:
                loop(2, box, 1)
        with sharpened:
            loop(3, sharp)


@generated
def transpose(
    lines: Array, place: Value, pitch: Value, words: Array, target: Value, count: Value
) -> None:
    """words[target + k lanes + l] = lines[place + l pitch + k], for as many lines as lanes."""
    # Samples k = 0 .. count - 1, rounded up to whole tiles.
    size, lanes = 8 * TILE_BYTES // lines.bits, lanes_in_line(words)
    with ((count + (size - 1)) // size).times() as tile:
        first = place + tile * size
        rows = [
            join_vectors([lines.load(first + pitch * (i + n), size) for n in range(0, lanes, size)])
            for i in range(size)
        ]
        for j, vector in enumerate(transposed(rows)):
            words.store(target + tile * (size * lanes) + j * lanes, vector)


def _moving(
    words: Array,
    places: Array,
    ends: Array,
    first: Value,
    count: Value,
    behind: Value,
    pixel: Value,
    carry: Array,
    lanes_of: Array,
    use: Callable[[Value, Value], None],
) -> None:
    """Running sums of several lines at once; `use` is called with r pixel and sum number r."""
    # Sum r adds words[place ...] and subtracts words[place - behind ...] for the places with the
    # numbers ends[first + r] to ends[first + r + 1] - 1, or without `ends` for number first + r;
    # each sample of a pixel has its own sum. `carry` has the sum before the first, and afterwards
    # the last one.
    lanes = lanes_in_line(lanes_of)

    def take(total: Variable, place: Value) -> None:
        change = words.load(place, lanes) - words.load(place - behind, lanes)
        total.set(total.get() + change.as_wide_as(carry.bits, signed=True))

    with (pixel // lanes).times() as sample:
        channel = sample * lanes
        total = Variable(carry.load(channel, lanes))
        with ends.size().is_nothing() as (one_each, several):
            with one_each, count.times() as r:
                take(total, places.load(first + r) + channel)
                use(r * pixel + channel, total.get())
            with several, count.times() as r:
                begin = ends.load(first + r)
                with (ends.load(first + r + 1) - begin).times() as i:
                    take(total, places.load(begin + i) + channel)
                use(r * pixel + channel, total.get())
        carry.store(channel, total.get())


def _factors(table: Array, entry: Value, lanes: int, *numbers: int) -> Sequence[Value]:
    """The requested ones of half (0), scale (1) and multiplier (2), from table[entry] on."""
    return [table.load(entry + lanes * k, lanes) for k in numbers]


def _quotient(total: Value, factors: Sequence[Value], drop: Value, most: Value) -> Value:
    """min(most, ((total + half) scale multiplier) >> drop)."""
    half, scale, multiplier = factors
    quotient = ((total + half) * scale).upper_product(multiplier) >> (drop - total.bits)
    return quotient.at_most(most) if total.bits > 16 else quotient


@generated
def running_sum(
    words: Array,
    places: Array,
    ends: Array,
    first: Value,
    count: Value,
    behind: Value,
    totals: Array,
    target: Value,
    pixel: Value,
    carry: Array,
    lanes_of: Array,
) -> None:
    """totals[target + r pixel ...], r = 0 .. count - 1, as `_moving` has them."""
    _moving(
        *(words, places, ends, first, count, behind, pixel, carry, lanes_of),
        lambda place, total: totals.store(target + place, total),
    )


@generated
def quotients(
    words: Array,
    places: Array,
    ends: Array,
    first: Value,
    count: Value,
    behind: Value,
    values: Array,
    pixel: Value,
    carry: Array,
    index: Array,
    alike: Value,
    table: Array,
    drop: Value,
    most: Value,
) -> None:
    """As `running_sum`, each divided as `divide` does: values[r pixel ...]."""
    lanes = lanes_in_line(values)
    samples = first * (pixel // lanes)
    moving = words, places, ends, first, count, behind, pixel, carry, values

    def store(place: Value, total: Value, factors: Sequence[Value]) -> None:
        quotient = _quotient(total, factors, drop, most)
        values.store(place, quotient.as_wide_as(values.bits))

    with alike.is_nothing() as (different, all_alike):
        with different:

            def own(place: Value, total: Value) -> None:
                entry = index.load(samples + place // lanes)
                store(place, total, _factors(table, entry, lanes, 0, 1, 2))

            _moving(*moving, own)
        with all_alike:
            entry = index.load(samples)
            known = _factors(table, entry, lanes, 0, 1)

            def same(place: Value, total: Value) -> None:
                # Loaded from memory, so that LLVM knows the multiplier's width.
                store(place, total, [*known, *_factors(table, entry, lanes, 2)])

            _moving(*moving, same)


@generated
def divide(
    totals: Array,
    place: Value,
    values: Array,
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
        values.store(n * lanes, quotient.as_wide_as(values.bits))


@generated
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
        taken = [values.load(index.load(first_here + i) - base, lanes) for i in range(width)]
        _store_tile(taken, picture, target + tile * width, pitch)


def _tile_samples(picture: Array) -> int:
    """Samples of a line that are transposed back in one go."""
    return int(2 * 8 * TILE_BYTES // picture.bits)


def _store_tile(taken: Sequence[Value], picture: Array, target: Value, pitch: Value) -> None:
    """Transpose vectors of values back: lane l of number k to picture[target + l pitch + k]."""
    together = taken[0].bits // picture.bits
    rows = [
        reduce(or_, (taken[i + j] << (picture.bits * j) for j in range(together)))
        for i in range(0, len(taken), together)
    ]
    for line, piece in transposed_pieces(rows):
        picture.store(target + pitch * line, piece)


@generated
def finished_lines(
    words: Array,
    places: Array,
    first: Value,
    count: Value,
    behind: Value,
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
    """As `running_sum` with one place each, divided, then `transpose_back`, in registers."""
    # Pixels first .. first + count - 1, rounded up to whole tiles. The quotient of a sum is
    # min(most, ((sum + half) multiplier / 2^bits) >> drop): sums are kept with half. `inverse`: the
    # bits of a real number, if not 0, with which it is (sum + half) inverse.
    lanes, width = lanes_in_line(lanes_of), _tile_samples(picture)
    shift = drop.as_wide_as(carry.bits)

    def whole(total: Value) -> Value:
        # The multiplier from memory: LLVM knows then that it is no wider than that.
        quotient = total.upper_product(table.load(entry + 2 * lanes, lanes)) >> shift
        return quotient.at_most(most) if carry.bits > 16 else quotient

    def real(total: Value) -> Value:
        return total.times_real(inverse)

    def loop(channels: int, above: Value, divide: Callable[[Value], Value]) -> None:
        places_of = [count - count + c * lanes for c in range(channels)]
        totals = [Variable(carry.load(place, lanes) + above) for place in places_of]
        with ((count + (width - 1)) // width).times() as tile:
            taken, goal = [], target + tile * (width * channels)
            for k in range(width):
                place = places.load(first + tile * width + k)
                for total, channel in zip(totals, places_of, strict=True):
                    here = place + channel
                    change = words.load(here, lanes) - words.load(here - behind, lanes)
                    total.set(total.get() + change.as_wide_as(carry.bits, signed=True))
                    taken.append(divide(total.get()).as_wide_as(lanes_of.bits))
                    if len(taken) == width:
                        _store_tile(taken, picture, goal, pitch)
                        taken, goal = [], goal + width
        for place, total in zip(places_of, totals, strict=True):
            carry.store(place, total.get() - above)

    def divided(channels: int) -> None:
        if carry.bits != 32:
            loop(channels, table.load(entry, lanes), whole)
            return
        with inverse.is_nothing() as (wide, narrow):
            with wide:
                loop(channels, table.load(entry, lanes), whole)
            with narrow:
                loop(channels, half.of_lanes(lanes, carry.bits), real)

    with (carry.size() - lanes).is_nothing() as (grey, colour):
        with grey:
            divided(1)
        with colour:
            divided(3)


@generated
def copy_line(
    target: Array, place: Value, source: Array, first: Value, count: Value, past: Value
) -> None:
    """target[place + k] = source[first + k], k < count; `past` 1: past the caches."""
    line, tile = (8 * size // target.bits for size in (LINE_BYTES, TILE_BYTES))

    def part(done: Value, end: Value, lanes: int, *, aligned: bool = False) -> Value:
        with ((end - done) // lanes).times() as n:
            k = done + n * lanes
            target.store(place + k, source.load(first + k, lanes), past_caches=aligned)
        return done + (end - done) // lanes * lanes

    # Whole cache lines in between, if there are any.
    head = (target.beyond_line(place) * past).at_most(count)
    done = part(part(count - count, head, tile), head, 1)
    with past.is_nothing() as (through, around):
        with through:
            part(done, count, line)
        with around:
            part(done, count, line, aligned=True)
    done = done + (count - done) // line * line
    part(part(done, count, tile), count, 1)


@generated
def three_lines(
    sums: Array,
    own: Value,
    before: Value,
    behind: Value,
    target: Value,
    count: Value,
    centre: Value,
    side: Value,
) -> None:
    """sums[target + k] = centre sums[own + k] - side (sums[before + k] + sums[behind + k])."""
    # For k = 0 .. count - 1, rounded up to whole vectors.
    lanes = lanes_in_line(sums)
    with ((count + (lanes - 1)) // lanes).times() as n:
        k = n * lanes
        around = sums.load(before + k, lanes) + sums.load(behind + k, lanes)
        sums.store(target + k, sums.load(own + k, lanes) * centre - around * side)


@generated
def sharpen(
    totals: Array,
    place: Value,
    before: Value,
    behind: Value,
    result: Array,
    target: Value,
    count: Value,
    lanes_of: Array,
    centre: Value,
    side: Value,
    bias: Value,
    drop: Value,
) -> None:
    """Sharpen `count` vectors: max(0, (centre own - side (before + behind)) >> drop), signed."""
    # `bias`, a multiple of 2^drop, is the largest magnitude of a negative difference.
    lanes = lanes_in_line(lanes_of)
    with count.times() as n:
        k = place + n * lanes
        around = totals.load(k - before, lanes) + totals.load(k + behind, lanes)
        total = totals.load(k, lanes) * centre - around * side + bias
        result.store(target + n * lanes, ((total >> drop) - (bias >> drop)).at_least_nothing())
