# SPDX-License-Identifier: Apache-2.0
"""The moving sum engine's schedule against the definition of the operator."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stepped_sums import lane_sums, moving_sum_lines

from plenofir.refocus import FilterLayout, filter_lines, gather_sums
from plenofir.refocus.focal_stack import StackLayout
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.operator import output_offset
from plenofir.refocus.sum_lanes import LaneLayout

pytestmark = pytest.mark.quick


def drawn_boxes(data: st.DataObject, m: int, shifts: list[int]) -> tuple[int, ...]:
    """A box for each slice, a multiple of gcd(a', M); or none."""
    if data.draw(st.booleans()):
        return ()
    steps = [math.gcd(shift, m) for shift in shifts]
    return tuple(step * data.draw(st.integers(1, m // step)) for step in steps)


@settings(max_examples=150, deadline=None)
@given(
    m=st.integers(1, 9),
    shifts=st.lists(st.integers(-14, 16), min_size=1, max_size=4),
    lengths=st.lists(st.integers(1, 40), min_size=1, max_size=4),
    align=st.sampled_from(["centred", "causal"]),
    any_length=st.booleans(),
    data=st.data(),
)
def test_equals_the_definition(m, shifts, lengths, align, any_length, data) -> None:
    # The rings hold real pixels, so one overwritten before it has left makes a sum wrong.
    boxes = drawn_boxes(data, m, shifts)
    layout = SumLayout(m, tuple(shifts), align, any_length, boxes)
    if any_length:
        # Back to back at full rate, as no frame is shorter than the rings require.
        lengths = [layout.reach + length for length in lengths]
        assert all(layout.least_steps(k, columns=True) == k for k in lengths)
    slices = [data.draw(st.integers(0, len(shifts) - 1)) for _ in lengths]
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    lines = [rng.integers(1, 256, length) for length in lengths]
    got = list(moving_sum_lines(lines, layout, slices))
    assert len(got) == len(lines)
    for line, slice_, sums in zip(lines, slices, got, strict=True):
        shift, box = shifts[slice_], boxes[slice_] if boxes else m
        offset = output_offset(m, shift, align, box)
        want = gather_sums(line, m, shift, axis=0, offset=offset, box=box)
        assert np.array_equal(sums, want)


@settings(max_examples=150, deadline=None)
@given(
    m=st.integers(1, 12),
    pixels=st.sampled_from([2, 4, 8, 16, 32]),
    shifts=st.lists(st.integers(-14, 16), min_size=1, max_size=3),
    lengths=st.lists(st.integers(1, 70), min_size=1, max_size=4),
    align=st.sampled_from(["centred", "causal"]),
    data=st.data(),
)
def test_several_pixels_a_token(m, pixels, shifts, lengths, align, data) -> None:
    # As above: pixels that the banks no longer hold make a sum wrong.
    boxes = drawn_boxes(data, m, shifts)
    layout = LaneLayout(SumLayout(m, tuple(shifts), align, boxes=boxes), pixels)
    slices = [data.draw(st.integers(0, len(shifts) - 1)) for _ in lengths]
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    lines = [rng.integers(1, 256, length) for length in lengths]
    got = list(lane_sums(lines, layout, slices))
    assert len(got) == len(lines)
    for line, slice_, sums in zip(lines, slices, got, strict=True):
        shift, box = shifts[slice_], boxes[slice_] if boxes else m
        offset = output_offset(m, shift, align, box)
        want = gather_sums(line, m, shift, axis=0, offset=offset, box=box)
        assert np.array_equal(sums, want)


def test_all_lines_are_of_the_first_slice_if_none_is_named() -> None:
    layout, lines = SumLayout(4, (3, -2, 8)), np.arange(1, 61).reshape(3, 20)
    offset = output_offset(4, 3, "centred")
    want = [gather_sums(line, 4, 3, axis=0, offset=offset).tolist() for line in lines]
    assert [sums.tolist() for sums in moving_sum_lines(lines, layout)] == want
    assert [sums.tolist() for sums in lane_sums(lines, LaneLayout(layout, 2))] == want
    assert [sums.tolist() for sums in filter_lines(lines, FilterLayout(4, layout.shifts))] == want


@pytest.mark.parametrize("pixels", [2, 4, 8, 16, 32])
@pytest.mark.parametrize("m", [1, 2, 3, 5, 6, 11, 40])
def test_neighbouring_outputs_take_from_banks_of_their_own(m: int, pixels: int) -> None:
    for shift in range(-m - 1, 2 * m + 2, 1 + m // 8):
        layout = LaneLayout(SumLayout(m, (shift,)), pixels)
        assert layout.banks % m == 0
        assert pixels <= layout.banks < pixels + m
        assert {layout.bank(0, place) for place in range(layout.banks)} == set(range(layout.banks))


@pytest.mark.parametrize("m", [1, 2, 3, 4, 6, 11])
def test_every_pixel_enters_once(m: int) -> None:
    for shift in range(-2 * m, 2 * m + 1):
        layout = SumLayout(m, (shift,))
        assert {layout.entering_phase(0, k) for k in range(m)} == set(range(m))
        ages = [layout.entering_age(0, v) for v in range(m)]
        assert min(ages) == 0 if m > 1 else ages == [layout.delay]
        # On average a pixel waits until half of the moving sum's length before its output is due.
        assert np.mean(ages) <= layout.delay


def overwritten(layout: SumLayout, lengths: list[int]) -> set[int]:
    """Phases of which a line is overwritten while a slice may still need it."""
    m = layout.micro_image_size
    found = set()
    for phase, ring in enumerate(layout.ring_lines):
        start, written = 0, []
        for length in lengths:
            written += [start + line for line in range(phase, length, m)]
            start += layout.least_steps(length, columns=True)
        needed = layout.oldest(phase)
        pairs = zip(written, written[ring:], strict=False) if needed else ()
        if any(later < first + needed for first, later in pairs):
            found.add(phase)
    return found


@settings(max_examples=150, deadline=None)
@given(
    m=st.integers(1, 11),
    shifts=st.lists(st.integers(-14, 24), min_size=1, max_size=3),
    lengths=st.lists(st.integers(1, 150), min_size=1, max_size=6),
    align=st.sampled_from(["centred", "causal"]),
    any_length=st.booleans(),
    data=st.data(),
)
def test_no_line_is_overwritten_while_it_is_needed(
    m, shifts, lengths, align, any_length, data
) -> None:
    boxes = drawn_boxes(data, m, shifts)
    assert not overwritten(SumLayout(m, tuple(shifts), align, any_length, boxes), lengths)


def test_frames_of_any_length_need_the_lines_that_they_get() -> None:
    # Without them frames of n M + 1 lines overwrite what is needed; and not one phase has more.
    for m, shifts in ((5, (10,)), (7, (7,)), (11, tuple(range(-11, 12)))):
        plain, layout = (SumLayout(m, shifts, any_length=any_) for any_ in (False, True))
        more = {v for v in range(m) if layout.ring_lines[v] > plain.ring_lines[v]}
        assert more
        at_full_rate = replace(layout)
        at_full_rate.__dict__["ring_lines"] = plain.ring_lines
        size = -(-layout.reach // m) * m
        found = set().union(*(overwritten(at_full_rate, [size + h] * 5) for h in range(m)))
        assert found == more


def test_memory_is_what_the_phases_need() -> None:
    # a' = 1: the M lines in the sum, and those to make the banks even.
    assert SumLayout(5, (1,)).ring_lines == (2, 2, 2, 2, 2)
    # Integer a: sums begin anew, nothing leaves.
    layout = SumLayout(5, (10,))
    assert not layout.pixels_leave
    assert layout.ring_lines == (0, 2, 4, 5, 7)
    assert sum(SumLayout(11, (11,)).ring_lines) == 50


@pytest.mark.parametrize(
    ("m", "shifts", "align", "words"),
    [
        # A running and a first sum; held ones where outputs are equal; and the group's own first
        # sum where output 0 lies within a group.
        (3, (1,), "centred", [2]),
        (3, (3,), "centred", [3]),
        (2, (2,), "centred", [4]),
        (2, (2,), "causal", [3]),
        (4, (1, 2), "centred", [2, 4]),
        (4, (4, 1), "causal", [3, 2]),
    ],
)
def test_sums_of_each_column(m, shifts, align, words) -> None:
    assert SumLayout(m, shifts, align).sum_words == max(words)
    stack = StackLayout(m, shifts, align)
    assert [stack.slice_words(n) for n in range(len(shifts))] == words


@pytest.mark.parametrize(
    ("shifts", "delay", "reach"), [((1,), 1, 3), ((3,), 3, 5), ((-3,), 5, 9), ((9, -5), 9, 17)]
)
def test_lines_come_no_earlier_than_memory_allows(shifts, delay, reach) -> None:
    plain = SumLayout(3, shifts)
    any_length, stack = SumLayout(3, shifts, any_length=True), StackLayout(3, shifts)
    assert (plain.delay, plain.reach) == (delay, reach)
    for length in (1, 2, 3, 4, 100):
        # The next line begins when the first output is out; columns also fill up a micro image,
        # or wait until no pixel is needed any more.
        whole, out = -(-length // 3) * 3, max(length, delay + 1)
        assert plain.least_steps(length, columns=True) == max(out, whole)
        assert any_length.least_steps(length, columns=True) == max(out, reach)
        assert stack.least_steps(length, columns=True) == -(-out // 3) * 3
        for layout in (plain, any_length, stack):
            assert layout.least_steps(length, columns=False) == out


@pytest.mark.parametrize(
    ("m", "shifts", "pixels", "clocks", "rows"),
    [
        (3, (1,), 1, 7, 4),
        (3, (1,), 2, 8, 8),
        (3, (1,), 8, 10, 8),
        (3, (3,), 8, 11, 8),
        (4, (1, 3), 32, 13, 8),
        (4, (1, 2), 32, 14, 8),
        (11, (-11, 0, 11), 2, 10, 16),
        (40, (60,), 32, 13, 64),
    ],
)
def test_clocks_and_rows_of_several_pixels_a_token(m, shifts, pixels, clocks, rows) -> None:
    # A clock for each level of the prefix sums, one to choose a slice, one to hold outputs.
    layout = LaneLayout(SumLayout(m, shifts), pixels)
    assert (layout.clocks, layout.rows) == (clocks, rows)


@settings(max_examples=100, deadline=None)
@given(
    m=st.integers(1, 9),
    shifts=st.lists(st.integers(-14, 16), min_size=1, max_size=3),
    data=st.data(),
)
def test_pixels_that_enter_and_leave_are_in_different_banks(m, shifts, data) -> None:
    boxes = drawn_boxes(data, m, shifts)
    layout = SumLayout(m, tuple(shifts), boxes=boxes)
    assert sum(layout.bank_lines) == sum(layout.ring_lines)
    for slice_ in range(len(shifts)) if layout.pixels_leave else ():
        for output in range(m):
            enters, leaves = (
                phase(slice_, output) for phase in (layout.entering_phase, layout.leaving_phase)
            )
            if enters != leaves:
                assert layout.bank_groups[enters] != layout.bank_groups[leaves]
            else:
                # A line and the one before it in an even ring alternate.
                assert layout.alternates
                assert layout.ring_lines[enters] % 2 == 0
