# SPDX-License-Identifier: Apache-2.0
"""A camera as it is focused: its lengths, and chief rays through its micro lenses and main lens."""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.camera import Camera, check_micro_image
from plenofir.camera.rays.distances import lens_extension
from plenofir.camera.rays.precise import CONTEXT, Values, exact
from plenofir.ground.errors import InputError

Origin = Literal["exit pupil", "principal plane", "aperture stop", "ideal"]
"""Where the chief rays of micro image centres may come from."""


@dataclass(frozen=True)
class FocusedCamera:
    """Geometry of a camera that was focused, with micro images of M pixels: base of `RayModel`."""

    camera: Camera
    extension: Decimal
    micro_image_size: int
    box: int | None = None

    def __post_init__(self) -> None:
        """Check M, the box and the exit pupil."""
        if not CONTEXT.add(exact(self.camera.main_lens.exit_pupil_mm), self.extension):
            raise InputError(
                "the exit pupil lies in the micro lenses at this focus", where=self.camera.name
            )
        m = self.micro_image_size
        check_micro_image(m)
        if self.box is not None and not (isinstance(self.box, int) and 1 <= self.box <= m):
            raise InputError(f"{self.box!r} samples; use an integer from 1 to M = {m}", where="box")

    @classmethod
    def focused(
        cls, camera: Camera, focus_mm: float, micro_image_size: int, box: int | None = None
    ) -> Self:
        """Focus a camera on a plane.

        `focus_mm`: d_f from the micro lenses to the plane; inf is allowed. `micro_image_size`: M, 2
        or more. `box`: samples of a slice that are averaged; None for M in a standard camera and
        |a'| = |a M| (at most M) in a focused one. Raises `InputError` if M, the box or the focus is
        not possible.
        """
        lens = camera.main_lens
        f, separation = lens.focal_length_mm, lens.principal_plane_separation_mm
        return cls(camera, lens_extension(f, separation, focus_mm), micro_image_size, box)

    def micro_image_note(self) -> str:
        """What is wrong with M for this camera; empty if its micro images have M pixels."""
        return self.camera.micro_image_note(self.micro_image_size)

    @property
    def extension_mm(self) -> float:
        """Extension e = b_U - f_U of the main lens."""
        return float(self.extension)

    @property
    def image_distance_mm(self) -> float:
        """Image distance b_U from the principal plane to the micro lenses."""
        return float(CONTEXT.add(exact(self.camera.main_lens.focal_length_mm), self.extension))

    @property
    def exit_pupil_mm(self) -> float:
        """Distance d_A' from the micro lenses to the exit pupil; it moves with the lens.

        inf where the lens is telecentric on its image side, negative behind the micro lenses.
        """
        return float(CONTEXT.add(exact(self.camera.main_lens.exit_pupil_mm), self.extension))

    @property
    def pupil_ratio(self) -> float:
        """d_A' divided by its value at infinity focus: 1 + e / d_A'."""
        return 1 + self.extension_mm / self.camera.main_lens.exit_pupil_mm

    @property
    def aperture_stop_mm(self) -> float | None:
        """Distance d_A from the micro lenses to the aperture stop, if known; it moves likewise."""
        stop = self.camera.main_lens.aperture_stop_mm
        return None if stop is None else float(CONTEXT.add(exact(stop), self.extension))

    @property
    def pixel_slope(self) -> float:
        """Slope kappa = p_p / b_s between rays of neighbouring pixels of a micro image."""
        return self.camera.sensor.pixel_pitch_mm / self.camera.micro_lenses.spacing_mm

    def micro_lens_position(self, j: npt.ArrayLike) -> Values:
        """Positions s_j of micro lenses, counted from the optical axis (Eq. 3.19).

        `j`: index relative to the central micro lens (j - o of the thesis), any shape. Result: mm,
        same shape.
        """
        return np.asarray(j, dtype=np.float64) * self.camera.micro_lenses.pitch_mm

    def micro_image_centre(
        self, position_mm: npt.ArrayLike, origin: Origin = "exit pupil"
    ) -> Values:
        """Micro image centres (Eqs. 3.21, 3.22, 5.17, 5.18).

        `position_mm`: positions s_j of micro lenses, any shape. `origin`: where their chief rays
        come from: the exit pupil (5.18), the principal plane (5.17), the aperture stop (5.18 with
        d_A, for Tables 5.3 and 5.4) or infinitely far (the ideal model). Result: u_c,j in mm, same
        shape. Raises `InputError` if the place of the aperture stop is asked for and not known.
        """
        s = np.asarray(position_mm, dtype=np.float64)
        if origin == "ideal":
            return s
        lengths = {
            "exit pupil": self.exit_pupil_mm,
            "principal plane": self.image_distance_mm,
            "aperture stop": self.aperture_stop_mm,
        }
        length = lengths[origin]
        if length is None:
            raise InputError(
                "the camera's aperture stop is not known; add main_lens.aperture_stop_mm to "
                "its file",
                where=self.camera.name,
            )
        return s + s * (self.camera.micro_lenses.spacing_mm / length)

    def chief_ray_slope(self, i: npt.ArrayLike, position_mm: npt.ArrayLike) -> Values:
        """Slopes of chief rays between micro lenses and main lens (Eq. 3.24).

        `i`: pixel of the micro image, counted from its centre; fractions are allowed.
        `position_mm`: positions s_j of micro lenses, broadcast with `i`. Result: m_c+i,j.
        """
        s = np.asarray(position_mm, dtype=np.float64)
        return -s / self.exit_pupil_mm - np.asarray(i, dtype=np.float64) * self.pixel_slope

    def object_ray(self, i: npt.ArrayLike, position_mm: npt.ArrayLike) -> tuple[Values, Values]:
        """Chief rays in object space (Eqs. 3.25-3.28).

        `i`, `position_mm`: as in `chief_ray_slope`. Result: slope q and height U at the object-side
        principal plane: height(z) = q z + U.
        """
        s = np.asarray(position_mm, dtype=np.float64)
        slope = self.chief_ray_slope(i, s)
        height = slope * self.image_distance_mm + s
        return -(slope * self.extension_mm + s) / self.camera.main_lens.focal_length_mm, height

    @property
    def entrance_pupil_mm(self) -> float:
        """Distance d_A'' from the micro lenses to the entrance pupil (Eqs. 3.52, 3.53).

        The virtual cameras stand there; negative where it lies behind the micro lenses.
        """
        lens = self.camera.main_lens
        with localcontext(CONTEXT):
            plane = exact(lens.focal_length_mm) + self.extension
            plane += exact(lens.principal_plane_separation_mm)
            return float(plane + self._entrance_pupil_from_plane)

    @property
    def entrance_pupil_from_vertex_mm(self) -> float | None:
        """Distance V1A'' from the front vertex to the entrance pupil (Eq. 5.19), if known."""
        lens = self.camera.main_lens
        if lens.front_vertex_mm is None:
            return None
        with localcontext(CONTEXT):
            return float(exact(lens.front_vertex_mm) - self._entrance_pupil_from_plane)

    @property
    def _entrance_pupil_from_plane(self) -> Decimal:
        """Distance from the object-side principal plane to the entrance pupil."""
        lens = self.camera.main_lens
        with localcontext(CONTEXT):
            f, pupil = exact(lens.focal_length_mm), exact(lens.exit_pupil_mm)
            return f - f * f / pupil
