# SPDX-License-Identifier: Apache-2.0
"""Pictures of the optical bench: rays, refocused planes, depths of field."""

import io
from collections.abc import Sequence
from fractions import Fraction
from math import isnan
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import ScalarFormatter

from plenofir.camera.rays.model import RayModel
from plenofir.ground.files import write_file

_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")


def _draw_rays(axes: Axes, model: RayModel, a: float, colour: str, reach: float) -> None:
    """Draw the ray pair of one plane from the sensor into object space."""
    c = (model.micro_image_size - 1) / 2
    pitch = model.camera.micro_lenses.pitch_mm
    sensor = -model.camera.micro_lenses.focal_length_mm
    lens = model.image_distance_mm
    front = lens + model.camera.main_lens.principal_plane_separation_mm
    for sign in (1, -1):
        # The plane lies where rays of pixels -c and c cross that start half of a (M-1) pitches
        # above and below the axis.
        position = sign * a * c * pitch
        pixel = -sign * c
        slope = float(model.chief_ray_slope(pixel, position))
        object_slope, height = (float(v) for v in model.object_ray(pixel, position))
        axes.plot(
            [sensor, 0, lens],
            [position + slope * sensor, position, height],
            color=colour,
            linewidth=1,
        )
        axes.plot(
            [front, reach],
            [height, height + object_slope * (reach - front)],
            color=colour,
            linewidth=1,
        )


def plot_bench(model: RayModel, settings: Sequence[Fraction], path: Path) -> None:
    """Draw the optical bench with the planes' rays, and their depths of field."""
    planes = model.planes([float(a) for a in settings])
    seen = planes.centre.mm[np.isfinite(planes.centre.mm) & (planes.centre.states == 0)]
    lens = model.image_distance_mm
    front = lens + model.camera.main_lens.principal_plane_separation_mm
    reach = 1.15 * float(max([*seen[seen < 20 * lens], 1.5 * lens]))

    figure, (bench, depths) = plt.subplots(
        2, 1, figsize=(10, 7), height_ratios=(3, 2), constrained_layout=True
    )
    for index, a in enumerate(settings):
        _draw_rays(bench, model, float(a), _COLOURS[index % len(_COLOURS)], reach)
    top = max(abs(limit) for limit in bench.get_ylim())
    pupil = model.exit_pupil_mm
    marks = [(0.0, "micro lenses"), (lens, "H2"), (front, "H1")]
    # It may lie at infinity, or behind the micro lenses.
    marks += [(pupil, "exit pupil")] if 0 < pupil < reach else []
    marks.sort()
    for index, (place, name) in enumerate(marks):
        height = top * (1 - 0.25 * index)
        bench.axvline(place, color="0.6", linewidth=0.8, linestyle=":")
        bench.text(place, height, name, rotation=90, va="top", ha="right", fontsize=8, color="0.4")
    for index, (a, distance) in enumerate(zip(settings, planes.centre.mm, strict=True)):
        if not isnan(distance) and distance < reach:
            colour = _COLOURS[index % len(_COLOURS)]
            bench.axvline(distance, color=colour, linewidth=1.5)
            bench.text(distance, -top, f"a = {a}", rotation=90, va="bottom", ha="right", fontsize=8)
    bench.set_xlabel("distance from the micro lenses / mm")
    bench.set_ylabel("height / mm")
    bench.set_title(f"{model.camera.name}, M = {model.micro_image_size}")

    farthest = max([10 * reach, *(v for v in planes.far.mm if np.isfinite(v))])
    for index in range(len(settings)):
        near, far = float(planes.near.mm[index]), float(planes.far.mm[index])
        if isnan(near):
            continue
        end = farthest if isnan(far) else far
        colour = _COLOURS[index % len(_COLOURS)]
        depths.fill_betweenx([index - 0.25, index + 0.25], near, end, color=colour, alpha=0.4)
        centre = float(planes.centre.mm[index])
        if not isnan(centre):
            depths.plot([centre, centre], [index - 0.35, index + 0.35], color=colour)
    depths.set_xscale("log")
    depths.margins(x=0.05)
    depths.xaxis.set_major_formatter(ScalarFormatter())
    depths.xaxis.set_minor_formatter(ScalarFormatter())
    depths.tick_params(axis="x", which="minor", labelsize=7)
    depths.set_yticks(range(len(settings)), [f"a = {a}" for a in settings])
    depths.set_xlabel("depth of field: distance from the micro lenses / mm")
    content = io.BytesIO()
    figure.savefig(content, dpi=120, format="png")
    plt.close(figure)
    write_file(path, content.getvalue())
