# SPDX-License-Identifier: Apache-2.0
"""Constants for division by the weights of lines and columns (`plenofir.refocus.division`)."""

import numpy as np

from plenofir.ground.kept_code import borrowing
from plenofir.refocus.compiled.parameters import Integers, Weights


@borrowing
def weights_table(weights: Weights, rows: Integers, bits: int, table: Integers) -> None:
    """Constants for division by weights: half, scale and multiplier for each weight of a column.

    floor((n + half) scale multiplier / 2^drop) is the quotient; scaled weights are most / 2 to
    most. `table` has the shape (columns' weights, 3, lanes), flat.
    """
    lanes = rows.size
    one = np.uint64(1)
    most = one << np.uint64(bits - weights.bits)
    drop = 2 * bits - weights.bits - 1
    for c in range(weights.columns.size):
        for line in range(lanes):
            weight = np.uint64(weights.twice * rows[line] * weights.columns[c])
            half, scale, multiplier = weight >> one, one, np.uint64(0)
            if weight > 0:
                while weight * (scale + scale) <= most:
                    scale += scale
                scaled = weight * scale
                power = one << np.uint64(min(drop, 63))
                multiplier, rest = power // scaled, power % scaled
                for _ in range(63, drop):
                    above = np.uint64(rest + rest >= scaled)
                    multiplier = multiplier + multiplier + above
                    rest = rest + rest - above * scaled
                if rest + rest >= scaled:
                    # The next multiplier is nearer, and not too small.
                    multiplier += one
                elif rest > 0:
                    half += one
            place = 3 * lanes * c + line
            table[place] = half
            table[place + lanes] = scale
            table[place + 2 * lanes] = multiplier


@borrowing
def inverse_bits(weight: int, largest: int) -> int:
    """Bits of a 32 bit floating point 1 / weight, if floor(n inverse) is right for all n; else 0.

    For n of up to weight (largest + 1).
    """
    # Rounded up, by e <= 2^-23 of it, so that it is right where n is a multiple. Below a multiple
    # q weight it is, if e and the rounding of the product, 2^-24, are less than 1 / (q weight).
    if weight <= 0 or weight * (largest + 1) > 1 << 22:
        return 0
    power = 0
    while 1 << power < weight:
        power += 1
    # 1 / weight is 2^-power times 1 to 2, of which 23 bits behind the point are kept.
    return (126 - power << 23) + -(-(1 << power + 23) // weight)
