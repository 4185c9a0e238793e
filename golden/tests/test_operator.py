"""The operator's forms agree with each other and with the equation, for any M, a' and size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.refocus import (
    filter_lines,
    gather_sums,
    moving_sums,
    output_delay,
    output_offset,
    refocus,
    refocus_sums,
    scatter_sums,
    switch_matrix,
    tap_count,
)

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


@given(
    micro_image_sizes,
    shifts,
    st.lists(st.integers(1, 40), min_size=1, max_size=4),
    alignments,
    seeds,
)
def test_switched_filter_equals_gather_with_lines_back_to_back(m, shift, lengths, align, seed):
    lines = [samples(seed + i, length) for i, length in enumerate(lengths)]
    offset = output_offset(m, shift, align)
    filtered = list(filter_lines(lines, m, shift, align=align))
    assert len(filtered) == len(lines)
    for line, got in zip(lines, filtered, strict=True):
        assert np.array_equal(got, gather_sums(line, m, shift, axis=0, offset=offset))


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
    # Eqs. (6.8) and (6.9).
    assert switch_matrix(3, 1).astype(int).tolist() == [[1, 1, 1], [1, 1, 1], [1, 1, 1]]
    assert switch_matrix(3, 2).astype(int).tolist() == [
        [0, 0, 1, 1, 1],
        [0, 1, 1, 1, 0],
        [1, 1, 1, 0, 0],
    ]


@given(micro_image_sizes, shifts)
def test_each_phase_closes_m_neighbouring_switches(m, shift):
    switches = switch_matrix(m, shift)
    assert switches.shape == (m, tap_count(m, shift))
    for row in switches:
        closed = np.flatnonzero(row)
        assert len(closed) == m
        assert closed[-1] - closed[0] == m - 1
    # No tap is needed before the first or behind the last that some phase closes.
    assert switches.any(axis=0)[[0, -1]].all()


@given(micro_image_sizes, shifts, alignments)
def test_delay_lies_within_the_filter(m, shift, align):
    assert 0 <= output_delay(m, shift, align) <= tap_count(m, shift) - 1


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
    sums = refocus_sums(raw, m, a * m, align="causal")
    blocks = sums.reshape(4, m, 5, m)
    assert (blocks == blocks[:, :1, :, :1]).all()


def test_linear_in_the_image():
    rng = np.random.default_rng(1)
    first, second = rng.integers(0, 1000, (2, 17, 23))
    want = refocus_sums(first, 5, 3) + 7 * refocus_sums(second, 5, 3)
    assert np.array_equal(refocus_sums(first + 7 * second, 5, 3), want)


def test_unknown_alignment_is_refused():
    with pytest.raises(ValueError, match="align"):
        output_offset(3, 1, "left")  # type: ignore[arg-type]
