# SPDX-License-Identifier: Apache-2.0
"""Sharpening: the definition in loops of its own, its weights, and the fast path to the bit."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_refocus import random_image

from plenofir.ground.errors import InputError
from plenofir.refocus import (
    ExactArithmetic,
    StoredProductArithmetic,
    automatic_units,
    derived_moment,
    interpolated_sums,
    refocus,
    refocus_sums,
    sharpening_units,
)
from plenofir.refocus.compiled import columns, frames, plans
from plenofir.refocus.sharpening import MAX_WEIGHT_UNITS, check_sharpen, sharpened_sums, taps

aligns = st.sampled_from(["centred", "causal"])
depths = st.sampled_from([np.uint8, np.uint16])
weights = st.integers(0, MAX_WEIGHT_UNITS).map(lambda n: Fraction(n, 64)) | st.just("auto")


def by_definition(sums: np.ndarray, m: int, b: Fraction) -> list[list[Fraction]]:
    """The filter on each pixel by itself, rows then columns, in fractions."""
    rows, columns = sums.shape

    def along(line: list[Fraction]) -> list[Fraction]:
        def tap(k: int, own: int) -> Fraction:
            return line[k] if 0 <= k < len(line) else line[own]

        return [(1 + 2 * b) * x - b * (tap(k - m, k) + tap(k + m, k)) for k, x in enumerate(line)]

    lines = [along([Fraction(int(x)) for x in row]) for row in sums]
    turned = [along([lines[y][x] for y in range(rows)]) for x in range(columns)]
    return [[turned[x][y] for x in range(columns)] for y in range(rows)]


@pytest.mark.parametrize(("m", "shift", "order"), [(3, 2, 0), (5, -3, 0), (2, 1, 1), (1, 0, 0)])
def test_definition(m: int, shift: int, order: int) -> None:
    raw = random_image((2 * m + 7, 3 * m + 2), np.uint8)
    raw[raw > 128] = 255
    sums = refocus_sums(raw, m, shift=shift, order=order)
    for b in (Fraction(3, 64), Fraction(1, 16), Fraction(1, 4)):
        want = by_definition(sums, m, b)
        scale = taps(int(64 * b)).scale ** 2
        found = sharpened_sums(sums, m, int(64 * b))
        assert [[Fraction(int(x), scale) for x in row] for row in found] == want
        pixels = [
            [min(max(int((x / m ** (2 + 2 * order) + Fraction(1, 2)) // 1), 0), 255) for x in row]
            for row in want
        ]
        image = ExactArithmetic().refocus(raw, m, shift=shift, order=order, sharpen=b)
        assert image.tolist() == pixels
        assert {0, 255} <= set(np.unique(image)) or m > 1


@given(data=st.data())
def test_fast_path_equals_the_definition(data) -> None:
    m, shift = data.draw(st.integers(1, 13)), data.draw(st.integers(-30, 35))
    order, b = data.draw(st.sampled_from([0, 0, 0, 1, 2, 3])), data.draw(weights)
    align, dtype = data.draw(aligns), data.draw(depths)
    shape = tuple(m + data.draw(st.integers(0, 75)) for _ in range(2))
    shape += data.draw(st.sampled_from([(), (3,)]))
    raw = random_image(shape, dtype, data.draw(st.integers(0, 9)))
    if data.draw(st.booleans()):
        raw = np.where(raw > np.iinfo(dtype).max // 2, np.iinfo(dtype).max, 0).astype(dtype)
    ends = [sorted(data.draw(st.integers(0, n)) for _ in range(2)) for n in shape[:2]]
    region = data.draw(st.sampled_from([None, tuple(slice(*pair) for pair in ends)]))
    with pytest.MonkeyPatch.context() as patch:
        # Strips of a few pixels, and threads for them.
        patch.setattr(plans, "_BLOCK_BYTES", data.draw(st.integers(1, 99)))
        patch.setattr(frames, "_SAMPLES_FOR_A_THREAD", data.draw(st.integers(1, 9999)))
        how = {"align": align, "interpolation": order, "region": region, "threads": 2}
        image = refocus(raw, m, Fraction(shift, m), sharpen=b, **how)
    want = ExactArithmetic().refocus(raw, m, shift=shift, align=align, order=order, sharpen=b)
    assert image.dtype == raw.dtype
    assert np.array_equal(image, want if region is None else want[region])


@pytest.mark.parametrize(
    ("m", "shift", "dtype", "b"),
    [
        (16, 9, np.uint8, Fraction(1, 4)),
        (17, 9, np.uint8, "auto"),
        (70, 33, np.uint8, Fraction(13, 64)),
        (99, 1000, np.uint16, "auto"),
        (260, 7, np.uint16, "auto"),
        (12, 5, np.uint16, Fraction(15, 64)),
    ],
)
def test_extremes_and_all_white(m, shift, dtype, b) -> None:
    shape = (max(m, 150) + 3, max(m, 140) + 5)
    white = np.full(shape, np.iinfo(dtype).max, dtype)
    edges = np.where(np.indices(shape).sum(axis=0) // m % 2, white, 0).astype(dtype)
    for raw in (white, edges):
        want = ExactArithmetic().refocus(raw, m, shift=shift, sharpen=b)
        assert np.array_equal(refocus(raw, m, Fraction(shift, m), sharpen=b), want)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("units", [1, 2, 3, 4, 8, 15, 16])
def test_largest_and_smallest_sums(units, dtype) -> None:
    # a = 0 takes whole lenses, and so does a' = 1 once in M pixels, by another way: a black one
    # beside four white ones, and the other way round, have the largest sums of both signs. M up to
    # where words of 16 bits are too narrow.
    b = Fraction(units, 64)
    for m in (*range(1, 18), 21, 22, 32, 33) if dtype == np.uint8 else (1, 2, 3, 7, 16, 17):
        lenses = np.indices((4, 5)).sum(axis=0) % 2 * np.iinfo(dtype).max
        raw = lenses.astype(dtype).repeat(m, 0).repeat(m, 1)
        for image, shift in itertools.product((raw, ~raw, raw[m // 2 :, m // 2 :]), (0, 1)):
            want = ExactArithmetic().refocus(image, m, shift=shift, sharpen=b)
            assert np.array_equal(refocus(image, m, Fraction(shift, m), sharpen=b), want), m


def test_long_lines_and_many_lines() -> None:
    # More samples than a chunk of the columns, more lines than a vector has lanes.
    for m in (3, 33):
        raw = random_image((2 * m + 70, columns.CHUNK + 2 * m + 5), np.uint8)
        want = ExactArithmetic().refocus(raw, m, shift=2, sharpen="1/16")
        assert np.array_equal(refocus(raw, m, Fraction(2, m), sharpen="1/16", threads=1), want)


@pytest.mark.parametrize(("m", "shift"), [(5, 3), (6, 2), (6, 3), (4, -2), (3, 7), (5, 10), (1, 0)])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_moment_is_that_of_the_operator(m: int, shift: int, order: int) -> None:
    if order and np.gcd(shift, m) > 1:
        # The outputs of a run of g differ in their means, which interpolation mixes.
        return
    # Where in the object, 2 M places to a lens, each pixel of the raw image looks.
    lens, u = np.divmod(np.arange(60 * m), m)
    place = 2 * m * (lens - 30) + shift * (2 * u - (m - 1))
    means = [
        interpolated_sums(place**power, m, shift, axis=0, order=order) / m ** (1 + order)
        for power in (1, 2)
    ]
    moment = (means[1] - means[0] ** 2)[25 * m : 35 * m] / (2 * m) ** 2
    assert moment == pytest.approx(float(derived_moment(m, shift, order)))


def test_weights() -> None:
    assert [automatic_units(m, s) for m, s in ((5, 3), (11, 4), (4, 2), (6, 3), (6, 2))] == [
        *(4, 4, 3, 3, 4)
    ]
    for m in range(1, 14):
        for shift in range(-2 * m, 2 * m + 1):
            for order in range(4):
                units = automatic_units(m, shift, order)
                assert 0 <= units <= MAX_WEIGHT_UNITS
                if shift % m == 0:
                    assert units == 0
                else:
                    exact = 48 * derived_moment(m, shift, order)
                    assert abs(units - exact) <= Fraction(1, 2)
    options = "1/16", 0.0625, Fraction(1, 16), "off", 0, "auto", "1/64", "1/4"
    assert [sharpening_units(x, 5, 3) for x in options] == [4, 4, 4, 0, 0, 4, 1, 16]
    assert sharpening_units("auto", 5, 3, 1) == 8
    assert [check_sharpen(x) for x in options] == list(options)


def test_integer_settings_and_flat_pictures_stay_as_they_are() -> None:
    raw = random_image((70, 80, 3), np.uint8)
    assert np.array_equal(refocus(raw, 5, 2, sharpen="auto"), refocus(raw, 5, 2))
    lenses = refocus(raw, 5, 1, sharpen="auto", upsample=False)
    assert np.array_equal(lenses, refocus(raw, 5, 1, upsample=False))
    # All views see the inner part; missing views darken the rest.
    for level in (0, 100, 255):
        flat = np.full((80, 80), level, np.uint8)
        sharp = refocus(flat, 5, "3/5", sharpen="auto")
        assert (sharp[30:50, 30:50] == level).all()
        assert (refocus(flat, 5, "1/5", sharpen="1/16")[20:60, 20:60] == level).all()


@pytest.mark.parametrize(
    "b", ["1/24", "2", "17/64", -0.1, Fraction(-1, 64), "x", "1e9", True, None, float("nan"), "1/0"]
)
def test_bad_weights(b: object) -> None:
    raw = random_image((20, 20), np.uint8)
    advice = r"^sharpen: .*use auto, off, or a multiple of 1/64"
    with pytest.raises(InputError, match=advice):
        refocus(raw, 5, "3/5", sharpen=b)
    with pytest.raises(InputError, match=advice):
        check_sharpen(b)


def test_what_cannot_be_sharpened() -> None:
    raw = random_image((20, 20), np.uint8)
    with pytest.raises(InputError, match=r"^sharpen: .*one pixel for each micro lens"):
        refocus(raw, 5, 1, sharpen="1/16", upsample=False)
    stored = StoredProductArithmetic()
    with pytest.raises(InputError, match=r"^sharpen: stored products cannot be sharpened"):
        stored.refocus(raw, 5, shift=3, sharpen="auto")
    assert np.array_equal(
        stored.refocus(raw, 5, shift=5, sharpen="auto"), stored.refocus(raw, 5, shift=5)
    )
