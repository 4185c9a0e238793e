# SPDX-License-Identifier: Apache-2.0
"""`border="normalise"`: the mean of the views that reach a pixel, to the bit."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.ground.errors import InputError
from plenofir.refocus import (
    ExactArithmetic,
    StoredProductArithmetic,
    error_against_operator,
    interpolated_sums,
    refocus,
    refocus_sums,
)
from plenofir.refocus.sharpening import taps

pytestmark = pytest.mark.quick


def drawn(shape: tuple[int, ...], dtype: type) -> np.ndarray:
    return np.random.default_rng(5).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)


def mean_of_views(raw: np.ndarray, m: int, shift: int) -> np.ndarray:
    """By the definition: each view is moved, and the mean taken over existing pixels."""
    sums, counts = np.zeros(raw.shape, np.int64), np.zeros(raw.shape, np.int64)
    offset = (m - 1) * shift // 2
    rows, columns = (np.arange(n) + offset for n in raw.shape[:2])
    for v, u in np.ndindex(m, m):
        y = m * ((rows - v * shift) // m) + v
        x = m * ((columns - u * shift) // m) + u
        there = np.ix_((y >= 0) & (y < raw.shape[0]), (x >= 0) & (x < raw.shape[1]))
        taken = raw[np.clip(y, 0, raw.shape[0] - 1)][:, np.clip(x, 0, raw.shape[1] - 1)]
        sums[there] += taken[there]
        counts[there] += 1
    counts = np.maximum(counts, 1)
    return (2 * sums + counts) // (2 * counts)


shapes = st.tuples(st.integers(0, 30), st.integers(0, 40))


@given(
    st.integers(1, 7),
    st.integers(-16, 17),
    shapes,
    st.sampled_from([np.uint8, np.uint16]),
    st.booleans(),
)
def test_mean_of_the_views_that_reach_a_pixel(m, shift, extra, dtype, rgb) -> None:
    raw = drawn((m + extra[0], m + extra[1], *((3,) if rgb else ())), dtype)
    image = refocus(raw, m, Fraction(shift, m), border="normalise")
    assert np.array_equal(image, mean_of_views(raw, m, shift))


@given(
    st.integers(1, 6),
    st.integers(-9, 10),
    shapes,
    st.integers(0, 2),
    st.sampled_from([0, 3, 16]),
    st.sampled_from(["centred", "causal"]),
)
def test_orders_and_taps(m, shift, extra, order, units, align) -> None:
    raw = drawn((m + extra[0], m + extra[1]), np.uint8)
    full, filter_ = m ** (1 + order), taps(units)
    sums = refocus_sums(raw, m, shift=shift, order=order, align=align)
    weights = []
    for axis, length in enumerate(raw.shape):
        ones = np.ones(length, np.int64)
        reached = interpolated_sums(ones, m, shift, axis=0, order=order, align=align)
        weights.append(reached * filter_.scale)
        lines = np.moveaxis(sums, axis, 0)
        sharp = np.empty_like(lines)
        for k in range(length):
            # A tap that not all views reach counts as the pixel itself, as do all taps of one.
            near = [n for n in (k - m, k + m) if 0 <= n < length and reached[n] == full]
            near = near if reached[k] == full else []
            around = sum((lines[n] for n in near), (2 - len(near)) * lines[k])
            sharp[k] = filter_.centre * lines[k] - filter_.side * around
        sums = np.moveaxis(sharp, 0, axis)
    weight = np.outer(*weights)
    want = np.clip((2 * sums + weight) // (2 * np.maximum(weight, 1)), 0, 255)
    image = refocus(
        raw,
        m,
        Fraction(shift, m),
        interpolation=order,
        sharpen=Fraction(units, 64),
        align=align,
        border="normalise",
    )
    assert np.array_equal(image, np.where(weight > 0, want, 0))


@given(st.integers(-12, 13), st.integers(1, 3), st.data())
def test_regions_threads_and_single_pixels_of_lenses(shift, threads, data) -> None:
    m, raw = 4, drawn((37, 54, 3), np.uint16)
    a = Fraction(shift, m)
    whole = refocus(raw, m, a, border="normalise")
    rows, columns = (
        slice(*sorted(data.draw(st.tuples(st.integers(0, n), st.integers(0, n)))))
        for n in raw.shape[:2]
    )
    part = refocus(raw, m, a, border="normalise", region=(rows, columns), threads=threads)
    assert np.array_equal(part, whole[rows, columns])
    if shift % m == 0:
        lenses = refocus(raw, m, a, border="normalise", upsample=False)
        assert np.array_equal(lenses, whole[:36:4, :52:4])


def test_flat_light_field_stays_flat() -> None:
    raw = np.full((300, 700), 65535, np.uint16)
    for a in ("-2", "3/11", "2"):
        assert (refocus(raw, 11, a, border="normalise", sharpen="auto") == 65535).all()
        assert (refocus(raw, 11, a) < 65535).any()


@given(
    st.integers(1, 6),
    st.integers(-9, 10),
    shapes,
    st.integers(0, 2),
    st.sampled_from([0, 4]),
    st.sampled_from(["centred", "causal"]),
)
def test_model_of_the_hardware(m, shift, extra, order, units, align) -> None:
    raw = drawn((m + extra[0], m + extra[1]), np.uint8)
    b, a = Fraction(units, 64), Fraction(shift, m)
    exact = ExactArithmetic().refocus(
        raw, m, shift=shift, align=align, order=order, sharpen=b, border="normalise"
    )
    assert np.array_equal(
        exact,
        refocus(raw, m, a, align=align, interpolation=order, sharpen=b, border="normalise"),
    )
    if not units:
        error = error_against_operator(
            exact, raw, m, shift=shift, align=align, order=order, border="normalise"
        )
        assert np.abs(error).max() <= 0.5


def test_stored_products_are_refused() -> None:
    with pytest.raises(InputError, match="stored products cannot be normalised"):
        StoredProductArithmetic().refocus(drawn((6, 6), np.uint8), 3, shift=1, border="normalise")


def test_unknown_border_is_refused() -> None:
    with pytest.raises(InputError, match="'mirror' is not a border; use 'zero' or 'normalise'"):
        refocus(drawn((6, 6), np.uint8), 3, 0, border="mirror")  # type: ignore[arg-type]
