# SPDX-License-Identifier: Apache-2.0
"""Plots of a camera's figures."""

from math import inf, isfinite

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from plenofir.camera.design.figures import Design, depth_error, lens_sample, resolution_mm
from plenofir.camera.plots import SharpRange, draw_ranges, log_scale
from plenofir.camera.rays import RayModel
from plenofir.camera.rays.distances import BLURRED

_POINTS = 200
# A range to infinity is drawn to so many times its near end.
_FAR = 30.0


def _bounded(values: np.ndarray, states: np.ndarray, top: float) -> np.ndarray:
    """Distances for a band: what lies at or beyond infinity is the top of the plot."""
    reached = np.where(states == 0, np.minimum(np.nan_to_num(values, nan=top), top), top)
    return np.where(states == BLURRED, np.nan, reached)


def _planes(axes: Axes, model: RayModel, found: Design, top: float) -> None:
    ends = [float(model.focus_setting(distance)) for distance in (found.near_mm, top)]
    settings = np.linspace(min(ends), max(ends), _POINTS)
    planes = model.planes(settings)
    axes.plot(settings, _bounded(planes.centre.mm, planes.centre.states, top), label="plane")
    axes.fill_between(
        settings,
        _bounded(planes.near.mm, planes.near.states, top),
        _bounded(planes.far.mm, planes.far.states, top),
        alpha=0.3,
        label="depth of field",
    )
    axes.set(xlabel="a", ylabel="distance / mm")
    log_scale(axes.yaxis)
    axes.legend(fontsize=8)


def _ranges(found: Design) -> list[SharpRange]:
    return [
        SharpRange(
            f"a = {plane.a}",
            plane.near_mm,
            plane.far_mm,
            plane.distance_mm if isfinite(plane.distance_mm) else None,
        )
        for plane in found.planes
    ]


def design_plot(found: Design) -> Drawing:
    """Four plots: planes, slices, lateral resolution and depth error over the distance."""
    model = found.model
    top = found.far_mm if isfinite(found.far_mm) else _FAR * found.near_mm
    distances = np.geomspace(found.near_mm, top, _POINTS)
    drawing, axes = plt.subplots(2, 2, figsize=(11, 7.5), constrained_layout=True)
    _planes(axes[0, 0], model, found, top)
    draw_ranges(axes[0, 1], _ranges(found))
    axes[0, 1].set_title("slices that cover the range")
    sample = np.array([lens_sample(model, float(d)) for d in distances])
    axes[1, 0].plot(distances, sample, label="a micro lens wide (a view's pixel)")
    axes[1, 0].plot(distances, sample / model.micro_image_size, "--", label="1/M of that")
    if not model.camera.micro_lenses.standard:
        settings = model.focus_setting(distances)
        widths = [resolution_mm(model, float(a)) for a in settings]
        axes[1, 0].plot(distances, widths, label="pixel, blur and box of a slice")
    axes[1, 0].set(xlabel="distance / mm", ylabel="width on the object / mm")
    errors = [depth_error(model, float(d), found.gap, found.disparity_error_px) for d in distances]
    axes[1, 1].plot(distances, [np.nan if e == inf else e for e in errors])
    axes[1, 1].set(
        xlabel="distance / mm",
        ylabel="error of the distance / mm",
        title=f"disparity off by {found.disparity_error_px:g} pixels, G = {found.gap}",
    )
    for line in (axes[1, 0].xaxis, axes[1, 0].yaxis, axes[1, 1].xaxis, axes[1, 1].yaxis):
        log_scale(line)
    axes[1, 0].legend(fontsize=8)
    for axis in axes.ravel():
        axis.grid(alpha=0.3, which="both")
    drawing.suptitle(f"{model.camera.name}, M = {model.micro_image_size}")
    return drawing
