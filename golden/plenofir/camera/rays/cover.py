# SPDX-License-Identifier: Apache-2.0
"""Which slices cover a range of depths, and what lies between their depths of field."""

from dataclasses import dataclass
from fractions import Fraction
from math import floor, inf

import numpy as np

from plenofir.camera.rays.distances import State
from plenofir.camera.rays.lens_types import sharpest_type
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError

# More planes than any camera tells apart.
_MOST_PLANES = 200_000


@dataclass(frozen=True)
class Slice:
    """One refocused slice.

    `near_mm`, `far_mm`: depth of field; inf where it reaches infinity.
    """

    a: Fraction
    near_mm: float
    far_mm: float


@dataclass(frozen=True)
class Cover:
    """Slices, and the parts of the range that none of them covers.

    `slices`: from far to near. `gaps`: (near, far) in mm of each uncovered part of the range, from
    far to near.
    """

    slices: tuple[Slice, ...]
    gaps: tuple[tuple[float, float], ...]


def depth_of_field(model: RayModel, a: Fraction) -> Slice | None:
    """Depth of field of a slice in front of the lens.

    Result: None if no real distance is in focus, or no type of micro lens is sharp.
    """
    near, far = model.near_border(float(a)), model.far_border(float(a))
    if near.state() in (State.INFINITY, State.BEYOND_INFINITY, State.BLURRED):
        return None
    if far.state() is State.INSIDE_LENS:
        return None
    reach = inf if far.state() in (State.INFINITY, State.BEYOND_INFINITY) else float(far.mm)
    return Slice(a, float(near.mm), reach)


def gaps_between(
    slices: list[Slice], near_mm: float, far_mm: float
) -> tuple[tuple[float, float], ...]:
    """Find the parts of a range that no slice covers.

    `slices`: slices in any order. `near_mm`, `far_mm`: the range. Result: (near, far) of each gap,
    from far to near.
    """
    between = []
    covered_down_to = far_mm
    for part in sorted(slices, key=lambda s: s.far_mm, reverse=True):
        between.append((max(part.far_mm, near_mm), covered_down_to))
        covered_down_to = min(covered_down_to, part.near_mm)
    between.append((near_mm, covered_down_to))
    return tuple((near, far) for near, far in between if near < far)


def without_idle_slices(cover: Cover, near_mm: float, far_mm: float) -> Cover:
    """Drop slices whose depth of field adds nothing to that of the others."""

    def uncovered(slices: list[Slice]) -> float:
        # In reciprocal distances a gap to infinity has a finite size.
        return sum(1 / low - (0 if high == inf else 1 / high) for low, high in gaps(slices))

    def gaps(slices: list[Slice]) -> tuple[tuple[float, float], ...]:
        return gaps_between(slices, near_mm, far_mm)

    kept = list(cover.slices)
    for part in cover.slices:
        others = [other for other in kept if other is not part]
        if others and uncovered(others) <= uncovered(kept):
            kept = others
    return Cover(tuple(kept), gaps(kept))


def covering_slices(
    model: RayModel, near_mm: float, far_mm: float, *, step: Fraction | None = None
) -> Cover:
    """Choose the fewest slices whose depths of field cover a range.

    From the far end on, each slice is the nearest one whose depth of field still reaches what is
    not covered yet. Where the grid leaves a gap, the next slice follows, as behind planes where no
    type of micro lens of a focused camera is sharp.

    `near_mm`, `far_mm`: range of distances from the micro lenses; far may be inf. `step`: grid of
    focus settings; 1/M if None. Raises `InputError` if the range is empty.
    """
    if not 0 < near_mm < far_mm:
        raise InputError(
            f"{near_mm:g} to {far_mm:g} mm is not a range of distances; give 0 < near < far"
        )
    grid = step or Fraction(1, model.micro_image_size)
    chosen: list[Slice] = []
    if not model.camera.micro_lenses.standard:
        chosen = _chosen_of(_sharp_slices(model, near_mm, far_mm, grid), near_mm, far_mm)
        return Cover(tuple(chosen), gaps_between(chosen, near_mm, far_mm))
    to_cover = far_mm
    while to_cover > near_mm:
        # Far borders come nearer as a grows: the last slice that still reaches to_cover.
        index = floor(float(model.focus_setting(to_cover, "far")) / float(grid))
        # Where it leaves a gap, the next slice begins below that.
        reaching = (depth_of_field(model, (index + n) * grid) for n in (0, 1))
        part = next((p for p in reaching if p is not None and p.near_mm < to_cover), None)
        if part is None or part.far_mm <= near_mm:
            break
        chosen.append(part)
        to_cover = part.near_mm
    return Cover(tuple(chosen), gaps_between(chosen, near_mm, far_mm))


def _sharp_slices(model: RayModel, near_mm: float, far_mm: float, grid: Fraction) -> list[Slice]:
    """Slices of a focused camera that some type of micro lens sees sharply, from far to near."""
    first = float(model.focus_setting(far_mm, "far")) / float(grid)
    last = float(model.focus_setting(near_mm, "near")) / float(grid)
    if not last - first < _MOST_PLANES:
        raise InputError(
            f"{near_mm:g} to {far_mm:g} mm is a range of more than {_MOST_PLANES} planes; give "
            "a shorter one"
        )
    numbers = np.arange(floor(first), floor(last) + 2)
    sharp = numbers[sharpest_type(model, numbers * float(grid)).sharp]
    parts = (depth_of_field(model, int(number) * grid) for number in sharp)
    return [part for part in parts if part is not None]


def _chosen_of(slices: list[Slice], near_mm: float, far_mm: float) -> list[Slice]:
    """The fewest of slices, given from far to near, that cover as much of a range as all."""
    chosen: list[Slice] = []
    to_cover = far_mm
    inside = [part for part in slices if part.near_mm < far_mm and part.far_mm > near_mm]
    while inside and to_cover > near_mm:
        reaching = [part for part in inside if part.far_mm >= to_cover]
        part = reaching[-1] if reaching else inside[0]
        chosen.append(part)
        to_cover = part.near_mm
        inside = [other for other in inside if other.near_mm < to_cover]
    return chosen
