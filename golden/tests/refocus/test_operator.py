# SPDX-License-Identifier: Apache-2.0
"""The operator's forms agree with each other and with the equation, for any M, a' and size."""

from fractions import Fraction
from math import gcd

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.ground.errors import InputError
from plenofir.refocus import (
    ExactArithmetic,
    FilterLayout,
    filter_lines,
    gather_sums,
    interpolated_sums,
    moving_sums,
    output_offset,
    refocus,
    refocus_sums,
    scatter_sums,
)

pytestmark = pytest.mark.quick

micro_image_sizes = st.integers(1, 13)
shifts = st.integers(-20, 25)
alignments = st.sampled_from(["centred", "causal"])
seeds = st.integers(0, 2**32 - 1)


def samples(seed: int, length: int, largest: int = 65535) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, largest, length, endpoint=True)


@given(micro_image_sizes, shifts, st.integers(1, 60), alignments, seeds)
def test_gather_equals_scatter_and_moving_sum(m, shift, length, align, seed):
    x = samples(seed, length)
    offset = output_offset(m, shift, align)
    want = scatter_sums(x, m, shift, axis=0, offset=offset)
    assert np.array_equal(gather_sums(x, m, shift, axis=0, offset=offset), want)
    assert np.array_equal(moving_sums(x, m, shift, axis=0, offset=offset), want)


@given(micro_image_sizes, shifts, st.integers(0, 12), st.integers(1, 60), alignments, seeds)
def test_boxes_of_fewer_samples_in_all_forms(m, shift, number, length, align, seed):
    common = gcd(shift, m)
    box = common * (1 + number % (m // common))
    x = samples(seed, length)
    offset = output_offset(m, shift, align, box)
    want = scatter_sums(x, m, shift, axis=0, offset=offset, box=box)
    assert np.array_equal(gather_sums(x, m, shift, axis=0, offset=offset, box=box), want)
    assert np.array_equal(moving_sums(x, m, shift, axis=0, offset=offset, box=box), want)
    # Inside each output is the sum of `box` pixels.
    reach = m * (abs(shift) + 2)
    ones = np.ones(4 * reach)
    inside = gather_sums(ones, m, shift, axis=0, offset=offset, box=box)[reach + m : -reach - m]
    assert np.all(inside == box)


@given(micro_image_sizes, st.integers(-4, 6), seeds)
def test_a_box_of_the_shift_shows_a_focused_camera_s_micro_images(m, shift, seed):
    """Neighbouring micro images that show one line M / a' pixels apart give that line."""
    box = abs(shift)
    if not 1 <= box <= m or gcd(shift, m) > 1:
        return
    # An object in steps of |a'| pixels of the picture; sample u of micro image j is at M j + u a'.
    pictured = np.repeat(samples(seed, 40 * m), box)
    j, u = np.divmod(np.arange(8 * m), m)
    line = pictured[m * j + u * shift + 20 * m * box]
    offset = output_offset(m, shift, "causal", box)
    sums = gather_sums(line, m, shift, axis=0, offset=offset, box=box)
    k = np.arange(8 * m)
    # The box holds the places k - B + 1 .. k; those of one sample of the object are equal.
    places = k[:, None] - np.arange(box) + 20 * m * box
    inside = slice(m * (box + 2), -m * (box + 2))
    assert np.array_equal(sums[inside], pictured[places].sum(axis=1)[inside])


@pytest.mark.parametrize(
    ("m", "shift", "box", "message"),
    [(5, 5, 3, "multiple of gcd"), (5, 1, 6, "5 samples or fewer"), (5, 1, 0, "1 or more")],
)
def test_boxes_that_do_not_exist(m, shift, box, message):
    raw = np.zeros((10, 10), np.uint8)
    for call in (
        lambda: refocus(raw, m, Fraction(shift, m), box=box),
        lambda: ExactArithmetic().refocus(raw, m, shift=shift, box=box),
        lambda: refocus_sums(raw, m, shift=shift, box=box),
    ):
        with pytest.raises(InputError, match=message):
            call()


@given(
    micro_image_sizes,
    st.lists(shifts, min_size=1, max_size=4),
    st.lists(st.integers(1, 40), min_size=1, max_size=4),
    alignments,
    seeds,
)
def test_switched_filter_equals_gather_with_lines_back_to_back(m, shifts_, lengths, align, seed):
    """Any slice of the set for any line, lines of any length, no gap between them."""
    lines = [samples(seed + i, length) for i, length in enumerate(lengths)]
    slices = [(seed + 7 * i) % len(shifts_) for i in range(len(lines))]
    layout = FilterLayout(m, tuple(shifts_), align)
    filtered = list(filter_lines(lines, layout, slices))
    assert len(filtered) == len(lines)
    for line, slice_, got in zip(lines, slices, filtered, strict=True):
        shift = shifts_[slice_]
        offset = output_offset(m, shift, align)
        assert np.array_equal(got, gather_sums(line, m, shift, axis=0, offset=offset))


@given(
    micro_image_sizes,
    st.lists(st.integers(-3, 3), min_size=1, max_size=3),
    st.lists(st.integers(1, 40), min_size=1, max_size=4),
    alignments,
    seeds,
)
def test_hold_needs_fewer_taps_and_gives_the_same(m, planes, lengths, align, seed):
    shifts_ = tuple(m * a * (1 if m % 2 else 2) for a in planes)
    held = FilterLayout(m, shifts_, align, hold=True)
    full = FilterLayout(m, shifts_, align)
    assert held.can_hold
    assert held.taps == full.taps - (m - 1)
    assert held.delay == full.delay
    assert held.switches.sum(axis=2).max() == 1
    lines = [samples(seed + i, length) for i, length in enumerate(lengths)]
    slices = [(seed + i) % len(shifts_) for i in range(len(lines))]
    for got, want in zip(
        filter_lines(lines, held, slices), filter_lines(lines, full, slices), strict=True
    ):
        assert np.array_equal(got, want)


def test_hold_is_for_equal_outputs_only():
    assert not FilterLayout(3, (1,)).can_hold
    assert not FilterLayout(3, (0, 2)).can_hold
    # M = 2, a = 1: the centred picture is shifted by half a micro image.
    assert not FilterLayout(2, (2,)).can_hold
    assert FilterLayout(2, (2,), "causal").can_hold


@given(st.integers(1, 7), st.integers(-6, 8), st.integers(1, 3), st.integers(1, 40), seeds)
def test_interpolation_is_a_moving_sum_of_the_sums(m, shift, order, length, seed):
    x = samples(seed, length)
    got = interpolated_sums(x, m, shift, axis=0, align="causal", order=order)
    want = gather_sums(x, m, shift, axis=0)
    for _ in range(order):
        want = np.convolve(want, np.ones(m, dtype=np.int64))[:length]
    assert np.array_equal(got, want)


@pytest.mark.parametrize("m", [2, 3, 5])
def test_linear_interpolation_has_a_triangle_for_kernel(m):
    # One bright micro image: a point of the plane a = 0.
    raw = np.zeros((m * 7, m * 7), dtype=np.uint8)
    raw[3 * m : 4 * m, 3 * m : 4 * m] = 250
    line = refocus(raw, m, 0, interpolation="linear").astype(float)[3 * m + m // 2]
    triangle = np.convolve(np.ones(m), np.ones(m)) / m
    peak = int(line.argmax())
    got = line[peak - m + 1 : peak + m] / line.max()
    assert np.allclose(got, triangle / triangle.max(), atol=0.01)


@given(micro_image_sizes, shifts, seeds)
def test_sums_by_hand(m, shift, seed):
    # The definition (Eq. 6.1) spelled out for one line, outputs from far left to far right.
    length = 3 * m + 1
    x = samples(seed, length)
    reach = m * (abs(shift) + 2)
    sums = dict.fromkeys(range(-reach, length + reach), 0)
    for k in range(length):
        for n in range(m):
            sums[k + n + (k % m) * (shift - 1)] += int(x[k])
    offset = output_offset(m, shift, "centred")
    want = [sums.get(k + offset, 0) for k in range(length)]
    assert gather_sums(x, m, shift, axis=0, offset=offset).tolist() == want


def test_switch_rows_of_the_thesis():
    # Eqs. (6.7), with the write enable, (6.8) and (6.9).
    held = FilterLayout(3, (0,), "causal", hold=True)
    assert held.switches[0].astype(int).tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert FilterLayout(3, (1,)).switches[0].all()
    assert FilterLayout(3, (2,)).switches[0].astype(int).tolist() == [
        [0, 0, 1, 1, 1],
        [0, 1, 1, 1, 0],
        [1, 1, 1, 0, 0],
    ]


@given(micro_image_sizes, st.lists(shifts, min_size=1, max_size=4), alignments)
def test_each_phase_closes_m_neighbouring_switches(m, shifts_, align):
    layout = FilterLayout(m, tuple(shifts_), align)
    assert layout.switches.shape == (len(shifts_), m, layout.taps)
    for row in layout.switches.reshape(-1, layout.taps):
        closed = np.flatnonzero(row)
        assert len(closed) == m
        assert closed[-1] - closed[0] == m - 1
    # No tap is needed before the first or after the last that some phase closes.
    assert layout.switched[[0, -1]].all()
    assert 0 <= layout.delay <= layout.taps - 1


@given(micro_image_sizes, shifts)
def test_one_slice_needs_the_taps_of_the_formula(m, shift):
    assert FilterLayout(m, (shift,)).taps == m + (m - 1) * abs(shift - 1)


@given(st.integers(1, 9), st.lists(shifts, min_size=1, max_size=4))
def test_a_centred_set_needs_no_more_taps_than_its_largest(m, shifts_):
    # Half a tap more where (M-1) a' is odd.
    most = max(FilterLayout(m, (shift,)).taps for shift in shifts_)
    assert most <= FilterLayout(m, tuple(shifts_)).taps <= most + 1


@given(st.integers(1, 9), st.integers(-12, 15))
def test_white_stays_white_away_from_the_borders(m, shift):
    border = m * (abs(shift) + 2)
    size = 2 * border + 3 * m
    white = np.full((size, size), 255, dtype=np.uint8)
    image = refocus(white, m, f"{shift}/{m}")
    assert (image[border:-border, border:-border] == 255).all()


@given(micro_image_sizes, shifts)
def test_a_point_stays_put_while_focus_is_stepped(m, shift):
    # The replica of a micro image's central pixel: within half a pixel of its place (odd M).
    m = m | 1
    length = 2 * m * (abs(shift) + 3) + m
    point = m * (length // m // 2) + m // 2
    x = np.zeros(length, dtype=np.int64)
    x[point] = 1
    sums = gather_sums(x, m, shift, axis=0, offset=output_offset(m, shift, "centred"))
    assert np.flatnonzero(sums).mean() == point


@given(st.integers(1, 6), st.integers(-4, 8))
def test_integer_focus_repeats_one_value_over_each_micro_image(m, a):
    raw = np.random.default_rng(0).integers(0, 256, (4 * m, 5 * m), dtype=np.uint8)
    sums = refocus_sums(raw, m, shift=a * m, align="causal")
    blocks = sums.reshape(4, m, 5, m)
    assert (blocks == blocks[:, :1, :, :1]).all()


def test_linear_in_the_image():
    rng = np.random.default_rng(1)
    first, second = rng.integers(0, 1000, (2, 17, 23))
    want = refocus_sums(first, 5, shift=3) + 7 * refocus_sums(second, 5, shift=3)
    assert np.array_equal(refocus_sums(first + 7 * second, 5, shift=3), want)


def test_unknown_alignment_is_refused():
    with pytest.raises(ValueError, match="align"):
        output_offset(3, 1, "left")  # type: ignore[arg-type]


@pytest.mark.parametrize("m", [4, 5, 6])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_even_m_moves_pictures_by_halves(m: int, order: int) -> None:
    """Pixel u of lens j is seen at M j + c + a' (u - c), and (n + a' mod 2) / 2 more for even M."""
    c, lens = (m - 1) / 2, 30
    for shift in range(-3, 4):
        more = (order + shift % 2) / 2 if m % 2 == 0 else 0
        for u in range(m):
            line = np.zeros(60 * m, np.int64)
            line[lens * m + u] = 1
            sums = interpolated_sums(line, m, shift, axis=0, order=order)
            middle = (sums * np.arange(sums.size)).sum() / sums.sum()
            assert middle == pytest.approx(lens * m + c + shift * (u - c) + more)
