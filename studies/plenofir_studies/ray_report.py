# SPDX-License-Identifier: Apache-2.0
"""The report on the ray model: Markdown with figures."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from plenofir.camera.optics.prescription import shipped_lenses
from plenofir.camera.rays.camera import load_camera
from plenofir.camera.rays.model import RayModel
from plenofir_studies import real_tables
from plenofir_studies.errata import ERRATA
from plenofir_studies.intersections import (
    image_side_distance,
    iterated_image_distance,
    object_side_distance,
)
from plenofir_studies.ray_pictures import dispersion_picture, distances_picture, meetings_picture
from plenofir_studies.ray_stability import (
    Outcome,
    _error,
    all_outcomes,
    magnitude,
    oracle_distance,
    oracle_extension,
)
from plenofir_studies.ray_validation import Check, all_checks, rounding_sentences
from plenofir_studies.real_rays import (
    compare_distances,
    compare_virtual_cameras,
    real_camera,
    real_micro_image_centres,
)
from plenofir_studies.report_parts import Report
from plenofir_studies.thesis_tables import load_table

NamedProgress = Callable[[str, int, int], None]
_FLOOR = 1e-17


def _validation(report: Report, checks: list[Check]) -> None:
    report.say(
        "## The thesis's predictions",
        "Every prediction of the thesis's tables, computed anew. A number agrees if it rounds to "
        f"the printed digits. {rounding_sentences()}",
    )
    rows = []
    for name in dict.fromkeys(check.table for check in checks):
        group = [check for check in checks if check.table == name]
        wrong = sum(check.erratum is not None for check in group)
        agree = sum(check.agrees for check in group if not check.erratum)
        rows.append((name, len(group), f"{agree} of {len(group) - wrong}", wrong))
    report.table(["table", "numbers", "agree", "known errata"], rows)
    errata = [ERRATA[key] for key in dict.fromkeys(c.erratum for c in checks if c.erratum)]
    report.add(f"- {erratum.where}: {erratum.holds} (`docs/thesis.md`)" for erratum in errata)
    report.say("", "<details><summary>All numbers</summary>")
    report.table_of(
        checks,
        {
            "table": "{.table}",
            "row": "{.row}",
            "quantity": "{.quantity}",
            "printed": "{.printed.text}",
            "computed": "{.computed:.6f}",
            "": lambda c: "agrees" if c.agrees else ("erratum" if c.erratum else "differs"),
        },
    )
    report.say("</details>")


def _real_rays(report: Report) -> None:
    report.say(
        "## Real rays",
        "The f100 lens of the thesis from its prescription: micro image centres from real chief "
        "rays beside the thesis's simulation.",
    )
    rows = []
    for number in ("5.3", "5.4"):
        part = load_table(number).part("a")
        extension = part.settings["b_u_mm"] - 99.5044
        for row in part.rows:
            position = np.array([row["s_over_p_m"] * 0.125])
            centre = float(real_micro_image_centres("f100", position, extension)[0])
            printed = row.numbers["simulated_mm"]
            cells = [f"{number}a", f"{row['s_over_p_m']:g}", printed.text, f"{centre:.5f}"]
            rows.append([*cells, f"{abs(centre - printed.value):.1e}"])
    report.table(["table", "micro lens", "printed / mm", "traced / mm", "difference"], rows)
    report.say(
        "Refocusing distances predicted by the ray model and found with real rays, M = 13, micro "
        "lenses (II), focus at infinity, 550 nm. The thesis's predictions stay within 0.35 % of "
        "its simulation.",
    )
    settings = np.array([0.5, 1.0, 2.0, 3.0, 4.0])
    figure, axes = plt.subplots(figsize=(8, 4), dpi=110, constrained_layout=True)
    rows = []
    for lens in shipped_lenses():
        found_borders = [compare_distances(lens, settings, 13, border=b) for b in (1, 0, -1)]
        worst = max(float(np.abs(centre.deviation_percent).max()) for centre in found_borders)
        plane = found_borders[1]
        axes.plot(settings, plane.deviation_percent, marker="o", label=lens)
        pairs = zip(plane.predicted, plane.real, strict=True)
        rows.append([lens, *(f"{p:.4f} / {r:.4f}" for p, r in pairs), f"{worst:.3f} %"])
    axes.set(xlabel="a", ylabel="(predicted - real) / predicted in percent")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    report.picture("real_rays", figure, "Deviation from real rays")
    heads = ["lens", *(f"a = {a:g}: predicted / real" for a in settings)]
    report.table([*heads, "largest deviation, borders too"], rows)
    report.say(
        "The planes of Tables 5.5 to 5.7 and the virtual cameras of Tables 5.8 and 5.9 through all "
        "lenses, with both micro lens arrays, focused to infinity, 3 m and 1.5 m: the largest "
        "deviations."
    )
    report.add([*real_tables.summary(), ""])
    report.say("<details><summary>Each plane through f100</summary>", "")
    report.add(real_tables.planes_of("f100"))
    report.say("</details>")
    for name, text, picture in (
        ("meetings", "Real rays that meet on refocused planes of f100", meetings_picture),
        ("distances", "Predicted and printed distances", distances_picture),
        ("dispersion", "The micro lenses' glass by its three formulas", dispersion_picture),
    ):
        report.picture(name, picture(), text)


def _virtual_cameras(report: Report) -> None:
    report.say(
        "## Real rays of virtual cameras",
        "Virtual cameras and triangulated distances (section 5.2.3), predicted and found with real "
        "rays: G = 6, i = 0, micro lenses (II), 550 nm. Disparities of 0, 1 and 2 micro lenses for "
        "each view of the gap, as in Table 5.9. Largest deviations in percent; those of the thesis "
        "for its lenses are 0.9 (pupil), 0.14 (baseline), 0.28 (tilt) and 0.33 (distances).",
    )
    rows = []
    for lens in shipped_lenses():
        for focus in (inf, 3000.0, 1500.0):
            extension = RayModel.focused(real_camera(lens).camera, focus, 13).extension_mm
            per_view = (1.0, 2.0) if focus == inf else (0.0, 1.0, 2.0)
            cameras = compare_virtual_cameras(lens, 6, extension_mm=extension, per_view=per_view)
            label = "inf" if focus == inf else f"{focus / 1000:g} m"
            row = [
                lens,
                label,
                f"{cameras.predicted_pupil_mm:.4f} / {cameras.real_pupil_mm:.4f}",
                f"{cameras.predicted_baseline_mm:.4f} / {cameras.real_baseline_mm:.4f}",
                f"{cameras.predicted_tilt_deg:.4f} / {cameras.real_tilt_deg:.4f}",
            ]
            for name in ("pupil", "baseline", "tilt", "depths"):
                percent = np.abs(cameras.deviations_percent[name])
                row.append("" if np.isnan(percent).all() else f"{percent.max():.3f}")
            rows.append(row)
    heads = ["lens", "focus", "pupil / mm", "baseline / mm", "tilt / degrees"]
    report.table([*heads, "pupil / %", "baseline / %", "tilt / %", "distances / %"], rows)


def _stability(report: Report, outcomes: list[Outcome]) -> None:
    report.say(
        "## Numerical stability",
        "Relative errors of the ray model and of the thesis's formulas against an oracle of 700 "
        "digits, worst case of each group. Where there is no distance, the model says so by name "
        '(`infinity`, `beyond infinity`); "no number" means that a formula gave inf or nan, or a '
        "number where there is none.",
    )
    ways = list(dict.fromkeys(way for outcome in outcomes for way in outcome.naive))
    groups = list(dict.fromkeys(outcome.group for outcome in outcomes))
    rows = []
    for group in groups:
        members = [outcome for outcome in outcomes if outcome.group == group]
        row = [group, str(len(members)), magnitude(max(o.error for o in members))]
        for way in ways:
            errors = [o.naive[way] for o in members if way in o.naive]
            row.append(magnitude(max(errors)) if errors else "")
        rows.append(row)

    figure, axes = plt.subplots(figsize=(9, 5), dpi=110, constrained_layout=True)
    for way, marker in (("plenofir", "o"), *zip(ways, "sx^v*", strict=False)):
        offset = 0.15 if way == "plenofir" else -0.1
        points = [
            (min(max(error, _FLOOR), 10.0), groups.index(o.group) + offset)
            for o in outcomes
            if (error := o.error if way == "plenofir" else o.naive.get(way)) is not None
        ]
        axes.plot(*zip(*points, strict=True), marker, label=way, alpha=0.6)
    axes.axvline(1e-12, color="0.5", linestyle=":")
    axes.set(xscale="log", xlabel="relative error (10: no number)")
    axes.set_yticks(range(len(groups)), groups)
    axes.legend(fontsize=8)
    report.picture("stability", figure, "Relative errors")

    report.table(["group", "cases", "plenofir", *ways], rows)
    report.say("<details><summary>All cases</summary>")
    cells = [
        [
            o.group,
            o.case,
            "none" if o.want is None else f"{o.want:.10g}",
            o.state,
            magnitude(o.error),
            *(magnitude(o.naive[way]) if way in o.naive else "" for way in ways),
        ]
        for o in outcomes
    ]
    report.table(["group", "case", "value", "state", "plenofir", *ways], cells)
    report.say("</details>")


@dataclass(frozen=True)
class Timing:
    """Error and run time of one way to the distances of planes."""

    way: str
    # largest relative error against the oracle (for real rays: deviation of the paraxial model)
    error: float
    nanoseconds: float  # run time for each plane of an array
    microseconds_single: float  # run time of a call for one plane


def _median(work: Callable[[], object], runs: int) -> float:
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def error_against_run_time() -> list[Timing]:
    """Measure error and run time of all ways to compute the distance of a plane."""
    # The planes lie between 0.25 m and 100 m; f100 focused to infinity, M = 13.
    camera = load_camera("f100-mla2")
    model = RayModel.focused(camera, inf, 13)
    settings = np.geomspace(
        float(model.focus_setting(100_000.0)), float(model.focus_setting(250.0)), 100_000
    )
    sample = settings[:: len(settings) // 50]
    want = [oracle_distance(model, oracle_extension(1, 0, inf), float(a), 0) for a in sample]
    ways: tuple[tuple[str, Callable[[np.ndarray], np.ndarray]], ...] = (
        ("closed form", lambda a: model.distance(a).mm),
        ("image side", lambda a: image_side_distance(model, a)),
        ("object side", lambda a: object_side_distance(model, a)),
    )
    timings = []
    one = np.array([0.5])
    for name, way in ways:
        error = max(_error(float(got), w) for got, w in zip(way(sample), want, strict=True))
        array = _median(lambda way=way: way(settings), 9) / len(settings)  # type: ignore[misc]
        single = _median(lambda way=way: way(one), 301)  # type: ignore[misc]
        timings.append(Timing(name, error, array * 1e9, single * 1e6))
    traced = compare_distances("f100", settings[:10_000], 13)
    error = float(np.nanmax(np.abs(traced.deviation_percent))) / 100
    array = _median(lambda: compare_distances("f100", settings[:10_000], 13), 3) / 10_000
    single = _median(lambda: compare_distances("f100", np.array([0.5]), 13), 21)
    timings.append(Timing("real rays", error, array * 1e9, single * 1e6))

    lens = camera.main_lens
    f, separation = lens.focal_length_mm, lens.principal_plane_separation_mm
    focuses = np.geomspace(500.0, 1e7, 40)
    exact = [oracle_extension(f, separation, float(d)) for d in focuses]

    def iterated(d: float) -> float:
        return iterated_image_distance(f, separation, d)[0] - f

    def closed(d: float) -> float:
        return RayModel.focused(camera, d, 13).extension_mm

    for name, solve in (("focus, closed form", closed), ("focus, iteration", iterated)):
        error = max(_error(solve(float(d)), e) for d, e in zip(focuses, exact, strict=True))
        single = _median(lambda solve=solve: [solve(float(d)) for d in focuses], 9)  # type: ignore[misc]
        timings.append(Timing(name, error, single / 40 * 1e9, single / 40 * 1e6))
    return timings


def _run_time(report: Report, timings: list[Timing]) -> None:
    report.say(
        "## Error against run time",
        "Planes between 0.25 m and 100 m (f100, infinity focus, M = 13), arrays of 100,000 planes "
        "and calls for one; focus settings from 0.5 m to 10 km, one call each. For real rays the "
        "error is the deviation of the paraxial model from them.",
    )
    figure, axes = plt.subplots(figsize=(8, 4), dpi=110, constrained_layout=True)
    for timing in timings:
        place = timing.nanoseconds, max(timing.error, _FLOOR)
        axes.plot(*place, "o")
        axes.annotate(f"  {timing.way}", place, fontsize=8)
    axes.set(xscale="log", xlabel="run time in nanoseconds for each plane")
    axes.set(yscale="log", ylabel="largest relative error")
    axes.margins(0.2)
    axes.grid(alpha=0.3)
    report.picture("run_time", figure, "Error against run time")
    report.table_of(
        timings,
        {
            "way": "{.way}",
            "largest relative error": "{.error:.1e}",
            "ns a plane": "{.nanoseconds:.0f}",
            "\u00b5s a call": "{.microseconds_single:.0f}",
        },
    )


def write_report(folder: Path, progress: NamedProgress | None = None) -> Path:
    """Write ``report.md`` and its figures, all or none."""
    report = Report(folder, "report.md")
    report.say("# The ray model: validation and stability")
    steps: dict[str, Callable[[], None]] = {
        "the thesis's predictions": lambda: _validation(report, all_checks()),
        "real rays": lambda: _real_rays(report),
        "virtual cameras": lambda: _virtual_cameras(report),
        "numerical stability": lambda: _stability(report, all_outcomes()),
        "error against run time": lambda: _run_time(report, error_against_run_time()),
    }
    for count, (name, step) in enumerate(steps.items()):
        if progress is not None:
            progress(name, count, len(steps))
        step()
    return report.write()
