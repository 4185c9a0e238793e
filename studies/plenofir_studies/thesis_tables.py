# SPDX-License-Identifier: Apache-2.0
"""The numeric tables of the thesis, with the digits as printed, to check the ray model against.

The files and their format are described in ``data/thesis/README.md``.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from plenofir.ground.errors import InputError
from plenofir_studies import DATA

TABLES = tuple(f"5.{number}" for number in range(1, 14))

_LABELS = frozenset({"lens", "mla", "object"})


@dataclass(frozen=True)
class Printed:
    """A number as printed."""

    text: str

    def __post_init__(self) -> None:
        """Refuse what is not a number."""
        if math.isnan(self.value):
            raise ValueError(f"not a number: {self.text!r}")

    @property
    def value(self) -> float:
        return float(Fraction(self.text)) if "/" in self.text else float(self.text)

    @property
    def decimals(self) -> int:
        return len(self.text.partition(".")[2])

    @property
    def half_unit(self) -> float:
        """Half a unit of the last digit; 0 for fractions and infinity, which are exact."""
        if "/" in self.text or math.isinf(self.value):
            return 0.0
        return 0.5 * 10.0**-self.decimals

    def agrees(self, number: float, slack: float = 0.0) -> bool:
        """Whether a computed number agrees with the printed one."""
        if math.isinf(self.value) or math.isinf(number):
            return self.value == number
        rounding_of_floats = 1e-12 * abs(self.value)
        return abs(number - self.value) <= self.half_unit + slack + rounding_of_floats


@dataclass(frozen=True)
class Cells:
    """Named values: a row of a table or the settings of a part."""

    numbers: Mapping[str, Printed]
    labels: Mapping[str, str]
    erratum: str | None = None

    def __getitem__(self, name: str) -> float:
        """Value of a number."""
        return self.numbers[name].value


@dataclass(frozen=True)
class Part:
    """A part of a table."""

    name: str
    settings: Cells
    rows: tuple[Cells, ...]
    erratum: str | None = None


@dataclass(frozen=True)
class Table:
    """A table."""

    number: str
    topic: str
    parts: tuple[Part, ...]

    def part(self, name: str = "") -> Part:
        for part in self.parts:
            if part.name == name:
                return part
        names = ", ".join(repr(part.name) for part in self.parts)
        raise InputError(f"table {self.number} has no part {name!r}; it has {names}")


def load_table(number: str) -> Table:
    if number not in TABLES:
        raise InputError(f"there is no table {number!r}; choose from {', '.join(TABLES)}")
    folder = DATA / "thesis"
    file = folder.joinpath(f"table_{number.replace('.', '_')}.toml")
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    return Table(
        number=document["table"],
        topic=document["topic"],
        parts=tuple(_part(part) for part in document["parts"]),
    )


def _part(part: Mapping[str, Any]) -> Part:
    return Part(
        name=part["name"],
        settings=_cells(part.get("settings", {})),
        rows=tuple(map(_cells, _rows(part["rows"]))),
        erratum=part.get("erratum"),
    )


def _rows(text: str) -> list[dict[str, str]]:
    """Rows of a table as it is printed, heads first; what is empty is left out."""
    heads, *rows = ([cell.strip() for cell in line.split("|")] for line in text.splitlines())
    return [{name: cell for name, cell in zip(heads, row, strict=True) if cell} for row in rows]


def _cells(cells: Mapping[str, str]) -> Cells:
    return Cells(
        numbers={
            name: Printed(text)
            for name, text in cells.items()
            if name not in _LABELS and name != "erratum"
        },
        labels={name: text for name, text in cells.items() if name in _LABELS},
        erratum=cells.get("erratum"),
    )
