"""The ray model beside real rays: a main lens from its prescription, traced surface by surface."""

from dataclasses import dataclass
from decimal import Decimal
from functools import cache

import numpy as np

from plenofir.camera.optics.chief_rays import micro_image_centres
from plenofir.camera.optics.paraxial import cardinal_points, entrance_pupil, exit_pupil
from plenofir.camera.optics.prescription import LensSystem, load_prescription
from plenofir.camera.optics.tracing import refocused_planes
from plenofir.camera.rays.camera import Camera, MainLens, MicroLensArray, Sensor
from plenofir.camera.rays.model import RayModel
from plenofir.camera.rays.precise import Values

WAVELENGTH_NM = 550.0
MICRO_LENSES = MicroLensArray(focal_length_mm=2.75, pitch_mm=0.125)
SENSOR = Sensor(pixel_pitch_mm=0.009, columns=4008, rows=2672)


@dataclass(frozen=True)
class RealCamera:
    """A camera whose main lens is known by its prescription."""

    system: LensSystem  # the lens's surfaces
    back_focal_distance_mm: float  # from the last vertex to the focal plane
    camera: Camera  # the same camera in paraxial data


@cache
def real_camera(lens: str) -> RealCamera:
    """Make a camera with micro lenses (II) of the text from a shipped prescription."""
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
        name=lens, title="", main_lens=main_lens, micro_lenses=MICRO_LENSES, sensor=SENSOR
    )
    return RealCamera(system, points.back_focal_distance_mm, camera)


@dataclass(frozen=True)
class Comparison:
    """Predicted and real distances of planes."""

    a: Values  # focus settings
    border: int  # 1 near border, 0 plane, -1 far border
    # distances from the micro lenses in mm; nan where there is none
    predicted: Values
    real: Values

    @property
    def deviation_percent(self) -> Values:
        """(predicted - real) / predicted in percent, as the text counts."""
        return np.asarray(100 * (self.predicted - self.real) / self.predicted)


def compare_distances(
    lens: str, a: Values, micro_image_size: int, *, extension_mm: float = 0.0, border: int = 0
) -> Comparison:
    """Predict planes, and find them with real rays from the sensor (section 5.2.2)."""
    # Rays start in pairs symmetric to the axis, from the heights and with the slopes of the model.
    real = real_camera(lens)
    model = RayModel(real.camera, Decimal(extension_mm), micro_image_size)
    predicted = {1: model.near_border, 0: model.distance, -1: model.far_border}[border](a).mm
    c = (micro_image_size - 1) / 2
    position = a * c * MICRO_LENSES.pitch_mm
    start = position + border * MICRO_LENSES.pitch_mm / 2
    slope = model.chief_ray_slope(-(c - border / 2), position)
    planes = refocused_planes(
        real.system,
        (start, slope),
        (-start, -slope),
        real.back_focal_distance_mm + extension_mm,
    )
    return Comparison(a, border, predicted, planes.distances_mm)


def real_micro_image_centres(lens: str, positions_mm: Values, extension_mm: float) -> Values:
    """Micro image centres from real chief rays (Tables 5.3 and 5.4, simulation)."""
    real = real_camera(lens)
    # The image plane that the prescription states, as the text's simulation has it.
    image_distance = real.system.image_distance_mm + extension_mm
    return micro_image_centres(
        real.system, positions_mm, image_distance, MICRO_LENSES.focal_length_mm
    ).positions_mm
