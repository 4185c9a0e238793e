"""Where refocused planes lie, how deep they are, and where the virtual cameras stand.

The camera with its focus and micro image size M is one `RayModel`; the planes' functions take
arrays of focus settings a. Symbols are those of the thesis: kappa = p_p / f_s is the slope between
neighbouring pixels of a micro image, e = b_U - f_U the extension of the main lens.

Chief rays have the slopes m = -s / d_A' - i kappa (Eqs. 3.21-3.24). The pair that meets on plane
a comes from pixels -c and c of micro lenses a (M-1) apart (section 3.3.1); the borders of the depth
of field come from the pixels' borders and the micro lenses' edges (section 3.3.2). With
n = a (M-1) + k, k = 1 for the near border, 0 for the plane, -1 for the far border, they meet at

    d' = -n p_M / ((M-1-k) kappa - a (M-1) p_M / d_A')

behind the micro lenses, and the thin lens equation takes that to the distance

    d = b_U + H1H2 + f_U (b_U - d') / (e - d')

from the micro lenses. As a function of a this is a quotient of two linear functions,
d = D(a) / V(a), without any intermediate infinity. V, the vergence, vanishes at infinity.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from functools import cached_property
from math import inf
from typing import Literal

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.camera import Camera
from plenofir.camera.rays.distances import Distances, Planes, lens_extension
from plenofir.camera.rays.precise import CONTEXT, Line, Values, exact, split
from plenofir.errors import InputError

DisparityUnit = Literal["pixels", "pixels per view"]


_REAL, _INFINITY, _BEYOND, _INSIDE = range(4)
# Beyond this the products of the coefficients would overflow.
_LARGEST_A = 1e100
# Planes are evaluated in blocks that stay in the processor's cache.
_BLOCK = 8192


@dataclass(frozen=True)
class RayModel:
    """A camera, focused, with micro images of M pixels.

    `RayModel.focused` makes one from a focus distance.

    Attributes
    ----------
    camera
        The camera.
    extension
        e = b_U - f_U in mm, 0 for infinity focus.
    micro_image_size
        M, 2 or more.

    Raises
    ------
    InputError
        If M is not possible.
    """

    camera: Camera
    extension: Decimal
    micro_image_size: int

    def __post_init__(self) -> None:
        """Check M."""
        m = self.micro_image_size
        if isinstance(m, bool) or not isinstance(m, int) or m < 2:
            raise InputError(f"M = {m!r}", where="micro image", expected="an integer, 2 or more")

    @classmethod
    def focused(cls, camera: Camera, focus_mm: float, micro_image_size: int) -> "RayModel":
        """Focus a camera on a plane.

        Parameters
        ----------
        camera
            The camera.
        focus_mm
            d_f from the micro lenses to the plane; inf is allowed.
        micro_image_size
            M, 2 or more.

        Returns
        -------
        RayModel
            The model.

        Raises
        ------
        InputError
            If M or the focus is not possible.
        """
        lens = camera.main_lens
        f, separation = lens.focal_length_mm, lens.principal_plane_separation_mm
        return cls(camera, lens_extension(f, separation, focus_mm), micro_image_size)

    @cached_property
    def _lines(self) -> dict[int, tuple[Line, Line]]:
        """D and V of the near border (1), the plane (0) and the far border (-1)."""
        # With w = a (M-1), multiplied by f_s d_A' so that no quotient is left:
        #
        #     V = e ((M-1-k) p_p d_A' - w p_M f_s) + (w + k) p_M f_s d_A'
        #     D = (b_U + H1H2) V + f_U (V + f_U ((M-1-k) p_p d_A' - w p_M f_s))
        lens, array = self.camera.main_lens, self.camera.micro_lenses
        f, e = exact(lens.focal_length_mm), self.extension
        span = self.micro_image_size - 1
        lines = {}
        with localcontext(CONTEXT):
            pupil = exact(lens.exit_pupil_mm) + e
            pitch = exact(array.pitch_mm) * exact(array.focal_length_mm)
            pixels = exact(self.camera.sensor.pixel_pitch_mm) * pupil
            offset = f + e + exact(lens.principal_plane_separation_mm)
            for k in (1, 0, -1):
                divergence = (span - k) * pixels, -span * pitch
                vergence = (
                    e * divergence[0] + k * pitch * pupil,
                    e * divergence[1] + span * pitch * pupil,
                )
                distance = (
                    offset * vergence[n] + f * (vergence[n] + f * divergence[n]) for n in (0, 1)
                )
                lines[k] = (Line.of(*distance), Line.of(*vergence))
        return lines

    def _distances(self, a: npt.ArrayLike, k: int) -> Distances:
        values = np.asarray(a, dtype=np.float64)
        if not (np.abs(values) <= _LARGEST_A).all():
            raise InputError(
                "not finite, or too large", where="a", expected=f"numbers up to {_LARGEST_A:g}"
            )
        top, bottom = self._lines[k]
        lens = self.camera.main_lens
        # Nothing can be placed nearer than the front vertex or, if that is not known, than the
        # object-side principal plane.
        front = self.image_distance_mm + lens.principal_plane_separation_mm
        front += lens.front_vertex_mm or 0.0
        flat = values.ravel()
        mm = np.empty(flat.shape)
        states = np.full(flat.shape, _REAL, dtype=np.int8)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for start in range(0, flat.size, _BLOCK):
                part = slice(start, start + _BLOCK)
                x = flat[part]
                halves = split(x)
                vergence = bottom.at(x, halves)
                distance = top.at(x, halves) / vergence
                state = states[part]
                hidden = distance <= front
                state[hidden] = _INSIDE
                diverging = hidden & (vergence < 0)
                state[diverging] = _BEYOND
                # Farther than a double can say counts as infinity.
                parallel = (vergence == 0) | np.isinf(distance)
                state[parallel] = _INFINITY
                distance[diverging | parallel] = np.nan
                mm[part] = distance
        return Distances(mm.reshape(values.shape), states.reshape(values.shape))

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
        """Distance d_A' from the micro lenses to the exit pupil; it moves with the lens."""
        return float(CONTEXT.add(exact(self.camera.main_lens.exit_pupil_mm), self.extension))

    @property
    def pixel_slope(self) -> float:
        """Slope kappa between rays of neighbouring pixels of a micro image."""
        return self.camera.sensor.pixel_pitch_mm / self.camera.micro_lenses.focal_length_mm

    def distance(self, a: npt.ArrayLike) -> Distances:
        """Distances of refocused planes from the micro lenses (Eqs. 3.29-3.34).

        Parameters
        ----------
        a
            Focus settings, any shape.

        Returns
        -------
        Distances
            Same shape.
        """
        return self._distances(a, 0)

    def near_border(self, a: npt.ArrayLike) -> Distances:
        """Near borders of the depths of field (Eqs. 3.36-3.43, inner rays), as `distance`."""
        return self._distances(a, 1)

    def far_border(self, a: npt.ArrayLike) -> Distances:
        """Far borders of the depths of field (Eqs. 3.36-3.43, outer rays), as `distance`."""
        return self._distances(a, -1)

    def planes(self, a: npt.ArrayLike) -> Planes:
        """Refocused planes with their depths of field.

        Parameters
        ----------
        a
            Focus settings, any shape.

        Returns
        -------
        Planes
            Same shape.
        """
        values = np.asarray(a, dtype=np.float64)
        return Planes(values, *(self._distances(values, k) for k in (0, 1, -1)))

    def focus_setting(
        self, distance_mm: npt.ArrayLike, border: Literal["centre", "near", "far"] = "centre"
    ) -> Values:
        """Focus setting a of the plane at a distance: the inverse of `distance`.

        Parameters
        ----------
        distance_mm
            Distances from the micro lenses, any shape; inf is allowed.
        border
            Which of a plane's distances is meant: its own, or a border of its depth of field.

        Returns
        -------
        Values
            a, same shape.
        """
        top, bottom = self._lines[{"centre": 0, "near": 1, "far": -1}[border]]
        distance = np.asarray(distance_mm, dtype=np.float64)
        if np.isnan(distance).any() or (distance == -inf).any():
            raise InputError("not a distance", where="distance", expected="numbers of mm, or inf")
        # D(a) = d V(a) is as linear in d as in a.
        numerator = Line(-top.constant, -top.constant_low, bottom.constant, bottom.constant_low)
        denominator = Line(top.factor, top.factor_low, -bottom.factor, -bottom.factor_low)
        far = np.isposinf(distance)
        finite = np.where(far, 0.0, distance)
        halves = split(finite)
        slope = np.where(far, -bottom.factor, denominator.at(finite, halves))
        if (slope == 0).any():
            raise InputError("no plane lies there", where="distance", expected="another distance")
        return np.asarray(np.where(far, bottom.constant, numerator.at(finite, halves)) / slope)

    def micro_lens_position(self, j: npt.ArrayLike) -> Values:
        """Positions s_j of micro lenses, counted from the optical axis (Eq. 3.19).

        Parameters
        ----------
        j
            Index relative to the central micro lens (j - o of the text), any shape.

        Returns
        -------
        Values
            mm, same shape.
        """
        return np.asarray(j, dtype=np.float64) * self.camera.micro_lenses.pitch_mm

    def micro_image_centre(
        self,
        position_mm: npt.ArrayLike,
        origin: Literal["exit pupil", "principal plane", "ideal"] = "exit pupil",
    ) -> Values:
        """Micro image centres (Eqs. 3.21, 3.22, 5.17, 5.18).

        Parameters
        ----------
        position_mm
            Positions s_j of micro lenses, any shape.
        origin
            Where their chief rays come from: the exit pupil (5.18), the principal plane (5.17) or
            infinitely far (the ideal model).

        Returns
        -------
        Values
            u_c,j in mm, same shape.
        """
        s = np.asarray(position_mm, dtype=np.float64)
        if origin == "ideal":
            return s
        lengths = {"exit pupil": self.exit_pupil_mm, "principal plane": self.image_distance_mm}
        return s + s * (self.camera.micro_lenses.focal_length_mm / lengths[origin])

    def chief_ray_slope(self, i: npt.ArrayLike, position_mm: npt.ArrayLike) -> Values:
        """Slopes of chief rays between micro lenses and main lens (Eq. 3.24).

        Parameters
        ----------
        i
            Pixel of the micro image, counted from its centre; fractions are allowed.
        position_mm
            Positions s_j of micro lenses, broadcast with `i`.

        Returns
        -------
        Values
            m_c+i,j.
        """
        s = np.asarray(position_mm, dtype=np.float64)
        return -s / self.exit_pupil_mm - np.asarray(i, dtype=np.float64) * self.pixel_slope

    def object_ray(self, i: npt.ArrayLike, position_mm: npt.ArrayLike) -> tuple[Values, Values]:
        """Chief rays in object space (Eqs. 3.25-3.28).

        Parameters
        ----------
        i, position_mm
            As in `chief_ray_slope`.

        Returns
        -------
        tuple of Values
            Slope q and height U at the object-side principal plane: height(z) = q z + U.
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
            return f * (pupil - f) / pupil

    def virtual_camera(self, i: npt.ArrayLike) -> Values:
        """Heights of virtual cameras on the entrance pupil (Eq. 3.54).

        Parameters
        ----------
        i
            Views, counted from the central one.

        Returns
        -------
        Values
            A_i'' in mm, same shape.
        """
        lens = self.camera.main_lens
        step = self.pixel_slope * lens.focal_length_mm * (self.exit_pupil_mm / lens.exit_pupil_mm)
        return -np.asarray(i, dtype=np.float64) * step

    def baseline(self, gap: npt.ArrayLike) -> Values:
        """Baseline between virtual cameras (Eq. 3.55 as a difference).

        Parameters
        ----------
        gap
            G, views between the two cameras.

        Returns
        -------
        Values
            B_G in mm, same shape.
        """
        return -self.virtual_camera(gap)

    def tilt(self, gap: npt.ArrayLike, view: npt.ArrayLike = 0) -> Values:
        """Tilt between the axes of virtual cameras view and view + gap (Eqs. 3.58, 3.59).

        Parameters
        ----------
        gap
            G, views between the two cameras.
        view
            i, the first camera.

        Returns
        -------
        Values
            Phi_i - Phi_i+G in degrees: 0 at infinity focus, negative where the axes converge.
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
        lens = self.camera.main_lens
        ratio = lens.exit_pupil_mm / self.exit_pupil_mm
        return self.camera.micro_lenses.pitch_mm * ratio / lens.focal_length_mm

    def depth(
        self,
        disparity: npt.ArrayLike,
        gap: int,
        *,
        view: int = 0,
        unit: DisparityUnit = "pixels",
    ) -> Distances:
        """Distance of an object from its disparity (Eqs. 2.5, 3.60, 3.61).

        Parameters
        ----------
        disparity
            Disparity between views view and view + gap, any shape.
        gap
            G, not 0.
        view
            i, the first view.
        unit
            "pixels": of the two sub-aperture images (micro lenses). "pixels per view": divided
            by the gap, as Table 5.9 of the text counts.

        Returns
        -------
        Distances
            Z from the entrance pupil (add `entrance_pupil_mm` to count from the micro lenses).
        """
        pixels = self._in_pixels(disparity, gap, unit)
        turn = pixels * self._pixel_at_unit_distance + self._convergence(gap, view)
        states = np.full(turn.shape, _REAL, dtype=np.int8)
        base = self.baseline(gap)
        states[turn * np.sign(base) < 0] = _BEYOND
        with np.errstate(divide="ignore", over="ignore"):
            depth = base / turn
        # Farther than a double can say counts as infinity.
        states[~np.isfinite(depth)] = _INFINITY
        return Distances(np.where(states == _REAL, depth, np.nan), states)

    def disparity(
        self,
        depth_mm: npt.ArrayLike,
        gap: int,
        *,
        view: int = 0,
        unit: DisparityUnit = "pixels",
    ) -> Values:
        """Disparity of an object from its distance: the inverse of `depth`.

        Parameters
        ----------
        depth_mm
            Z from the entrance pupil, any shape; inf is allowed.
        gap, view, unit
            As in `depth`.

        Returns
        -------
        Values
            Disparity, same shape.
        """
        self._in_pixels(0.0, gap, unit)
        z = np.asarray(depth_mm, dtype=np.float64)
        turn = self.baseline(gap) / z - self._convergence(gap, view)
        pixels = turn / self._pixel_at_unit_distance
        return np.asarray(pixels / gap if unit == "pixels per view" else pixels)

    @staticmethod
    def _in_pixels(disparity: npt.ArrayLike, gap: int, unit: DisparityUnit) -> Values:
        if gap == 0:
            raise InputError("gap = 0", where="gap", expected="two different views")
        if unit not in ("pixels", "pixels per view"):
            raise InputError(f"{unit!r}", where="unit", expected="'pixels' or 'pixels per view'")
        pixels = np.asarray(disparity, dtype=np.float64)
        return pixels * gap if unit == "pixels per view" else pixels
