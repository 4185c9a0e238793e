# SPDX-License-Identifier: Apache-2.0
"""The call for users: sizes, types, rounding, focus settings, bad input."""

from fractions import Fraction
from math import gcd

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.ground.errors import InputError
from plenofir.refocus import (
    ExactArithmetic,
    StoredProductArithmetic,
    focus_to_shift,
    interpolated_sums,
    refocus,
    refocus_sums,
    setting_names,
    shift_to_name,
    shift_to_text,
)
from plenofir.refocus.operator import clamped_shift

pytestmark = pytest.mark.quick


def random_image(shape: tuple[int, ...], dtype: type, seed: int = 0) -> np.ndarray:
    largest = np.iinfo(dtype).max
    return np.random.default_rng(seed).integers(0, largest, shape, dtype, endpoint=True)


@given(
    st.integers(1, 9),
    st.integers(-14, 20),
    st.integers(0, 12),
    st.integers(0, 12),
    st.sampled_from([np.uint8, np.uint16]),
    st.booleans(),
    st.sampled_from(["centred", "causal"]),
)
def test_correctly_rounded_halves_up(m, shift, extra_rows, extra_columns, dtype, rgb, align):
    shape = (m + extra_rows, m + extra_columns) + ((3,) if rgb else ())
    raw = random_image(shape, dtype)
    image = refocus(raw, m, Fraction(shift, m), align=align)
    assert image.dtype == raw.dtype
    assert image.shape == raw.shape
    sums = refocus_sums(raw, m, shift=shift, align=align)
    for got, total in zip(image.flat, sums.flat, strict=True):
        exact = Fraction(int(total), m * m)
        assert Fraction(-1, 2) < int(got) - exact <= Fraction(1, 2)


def test_channels_are_independent():
    raw = random_image((21, 17, 3), np.uint8)
    image = refocus(raw, 4, "3/4")
    for channel in range(3):
        assert np.array_equal(image[:, :, channel], refocus(raw[:, :, channel], 4, "3/4"))


def test_one_pixel_micro_images_leave_the_image_alone():
    raw = random_image((5, 6), np.uint16)
    for a in (-3, 0, 1, 8):
        assert np.array_equal(refocus(raw, 1, a), raw)


def test_transposed_image_gives_the_transposed_picture():
    raw = random_image((25, 35), np.uint8)
    assert np.array_equal(refocus(raw.T, 5, "-3/5"), refocus(raw, 5, "-3/5").T)


@pytest.mark.parametrize(
    ("a", "m", "shift"),
    [
        (1, 5, 5),
        (-2, 3, -6),
        ("0", 7, 0),
        ("-3/5", 5, -3),
        ("2/4", 4, 2),
        ("1/2", 4, 2),
        (Fraction(7, 11), 11, 7),
        (" 1 ", 3, 3),
        (np.int64(2), np.uint8(200), 400),
    ],
)
def test_focus_settings(a, m, shift):
    assert focus_to_shift(a, m) == shift


@given(st.integers(1, 20), st.integers(-100, 100))
def test_focus_text_round_trip(m, shift):
    assert focus_to_shift(shift_to_text(shift, m), m) == shift


def test_focus_settings_as_text_and_names():
    texts = [shift_to_text(shift, 5) for shift in (-10, -3, 0, 4, 5, 6)]
    assert texts == ["-2", "-3/5", "0", "4/5", "1", "6/5"]
    assert shift_to_name(-3, 5) == "-3_5"
    assert setting_names([Fraction(7, 5)], 5) == ["a7_5"]
    fifths = [Fraction(n, 5) for n in (5, -3, 0)]
    assert setting_names([*fifths, Fraction("0.2062")], 5) == [
        *("4_a1", "1_a-3_5", "2_a0", "3_a0.2062")
    ]
    whole = [Fraction(n) for n in range(10)]
    assert setting_names(whole, 1)[8:] == ["09_a8", "10_a9"]
    assert setting_names(whole[:9], 1)[8] == "9_a8"


@pytest.mark.parametrize("a", ["1/3", "1/0", "x", "", "0.5", "1e0", "1_0", None, 0.5, True, "nan"])
def test_bad_focus_settings(a):
    with pytest.raises(InputError, match=r"^a: "):
        refocus(random_image((10, 10), np.uint8), 5, a)


@pytest.mark.parametrize(
    ("raw", "m", "message"),
    [
        (np.zeros((10, 10), np.float32), 5, "float32"),
        (np.zeros((10, 10), np.int16), 5, "int16"),
        (np.zeros((10, 10, 4), np.uint8), 5, "4 channels"),
        (np.zeros((10, 10, 1), np.uint8), 5, "1 channels"),
        (np.zeros(10, np.uint8), 5, "1 dimensions"),
        (np.zeros((4, 10), np.uint8), 5, "less than one micro image"),
        (np.zeros((10, 4), np.uint8), 5, "less than one micro image"),
        (np.zeros((10, 10), np.uint8), 0, "must be an integer, 1 or more"),
        (np.zeros((10, 10), np.uint8), -5, "must be an integer, 1 or more"),
        (np.zeros((10, 10), np.uint8), 2.5, "must be an integer"),
        (np.ma.masked_array(np.zeros((10, 10), np.uint8)), 5, "masked array"),
    ],
)
def test_bad_images(raw, m, message):
    with pytest.raises(InputError, match=message) as caught:
        refocus(raw, m, 0)
    assert "\n" not in str(caught.value)


def test_bad_options():
    raw = np.zeros((10, 10), np.uint8)
    with pytest.raises(InputError, match="align"):
        refocus(raw, 5, 0, align="left")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="interpolation"):
        refocus(raw, 5, 0, interpolation="cubic")  # type: ignore[arg-type]
    for options in ({"region": (slice(0.5), slice(3))}, {"threads": 1.5}, {"upsample": False}):
        with pytest.raises(InputError, match=f"^{next(iter(options))}: "):
            refocus(raw, 5, "1/5", **options)  # type: ignore[arg-type]


def test_bad_memory_for_the_result():
    raw = random_image((12, 12), np.uint8)
    read_only = np.zeros((10, 10), np.uint8)
    read_only.flags.writeable = False
    for out in (
        read_only,
        np.ma.masked_array(np.zeros((10, 10), np.uint8)),
        np.zeros((10, 10), ">u2"),
        np.zeros((10, 10), np.uint8).tolist(),
        raw[:10, :10],
        raw.reshape(-1)[:100].reshape(10, 10),
    ):
        with pytest.raises(InputError, match=r"^out: ") as refused:
            refocus(raw[2:, 2:], 5, 1, out=out)
        assert "\n" not in str(refused.value)


ARITHMETICS = (ExactArithmetic(), StoredProductArithmetic())


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_any_order_of_the_same_pixels(dtype):
    """Byte-swapped, read-only, reversed, transposed, in a file: the values alone count."""
    raw = random_image((21, 18, 3), dtype)
    read_only = raw.copy()
    read_only.flags.writeable = False
    same = (
        raw.astype(raw.dtype.newbyteorder()),
        read_only,
        raw[::-1, :, ::-1].copy()[::-1, :, ::-1],
        np.asfortranarray(raw),
        np.repeat(raw, 2, axis=1)[:, ::2],
    )
    want = refocus(raw, 3, "2/3")
    for image in same:
        got = refocus(image, np.int64(3), "2/3")
        assert got.dtype == raw.dtype
        assert np.array_equal(got, want)
        for arithmetic in ARITHMETICS:
            got = arithmetic.refocus(image, np.uint8(3), shift=np.int16(2))
            assert got.dtype == raw.dtype
            assert np.array_equal(got, arithmetic.refocus(raw, 3, shift=2))


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=lambda a: a.kind)
@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"raw": np.zeros((9, 9))}, "raw"),
        ({"raw": [[1, 2], [3, 4]]}, "raw"),
        ({"raw": np.zeros((9, 9, 4), np.uint8)}, "raw"),
        ({"raw": np.ma.masked_array(np.zeros((9, 9), np.uint8))}, "raw"),
        ({"micro_image_size": 0}, "M"),
        ({"micro_image_size": "3"}, "M"),
        ({"shift": 0.5}, "shift"),
        ({"shift": "1/3"}, "shift"),
        ({"shift": True}, "shift"),
        ({"align": "left"}, "align"),
        ({"order": 4}, "order"),
    ],
    ids=str,
)
def test_the_arithmetics_check_their_arguments(arithmetic, change, where):
    arguments = {"raw": np.zeros((9, 9), np.uint8), "micro_image_size": 3, "shift": 1, **change}
    with pytest.raises(InputError, match=f"^{where}: ") as refused:
        arithmetic.refocus(**arguments)
    assert "\n" not in str(refused.value)


def test_shift_and_focus_setting_cannot_be_mixed_up():
    raw = random_image((9, 9), np.uint8)
    for arithmetic in ARITHMETICS:
        with pytest.raises(TypeError, match="positional"):
            arithmetic.refocus(raw, 3, 1)


@given(
    st.integers(1, 6),
    st.integers(-60, 60),
    st.tuples(st.integers(1, 15), st.integers(1, 15)),
    st.sampled_from(["centred", "causal"]),
    st.integers(0, 2),
)
def test_clamping_changes_no_sum(m, shift, shape, align, order):
    raw = random_image(shape, np.uint8)
    bounded = clamped_shift(m, shift, shape)
    assert (bounded - shift) % m == 0
    assert abs(bounded) <= min(abs(shift), 2 * max(shape) + 4 * m)
    # A box of fewer samples shows where the view that stays in place lies.
    for box in (m, gcd(m, shift)):
        options = {"align": align, "order": order, "box": box}
        rows = interpolated_sums(raw, m, shift, axis=1, **options)
        want = interpolated_sums(rows, m, shift, axis=0, **options)
        assert np.array_equal(refocus_sums(raw, m, shift=shift, **options), want)


@pytest.mark.parametrize("a", [10**5, -(10**8), 10**21, "-1" + 300 * "0"])
def test_far_beyond_the_picture(a):
    for m in (1, 2, 5):
        raw = random_image((3 * m, 4 * m), np.uint8)
        image = refocus(raw, m, a)
        # The middle view is the only one that stays in place.
        lenses = raw[m // 2 :: m, m // 2 :: m].astype(np.int64) * (m % 2)
        want = ((lenses + m * m // 2) // (m * m)).repeat(m, 0).repeat(m, 1)
        assert np.array_equal(image, want)
        assert np.array_equal(image, ExactArithmetic().refocus(raw, m, shift=int(a) * m))
        assert np.array_equal(refocus(raw, m, a, upsample=False), want[::m, ::m])


def test_regions_have_no_steps():
    raw = random_image((9, 9), np.uint8)
    part = refocus(raw, 3, "1/3", region=(slice(0, 5, 1), slice(2, None, 1)))
    assert np.array_equal(part, refocus(raw, 3, "1/3")[:5, 2:])
    for step in (0, 2, -1):
        with pytest.raises(InputError, match="region"):
            refocus(raw, 3, "1/3", region=(slice(0, 5, step), slice(None)))


@pytest.mark.parametrize(("m", "a"), [(True, 1), (5, True), (5.0, 1), (5, 1.0), (5, [1]), (5, {})])
def test_settings_of_other_types_are_refused_after_equal_ones_were_taken(m, a):
    raw = np.zeros((10, 10), np.uint8)
    refocus(raw, 1, 1), refocus(raw, 5, 1)
    with pytest.raises(InputError):
        refocus(raw, m, a)
