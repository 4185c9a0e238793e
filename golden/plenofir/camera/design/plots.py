# SPDX-License-Identifier: Apache-2.0
"""Plots of a camera's figures, as SVG, PDF or PNG."""

import io
from math import inf, isfinite

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import LogLocator, NullFormatter

from plenofir.camera.design.figures import Design, depth_error, lens_sample
from plenofir.camera.rays import RayModel

PLOTS = (".svg", ".pdf", ".png")
"""Endings of what `encode_figure` writes."""
_POINTS = 200
# A range to infinity is drawn to so many times its near end.
_FAR = 30.0


def encode_figure(drawing: Drawing, suffix: str) -> bytes:
    """A figure as SVG, PDF or PNG; the same input gives the same bytes."""
    kind = suffix.lstrip(".").lower()
    # Neither dates nor random names of parts.
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    content = io.BytesIO()
    with plt.rc_context({"svg.hashsalt": "plenofir", "svg.fonttype": "none"}):
        drawing.savefig(content, format=kind, dpi=120, metadata=metadata)
    plt.close(drawing)
    return content.getvalue()


def _bounded(values: np.ndarray, states: np.ndarray, top: float) -> np.ndarray:
    """Distances for a band: what lies at or beyond infinity is the top of the plot."""
    return np.where(states == 0, np.minimum(np.nan_to_num(values, nan=top), top), top)


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
    axes.set(xlabel="a", ylabel="distance / mm", yscale="log")
    axes.legend(fontsize=8)


def _slices(axes: Axes, found: Design, top: float) -> None:
    for n, plane in enumerate(found.planes):
        axes.plot([plane.near_mm, min(plane.far_mm, top)], [n, n], linewidth=6, alpha=0.5)
        axes.plot(min(plane.distance_mm, top), n, "k|")
    names = [f"a = {plane.a}" for plane in found.planes]
    axes.set_yticks(range(len(names)), names, fontsize=max(4, min(8, 120 // max(1, len(names)))))
    axes.set(xlabel="distance / mm", xscale="log", title="slices that cover the range")


def design_plot(found: Design) -> Drawing:
    """Four plots: planes, slices, lateral resolution and depth error over the distance."""
    model = found.model
    top = found.far_mm if isfinite(found.far_mm) else _FAR * found.near_mm
    distances = np.geomspace(found.near_mm, top, _POINTS)
    drawing, axes = plt.subplots(2, 2, figsize=(11, 7.5), constrained_layout=True)
    _planes(axes[0, 0], model, found, top)
    _slices(axes[0, 1], found, top)
    sample = np.array([lens_sample(model, float(d)) for d in distances])
    axes[1, 0].plot(distances, sample, label="a micro lens wide (a view's pixel)")
    axes[1, 0].plot(distances, sample / model.micro_image_size, "--", label="1/M of that")
    axes[1, 0].set(xlabel="distance / mm", ylabel="width on the object / mm")
    errors = [depth_error(model, float(d), found.gap, found.disparity_error_px) for d in distances]
    axes[1, 1].plot(distances, [np.nan if e == inf else e for e in errors])
    axes[1, 1].set(
        xlabel="distance / mm",
        ylabel="error of the distance / mm",
        title=f"disparity off by {found.disparity_error_px:g} pixels, G = {found.gap}",
    )
    for axis in axes[1]:
        axis.set(xscale="log", yscale="log")
    axes[1, 0].legend(fontsize=8)
    for axis in axes.ravel():
        axis.grid(alpha=0.3, which="both")
        for line in (axis.xaxis, axis.yaxis):
            if line.get_scale() == "log":
                line.set_major_locator(LogLocator(subs=(1, 2, 5)))
                line.set_major_formatter("{x:g}")
                line.set_minor_formatter(NullFormatter())
    drawing.suptitle(f"{model.camera.name}, M = {model.micro_image_size}")
    return drawing
