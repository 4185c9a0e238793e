# SPDX-License-Identifier: Apache-2.0
"""Steps of the fast refocuser in vectors, for numba: what its compiler does not find by itself.

They are written in LLVM's own vectors, which it breaks down to what the processor has: AVX-512,
AVX2, NEON. A vector of `LINE_BYTES` holds a sample of several lines.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import reduce
from inspect import Parameter, Signature, signature
from operator import or_
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

LINE_BYTES = 64
"""Bytes of a vector that holds a sample of several lines."""
TILE_BYTES = 16
"""Bytes that a transposition moves in one piece: the shortest vector there is."""
AHEAD_BYTES = 1024
"""How far ahead in its line a pixel is asked for."""


class _Value:
    """A number of the generated code, or a vector; a number meets a vector in each of its lanes."""

    def __init__(self, builder: Any, llvm: Any) -> None:
        self.builder, self.llvm = builder, llvm

    @property
    def lanes(self) -> int:
        return int(getattr(self.llvm.type, "count", 1))

    @property
    def bits(self) -> int:
        return int(getattr(self.llvm.type, "element", self.llvm.type).width)

    def of_lanes(self, lanes: int, bits: int) -> "_Value":
        """A number as a vector that has it everywhere."""
        one = self.as_wide_as(bits).llvm
        if lanes == 1:
            return _Value(self.builder, one)
        kind = ir.VectorType(one.type, lanes)
        nothing = ir.Constant(kind, ir.Undefined)
        first = self.builder.insert_element(nothing, one, ir.Constant(ir.IntType(32), 0))
        mask = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
        return _Value(self.builder, self.builder.shuffle_vector(first, nothing, mask))

    def as_wide_as(self, bits: int, *, signed: bool = False) -> "_Value":
        if bits == self.bits:
            return self
        kind: Any = ir.IntType(bits)
        if isinstance(self.llvm.type, ir.VectorType):
            kind = ir.VectorType(kind, self.lanes)
        widen = self.builder.sext if signed else self.builder.zext
        return _Value(
            self.builder, (widen if bits > self.bits else self.builder.trunc)(self.llvm, kind)
        )

    def _with(self, other: "_Value | int", step: Callable[[Any, Any], Any]) -> "_Value":
        if isinstance(other, int):
            kind = self.llvm.type
            vector = isinstance(kind, ir.VectorType)
            constant = ir.Constant(kind, [other] * self.lanes if vector else other)
        else:
            lone = self.lanes > 1 and other.lanes == 1
            constant = (other.of_lanes(self.lanes, self.bits) if lone else other).llvm
        return _Value(self.builder, step(self.llvm, constant))

    def __add__(self, other: "_Value | int") -> "_Value":
        return self._with(other, self.builder.add)

    def __sub__(self, other: "_Value | int") -> "_Value":
        return self._with(other, self.builder.sub)

    def __mul__(self, other: "_Value | int") -> "_Value":
        return self._with(other, self.builder.mul)

    def __floordiv__(self, other: int) -> "_Value":
        return self._with(other, self.builder.udiv)

    def __lshift__(self, other: "_Value | int") -> "_Value":
        return self._with(other, self.builder.shl)

    def __rshift__(self, other: "_Value | int") -> "_Value":
        return self._with(other, self.builder.lshr)

    def __or__(self, other: "_Value | int") -> "_Value":
        return self._with(other, self.builder.or_)

    def lowest(self, limit: int) -> "_Value":
        """Remainder of a division by a power of two."""
        return self._with(limit - 1, self.builder.and_)

    def upper_product(self, other: "_Value") -> "_Value":
        """Upper half of the product's bits."""
        bits = self.bits
        factor = other if other.lanes == self.lanes else other.of_lanes(self.lanes, bits)
        product = self.as_wide_as(2 * bits) * factor.as_wide_as(2 * bits)
        return (product >> bits).as_wide_as(bits)

    def at_most(self, other: "_Value") -> "_Value":
        limit = other.of_lanes(self.lanes, self.bits).llvm
        below = self.builder.icmp_unsigned("<", self.llvm, limit)
        return _Value(self.builder, self.builder.select(below, self.llvm, limit))

    def at_least_nothing(self) -> "_Value":
        nothing = ir.Constant(self.llvm.type, [0] * self.lanes)
        above = self.builder.icmp_signed(">", self.llvm, nothing)
        return _Value(self.builder, self.builder.select(above, self.llvm, nothing))

    @contextmanager
    def times(self) -> "Iterator[_Value]":
        """Loop this many times."""
        with cgutils.for_range(self.builder, self.llvm) as loop:
            yield _Value(self.builder, loop.index)

    def is_nothing(self) -> Any:
        """Two branches: it is 0, or not."""
        nothing = ir.Constant(self.llvm.type, 0)
        return self.builder.if_else(self.builder.icmp_signed("==", self.llvm, nothing))


class _Variable:
    """What changes in a loop."""

    def __init__(self, value: _Value) -> None:
        self.builder = value.builder
        self.place = cgutils.alloca_once(value.builder, value.llvm.type)  # type: ignore[no-untyped-call]
        self.set(value)

    def set(self, value: _Value) -> None:
        self.builder.store(value.llvm, self.place)

    def get(self) -> _Value:
        return _Value(self.builder, self.builder.load(self.place))


class _Array:
    """A contiguous array of numbers, by places counted from its first."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self.builder, self.bits = builder, kind.dtype.bitwidth
        array = context.make_array(kind)(context, builder, value)
        self.data, self._size = array.data, array.nitems

    def size(self) -> _Value:
        """How many numbers."""
        return _Value(self.builder, self._size)

    def _pointer(self, place: _Value, lanes: int, bits: int) -> Any:
        kind: Any = ir.IntType(bits)
        kind = ir.VectorType(kind, lanes) if lanes > 1 else kind
        pointer = self.builder.gep(self.data, [place.llvm])
        return self.builder.bitcast(pointer, kind.as_pointer())

    def load(self, place: _Value, lanes: int = 1) -> _Value:
        value = self.builder.load(self._pointer(place, lanes, self.bits))
        value.align = self.bits // 8
        return _Value(self.builder, value)

    def store(self, place: _Value, value: _Value, *, past_caches: bool = False) -> None:
        """`past_caches`: a whole line of a cache, which is not wanted there."""
        pointer = self._pointer(place, value.lanes, value.bits)
        stored = self.builder.store(value.llvm, pointer)
        stored.align = LINE_BYTES if past_caches else self.bits // 8
        if past_caches:
            mark = self.builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)])
            stored.set_metadata("nontemporal", mark)

    def beyond_line(self, place: _Value) -> _Value:
        """Numbers from there to where the next line of a cache begins."""
        pointer = self._pointer(place, 1, self.bits)
        address = _Value(self.builder, self.builder.ptrtoint(pointer, ir.IntType(64)))
        before = self.builder.neg(address.llvm)
        return _Value(self.builder, before).lowest(LINE_BYTES) // int(self.bits // 8)

    def prefetch(self, place: _Value) -> None:
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        ask = self.builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
        pointer = self.builder.bitcast(self.builder.gep(self.data, [place.llvm]), byte)
        self.builder.call(ask, [pointer, number(0), number(2), number(1)])


def _generated(write: Callable[..., None]) -> Callable[..., Any]:
    """Function whose code is generated for the types of the arrays that it is called with."""

    def typing(_: Any, *kinds: Any) -> Any:
        taken = [kind if isinstance(kind, types.Array) else types.int64 for kind in kinds]

        def generate(context: Any, builder: Any, made: Any, arguments: Any) -> Any:
            given = [
                _Array(context, builder, kind, value)
                if isinstance(kind, types.Array)
                else _Value(builder, value)
                for kind, value in zip(made.args, arguments, strict=True)
            ]
            write(*given)
            return context.get_dummy_value()

        return types.void(*taken), generate

    typing.__name__ = write.__name__
    names = ["context", *signature(write).parameters]
    # numba asks for the arguments' names.
    typing.__signature__ = Signature(  # type: ignore[attr-defined]
        [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    )
    return intrinsic(typing)


def _lanes(array: _Array) -> int:
    return int(8 * LINE_BYTES // array.bits)


def _joined(vectors: Sequence[_Value]) -> _Value:
    """One vector of several, in their order."""
    builder, joined = vectors[0].builder, [vector.llvm for vector in vectors]
    while len(joined) > 1:
        lanes = 2 * joined[0].type.count
        mask = ir.Constant(ir.VectorType(ir.IntType(32), lanes), list(range(lanes)))
        joined = [
            builder.shuffle_vector(a, b, mask)
            for a, b in zip(joined[::2], joined[1::2], strict=True)
        ]
    return _Value(builder, joined[0])


def _transposed(vectors: list[_Value]) -> list[_Value]:
    """Transpose the squares that stand side by side in as many vectors as a square has lines."""
    builder, size, lanes = vectors[0].builder, len(vectors), vectors[0].lanes
    masks = [
        ir.Constant(
            ir.VectorType(ir.IntType(32), lanes),
            [
                square + half + k // 2 + lanes * (k % 2)
                for square in range(0, lanes, size)
                for k in range(size)
            ],
        )
        for half in (0, size // 2)
    ]
    lines = [vector.llvm for vector in vectors]
    # Shuffling each line with the one half the square below, log2 times, transposes.
    for _ in range(size.bit_length() - 1):
        lines = [
            builder.shuffle_vector(lines[n], lines[n + size // 2], mask)
            for n in range(size // 2)
            for mask in masks
        ]
    return [_Value(builder, line) for line in lines]


@_generated
def sum_lines(
    x: _Array,
    lines: _Array,
    begin: _Value,
    middle: _Value,
    end: _Value,
    left: _Value,
    sums: _Array,
    base: _Value,
    target: _Value,
    count: _Value,
) -> None:
    """sums[target + k] = sums[base + k] + lines that enter - lines that leave, k < count."""
    # Lines enter at x[left + lines[begin .. middle - 1] + k], leave at those of middle .. end - 1.
    done = count - count
    most = 8 * LINE_BYTES // x.bits
    for lanes in (most, 8, 1):
        with ((count - done) // lanes).times() as n:
            k = done + n * lanes
            total = _Variable(sums.load(base + k, lanes))
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


@_generated
def next_line(
    x: _Array,
    enters: _Value,
    leaves: _Value,
    ahead: _Value,
    sums: _Array,
    base: _Value,
    target: _Value,
    count: _Value,
) -> None:
    """As `sum_lines` where one line enters and one leaves; asks for those at `ahead`."""
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


@_generated
def transpose(
    lines: _Array, place: _Value, pitch: _Value, words: _Array, target: _Value, count: _Value
) -> None:
    """words[target + k lanes + l] = lines[place + l pitch + k], for as many lines as lanes."""
    # Samples k = 0 .. count - 1, rounded up to whole tiles.
    size, lanes = 8 * TILE_BYTES // lines.bits, _lanes(words)
    with ((count + (size - 1)) // size).times() as tile:
        first = place + tile * size
        rows = [
            _joined([lines.load(first + pitch * (i + n), size) for n in range(0, lanes, size)])
            for i in range(size)
        ]
        for j, vector in enumerate(_transposed(rows)):
            words.store(target + tile * (size * lanes) + j * lanes, vector)


def _moving(
    words: _Array,
    places: _Array,
    ends: _Array,
    first: _Value,
    count: _Value,
    behind: _Value,
    pixel: _Value,
    carry: _Array,
    lanes_of: _Array,
    use: Callable[[_Value, _Value], None],
) -> None:
    """Running sums of several lines at once, number r at r pixel; `use` takes that and the sum."""
    # Each adds words[place ...] and subtracts words[place - behind ...] for the places number
    # ends[first + r] to ends[first + r + 1] - 1, or without `ends` for that number first + r; all
    # samples of a pixel on their own. The sum before the first is in `carry`, as is the last one
    # afterwards.
    lanes = _lanes(lanes_of)

    def take(total: _Variable, place: _Value) -> None:
        change = words.load(place, lanes) - words.load(place - behind, lanes)
        total.set(total.get() + change.as_wide_as(carry.bits, signed=True))

    with (pixel // lanes).times() as sample:
        channel = sample * lanes
        total = _Variable(carry.load(channel, lanes))
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


def _factors(table: _Array, entry: _Value, lanes: int, *numbers: int) -> Sequence[_Value]:
    """Of half (0), scale (1) and multiplier (2) those asked for, from table[entry] on."""
    return [table.load(entry + lanes * k, lanes) for k in numbers]


def _quotient(total: _Value, factors: Sequence[_Value], drop: _Value, most: _Value) -> _Value:
    """min(most, ((total + half) scale multiplier) >> drop)."""
    half, scale, multiplier = factors
    quotient = ((total + half) * scale).upper_product(multiplier) >> (drop - total.bits)
    return quotient.at_most(most) if total.bits > 16 else quotient


@_generated
def running_sum(
    words: _Array,
    places: _Array,
    ends: _Array,
    first: _Value,
    count: _Value,
    behind: _Value,
    totals: _Array,
    target: _Value,
    pixel: _Value,
    carry: _Array,
    lanes_of: _Array,
) -> None:
    """totals[target + r pixel ...], r = 0 .. count - 1, as `_moving` has them."""
    _moving(
        *(words, places, ends, first, count, behind, pixel, carry, lanes_of),
        lambda place, total: totals.store(target + place, total),
    )


@_generated
def quotients(
    words: _Array,
    places: _Array,
    ends: _Array,
    first: _Value,
    count: _Value,
    behind: _Value,
    values: _Array,
    pixel: _Value,
    carry: _Array,
    index: _Array,
    alike: _Value,
    table: _Array,
    drop: _Value,
    most: _Value,
) -> None:
    """As `running_sum`, each divided as `divide` does: values[r pixel ...]."""
    lanes = _lanes(values)
    samples = first * (pixel // lanes)
    moving = words, places, ends, first, count, behind, pixel, carry, values

    def store(place: _Value, total: _Value, factors: Sequence[_Value]) -> None:
        quotient = _quotient(total, factors, drop, most)
        values.store(place, quotient.as_wide_as(values.bits))

    with alike.is_nothing() as (different, all_alike):
        with different:

            def own(place: _Value, total: _Value) -> None:
                entry = index.load(samples + place // lanes)
                store(place, total, _factors(table, entry, lanes, 0, 1, 2))

            _moving(*moving, own)
        with all_alike:
            entry = index.load(samples)
            known = _factors(table, entry, lanes, 0, 1)

            def same(place: _Value, total: _Value) -> None:
                # The multiplier from memory: LLVM knows then that it is no wider than that.
                store(place, total, [*known, *_factors(table, entry, lanes, 2)])

            _moving(*moving, same)


@_generated
def divide(
    totals: _Array,
    place: _Value,
    values: _Array,
    count: _Value,
    index: _Array,
    first: _Value,
    table: _Array,
    drop: _Value,
    most: _Value,
) -> None:
    """`count` vectors of min(most, ((totals[place ...] + half) scale multiplier) >> drop)."""
    # Vector n has half, scale and multiplier from table[index[first + n]] on.
    lanes = _lanes(values)
    with count.times() as n:
        total = totals.load(place + n * lanes, lanes)
        factors = _factors(table, index.load(first + n), lanes, 0, 1, 2)
        quotient = _quotient(total, factors, drop, most)
        values.store(n * lanes, quotient.as_wide_as(values.bits))


@_generated
def transpose_back(
    values: _Array,
    index: _Array,
    first: _Value,
    base: _Value,
    picture: _Array,
    target: _Value,
    pitch: _Value,
    count: _Value,
) -> None:
    """picture[target + l pitch + k] = values[index[first + k] - base + l], k < count, lanes l."""
    # Rounded up to whole tiles.
    lanes, size = _lanes(values), 8 * TILE_BYTES // values.bits
    together = values.bits // picture.bits
    width = size * together
    with ((count + (width - 1)) // width).times() as tile:
        rows = []
        for i in range(0, width, together):
            parts = [
                values.load(index.load(first + tile * width + (i + j)) - base, lanes)
                << (picture.bits * j)
                for j in range(together)
            ]
            rows.append(reduce(or_, parts))
        for i, vector in enumerate(_transposed(rows)):
            for n in range(0, lanes, size):
                mask = ir.Constant(ir.VectorType(ir.IntType(32), size), list(range(n, n + size)))
                part = vector.builder.shuffle_vector(vector.llvm, vector.llvm, mask)
                picture.store(target + pitch * (i + n) + tile * width, _Value(vector.builder, part))


@_generated
def copy_line(
    target: _Array, place: _Value, source: _Array, first: _Value, count: _Value, past: _Value
) -> None:
    """target[place + k] = source[first + k], k < count; `past` 1: past the caches."""
    line, tile = (8 * size // target.bits for size in (LINE_BYTES, TILE_BYTES))

    def part(done: _Value, end: _Value, lanes: int, *, aligned: bool = False) -> _Value:
        with ((end - done) // lanes).times() as n:
            k = done + n * lanes
            target.store(place + k, source.load(first + k, lanes), past_caches=aligned)
        return done + (end - done) // lanes * lanes

    # Whole lines of the cache in between, if there are any.
    head = (target.beyond_line(place) * past).at_most(count)
    done = part(part(count - count, head, tile), head, 1)
    with past.is_nothing() as (through, around):
        with through:
            part(done, count, line)
        with around:
            part(done, count, line, aligned=True)
    done = done + (count - done) // line * line
    part(part(done, count, tile), count, 1)


@_generated
def three_lines(
    sums: _Array,
    own: _Value,
    before: _Value,
    behind: _Value,
    target: _Value,
    count: _Value,
    centre: _Value,
    side: _Value,
) -> None:
    """sums[target + k] = centre sums[own + k] - side (sums[before + k] + sums[behind + k])."""
    # For k = 0 .. count - 1, rounded up to whole vectors.
    lanes = _lanes(sums)
    with ((count + (lanes - 1)) // lanes).times() as n:
        k = n * lanes
        around = sums.load(before + k, lanes) + sums.load(behind + k, lanes)
        sums.store(target + k, sums.load(own + k, lanes) * centre - around * side)


@_generated
def sharpen(
    totals: _Array,
    place: _Value,
    before: _Value,
    behind: _Value,
    result: _Array,
    target: _Value,
    count: _Value,
    lanes_of: _Array,
    centre: _Value,
    side: _Value,
    bias: _Value,
    drop: _Value,
) -> None:
    """Sharpen `count` vectors: max(0, (centre own - side (before + behind)) >> drop), with sign."""
    # `bias`, a multiple of 2^drop, is as much as the difference may be below 0.
    lanes = _lanes(lanes_of)
    with count.times() as n:
        k = place + n * lanes
        around = totals.load(k - before, lanes) + totals.load(k + behind, lanes)
        total = totals.load(k, lanes) * centre - around * side + bias
        result.store(target + n * lanes, ((total >> drop) - (bias >> drop)).at_least_nothing())
