# SPDX-License-Identifier: Apache-2.0
"""Compiled division of `plenofir.refocus.border`; its import takes longer than all else there."""

from typing import Any

import numpy as np

from plenofir.refocus.kernels import Integers, compiled


@compiled
def divide_lines(
    sums: Integers, down: Integers, across: Integers, half: Any, most: Any, out: Integers
) -> None:
    """Divide in floating point; it holds the sums, weights and their products without an error."""
    numerators, weights = np.empty_like(across), np.empty_like(across)
    one = half + half
    # One where nothing arrives: the sum is 0 there, too.
    inverses = one / np.maximum(across, one)
    for line in range(sums.shape[0]):
        for k in range(across.size):
            numerators[k] = sums[line, k]
        inverse = one / max(down[line], one)
        for k in range(across.size):
            weights[k] = max(down[line] * across[k], one)
            numerators[k] += np.floor(weights[k] * half)
        for k in range(across.size):
            # Off by one at most, because the quotient is small.
            quotient = np.floor(numerators[k] * (inverse * inverses[k]))
            rest = numerators[k] - quotient * weights[k]
            if rest >= weights[k]:
                quotient += one
            if rest < one - one:
                quotient -= one
            numerators[k] = max(one - one, min(most, quotient))
        for k in range(across.size):
            out[line, k] = numerators[k]
