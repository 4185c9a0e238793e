# SPDX-License-Identifier: Apache-2.0
"""Make the pictures of docs/light-field.md: calibration, microscope, depth, sweep in the VHDL.

Usage: python scripts/capture_pictures.py [ghdl | nvc]
"""

import sys
import tempfile
from math import inf
from pathlib import Path

import cv2
import imageio.v3 as iio
import matplotlib.pyplot as plt
import numpy as np
from skimage import data

from plenofir import project
from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.lightfield import (
    all_in_focus,
    depth_map,
    focal_stack,
    light_field,
    sub_aperture,
)
from plenofir.camera.lightfield.pictures import figure_pixels
from plenofir.camera.rays import RayModel, load_camera
from plenofir.camera.synthetic import TexturedPlane, field_of_view, render
from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.images import read_image, write_png
from plenofir_studies.calibration_report import MICROSCOPE, microscope_picture
from plenofir_studies.sweep import OBJECTS, SHIFTS, M, swept_scene

IMAGES = project.root() / "docs" / "images"


def enlarged(image: np.ndarray, times: int) -> np.ndarray:
    """Picture with larger pixels."""
    return image.repeat(times, axis=0).repeat(times, axis=1)


def calibration_picture() -> None:
    """Part of the microscope's white image with the centres found, and what decoding makes."""
    white, dark = (read_image(MICROSCOPE / f"{name}.png") for name in ("white", "dark"))
    calibration = calibrate(white, dark)
    times, side = 8, 78
    grey = np.clip(white[:side, :side] / np.percentile(white, 99.5), 0, 1) * 255
    left = enlarged(np.repeat(grey.astype(np.uint8)[:, :, None], 3, axis=2), times)
    for y, x in calibration.centres.reshape(-1, 2):
        if max(y, x) < side:
            place = tuple(round(times * (c + 0.5)) for c in (x, y))
            cv2.drawMarker(left, place, (255, 40, 40), cv2.MARKER_CROSS, 22, 2)
    even = decode(white, calibration, 15)[: side - 3, : side - 3]
    right = enlarged(np.clip(0.75 * even / np.median(even), 0, 1), times) * 255
    right = cv2.resize(right.astype(np.uint8), (left.shape[1], left.shape[0]))
    gap = np.full((left.shape[0], 16, 3), 255, np.uint8)
    picture = np.hstack([left, gap, np.repeat(right[:, :, None], 3, axis=2)])
    iio.imwrite(IMAGES / "calibration.jpg", picture, quality=85)


def depth_pictures() -> None:
    """Raw capture, a view, all in focus and the depth map of a rendered scene."""
    m, lenses = 11, (72, 120)
    model = RayModel.focused(load_camera("f197-mla2"), inf, m)
    objects = (
        (data.brick(), 1 / 11, (0, 0), 170),
        (data.coffee(), 4 / 11, (4, -36), 42),
        (data.astronaut(), 7 / 11, (0, 0), 34),
        (data.chelsea(), 10 / 11, (6, 36), 40),
    )
    planes = []
    for texture, a, (down, right), width in objects:
        distance = float(model.distance(a).mm)
        lens = field_of_view(model, distance, 1)
        planes.append(TexturedPlane(texture, distance, width * lens, (down * lens, right * lens)))
    capture = render(model, planes, lenses, rotation_degrees=0.4, noise=0.01, shading=0.3)
    raster = decode(capture.raw, calibrate(capture.white), m)
    stack = focal_stack(raster, m, [f"{k}/11" for k in range(13)])
    sharp = all_in_focus(stack, m).image
    depth = depth_map(raster, model)
    rows, columns = light_field(raster, m).shape[:2]
    figure, axes = plt.subplots(2, 2, figsize=(11, 7.2), constrained_layout=True)
    shown = (
        ("part of the raw capture", capture.raw[380:524, 480:720] >> 8),
        ("central view", sub_aperture(raster, m, 5, 5) >> 8),
        ("all in focus", sharp[: rows * m, : columns * m] >> 8),
    )
    for axis, (title, image) in zip(axes.ravel(), shown, strict=False):
        axis.imshow(image.astype(np.uint8), interpolation="nearest")
        axis.set_title(title)
    colours = plt.get_cmap("viridis_r").with_extremes(bad="0.6")
    scale = axes[1, 1].imshow(depth.distance_mm / 1000, cmap=colours, vmin=1, vmax=5)
    axes[1, 1].set_title("distance from the micro lenses")
    figure.colorbar(scale, ax=axes[1, 1], label="m", shrink=0.8)
    for axis in axes.ravel():
        axis.set_axis_off()
    iio.imwrite(IMAGES / "depth.jpg", figure_pixels(figure), quality=85)


def sweep_picture(simulator: str) -> None:
    """Slices of a rendered capture out of the VHDL, and how sharp each object is in each."""
    scene = swept_scene()
    frames = np.repeat(scene.raster[np.newaxis], len(SHIFTS), axis=0)
    with tempfile.TemporaryDirectory() as folder:
        result = run_bench(
            find_simulator(simulator), scene.core, frames, Path(folder), sweep_frames=1
        )
    figure = plt.figure(figsize=(11, 6.4), constrained_layout=True)
    grid = figure.add_gridspec(2, len(OBJECTS), height_ratios=(1, 1.5))
    for column, shift in enumerate(OBJECTS):
        axis = figure.add_subplot(grid[0, column])
        axis.imshow(result.frames[SHIFTS.index(shift)], cmap="gray", vmin=0)
        axis.set_title(f"a = {shift}/{M}")
        axis.set_axis_off()
    axis = figure.add_subplot(grid[1, :])
    settings = np.array(SHIFTS) / M
    predicted = scene.model.focus_setting(scene.distances_mm)
    curves = scene.curves(result.frames)
    for curve, a, distance in zip(curves, predicted, scene.distances_mm, strict=True):
        (line,) = axis.plot(settings, curve, marker="o", label=f"object at {distance / 1000:.2f} m")
        axis.axvline(a, color=line.get_color(), linestyle=":")
    axis.set_xlabel("slice a (dotted: the ray model's prediction)")
    axis.set_ylabel("sharpness, largest = 1")
    axis.grid(alpha=0.3)
    axis.legend()
    write_png(IMAGES / "sweep.png", figure_pixels(figure))


def main() -> None:
    """Write the pictures."""
    calibration_picture()
    write_png(IMAGES / "microscope.png", microscope_picture())
    depth_pictures()
    sweep_picture(sys.argv[1] if len(sys.argv) > 1 else "ghdl")


if __name__ == "__main__":
    main()
