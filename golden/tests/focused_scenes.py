# SPDX-License-Identifier: Apache-2.0
"""Rendered captures of a focused camera with three types of micro lenses, for tests."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from skimage import data

from plenofir.camera.rays import RayModel, load_camera, setting_of_virtual_depth
from plenofir_studies.synthetic import (
    Capture,
    TexturedPlane,
    field_of_view,
    micro_image_pitch,
    pinhole_view,
    render,
    with_pitch,
)

R12 = load_camera("raytrix-r12")
FOCUS = 463.54174
Floats = npt.NDArray[np.float64]
RAYTRIX_XML = """<?xml version="1.0"?>
<RayCalibData version="1.0">
  <offset units="pix"><x>{x}</x><y>{y}</y></offset>
  <diameter units="pix">{diameter}</diameter>
  <rotation units="rad">{rotation}</rotation>
  <lens_border units="pix">1</lens_border>
  <lens_base_x units="lens"><x>1</x><y>0</y></lens_base_x>
  <lens_base_y units="lens"><x>0.5</x><y>-0.866025388241</y></lens_base_y>
  <distortion type="radial"><parameter count="0">{distortion}</parameter></distortion>
  <lens_type id="0"><offset><x>0</x><y>0</y></offset>
    <depth_range><min>1</min><max>3</max></depth_range></lens_type>
  <lens_type id="1"><offset><x>1</x><y>0</y></offset>
    <depth_range><min>2.8</min><max>4</max></depth_range></lens_type>
  <lens_type id="2"><offset><x>-1</x><y>0</y></offset>
    <depth_range><min>3.8</min><max>100</max></depth_range></lens_type>
</RayCalibData>"""


class Scene(NamedTuple):
    """A capture, and what its pictures of two pixels of the capture should show."""

    model: RayModel
    capture: Capture
    truth: Floats  # colours, (rows, columns, 3)
    depth: Floats  # virtual depth; nan where there is nothing


def model_of(pitch: float = 23.0) -> RayModel:
    """The shipped focused camera with micro images of another pitch."""
    return with_pitch(RayModel.focused(R12, FOCUS, 23), pitch)


def planes_at(
    model: RayModel, depths: tuple[float, ...], lenses: tuple[int, int]
) -> list[TexturedPlane]:
    """Photographs at virtual depths: the first fills the picture, others lie before it.

    Their detail is as fine as the sensor's pixels thrown onto them.
    """
    planes = []
    for number, depth in enumerate(depths):
        photograph = (data.astronaut(), data.coffee(), data.rocket())[number]
        distance = float(model.distance(float(setting_of_virtual_depth(model, depth))).mm)
        across = field_of_view(model, distance, lenses[1])
        down = field_of_view(model, distance, lenses[0])
        width, centre = 1.5 * across, (0.0, 0.0)
        if number:
            side = 1 if number % 2 else -1
            width, centre = 0.45 * across, (side * 0.2 * down, -side * 0.23 * across)
        pixels = width / across * lenses[1] * micro_image_pitch(model)
        fine = depth * photograph.shape[1] / pixels / 2
        smooth = ndimage.gaussian_filter(photograph / 255, (fine, fine, 0), mode="nearest")
        planes.append(TexturedPlane(smooth, distance, width, centre))
    return planes


def scene(
    depths: tuple[float, ...] = (2.3, 2.6, 3.1),
    *,
    pitch: float = 23.0,
    lenses: tuple[int, int] = (26, 32),
    **how: Any,
) -> Scene:
    """Render a scene; `how`: see `plenofir_studies.synthetic.render`."""
    model = model_of(pitch)
    planes = planes_at(model, depths, lenses)
    how = {"layout": "hexagonal-rows", "noise": 0.005, **how}
    capture = render(model, planes, lenses, **how)
    if pitch != 23.0:
        return Scene(model, capture, np.empty(0), np.empty(0))
    truth, distances = pinhole_view(model, planes, lenses, 23)
    rows, columns = (n // 2 for n in truth.shape[:2])
    truth = truth[: 2 * rows, : 2 * columns].reshape(rows, 2, columns, 2, 3).mean(axis=(1, 3))
    depth = np.full((rows, columns), np.nan)
    for plane, v in zip(planes, depths, strict=True):
        depth[np.isclose(distances[: 2 * rows : 2, : 2 * columns : 2], plane.distance_mm)] = v
    return Scene(model, capture, truth, depth)
