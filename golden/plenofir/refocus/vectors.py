"""Two steps of the fast refocuser in vectors, for numba: what its compiler does not find by itself.

Both are written in LLVM's own vectors, which it breaks down to what the processor has.
"""

from typing import Any

import numpy.typing as npt
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

Integers = npt.NDArray[Any]

LINE_BYTES = 64
"""Bytes of a vector that holds a pixel of several lines."""
TILE_BYTES = 16
"""Bytes of a line of a tile that is transposed at once."""


def _pointer(context: Any, builder: Any, kind: Any, array: Any, index: Any, vector: Any) -> Any:
    """Pointer to a vector that begins at an element of an array."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), vector.as_pointer())


def _load(builder: Any, pointer: Any, item_bytes: int) -> Any:
    value = builder.load(pointer)
    value.align = item_bytes
    return value


def _store(builder: Any, value: Any, pointer: Any, item_bytes: int) -> None:
    builder.store(value, pointer).align = item_bytes


@intrinsic
def step(
    typing: Any, sums: Any, target: Any, before: Any, words: Any, enters: Any, leaves: Any
) -> Any:
    """sums[target ...] = sums[before ...] + words[enters ...] - words[leaves ...].

    A vector of `LINE_BYTES` each, for one-dimensional contiguous arrays of equal unsigned types;
    target, before, enters and leaves are the places of their first elements.
    """
    item_bytes = sums.dtype.bitwidth // 8
    lines = LINE_BYTES // item_bytes
    place = types.intp

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector = ir.VectorType(ir.IntType(8 * item_bytes), lines)

        def pointer(array: int, index: int) -> Any:
            kind = signature.args[array]
            return _pointer(context, builder, kind, arguments[array], arguments[index], vector)

        total = _load(builder, pointer(0, 2), item_bytes)
        total = builder.add(total, _load(builder, pointer(3, 4), item_bytes))
        total = builder.sub(total, _load(builder, pointer(3, 5), item_bytes))
        _store(builder, total, pointer(0, 1), item_bytes)
        return context.get_dummy_value()

    return types.void(sums, place, place, words, place, place), generate


@intrinsic
def transpose_tile(
    typing: Any, source: Any, start: Any, stride: Any, target: Any, first: Any, pitch: Any
) -> Any:
    """Transpose a square of as many elements as fit into `TILE_BYTES`, through registers.

    target[first + j pitch + i] = source[start + i stride + j], for one-dimensional contiguous
    arrays of equal types.
    """
    item_bytes = source.dtype.bitwidth // 8
    size = TILE_BYTES // item_bytes
    place = types.intp

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector = ir.VectorType(ir.IntType(8 * item_bytes), size)
        mask_type = ir.VectorType(ir.IntType(32), size)
        pairs = [[half + k // 2 + size * (k % 2) for k in range(size)] for half in (0, size // 2)]
        masks = [ir.Constant(mask_type, pair) for pair in pairs]

        def pointer(array: int, line: int) -> Any:
            index = builder.add(
                arguments[array + 1],
                builder.mul(arguments[array + 2], ir.Constant(ir.IntType(64), line)),
            )
            kind = signature.args[array]
            return _pointer(context, builder, kind, arguments[array], index, vector)

        lines = [_load(builder, pointer(0, line), item_bytes) for line in range(size)]
        # Shuffling each line with the one half the square below, log2 times, transposes.
        for _ in range(size.bit_length() - 1):
            lines = [
                builder.shuffle_vector(lines[n], lines[n + size // 2], mask)
                for n in range(size // 2)
                for mask in masks
            ]
        for line in range(size):
            _store(builder, lines[line], pointer(3, line), item_bytes)
        return context.get_dummy_value()

    return types.void(source, place, place, target, place, place), generate
