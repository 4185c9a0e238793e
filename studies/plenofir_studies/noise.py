# SPDX-License-Identifier: Apache-2.0
"""The effect of refocusing on noise: variance measured on even frames, and derived.

An output pixel is the mean of M x M pixels of the raw image, for every a. Independent noise of
variance s^2 leaves s^2 / M^2 of it; rounding adds its own:

    exact:            s^2 / M^2 + q_0
    stored products:  s^2 / M^2 + (M q_F + r_G) / M + M q_F + r_0

with q_n = 4^-n / 12 the variance of rounding to n fraction bits, and r_n = q_n where fraction bits
are dropped to n, else 0. M separately rounded products add M q_F; the columns average that of M
rows. Rounding errors of products are assumed uniform and independent, which holds while a product's
step, M / 2^F grey levels, is smaller than the noise.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.refocus import (
    Arithmetic,
    ExactArithmetic,
    StoredProductArithmetic,
    interpolated_sums,
    refocus_sums,
    shift_to_text,
)

Floats = npt.NDArray[np.float64]

SIZES = (3, 5, 7, 11)
"""Micro image sizes M that are measured."""
ARITHMETICS: tuple[Arithmetic, ...] = (
    ExactArithmetic(),
    StoredProductArithmetic(fraction_bits=8, guard_bits=2),
    StoredProductArithmetic(fraction_bits=4, guard_bits=2),
    StoredProductArithmetic(fraction_bits=0, guard_bits=0),
)
"""Arithmetics that are measured; the last one is the thesis's."""
NOISE = 8.0
"""Standard deviation of the raw image's noise in grey levels."""
_LEVEL = 120.0
_LENSES = 60


@dataclass(frozen=True)
class Noise:
    """Noise after the operator."""

    m: int
    shift: int  # a'
    order: int  # of the interpolation
    arithmetic: str
    raw: float  # variance of the raw image, in squares of grey levels
    measured: float  # mean square distance of the refocused image from the even level, the same
    derived: float  # by the formulas above

    @property
    def a(self) -> str:
        return shift_to_text(self.shift, self.m)


def arithmetic_name(arithmetic: Arithmetic) -> str:
    """Name for tables."""
    if isinstance(arithmetic, ExactArithmetic):
        return "exact"
    return f"F = {arithmetic.fraction_bits}, G = {arithmetic.guard_bits}"


def rounding_variance(bits: int) -> float:
    """Variance of rounding to some fraction bits: a uniform error of one step."""
    return 4.0**-bits / 12


def share_of_noise(m: int, shift: int, order: int = 0) -> float:
    """Share of the raw image's variance that remains: sum of the operator's squared weights.

    Mean over the outputs of a micro image, inside the picture; for nearest neighbour 1 / M^2.
    """
    reach = m * (abs(shift) + order + 4)
    impulses = np.eye(2 * reach + m, dtype=np.int64)
    weights = interpolated_sums(impulses, m, shift, axis=0, order=order) / m ** (1 + order)
    rows: Floats = (weights[reach : reach + m] ** 2).sum(axis=1)
    return float(rows.mean() ** 2)


def derived_variance(
    m: int, shift: int, arithmetic: Arithmetic, raw_variance: float, order: int = 0
) -> float:
    """Variance of a refocused image by the formulas of this module, in squares of grey levels.

    Stored products with order 0 only.
    """
    averaged = raw_variance * share_of_noise(m, shift, order)
    if isinstance(arithmetic, ExactArithmetic):
        return averaged + rounding_variance(0)
    assert order == 0
    fraction, guard = arithmetic.fraction_bits, arithmetic.guard_bits
    products = m * rounding_variance(fraction)
    rows = products + (rounding_variance(guard) if fraction > guard else 0.0)
    final = rounding_variance(0) if fraction > 0 else 0.0
    return averaged + rows / m + products + final


def noisy_frame(m: int, seed: int, level: float = _LEVEL) -> npt.NDArray[np.uint8]:
    """Even raw image with normal noise, 8 bit."""
    side = _LENSES * m
    values = np.random.default_rng(seed).normal(level, NOISE, (side, side))
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _inside(image: npt.NDArray[np.generic], m: int, shift: int) -> Floats:
    """Part of an image whose pixels have all their views."""
    border = (abs(shift) + 4) * m
    return np.asarray(image[border:-border, border:-border], dtype=np.float64)


def measure_noise(
    m: int, shift: int, arithmetic: Arithmetic, *, order: int = 0, frames: int = 8, seed: int = 0
) -> Noise:
    """Refocus even frames with noise, and compare the variance with the derived one.

    The variance is averaged over frames whose levels are spread over M grey levels: a step of a
    product without fraction bits.
    """
    levels = [_LEVEL + m * k / frames for k in range(frames)]
    of_raw, of_refocused = [], []
    for k, level in enumerate(levels):
        raw = noisy_frame(m, seed + k, level)
        refocused = _inside(arithmetic.refocus(raw, m, shift=shift, order=order), m, shift)
        of_raw.append(float(np.mean((raw - level) ** 2)))
        of_refocused.append(float(np.mean((refocused - level) ** 2)))
    raw_variance = float(np.mean(of_raw))
    return Noise(
        m=m,
        shift=shift,
        order=order,
        arithmetic=arithmetic_name(arithmetic),
        raw=raw_variance,
        measured=float(np.mean(of_refocused)),
        derived=derived_variance(m, shift, arithmetic, raw_variance, order),
    )


def neighbours_alike(m: int, shift: int, seed: int = 0) -> Floats:
    """Correlation of the noise of pixels 0 to 2 M apart in a row of a refocused image."""
    sums = refocus_sums(noisy_frame(m, seed), m, shift=shift)
    part = _inside(sums, m, shift)
    part = part - part.mean()
    columns = part.shape[1] - 2 * m
    base = part[:, :columns]
    return np.array([(base * part[:, d : d + columns]).mean() for d in range(2 * m + 1)]) / float(
        (base**2).mean()
    )


def cases() -> Iterator[tuple[int, int, Arithmetic, int]]:
    """Measured cases: M, a', arithmetic, order of the interpolation."""
    for m in SIZES:
        for shift in (-m, 0, 1, 2, m, m + 1):
            yield m, shift, ARITHMETICS[0], 0
        for arithmetic in ARITHMETICS[1:]:
            yield m, 2, arithmetic, 0
        yield m, 2, ARITHMETICS[0], 1


def measure_all(step: Callable[[], None] | None = None) -> Sequence[Noise]:
    results = []
    for m, shift, arithmetic, order in cases():
        results.append(measure_noise(m, shift, arithmetic, order=order))
        if step is not None:
            step()
    return results
