# SPDX-License-Identifier: Apache-2.0
"""Integer sharpness, depth index and all-in-focus picture against their plain definition."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from plenofir.camera.lightfield.stack import focal_stack
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import read_image
from plenofir.refocus.sharpness import (
    SURE,
    TEXTURE,
    between_slices,
    confidence_level,
    depth_between_picture,
    depth_index,
    depth_index_picture,
    has_order,
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
    # Without a radius of votes confidence is not asked for.
    unsure = depth_index(stack, m, radius, confidence=10**9)
    assert np.array_equal(unsure.index, got.index)
    assert np.array_equal(depth_index(stack, m).index, depth_index(stack, m, 1).index)
    energies = [plain_sharpness(image, m, radius) for image in stack]
    for image, energy in zip(stack, energies, strict=True):
        assert local_sharpness(image, m, radius).tolist() == energy
    for y in range(size[0]):
        for x in range(size[1]):
            candidates = [energy[y // m][x // m] for energy in energies]
            best = candidates.index(max(candidates))
            assert got.index[y // m, x // m] == best
            assert np.array_equal(got.image[y, x], stack[best, y, x])
    assert np.array_equal(
        got.focus([7, -3, 0, 2][:slices], m) * m, np.array([7, -3, 0, 2])[got.index]
    )


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


def plain_place(before: int, own: int, after: int, steps: list[int], confidence: int):
    """Place of the vertex in 256ths, and its confidence; intervals of these lengths beside it."""
    p, q = steps[1] * (own - before), steps[0] * (own - after)
    unit = 1
    while confidence // unit > 31:
        unit *= 2
    return min(255, 256 * p // (p + q)), max(1, min(255, (2 * own - before - after) // unit))


@settings(max_examples=40, deadline=None)
@given(
    shifts=st.lists(st.integers(-9, 9), min_size=1, max_size=5, unique=True).map(sorted),
    down=st.booleans(),
    # None: exactly what one of the lenses has.
    confidence=st.sampled_from([None, 0, 31, 32, 40, 900, 3000]),
    vote_radius=st.integers(0, 2),
    seed=st.integers(0, 1000),
)
@example(shifts=[0, 1, 2], down=False, confidence=None, vote_radius=1, seed=2)
def test_depth_between_slices_equals_the_plain_definition(
    shifts, down, confidence, vote_radius, seed
) -> None:
    shifts = shifts[::-1] if down else shifts
    stack = np.random.default_rng(seed).integers(0, 256, (len(shifts), 8, 10)).astype(np.uint8)
    # Of an integer a 12 sixteenths, between two lenses 15.
    energies = [
        np.array(plain_sharpness(image, 2, 1)) * (15 if shift % 2 else 12) // 16
        for image, shift in zip(stack, shifts, strict=True)
    ]
    best, differences = np.argmax(energies, axis=0), np.ptp(energies, axis=0)
    confidence = int(differences[1, 2]) if confidence is None else confidence
    got = depth_index(stack, 2, 1, confidence=confidence, vote_radius=vote_radius, shifts=shifts)
    sure = (differences >= confidence) | (vote_radius == 0)
    voted = plain_vote(best.tolist(), sure.tolist(), vote_radius)
    for t, s in np.ndindex(4, 5):
        n = int(best[t, s])
        want, focus = (voted[t][s], 128, 0), shifts[voted[t][s]] / 2
        if sure[t, s] and 0 < n < len(shifts) - 1:
            steps = [abs(shifts[n] - shifts[n - 1]), abs(shifts[n + 1] - shifts[n])]
            values = (int(energies[k][t, s]) for k in (n - 1, n, n + 1))
            want = n, *plain_place(*values, steps, confidence)
            low, high = (shifts[n] + shifts[n + step] for step in (-1, 1))
            focus = (low + (high - low) * (want[1] + 0.5) / 256) / 4
        assert got.focus(shifts, 2)[t, s] == pytest.approx(focus)
        assert (got.index[t, s], got.fraction[t, s], got.confidence[t, s]) == want


@pytest.mark.parametrize("largest", [1, 3, 300, 1 << 54])
@pytest.mark.parametrize("shifts", [(0, 1, 2), (-7, -6, 0, 9)])
def test_place_of_any_vertex(largest: int, shifts: tuple[int, ...]) -> None:
    rng = np.random.default_rng(largest)
    index = rng.integers(0, len(shifts), (20, 30)).astype(np.uint8)
    own = rng.integers(1, largest + 1, index.shape)
    # The slice before is less sharp, the one after no sharper.
    before, after = (own * rng.random(index.shape) * part for part in (1, rng.random() > 0))
    before, after = np.minimum(before.astype(int), own - 1), np.minimum(after.astype(int), own)
    after = np.where(rng.random(index.shape) < 0.2, own, after)
    known = rng.random(index.shape) < 0.8
    found = between_slices(index, (before, own, after), known, shifts, 31 * largest // 40)
    for place in np.ndindex(*index.shape):
        want, n = (128, 0), int(index[place])
        if known[place] and 0 < n < len(shifts) - 1:
            steps = [shifts[n] - shifts[n - 1], shifts[n + 1] - shifts[n]]
            values = (int(values[place]) for values in (before, own, after))
            want = plain_place(*values, steps, 31 * largest // 40)
        assert (found[0][place], found[1][place]) == want


def test_only_lines_that_are_needed_are_made() -> None:
    stack = np.random.default_rng(0).integers(0, 256, (3, 301, 4)).astype(np.uint8)

    class Lines(list):
        asked = 0

        def lines(self, first: int, last: int):
            assert first == self.asked < last <= 301
            self.asked = last
            return (image[first:last] for image in self)

    made = Lines(stack)
    want, got = depth_index(stack, 2), depth_index(made, 2)
    assert made.asked == 301
    assert np.array_equal(got.image, want.image)
    of_pixels = want.index.repeat(2, 0).repeat(2, 1)[:301]
    assert np.array_equal(want.image, np.take_along_axis(stack, of_pixels[None], 0)[0])


def test_levels_and_weights() -> None:
    # A twelfth of a lens, a fourth, a third, a half, and whole lenses.
    assert [slice_weight(shift, 12) for shift in (1, 3, 4, 6, 0, -12)] == [16, 16, 16, 15, 12, 12]
    assert confidence_level(6, 5, 1) == 6 * 25 * 9
    assert confidence_level(6, 5, 1, channels=3) == 6 * 25 * 9 * 4
    assert confidence_level(2.5, 3, 2, pixel_bits=10) == 10 * 9 * 25
    assert (TEXTURE, SURE) == (6, 16)
    assert all(map(has_order, ([3], [-1, 0, 4], [4, 0, -1])))
    assert not any(map(has_order, ([0, 0], [0, 1, 1], [2, 0, 1])))


def test_pictures_of_the_index() -> None:
    index = np.array([[0, 1, 2]], np.uint8)
    assert depth_index_picture(index, 3).tolist() == [[0, 127, 255]]
    assert depth_index_picture(index[:, :1], 1).tolist() == [[0]]
    index = np.arange(256, dtype=np.uint8)
    assert np.array_equal(depth_index_picture(index, 256), index)
    for slices in (1, 2, 3, 7):
        index = np.repeat(np.arange(slices, dtype=np.uint8), 256)
        fraction = np.tile(np.arange(256, dtype=np.uint8), slices)
        last = max(slices - 1, 1)
        places = [
            n + Fraction(int(k) - 128, 256) for n, k in zip(index.tolist(), fraction, strict=True)
        ]
        want = [65535 * min(max(place, 0), last) // last for place in places]
        assert depth_between_picture(index, fraction, slices).tolist() == want


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


def test_limits() -> None:
    stack = np.zeros((256, 4, 4), np.uint8)
    stack[255, ::2] = 1
    got = depth_index(stack, 1, 8, confidence=2**30 - 1, vote_radius=4)
    assert got.index.tolist() == [[255] * 4] * 4
    assert got.image.tolist() == stack[255].tolist()
    assert depth_index(stack, 1, 0, confidence=0, vote_radius=0).index.max() == 255
    one = stack[:1]
    for bad, options in (
        ("slices", {"stack": stack[:0]}),
        ("slices", {"stack": np.zeros((257, 4, 4), np.uint8)}),
        ("radius", {"radius": -1}),
        ("radius", {"radius": 9}),
        ("confidence", {"confidence": -1}),
        ("confidence", {"confidence": 2**30}),
        ("vote_radius", {"vote_radius": -1}),
        ("vote_radius", {"vote_radius": 5}),
        ("depth between slices needs", {"shifts": (0, 1)}),
        ("depth between slices needs", {"stack": stack[:2], "shifts": (1, 1)}),
    ):
        with pytest.raises(InputError, match=bad):
            depth_index(**{"stack": one, "micro_image_size": 2, **options})
