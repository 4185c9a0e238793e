# SPDX-License-Identifier: Apache-2.0
"""The fast refocuser against the reference, to the bit."""

import itertools
import math
import subprocess
import sys
import threading
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_refocus import random_image

from plenofir.ground.errors import InputError
from plenofir.ground.kept_code import compiled
from plenofir.refocus import ExactArithmetic, refocus, threads
from plenofir.refocus.compiled import frames, plans, weights
from plenofir.refocus.compiled.parameters import Weights
from plenofir.refocus.division import division
from plenofir.refocus.slices import Slice

aligns = st.sampled_from(["centred", "causal"])
depths = st.sampled_from([np.uint8, np.uint16])
bounds = st.tuples(st.integers(0, 60), st.integers(0, 60)).map(sorted)
parts = st.sampled_from([0, 0.3, 0.6, 1])


def a_box(m: int, shift: int, part: float) -> int:
    """A box that a slice may have: the least, part of the way to M, or M."""
    common = math.gcd(shift, m)
    return common * max(1, round(part * m / common))


weights_table, inverse_bits = (
    compiled(function.py_func) for function in (weights.weights_table, weights.inverse_bits)
)
"""Functions for compiled code, with a way from Python."""


@given(data=st.data())
def test_equals_the_reference(data):
    m, shift = data.draw(st.integers(1, 13)), data.draw(st.integers(-30, 35))
    order = data.draw(st.sampled_from([0, 0, 0, 1, 2, 3]))
    dtype = data.draw(depths)
    options = {
        "align": data.draw(aligns),
        "box": a_box(m, shift, data.draw(parts)),
        "sharpen": data.draw(st.sampled_from(["off", "auto", Fraction(3, 64)])),
        "border": data.draw(st.sampled_from(["zero", "normalise"])),
    }
    shape = tuple(m + data.draw(st.integers(0, 45)) for _ in range(2))
    shape += data.draw(st.sampled_from([(), (3,)]))
    raw = random_image(shape, dtype, data.draw(st.integers(0, 9)))
    with pytest.MonkeyPatch.context() as patch:
        # Blocks of a few pixels, and threads for them, so that their borders lie everywhere.
        patch.setattr(plans, "_BLOCK_BYTES", data.draw(st.integers(1, 99)))
        patch.setattr(plans, "_BLOCK_LENSES", data.draw(st.integers(0, 3)))
        patch.setattr(frames, "_SAMPLES_FOR_A_THREAD", data.draw(st.integers(1, 9999)))
        patch.setattr(frames, "_PAST_CACHES", data.draw(st.sampled_from([0, 4 << 20])))
        image = refocus(raw, m, Fraction(shift, m), interpolation=order, threads=2, **options)
    want = ExactArithmetic().refocus(raw, m, shift=shift, order=order, **options)
    assert image.dtype == raw.dtype
    assert np.array_equal(image, want)


@given(st.integers(1, 9), st.integers(-20, 20), bounds, bounds, aligns, st.integers(0, 2), parts)
def test_region_is_a_part_of_the_whole(m, shift, rows, columns, align, order, part):
    raw = random_image((m + 40, m + 43), np.uint8)
    region = slice(*rows), slice(*columns)
    options = {"align": align, "box": a_box(m, shift, part)}
    image = refocus(raw, m, Fraction(shift, m), interpolation=order, region=region, **options)
    whole = ExactArithmetic().refocus(raw, m, shift=shift, order=order, **options)
    assert np.array_equal(image, whole[region])


@given(st.integers(1, 9), st.integers(-4, 5), bounds, aligns, depths, st.booleans())
def test_a_pixel_for_each_micro_lens(m, a, rows, align, dtype, rgb):
    raw = random_image((8 * m + 3, 7 * m + 2, *((3,) if rgb else ())), dtype)
    whole = ExactArithmetic().refocus(raw, m, shift=a * m, align=align)
    want = whole[: raw.shape[0] // m * m : m, : raw.shape[1] // m * m : m]
    assert np.array_equal(refocus(raw, m, a, align=align, upsample=False), want)
    region = slice(*rows), slice(1, None)
    part = refocus(raw, m, a, align=align, upsample=False, region=region)
    assert np.array_equal(part, want[region])


@pytest.mark.parametrize(
    ("m", "shift", "shape", "dtype"),
    [
        (99, 1000, (99, 99), np.uint16),
        (99, -1000, (120, 301, 3), np.uint8),
        (16, 9, (70, 60), np.uint8),
        (12, 5, (70, 60), np.uint8),
        (130, 77, (131, 260), np.uint16),
        (260, 7, (260, 300), np.uint16),
        (2, -1000, (7, 3000), np.uint8),
        (11, 33, (300, 600), np.uint16),
    ],
)
def test_extremes_and_all_white(m, shift, shape, dtype):
    white = np.full(shape, np.iinfo(dtype).max, dtype)
    for raw in (white, random_image(shape, dtype)):
        want = ExactArithmetic().refocus(raw, m, shift=shift)
        assert np.array_equal(refocus(raw, m, Fraction(shift, m)), want)


@pytest.mark.parametrize(
    ("m", "dtype"),
    [(m, np.uint8) for m in (15, 16, 17, 127, 128, 129)] + [(m, np.uint16) for m in (256, 257)],
)
def test_where_words_get_wider(m, dtype):
    # Black beside white lenses: sums of columns change by all that they can be. Sums of 32 and 64
    # bits begin with 17 and 257, those of columns with 129 and 257.
    lenses = np.array([[0, 1, 0], [1, 1, 0]], dtype) * np.iinfo(dtype).max
    raw = lenses.repeat(m, 0).repeat(m, 1)[: m + 3]
    for shift in (0, 1, m - 1) if m < 200 else (1,):
        for image in (raw, ~raw):
            want = ExactArithmetic().refocus(image, m, shift=shift)
            assert np.array_equal(refocus(image, m, Fraction(shift, m)), want)


@given(st.integers(2, 400), st.integers(0, 3), st.sampled_from([8, 16]))
def test_division_by_multiplication_is_exact(m, order, pixel_bits):
    divisor, white = m ** (2 + 2 * order), (1 << pixel_bits) - 1
    if (divisor * white).bit_length() > 61:
        with pytest.raises(InputError, match="sums"):
            Slice((9, 9), pixel_bits, m, 1, (range(9), range(9)), order=order)
        return
    made = division(divisor, white)
    assert divisor * white + made.half < 1 << made.bits
    assert made.multiplier < 1 << made.bits <= 1 << made.drop
    # The quotient can only be wrong next to where it changes.
    for quotient in {0, 1, 2, 127, 128, white - 1, white}:
        first = max(0, quotient * divisor - divisor // 2)
        for n in (first, min(quotient * divisor + (divisor - 1) // 2, white * divisor)):
            assert (n + made.half) * made.multiplier >> made.drop == quotient


@given(
    st.lists(st.integers(0, 300), min_size=1, max_size=9),
    st.integers(0, 300),
    st.sampled_from([(16, 8), (32, 8), (32, 16), (32, 18), (64, 9), (64, 16)]),
    st.integers(1, 2),
)
def test_division_by_weights_is_exact(columns, row, widths, twice):
    bits, quotient_bits = widths
    # As large as the words allow.
    largest = math.isqrt((1 << bits - quotient_bits) // twice)
    columns, row = [min(c * largest // 300, largest) for c in columns], row * largest // 300
    none = np.empty(0, np.int64)
    factors = Weights(none, none, np.array(columns), twice, quotient_bits)
    table = np.empty((len(columns), 3, 2), np.uint64)
    weights_table(factors, np.array([row, largest]), bits, table.reshape(-1))
    assert int(table.max()) < 1 << bits
    drop, most = 2 * bits - quotient_bits - 1, (1 << quotient_bits) - 1
    for column, numbers in zip(columns, table.astype(object), strict=True):
        for line, (half, scale, multiplier) in zip((row, largest), numbers.T, strict=True):
            weight = twice * column * line
            for quotient in {0, 1, 2, most // 2, most - 1, most}:
                first = max(0, quotient * weight - weight // 2)
                last = min(quotient * weight + max(weight - 1, 0) // 2, most * weight)
                for n in (first, last):
                    assert (n + half) * scale < 1 << bits
                    found = (n + half) * scale * multiplier >> drop
                    assert found == (quotient if weight else 0)


@pytest.mark.parametrize(("weight", "quotient_bits"), [(15841, 18), (8803969, 8), (1 << 24, 8)])
def test_division_where_the_multiplier_is_almost_exact(weight, quotient_bits):
    # These numbers, 15841 = 7 31 73 and 8803969 = 31 89 3191, divide a power of two less 1.
    none, columns = np.empty(0, np.int64), np.array([weight])
    table = np.empty(3, np.uint64)
    factors = Weights(none, none, columns, 1, quotient_bits)
    weights_table(factors, np.array([1]), 32, table)
    half, scale, multiplier = table.tolist()
    for quotient in (1, 2, 100, (1 << quotient_bits) - 1):
        # The sum that is just rounded up, and the one before it.
        n = quotient * weight - weight // 2 + half
        found = [(k * scale * multiplier) >> 63 - quotient_bits for k in (n, n - 1)]
        assert found == [quotient, quotient - 1]


@given(st.integers(1, 1 << 14), st.sampled_from([8, 12, 16]))
def test_division_by_a_real_number_is_exact(weight, bits):
    most = (1 << bits) - 1
    inverse = np.array([inverse_bits(weight, most)], np.int32).view(np.float32)[0]
    assert (inverse == 0) == (weight << bits > 1 << 22)
    if inverse:
        # The quotient can only be wrong next to where it changes.
        n = weight * np.arange(1, most + 2)[:, None] - [1, 0]
        assert np.array_equal((n.astype(np.float32) * inverse).astype(int), n // weight)


def test_threads_are_kept_and_hand_on_what_fails():
    raw = random_image((900, 900), np.uint8)
    want = refocus(raw, 11, "1/11", threads=1)

    def fails():
        raise ValueError(threading.get_ident())

    with pytest.raises(ValueError, match=r"^\d+$"):
        threads.in_threads(fails, 3)
    kept = list(threads._idle)
    assert len(kept) >= 2
    seen = set()
    threads.in_threads(lambda: seen.add(threading.get_ident()), 3)
    assert len(seen) == 3
    assert set(threads._idle) == set(kept)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frames, "_SAMPLES_FOR_A_THREAD", 1)
        assert np.array_equal(refocus(raw, 11, "1/11", threads=3), want)


def test_sums_that_do_not_fit_are_refused():
    raw = random_image((200, 200), np.uint16)
    with pytest.raises(InputError, match="sums of 78 bits"):
        refocus(raw, 200, 1, interpolation=3)
    with pytest.raises(InputError, match="sums of 78 bits"):
        ExactArithmetic().refocus(raw, 200, shift=200, order=3)


def test_views_and_given_memory():
    raw = random_image((60, 80, 3), np.uint8)
    out = np.empty((80, 60), np.uint8)
    image = refocus(raw[:, :, 1].T, 5, "-3/5", out=out)
    assert image is out
    assert np.array_equal(out, ExactArithmetic().refocus(raw[:, :, 1].T, 5, shift=-3))
    empty = refocus(raw, 5, "-3/5", region=(slice(3, 3), slice(None)))
    assert empty.shape == (0, 80, 3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"upsample": False, "a": "1/5"}, "upsample"),
        ({"upsample": False, "interpolation": 1}, "upsample"),
        ({"region": slice(3)}, "region"),
        ({"region": (slice(0, 9, 2), slice(3))}, "region"),
        ({"threads": 0}, "threads"),
        ({"out": np.zeros((60, 60), np.uint16)}, "out"),
        ({"out": np.zeros((60, 60), np.uint8).T[::-1]}, "out"),
    ],
)
def test_bad_options(options, message):
    raw = random_image((60, 60), np.uint8)
    with pytest.raises(InputError, match=f"^{message}: "):
        refocus(raw, 5, **{"a": 1, **options})
    with pytest.raises(InputError, match=r"^out: shares its memory"):
        refocus(raw, 5, 1, out=raw)


@given(
    st.integers(2, 41), st.integers(-300, 300), st.integers(0, 1), aligns, st.integers(1, 3), parts
)
def test_most_of_what_is_reached_lies_outside(m, shift, order, align, threads, part):
    raw = random_image((m + 33, m + 58), np.uint8)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frames, "_SAMPLES_FOR_A_THREAD", 99)
        patch.setattr(plans, "_BLOCK_LENSES", 0)
        options = {"align": align, "box": a_box(m, shift, part)}
        image = refocus(raw, m, Fraction(shift, m), interpolation=order, threads=threads, **options)
    want = ExactArithmetic().refocus(raw, m, shift=shift, order=order, **options)
    assert np.array_equal(image, want)


@pytest.mark.parametrize(("m", "shift"), [(1601, 4804), (1601, 1), (1600, 1700)])
def test_memory_does_not_grow_with_the_reach(m, shift):
    """Peak of the process's memory, in a process of its own."""
    code = f"""
import numpy as np
from fractions import Fraction
from pathlib import Path
from plenofir.refocus import first_calls, refocus

first_calls.patient = True

def mega_bytes(name):
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(name)).split()[1]) / 1024

raw = np.random.default_rng(0).integers(0, 65536, (2500, 2500), np.uint16)
out = np.empty_like(raw)
small = np.zeros((1700, 1700), np.uint16)
refocus(small, {m}, 0, threads=1)
Path("/proc/self/clear_refs").write_text("5")
before = mega_bytes("VmRSS") + out.nbytes / 2**20
refocus(raw, {m}, Fraction({shift}, {m}), out=out, threads=1)
print(mega_bytes("VmHWM") - before)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 17


def cut_anyhow(rng: np.random.Generator, length: int) -> list[tuple[int, int]]:
    """A few parts of any sizes, or many of 1 to 4 pixels."""
    inside = rng.permutation(np.arange(1, length))[: rng.integers(0, 5)]
    if rng.random() < 0.5:
        inside = np.arange(rng.integers(1, 5), length, rng.integers(1, 5))
    return list(itertools.pairwise([0, *sorted(inside.tolist()), length]))


@pytest.mark.parametrize("sharpen", ["off", "1/64", "1/4"])
@pytest.mark.parametrize("order", range(4))
def test_any_blocks(order, sharpen, monkeypatch) -> None:
    """What begins, ends and lies inside of a picture, a few pixels wide or high."""
    rng = np.random.default_rng(order)

    def cut(work, word_bytes, threads):
        rows, columns = (cut_anyhow(rng, axis.outputs) for axis in (work.rows, work.columns))
        return np.array([(*row, *column) for column in columns for row in rows])

    monkeypatch.setattr(frames, "blocks_of", cut)
    for m, shift in ((2, 1), (2, -3), (3, 1), (3, 2), (4, 2), (4, 5), (5, 0), (5, -4), (6, 3)):
        for dtype, border in ((np.uint8, "zero"), (np.uint16, "normalise")):
            raw = random_image((int(rng.integers(m, 90)), int(rng.integers(m, 90))), dtype)
            how = {"order": order, "sharpen": sharpen, "border": border}
            how["box"] = a_box(m, shift, rng.choice([0.3, 0.6, 1]))
            want = ExactArithmetic().refocus(raw, m, shift=shift, **how)
            how["interpolation"] = how.pop("order")
            assert np.array_equal(refocus(raw, m, Fraction(shift, m), **how), want), (m, shift)


@given(data=st.data())
def test_blocks_cover_each_pixel_once(data) -> None:
    m, shift = data.draw(st.integers(1, 40)), data.draw(st.integers(-50, 50))
    rows, columns = data.draw(st.integers(1, 5000)), data.draw(st.integers(1, 5000))
    upsample = data.draw(st.booleans())
    shift *= 1 if upsample else m
    shape, region = (rows * m, columns * m), (range(rows), range(columns))
    work = plans.work_of(Slice(shape, 8, m, shift, region, upsample=upsample))
    cut = plans.blocks_of(work.plan, work.loops.word_bytes, data.draw(st.integers(1, 9)))
    corners = {(row, column) for row, _, column, _ in cut.tolist()}
    for axis, length in ((0, rows), (1, columns)):
        parts = sorted(set(map(tuple, cut[:, 2 * axis : 2 * axis + 2].tolist())))
        assert [0, *(end for _, end in parts)] == [*(begin for begin, _ in parts), length]
    assert (
        len(cut)
        == len(corners)
        == np.prod([len(set(starts)) for starts in zip(*corners, strict=True)])
    )
