# SPDX-License-Identifier: Apache-2.0
"""Distances of refocused planes and their states, and the extension that focuses a main lens."""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from enum import StrEnum
from math import inf, isfinite

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.precise import CONTEXT, Values, exact
from plenofir.ground.errors import InputError


class State(StrEnum):
    """Where the rays of a plane meet."""

    REAL = "real"  # in front of the main lens
    INFINITY = "infinity"  # nowhere: the rays are parallel
    BEYOND_INFINITY = "beyond infinity"  # nowhere: the rays diverge towards the scene
    INSIDE_LENS = "inside lens"  # inside the main lens: nothing can be placed there
    # A border of a depth of field that there is not: the micro lenses of every type blur this plane
    # by more than a pixel and the box.
    BLURRED = "no lens type is sharp"


States = npt.NDArray[np.int8]
"""Indices into `STATES`."""
STATES = tuple(State)
REAL, INFINITY, BEYOND, INSIDE, BLURRED = range(len(STATES))


@dataclass(frozen=True)
class Distances:
    """Distances of planes from the micro lenses.

    `mm`: distance in mm; nan for planes at and beyond infinity, and for borders where no type of
    micro lens is sharp. Planes inside the lens have the number at which their rays would meet.
    `states`: indices into `STATES`, same shape.
    """

    mm: Values
    states: States

    def state(self, *index: int) -> State:
        """State of one plane."""
        return STATES[int(self.states[index])]


@dataclass(frozen=True)
class Planes:
    """Refocused planes with their depths of field.

    `centre`, `near`, `far`: distances of the planes and of the borders of their depths of field.
    """

    a: Values
    centre: Distances
    near: Distances
    far: Distances


def lens_extension(
    focal_length_mm: float, principal_plane_separation_mm: float, focus_mm: float
) -> Decimal:
    """Extension e = b_U - f_U that focuses the main lens to a distance, Eq. (5.16) solved.

    With S = d_f - H1H2 and T = S - 2 f_U, e is the smaller root of e^2 - T e + f_U^2 = 0:
    e = 2 f_U^2 / (T + sqrt(S (S - 4 f_U))). S = 4 f_U is imaging at 1:1; nearer there is no image.

    `focal_length_mm`: f_U. `principal_plane_separation_mm`: H1H2. `focus_mm`: d_f from the micro
    lenses to the focused plane; inf is allowed. Result: e in mm to about sixty digits, 0 for
    infinity. Raises `InputError` if no real image exists at that distance.
    """
    if focus_mm == inf:
        return Decimal(0)
    f = exact(focal_length_mm)
    with localcontext(CONTEXT):
        nearest = 4 * f + exact(principal_plane_separation_mm)
        if not isfinite(focus_mm) or exact(focus_mm) < nearest:
            raise InputError(
                f"{focus_mm} mm is nearer than the main lens can focus; use at least "
                f"{float(nearest):.4f} mm, or inf",
                where="focus",
            )
        distance = exact(focus_mm) - exact(principal_plane_separation_mm)
        root = (distance * (distance - 4 * f)).sqrt()
        return 2 * f * f / (distance - 2 * f + root)
