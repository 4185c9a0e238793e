# SPDX-License-Identifier: Apache-2.0
"""Generates LLVM code with vector types, by way of values, variables and arrays.

LLVM maps the vectors to those of the processor: AVX-512, AVX2, NEON.
`plenofir.refocus.compiled.machine_code` compiles it.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from llvmlite import ir
from numba.core import cgutils

LINE_BYTES = 64
"""Bytes of a vector that holds a sample of several lines."""
TILE_BYTES = 16
"""Bytes that a transposition moves in one piece: the shortest vector there is."""


class Value:
    """A number or vector in the generated code; numbers are broadcast to vectors."""

    def __init__(self, builder: Any, llvm: Any) -> None:
        self.builder, self.llvm = builder, llvm

    @property
    def lanes(self) -> int:
        """Lanes of a vector; 1 for a number."""
        return int(getattr(self.llvm.type, "count", 1))

    @property
    def bits(self) -> int:
        """Bits of a lane."""
        return int(getattr(self.llvm.type, "element", self.llvm.type).width)

    def of_lanes(self, lanes: int, bits: int) -> "Value":
        """A vector with the number in all lanes."""
        one = self.as_wide_as(bits).llvm
        if lanes == 1:
            return Value(self.builder, one)
        kind = ir.VectorType(one.type, lanes)
        nothing = ir.Constant(kind, ir.Undefined)
        first = self.builder.insert_element(nothing, one, ir.Constant(ir.IntType(32), 0))
        mask = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
        return Value(self.builder, self.builder.shuffle_vector(first, nothing, mask))

    def parts(self, lanes: int) -> "list[Value]":
        """Vectors of so many neighbouring lanes each."""
        kind = ir.VectorType(ir.IntType(32), lanes)
        masks = [list(range(n, n + lanes)) for n in range(0, self.lanes, lanes)]
        shuffle = self.builder.shuffle_vector
        return [
            Value(self.builder, shuffle(self.llvm, self.llvm, ir.Constant(kind, mask)))
            for mask in masks
        ]

    def as_wide_as(self, bits: int, *, signed: bool = False) -> "Value":
        """Lanes extended or truncated to a number of bits."""
        if bits == self.bits:
            return self
        kind: Any = ir.IntType(bits)
        if isinstance(self.llvm.type, ir.VectorType):
            kind = ir.VectorType(kind, self.lanes)
        widen = self.builder.sext if signed else self.builder.zext
        return Value(
            self.builder, (widen if bits > self.bits else self.builder.trunc)(self.llvm, kind)
        )

    def _with(self, other: "Value | int", step: Callable[[Any, Any], Any]) -> "Value":
        if isinstance(other, int):
            kind = self.llvm.type
            vector = isinstance(kind, ir.VectorType)
            constant = ir.Constant(kind, [other] * self.lanes if vector else other)
        else:
            lone = self.lanes > 1 and other.lanes == 1
            constant = (other.of_lanes(self.lanes, self.bits) if lone else other).llvm
        return Value(self.builder, step(self.llvm, constant))

    def __add__(self, other: "Value | int") -> "Value":
        """Sum of each lane."""
        return self._with(other, self.builder.add)

    def __sub__(self, other: "Value | int") -> "Value":
        """Difference of each lane."""
        return self._with(other, self.builder.sub)

    def __mul__(self, other: "Value | int") -> "Value":
        """Product of each lane, truncated to its bits."""
        return self._with(other, self.builder.mul)

    def __floordiv__(self, other: int) -> "Value":
        """Unsigned quotient of each lane."""
        return self._with(other, self.builder.udiv)

    def __lshift__(self, other: "Value | int") -> "Value":
        """Each lane shifted left."""
        return self._with(other, self.builder.shl)

    def __rshift__(self, other: "Value | int") -> "Value":
        """Each lane shifted right, filled with zeros."""
        return self._with(other, self.builder.lshr)

    def __or__(self, other: "Value | int") -> "Value":
        """Bitwise or of each lane."""
        return self._with(other, self.builder.or_)

    def lowest(self, limit: int) -> "Value":
        """Remainder of a division by a power of two."""
        return self._with(limit - 1, self.builder.and_)

    def upper_product(self, other: "Value") -> "Value":
        """Upper half of the product's bits."""
        bits = self.bits
        factor = other if other.lanes == self.lanes else other.of_lanes(self.lanes, bits)
        product = self.as_wide_as(2 * bits) * factor.as_wide_as(2 * bits)
        return (product >> bits).as_wide_as(bits)

    def times_real(self, factor: "Value") -> "Value":
        """Product with a number of 32 bit floating point, given by its bits, rounded down."""
        real: Any = ir.VectorType(ir.FloatType(), self.lanes)
        factors = self.builder.bitcast(factor.of_lanes(self.lanes, self.bits).llvm, real)
        product = self.builder.fmul(self.builder.sitofp(self.llvm, real), factors)
        return Value(self.builder, self.builder.fptosi(product, self.llvm.type))

    def at_most(self, other: "Value") -> "Value":
        """Unsigned minimum of each lane and a limit."""
        limit = other.of_lanes(self.lanes, self.bits).llvm
        below = self.builder.icmp_unsigned("<", self.llvm, limit)
        return Value(self.builder, self.builder.select(below, self.llvm, limit))

    def beyond(self, other: "Value") -> "Value":
        """How much each lane is more than a limit, unsigned; 0 if it is not."""
        limit = other.of_lanes(self.lanes, self.bits).llvm
        above = self.builder.icmp_unsigned(">", self.llvm, limit)
        more = self.builder.select(above, self.llvm, limit)
        return Value(self.builder, self.builder.sub(more, limit))

    def in_lanes_of(self, bits: int) -> "Value":
        """The same bits in wider or narrower lanes, the lowest first."""
        kind: Any = ir.VectorType(ir.IntType(bits), self.lanes * self.bits // bits)
        return Value(self.builder, self.builder.bitcast(self.llvm, kind))

    def every_other(self, first: int) -> "Value":
        """Lanes first, first + 2, ..."""
        mask = ir.Constant(
            ir.VectorType(ir.IntType(32), self.lanes // 2), list(range(first, self.lanes, 2))
        )
        return Value(self.builder, self.builder.shuffle_vector(self.llvm, self.llvm, mask))

    def in_turns_with(self, other: "Value") -> "Value":
        """Lanes of both, in turns."""
        order = [k for n in range(self.lanes) for k in (n, n + self.lanes)]
        mask = ir.Constant(ir.VectorType(ir.IntType(32), 2 * self.lanes), order)
        return Value(self.builder, self.builder.shuffle_vector(self.llvm, other.llvm, mask))

    @contextmanager
    def times(self) -> "Iterator[Value]":
        """Loop this many times."""
        with cgutils.for_range(self.builder, self.llvm) as loop:
            yield Value(self.builder, loop.index)

    def is_nothing(self) -> Any:
        """Branches for zero and for other values."""
        nothing = ir.Constant(self.llvm.type, 0)
        return self.builder.if_else(self.builder.icmp_signed("==", self.llvm, nothing))


class Variable:
    """A variable, which changes in a loop."""

    def __init__(self, value: Value) -> None:
        self.builder = value.builder
        self.place = cgutils.alloca_once(value.builder, value.llvm.type)  # type: ignore[no-untyped-call]
        self.set(value)

    def set(self, value: Value) -> None:
        """Set the variable."""
        self.builder.store(value.llvm, self.place)

    def get(self) -> Value:
        """Value of the variable."""
        return Value(self.builder, self.builder.load(self.place))


class Array:
    """Numbers one after the other in memory, from an address on."""

    def __init__(self, builder: Any, address: Any, bits: int) -> None:
        self.builder, self.bits = builder, bits
        self.data = builder.inttoptr(address, ir.IntType(bits).as_pointer())

    def _pointer(self, place: Value, lanes: int, bits: int) -> Any:
        kind: Any = ir.IntType(bits)
        kind = ir.VectorType(kind, lanes) if lanes > 1 else kind
        pointer = self.builder.gep(self.data, [place.llvm])
        return self.builder.bitcast(pointer, kind.as_pointer())

    def load(self, place: Value, lanes: int = 1) -> Value:
        """A vector of elements from an index on."""
        value = self.builder.load(self._pointer(place, lanes, self.bits))
        value.align = self.bits // 8
        return Value(self.builder, value)

    def store(self, place: Value, value: Value, *, past_caches: bool = False) -> None:
        """Store a vector; `past_caches`: a whole cache line, written without caching it."""
        pointer = self._pointer(place, value.lanes, value.bits)
        stored = self.builder.store(value.llvm, pointer)
        stored.align = LINE_BYTES if past_caches else self.bits // 8
        if past_caches:
            mark = self.builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)])
            stored.set_metadata("nontemporal", mark)

    def beyond_line(self, place: Value) -> Value:
        """Number of elements from an index to the next cache line."""
        pointer = self._pointer(place, 1, self.bits)
        address = Value(self.builder, self.builder.ptrtoint(pointer, ir.IntType(64)))
        before = self.builder.neg(address.llvm)
        return Value(self.builder, before).lowest(LINE_BYTES) // int(self.bits // 8)

    def prefetch(self, place: Value) -> None:
        """Prefetch the cache line of an index."""
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        ask = self.builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
        pointer = self.builder.bitcast(self.builder.gep(self.data, [place.llvm]), byte)
        self.builder.call(ask, [pointer, number(0), number(2), number(1)])


def lanes_in_line(array: Array) -> int:
    """Elements of an array in a cache line."""
    return int(8 * LINE_BYTES // array.bits)


def join_vectors(vectors: Sequence[Value]) -> Value:
    """Concatenate vectors."""
    builder, joined = vectors[0].builder, [vector.llvm for vector in vectors]
    while len(joined) > 1:
        lanes = 2 * joined[0].type.count
        mask = ir.Constant(ir.VectorType(ir.IntType(32), lanes), list(range(lanes)))
        joined = [
            builder.shuffle_vector(a, b, mask)
            for a, b in zip(joined[::2], joined[1::2], strict=True)
        ]
    return Value(builder, joined[0])


def transposed(vectors: list[Value]) -> list[Value]:
    """Transpose square blocks that lie side by side in as many vectors as a block has lines."""
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
    # Interleaving each line with the one half a block below, log2 times, transposes.
    for _ in range(size.bit_length() - 1):
        lines = [
            builder.shuffle_vector(lines[n], lines[n + size // 2], mask)
            for n in range(size // 2)
            for mask in masks
        ]
    return [Value(builder, line) for line in lines]


def transposed_pieces(vectors: list[Value]) -> Iterator[tuple[int, Value]]:
    """Transpose twice as many vectors as a square has lines: numbers of lines, with a piece each.

    A piece has a number of each vector, those of the first half first.
    """
    builder, size, lanes = vectors[0].builder, len(vectors) // 2, vectors[0].lanes
    squares = range(0, lanes, size)
    # Squares of both halves side by side, in two vectors.
    order = [
        first + k for square in squares for first in (square, square + lanes) for k in range(size)
    ]
    masks = [
        ir.Constant(ir.VectorType(ir.IntType(32), lanes), part)
        for part in (order[:lanes], order[lanes:])
    ]
    halves = (transposed(vectors[:size]), transposed(vectors[size:]))
    for line, (a, b) in enumerate(zip(*halves, strict=True)):
        both = [Value(builder, builder.shuffle_vector(a.llvm, b.llvm, mask)) for mask in masks]
        pieces = [piece for vector in both for piece in vector.parts(2 * size)]
        for square, piece in zip(squares, pieces, strict=True):
            yield line + square, piece
