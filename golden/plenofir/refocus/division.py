# SPDX-License-Identifier: Apache-2.0
"""Division of sums by a multiplication: exact quotients, halves rounded up.

With d = divisor 2^t and multiplier = (2^k + e) / d, |e| <= d / 2, the quotient n 2^t / d is right
if e n < 2^k; or, for e < 0 and n + 1 in the place of n, if -e (n + 1) <= 2^k. d is at most
2^(bits of a word - those of a quotient), and more than half of it. A word has more bits than a
quotient, so that the upper half of a product is enough: 2^drop is no less than 2^bits.
"""

from typing import NamedTuple


class Division(NamedTuple):
    """How sums are held and divided: floor((n + half) multiplier / 2^drop)."""

    bits: int
    half: int
    multiplier: int
    drop: int


def division(divisor: int, most: int, *numbers: int, least_bits: int = 16) -> Division:
    """Narrowest words for sums, and constants for their quotients.

    `most`: largest quotient. `numbers`: what the words must hold besides.
    """
    quotient_bits = most.bit_length()
    largest = max((most * divisor, *numbers))
    bits = least_bits
    while divisor << quotient_bits > 1 << bits or largest >> bits or quotient_bits == bits:
        bits *= 2
    scale = ((1 << bits - quotient_bits) // divisor).bit_length() - 1
    scaled, drop = divisor << scale, 2 * bits - quotient_bits - 1
    multiplier, rest = divmod(1 << drop, scaled)
    half, above = divisor // 2, 2 * rest >= scaled
    if rest and not above:
        half += 1
    return Division(bits, half, multiplier + above, drop - scale)
