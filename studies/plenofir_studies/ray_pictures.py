# SPDX-License-Identifier: Apache-2.0
"""Pictures of the ray model in the manner of the thesis's chapter 5, from the same numbers."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from plenofir.camera.plots import figure_pixels
from plenofir.camera.rays import (
    RayModel,
    blur_px,
    covering_depth,
    load_camera,
    resolution_ratio,
    setting_of_virtual_depth,
    usable_ranges,
)
from plenofir.refocus.operator import Image
from plenofir_studies.micro_lens_glass import (
    MICRO_LENS_CAUCHY,
    MICRO_LENS_SCHOTT,
    MICRO_LENS_SELLMEIER,
)
from plenofir_studies.ray_validation import table_model
from plenofir_studies.real_rays import MICRO_LENSES, compare_distances, real_camera
from plenofir_studies.thesis_tables import load_table
from plenofir_studies.tracing import trace_to_object

_WAVELENGTHS_NM = np.linspace(400, 700, 301)
# Border of the depth of field, its name and colour.
_BORDERS = ((1, "inner rays", "tab:red"), (0, "central", "k"), (-1, "outer rays", "tab:blue"))
_PANELS = ((13, 2.0), (13, 3.0), (13, 4.0), (11, 4.0), (9, 4.0), (7, 4.0))


def dispersion_picture() -> Image:
    """The micro lenses' glass by its three formulas, and how far they are apart (Fig. 5.1)."""
    figure, (whole, apart) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    cauchy = MICRO_LENS_CAUCHY.index(_WAVELENGTHS_NM)
    for name, formula, style in (
        ("Cauchy, Eq. 5.2", MICRO_LENS_CAUCHY, "-"),
        ("Schott, Eq. 5.5", MICRO_LENS_SCHOTT, "--"),
        ("Sellmeier, Eq. 5.7", MICRO_LENS_SELLMEIER, "-."),
    ):
        index = formula.index(_WAVELENGTHS_NM)
        (line,) = whole.plot(_WAVELENGTHS_NM, index, style, label=name)
        if formula is not MICRO_LENS_CAUCHY:
            apart.plot(
                _WAVELENGTHS_NM, 1e6 * (index - cauchy), style, color=line.get_color(), label=name
            )
    whole.set_ylabel("refractive index")
    apart.set_ylabel("index less Cauchy's / 1e-6")
    for axes in (whole, apart):
        axes.set_xlabel("wavelength / nm")
        axes.legend(fontsize=8)
        axes.grid(alpha=0.3)
    return figure_pixels(figure)


def _draw_meeting(axes: Axes, lens: str, size: int, a: float) -> None:
    """Real rays around a refocused plane and the borders of its depth of field."""
    real = real_camera(lens)
    c = (size - 1) / 2
    position = a * c * MICRO_LENSES.pitch_mm
    traces = {
        border: compare_distances(lens, np.array([a]), size, border=border)
        for border, *_ in _BORDERS
    }
    middle = float(traces[0].real[0])
    places = np.linspace(-16.0, 16.0, 3)
    for border, name, colour in _BORDERS:
        start = position + border * MICRO_LENSES.pitch_mm / 2
        slope = float(traces[border].model.chief_ray_slope(-(c - border / 2), position))
        rays = trace_to_object(
            real.system, [start, -start], [slope, -slope], real.back_focal_distance_mm
        ).rays
        heights = np.array(
            [rays.at(middle + z - real.back_focal_distance_mm)[:, 1] for z in places]
        )
        axes.plot(places, heights, color=colour, linewidth=1, label=[name, ""])
        meeting = float(traces[border].real[0]) - middle
        axes.axvline(meeting, color=colour, linestyle=":", linewidth=0.8)
    axes.set_xlim(places[0], places[-1])
    axes.set_ylim(-0.8, 0.8)
    axes.set_title(f"M = {size}, a = {a:g}: {middle:.1f} mm", fontsize=9)


def meetings_picture(lens: str = "f100") -> Image:
    """Real rays that meet on refocused planes: a varies above, M below (Figs. 5.6, 5.7)."""
    figure, axes = plt.subplots(
        2, 3, figsize=(11, 6), sharex=True, sharey=True, constrained_layout=True
    )
    for panel, (size, a) in zip(axes.ravel(), _PANELS, strict=True):
        _draw_meeting(panel, lens, size, a)
    for panel in axes[1]:
        panel.set_xlabel("from the plane / mm")
    for panel in axes[:, 0]:
        panel.set_ylabel("height / mm")
    axes[0, 0].legend(fontsize=8)
    return figure_pixels(figure)


def distances_picture() -> Image:
    """Predicted distances of Tables 5.5 to 5.7, and the thesis's real rays (Fig. 5.9)."""
    figure, axes = plt.subplots(figsize=(9, 5), constrained_layout=True)
    settings = np.linspace(-1.05, 4, 500)
    styles = {np.inf: "-", 3.0: "--", 1.5: "-."}
    for number, colour in (("5.5", "tab:blue"), ("5.6", "tab:orange"), ("5.7", "tab:green")):
        part = load_table(number).part()
        lens, mla = part.settings.labels["lens"], part.settings.labels["mla"]
        for focus, style in styles.items():
            model = table_model(lens, mla, focus, int(part.settings["micro_image_px"]))
            reach = "inf" if np.isinf(focus) else f"{focus:g} m"
            label = f"{lens}, MLA ({mla}.), d_f = {reach}"
            distances = model.distance(settings).mm / 1000
            axes.plot(settings, distances, style, color=colour, linewidth=1, label=label)
            rows = [row for row in part.rows if row["d_f_m"] == focus]
            traced = [(row["a"], row["simulated_mm"] / 1000) for row in rows]
            axes.plot(*zip(*traced, strict=True), "+", color="0.3")
    axes.plot([], [], "+", color="0.3", label="real rays, as printed")
    axes.set_yscale("log")
    axes.set_ylim(0.1, 50)
    axes.set_xlabel("a")
    axes.set_ylabel("distance from the micro lenses / m")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3, which="both")
    return figure_pixels(figure)


def lens_types_picture(name: str = "raytrix-r12", focus_mm: float = 463.54174) -> Image:
    """Where a focused camera is sharp: blur of its types of micro lenses, and what it resolves."""
    camera = load_camera(name)
    model = RayModel.focused(camera, focus_mm, camera.micro_image_size)
    depths = np.geomspace(1.2, 12, 600)
    settings = setting_of_virtual_depth(model, depths)
    figure, (blurs, ratios) = plt.subplots(2, 1, figsize=(9, 7), constrained_layout=True)
    blurs.axhline(1, color="0.5", linestyle=":", label="a pixel")
    for curve, part in zip(blur_px(model, settings), usable_ranges(model), strict=True):
        (line,) = blurs.plot(depths, curve, label=f"f_s = {part.focal_length_mm:.3f} mm")
        for axes in (blurs, ratios):
            axes.axvspan(*part.depths, color=line.get_color(), alpha=0.15)
    blurs.set(ylabel="blur / pixels", ylim=(0, 8))
    ratios.plot(depths, resolution_ratio(model, settings), "k", label="its sharpest type")
    ratios.plot(depths, np.minimum(1 / depths, 1), "k:", label="pixels alone, 1 / v")
    ratios.set(ylabel="effective resolution ratio", xlabel="virtual depth v", ylim=(0, 0.6))
    distances = ratios.twinx()
    distances.plot(depths, model.distance(settings).mm, color="tab:purple")
    distances.set_ylabel("distance from the micro lenses / mm", color="tab:purple")
    covering = covering_depth(camera.micro_lenses)
    for axes in (blurs, ratios):
        if covering is not None:
            axes.axvline(covering, color="0.4", linestyle="--", label="total covering plane")
        axes.legend(fontsize=8)
        axes.grid(alpha=0.3)
    figure.suptitle(f"{name}, focused to {focus_mm:g} mm; shaded: blur of at most a pixel")
    return figure_pixels(figure)


def depths_of_field_picture() -> Image:
    """Depths of field of Tables 5.5 to 5.7, focused to 3 m, over the focus setting (Fig. 5.10)."""
    figure, axes = plt.subplots(figsize=(9, 5), constrained_layout=True)
    top, focus = 8.0, 3.0
    settings = np.linspace(0, 4, 400)
    for place, (number, colour) in enumerate(
        (("5.5", "tab:blue"), ("5.6", "tab:orange"), ("5.7", "tab:green"))
    ):
        part = load_table(number).part()
        lens, mla = part.settings.labels["lens"], part.settings.labels["mla"]
        model = table_model(lens, mla, focus, int(part.settings["micro_image_px"]))
        planes = model.planes(settings)
        axes.plot(settings, planes.centre.mm / 1000, color=colour, label=f"{lens}, MLA ({mla})")
        # A border at or beyond infinity has no number.
        near, far = (np.nan_to_num(d.mm / 1000, nan=np.inf) for d in (planes.near, planes.far))
        axes.fill_between(
            settings, np.minimum(near, top), np.minimum(far, top), color=colour, alpha=0.15
        )
        for row in part.rows:
            if row["d_f_m"] == focus:
                ends = [row[f"predicted_{name}mm"] / 1000 for name in ("near_", "far_")]
                at = row["a"] + 0.03 * (place - 1)
                axes.plot([at, at], np.minimum(ends, top), color=colour, linewidth=3)
    axes.set_ylim(0, top)
    axes.set_xlabel("a")
    axes.set_ylabel("distance from the micro lenses / m")
    axes.legend(fontsize=8, title="line: plane; band: depth of field; bars: as printed")
    axes.grid(alpha=0.3)
    return figure_pixels(figure)
