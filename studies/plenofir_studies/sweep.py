# SPDX-License-Identifier: Apache-2.0
"""Joint test of hardware, golden refocuser and ray model: a sweep over a rendered capture.

Three objects stand at distances that the ray model predicts for three slices. The capture is
calibrated and decoded like a real one; the raster goes through the filter array once for each
slice, and each object must be sharpest in its own.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import inf

import numpy as np

from plenofir.camera.calibration import calibrate, decode, raster_window
from plenofir.camera.lightfield import sharpness_curve
from plenofir.camera.lightfield.stack import Floats
from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.refocus.operator import Image
from plenofir_studies.experiments import CAMERA, textures
from plenofir_studies.synthetic.render import TexturedPlane, field_of_view, render, with_pitch

M = 5
SHIFTS = tuple(range(7))
"""Slices swept, a' = a M."""
OBJECTS = (1, 3, 5)
"""a' of the slices in which the objects are sharp, left to right."""
_PITCH = 6.3
_SIDE = 13
_GAP = 2
_ROWS = 17
_INSIDE = 9


@dataclass(frozen=True)
class SweptScene:
    """The capture's raster and its objects."""

    model: RayModel  # the camera; its pixel pitch gives micro images of 6.3 pixels
    raster: Image  # aligned raw image, 8 bit grey, M = 5
    distances_mm: tuple[float, ...]  # where the objects stand
    regions: tuple[tuple[slice, slice], ...]  # rows and columns of pixels of each object's inside

    @property
    def core(self) -> CoreConfiguration:
        """The filter array that the raster is swept through."""
        return CoreConfiguration(
            micro_image_size=M,
            shifts=SHIFTS,
            max_columns=self.raster.shape[1],
            engine=FirEngine(),
        )

    def curves(self, frames: Image) -> list[Floats]:
        """Sharpness of each object in each frame of a sweep."""
        return [sharpness_curve(frames, region, M) for region in self.regions]


def swept_scene() -> SweptScene:
    """Render, calibrate and decode the scene."""
    model = with_pitch(RayModel.focused(load_camera(CAMERA), inf, M), _PITCH)
    settings = [Fraction(k, M) for k in OBJECTS]
    distances = [float(model.distance(float(a)).mm) for a in settings]
    columns = len(OBJECTS) * (_SIDE + _GAP) + _GAP
    middles = [(k - (len(OBJECTS) - 1) / 2) * (_SIDE + _GAP) for k in range(len(OBJECTS))]
    planes = []
    for distance, middle, texture in zip(distances, middles, textures(), strict=False):
        lens = field_of_view(model, distance, 1)
        # A part of the texture, so that its grains are larger than micro lenses.
        part = texture[:200, :200]
        planes.append(TexturedPlane(part, distance, _SIDE * lens, (0.0, middle * lens)))
    capture = render(
        model, planes, (_ROWS, columns), rotation_degrees=0.4, noise=0.01, shading=0.2, bits=8
    )
    calibration = calibrate(capture.white)
    raster = decode(capture.raw, calibration, M)
    rows, lens_columns = raster_window(calibration)
    middle_px = (np.array(capture.raw.shape) - 1) / 2
    centre = calibration.grid.inverse(middle_px) - (rows.start, lens_columns.start)
    regions = []
    for middle in middles:
        start = np.rint((centre + np.array([0.0, middle]) - (_INSIDE - 1) / 2) * M).astype(int)
        parts = [slice(max(0, int(s)), int(s) + _INSIDE * M) for s in start]
        regions.append((parts[0], parts[1]))
    return SweptScene(model, raster, tuple(distances), tuple(regions))
