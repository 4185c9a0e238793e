# SPDX-License-Identifier: Apache-2.0
"""Types of micro lenses of a focused camera: which lens is of which type, and where it is sharp."""

from itertools import permutations
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from plenofir.camera.calibration.grid import Floats, Grid, Indices

_MOST_TYPES = 3
# Stands for virtual depths without end.
_FARTHEST = 1e6


def usual_order(grid: Grid, t: Indices, s: Indices, types: int) -> Indices:
    """Type of micro lenses, counted from 0, in an array of several types in the usual order.

    On a hexagonal grid no lens of three types has a neighbour of its own type, on a square one none
    of two has one beside it. `t`, `s`: rows and columns, any shape. Result: same shape.
    """
    if grid.layout == "rectangular":
        return np.asarray((t + s) % types)
    row, place = (t, s) if grid.layout == "hexagonal-rows" else (s, t)
    shifted = row + grid.stagger
    return np.asarray((place + (shifted % 2 - shifted) // 2 - row) % types)


class LensTypes(BaseModel):
    """Types of micro lenses, which make a calibration that of a focused camera.

    Attributes
    ----------
    pattern
        Type of the lenses that `usual_order` counts as 0, 1, ..: a permutation of the types.
    sharpest
        For each type 1 / v of the virtual depth at which it is sharpest, 0 for infinity; v counts
        as micro images do (`plenofir.camera.focused`).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    pattern: tuple[Annotated[int, Field(ge=0, lt=_MOST_TYPES)], ...]
    sharpest: tuple[Annotated[float, Field(gt=-1, lt=1)], ...]

    @model_validator(mode="after")
    def _is_a_pattern(self) -> "LensTypes":
        if self.pattern not in permutations(range(len(self.sharpest))):
            raise ValueError(f"pattern {list(self.pattern)} for {len(self.sharpest)} types")
        if not self.pattern:
            raise ValueError("no type")
        return self

    def at(self, grid: Grid, t: Indices, s: Indices) -> Indices:
        """Type of lenses of the grid, same shape as their rows and columns `t`, `s`."""
        return np.array(self.pattern)[usual_order(grid, t, s, len(self.pattern))]

    def ranges(self, pitch: float) -> tuple[tuple[float, float], ...]:
        """Virtual depths from - to at which each type blurs by a pixel at most; inf beyond.

        `pitch`: distance of neighbouring micro images in pixels.
        """
        ends = np.array(self.sharpest)[:, np.newaxis] + np.array([1, -1]) / pitch
        # Beyond infinity micro images are turned: that is another side, and not usable here.
        side = np.where(np.array(self.sharpest) < 0, -1.0, 1.0)[:, np.newaxis]
        depths = 1 / np.maximum(ends * side, 1e-300)
        return tuple(
            (float(low), float(high)) for low, high in np.sort(np.minimum(depths, _FARTHEST)) * side
        )

    def described(self, pitch: float) -> tuple[str, ...]:
        """The types, where they are sharp, and the box for that, for people."""
        depths = ", ".join(f"{1 / x:.3g}" if x else "inf" for x in self.sharpest)
        kinds = "1 type" if len(self.pattern) == 1 else f"{len(self.pattern)} types"
        ranges = self.ranges(pitch)
        spans = ", ".join(
            f"{a:.3g} to {'inf' if abs(b) >= _FARTHEST else f'{b:.3g}'}" for a, b in ranges
        )
        least, most = (
            float(end(abs(one) for pair in ranges for one in pair)) for end in (min, max)
        )
        box = f"B = |v|, rounded: {max(1, round(least))} to {min(round(most), round(pitch))}"
        return (
            f"{kinds}, sharpest at v = {depths}",
            f"usable, blurred by a pixel at most: v = {spans}; {box}",
        )

    def carried(self, old: Grid, new: Grid, matrix: Floats, shift: Floats) -> "LensTypes":
        """The same lenses, counted by another grid.

        `matrix`, `shift`: where pixel positions (y, x) of the old grid are in the new one's.
        """
        t, s = np.divmod(np.arange(9), 3)
        places = (new.centres(t, s) - shift) @ np.linalg.inv(matrix).T
        types = self.at(old, *old.nearest(places)[:2])
        order = usual_order(new, t, s, len(self.pattern))
        pattern = tuple(int(types[order == k][0]) for k in range(len(self.pattern)))
        return self.model_copy(update={"pattern": pattern})
