# SPDX-License-Identifier: Apache-2.0
"""Real ray tracing through a sequence of spherical and plane surfaces.

Lengths in mm. Rays travel towards positive z and the first vertex of the lens is the origin;
heights are x and y. To trace from the sensor into object space, trace through
`LensSystem.reversed`: then z runs from the sensor to the object and the origin is the vertex next
to the sensor.

Every ray has a `RayState` that says how far it got; beyond that its coordinates are nan.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from plenofir.camera.optics.dispersion import FloatArray
from plenofir.camera.optics.prescription import LensSystem
from plenofir.ground.errors import InputError

BoolArray = npt.NDArray[np.bool_]
StateArray = npt.NDArray[np.int8]

_EPS = float(np.finfo(np.float64).eps)


class RayState(IntEnum):
    """What became of a ray."""

    PASSED = 0
    MISSED = 1
    """The ray does not meet a surface's sphere (or not its side towards the ray)."""
    TOTAL_REFLECTION = 2
    VIGNETTED = 3
    """The ray meets a surface outside its clear aperture (only when that is asked for)."""
    NOT_AIMED = 4
    """No chief ray was found for the height."""


@dataclass(frozen=True, eq=False)
class Rays:
    """A bundle of rays.

    `points`: a point on each ray, (x, y, z) in mm, shape (rays, 3). `directions`: unit vectors,
    shape (rays, 3).
    """

    points: FloatArray
    directions: FloatArray

    @property
    def slopes(self) -> FloatArray:
        """dx/dz and dy/dz, shape (rays, 2)."""
        return self.directions[:, :2] / self.directions[:, 2:]

    def at(self, z_mm: npt.ArrayLike) -> FloatArray:
        """Points of the rays in planes perpendicular to the axis.

        `z_mm`: position of the plane in mm, one or one for each ray. Result: (x, y) in mm, shape
        (rays, 2).
        """
        advance = np.asarray(z_mm, dtype=np.float64) - self.points[:, 2]
        return self.points[:, :2] + advance[:, np.newaxis] * self.slopes


@dataclass(frozen=True, eq=False)
class Trace:
    """Rays through a lens.

    Attributes
    ----------
    points
        Where the rays meet the surfaces, (x, y, z) in mm, shape (surfaces, rays, 3); nan from the
        surface on that a ray misses, and after the one that it is totally reflected or vignetted
        at.
    rays
        The rays behind the last surface; nan for those that did not pass.
    states
        `RayState` of each ray, shape (rays,).
    lost_at
        Number of the surface (from 0) that a ray was lost at, -1 where it passed, shape (rays,).
    """

    points: FloatArray
    rays: Rays
    states: StateArray
    lost_at: npt.NDArray[np.intp]

    @property
    def passed(self) -> BoolArray:
        """Mask of the rays that came through, shape (rays,)."""
        return np.asarray(self.states == RayState.PASSED)


def meridional_rays(
    heights_mm: npt.ArrayLike, slopes: npt.ArrayLike, z_mm: npt.ArrayLike = 0.0
) -> Rays:
    """Rays in the y-z plane.

    `heights_mm`: y in mm. `slopes`: dy/dz. `z_mm`: where the heights are, in mm; all of any shape.
    Result: arguments broadcast together, one ray for each element. Raises `InputError` if one of
    them is not finite.
    """
    y, m, z = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(v, dtype=np.float64)) for v in (heights_mm, slopes, z_mm))
    )
    y, m, z = y.ravel(), m.ravel(), z.ravel()
    if not np.all(np.isfinite(y) & np.isfinite(m) & np.isfinite(z)):
        raise InputError("heights, slopes and positions of rays must be finite")
    cosine = 1 / np.hypot(1.0, m)
    zero = np.zeros_like(y)
    return Rays(np.stack([zero, y, z], axis=1), np.stack([zero, m * cosine, cosine], axis=1))


def trace(system: LensSystem, rays: Rays, *, clip: bool = False) -> Trace:
    """Trace rays through all surfaces.

    The intersection is found from the vertex plane with a formula that has no difference of large
    numbers and holds for planes; refraction is Snell's law in vectors, and likewise free of
    differences that cancel.

    `rays`: rays towards positive z in the first medium, origin at the first vertex. `clip`: whether
    rays outside a surface's clear semi aperture are lost.
    """
    points = np.array(rays.points, dtype=np.float64)
    directions = np.array(rays.directions, dtype=np.float64)
    count = len(points)
    states = np.full(count, RayState.PASSED, dtype=np.int8)
    lost_at = np.full(count, -1, dtype=np.intp)
    path = np.full((len(system.curvatures), count, 3), np.nan)
    alive = np.arange(count)

    for number, curvature in enumerate(system.curvatures):
        if number > 0:
            points[:, 2] -= system.gaps[number - 1]
        before, behind = float(system.indices[number]), float(system.indices[number + 1])
        met, hit, normals, cosines = _meet_sphere(points, directions, float(curvature))
        path[number, alive] = np.where(met[:, np.newaxis], hit, np.nan)
        # (n' cos I')^2 from (n sin I)^2, with sin^2 I = (1 - cos I)(1 + cos I).
        squared = behind**2 - before**2 * (1 - cosines) * (1 + cosines)

        fate = np.where(met, RayState.PASSED, RayState.MISSED)
        fate[met & (squared < 0)] = RayState.TOTAL_REFLECTION
        if clip:
            outside = np.hypot(hit[:, 0], hit[:, 1]) > system.semi_apertures[number]
            fate[met & outside] = RayState.VIGNETTED
        keep = fate == RayState.PASSED
        states[alive] = fate
        lost_at[alive[~keep]] = number

        alive, points = alive[keep], hit[keep]
        bent_cosine, cosine = np.sqrt(squared[keep]), before * cosines[keep]
        # n' cos I' - n cos I without their difference, which cancels between similar glasses.
        bend = (behind - before) * (behind + before) / (bent_cosine + cosine)
        directions = (before * directions[keep] + bend[:, np.newaxis] * normals[keep]) / behind

    path[:, :, 2] += system.vertices[:, np.newaxis]
    out_points = np.full((count, 3), np.nan)
    out_directions = np.full((count, 3), np.nan)
    out_points[alive] = path[-1, alive]
    out_directions[alive] = directions
    return Trace(path, Rays(out_points, out_directions), states, lost_at)


def _meet_sphere(
    points: FloatArray, directions: FloatArray, curvature: float
) -> tuple[BoolArray, FloatArray, FloatArray, FloatArray]:
    """Intersect rays with a sphere whose vertex is the origin."""
    # Returns the mask of rays that meet it, the points, the unit normals towards positive z, and
    # the cosines between ray and normal; the values of rays that miss it are meaningless.
    forward = directions[:, 2] > 0
    dz = np.where(forward, directions[:, 2], 1.0)
    # A ray perpendicular to the axis may overflow; it then counts as missing the sphere.
    with np.errstate(over="ignore", invalid="ignore"):
        on_plane = points[:, :2] - directions[:, :2] * (points[:, 2] / dz)[:, np.newaxis]
        f = curvature * np.sum(on_plane**2, axis=1)
        g = dz - curvature * np.sum(directions[:, :2] * on_plane, axis=1)
        discriminant = g**2 - curvature * f
    crosses = forward & (discriminant >= 0) & np.isfinite(discriminant)
    on_plane = np.where(crosses[:, np.newaxis], on_plane, 0.0)
    f, g = np.where(crosses, f, 0.0), np.where(crosses, g, 0.0)
    cosines = np.sqrt(np.where(crosses, discriminant, 0.0))
    denominator = g + cosines
    crosses &= denominator > 0
    advance = f / np.where(crosses, denominator, 1.0)
    z = advance * dz
    hit = np.column_stack([on_plane + advance[:, np.newaxis] * directions[:, :2], z])
    # Only the half of the sphere around the vertex is the surface.
    towards_z = 1 - curvature * z
    normals = np.column_stack([-curvature * hit[:, :2], towards_z])
    return crosses & (towards_z > 0), hit, normals, cosines


@dataclass(frozen=True, eq=False)
class Meetings:
    """Where rays meet, pair by pair.

    Attributes
    ----------
    points
        Half-way between the points where the two rays come closest, in mm, shape (pairs, 3); nan
        where they are parallel or one of the rays was lost.
    gaps_mm
        Distance between these points, 0 for rays in one plane, shape (pairs,).
    parallel
        Pairs that meet at no finite distance, to working precision, shape (pairs,).
    behind
        Pairs that meet behind a starting point, going backwards, shape (pairs,).
    lost
        Pairs of which a ray was lost, shape (pairs,).
    """

    points: FloatArray
    gaps_mm: FloatArray
    parallel: BoolArray
    behind: BoolArray
    lost: BoolArray

    @property
    def real(self) -> BoolArray:
        """Pairs that meet ahead of where they come from, shape (pairs,)."""
        return np.asarray(~(self.parallel | self.behind | self.lost))


def intersect(first: Rays, second: Rays) -> Meetings:
    """Intersect rays pair by pair.

    `first`, `second`: as many rays each; rays with nan count as lost. Result: in the frame of the
    rays.
    """
    p1, d1, p2, d2 = first.points, first.directions, second.points, second.directions
    lost = ~np.all(np.isfinite(np.concatenate([p1, d1, p2, d2], axis=1)), axis=1)
    between = p2 - p1
    # Common perpendicular of both rays; its length is the sine of the angle between them.
    across = np.cross(d1, d2)
    sine_squared = np.sum(across**2, axis=1)
    parallel = ~lost & (sine_squared <= (4 * _EPS) ** 2)
    usable = ~lost & ~parallel
    divisor = np.where(usable, sine_squared, 1.0)
    t1 = np.sum(np.cross(between, d2) * across, axis=1) / divisor
    t2 = np.sum(np.cross(between, d1) * across, axis=1) / divisor
    near1 = p1 + t1[:, np.newaxis] * d1
    near2 = p2 + t2[:, np.newaxis] * d2
    points = np.where(usable[:, np.newaxis], 0.5 * (near1 + near2), np.nan)
    gaps = np.where(usable, np.linalg.norm(near2 - near1, axis=1), np.nan)
    return Meetings(points, gaps, parallel, usable & ((t1 < 0) | (t2 < 0)), lost)


def trace_to_object(
    system: LensSystem,
    heights_mm: npt.ArrayLike,
    slopes: npt.ArrayLike,
    image_distance_mm: float,
    *,
    clip: bool = False,
) -> Trace:
    """Trace meridional rays from the micro lenses through the main lens into object space.

    Result: in the frame of the reversed lens: z = 0 at the vertex next to the sensor, growing
    towards the object, so the micro lenses are at z = -`image_distance_mm`. Surfaces are counted
    from the sensor.

    Parameters
    ----------
    system
        The main lens at a wavelength, as prescribed (object side first).
    heights_mm
        s: heights in the plane of the micro lenses, mm.
    slopes
        m: height gained for each mm towards the object.
    image_distance_mm
        From the micro lenses to the lens's last vertex, mm.
    clip
        Whether rays outside a clear aperture are lost.
    """
    return trace(
        system.reversed(), meridional_rays(heights_mm, slopes, -image_distance_mm), clip=clip
    )


@dataclass(frozen=True, eq=False)
class RefocusedPlanes:
    """Distances at which pairs of rays from the sensor meet in object space.

    `distances_mm`: d_a: from the micro lenses to the meeting point along the axis, mm, shape
    (pairs,); nan where `meetings` names the pair parallel or lost. Where it names the pair behind,
    the rays meet only when they are drawn backwards, and the distance is that of no real plane.
    `meetings`: the meeting points and their states, in the frame of `trace_to_object`.
    """

    distances_mm: FloatArray
    meetings: Meetings


def refocused_planes(
    system: LensSystem,
    first: tuple[npt.ArrayLike, npt.ArrayLike],
    second: tuple[npt.ArrayLike, npt.ArrayLike],
    image_distance_mm: float,
    *,
    clip: bool = False,
) -> RefocusedPlanes:
    """Fire pairs of rays from the micro lenses and measure where they meet (section 5.2.2).

    Parameters
    ----------
    system
        The main lens at a wavelength, as prescribed.
    first, second
        (heights in mm, slopes) of the two rays of each pair, as in `trace_to_object`.
    image_distance_mm
        From the micro lenses to the lens's last vertex, mm.
    clip
        Whether rays outside a clear aperture are lost.
    """
    traced = [
        trace_to_object(system, heights, slopes, image_distance_mm, clip=clip)
        for heights, slopes in (first, second)
    ]
    meetings = intersect(traced[0].rays, traced[1].rays)
    return RefocusedPlanes(meetings.points[:, 2] + image_distance_mm, meetings)
