# SPDX-License-Identifier: Apache-2.0
"""Several slices from one column memory, against the definition of the operator."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stepped_sums import focal_stack_lines

from plenofir.refocus import gather_sums
from plenofir.refocus.focal_stack import StackLayout
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.operator import output_offset


@settings(max_examples=60, deadline=None)
@given(
    m=st.integers(1, 9),
    shifts=st.lists(st.integers(-14, 16), min_size=1, max_size=5),
    lengths=st.lists(st.integers(1, 40), min_size=1, max_size=4),
    align=st.sampled_from(["centred", "causal"]),
    data=st.data(),
)
def test_equals_the_definition(m, shifts, lengths, align, data) -> None:
    steps = [math.gcd(shift, m) for shift in shifts]
    boxes = tuple(step * data.draw(st.integers(1, m // step)) for step in steps)
    layout = StackLayout(m, tuple(shifts), align, boxes=boxes)
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    lines = [rng.integers(1, 256, length) for length in lengths]
    got = list(focal_stack_lines(lines, layout))
    assert len(got) == len(lines)
    for line, sums in zip(lines, got, strict=True):
        for shift, box, slice_sums in zip(shifts, boxes, sums, strict=True):
            offset = output_offset(m, shift, align, box)
            want = gather_sums(line, m, shift, axis=0, offset=offset, box=box)
            assert np.array_equal(slice_sums, want)


@pytest.mark.parametrize("m", [1, 2, 3, 5, 11])
def test_memory_is_never_more_than_that_of_a_set(m: int) -> None:
    for shifts in [(1,), (m,), (-m, 0, m), (-2, 0, 2), tuple(range(-3, 4))]:
        lines = StackLayout(m, shifts).history_lines
        rings = SumLayout(m, shifts).ring_lines
        assert all(line <= ring for line, ring in zip(lines, rings, strict=True))
    assert StackLayout(5, (1,)).history_lines == (1, 1, 1, 1, 1)
