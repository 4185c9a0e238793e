# SPDX-License-Identifier: Apache-2.0
"""Light-field microscopes: where their refocused planes lie, in um from the plane in focus.

The aperture stop of a microscope's objective lies in its back focal plane, so the entrance pupil is
infinitely far (the objective is telecentric on the object's side) and each view is a parallel
projection: Levoy et al., Light Field Microscopy, ACM Transactions on Graphics 25(3), 2006. By
Abbe's sine condition (Born and Wolf, Principles of Optics, section 4.5.1), view i, i pixels from
the middle of a micro image, sees the object under the angle theta_i to the axis with

    n sin theta_i = V i kappa,    kappa = p_p / f_s,

V the magnification, n the index of immersion. A point at height z over the plane in focus lies
z tan theta_i beside its place there in view i, that is V z tan theta_i / p_M micro lenses.
Refocusing moves view i by a i lenses. The a nearest to all of these moves, by least squares over
the views of the round pupil, which are even in sin theta, is a = z g V^2 kappa / (n p_M), so

    z = a n p_M f_s / (g V^2 p_p),
    g = mean(tan theta sin theta) / mean(sin^2 theta) = 4 (2/3 - c + c^3 / 3) / s^4,

s the sine of the outermost view, c = sqrt(1 - s^2). g is 1 + s^2 / 3 for small angles, where z is
the ray model's image distance d' = a p_M f_s / p_p (`plenofir.camera.rays.model`) over V^2 / n, the
magnification along the axis. z grows with a, towards the objective.
"""

from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from plenofir.camera.rays.camera import (
    Camera,
    Instrument,
    Length,
    Part,
    camera_names,
    check_micro_image,
    checked,
    description,
    microscope_names,
)
from plenofir.camera.rays.precise import Values

_UM = 1000.0
# Immersion media end at 1.8 (methylene iodide); the largest magnifications are below 1000.
_LARGEST_INDEX, _LARGEST_MAGNIFICATION = 2.0, 1e4
# Below this sine the series 1 + s^2 / 3 is exact to nine digits, and the closed form is not.
_SMALL_SINE = 1e-2


class Objective(Part):
    """A microscope's objective."""

    # As engraved: with the tube lens that it is made for.
    magnification: Annotated[float, Field(gt=0, le=_LARGEST_MAGNIFICATION)]
    # NA = n sin theta of the outermost ray.
    numerical_aperture: Annotated[float, Field(gt=0, le=_LARGEST_INDEX)]
    # n, refractive index of what the object lies in: 1 for air, 1.33 for water.
    immersion_index: Annotated[float, Field(ge=1, le=_LARGEST_INDEX)] = 1.0
    # Focal length of the tube lens that is there, if it is not the one that it is made for.
    tube_lens_mm: Length | None = None
    # Focal length of the tube lens it is made for: 200 mm by Leica, Mitutoyo and Nikon, 180 by
    # Olympus, 165 by Zeiss.
    made_for_tube_lens_mm: Length | None = None

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.numerical_aperture >= self.immersion_index:
            raise ValueError(
                f"numerical_aperture {self.numerical_aperture:g} must be below immersion_index "
                f"{self.immersion_index:g}"
            )
        if self.made_for_tube_lens_mm is not None and self.tube_lens_mm is None:
            raise ValueError("tube_lens_mm is missing, the tube lens that is there")
        return self

    @property
    def real_magnification(self) -> float:
        """V: with the tube lens that is there."""
        there, meant = self.tube_lens_mm, self.made_for_tube_lens_mm
        return self.magnification * (there / meant if there and meant else 1.0)


class Microscope(Instrument):
    """A light-field microscope: its micro lenses stand in the image plane of the tube lens.

    `source`: where its numbers are from. `sensor.pixel_pitch_mm`: at the micro lenses; with a relay
    lens the sensor's own pitch over the relay's magnification.
    """

    source: str = ""
    objective: Objective

    @model_validator(mode="after")
    def _standard(self) -> Self:
        if not self.micro_lenses.standard:
            raise ValueError(
                "sensor_distance_mm other than focal_length_mm is for cameras: the heights of a "
                "microscope with focused micro lenses are not known here"
            )
        return self


def load_instrument(path: str | Path) -> Camera | Microscope:
    """Load a camera or a microscope: a shipped one by name, or any from a TOML file.

    A file with the part `objective` is a microscope. Raises `InputError` as `load_camera` does.
    """
    content, place = description(path, [*camera_names(), *microscope_names()])
    if "objective" in content:
        return checked(Microscope, content, place)
    return checked(Camera, content, place)


@dataclass(frozen=True)
class MicroscopeModel:
    """A microscope with micro images of M x M pixels; see the module for the equations.

    Raises `InputError` if M is not possible.
    """

    microscope: Microscope
    micro_image_size: int

    def __post_init__(self) -> None:
        """Check M."""
        check_micro_image(self.micro_image_size)

    @property
    def _pixel_slope(self) -> float:
        """Kappa."""
        array = self.microscope.micro_lenses
        return self.microscope.sensor.pixel_pitch_mm / array.focal_length_mm

    @property
    def outermost_sine(self) -> float:
        """Sine s of the outermost view's angle: that of the aperture, or of the M pixels."""
        objective = self.microscope.objective
        n = objective.immersion_index
        of_pixels = self.micro_image_size / 2 * self._pixel_slope * objective.real_magnification / n
        return min(objective.numerical_aperture / n, of_pixels)

    @property
    def steepness(self) -> float:
        """g: how much faster views move than their sines say."""
        s = self.outermost_sine
        if s < _SMALL_SINE:
            return 1 + s * s / 3
        c = sqrt(1 - s * s)
        return 4 * (2 / 3 - c + c**3 / 3) / s**4

    @property
    def um_per_a(self) -> float:
        """Dz / da in um."""
        objective, array = self.microscope.objective, self.microscope.micro_lenses
        longitudinal = objective.immersion_index / objective.real_magnification**2
        return _UM * array.pitch_mm / self._pixel_slope * longitudinal / self.steepness

    @property
    def pixel_um(self) -> float:
        """Width of a refocused picture's pixel at the object: p_M / (M V)."""
        pitch = _UM * self.microscope.micro_lenses.pitch_mm
        return pitch / self.micro_image_size / self.microscope.objective.real_magnification

    def height_um(self, a: npt.ArrayLike) -> Values:
        """Heights z in um of refocused planes; `a`: focus settings, any shape."""
        return np.asarray(a, dtype=np.float64) * self.um_per_a

    def depth_of_field_um(self, a: npt.ArrayLike) -> tuple[Values, Values]:
        """Where the depths of field of planes begin and end: far, near; z in um.

        Rays through the edges of pixels and micro lenses meet there (Eqs. 3.36-3.43), in planes
        (a (M-1) + k) / (M-1-k) with k = -1 and 1. One pixel has no end.
        """
        values, span = np.asarray(a, dtype=np.float64), self.micro_image_size - 1
        with np.errstate(divide="ignore"):
            far, near = ((values * span + k) / np.float64(span - k) for k in (-1, 1))
        return self.height_um(far), self.height_um(near)

    def focus_setting(self, height_um: npt.ArrayLike) -> Values:
        """Focus setting a of planes at heights z in um: the inverse of `height_um`."""
        return np.asarray(height_um, dtype=np.float64) / self.um_per_a

    def micro_image_note(self) -> str:
        """What is wrong with M; empty if the micro images have M pixels."""
        return self.microscope.micro_image_note(self.micro_image_size)
