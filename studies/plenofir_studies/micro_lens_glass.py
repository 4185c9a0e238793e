# SPDX-License-Identifier: Apache-2.0
"""Glass of the thesis's micro lenses in three forms, and what its printed numbers lose."""

from fractions import Fraction

import numpy as np
import numpy.typing as npt

from plenofir.camera.optics.dispersion import Cauchy, FloatArray, Schott, Sellmeier
from plenofir.ground.errors import InputError


def schott_of(cauchy: Cauchy) -> Schott:
    """The same dispersion as Schott coefficients in micrometres (thesis Eq. 5.5).

    The square of a Cauchy equation of up to three terms has exactly the Schott formula's terms,
    with G1 = 0: the conversion is an identity, not a fit. It is computed in exact rational
    arithmetic from the decimal numbers that the coefficients were written as, so the only
    rounding is that of each result to a double. Raises `InputError` if there are more than three
    coefficients, whose square has terms that the Schott formula lacks.
    """
    count = len(cauchy.coefficients)
    if count > 3:
        raise InputError(
            f"{count} coefficients of Cauchy's equation are too many; "
            "the square of more than 3 does not fit the Schott formula"
        )
    in_um = [
        Fraction(repr(float(g))) / Fraction(1000) ** (2 * power)
        for power, g in enumerate(cauchy.coefficients)
    ]
    a, b, c = in_um + [Fraction(0)] * (3 - count)
    square = (a * a, Fraction(0), 2 * a * b, b * b + 2 * a * c, 2 * b * c, c * c)
    return Schott(coefficients=tuple(float(g) for g in square))


def naive_sellmeier_index(formula: Sellmeier, wavelength_nm: npt.ArrayLike) -> FloatArray:
    """Refractive index by the Sellmeier formula term by term, kept to compare with.

    Loses about as many digits as the terms are larger than their sum: some 6 of 16 for the
    coefficients of thesis Eq. (5.7). Result: indices, shape of `wavelength_nm`.
    """
    squared_um = (np.asarray(wavelength_nm, dtype=np.float64) / 1000) ** 2
    squared_index = np.ones_like(squared_um)
    for b, c in zip(formula.strengths, formula.resonances_um2, strict=True):
        squared_index = squared_index + b * squared_um / (squared_um - c)
    return np.sqrt(squared_index)


MICRO_LENS_CAUCHY = Cauchy(coefficients=(1.5375, 8290.45, -2.11046e8))
"""Substrate of the micro lens array as its maker states it (thesis Eq. 5.2)."""

MICRO_LENS_SCHOTT = Schott(
    coefficients=(
        2.36390625,
        0.0,
        2.549313375e-2,
        -5.802348887975e-4,
        -3.4993326214e-6,
        4.454041411599998e-8,
    )
)
"""The substrate in Schott's form as printed (thesis Eq. 5.5)."""

MICRO_LENS_SELLMEIER = Sellmeier(
    strengths=(-8.86496761e5, 8.86498127e5, 4.54358371e3),
    resonances_um2=(3.49477799e-2, 3.49477525e-2, 6.30419436e6),
)
"""The substrate as fitted by design software (thesis Eq. 5.7): two huge terms that cancel."""
