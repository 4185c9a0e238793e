# SPDX-License-Identifier: Apache-2.0
"""An erratum of the thesis: printed, correct, and a computation that distinguishes the two."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Shown:
    """Result of the computation for an erratum."""

    text: str  # what was computed, with its numbers
    # errors of the printed and of the correct version
    printed: float
    holds: float
    limit: float  # errors up to this are rounding

    @property
    def confirmed(self) -> bool:
        """Whether the printed version is wrong and the correct one is not."""
        return self.holds <= self.limit < self.printed


@dataclass(frozen=True)
class Erratum:
    """A place of the thesis that is wrong, contradicts another, or says less than it seems to."""

    key: str
    where: str
    printed: str
    holds: str
    show: Callable[[], Shown]
