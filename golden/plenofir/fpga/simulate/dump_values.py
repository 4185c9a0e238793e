# SPDX-License-Identifier: Apache-2.0
"""Values of two waveform files side by side: levels, undefined bits, the first difference."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from plenofir.fpga.simulate.dumps import Changes, DumpSignal, Value

Pair = tuple[DumpSignal, DumpSignal]
_Words = npt.NDArray[Any]

# Characters of a bit: its level, and whether it is defined.
LEVELS = str.maketrans("lhuxzw-", "0100000")
DEFINED = str.maketrans("01lhuxzw-", "111100000")
# Bits of the widest signal that fits a signed machine word.
_WORD_BITS = 63


def alike(a: DumpSignal, b: DumpSignal) -> bool:
    """Whether two signals can be compared."""
    return a.is_bits == b.is_bits and a.width == b.width


def all_bits(pair: Pair, strict: bool) -> int:
    """Mask of a signal's bits; whatever is compared by codes has them all."""
    return (1 << pair[0].width) - 1 if pair[0].is_bits and not strict else -1


def value_tracks(changes: Sequence[Changes], pair: Pair) -> list[_Words]:
    """Values as words, shape (2, changes + 1): levels, and which bits are defined.

    Before the first change nothing is defined.
    """
    if not pair[0].is_bits:
        return _coded_tracks([c.values for c in changes], undefined_at_first=True)
    every_bit = all_bits(pair, strict=False)
    word = np.int64 if pair[0].width <= _WORD_BITS else object

    def split(value: Value) -> tuple[int, int]:
        if isinstance(value, int):
            return value, every_bit
        text = str(value)
        return int(text.translate(LEVELS), 2), int(text.translate(DEFINED), 2)

    return [np.array([(0, 0), *map(split, c.values)], dtype=word).reshape(-1, 2).T for c in changes]


def text_tracks(changes: Sequence[Changes], pair: Pair) -> list[_Words]:
    """What the files say, to the character, with nothing undefined."""
    texts = [
        [_characters(value, s.width) for value in c.values]
        for c, s in zip(changes, pair, strict=True)
    ]
    return _coded_tracks(texts, undefined_at_first=False)


def _coded_tracks(values: Sequence[Sequence[Value]], *, undefined_at_first: bool) -> list[_Words]:
    """Values as numbers, equal ones with equal numbers."""
    codes: dict[str, int] = {}
    tracks = []
    for file_values in values:
        levels = [0, *(codes.setdefault(str(v), len(codes) + 1) for v in file_values)]
        defined = np.full(len(levels), -1, dtype=np.int64)
        if undefined_at_first:
            defined[0] = 0
        tracks.append(np.stack([np.array(levels, dtype=np.int64), defined]))
    return tracks


def first_difference(a: _Words, b: _Words) -> tuple[int | None, int]:
    """First sample at which two tracks differ, and the bits that are ever defined."""
    (level_a, defined_a), (level_b, defined_b) = a, b
    seen_a, seen_b = np.bitwise_or.accumulate(defined_a), np.bitwise_or.accumulate(defined_b)
    wrong = (level_a ^ level_b) & defined_a & defined_b | (defined_a ^ defined_b)
    # A bit that only one file ever defines counts from the moment on at which it does.
    lone = seen_a[-1] ^ seen_b[-1]
    wrong = wrong & (seen_a & seen_b | (defined_a | defined_b) & lone)
    differs = wrong != 0
    at = int(np.argmax(differs)) if differs.any() else None
    return at, int(seen_a[-1] | seen_b[-1])


def _characters(value: Value, width: int) -> str:
    return f"{value:0{width}b}" if width and isinstance(value, int) else str(value)


def value_text(value: Value | None, signal: DumpSignal, strict: bool) -> str:
    """A value as a person reads it."""
    if value is None:
        return "nothing yet"
    if not signal.is_bits:
        return str(value)
    if isinstance(value, str) or strict:
        return f'"{_characters(value, signal.width).upper()}"'
    return str(value) if signal.width == 1 else f"{value} (0x{value:x})"
