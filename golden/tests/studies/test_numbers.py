# SPDX-License-Identifier: Apache-2.0
"""Noise, resolution, rounded centres: measurements agree with derivations."""

from fractions import Fraction

import numpy as np
import pytest

from plenofir.refocus import StoredProductArithmetic, refocus
from plenofir_studies import centres, noise
from plenofir_studies import resolution as detail


@pytest.mark.parametrize("m", noise.SIZES)
def test_share_of_noise(m: int) -> None:
    for shift in (-m, 0, 1, 2, m, m + 1):
        assert noise.share_of_noise(m, shift) == pytest.approx(m**-2)
    # Weights of a triangle of 2 M - 1 samples over each dimension, for a' = 1.
    triangle = np.minimum(np.arange(1, 2 * m), np.arange(1, 2 * m)[::-1]) / m**2
    assert noise.share_of_noise(m, 1, 1) == pytest.approx(float((triangle**2).sum()) ** 2)


def test_noise_is_as_derived() -> None:
    stored = StoredProductArithmetic(fraction_bits=0, guard_bits=0)
    found = [noise.measure_noise(3, 2, way) for way in (noise.ARITHMETICS[0], stored)]
    for one in found:
        assert one.measured == pytest.approx(one.derived, rel=0.03)
    # Rounding products costs a quarter of a squared grey level: M q_0.
    assert found[1].measured - found[0].measured == pytest.approx(0.25, abs=0.1)
    alike = noise.neighbours_alike(5, 5)
    assert alike[0] == pytest.approx(1)
    assert alike[1] > 0.7
    assert abs(alike[7]) < 0.15


def test_row_stage_is_the_first_dimension() -> None:
    raw = np.random.default_rng(1).integers(0, 256, (12, 15), np.uint8)
    rows = detail.row_stage(raw, 3, 0)
    means = np.floor(raw.reshape(12, 5, 3).mean(axis=2) + 0.5)
    assert np.array_equal(rows, means.repeat(3, 1))
    both = detail.row_stage(detail.row_stage(raw, 3, 2).T, 3, 2).T
    want = refocus(raw, 3, Fraction(2, 3)).astype(int)
    assert np.abs(both.astype(int) - want).max() <= 1


def test_central_directions() -> None:
    raw = np.arange(100, dtype=np.uint8).reshape(10, 10)
    assert detail.central_directions(raw, 5, 1).tolist() == [[22, 27], [72, 77]]
    assert detail.central_directions(raw, 5, 3)[0].tolist() == [11, 12, 13, 16, 17, 18]


def test_integer_settings_alias_and_others_do_not() -> None:
    whole, between = (detail.edge_detail(3, shift) for shift in (3, 4))
    assert whole.differing == 0
    assert between.differing > 0.3
    assert whole.alias > 1
    assert between.alias < 0.02
    assert whole.jaggedness > 20 * between.jaggedness
    # Contrast itself hardly differs.
    assert between.transfer.half == pytest.approx(whole.transfer.half, rel=0.15)


def test_interpolation_before_and_after_are_one_for_integer_settings() -> None:
    for order in detail.INTERPOLATIONS.values():
        same = detail.before_and_after(3, 3, order)
        assert same.difference < 0.05
        other = detail.before_and_after(3, 4, order)
        assert other.difference > 1
        assert other.before > other.after


def test_transfer_of_a_known_edge() -> None:
    # A box of 8 pixels has its first zero at 1/8 of a cycle a pixel.
    places = np.arange(160) - 80 - 0.07 * np.arange(120)[:, np.newaxis]
    found = detail.transfer(np.clip(places / 8 + 0.5, 0, 1), 8)
    assert found.at(0.5) == pytest.approx(np.sinc(0.5), abs=0.02)
    assert found.at(1.0) < 0.04
    assert found.half == pytest.approx(0.603, abs=0.01)


@pytest.mark.slow
def test_rounded_centres_make_stairs() -> None:
    ways, rounded = centres.compare()
    nearest, bilinear, cubic = ways
    assert [w.way for w in ways] == ["nearest", "bilinear", "cubic"]
    assert nearest.jaggedness == pytest.approx(rounded, rel=0.15)
    assert bilinear.jaggedness < nearest.jaggedness / 3
    assert cubic.jaggedness < bilinear.jaggedness
    assert nearest.noise == pytest.approx(1, abs=0.02)
    assert bilinear.noise == pytest.approx(4 / 9, abs=0.01)
