# SPDX-License-Identifier: Apache-2.0
"""TMDS of a channel, from DVI 1.0, sections 3.2 and 3.3."""

from collections.abc import Iterable

# C1 C0 = 00, 01, 10, 11; bit 0 is sent first.
TOKENS = (0b1101010100, 0b0010101011, 0b0101010100, 0b1010101011)
# active, horizontal and vertical sync, pixel with red in the low bits.
Signal = tuple[int, int, int, int]


def encode(byte: int, disparity: int) -> tuple[int, int]:
    """The word of a byte, and the running disparity (figure 3-5)."""
    d = [byte >> i & 1 for i in range(8)]
    with_xor = not (sum(d) > 4 or (sum(d) == 4 and not d[0]))
    q = [d[0]]
    for bit in d[1:]:
        q.append(q[-1] ^ bit if with_xor else 1 - (q[-1] ^ bit))
    excess = 2 * sum(q) - 8
    if disparity == 0 or excess == 0:
        invert = not with_xor
        disparity += excess if with_xor else -excess
    elif (disparity > 0) == (excess > 0):
        invert = True
        disparity += 2 * with_xor - excess
    else:
        invert = False
        disparity += excess - 2 * (not with_xor)
    bits = [1 - bit if invert else bit for bit in q] + [int(with_xor), int(invert)]
    return sum(bit << i for i, bit in enumerate(bits)), disparity


def words(signals: Iterable[Signal]) -> list[tuple[int, int, int]]:
    """Words of channels 0 (blue and syncs), 1 (green) and 2 (red)."""
    found = []
    disparity = [0, 0, 0]
    for active, h_sync, v_sync, pixel in signals:
        if active:
            row = []
            for c in range(3):
                word, disparity[c] = encode(pixel >> (16 - 8 * c) & 0xFF, disparity[c])
                row.append(word)
        else:
            row = [TOKENS[v_sync << 1 | h_sync], TOKENS[0], TOKENS[0]]
            disparity = [0, 0, 0]
        found.append((row[0], row[1], row[2]))
    return found
