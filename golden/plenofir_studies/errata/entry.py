# SPDX-License-Identifier: Apache-2.0
"""An erratum of the thesis: what is printed, what holds, and a computation that tells the two."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Shown:
    """What the computation of an erratum found."""

    text: str  # what was computed, with its numbers
    # how far what is printed, and what holds, miss what they should give
    printed: float
    holds: float
    limit: float  # a miss up to this is rounding

    @property
    def confirmed(self) -> bool:
        """Whether what is printed misses and what holds does not."""
        return self.holds <= self.limit < self.printed


@dataclass(frozen=True)
class Erratum:
    """A place of the thesis that is wrong, contradicts another, or says less than it seems to."""

    key: str
    where: str
    printed: str
    holds: str
    show: Callable[[], Shown]
