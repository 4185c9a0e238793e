# SPDX-License-Identifier: Apache-2.0
"""The gain of sharpening: theory and measurement agree, and `auto` is near the optimum."""

from fractions import Fraction

import numpy as np
import pytest

from plenofir.refocus import automatic_units, derived_moment
from plenofir_studies import sharpening as study
from plenofir_studies.sharpening_report import flower_pictures, plane_pictures

SIXTEENTH = Fraction(1, 16)


@pytest.mark.parametrize(("m", "shift", "order"), [(5, 3, 0), (11, 4, 0), (4, 2, 0), (5, 3, 1)])
def test_best_weight_lies_above_that_of_the_moment(m: int, shift: int, order: int) -> None:
    moment = float(derived_moment(m, shift, order)) / 2
    # For low frequencies only the second moment matters.
    assert study.best_weight(m, shift, order, band=0.03)[0] == pytest.approx(moment, abs=1 / 100)
    best, gain = study.best_weight(m, shift, order)
    assert best == pytest.approx(automatic_units(m, shift, order) / 64, abs=1 / 64)
    assert best > moment
    assert gain > (10 if m % 2 else 0.3)


def test_planes_are_nearer_to_the_object() -> None:
    field = study.plane(5, 3, study.TEXTURES[1])
    plain, sharp, more = (study.measure(field, b) for b in (Fraction(0), SIXTEENTH, 2 * SIXTEENTH))
    assert plain.lens == pytest.approx(37.7, abs=1)
    assert sharp.lens == pytest.approx(49.5, abs=1)
    assert sharp.pixel > plain.pixel + 8
    assert more.lens < plain.lens
    whole = study.plane(5, 5, study.TEXTURES[1])
    assert study.measure(whole, Fraction(0)).lens > study.measure(whole, SIXTEENTH).lens + 20


def test_where_it_harms() -> None:
    noisy = study.plane(5, 3, study.TEXTURES[3], noise=40)
    assert study.measure(noisy, Fraction(0)).pixel > study.measure(noisy, SIXTEENTH).pixel
    far = study.plane(5, 3, study.TEXTURES[3], away=Fraction(1))
    plain, sharp = (study.measure(far, b) for b in (Fraction(0), SIXTEENTH))
    assert plain.ideal > sharp.ideal + 1
    derived, measured = study.noise_gain(5, 3, 4)
    assert measured == pytest.approx(derived, rel=0.02)


def test_pictures() -> None:
    for picture in (flower_pictures(), plane_pictures()):
        assert picture.dtype == np.uint8
        assert picture.shape[1] > 700
