# SPDX-License-Identifier: Apache-2.0
"""Growth: laws are fitted right, and each of the page's has four points."""

import numpy as np
import pytest

from plenofir_studies import energy, growth, growth_measured


def test_laws_are_found_again():
    x = (1, 2, 5, 30)
    line = growth.fit({k: 7 + 3 * k for k in x}, "line")
    assert (line.start, line.slope) == (pytest.approx(7), pytest.approx(3))
    assert line.off < 1e-9
    assert line.text() == "7 + 3 x"
    power = growth.fit({k: 4 * k**-0.5 for k in x}, "power")
    assert (power.slope, power.power) == (pytest.approx(4), pytest.approx(-0.5))
    assert power.text() == "4 x^-0.50"
    constant = growth.fit({1: 2, 2: 8}, "constant")
    assert constant.text() == "4"
    assert constant.off == pytest.approx(1)
    assert constant.at(99) == pytest.approx(4)


def test_every_law_of_the_page_has_four_points():
    recorded, found = growth_measured.load_recorded(), energy.load_measured()
    laws = list(growth.growths(recorded, found))
    assert {g.quantity.split(":")[0] for g in laws} == {"software", "Dask", "core"}
    for g in laws:
        assert len(g.points) >= 4, (g.quantity, g.against)
        assert np.isfinite(g.law.off)
        assert g.end
    text = "\n".join([*growth.laws(recorded, found), *growth.planned(recorded, found)])
    assert "10^6 frames" in text


def test_memory_of_a_call_is_measured():
    # A frame that is copied would take 9 MB more.
    least = growth_measured.extra_bytes((600, 600), 5, threads=1)
    assert 0 <= least < 9e6
    wide = growth_measured.extra_bytes((2000, 2000, 3), 5, "uint16", threads=1, order=1)
    assert wide >= least
