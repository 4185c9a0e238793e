# SPDX-License-Identifier: Apache-2.0
"""The ray model: distances and depths of field of refocused planes, and virtual cameras.

`RayModel` is the model; `load_camera` reads what it is made from. `MicroscopeModel` is that of
microscopes, `load_instrument` reads cameras and microscopes.
"""

from plenofir.camera.rays.camera import (
    FIELDS,
    Camera,
    MainLens,
    MicroLensArray,
    Sensor,
    camera_names,
    camera_of,
    load_camera,
    microscope_names,
)
from plenofir.camera.rays.condition import condition_numbers
from plenofir.camera.rays.cover import Cover, Slice, covering_slices, depth_of_field, gaps_between
from plenofir.camera.rays.diffraction import (
    abbe_limit,
    airy_radius,
    diffraction_note,
    rayleigh_limit,
)
from plenofir.camera.rays.distances import Distances, Planes, State, lens_extension
from plenofir.camera.rays.lens_types import (
    Sharpness,
    UsableRange,
    blur_px,
    covering_depth,
    pupil_blur_px,
    resolution_ratio,
    setting_of_virtual_depth,
    sharpest_inverse,
    sharpest_type,
    usable_ranges,
    virtual_depth,
)
from plenofir.camera.rays.measured import (
    MeasuredPupil,
    extension_of_infinity,
    measure_pupil,
    measured_focal_length,
)
from plenofir.camera.rays.microscope import Microscope, MicroscopeModel, Objective, load_instrument
from plenofir.camera.rays.model import RayModel

__all__ = [
    "FIELDS",
    "Camera",
    "Cover",
    "Distances",
    "MainLens",
    "MeasuredPupil",
    "MicroLensArray",
    "Microscope",
    "MicroscopeModel",
    "Objective",
    "Planes",
    "RayModel",
    "Sensor",
    "Sharpness",
    "Slice",
    "State",
    "UsableRange",
    "abbe_limit",
    "airy_radius",
    "blur_px",
    "camera_names",
    "camera_of",
    "condition_numbers",
    "covering_depth",
    "covering_slices",
    "depth_of_field",
    "diffraction_note",
    "extension_of_infinity",
    "gaps_between",
    "lens_extension",
    "load_camera",
    "load_instrument",
    "measure_pupil",
    "measured_focal_length",
    "microscope_names",
    "pupil_blur_px",
    "rayleigh_limit",
    "resolution_ratio",
    "setting_of_virtual_depth",
    "sharpest_inverse",
    "sharpest_type",
    "usable_ranges",
    "virtual_depth",
]
