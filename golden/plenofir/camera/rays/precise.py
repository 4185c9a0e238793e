# SPDX-License-Identifier: Apache-2.0
"""Linear functions whose value keeps its relative accuracy where its two terms cancel.

A plane near infinity is the quotient of a number and a difference that nearly vanishes. The
coefficients of that difference depend on the camera alone, so they are computed once with sixty
digits and kept as unevaluated sums of two doubles; only the evaluation for each plane is
vectorised.
"""

from dataclasses import dataclass
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from typing import Any

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]

CONTEXT = Context(prec=60, Emin=MIN_EMIN, Emax=MAX_EMAX)
_SPLITTER = 134217729.0  # 2^27 + 1


@dataclass(frozen=True)
class Line:
    """The function c0 + c1 x with coefficients to about 32 digits."""

    # c0 as the sum of two doubles
    constant: float
    constant_low: float
    # c1 as the sum of two doubles
    factor: float
    factor_low: float

    @classmethod
    def of(cls, constant: Decimal, factor: Decimal) -> "Line":
        """Round sixty-digit coefficients to two doubles each."""
        high, factor_high = float(constant), float(factor)
        return cls(
            high,
            float(CONTEXT.subtract(constant, Decimal(high))),
            factor_high,
            float(CONTEXT.subtract(factor, Decimal(factor_high))),
        )

    def at(self, x: Values, halves: tuple[Values, Values]) -> Values:
        """Evaluate the function."""
        x_high, x_low = halves
        factor_high, factor_low = split(np.float64(self.factor))
        # Exact product of x and the high factor (Dekker).
        product = x * self.factor
        error = x_high * factor_high
        error -= product
        error += x_low * factor_high
        error += x_high * factor_low
        error += x_low * factor_low
        # Exact sum of the product and the constant (Knuth).
        total = product + self.constant
        virtual = total - product
        error += self.constant - virtual
        product -= total - virtual
        error += product
        error += x * self.factor_low + self.constant_low
        total += error
        return total


def split(x: npt.NDArray[np.float64] | np.float64) -> tuple[Any, Any]:
    """Split doubles into halves of 26 bits, whose products are exact (Dekker, Veltkamp)."""
    scaled = x * _SPLITTER
    high = scaled - (scaled - x)
    return high, x - high


def exact(value: Any) -> Decimal:
    """Convert a number without rounding."""
    return Decimal(value)
