# SPDX-License-Identifier: Apache-2.0
"""A plenoptic camera with real lenses: pictures by ray tracing, without formulas of the ray model.

Each pixel sends rays from points in it through points of its plano-convex micro lens and through
all surfaces of the main lens with its stop to the objects, and averages what they hit. With
`paraxial` the same surfaces refract in proportion to height and slope; the difference between the
pictures is the effect of aberrations.

Lengths in mm, z from the micro lenses' vertices towards the objects. There is no diffraction.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.optics.prescription import load_prescription
from plenofir.refocus.operator import Image
from plenofir_studies.thesis_tables import load_table

Floats = npt.NDArray[np.float64]

PITCH_MM = 0.125
PIXEL_MM = 0.009
WAVELENGTH_NM = 550.0
_FULL = 65535
_LEVEL = 0.9
_BLOCK_RAYS = 1 << 17
# Heights at which rays are paraxial.
_NEAR_MM = 1e-5
# Steps of a low-discrepancy sequence in four dimensions (roots of x^5 = x + 1).
_STEPS = 1.1673039782614187 ** -np.arange(1.0, 5.0)


@dataclass(frozen=True)
class Surfaces:
    """Spherical and plane surfaces on the axis, in the order in which rays meet them."""

    z: Floats  # of the vertices
    curvatures: Floats  # positive: the centre lies farther on
    indices: Floats  # before the first, between, behind the last
    radii: Floats  # clear radii

    def part(self, first: int, last: int) -> "Surfaces":
        """Surfaces `first` to `last` - 1."""
        chosen = slice(first, last)
        indices = self.indices[first : last + 1]
        return Surfaces(self.z[chosen], self.curvatures[chosen], indices, self.radii[chosen])

    def turned(self) -> "Surfaces":
        """The lens from the other side, z negated."""
        return Surfaces(-self.z[::-1], -self.curvatures[::-1], self.indices[::-1], self.radii[::-1])


@dataclass
class Rays:
    """Points and directions of rays, shape (3, rays), and which of them passed."""

    places: Floats
    directions: Floats  # unit vectors; paraxial: (slope x, slope y, 1)
    passed: npt.NDArray[np.bool_]

    def at(self, z: float) -> Floats:
        """(x, y) in a plane perpendicular to the axis, shape (2, rays)."""
        return np.asarray(self.places[:2] + (z - self.places[2]) * self.slopes)

    @property
    def slopes(self) -> Floats:
        """Change of (x, y) with z, shape (2, rays)."""
        return np.asarray(self.directions[:2] / self.directions[2])


def rays_from(places: Floats, slopes: Floats, *, paraxial: bool) -> Rays:
    """Rays from places, shape (3, rays), with slopes, shape (2, rays)."""
    directions = np.concatenate([slopes, np.ones_like(slopes[:1])])
    if not paraxial:
        directions /= np.sqrt((directions**2).sum(axis=0))
    return Rays(places.copy(), directions, np.ones(places.shape[1], dtype=bool))


def bend(rays: Rays, surfaces: Surfaces, *, paraxial: bool) -> None:
    step = _bend_paraxially if paraxial else _bend
    with np.errstate(invalid="ignore", over="ignore"):
        for k, (z, curvature, radius) in enumerate(
            zip(surfaces.z, surfaces.curvatures, surfaces.radii, strict=True)
        ):
            step(rays, z, curvature, *surfaces.indices[k : k + 2])
            x, y = rays.places[:2]
            # Rays that miss a surface are nan, for which comparisons are false.
            rays.passed &= x * x + y * y <= radius * radius


def _bend(rays: Rays, z: float, curvature: float, before: float, behind: float) -> None:
    """Meet a sphere, and refract by Snell's law."""
    p, d = rays.places, rays.directions
    if curvature == 0:
        p += ((z - p[2]) / d[2]) * d
        normal = np.array([[0.0], [0.0], [1.0]])
        cosine = d[2]
    else:
        centre = np.array([[0.0], [0.0], [z + 1 / curvature]])
        from_centre = p - centre
        along = (from_centre * d).sum(axis=0)
        beyond = (from_centre**2).sum(axis=0) - 1 / curvature**2
        p += (-along - np.sign(curvature) * np.sqrt(along**2 - beyond)) * d
        normal = (centre - p) * curvature
        cosine = (normal * d).sum(axis=0)
    if before == behind:
        return
    ratio = before / behind
    bent = np.sqrt(1 - ratio**2 * (1 - cosine**2))
    rays.directions = ratio * d + (bent - ratio * cosine) * normal


def _bend_paraxially(rays: Rays, z: float, curvature: float, before: float, behind: float) -> None:
    """Meet the vertex plane, and refract in proportion to height and slope."""
    p, d = rays.places, rays.directions
    p[:2] += (z - p[2]) * d[:2]
    p[2] = z
    d[:2] = (before * d[:2] - (behind - before) * curvature * p[:2]) / behind


@dataclass(frozen=True)
class LensCamera:
    """The camera."""

    lens: Surfaces  # from the micro lenses on
    stop: int  # which of its surfaces is the stop
    micro: Surfaces  # of the micro lens on the axis, from the sensor on
    micro_focal_length: float
    paraxial: bool = False

    @property
    def sensor_z(self) -> float:
        """Place of the sensor: the focal plane of the micro lenses."""
        radius = -1 / float(self.micro.curvatures[1])
        index = float(self.micro.indices[1])
        # From the plane side: f - t / n, with f from the curved one.
        return float(self.micro.z[0]) - (radius / (index - 1) + float(self.micro.z[0]) / index)

    @cached_property
    def pupil_z(self) -> float:
        """Position of the exit pupil: apparent origin of rays from the middle of the stop."""
        inner = self.lens.part(0, self.stop).turned()
        start = np.array([[0.0], [0.0], [-float(self.lens.z[self.stop])]])
        rays = rays_from(start, np.array([[0.0], [1e-4]]), paraxial=True)
        bend(rays, inner, paraxial=True)
        return -float(rays.places[2, 0] - rays.places[1, 0] / rays.slopes[1, 0])

    def to_objects(self, places: Floats, slopes: Floats) -> Rays:
        """Rays from the micro lenses' side through the main lens."""
        rays = rays_from(places, slopes, paraxial=self.paraxial)
        bend(rays, self.lens, paraxial=self.paraxial)
        return rays

    def stopped(self, fill: float) -> "LensCamera":
        """The camera with the stop closed until micro images are `fill` of their pitch wide."""
        slope = fill * PITCH_MM / 2 / self.micro_focal_length
        rays = rays_from(np.zeros((3, 1)), np.array([[0.0], [slope]]), paraxial=self.paraxial)
        bend(rays, self.lens.part(0, self.stop + 1), paraxial=self.paraxial)
        radii = self.lens.radii.copy()
        radii[self.stop] = rays.places[1, 0]
        return replace(self, lens=replace(self.lens, radii=radii))

    def object_spacing(self, distance: float) -> float:
        """Pitch on the object, near the axis, of the points that neighbouring micro lenses see."""
        places = np.array([[0.0], [_NEAR_MM], [0.0]])
        rays = self.to_objects(places, np.array([[0.0], [-_NEAR_MM / self.pupil_z]]))
        return abs(float(rays.at(distance)[1, 0])) * PITCH_MM / _NEAR_MM


def lens_camera(
    lens: str, mla: str, *, focus_mm: float = np.inf, paraxial: bool = False
) -> LensCamera:
    """A shipped prescription with micro lenses of Table 5.1, focused to a distance."""
    system = load_prescription(lens).at(WAVELENGTH_NM)
    (row,) = (r for r in load_table("5.1").part().rows if r.labels["mla"] == mla)
    index, thickness = row["n"], row["t_s_mm"]
    micro = Surfaces(
        np.array([-thickness, 0.0]),
        np.array([0.0, -1 / row["r1_mm"]]),
        np.array([1.0, index, 1.0]),
        np.array([np.inf, np.inf]),
    )
    surfaces = Surfaces(
        system.vertices, system.curvatures, system.indices, system.semi_apertures
    ).turned()
    assert system.stop is not None

    def placed(distance: float) -> Surfaces:
        return replace(surfaces, z=surfaces.z - surfaces.z[0] + distance)

    def image_distance(object_mm: float) -> float:
        """Image distance, from the last surface, of an axial point at a distance from the first."""
        rays = rays_from(
            np.array([[0.0], [_NEAR_MM], [-float(surfaces.z[-1])]]),
            np.array([[0.0], [_NEAR_MM / object_mm]]),
            paraxial=True,
        )
        bend(rays, surfaces.turned(), paraxial=True)
        return float(-rays.places[1, 0] / rays.slopes[1, 0])

    behind = image_distance(np.inf)
    if np.isfinite(focus_mm):
        # The distance is measured from the micro lenses, from which the lens moves away.
        for _ in range(100):
            behind = image_distance(focus_mm - behind - system.length_mm)
    stop = len(surfaces.z) - 1 - system.stop
    return LensCamera(placed(behind), stop, micro, row["f_s_mm"], paraxial)


@dataclass(frozen=True)
class Light:
    """Rays of each pixel in front of the camera, for any objects."""

    shape: tuple[int, int]  # rows and columns of pixels
    # (x, y) extended to z = 0, and slopes, shape (2, pixels, rays); shares of light (pixels, rays).
    places: npt.NDArray[np.float32]
    slopes: npt.NDArray[np.float32]
    shares: npt.NDArray[np.float32]

    @property
    def white(self) -> Image:
        """The camera's picture of an even, bright surface."""
        return _exposed(self.shares.sum(axis=1).reshape(self.shape), self._brightest)

    @property
    def _brightest(self) -> float:
        return float(self.shares.sum(axis=1).max())

    def picture(self, texture: "Texture", distance: float) -> Image:
        """The camera's picture of a flat texture perpendicular to the axis."""
        light = texture.at(self.places + distance * self.slopes)
        return _exposed((light * self.shares).sum(axis=1).reshape(self.shape), self._brightest)


def _exposed(values: Floats, brightest: float) -> Image:
    return np.rint(values / brightest * (_LEVEL * _FULL)).astype(np.uint16)


def capture(camera: LensCamera, lenses: tuple[int, int], *, rays: int = 16, seed: int = 0) -> Light:
    """Trace the rays of all pixels behind a number of rows and columns of micro lenses.

    `rays`: number for each pixel, from different points of the pixel and its micro lens.
    """
    stretch = 1 + camera.micro_focal_length / camera.pupil_z
    rows, columns = (round(n * PITCH_MM * stretch / PIXEL_MM) for n in lenses)
    pixels = np.moveaxis(np.indices((rows, columns)), 0, -1).reshape(-1, 2)[:, ::-1]
    middle = (np.array([columns, rows]) - 1) / 2
    places = np.empty((2, len(pixels), rays), dtype=np.float32)
    slopes, shares = np.empty_like(places), np.empty(places.shape[1:], dtype=np.float32)
    random = np.random.default_rng(seed)
    block = max(1, _BLOCK_RAYS // rays)
    for start in range(0, len(pixels), block):
        part = slice(start, start + block)
        centres = ((pixels[part] - middle) * PIXEL_MM).T
        count = centres.shape[1]
        # Evenly spread over pixel and lens, from a random start.
        spread = random.random((4, count, 1)) + _STEPS[:, None, None] * np.arange(rays)
        spread = (spread % 1 - 0.5).reshape(4, -1)
        hits = _through(camera, np.repeat(centres, rays, axis=1), lenses, spread)
        places[:, part], slopes[:, part], shares[part] = (
            values.reshape(*values.shape[:-1], count, rays) for values in hits
        )
    return Light((rows, columns), places, slopes, shares)


def _through(
    camera: LensCamera, centres: Floats, lenses: tuple[int, int], spread: Floats
) -> tuple[Floats, Floats, Floats]:
    """Rays from pixels through their micro lenses and the main lens."""
    # The lens whose middle is nearest to the line from the pixel to the pupil.
    shrink = camera.pupil_z / (camera.pupil_z + camera.micro_focal_length)
    odd = np.array([[lenses[1] - 1], [lenses[0] - 1]]) / 2
    lens = (np.rint(centres * shrink / PITCH_MM + odd) - odd) * PITCH_MM
    start = centres + PIXEL_MM * spread[:2] - lens
    # Towards points in the lens's inner principal plane, one focal length from the sensor.
    slopes = (PITCH_MM * spread[2:] - start) / camera.micro_focal_length
    depth = np.full((1, start.shape[1]), camera.sensor_z)
    rays = rays_from(np.concatenate([start, depth]), slopes, paraxial=camera.paraxial)
    shares = (1 + (slopes**2).sum(axis=0)) ** -2
    bend(rays, camera.micro, paraxial=camera.paraxial)
    # Rays beyond its edge would meet the neighbour.
    rays.passed &= (np.abs(rays.places[:2]) <= PITCH_MM / 2).all(axis=0)
    rays.places[:2] += lens
    bend(rays, camera.lens, paraxial=camera.paraxial)
    shares = np.where(rays.passed, shares, 0.0)
    return np.nan_to_num(rays.at(0.0)), np.nan_to_num(rays.slopes), shares


@dataclass(frozen=True)
class Texture:
    """A flat picture, its middle on the axis."""

    pixels: Floats  # brightness, 0 to 1
    step: float  # of a pixel, in mm

    def at(self, places: npt.NDArray[np.floating]) -> Floats:
        """Brightness at (x, y) in mm, shape (2, ...); mirrored beyond the edge."""
        middle = (np.array(self.pixels.shape) - 1) / 2
        shape = (2, *[1] * (places.ndim - 1))
        points = places[::-1] / self.step + middle.reshape(shape)
        samples = ndimage.map_coordinates(self.pixels, points, order=1, mode="mirror")
        return np.asarray(samples)
