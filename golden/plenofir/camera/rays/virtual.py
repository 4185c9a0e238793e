# SPDX-License-Identifier: Apache-2.0
"""The virtual cameras behind the views of a light field, and triangulation with them."""

from dataclasses import dataclass
from math import floor
from typing import Literal

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.distances import BEYOND, INFINITY, REAL, Distances
from plenofir.camera.rays.focused import FocusedCamera
from plenofir.camera.rays.precise import Values
from plenofir.ground.errors import InputError

DisparityUnit = Literal["pixels", "pixels per view"]

_MOST_VIEWS = 1e9


@dataclass(frozen=True)
class VirtualCameras(FocusedCamera):
    """Views as cameras on the entrance pupil (section 3.5): a part of `RayModel`."""

    def virtual_camera(self, i: npt.ArrayLike) -> Values:
        """Heights of virtual cameras on the entrance pupil (Eq. 3.54).

        `i`: views, counted from the central one. Result: A_i'' in mm, same shape.
        """
        lens = self.camera.main_lens
        step = self.pixel_slope * lens.focal_length_mm * self.pupil_ratio
        return -np.asarray(i, dtype=np.float64) * step

    def baseline(self, gap: npt.ArrayLike) -> Values:
        """Baseline between virtual cameras (Eq. 3.55 as a difference).

        `gap`: G, views between the two cameras. Result: B_G in mm, same shape.
        """
        return -self.virtual_camera(gap)

    def exit_pupil_baseline(self, gap: npt.ArrayLike) -> Values:
        """Baseline B_A' between views at the exit pupil (Eq. 3.51 as a difference).

        `gap`: G, views between the two cameras. Result: B_A' in mm, same shape; infinite where the
        exit pupil is.
        """
        views, step = np.asarray(gap, dtype=np.float64), self.pixel_slope * self.exit_pupil_mm
        with np.errstate(invalid="ignore"):
            # Holds for a pupil at infinity too.
            return np.where(views == 0, 0.0, views * step)

    @property
    def outermost_view(self) -> int | None:
        """Largest view, counted from the central one, whose camera lies in the entrance pupil.

        The pupil bounds the baseline: views farther out see its rim, and are vignetted. None where
        the pupil's diameter is not known.
        """
        diameter = self.camera.main_lens.entrance_pupil_diameter_mm
        if diameter is None:
            return None
        with np.errstate(divide="ignore", over="ignore"):
            views = np.float64(diameter / 2) / self.baseline(1)
        # A small tolerance, so that rounding does not decide about a view right on the rim.
        return floor(min(float(views) * (1 + 1e-12), _MOST_VIEWS))

    def vignetting_note(self, *views: int) -> str:
        """Say if views lie beyond the entrance pupil.

        `*views`: views, counted from the central one. Result: a line, empty where all lie in it or
        its diameter is not known.
        """
        bound = self.outermost_view
        if bound is None or max(map(abs, views)) <= bound:
            return ""
        return (
            f"views more than {bound} from the central one lie outside the entrance pupil "
            f"(diameter {self.camera.main_lens.entrance_pupil_diameter_mm:.4g} mm): vignetted"
        )

    def tilt(self, gap: npt.ArrayLike, view: npt.ArrayLike = 0) -> Values:
        """Tilt between the axes of virtual cameras view and view + gap (Eqs. 3.58, 3.59).

        `gap`: G, views between the two cameras. `view`: i, the first camera. Result: Phi_i -
        Phi_i+G in degrees: 0 at infinity focus, negative where the axes converge.
        """
        return -np.rad2deg(np.arctan(self._convergence(gap, view)))

    def _convergence(self, gap: npt.ArrayLike, view: npt.ArrayLike) -> Values:
        """Tangent of the angle at which two virtual cameras' axes converge."""
        step = self.pixel_slope * (self.extension_mm / self.camera.main_lens.focal_length_mm)
        first = np.asarray(view, dtype=np.float64) * step
        turn = np.asarray(gap, dtype=np.float64) * step
        # tan(arctan(x + t) - arctan(x)) without the difference of the two angles.
        return turn / (1 + first * (first + turn))

    @property
    def _pixel_at_unit_distance(self) -> float:
        """Virtual pixel pitch p_N divided by the virtual image distance b_N (Eq. 3.57)."""
        pitch = self.camera.micro_lenses.pitch_mm
        return pitch / self.pupil_ratio / self.camera.main_lens.focal_length_mm

    def depth(
        self,
        disparity: npt.ArrayLike,
        gap: int,
        *,
        view: int = 0,
        unit: DisparityUnit = "pixels",
    ) -> Distances:
        """Distance of an object from its disparity (Eqs. 2.5, 3.60, 3.61).

        `disparity`: disparity between views view and view + gap, any shape. `gap`: G, not 0.
        `view`: i, the first view. `unit`: "pixels": of the two sub-aperture images (micro lenses).
        "pixels per view": divided by the gap, as Table 5.9 of the thesis counts. Result: Z from the
        entrance pupil (add `entrance_pupil_mm` to count from the micro lenses). Raises `InputError`
        if the gap is 0.
        """
        with np.errstate(divide="ignore", over="ignore"):
            pixels = np.asarray(disparity, dtype=np.float64) * _pixels_in(unit, gap)
            turn = pixels * self._pixel_at_unit_distance + self._convergence(gap, view)
            depth = self.baseline(gap) / turn
        states = np.full(turn.shape, REAL, dtype=np.int8)
        states[np.signbit(depth)] = BEYOND
        # Distances that overflow a double count as infinity.
        states[~np.isfinite(depth)] = INFINITY
        return Distances(np.where(states == REAL, depth, np.nan), states)

    def disparity(
        self,
        depth_mm: npt.ArrayLike,
        gap: int,
        *,
        view: int = 0,
        unit: DisparityUnit = "pixels",
    ) -> Values:
        """Disparity of an object from its distance: the inverse of `depth`.

        `depth_mm`: Z from the entrance pupil, any shape; inf is allowed. `gap`, `view`, `unit`: as
        in `depth`. Result: disparity, same shape.
        """
        z = np.asarray(depth_mm, dtype=np.float64)
        pixels = _pixels_in(unit, gap)
        turn = self.baseline(gap) / z - self._convergence(gap, view)
        return np.asarray(turn / self._pixel_at_unit_distance / pixels)


def _pixels_in(unit: DisparityUnit, gap: int) -> int:
    """Pixels of a disparity of 1; raises `InputError` if there is no such unit or gap."""
    if not gap:
        raise InputError("the two views are the same; their gap must not be 0")
    sizes = {"pixels": 1, "pixels per view": gap}
    if unit not in sizes:
        raise InputError(f"there is no unit {unit!r}; use 'pixels' or 'pixels per view'")
    return sizes[unit]
