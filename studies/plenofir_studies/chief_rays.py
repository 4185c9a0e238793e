# SPDX-License-Identifier: Apache-2.0
"""Chief rays through the aperture stop, and the centres of micro images that they predict."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.camera.optics.dispersion import FloatArray
from plenofir.camera.optics.prescription import LensSystem
from plenofir.ground.errors import InputError
from plenofir_studies.tracing import BoolArray, Rays, RayState, StateArray, meridional_rays, trace

_AIM_STEPS = 80
_AIM_TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class ChiefRays:
    """Meridional rays through the centre of the aperture stop.

    Attributes
    ----------
    image_slopes
        dy/dz where the rays meet the image plane, z towards the sensor, shape (rays,).
    object_rays
        The same rays in object space, travelling towards the object: z = 0 at the first vertex V_1U
        and growing towards the object.
    states
        `RayState` of each ray, shape (rays,); slopes and rays are nan where it is not PASSED.
    """

    image_slopes: FloatArray
    object_rays: Rays
    states: StateArray

    @property
    def passed(self) -> BoolArray:
        """Mask of the rays that were found, shape (rays,)."""
        return np.asarray(self.states == RayState.PASSED)


def chief_rays(
    system: LensSystem, heights_mm: npt.ArrayLike, image_distance_mm: float
) -> ChiefRays:
    """Find the rays through the stop's centre that arrive at given heights.

    Starting at the centre of the stop with the paraxial slope, the slope is corrected by Newton's
    method until the real ray arrives at the height, to 1e-12 of it; steps towards rays that are
    lost are halved.

    `heights_mm`: heights in the image plane (micro lens positions s), mm. `image_distance_mm`: from
    the last vertex to the image plane, mm. Raises `InputError` if the prescription has no stop or a
    height is not finite.
    """
    stop = system.stop_surface
    target = np.atleast_1d(np.asarray(heights_mm, dtype=np.float64)).ravel()
    if not np.all(np.isfinite(target)):
        raise InputError("ray heights must be finite numbers of mm")
    behind = system.section(stop, len(system.curvatures) - 1)

    def arrive(stop_slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Heights and slopes in the image plane; nan where a ray is lost."""
        rays = trace(behind, meridional_rays(np.zeros_like(stop_slopes), stop_slopes)).rays
        z = behind.length_mm + image_distance_mm
        return rays.at(z)[:, 1], rays.slopes[:, 1]

    # How much height a paraxial ray gains for each unit of slope, by a nearly axial real ray.
    unit = float(arrive(np.array([1e-6]))[0][0]) / 1e-6
    good = np.zeros_like(target)
    trial = target / unit if unit != 0 else good
    found = target == 0
    for _ in range(_AIM_STEPS):
        if np.all(found):
            break
        heights, _ = arrive(trial)
        error = heights - target
        found |= np.abs(error) <= _AIM_TOLERANCE * np.abs(target)
        nudge = np.maximum(np.abs(trial), 1e-9) * 1e-5
        gradient = (arrive(trial + nudge)[0] - arrive(trial - nudge)[0]) / (2 * nudge)
        usable = np.isfinite(error) & np.isfinite(gradient) & (gradient != 0)
        good = np.where(usable, trial, good)
        step = np.where(usable, error / np.where(usable, gradient, 1.0), 0.0)
        corrected = np.where(usable, trial - step, 0.5 * (good + trial))
        trial = np.where(found | ~np.isfinite(corrected), trial, corrected)

    _, image_slopes = arrive(trial)
    return _finish_chief_rays(system, stop, trial, found, image_slopes)


def _finish_chief_rays(
    system: LensSystem,
    stop: int,
    stop_slopes: FloatArray,
    found: BoolArray,
    image_slopes: FloatArray,
) -> ChiefRays:
    states = np.where(found, RayState.PASSED, RayState.NOT_AIMED).astype(np.int8)
    if stop == 0:
        to_object = meridional_rays(np.zeros_like(stop_slopes), -stop_slopes)
    else:
        front = system.section(0, stop - 1).reversed()
        started = meridional_rays(
            np.zeros_like(stop_slopes), -stop_slopes, -float(system.gaps[stop - 1])
        )
        traced = trace(front, started)
        states = np.where(found, traced.states, states).astype(np.int8)
        to_object = traced.rays
        to_object = Rays(to_object.points - [0.0, 0.0, front.length_mm], to_object.directions)
    lost = states != RayState.PASSED
    return ChiefRays(
        image_slopes=np.where(lost, np.nan, image_slopes),
        object_rays=Rays(
            np.where(lost[:, np.newaxis], np.nan, to_object.points),
            np.where(lost[:, np.newaxis], np.nan, to_object.directions),
        ),
        states=states,
    )


@dataclass(frozen=True, eq=False)
class MicroImageCentres:
    """Where real chief rays put the centres of micro images.

    `positions_mm`: u_c: heights on the sensor in mm, shape (micro lenses,); nan where there is no
    chief ray. `states`: `RayState` of each chief ray, shape (micro lenses,).
    """

    positions_mm: FloatArray
    states: StateArray


def micro_image_centres(
    system: LensSystem,
    micro_lens_positions_mm: npt.ArrayLike,
    image_distance_mm: float,
    micro_focal_length_mm: float,
) -> MicroImageCentres:
    """Micro image centres from real chief rays (the simulation of thesis Tables 5.3 and 5.4).

    A chief ray goes straight on through the middle of the micro lens and f_s further to the sensor.

    Raises `InputError` if the prescription has no stop.

    Parameters
    ----------
    system
        The main lens at a wavelength.
    micro_lens_positions_mm
        s: heights of the micro lens centres, mm.
    image_distance_mm
        From the main lens's last vertex to the micro lenses, mm.
    micro_focal_length_mm
        f_s in mm.
    """
    positions = np.atleast_1d(np.asarray(micro_lens_positions_mm, dtype=np.float64)).ravel()
    rays = chief_rays(system, positions, image_distance_mm)
    return MicroImageCentres(positions + micro_focal_length_mm * rays.image_slopes, rays.states)
