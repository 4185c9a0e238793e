# SPDX-License-Identifier: Apache-2.0
"""Micro lenses as thick lenses: the lens maker's equation, principal planes, sensor distance.

Lengths in mm, curvatures (1 / radius) in 1/mm. All formulas are in curvatures, so a plane is
curvature 0 and nothing is divided by an infinite radius. A radius is positive when its centre lies
behind the surface.
"""

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from plenofir.ground.errors import InputError


class ThickLens(BaseModel):
    """A single lens in air.

    Attributes
    ----------
    front_curvature_per_mm
        Curvature of the surface towards the object, 1/mm.
    back_curvature_per_mm
        Curvature of the surface towards the sensor, 1/mm.
    thickness_mm
        Distance of the vertices, mm.
    index
        Refractive index, relative to air.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    front_curvature_per_mm: FiniteFloat
    back_curvature_per_mm: FiniteFloat
    thickness_mm: Annotated[FiniteFloat, Field(ge=0)]
    index: Annotated[FiniteFloat, Field(gt=0)]

    @property
    def front_radius_mm(self) -> float:
        """R_1s: radius of the front surface in mm, infinite for a plane."""
        return _radius(self.front_curvature_per_mm)

    @property
    def back_radius_mm(self) -> float:
        """R_2s: radius of the back surface in mm, infinite for a plane."""
        return _radius(self.back_curvature_per_mm)

    @property
    def power_per_mm(self) -> float:
        """1 / f_s in 1/mm.

        The lens maker's equation for a thick lens; with one plane surface, whatever the thickness,
        it is the thesis's Eq. (5.8).
        """
        front, back, n = self.front_curvature_per_mm, self.back_curvature_per_mm, self.index
        bulge = (n - 1) * self.thickness_mm * front * back / n
        return (n - 1) * (front - back + bulge)

    @property
    def focal_length_mm(self) -> float:
        """f_s in mm.

        Raises `InputError` if the lens has no power.
        """
        power = self.power_per_mm
        if power == 0:
            raise InputError("the micro lens has no power; one surface must be curved")
        return 1 / power

    @property
    def front_principal_plane_mm(self) -> float:
        """H_1s in mm from the front vertex, positive towards the sensor (thesis Eq. 5.11).

        Raises `InputError` if the lens has no power.
        """
        return self._shift(self.back_curvature_per_mm)

    @property
    def back_principal_plane_mm(self) -> float:
        """H_2s in mm from the back vertex, positive towards the sensor (thesis Eq. 5.12).

        Raises `InputError` if the lens has no power.
        """
        return self._shift(self.front_curvature_per_mm)

    @property
    def principal_plane_separation_mm(self) -> float:
        """From the front to the back principal plane in mm (Eq. 5.13 for either orientation).

        Raises `InputError` if the lens has no power.
        """
        return self.thickness_mm + self.back_principal_plane_mm - self.front_principal_plane_mm

    @property
    def sensor_distance_mm(self) -> float:
        """d_s: from the back vertex to the sensor in the back focal plane, mm (thesis Eq. 5.14).

        Equals f_s when the plane side faces the object.

        Raises `InputError` if the lens has no power.
        """
        return self.focal_length_mm + self.back_principal_plane_mm

    def _shift(self, opposite_curvature: float) -> float:
        shift = self.focal_length_mm * self.thickness_mm * (self.index - 1) / self.index
        return -shift * opposite_curvature


def _radius(curvature: float) -> float:
    return 1 / curvature if curvature != 0 else math.inf


def plano_convex(
    focal_length_mm: float,
    thickness_mm: float,
    index: float,
    *,
    curved_side: Literal["front", "back"] = "front",
) -> ThickLens:
    """A plano-convex micro lens of a given focal length (thesis Eqs. 5.9 and 5.10).

    Result: the other surface is a plane. Raises `InputError` if the focal length, thickness or
    index is not allowed.

    Parameters
    ----------
    focal_length_mm
        f_s in mm, not 0 (negative: plano-concave).
    thickness_mm
        t_s in mm, 0 or more.
    index
        Refractive index, positive and not 1.
    curved_side
        "front": towards the object, as in thesis Table 5.1. "back": towards the sensor.
    """
    if not math.isfinite(focal_length_mm) or focal_length_mm == 0:
        raise InputError(
            f"a focal length of {focal_length_mm:g} mm is not possible; it must be a number other "
            "than 0"
        )
    if not math.isfinite(thickness_mm) or thickness_mm < 0:
        raise InputError(
            f"a thickness of {thickness_mm:g} mm is not possible; it must be 0 or more"
        )
    if not math.isfinite(index) or index <= 0 or index == 1:
        raise InputError(
            f"a refractive index of {index:g} is not possible; it must be positive and not 1"
        )
    curvature = 1 / (focal_length_mm * (index - 1))
    return ThickLens(
        front_curvature_per_mm=curvature if curved_side == "front" else 0.0,
        back_curvature_per_mm=-curvature if curved_side == "back" else 0.0,
        thickness_mm=thickness_mm,
        index=index,
    )
