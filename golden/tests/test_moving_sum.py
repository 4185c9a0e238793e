"""The moving sum engine's schedule against the definition of the operator."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plenofir.refocus import gather_sums
from plenofir.refocus.moving_sum import SumLayout, moving_sum_lines
from plenofir.refocus.operator import output_offset


@settings(max_examples=150, deadline=None)
@given(
    m=st.integers(1, 9),
    shifts=st.lists(st.integers(-14, 16), min_size=1, max_size=4),
    lengths=st.lists(st.integers(1, 40), min_size=1, max_size=4),
    align=st.sampled_from(["centred", "causal"]),
    data=st.data(),
)
def test_equals_the_definition(m, shifts, lengths, align, data) -> None:
    layout = SumLayout(m, tuple(shifts), align)
    slices = [data.draw(st.integers(0, len(shifts) - 1)) for _ in lengths]
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    lines = [rng.integers(1, 256, length) for length in lengths]
    got = list(moving_sum_lines(lines, layout, slices))
    assert len(got) == len(lines)
    for line, slice_, sums in zip(lines, slices, got, strict=True):
        offset = output_offset(m, shifts[slice_], align)
        assert np.array_equal(sums, gather_sums(line, m, shifts[slice_], axis=0, offset=offset))


@pytest.mark.parametrize("m", [1, 2, 3, 4, 6, 11])
def test_every_pixel_enters_once(m: int) -> None:
    for shift in range(-2 * m, 2 * m + 1):
        layout = SumLayout(m, (shift,))
        assert {layout.entering_phase(0, k) for k in range(m)} == set(range(m))
        ages = [layout.entering_age(0, v) for v in range(m)]
        assert min(ages) == 0 if m > 1 else ages == [layout.delay]
        # On average a pixel waits until half of the moving sum's length before its output is due.
        assert np.mean(ages) <= layout.delay


def test_memory_is_what_the_phases_need() -> None:
    # a' = 1: the M lines in the sum, and those to make the banks even.
    assert SumLayout(5, (1,)).ring_lines == (2, 2, 2, 2, 2)
    # Integer a: sums begin anew, nothing leaves.
    layout = SumLayout(5, (10,))
    assert not layout.pixels_leave
    assert layout.ring_lines == (0, 2, 4, 5, 7)
    assert sum(SumLayout(11, (11,)).ring_lines) == 50
