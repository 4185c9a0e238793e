# SPDX-License-Identifier: Apache-2.0
"""Pictures of curves and maps."""

from collections.abc import Mapping, Sequence

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from plenofir.refocus.operator import Image

Floats = npt.NDArray[np.float64]


def figure_pixels(figure: Figure) -> Image:
    """Draw a figure."""
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[:, :, :3].copy()  # type: ignore[attr-defined]
    plt.close(figure)
    return pixels


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


def depth_picture(distance_mm: Floats) -> Image:
    """Map of distances in colours, with a scale; grey where there is none."""
    rows, columns = distance_mm.shape
    width = 8.0
    height = min(max(width * rows / columns * 0.85, 2.0), 16.0)
    figure, axes = plt.subplots(figsize=(width, height), constrained_layout=True)
    known = distance_mm[~np.isnan(distance_mm)]
    low, high = np.percentile(known, [2, 98]) if known.size else (0.0, 1.0)
    colours = plt.get_cmap("viridis_r").with_extremes(bad="0.6")
    shown = axes.imshow(distance_mm, cmap=colours, vmin=low, vmax=max(high, low + 1))
    axes.set_axis_off()
    figure.colorbar(shown, ax=axes, label="mm from the micro lenses")
    return figure_pixels(figure)


def disparity_picture(view: Floats, maps: Mapping[str, Floats]) -> Image:
    """A view, and below it maps of disparities in pixels with their scales (Figs. 5.17, 5.18)."""
    rows, columns = view.shape
    width, count = 8.0, 1 + len(maps)
    height = count * min(max(width * rows / columns, 1.2), 8.0)
    figure, axes = plt.subplots(count, 1, figsize=(width, height), constrained_layout=True)
    axes[0].imshow(view, cmap="gray")
    for part, (name, disparities) in zip(axes[1:], maps.items(), strict=True):
        shown = part.imshow(disparities, cmap="viridis")
        part.set_title(name, fontsize=9)
        figure.colorbar(shown, ax=part, label="pixels")
    for part in axes:
        part.set_axis_off()
    return figure_pixels(figure)
