# SPDX-License-Identifier: Apache-2.0
"""Dispersion formulas: the thesis's numbers, an oracle of 50 digits, and the glass tables."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.optics import (
    C_LINE_NM,
    D_LINE_NM,
    F_LINE_NM,
    Cauchy,
    Constant,
    Sellmeier,
    glass_catalogue,
    glass_from_abbe,
    read_glass_table,
)
from plenofir.ground.errors import InputError
from plenofir_studies.micro_lens_glass import (
    MICRO_LENS_CAUCHY,
    MICRO_LENS_SCHOTT,
    MICRO_LENS_SELLMEIER,
    naive_sellmeier_index,
    schott_of,
)

# Eq. (5.7) as printed, so that the oracle does not inherit the rounding of doubles.
PRINTED_SELLMEIER = [
    ("-8.86496761e5", "3.49477799e-2"),
    ("8.86498127e5", "3.49477525e-2"),
    ("4.54358371e3", "6.30419436e6"),
]
wavelengths = st.floats(300.0, 2500.0)


def sellmeier_oracle(terms: list[tuple[str, str]], wavelength_nm: float) -> mp.mpf:
    squared = (mp.mpf(wavelength_nm) / 1000) ** 2
    parts = (mp.mpf(b) * squared / (squared - mp.mpf(c)) for b, c in terms)
    return mp.sqrt(1 + mp.fsum(parts))


def relative_error(got: float, want: mp.mpf) -> float:
    return float(abs((mp.mpf(float(got)) - want) / want))


@given(wavelengths)
def test_cancelling_sellmeier_terms_keep_their_digits(wavelength):
    with mp.workdps(50):
        want = sellmeier_oracle(PRINTED_SELLMEIER, wavelength)
        assert relative_error(MICRO_LENS_SELLMEIER.index(wavelength), want) < 2e-15


def test_naive_sellmeier_loses_digits():
    # Shows that the combined evaluation is needed, and that the test above can fail.
    grid = np.linspace(300, 2500, 200)
    with mp.workdps(50):
        want = [sellmeier_oracle(PRINTED_SELLMEIER, float(w)) for w in grid]
        naive = naive_sellmeier_index(MICRO_LENS_SELLMEIER, grid)
        worst = max(relative_error(n, w) for n, w in zip(naive, want, strict=True))
    assert 1e-12 < worst < 1e-9


@given(
    st.floats(0.5, 2.5),
    st.floats(1e3, 1e6),
    st.floats(5e-3, 2e-2),
    st.floats(1e-9, 1e-6),
    wavelengths,
)
def test_any_cancelling_pair(strength, size, resonance, apart, wavelength):
    # Two terms of about +-size of which `strength` is left over, in either order.
    b = (size + strength, -size)
    c = (resonance, resonance * (1 + apart))
    formula = Sellmeier(strengths=b, resonances_um2=c)
    with mp.workdps(50):
        want = sellmeier_oracle([(repr(b[0]), repr(c[0])), (repr(b[1]), repr(c[1]))], wavelength)
        assert relative_error(formula.index(wavelength), want) < 1e-14
        turned = Sellmeier(strengths=b[::-1], resonances_um2=c[::-1])
        assert relative_error(turned.index(wavelength), want) < 1e-14


@given(st.floats(360.0, 2500.0))
def test_cauchy_and_its_schott_form_agree(wavelength):
    schott = schott_of(MICRO_LENS_CAUCHY)
    assert float(schott.index(wavelength)) == pytest.approx(
        float(MICRO_LENS_CAUCHY.index(wavelength)), rel=1e-15
    )


def test_cauchy_becomes_the_printed_schott_coefficients():
    got = schott_of(MICRO_LENS_CAUCHY).coefficients
    # Eq. (5.5); its last coefficient is printed with the rounding of a program.
    assert got == pytest.approx(MICRO_LENS_SCHOTT.coefficients, rel=1e-15)
    assert got[:5] == MICRO_LENS_SCHOTT.coefficients[:5]


@given(
    st.lists(st.floats(-10, 10), min_size=1, max_size=3),
)
def test_schott_coefficients_are_correctly_rounded(coefficients):
    g = [mp.mpf(repr(c)) for c in coefficients] + [mp.mpf(0)] * (3 - len(coefficients))
    with mp.workdps(60):
        g = [mp.mpf(repr(c)) for c in coefficients] + [mp.mpf(0)] * (3 - len(coefficients))
        g = [g[0], g[1] / 10**6, g[2] / 10**12]
        want = [
            g[0] ** 2,
            0,
            2 * g[0] * g[1],
            g[1] ** 2 + 2 * g[0] * g[2],
            2 * g[1] * g[2],
            g[2] ** 2,
        ]
        want = [float(w) for w in want]
    got = schott_of(Cauchy(coefficients=tuple(coefficients))).coefficients
    assert got == pytest.approx(want, rel=4e-16, abs=1e-300)


def test_more_than_three_cauchy_terms_do_not_fit():
    with pytest.raises(InputError, match="more than 3"):
        schott_of(Cauchy(coefficients=(1.5, 1.0, 1.0, 1.0)))


def test_index_of_the_micro_lenses():
    # Table 5.1.
    assert round(float(MICRO_LENS_CAUCHY.index(550)), 4) == 1.5626
    assert round(float(MICRO_LENS_SCHOTT.index(550)), 4) == 1.5626
    # Section 5.1.1: the fitted Sellmeier coefficients deviate a little.
    assert 1e-5 < abs(float(MICRO_LENS_SELLMEIER.index(550)) - 1.5626) < 1e-3


@pytest.mark.parametrize("wavelength", [0.0, -550.0, float("nan"), float("inf")])
def test_no_wavelength(wavelength):
    for formula in (MICRO_LENS_CAUCHY, MICRO_LENS_SCHOTT, MICRO_LENS_SELLMEIER, Constant(value=1)):
        with pytest.raises(InputError, match="nanometres"):
            formula.index([550.0, wavelength])


def test_no_real_index_at_a_resonance():
    formula = Sellmeier(strengths=(1.0,), resonances_um2=(0.25,))
    for wavelength in (500.0, 499.0):
        with pytest.raises(InputError, match=f"{wavelength:g} nm"):
            formula.index([700.0, wavelength])


def test_tables_hold_the_catalogue_values():
    # Schott's catalogue: n_d and v_d.
    for name, index, abbe in [
        ("BK7", 1.51680, 64.17),
        ("N-SK2", 1.60738, 56.65),
        ("N-SK16", 1.62041, 60.32),
        ("F5", 1.60342, 38.03),
    ]:
        glass = glass_catalogue()[name]
        assert float(glass.index(D_LINE_NM)) == pytest.approx(index, abs=6e-6)
        assert glass.abbe_number == pytest.approx(abbe, abs=6e-3)


@given(st.floats(1.4, 2.0), st.floats(20, 90))
def test_glass_from_abbe_has_its_index_and_abbe_number(index, abbe):
    glass = glass_from_abbe("made", index, abbe)
    assert float(glass.index(D_LINE_NM)) == pytest.approx(index, rel=1e-14)
    assert glass.abbe_number == pytest.approx(abbe, rel=1e-11)


@pytest.mark.parametrize("name", sorted(glass_catalogue()))
def test_glass_from_abbe_is_as_near_as_it_says(name):
    glass = glass_catalogue()[name]
    made = glass_from_abbe(name, float(glass.index(D_LINE_NM)), glass.abbe_number)

    def departure(first: float, last: float) -> float:
        grid = np.linspace(first, last, 50)
        return float(np.max(np.abs(made.index(grid) - glass.index(grid))))

    abbe = glass.abbe_number
    assert departure(F_LINE_NM, C_LINE_NM) < (1e-4 if abbe > 40 else 5e-4)
    assert departure(400, 700) < (7e-4 if abbe > 50 else 2e-3 if abbe > 40 else 8e-3)


@pytest.mark.parametrize(("index", "abbe"), [(1.0, 50.0), (0.5, 50.0), (1.5, 0.0), (1.5, -3.0)])
def test_no_glass(index, abbe):
    with pytest.raises(InputError, match="glass odd"):
        glass_from_abbe("odd", index, abbe)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("BK7,1.0,0.2,1.0,0.006,0.02,103", "6 numbers"),
        ("BK7,1.0,0.2,x,0.006,0.02,103,1.5168", "line 2, field 4: 'x'"),
        ("BK7,1.13961212,0.231792344,1.01046945,0.006,0.0200179144,103.560653,1.5168", "n_d"),
    ],
)
def test_wrong_row_of_a_glass_table(tmp_path, row, message):
    path = tmp_path / "glasses.csv"
    path.write_text(f"# name, coefficients, n_d\n{row}\n")
    with pytest.raises(InputError, match=message) as caught:
        read_glass_table(path, "sellmeier")
    assert "glasses.csv: line 2" in str(caught.value)
