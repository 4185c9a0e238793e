# SPDX-License-Identifier: Apache-2.0
"""Named glasses: from tables of coefficients, or from an index and an Abbe number.

Wavelengths in nm, indices relative to air.
"""

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, ValidationError

from plenofir.camera.optics.dispersion import (
    C_LINE_NM,
    D_LINE_NM,
    F_LINE_NM,
    Cauchy,
    Constant,
    Dispersion,
    FloatArray,
    Schott,
    Sellmeier,
)
from plenofir.camera.optics.tables import parse_number, read_text
from plenofir.ground.errors import InputError
from plenofir.ground.project import DATA

LENS_DATA = DATA / "lenses"
"""Prescriptions and glass tables that the package ships."""

_TABLE_TOLERANCE = 1e-3


class Glass(BaseModel):
    """A medium: its name and its dispersion.

    `name`: for instance ``"N-SK16"``. `dispersion`: the formula of its index.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    dispersion: Dispersion

    def index(self, wavelength_nm: npt.ArrayLike) -> FloatArray:
        """Refractive index at wavelengths in nm of any shape, see `Constant.index`."""
        return self.dispersion.index(wavelength_nm)

    @property
    def abbe_number(self) -> float:
        """(n_d - 1) / (n_F - n_C); infinite without dispersion."""
        d, f, c = (float(self.index(line)) for line in (D_LINE_NM, F_LINE_NM, C_LINE_NM))
        return (d - 1) / (f - c) if f != c else float("inf")


AIR = Glass(name="air", dispersion=Constant(value=1.0))


def glass_from_abbe(name: str, index_d: float, abbe_number: float) -> Glass:
    """A glass of which only the index and the Abbe number are known.

    An approximation: Cauchy's equation with two terms, n = A + B / L^2, through n_d and n_F - n_C.
    Between the F and the C line it departs from the glasses of the shipped tables by less than 1e-4
    (v_d > 40) or 5e-4 (dense flints); from 400 to 700 nm, the most at the blue end, by less than
    7e-4 (v_d > 50), 2e-3 (v_d > 40) or 8e-3.

    `index_d`: n_d at 587.5618 nm, above 1. `abbe_number`: v_d = (n_d - 1) / (n_F - n_C), positive.
    Result: with a two-term Cauchy equation. Raises `InputError` if the index is not above 1 or the
    Abbe number is not positive.
    """
    if not 1 < index_d < float("inf"):
        raise InputError(
            f"an index of {index_d:g} is too low; it must be above 1", where=f"glass {name}"
        )
    if not 0 < abbe_number < float("inf"):
        raise InputError(
            f"an Abbe number of {abbe_number:g} is not possible; it must be positive",
            where=f"glass {name}",
        )
    rise = (index_d - 1) / abbe_number / (F_LINE_NM**-2 - C_LINE_NM**-2)
    return Glass(name=name, dispersion=Cauchy(coefficients=(index_d - rise / D_LINE_NM**2, rise)))


def _sellmeier_row(numbers: list[float]) -> Sellmeier:
    return Sellmeier(strengths=tuple(numbers[:3]), resonances_um2=tuple(numbers[3:]))


def _schott_row(numbers: list[float]) -> Schott:
    return Schott(coefficients=tuple(numbers))


_ROW_READERS: Mapping[str, Callable[[list[float]], Schott | Sellmeier]] = {
    "sellmeier": _sellmeier_row,
    "schott": _schott_row,
}


def read_glass_table(path: Path, formula: Literal["sellmeier", "schott"]) -> dict[str, Glass]:
    """Read a table of glasses: name, six coefficients and n_d in each row, separated by commas.

    Lines that are empty or start with ``#`` are skipped. n_d is checked against the formula, so
    that a slip in a coefficient does not pass.

    `path`: CSV file without a header. `formula`: "sellmeier": B_1, B_2, B_3, then C_1, C_2, C_3 in
    um^2. "schott": G0 ... G5, wavelength in um. Result: glasses by name. Raises `InputError` if the
    file cannot be read, or naming the line and field that is wrong.
    """
    glasses: dict[str, Glass] = {}
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        row = f"{path}: line {number}"
        name, *fields = (field.strip() for field in line.split(","))
        if len(fields) != 7:
            raise InputError(
                f"has {len(fields)} numbers after the name; it must have 6 coefficients and n_d",
                where=row,
            )
        *coefficients, index_d = (
            parse_number(field, where=f"{row}, field {k}")
            for k, field in enumerate(fields, start=2)
        )
        try:
            glass = Glass(name=name, dispersion=_ROW_READERS[formula](coefficients))
            computed = float(glass.index(D_LINE_NM))
        except (ValidationError, InputError):
            computed = float("nan")
        if not abs(computed - index_d) <= _TABLE_TOLERANCE:
            raise InputError(
                f"the coefficients of {name} give n_d = {computed:.5f}, but the row says "
                f"{index_d:g}; check the {formula} coefficients",
                where=row,
            )
        glasses[name] = glass
    return glasses


@cache
def glass_catalogue() -> Mapping[str, Glass]:
    """Glasses that the package ships tables of."""
    glasses = read_glass_table(LENS_DATA / "glasses_schott.csv", "schott")
    glasses |= read_glass_table(LENS_DATA / "glasses_sellmeier.csv", "sellmeier")
    return MappingProxyType(glasses)
