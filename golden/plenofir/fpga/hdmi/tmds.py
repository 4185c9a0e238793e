# SPDX-License-Identifier: Apache-2.0
"""TMDS coding of one channel, written from DVI 1.0, section 3.2 and 3.3.

Words have ten bits, bit 0 is sent first. A word is a data word (a byte, transition minimised and DC
balanced) or one of four control tokens, sent in the blanking. HDMI adds words for data islands.
"""

from functools import cache

import numpy as np
import numpy.typing as npt

Words = npt.NDArray[np.uint16]
Bytes = npt.NDArray[np.uint8]
Flags = npt.NDArray[np.bool_]

TOKENS = (0b1101010100, 0b0010101011, 0b0101010100, 0b1010101011)
"""Control tokens of (C1, C0) = 00, 01, 10, 11 (DVI 1.0, table 3-4)."""

DISPARITIES = tuple(range(-8, 10, 2))
"""Values that the running disparity takes between words."""


def _ones(value: int) -> int:
    return value.bit_count()


def minimise_transitions(byte: int) -> int:
    """First coding step (q_m of DVI 1.0, figure 3-5): the byte as a chain of XORs or XNORs.

    Bit 8 tells XOR (1) from XNOR (0).
    """
    ones = _ones(byte)
    inverted = ones > 4 or (ones == 4 and not byte & 1)
    coded = byte & 1
    for i in range(1, 8):
        bit = (coded >> (i - 1) ^ byte >> i) & 1
        coded |= (bit ^ inverted) << i
    return coded | (not inverted) << 8


def encode_byte(byte: int, disparity: int) -> tuple[int, int]:
    """Code a byte (DVI 1.0, figure 3-5): the word, and the disparity after it.

    The disparity is ones minus zeros of all data words since the last control token.
    """
    coded = minimise_transitions(byte)
    by_xor = coded >> 8
    low = coded & 0xFF
    excess = 2 * _ones(low) - 8
    if disparity == 0 or excess == 0:
        if by_xor:
            return 1 << 8 | low, disparity + excess
        return 1 << 9 | low ^ 0xFF, disparity - excess
    if (disparity > 0) == (excess > 0):
        return 1 << 9 | by_xor << 8 | low ^ 0xFF, disparity + 2 * by_xor - excess
    return by_xor << 8 | low, disparity - 2 * (1 - by_xor) + excess


def decode_word(word: int) -> int:
    """Byte of a data word of ten bits (DVI 1.0, figure 3-6); meaningless for control tokens."""
    low = word & 0xFF ^ (0xFF if word >> 9 else 0)
    chain = (low ^ low << 1) & 0xFE
    if not word >> 8 & 1:
        chain ^= 0xFE
    return chain | low & 1


@cache
def _tables() -> tuple[list[list[int]], list[list[int]]]:
    """Words and disparities after them, by [disparity // 2 + 4][byte]."""
    pairs = [[encode_byte(byte, d) for byte in range(256)] for d in DISPARITIES]
    return [[p[0] for p in row] for row in pairs], [[p[1] // 2 + 4 for p in row] for row in pairs]


def encode_channel(data: Bytes, active: Flags, control: Bytes) -> Words:
    """Code a channel: bytes where active, else `control`, 2 C1 + C0; all of shape (pixels,)."""
    words, behind = _tables()
    out = np.asarray(TOKENS, np.uint16)[control]
    at = 4
    values: list[int] = data.tolist()
    coded: list[int] = out.tolist()
    for i, on in enumerate(active.tolist()):
        if on:
            coded[i] = words[at][values[i]]
            at = behind[at][values[i]]
        else:
            at = 4
    return np.array(coded, np.uint16)


def decode_channel(words: Words) -> tuple[Flags, Bytes, Bytes]:
    """Data enable, bytes and control bits (2 C1 + C0) of a channel's words."""
    bytes_of = np.array([decode_word(word) for word in range(1024)], np.uint8)
    control_of = np.full(1024, 255, np.uint8)
    control_of[list(TOKENS)] = range(4)
    control = control_of[words]
    active = control == 255
    return (
        active,
        np.where(active, bytes_of[words], 0).astype(np.uint8),
        np.where(active, 0, control).astype(np.uint8),
    )
