# SPDX-License-Identifier: Apache-2.0
"""Refractive index of optical glass as a function of wavelength.

Wavelengths are in nm throughout. The coefficients keep the units in which they are published: nm
for Cauchy's equation (as the thesis prints it), micrometres for the Schott and Sellmeier formulas
(as glass catalogues do). Indices are relative to air.
"""

from fractions import Fraction
from functools import cached_property
from typing import Annotated, Self

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from plenofir.ground.errors import InputError

FloatArray = npt.NDArray[np.float64]

D_LINE_NM = 587.5618
F_LINE_NM = 486.1327
C_LINE_NM = 656.2725

_NM_PER_UM = 1000
# Far beyond what any glass lets through.
_SHORTEST_NM = 1.0
_LONGEST_NM = 1e6
_SCHOTT_COEFFICIENTS = 6


def _as_written(value: float) -> Fraction:
    """The decimal number that a float was written as, exactly (2.5e-3 is 1/400)."""
    return Fraction(repr(float(value)))


def _checked_wavelengths(wavelength_nm: npt.ArrayLike) -> FloatArray:
    wavelengths = np.asarray(wavelength_nm, dtype=np.float64)
    if not np.all((wavelengths >= _SHORTEST_NM) & (wavelengths <= _LONGEST_NM)):
        raise InputError(
            f"a wavelength of light lies between {_SHORTEST_NM:g} and {_LONGEST_NM:g} nanometres"
        )
    return wavelengths


def _index_from_square(
    squared: FloatArray, wavelength_nm: npt.ArrayLike, formula: str
) -> FloatArray:
    usable = np.isfinite(squared) & (squared > 0)
    if not np.all(usable):
        worst = np.broadcast_to(np.asarray(wavelength_nm, dtype=np.float64), squared.shape)[~usable]
        raise InputError(
            f"the {formula} formula has no real index at {worst.flat[0]:g} nm; use a "
            "wavelength away from the glass's absorption bands"
        )
    return np.sqrt(squared)


class _Formula(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    def index(self, wavelength_nm: npt.ArrayLike) -> FloatArray:
        """Refractive index.

        `wavelength_nm`: wavelengths in nm, any shape. Result: indices, shape of `wavelength_nm`.
        Raises `InputError` if a wavelength is none of light, or the formula has no real, positive
        index there.
        """
        return self._at(_checked_wavelengths(wavelength_nm))

    def _at(self, wavelengths: FloatArray) -> FloatArray:
        raise NotImplementedError


class Constant(_Formula):
    """An index without dispersion.

    `value`: refractive index.
    """

    value: Annotated[FiniteFloat, Field(gt=0)]

    def _at(self, wavelengths: FloatArray) -> FloatArray:
        return np.full_like(wavelengths, self.value)


class Schott(_Formula):
    """The Schott formula (thesis Eq. 5.4), wavelength in micrometres.

    n^2 = G0 + G1 L^2 + G2 L^-2 + G3 L^-4 + G4 L^-6 + G5 L^-8

    `coefficients`: G0, G1 in um^-2, then G2 ... G5 in um^2 ... um^8.
    """

    coefficients: Annotated[
        tuple[FiniteFloat, ...],
        Field(min_length=_SCHOTT_COEFFICIENTS, max_length=_SCHOTT_COEFFICIENTS),
    ]

    def _at(self, wavelengths: FloatArray) -> FloatArray:
        squared_um = (wavelengths / _NM_PER_UM) ** 2
        g0, g1, *falling = self.coefficients
        x = 1 / squared_um
        tail = np.zeros_like(x)
        for coefficient in reversed(falling):
            tail = x * (coefficient + tail)
        return _index_from_square(g0 + (g1 * squared_um + tail), wavelengths, "Schott")


class Cauchy(_Formula):
    """Cauchy's equation (thesis Eqs. 5.2 and 5.3), wavelength in nm.

    n = G0 + G1 / L^2 + G2 / L^4 + ...

    `coefficients`: G0, then G1 in nm^2, G2 in nm^4 and so on.
    """

    coefficients: Annotated[tuple[FiniteFloat, ...], Field(min_length=1)]

    def _at(self, wavelengths: FloatArray) -> FloatArray:
        x = wavelengths**-2.0
        index = np.full_like(x, self.coefficients[-1])
        for coefficient in reversed(self.coefficients[:-1]):
            index = coefficient + x * index
        if not np.all(index > 0):
            worst = wavelengths[~(index > 0)].flat[0]
            raise InputError(
                f"Cauchy's equation gives no positive index at {worst:g} nm; use a "
                "wavelength in the range that its coefficients were fitted to"
            )
        return index


class Sellmeier(_Formula):
    """The Sellmeier 1 formula (thesis Eq. 5.6), wavelength in micrometres.

    n^2 = 1 + sum of B_k L^2 / (L^2 - C_k)

    `strengths`: B_k (the thesis's Upsilon), dimensionless. `resonances_um2`: C_k (the thesis's
    Lambda) in um^2.
    """

    strengths: Annotated[tuple[FiniteFloat, ...], Field(min_length=1)]
    resonances_um2: tuple[FiniteFloat, ...]

    @model_validator(mode="after")
    def _same_length(self) -> Self:
        if len(self.strengths) != len(self.resonances_um2):
            raise ValueError("there must be as many resonances as strengths")
        return self

    @cached_property
    def _combined(self) -> tuple[tuple[float, float, float, float | None], ...]:
        """Terms (slope, offset, C_1, C_2): L^2 (slope L^2 - offset) / (L^2 - C_1) / (L^2 - C_2)."""
        # A term with a negative strength is joined with the positive one of the nearest resonance:
        # slope B_1 + B_2 and offset B_1 C_2 + B_2 C_1 are where the pair cancels, and they are
        # computed exactly from the coefficients as written. A term left alone has the offset 0 and
        # no C_2, and stands for slope L^2 / (L^2 - C_1).
        terms = [
            (_as_written(b), _as_written(c))
            for b, c in zip(self.strengths, self.resonances_um2, strict=True)
        ]
        positive = [term for term in terms if term[0] >= 0]
        combined: list[tuple[float, float, float, float | None]] = []
        for b1, c1 in (term for term in terms if term[0] < 0):
            if not positive:
                combined.append((float(b1), 0.0, float(c1), None))
                continue
            partner = min(positive, key=lambda term: abs(term[1] - c1))
            positive.remove(partner)
            b2, c2 = partner
            combined.append((float(b1 + b2), float(b1 * c2 + b2 * c1), float(c1), float(c2)))
        combined += [(float(b), 0.0, float(c), None) for b, c in positive]
        return tuple(combined)

    def _at(self, wavelengths: FloatArray) -> FloatArray:
        # Coefficients fitted by software may hold two huge terms of nearly the same resonance that
        # cancel (thesis Eq. 5.7: 9e5 against an index of 1.5). They are evaluated as one fraction
        # whose small numerator is known exactly.
        squared_um = (wavelengths / _NM_PER_UM) ** 2
        total = np.zeros_like(squared_um)
        with np.errstate(divide="ignore", invalid="ignore"):
            for slope, offset, c1, c2 in self._combined:
                if c2 is None:
                    total = total + slope * (squared_um / (squared_um - c1))
                else:
                    total = total + (slope * squared_um - offset) * (
                        squared_um / (squared_um - c1) / (squared_um - c2)
                    )
        return _index_from_square(1 + total, wavelengths, "Sellmeier")


Dispersion = Cauchy | Schott | Sellmeier | Constant
