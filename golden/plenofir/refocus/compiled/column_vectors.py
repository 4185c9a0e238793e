# SPDX-License-Identifier: Apache-2.0
"""Loops for sums of columns, with explicit vectors.

A vector of `LINE_BYTES` holds one sample of several lines.
"""

from collections.abc import Callable, Iterator

from plenofir.refocus.compiled.machine_code import loop
from plenofir.refocus.compiled.vector_code import (
    LINE_BYTES,
    TILE_BYTES,
    Array,
    Value,
    Variable,
    join_vectors,
    lanes_in_line,
    transposed,
    transposed_pieces,
)

AHEAD_BYTES = 1024
"""How far ahead in its line a pixel is asked for."""
# Samples that are summed together where a line has no whole vector left.
_FEW = 8


def _in_vectors(count: Value, most: int) -> Iterator[tuple[int, Value]]:
    """Lanes of each vector, and index of its first sample: the longest vectors, then what is left.

    Each is the body of a compiled loop.
    """
    start = count - count
    for lanes in (most, _FEW, 1):
        with ((count - start) // lanes).times() as n:
            yield lanes, start + n * lanes
        start = start + (count - start) // lanes * lanes


@loop
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
    most = 8 * LINE_BYTES // x.bits
    for lanes, k in _in_vectors(count, most):
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


@loop
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
    """Sums of `sum_lines` for one entering and one leaving line; prefetches those at `ahead`."""
    most = 8 * LINE_BYTES // x.bits
    for lanes, k in _in_vectors(count, most):
        if lanes == most:
            x.prefetch(ahead + k)
        change = x.load(enters + k, lanes).as_wide_as(sums.bits)
        change = change - x.load(leaves + k, lanes).as_wide_as(sums.bits)
        sums.store(target + k, sums.load(base + k, lanes) + change)


@loop
def next_words(
    x: Array,
    starts: Array,
    coming: Array,
    left: Value,
    sums: Array,
    state: Value,
    span: Value,
    groups: int,
    positions: int,
    centre: Value,
    side: Value,
    zero: Value,
    tiles: Value,
    words: Array,
    target: Value,
) -> None:
    """Sums for as many lines as lanes, then `transpose` to words[target ...], in registers.

    For nearest neighbour (one position), linear interpolation (two), or nearest neighbour,
    sharpened: three, in one group or in three groups.
    """
    # With line l of position p x[left + starts[2 (p lanes + l)] ...] enters, and that of the next
    # number leaves, which enters at the group's next position. sums[state + p span ...] becomes the
    # last sum of each, and behind them that of their moving sum. It asks for what is at coming[l].
    # Samples: twice as many a tile as lanes.
    lanes, size = lanes_in_line(words), 2 * 8 * TILE_BYTES // words.bits
    count = groups * positions

    def tiles_of(result: Callable[[list[Variable]], Value], kept: int = 0) -> None:
        with tiles.times() as tile:
            for half in range(2):
                k = tile * (2 * lanes) + half * lanes
                states = [state + span * n + k for n in range(count + kept)]
                totals = [Variable(sums.load(place, lanes)) for place in states]
                with (tiles - tiles + lanes // size).times() as group:
                    rows = []
                    for line in range(size):
                        number = group * size + line
                        if half == 0:
                            x.prefetch(coming.load(number) + left + k)
                        for p, total in enumerate(totals[:count]):
                            here = number * 2 + 2 * lanes * p
                            if p % positions == 0:
                                enters = pixel(here, k)
                            leaves = pixel(here + 1, k)
                            total.set(total.get() + (enters - leaves))
                            enters = leaves
                        rows.append(result(totals))
                    for sample, piece in transposed_pieces(rows):
                        words.store(target + (k + sample) * lanes + group * size, piece)
                for place, total in zip(states, totals, strict=True):
                    sums.store(place, total.get())

    def pixel(place: Value, k: Value) -> Value:
        return x.load(starts.load(place) + left + k, lanes).as_wide_as(sums.bits)

    def box(totals: list[Variable]) -> Value:
        totals[2].set(totals[2].get() + (totals[0].get() - totals[1].get()))
        return totals[2].get()

    def sharp(totals: list[Variable]) -> Value:
        around = totals[0].get() + totals[2].get()
        return totals[1].get() * centre - around * side + zero

    if count == 3:
        tiles_of(sharp)
    elif count == 2:
        tiles_of(box, 1)
    else:
        tiles_of(lambda totals: totals[0].get())


@loop
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


@loop
def three_lines(
    sums: Array,
    middle: Value,
    before: Value,
    behind: Value,
    target: Value,
    count: Value,
    centre: Value,
    side: Value,
    zero: Value,
) -> None:
    """Sharpened sums: sums[target + k], k = 0 .. count - 1, rounded up to whole vectors.

    They are centre sums[middle + k] - side (sums[before + k] + sums[behind + k]) + zero.
    """
    lanes = lanes_in_line(sums)
    with ((count + (lanes - 1)) // lanes).times() as n:
        k = n * lanes
        around = sums.load(before + k, lanes) + sums.load(behind + k, lanes)
        sums.store(target + k, sums.load(middle + k, lanes) * centre - around * side + zero)


@loop
def add_line(sums: Array, target: Value, source: Value, count: Value, negative: Value) -> None:
    """sums[target + k] += sums[source + k], k < count; `negative` 1: they are subtracted."""
    with negative.is_nothing() as (plus, minus):
        for branch, sign in ((plus, 1), (minus, -1)):
            with branch:
                start = count - count
                for lanes in (lanes_in_line(sums), 1):
                    with ((count - start) // lanes).times() as n:
                        k = start + n * lanes
                        change = sums.load(source + k, lanes)
                        total = sums.load(target + k, lanes)
                        sums.store(target + k, total + change if sign > 0 else total - change)
                    start = start + (count - start) // lanes * lanes


@loop
def fill(numbers: Array, first: Value, count: Value, number: Value) -> None:
    """numbers[first + k] = number, k < count."""
    with count.times() as k:
        numbers.store(first + k, number.as_wide_as(numbers.bits))


@loop
def narrow(numbers: Array, narrowed: Array, count: Value) -> None:
    """narrowed[k] = numbers[k], k < count, the lowest bits of each."""
    with count.times() as k:
        narrowed.store(k, numbers.load(k).as_wide_as(narrowed.bits))
