# SPDX-License-Identifier: Apache-2.0
"""Integer sharpness, depth index and all-in-focus picture against their plain definition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plenofir.camera.lightfield.stack import focal_stack
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import read_image
from plenofir.refocus.sharpness import (
    depth_index,
    lens_sums,
    local_sharpness,
    slice_weight,
    vote,
)

pytestmark = pytest.mark.quick


def plain_sharpness(image, m: int, radius: int) -> list[list[int]]:
    rows, columns = image.shape[:2]
    high, wide = -(-rows // m), -(-columns // m)
    sums = [[0] * wide for _ in range(high)]
    for y in range(rows):
        for x in range(columns):
            pixel = [int(value) for value in np.atleast_1d(image[y, x])]
            luma = pixel[0] if len(pixel) == 1 else pixel[0] + 2 * pixel[1] + pixel[2]
            sums[y // m][x // m] += luma
    bends = [[0] * wide for _ in range(high)]
    for t in range(high):
        for s in range(wide):
            for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                if 0 <= t + down < high and 0 <= s + right < wide:
                    bends[t][s] += sums[t][s] - sums[t + down][s + right]
    window = range(-radius, radius + 1)
    return [
        [
            sum(
                abs(bends[t + i][s + j])
                for i in window
                for j in window
                if 0 <= t + i < high and 0 <= s + j < wide
            )
            for s in range(wide)
        ]
        for t in range(high)
    ]


@settings(max_examples=40, deadline=None)
@given(
    m=st.integers(1, 4),
    size=st.tuples(st.integers(1, 17), st.integers(1, 17)),
    channels=st.sampled_from([(), (3,)]),
    slices=st.integers(1, 4),
    radius=st.integers(0, 3),
    levels=st.sampled_from([2, 256]),
    seed=st.integers(0, 1000),
)
def test_equals_the_plain_definition(m, size, channels, slices, radius, levels, seed) -> None:
    rng = np.random.default_rng(seed)
    stack = rng.integers(0, levels, (slices, *size, *channels)).astype(np.uint8)
    got = depth_index(stack, m, radius)
    energies = [plain_sharpness(image, m, radius) for image in stack]
    for image, energy in zip(stack, energies, strict=True):
        assert local_sharpness(image, m, radius).tolist() == energy
    for y in range(size[0]):
        for x in range(size[1]):
            candidates = [energy[y // m][x // m] for energy in energies]
            best = candidates.index(max(candidates))
            assert got.index[y // m, x // m] == best
            assert np.array_equal(got.image[y, x], stack[best, y, x])


@settings(max_examples=25, deadline=None)
@given(
    shifts=st.lists(st.integers(-9, 9), min_size=1, max_size=5, unique=True).map(sorted),
    down=st.booleans(),
    confidence=st.sampled_from([0, 40, 900]),
    seed=st.integers(0, 1000),
)
def test_depth_between_slices_equals_the_plain_definition(shifts, down, confidence, seed) -> None:
    shifts = shifts[::-1] if down else shifts
    stack = np.random.default_rng(seed).integers(0, 256, (len(shifts), 8, 10)).astype(np.uint8)
    got = depth_index(stack, 2, 1, confidence=confidence, shifts=shifts)
    energies = [
        np.array(plain_sharpness(image, 2, 1)) * slice_weight(shift, 2) >> 4
        for image, shift in zip(stack, shifts, strict=True)
    ]
    for place in np.ndindex(4, 5):
        values = [int(energy[place]) for energy in energies]
        best = values.index(max(values))
        want, focus = (best, 128, 0), shifts[best] / 2
        if 0 < best < len(shifts) - 1:
            before, own, after = values[best - 1 : best + 2]
            p = abs(shifts[best + 1] - shifts[best]) * (own - before)
            q = abs(shifts[best] - shifts[best - 1]) * (own - after)
            curvature = (2 * own - before - after) // 2 ** max(confidence.bit_length() - 5, 0)
            want = best, min(255, 256 * p // (p + q)), max(1, min(255, curvature))
            low, high = (shifts[best] + shifts[best + step] for step in (-1, 1))
            focus = (low + (high - low) * (want[1] + 0.5) / 256) / 4
        assert got.focus(shifts, 2)[place] == pytest.approx(focus)
        assert (got.index[place], got.fraction[place], got.confidence[place]) == want


def plain_vote(index, sure, radius: int) -> list[list[int]]:
    high, wide = len(index), len(index[0])
    voted = [[0] * wide for _ in range(high)]
    window = range(-radius, radius + 1)
    for t in range(high):
        for s in range(wide):
            near = [(t + i, s + j) for i in window for j in window]
            votes = [index[y][x] for y, x in near if 0 <= y < high and 0 <= x < wide and sure[y][x]]
            if sure[t][s]:
                voted[t][s] = index[t][s]
            elif votes:
                voted[t][s] = min(set(votes), key=lambda slice_: (-votes.count(slice_), slice_))
            elif t:
                voted[t][s] = voted[t - 1][s]
            else:
                voted[t][s] = voted[t][s - 1] if s else index[t][s]
    return voted


@settings(max_examples=60, deadline=None)
@given(
    size=st.tuples(st.integers(1, 12), st.integers(1, 12)),
    slices=st.integers(1, 5),
    radius=st.integers(1, 4),
    share=st.sampled_from([0.0, 0.05, 0.3, 1.0]),
    seed=st.integers(0, 1000),
)
def test_votes_equal_the_plain_definition(size, slices, radius, share, seed) -> None:
    rng = np.random.default_rng(seed)
    index = rng.integers(0, slices, size).astype(np.uint8)
    sure = rng.random(size) < share
    got = vote(index, sure, slices, radius)
    assert got.tolist() == plain_vote(index.tolist(), sure.tolist(), radius)


def test_finds_the_planes() -> None:
    raw = read_image(project.DATA / "planes_5x5.png")
    planes = ("-1", "-3/5", "1/5", "1")
    found = depth_index(focal_stack(raw, 5, planes), 5, 2)
    # The planes stand side by side: in the middle of each its own slice is the one most taken.
    for quarter in np.array_split(found.index, 4, axis=1):
        inside = quarter[6:-6, 6:-6]
        counts = np.bincount(inside.ravel(), minlength=4)
        assert counts.max() > 0.5 * inside.size, counts


def test_even_stack_is_of_the_first_slice() -> None:
    stack = np.full((3, 8, 8), 7, np.uint8)
    assert not depth_index(stack, 2).index.any()
    assert lens_sums(stack[0], 2).tolist() == [[28] * 4] * 4


def test_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="slices"):
        depth_index(np.zeros((0, 4, 4), np.uint8), 2)
    with pytest.raises(InputError, match="radius"):
        depth_index(np.zeros((1, 4, 4), np.uint8), 2, 9)
    with pytest.raises(InputError, match="confidence"):
        depth_index(np.zeros((1, 4, 4), np.uint8), 2, confidence=-1)
    with pytest.raises(InputError, match="vote_radius"):
        depth_index(np.zeros((1, 4, 4), np.uint8), 2, vote_radius=5)
