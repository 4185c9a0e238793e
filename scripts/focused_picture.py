# SPDX-License-Identifier: Apache-2.0
"""The picture of focused cameras in the documentation, for pictures.py."""

import matplotlib.pyplot as plt
import numpy as np
from skimage import data

from picture_files import save
from plenofir.camera.calibration import calibrate
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.captures.prepare import prepared
from plenofir.camera.exposure import Exposure
from plenofir.camera.focused import DepthScale, focused_capture, search_depth
from plenofir.camera.lightfield.disparity import LEAST_CONFIDENCE
from plenofir.camera.rays import RayModel, load_camera, setting_of_virtual_depth
from plenofir.ground.images import Picture
from plenofir_studies.synthetic import TexturedPlane, field_of_view, render, with_pitch


def focused() -> None:
    """A rendered capture of a focused camera: two planes, all in focus, depth."""
    lenses, depths = (40, 52), (2.3, 2.6, 3.1)
    model = with_pitch(RayModel.focused(load_camera("raytrix-r12"), 463.54174, 23), 23.0)
    settings = [float(setting_of_virtual_depth(model, v)) for v in depths]
    distances = [float(model.distance(a).mm) for a in settings]
    across = [field_of_view(model, mm, lenses[1]) for mm in distances]
    planes = [
        TexturedPlane(data.astronaut(), distances[0], 1.3 * across[0]),
        TexturedPlane(data.coffee(), distances[1], 0.42 * across[1], (6.5, -8.0)),
        TexturedPlane(data.rocket(), distances[2], 0.42 * across[2], (-4.5, 7.5)),
    ]
    capture = render(model, planes, lenses, layout="hexagonal-rows", noise=0.01)
    calibration = calibrate(capture.white)
    scale = DepthScale(model)
    types = LensTypes(pattern=(0, 1, 2), sharpest=scale.sharpest())
    types = types.carried(capture.grid, calibration.grid, np.eye(2), np.zeros(2))
    calibration = calibration.model_copy(update={"lens_types": types})
    source = focused_capture(prepared(Picture(capture.raw, 65535, 1.0), calibration))
    depth = search_depth(source)
    maps = scale.depth(np.where(depth.confidence >= LEAST_CONFIDENCE, depth.inverse, np.nan))
    screen = Exposure(0, 0.9 * 65535, 1.6)
    pictures = {
        "part of the raw capture": capture.raw[330:560, 420:726],
        **{f"v = {v}": source.refocused(scale.inverse(v)) for v in depths},
        "all in focus": source.refocused(depth.at(source.shape(), 2)),
    }
    figure, axes = plt.subplots(2, 3, figsize=(12, 6.4), constrained_layout=True)
    for axis, (title, image) in zip(axes.ravel(), pictures.items(), strict=False):
        axis.imshow(screen.apply(image, np.uint8))
        axis.set_title(title)
    shown = axes[1, 2].imshow(np.ma.masked_invalid(maps), cmap="viridis", vmin=2.2, vmax=3.2)
    axes[1, 2].set_title("virtual depth v")
    figure.colorbar(shown, ax=axes[1, 2], shrink=0.8)
    for axis in axes.ravel():
        axis.set_axis_off()
    save("focused.jpg", figure)
