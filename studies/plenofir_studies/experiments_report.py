# SPDX-License-Identifier: Apache-2.0
"""The thesis's experiments with a camera (section 5.3), as a part of the report on calibration."""

from collections.abc import Mapping

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from plenofir.camera.plots import Floats, figure_pixels, sharpness_picture
from plenofir.refocus.operator import Image
from plenofir_studies.experiments import (
    FIGURE_OBJECT_LENSES,
    FIGURES,
    FOCUS_MM,
    DisparityExperiment,
    Focused,
    disparity_experiment,
    focus_experiment,
    model_of,
    placed,
    random_distances,
    range_experiment,
)
from plenofir_studies.report_parts import Report
from plenofir_studies.thesis_tables import load_table

STEPS = 6
_SEED = 1
_PARTS = {"a": 9, "b": 11, "c": 11}
"""Parts of Table 5.10 with their M."""
_TABLES = {"5.17": ("5.11", "b"), "5.18": ("5.12", "c")}
"""Figures with their table, and the part of Table 5.10 that has their focus."""


def disparity_picture(view: Floats, maps: Mapping[str, Floats]) -> Image:
    """A view, and below it maps of disparities in pixels with their scales (Figs. 5.17, 5.18)."""
    rows, columns = view.shape
    width, count = 8.0, 1 + len(maps)
    height = count * min(max(width * rows / columns, 1.2), 8.0)
    figure, axes = plt.subplots(count, 1, figsize=(width, height), constrained_layout=True)
    axes[0].imshow(view, cmap="gray")
    for part, (name, disparities) in zip(axes[1:], maps.items(), strict=True):
        image = part.imshow(disparities, cmap="viridis")
        part.set_title(name, fontsize=9)
        figure.colorbar(image, ax=part, label="pixels")
    for part in axes:
        part.set_axis_off()
    return figure_pixels(figure)


def _focused(part: str) -> list[Focused]:
    """The thesis's objects and markers of a part of Table 5.10, swept."""
    model = model_of(_PARTS[part], FOCUS_MM[part])
    return focus_experiment(model, [float(d) for d in model.distance(placed(part)).mm])


def _curves(results: list[Focused]) -> Image:
    names = {f"{r.distance_mm / 10:.0f} cm": r for r in results}
    return sharpness_picture(
        [float(a) for a in results[0].settings],
        {name: r.curve for name, r in names.items()},
        {name: r.predicted for name, r in names.items()},
    )


def sharpness_pictures() -> Image:
    """The three plots of Fig. 5.16, one above the other."""
    return np.vstack([_curves(_focused(part)) for part in _PARTS])


def disparity_maps(figure: str) -> tuple[DisparityExperiment, Image]:
    """Fig. 5.17 or 5.18: views at the thesis's distances, measured and drawn."""
    number, part = _TABLES[figure]
    depths = [10 * row["distance_cm"] for row in load_table(number).part("a").rows]
    pairs = FIGURES[figure]
    model = model_of(11, FOCUS_MM[part])
    experiment = disparity_experiment(model, depths, pairs, object_lenses=FIGURE_OBJECT_LENSES)
    maps = {f"G = {pair.gap}, {pair.name}": experiment.maps[pair] for pair in pairs}
    return experiment, disparity_picture(experiment.central_view, maps)


def _focus(report: Report) -> None:
    report.say(
        "## Objects at predicted distances",
        "The thesis's experiment (Fig. 5.16, Table 5.10) with the synthetic camera: textured "
        "objects at the distances that the ray model predicts for the slices of the thesis's "
        "objects and markers, captured (pitch 14.27 pixels, rotated by 0.3 degree, 1 % noise), "
        "calibrated, decoded, and refocused to many settings. The camera renders by the ray model, "
        "so this tests the capture and the search, not the model (`plenofir report pictures` "
        "does). (c) is focused to 4 m, as its table is; the figure's caption says 404 cm. "
        "Distances are from the micro lenses; the last column compares the distance of the "
        "sharpest setting, interpolated between slices.",
    )
    rows = []
    for part, m in _PARTS.items():
        results = _focused(part)
        rows += [
            (
                f"5.10{part}",
                f"{round(r.predicted * m)}/{m}",
                f"{r.distance_mm / 10:.1f}",
                f"{round(r.best * m)}/{m}",
                f"{r.found * m:.2f}/{m}",
                f"{r.error_percent:+.2f} %",
            )
            for r in results
        ]
        report.picture(f"sharpness_{part}", _curves(results), f"Sharpness, Table 5.10{part}")
        report.step()
    heads = ["table", "predicted a", "distance / cm", "sharpest slice", "peak", "error of distance"]
    report.table(heads, rows)


def _disparity(report: Report) -> None:
    report.say(
        "## Baselines and tilts",
        "Disparities between two views at the thesis's distances, with the windows of Figs. 5.17 "
        "and 5.18, and what follows from them (Eqs. 5.24, 5.25; Tables 5.11, 5.12). Both pairs of "
        "gap 4 give the same baseline and tilt: the virtual cameras are evenly spaced.",
    )
    rows = []
    for figure, (number, part) in _TABLES.items():
        model = model_of(11, FOCUS_MM[part])
        experiment, picture = disparity_maps(figure)
        for r in experiment.objects:
            tilt = -float(model.tilt(r.pair.gap, r.pair.first))
            base = float(model.baseline(r.pair.gap))
            rows.append(
                (
                    number,
                    r.pair.name,
                    f"{r.depth_mm / 10:.0f}",
                    f"{r.predicted_px:z.3f} / {r.found_px:z.3f}",
                    f"{base:.4f} / {r.baseline_mm:.4f}",
                    f"{100 * (r.baseline_mm / base - 1):+.2f} %",
                    f"{tilt:z.4f} / {r.tilt_degrees:z.4f}",
                )
            )
        text = f"Central view and disparity maps, Fig. {figure}"
        report.picture(f"disparity_{figure.replace('.', '_')}", picture, text)
        report.step()
    heads = ["table", "pair", "Z / cm", "disparity: predicted / found", "baseline / mm: the same"]
    report.table([*heads, "error", "tilt / degrees: the same"], rows)


def _ranges(report: Report) -> None:
    report.say(
        "## Objects anywhere",
        f"Objects at random distances (seed {_SEED}), M = 11, focus at infinity: what depth map "
        "and sharpest slice say.",
    )
    model = model_of(11)
    ranged = range_experiment(model, random_distances(model, 12, _SEED), seed=_SEED)
    rows = []
    for r in sorted(ranged, key=lambda r: r.distance_mm):
        row = [f"{r.distance_mm:.0f}"]
        for mm in (r.by_disparity_mm, r.by_focus_mm):
            row += [f"{mm:.0f}", f"{100 * (mm / r.distance_mm - 1):+.2f} %"]
        rows.append(row)
    report.step()
    report.table(["distance / mm", "by disparity", "error", "by focus", "error"], rows)


def experiments(report: Report) -> None:
    """Do the experiments, in `STEPS` steps."""
    _focus(report)
    _disparity(report)
    _ranges(report)
