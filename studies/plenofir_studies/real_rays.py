# SPDX-License-Identifier: Apache-2.0
"""The ray model beside real rays: a main lens from its prescription, traced surface by surface."""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cache

import numpy as np

from plenofir.camera.optics.paraxial import cardinal_points, entrance_pupil, exit_pupil
from plenofir.camera.optics.prescription import LensSystem, load_prescription
from plenofir.camera.rays.camera import Camera, MainLens, MicroLensArray, Sensor
from plenofir.camera.rays.model import RayModel
from plenofir.camera.rays.precise import Values
from plenofir_studies.chief_rays import micro_image_centres
from plenofir_studies.tracing import Rays, intersect, refocused_planes, trace_to_object

WAVELENGTH_NM = 550.0
MICRO_LENSES = MicroLensArray(focal_length_mm=2.75, pitch_mm=0.125)
"""Micro lenses (II) of the thesis."""
SENSOR = Sensor(pixel_pitch_mm=0.009)


@dataclass(frozen=True)
class RealCamera:
    """A camera whose main lens is known by its prescription."""

    system: LensSystem  # the lens's surfaces
    back_focal_distance_mm: float  # from the last vertex to the focal plane
    camera: Camera  # the same camera in paraxial data


@cache
def real_camera(lens: str, micro_lenses: MicroLensArray = MICRO_LENSES) -> RealCamera:
    """Make a camera with micro lenses of the thesis from a shipped prescription."""
    system = load_prescription(lens).at(WAVELENGTH_NM)
    points, pupil = cardinal_points(system), exit_pupil(system)
    main_lens = MainLens(
        focal_length_mm=points.focal_length_mm,
        principal_plane_separation_mm=points.principal_plane_separation_mm,
        exit_pupil_mm=points.back_focal_distance_mm - pupil.position_mm,
        front_vertex_mm=points.front_principal_plane_mm,
        aperture_stop_mm=points.back_focal_distance_mm
        + system.length_mm
        - float(system.vertices[system.stop_surface]),
        entrance_pupil_diameter_mm=2 * entrance_pupil(system).semi_diameter_mm,
    )
    camera = Camera(
        name=lens, title="", main_lens=main_lens, micro_lenses=micro_lenses, sensor=SENSOR
    )
    return RealCamera(system, points.back_focal_distance_mm, camera)


@dataclass(frozen=True)
class Comparison:
    """Predicted and real distances of planes."""

    model: RayModel
    a: Values  # focus settings
    border: int  # 1 near border, 0 plane, -1 far border
    # distances from the micro lenses in mm; nan where there is none
    predicted: Values
    real: Values

    @property
    def deviation_percent(self) -> Values:
        """(predicted - real) / predicted in percent, as the thesis counts."""
        return np.asarray(100 * (self.predicted - self.real) / self.predicted)


def compare_distances(
    lens: str,
    a: Values,
    micro_image_size: int,
    *,
    extension_mm: float = 0.0,
    border: int = 0,
    micro_lenses: MicroLensArray = MICRO_LENSES,
) -> Comparison:
    """Predict planes, and find them with real rays from the sensor (section 5.2.2)."""
    # Rays start in pairs symmetric to the axis, from the heights and with the slopes of the model.
    real = real_camera(lens, micro_lenses)
    model = RayModel(real.camera, Decimal(extension_mm), micro_image_size)
    predicted = {1: model.near_border, 0: model.distance, -1: model.far_border}[border](a).mm
    c = (micro_image_size - 1) / 2
    position = a * c * micro_lenses.pitch_mm
    start = position + border * micro_lenses.pitch_mm / 2
    slope = model.chief_ray_slope(-(c - border / 2), position)
    planes = refocused_planes(
        real.system,
        (start, slope),
        (-start, -slope),
        real.back_focal_distance_mm + extension_mm,
    )
    return Comparison(model, a, border, predicted, planes.distances_mm)


def real_micro_image_centres(lens: str, positions_mm: Values, extension_mm: float) -> Values:
    """Micro image centres from real chief rays (Tables 5.3 and 5.4, simulation)."""
    real = real_camera(lens)
    # The image plane that the prescription states, as the thesis's simulation has it.
    image_distance = real.system.image_distance_mm + extension_mm
    return micro_image_centres(
        real.system, positions_mm, image_distance, MICRO_LENSES.focal_length_mm
    ).positions_mm


@dataclass(frozen=True)
class VirtualComparison:
    """Two virtual cameras, predicted and by real rays (section 5.2.3)."""

    gap: int
    # from the front vertex to the entrance pupil, in mm
    predicted_pupil_mm: float
    real_pupil_mm: float
    predicted_baseline_mm: float
    real_baseline_mm: float
    # between the cameras' axes
    predicted_tilt_deg: float
    real_tilt_deg: float
    # in micro lenses between the two views, and distances from the entrance pupil in mm
    disparities: Values
    predicted_depths_mm: Values
    real_depths_mm: Values

    @property
    def deviations_percent(self) -> dict[str, Values]:
        """(predicted - real) / predicted in percent, as the thesis counts; nan for a tilt of 0."""
        pairs = {
            "pupil": (self.predicted_pupil_mm, self.real_pupil_mm),
            "baseline": (self.predicted_baseline_mm, self.real_baseline_mm),
            "tilt": (self.predicted_tilt_deg, self.real_tilt_deg),
            "depths": (self.predicted_depths_mm, self.real_depths_mm),
        }
        with np.errstate(divide="ignore", invalid="ignore"):
            return {
                name: np.where(
                    np.asarray(predicted) == 0,
                    np.nan,
                    100 * (np.float64(1) - np.asarray(real) / np.asarray(predicted)),
                )
                for name, (predicted, real) in pairs.items()
            }


def compare_virtual_cameras(
    lens: str,
    gap: int,
    *,
    extension_mm: float = 0.0,
    per_view: Sequence[float] = (1.0, 2.0),
    micro_lenses: MicroLensArray = MICRO_LENSES,
) -> VirtualComparison:
    """Predict two virtual cameras and what they triangulate, and find both with real rays.

    Rays of a view start at neighbouring micro lenses with the slopes of the model. Where they
    meet, drawn through the lens as if it were not there, is its virtual camera. Disparities are
    given for each view of the gap, as Table 5.9 counts.
    """
    real = real_camera(lens, micro_lenses)
    model = RayModel(real.camera, Decimal(extension_mm), real.camera.micro_image_size)
    disparities = gap * np.asarray(per_view, dtype=np.float64)
    pitch = micro_lenses.pitch_mm

    def rays(view: int, positions: Values) -> Rays:
        return trace_to_object(
            real.system,
            positions,
            model.chief_ray_slope(view, positions),
            real.back_focal_distance_mm + extension_mm,
        ).rays

    def camera(view: int) -> tuple[float, float]:
        """Height and place of a virtual camera."""
        first, second = (rays(view, np.array([s])) for s in (0.0, pitch))
        ((_, height, place),) = intersect(first, second).points
        return float(height), float(place)

    (central, _), (other, place) = camera(0), camera(gap)
    axis, slope = (rays(view, np.array([0.0])).slopes[:, 1].item() for view in (0, gap))
    # An object on the axis of view 0, seen by the other view so many micro lenses away.
    slanted = rays(gap, -disparities * pitch)
    straight = rays(0, np.zeros_like(disparities))
    depths = intersect(straight, slanted).points[:, 2] - place
    pupil = model.entrance_pupil_from_vertex_mm
    assert pupil is not None
    return VirtualComparison(
        gap=gap,
        predicted_pupil_mm=pupil,
        real_pupil_mm=real.system.length_mm - place,
        predicted_baseline_mm=float(model.baseline(gap)),
        real_baseline_mm=central - other,
        predicted_tilt_deg=float(model.tilt(gap)),
        real_tilt_deg=float(np.rad2deg(np.arctan(axis) - np.arctan(slope))),
        disparities=disparities,
        predicted_depths_mm=model.depth(disparities, gap).mm,
        real_depths_mm=depths,
    )
