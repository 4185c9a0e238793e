# SPDX-License-Identifier: Apache-2.0
"""Pictures of an inspection: mean micro image, chief rays, size of spots over position."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from plenofir.camera.calibration.inspection import WhiteInspection, neighbours
from plenofir.camera.calibration.spots import FocusScore
from plenofir.camera.plots import figure_pixels
from plenofir.camera.rays.measured import MeasuredPupil
from plenofir.camera.rays.model import RayModel
from plenofir.refocus.operator import Image

_RAYS = 9


def micro_image_picture(found: WhiteInspection) -> Image:
    """Mean micro image, and its brightness towards its neighbours and between them (Fig. 4.4)."""
    mean, fill = found.mean, found.fill
    figure, (picture, curves) = plt.subplots(1, 2, figsize=(10, 4.6), constrained_layout=True)
    end = float(mean.places[-1])
    middle = float(mean.at(np.zeros((1, 2)))[0])
    half = (fill.darkest + 1) / 2
    shown = mean.values / middle
    shades = picture.imshow(shown, cmap="gray", vmin=0, extent=(-end, end, end, -end))
    picture.contour(mean.places, mean.places, shown, [half], colors="tab:orange")
    picture.contour(mean.places, mean.places, mean.cell, [0.5], colors="tab:blue")
    picture.set_title("mean micro image; orange: half brightness, blue: its cell")
    picture.set_xlabel("pitches")
    figure.colorbar(shades, ax=picture, shrink=0.8)
    near = neighbours(mean.layout)
    way = np.linspace(0, 1, 101)
    between = near[:, np.newaxis] * way[:, np.newaxis]
    turn = np.pi / len(near)
    turned = near @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    corner = 0.5 / np.cos(turn)
    gaps = turned[:, np.newaxis] * (2 * corner * way)[:, np.newaxis]
    for name, points, length in (
        ("towards the neighbours", between, way),
        ("towards the gaps", gaps, 2 * corner * way),
    ):
        inside = (np.abs(points) <= end).all(axis=(0, 2))
        curves.plot(length[inside], (mean.at(points).mean(axis=0) / middle)[inside], label=name)
    curves.axvline(0.5, color="0.6", linestyle=":")
    curves.axhline(half, color="tab:orange", linestyle=":")
    curves.set_xlabel("distance from the centre / pitches")
    curves.set_ylabel("brightness, middle = 1")
    curves.set_ylim(bottom=0)
    curves.set_title(f"{fill.verdict}: {100 * fill.share:.0f} % of the sensor lit")
    curves.legend()
    curves.grid(alpha=0.3)
    return figure_pixels(figure)


def chief_ray_picture(model: RayModel, pupil: MeasuredPupil, lenses: int) -> Image:
    """Chief rays of a row of micro lenses and where they meet, measured and predicted."""
    array = model.camera.micro_lenses
    heights = np.linspace(-lenses / 2, lenses / 2, _RAYS) * array.pitch_mm
    figure, axes = plt.subplots(figsize=(9, 4), constrained_layout=True)
    ends = [pupil.predicted_mm]
    if 0 < pupil.distance_mm < 5 * pupil.predicted_mm:
        ends.append(pupil.distance_mm)
    reach = 1.1 * max(ends)
    z = np.array([-array.spacing_mm, reach])
    for name, distance, colour in (
        ("measured", pupil.distance_mm, "tab:red"),
        ("from the camera's data", pupil.predicted_mm, "tab:blue"),
    ):
        lines = heights * (1 - z[:, np.newaxis] / distance)
        axes.plot(z, lines, color=colour, linewidth=0.9, label=[name] + [""] * (_RAYS - 1))
        if distance in ends:
            axes.axvline(distance, color=colour, linestyle=":")
    axes.axvline(0, color="0.6")
    axes.text(0, axes.get_ylim()[1], " micro lenses", fontsize=8, va="top", color="0.4")
    axes.set_xlabel("distance from the micro lenses / mm")
    axes.set_ylabel("height / mm")
    axes.set_title(f"{model.camera.name}: chief rays meet in the pupil")
    handles, names = axes.get_legend_handles_labels()
    axes.legend(handles, names, fontsize=8)
    return figure_pixels(figure)


def focus_picture(score: FocusScore) -> Image:
    """Size of spots over the position of the micro lens array (Fig. 4.2)."""
    figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
    positions = [one.position for one in score.spots]
    axes.plot(positions, [one.radius for one in score.spots], "o-", color="k", label="whole")
    for side in score.sides:
        axes.plot(positions, [one.sides[side] for one in score.spots], ".--", label=side)
    if score.best is not None:
        axes.axvline(score.best.position, color="0.5", linestyle=":")
    axes.set_xlabel("position of the micro lenses")
    axes.set_ylabel("radius of a spot / pitches")
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    return figure_pixels(figure)
