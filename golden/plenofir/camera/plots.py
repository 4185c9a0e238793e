# SPDX-License-Identifier: Apache-2.0
"""Pictures of curves and maps."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]


def figure_pixels(figure: Figure) -> Image:
    """Draw a figure."""
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[:, :, :3].copy()  # type: ignore[attr-defined]
    plt.close(figure)
    return pixels


def encode_figure(figure: Figure, suffix: str) -> bytes:
    """A figure as SVG, PDF or PNG; the same input gives the same bytes."""
    kind = suffix.lstrip(".").lower()
    # Neither dates nor random names of parts.
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    content = io.BytesIO()
    with plt.rc_context({"svg.hashsalt": "plenofir", "svg.fonttype": "none"}):
        figure.savefig(content, format=kind, dpi=120, metadata=metadata)
    plt.close(figure)
    return content.getvalue()


def log_scale(axis: Axis) -> None:
    """Make an axis logarithmic, if it shows anything above 0."""
    if axis.get_minpos() < inf:
        axes = axis.axes
        (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
        label_log_axis(axis)


def label_log_axis(axis: Axis) -> None:
    """Label 1, 2 and 5 of each power of ten in plain numbers; any range if the axis is empty."""
    low, high = axis.get_view_interval()
    if not (0 < axis.get_minpos() < inf and 0 < high < inf):
        axes = axis.axes
        set_limits = axes.set_xlim if axis is axes.xaxis else axes.set_ylim
        set_limits(*((low, high) if 0 < low < high < inf else (1, 10)))
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


@dataclass(frozen=True)
class SharpRange:
    """What is sharp in a slice, in mm; `far` is inf where it reaches infinity."""

    name: str
    near: float
    far: float
    centre: float | None = None  # the plane itself; None at and beyond infinity


def draw_ranges(
    axes: Axes, ranges: Sequence[SharpRange | str], colours: Sequence[str] = ("tab:blue",)
) -> None:
    """Draw depths of field as bars over the distance; an arrow means up to infinity.

    A slice in which nothing in front of the lens is sharp is given as text: its name and why.
    """
    finite = [r for r in ranges if isinstance(r, SharpRange)]
    # Distances inside of a lens may be negative; the axis, of logarithms, has none of them.
    ends = [v for r in finite for v in (r.near, r.far, r.centre) if v is not None and 0 < v < inf]
    # Room for the arrows: the last third of a plot to infinity.
    room = 4.0 if any(r.far == inf for r in finite) else 1.1
    low, high = min(ends, default=100.0) / 1.1, max(ends, default=1000.0) * room
    for n, one in enumerate(ranges):
        colour = colours[n % len(colours)]
        if isinstance(one, str):
            axes.text(low, n, f" {one}", va="center", fontsize=8, color=colour)
            continue
        axes.fill_betweenx(
            [n - 0.25, n + 0.25],
            max(one.near, low),
            min(max(one.far, low), high),
            color=colour,
            alpha=0.4,
        )
        if one.far == inf:
            arrow = {"arrowstyle": "->", "color": colour}
            axes.annotate("", (high, n), (high / 1.3, n), arrowprops=arrow)
            axes.text(high / 1.35, n, "infinity", va="center", ha="right", fontsize=8)
        if one.centre is not None and one.centre > 0:
            axes.plot([one.centre] * 2, [n - 0.35, n + 0.35], color=colour)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.set_ylim(-0.6, max(len(ranges), 1) - 0.4)
    label_log_axis(axes.xaxis)
    names = ["" if isinstance(one, str) else one.name for one in ranges]
    size = max(4, min(9, 120 // max(1, len(names))))
    axes.set_yticks(range(len(names)), names, fontsize=size)
    axes.set_xlabel("depth of field: distance from the micro lenses / mm")


def sharpness_picture(
    settings: Sequence[float],
    curves: Mapping[str, Floats],
    predicted: Mapping[str, float] | None = None,
) -> Image:
    """Plot of sharpness over focus settings (Fig. 5.16)."""
    figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
    for name, curve in curves.items():
        (line,) = axes.plot(settings, curve, marker="o", markersize=3, label=name or None)
        if predicted and name in predicted:
            axes.axvline(predicted[name], color=line.get_color(), linestyle=":")
    axes.set_xlabel("a")
    axes.set_ylabel("sharpness S, largest = 1")
    axes.grid(alpha=0.3)
    if any(curves):
        axes.legend(fontsize=8)
    return figure_pixels(figure)
