# SPDX-License-Identifier: Apache-2.0
"""The bit-true model of the hardware's arithmetic against the real-valued operator."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from plenofir.ground.errors import InputError
from plenofir.refocus import (
    ExactArithmetic,
    FilterLayout,
    StoredProductArithmetic,
    error_against_operator,
    filter_lines,
    refocus,
    refocus_sums,
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


def plain_pass(
    line, m: int, shift: int, offset: int, scale: int, drop: int, bits: int
) -> list[int]:
    """Products, their sums and what is left of these, as whole numbers, halves up."""
    products = [((int(value) << scale + 1) + m) // (2 * m) for value in line]
    sums = [
        sum(
            products[place]
            for u in range(m)
            for place in [m * ((k + offset - u * shift) // m) + u]
            if 0 <= place < len(line)
        )
        for k in range(len(line))
    ]
    return [min((2 * total + (1 << drop)) >> drop + 1, (1 << bits) - 1) for total in sums]


@given(
    stored_arithmetics,
    st.integers(1, 6),
    st.integers(-6, 9),
    st.integers(0, 2),
    st.sampled_from(["centred", "causal"]),
    st.sampled_from([np.uint8, np.uint16]),
    st.integers(0, 2**32 - 1),
)
def test_stored_products_by_definition(arithmetic, m, shift, order, align, dtype, seed):
    rng, white = np.random.default_rng(seed), np.iinfo(dtype).max
    raw = rng.integers(0, white, (m + 4, m + 3), dtype, endpoint=True)
    raw[rng.random(raw.shape) < 0.5] = white
    fraction, guard = arithmetic.fraction_bits, arithmetic.guard_bits
    bits, image = 8 * raw.itemsize, raw
    passes = [(axis, s) for axis in (1, 0) for s in (shift, *[1] * order)]
    for number, (axis, moved) in enumerate(passes):
        scale = fraction if number == 0 else fraction - guard
        last = number == len(passes) - 1
        drop, width = (fraction, bits) if last else (fraction - guard, bits + guard)
        offset = (m - 1) * moved // 2 if align == "centred" else 0
        lines = image if axis else image.T
        lines = np.array([plain_pass(x, m, moved, offset, scale, drop, width) for x in lines])
        image = lines if axis else lines.T
    got = arithmetic.refocus(raw, m, shift=shift, order=order, align=align)
    assert got.dtype == dtype
    assert got.tolist() == image.tolist()


def test_largest_sums_and_bounds_by_hand():
    exact, stored = ExactArithmetic(), StoredProductArithmetic()
    assert (stored.fraction_bits, stored.guard_bits) == (8, 2)
    assert StoredProductArithmetic(fraction_bits=12, guard_bits=12).guard_bits == 12
    assert [exact.largest_sum(3, 8, order) for order in (0, 1)] == [9 * 255, 81 * 255]
    assert exact.largest_sum(2, 16) == 4 * 65535
    assert [exact.error_bound(m, 8) for m in (1, 2, 3)] == [0, Fraction(1, 2), Fraction(4, 9)]
    assert exact.error_bound(3, 8, 1) == Fraction(40, 81)
    # 2^8 255 / 3 = 21760 for a pixel, 2^6 1023 / 3 = 21824 for one of the image in between.
    assert stored.largest_sum(3, 8) == 3 * 21824
    thesis = StoredProductArithmetic(fraction_bits=0, guard_bits=0)
    assert thesis.largest_sum(7, 8) == 7 * 36
    # Each of three products is off by a third of 1/256 at most, each sum by half of its last bit.
    third, half = Fraction(1, 256), Fraction(1, 2)
    assert stored.error_bound(3, 8) == third + (half / 4 + third) + half
    assert stored.error_bound(3, 8, 2) == third + 5 * (half / 4 + third) + half
    # Nothing is dropped but at the end; nothing at all.
    equal = StoredProductArithmetic(fraction_bits=4, guard_bits=4)
    assert equal.error_bound(3, 8) == 2 * 16 * third + half
    assert thesis.error_bound(3, 8) == 2
    assert thesis.error_bound(1, 8) == 0


@pytest.mark.parametrize("shape", [(11, 14), (11, 14, 3)])
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("border", ["zero", "normalise"])
def test_distance_from_the_operator_by_hand(shape, order, border):
    raw = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
    # A picture that has nothing to do with it.
    image, m, shift = raw[::-1], 3, 2
    how = {"shift": shift, "align": "causal", "order": order}
    distance = error_against_operator(image, raw, m, border=border, **how)
    sums = refocus_sums(raw, m, **how)
    weights = np.full(shape, 9 ** (1 + order))
    if border == "normalise":
        weights = np.maximum(refocus_sums(np.ones_like(raw), m, **how), 1)
    assert distance == pytest.approx(image - sums / weights)


def test_sharpened_distance_is_limited_to_the_pixels():
    raw = np.where(np.indices((20, 20)).sum(axis=0) // 2 % 2, 255, 0).astype(np.uint8)
    image = ExactArithmetic().refocus(raw, 2, shift=1, sharpen="1/4")
    assert {0, 255} <= set(image.flat)
    distance = error_against_operator(image, raw, 2, shift=1, units=16)
    assert 0.2 < np.abs(distance).max() <= 0.5
    assert error_against_operator(image + 1, raw, 2, shift=1, units=16) == pytest.approx(
        distance + 1 - 256.0 * (image == 255)
    )


@pytest.mark.parametrize(("m", "sharpen"), [(2435, "off"), (861, "1/4")])
def test_sums_of_61_bits_at_most(m: int, sharpen: str) -> None:
    raw = np.zeros((3, 3), np.uint16)
    # M^4 (2^16 - 1), and with 1/4 the taps, 6 + 2, in both dimensions: just below 2^61.
    how = {"shift": 1, "order": 1, "sharpen": sharpen}
    assert not ExactArithmetic().refocus(raw, m, **how).any()
    with pytest.raises(InputError, match="need sums of 62 bits, more than 61"):
        ExactArithmetic().refocus(raw, m + 1, **how)
