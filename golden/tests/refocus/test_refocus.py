"""The call for users: sizes, types, rounding, focus settings, bad input."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.errors import InputError
from plenofir.refocus import focus_to_shift, refocus, refocus_sums, shift_to_text

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
    sums = refocus_sums(raw, m, shift, align=align)
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
    ],
)
def test_focus_settings(a, m, shift):
    assert focus_to_shift(a, m) == shift


@given(st.integers(1, 20), st.integers(-100, 100))
def test_focus_text_round_trip(m, shift):
    assert focus_to_shift(shift_to_text(shift, m), m) == shift


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
        (np.zeros((10, 10), np.uint8), 0, "too small"),
        (np.zeros((10, 10), np.uint8), -5, "too small"),
        (np.zeros((10, 10), np.uint8), 2.5, "not an integer"),
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
