# SPDX-License-Identifier: Apache-2.0
"""The bit-true model of the hardware's arithmetic against the real-valued operator."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from plenofir.refocus import (
    ExactArithmetic,
    FilterLayout,
    StoredProductArithmetic,
    error_against_operator,
    filter_lines,
    refocus,
)

pytestmark = pytest.mark.quick

stored_arithmetics = st.integers(0, 4).flatmap(
    lambda guard: st.integers(guard, 12).map(
        lambda fraction: StoredProductArithmetic(fraction_bits=fraction, guard_bits=guard)
    )
)


def test_exact_arithmetic_is_the_correctly_rounded_operator():
    raw = np.random.default_rng(0).integers(0, 65536, (31, 27, 3), dtype=np.uint16)
    assert np.array_equal(ExactArithmetic().refocus(raw, 4, shift=7), refocus(raw, 4, "7/4"))


@given(stored_arithmetics, st.integers(1, 12), st.integers(-9, 14), st.integers(0, 2**32 - 1))
def test_stored_products_stay_within_their_bound(arithmetic, m, shift, seed):
    rng = np.random.default_rng(seed)
    raw = rng.integers(0, 256, (m + 9, m + 11), dtype=np.uint8)
    # Some white and some black, where saturation and rounding are at their worst.
    raw[rng.random(raw.shape) < 0.3] = 255
    raw[rng.random(raw.shape) < 0.1] = 0
    image = arithmetic.refocus(raw, m, shift=shift)
    error = error_against_operator(image, raw, m, shift=shift)
    assert np.abs(error).max() <= float(arithmetic.error_bound(m, 8)) + 1e-9


@given(st.integers(1, 12), st.integers(-9, 14))
def test_exact_arithmetic_stays_within_its_bound(m, shift):
    raw = np.random.default_rng(m).integers(0, 256, (m + 9, m + 11), dtype=np.uint8)
    error = error_against_operator(
        ExactArithmetic().refocus(raw, m, shift=shift), raw, m, shift=shift
    )
    assert np.abs(error).max() <= float(ExactArithmetic().error_bound(m, 8)) + 1e-9


@given(st.integers(1, 7), st.integers(-6, 9), st.integers(0, 2**32 - 1))
def test_thesis_arithmetic_step_by_step(m, shift, seed):
    """F = G = 0 through the register-level filter: 8 bit products, 8 bit intermediate image."""
    raw = np.random.default_rng(seed).integers(0, 256, (m + 5, m + 4), dtype=np.uint8)

    def product(value: int) -> int:
        return int(Fraction(int(value), m) + Fraction(1, 2))

    def one_dimension(image: np.ndarray) -> np.ndarray:
        products = np.vectorize(product)(image)
        return np.minimum(np.array(list(filter_lines(products, FilterLayout(m, (shift,))))), 255)

    want = one_dimension(one_dimension(raw).T).T
    arithmetic = StoredProductArithmetic(fraction_bits=0, guard_bits=0)
    assert np.array_equal(arithmetic.refocus(raw, m, shift=shift), want)


@pytest.mark.parametrize("m", range(1, 16))
@pytest.mark.parametrize(
    ("bits", "dtype"),
    [
        ((0, 0), np.uint8),
        ((4, 0), np.uint8),
        ((4, 4), np.uint8),
        ((8, 2), np.uint8),
        ((0, 0), np.uint16),
        ((12, 0), np.uint16),
    ],
)
def test_white_saturates_and_never_wraps(m, bits, dtype):
    largest = np.iinfo(dtype).max
    arithmetic = StoredProductArithmetic(fraction_bits=bits[0], guard_bits=bits[1])
    white = np.full((4 * m, 4 * m), largest, dtype)
    middle = arithmetic.refocus(white, m, shift=1)[2 * m, 2 * m]
    assert largest - middle <= arithmetic.error_bound(m, 8 * white.itemsize)


def test_more_fraction_bits_never_loosen_the_bound():
    for m in (3, 5, 7, 11):
        bounds = [
            StoredProductArithmetic(fraction_bits=f, guard_bits=min(f, 2)).error_bound(m, 8)
            for f in range(13)
        ]
        assert bounds[0] > bounds[4] > bounds[8] >= bounds[12] > Fraction(1, 2)


@pytest.mark.parametrize("bits", [(-1, 0), (13, 0), (4, 5), (0, 1), (4, -1)])
def test_bad_widths(bits):
    with pytest.raises(ValidationError):
        StoredProductArithmetic(fraction_bits=bits[0], guard_bits=bits[1])
