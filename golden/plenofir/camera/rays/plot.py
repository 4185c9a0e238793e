# SPDX-License-Identifier: Apache-2.0
"""Pictures of the ray model: the optical bench, depths of field, virtual cameras, triangulation."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import cycle

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plenofir.camera.plots import SharpRange, draw_ranges, log_scale
from plenofir.camera.rays.cover import Cover, depth_of_field
from plenofir.camera.rays.distances import REAL, State
from plenofir.camera.rays.model import RayModel
from plenofir.camera.rays.virtual import DisparityUnit

_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")


def _draw_rays(axes: Axes, model: RayModel, a: float, colour: str, reach: float) -> None:
    """Draw the ray pair of one plane from the sensor into object space."""
    c = (model.micro_image_size - 1) / 2
    pitch = model.camera.micro_lenses.pitch_mm
    sensor = -model.camera.micro_lenses.spacing_mm
    lens = model.image_distance_mm
    front = _front(model)
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


def _front(model: RayModel) -> float:
    """Object-side principal plane, from the micro lenses."""
    return model.image_distance_mm + model.camera.main_lens.principal_plane_separation_mm


def sharp_ranges(model: RayModel, settings: Sequence[Fraction]) -> list[SharpRange | str]:
    """What is sharp in slices, for `draw_ranges`."""
    ranges: list[SharpRange | str] = []
    for a in settings:
        field, plane = depth_of_field(model, a), model.distance(float(a))
        if field is None:
            blurred = model.near_border(float(a)).state() is State.BLURRED
            ranges.append(f"a = {a}: {(State.BLURRED if blurred else plane.state()).value}")
            continue
        centre = float(plane.mm) if plane.state() is State.REAL else None
        near = max(field.near_mm, _front(model))
        ranges.append(SharpRange(f"a = {a}", near, field.far_mm, centre))
    return ranges


def _titled(model: RayModel) -> str:
    return f"{model.camera.name}, M = {model.micro_image_size}"


def plot_bench(model: RayModel, settings: Sequence[Fraction]) -> Figure:
    """Draw the optical bench with the planes' rays, and their depths of field.

    Planes nearer than 20 image distances are marked. The rays go 15 % farther than the last of
    them, or than one and a half image distances.
    """
    planes = model.distance([float(a) for a in settings])
    lens = model.image_distance_mm
    near = (planes.states == REAL) & (planes.mm < 20 * lens)
    reach = 1.15 * max([1.5 * lens, *planes.mm[near].tolist()])

    figure, (bench, depths) = plt.subplots(
        2, 1, figsize=(10, 7), height_ratios=(3, 2), constrained_layout=True
    )
    written = {"rotation": 90, "ha": "right", "fontsize": 8}
    # Heights of texts are shares of the picture's.
    heights = bench.get_xaxis_transform()
    for colour, a, distance, marked in zip(
        cycle(_COLOURS), settings, planes.mm, near, strict=False
    ):
        _draw_rays(bench, model, float(a), colour, reach)
        if marked:
            bench.axvline(distance, color=colour, linewidth=1.5)
            bench.text(distance, 0, f"a = {a}", va="bottom", transform=heights, **written)
    marks = [(0.0, "micro lenses"), (lens, "H2"), (_front(model), "H1")]
    marks += [(model.exit_pupil_mm, "exit pupil")]
    # The pupil may lie at infinity, or behind the micro lenses.
    for index, (place, name) in enumerate(sorted(m for m in marks if 0 <= m[0] < reach)):
        bench.axvline(place, color="0.6", linewidth=0.8, linestyle=":")
        height = 1 - 0.125 * index
        bench.text(place, height, name, va="top", transform=heights, color="0.4", **written)
    bench.set_xlabel("distance from the micro lenses / mm")
    bench.set_ylabel("height / mm")
    bench.set_title(_titled(model))
    draw_ranges(depths, sharp_ranges(model, settings), _COLOURS)
    return figure


def plot_cover(model: RayModel, cover: Cover) -> Figure:
    """Draw the depths of field of slices that cover a range, and the gaps between them."""
    figure, axes = plt.subplots(
        figsize=(9, 2.5 + 0.35 * len(cover.slices)), constrained_layout=True
    )
    draw_ranges(axes, sharp_ranges(model, [part.a for part in cover.slices]))
    low, high = axes.get_xlim()
    for near, far in cover.gaps:
        axes.axvspan(max(near, low), min(far, high), color="tab:red", alpha=0.2, label="gap")
    if cover.gaps:
        axes.legend(fontsize=8)
    axes.set_title(_titled(model))
    return figure


def plot_baselines(model: RayModel, gaps: Sequence[int], chosen: int, view: int) -> Figure:
    """Draw baseline and tilt over the gap, the chosen one marked, and where the pupil ends."""
    figure, (base, tilt) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    for axes, values, mark, name in (
        (base, model.baseline(gaps), model.baseline(chosen), "baseline / mm"),
        (tilt, model.tilt(gaps, view), model.tilt(chosen, view), "tilt / degrees"),
    ):
        axes.plot(gaps, values, ".-")
        axes.plot(chosen, float(mark), "o", color="tab:red", label=f"G = {chosen}: {mark:.4f}")
        axes.set(xlabel="G, views between the two cameras", ylabel=name)
        axes.grid(alpha=0.3)
    bound = model.outermost_view
    if bound is not None and bound - view < max(gaps):
        base.axvline(bound - view, color="0.5", linestyle=":", label="edge of the entrance pupil")
    for axes in (base, tilt):
        axes.legend(fontsize=8)
    figure.suptitle(f"{_titled(model)}, first view i = {view}")
    return figure


def plot_triangulation(
    model: RayModel, disparities: Sequence[float], gap: int, view: int, unit: DisparityUnit
) -> Figure:
    """Draw distance over disparity, around the given ones, which are marked.

    The curve goes farther than zero and the given ones by 20 % of the largest on the left and 30 %
    on the right; of 1 where all are zero.
    """
    span = max(abs(d) for d in disparities) or 1.0
    ends = min(0.0, *disparities) - 0.2 * span, max(disparities) + 0.3 * span
    curve = np.linspace(*ends, num=801)
    figure, axes = plt.subplots(figsize=(8, 5), constrained_layout=True)
    for values, style in ((curve, "-"), (np.asarray(disparities, dtype=np.float64), "o")):
        distances = model.depth(values, gap, view=view, unit=unit).mm + model.entrance_pupil_mm
        axes.plot(values, distances, style, color="tab:blue")
    log_scale(axes.yaxis)
    axes.set(
        xlabel=f"disparity / {unit}, views {view} and {view + gap}",
        ylabel="distance from the micro lenses / mm",
        title=_titled(model),
    )
    axes.grid(alpha=0.3, which="both")
    return figure
