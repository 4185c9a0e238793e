# SPDX-License-Identifier: Apache-2.0
"""Error against run time of everything that the project computes, in one picture and one page.

Measured by ``make bench RECORD=1`` and kept in ``data/work_precision.json`` with the machine;
``make docs`` draws the picture and writes the page from that.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from pydantic import BaseModel, ConfigDict
from scipy.spatial import cKDTree

from plenofir.camera.calibration import calibrate
from plenofir.camera.calibration.frames import grey
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK
from plenofir.refocus import ExactArithmetic, refocus
from plenofir_studies import DATA
from plenofir_studies.depth_methods import WAYS, score
from plenofir_studies.depth_scenes import rendered
from plenofir_studies.many_pixels import GRADE, load_placed
from plenofir_studies.methods import Method, hardware, software
from plenofir_studies.precision_report import Field, fields
from plenofir_studies.precision_report import measure as measured_on
from plenofir_studies.ray_report import error_against_run_time
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import machine, table
from plenofir_studies.synthetic import regular_grid, white_image
from plenofir_studies.thesis_benchmark import as_printed
from plenofir_studies.thesis_calibration import thesis_calibration

FILE = DATA / "work_precision.json"
_LEAST_RUNS, _MOST_RUNS, _LEAST_SECONDS = 3, 50, 0.3
# The Fourier slice with the thesis's window.
_DOMINATED = ("window 1.5", "window 2.5", "window 3.5, oversampling 1.25", "window 6")
# Stored products that are drawn: fraction and guard bits.
_STORED = ("F = 0, G = 0", "F = 2, G = 2", "F = 4, G = 4", "F = 8, G = 4")
# Positions at which errors of 0 are drawn, for software and hardware.
_EXACT = (1e-18, 1e-21)
_DEPTH_SCENES = ("pictures", "slopes", "strips")
_SEED = 41

Step = Callable[[], None]


class Point(BaseModel):
    """A way to compute something."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    way: str
    nanoseconds: float  # of processor time for each pixel, plane or micro lens
    error: float | None = None  # against the chapter's reference; None if it computes another thing
    to_object: float | None = None  # of a refocused picture, against the object itself
    hardware: bool = False


class Recorded(BaseModel):
    """What was measured."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    machine: str
    refocusing: dict[str, list[Point]]  # by light field
    rays: list[Point]
    calibration: list[Point]
    depth: list[Point]
    missing: list[str]  # what could not be measured on that machine


def least_seconds(work: Callable[[], object]) -> float:
    """Processor time of a call, the least of several: other work hardly changes it."""
    work()
    best, begin, runs = float("inf"), time.process_time(), 0
    while runs < _LEAST_RUNS or (
        runs < _MOST_RUNS and time.process_time() - begin < _LEAST_SECONDS
    ):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
        runs += 1
    return best


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _ways() -> list[Method]:
    methods = [m for m in software() if not any(text in m.name for text in _DOMINATED)]
    methods.append(Method("thesis's loops, Eq. (6.1)", as_printed))
    if find_spec("cupy") is not None:
        methods.append(Method("refocus on a GPU (CuPy)", _on_gpu))
    return methods


def _on_gpu(raw: Any, m: int, shift: int) -> Any:
    import cupy

    picture = cupy.asnumpy(refocus(cupy.asarray(raw), m, f"{shift}/{m}"))
    cupy.cuda.Device().synchronize()
    return picture


def _refocusing(field: Field, step: Step) -> list[Point]:
    """All ways in software, and the cores at their placed clocks."""
    results = []
    pixels = field.raw.size
    for method in _ways():
        result = measured_on(field, method)
        seconds = least_seconds(partial(method.work, field.raw, field.m, field.shift))
        results.append(
            Point(
                way=method.name,
                nanoseconds=1e9 * seconds / pixels,
                error=_finite(result.rms),
                to_object=_to_object(result.truth_db),
            )
        )
        step()
    for method in hardware():
        stored = not isinstance(method.hardware, ExactArithmetic)
        if stored and not method.name.endswith(_STORED):
            continue
        result = measured_on(field, method)
        for count, placed in load_placed().items():
            if stored and count > 1:
                continue
            name = method.name.removeprefix("core, ")
            results.append(
                Point(
                    way=f"VHDL, {name}, {count} px a clock",
                    nanoseconds=1e3 / (count * placed.fmax_mhz),
                    error=_finite(result.rms),
                    to_object=_to_object(result.truth_db),
                    hardware=True,
                )
            )
    return results


def _to_object(decibel: float) -> float | None:
    return None if np.isnan(decibel) else float(255 / 10 ** (decibel / 20))


def _rays() -> list[Point]:
    return [
        Point(
            way=timing.way,
            nanoseconds=timing.nanoseconds,
            # Real rays are the reference of the paraxial model.
            error=None if timing.way == "real rays" else timing.error,
        )
        for timing in error_against_run_time()
    ]


def _calibration() -> list[Point]:
    """Centres of a white image with 1 % noise: the grid fit, and the thesis's centroids."""
    pitch, shape = 11.03, (1100, 1100)
    grid = regular_grid(shape, pitch, rotation_degrees=0.1)
    white = white_image(shape, grid, noise=0.01, seed=_SEED)
    i, j = np.meshgrid(np.arange(-150, 250), np.arange(-150, 250), indexing="ij")
    truth = grid.centres(i, j).reshape(-1, 2)
    ways: dict[str, Callable[[], np.ndarray]] = {
        "grid fitted to centroids": lambda: calibrate(white).centres,
        "the thesis's centroids": lambda: thesis_calibration(grey(white)).centroids,
    }
    results = []
    for name, way in ways.items():
        centres = way().reshape(-1, 2)
        # Centroids of micro images that are cut by the border are never their middles.
        whole = ((centres > pitch) & (centres < np.array(shape) - 1 - pitch)).all(axis=1)
        centres = centres[whole]
        error = cKDTree(truth).query(centres)[0]
        rms = float(np.sqrt(np.mean(error[error < pitch / 2] ** 2)))
        results.append(
            Point(way=name, nanoseconds=1e9 * least_seconds(way) / len(centres), error=rms)
        )
    return results


def _depth(step: Step) -> list[Point]:
    """Methods for depth: root mean square error of a over some rendered scenes."""
    scenes = [rendered(name) for name in _DEPTH_SCENES]
    results = []
    for name, way in WAYS.items():
        way(scenes[0])
        squares, seconds = [], 0.0
        for truth in scenes:
            start = time.process_time()
            disparity = way(truth)
            seconds += time.process_time() - start
            squares.append(score(disparity, truth).mse / 100)
        lenses = sum(truth.a.size for truth in scenes)
        rms = float(np.sqrt(np.mean(squares)))
        results.append(Point(way=name, nanoseconds=1e9 * seconds / lenses, error=rms))
        step()
    return results


def measure(step: Step = lambda: None) -> Recorded:
    """Measure everything; `step` is called now and then."""
    refocusing = {field.name: _refocusing(field, step) for field in fields()}
    return Recorded(
        machine=machine(),
        refocusing=refocusing,
        rays=_rays(),
        calibration=_calibration(),
        depth=_depth(step),
        missing=[] if find_spec("cupy") else ["refocus on a GPU (no CuPy here)"],
    )


def load_recorded() -> Recorded:
    return Recorded.model_validate_json(FILE.read_text())


def save_recorded(recorded: Recorded) -> None:
    save_records(FILE, recorded.model_dump(mode="json"), levels=3)


def front(points: Sequence[Point], error: Callable[[Point], float | None]) -> list[Point]:
    """Points that no other one beats in both time and error (Pareto front)."""
    kept: list[Point] = []
    pairs = [(p.nanoseconds, e, p) for p in points if (e := error(p)) is not None]
    for _, value, point in sorted(pairs, key=lambda one: one[:2]):
        last = error(kept[-1]) if kept else None
        if last is None or value < last:
            kept.append(point)
    return kept


def _draw(
    axes: Axes,
    points: Sequence[Point],
    error: Callable[[Point], float | None],
    rows: tuple[float, float] = (1e-17, 1e-17),
    names: dict[str, str] | None = None,
) -> None:
    """A panel: software and hardware, the front as a line.

    Errors of 0 lie in a row of their own below: software's, and the hardware's.
    """

    def height(point: Point) -> float:
        value = error(point)
        assert value is not None
        return value or rows[point.hardware]

    drawn = [p for p in points if error(p) is not None]
    for hard, style, colour in ((False, "o", "tab:blue"), (True, "s", "tab:orange")):
        group = [p for p in drawn if p.hardware == hard]
        axes.loglog(
            [p.nanoseconds for p in group], [height(p) for p in group], style, color=colour,
            markersize=5, label=_KINDS[hard],
        )  # fmt: skip
    best = front(drawn, error)
    axes.loglog(
        [p.nanoseconds for p in best], [height(p) for p in best], color="0.6", zorder=0, label=_BEST
    )
    middle = np.sqrt(np.prod([f(p.nanoseconds for p in drawn) for f in (min, max)]))
    for p in drawn:
        text = p.way if names is None else names.get(p.way, "")
        x, y, vertical, horizontal = 5, 3, "bottom", "left"
        if error(p) == 0 and p.hardware:
            x, y, vertical, horizontal = 0, -5, "top", "center"
        elif error(p) and not p.hardware and p.nanoseconds > middle:
            x, y, vertical, horizontal = -4, -3, "top", "right"
        axes.annotate(
            text, (p.nanoseconds, height(p)), xytext=(x, y), textcoords="offset points",
            fontsize=7, va=vertical, ha=horizontal,
        )  # fmt: skip
    axes.margins(0.3 if names is None else 0.12, 0.3 if names is None else 0.12)
    for line in (axes.xaxis, axes.yaxis):
        line.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3)


_KINDS = ("software, one core", "VHDL, at the clock placed on an ECP5")
_BEST = "no other way is both faster and nearer"
_NAMES = {
    "refocus": "refocus",
    "NumPy, separable int32": "NumPy int32",
    "running sums, float32": "running sums f32",
    "running sums, float64": "running sums f64",
    "shift and sum, float32": "shift and sum f32",
    "shift and sum, float64": "shift and sum f64",
    "thesis's loops, Eq. (6.1)": "reference, thesis's loops",
    "refocus on a GPU (CuPy)": "GPU",
    **{f"VHDL, exact, {p} px a clock": str(p) for p in PIXELS_PER_CLOCK},
    f"VHDL, {_STORED[0]}, 1 px a clock": "stored products: F = G = 0, 2, 4",
    f"VHDL, {_STORED[-1]}, 1 px a clock": _STORED[-1],
}
_OBJECT_NAMES = {
    "best picture": "best picture",
    "refocus": "nearest: refocus, NumPy, all VHDL",
    "refocus, linear": "linear",
    "refocus, sharpened": "sharpened",
    "refocus, linear, sharpened": "linear, sharpened",
    "refocus, cubic": "cubic",
    "shift and sum, linear": "views, linear",
    "shift and sum, cubic": "views, spline",
    "Fourier slice, window 3.5, oversampling 2": "Fourier slice",
}


def picture(recorded: Recorded) -> Figure:
    """Error against run time: refocusing, ray model, calibration, depth."""
    first = next(iter(recorded.refocusing.values()))
    figure = plt.figure(figsize=(12, 8.5), constrained_layout=True)
    grid = figure.add_gridspec(2, 6, height_ratios=(1.3, 1))
    exact, real = (figure.add_subplot(grid[0, part]) for part in (slice(0, 3), slice(3, 6)))
    _draw(exact, first, lambda p: p.error, _EXACT, _NAMES)
    exact.set(title="refocusing, against the exact value", ylabel="RMS error / grey levels")
    powers = range(-15, 1, 3)
    exact.set_yticks(
        [*_EXACT, *(10.0**n for n in powers)],
        ["exact", "exact, P =", *(f"$10^{{{n}}}$" for n in powers)],
    )
    exact.legend(fontsize=7, loc="upper left")
    _draw(real, first, lambda p: p.to_object, names=_OBJECT_NAMES)
    real.set(title="refocusing, against the object itself", yscale="linear", ylim=(0, None))
    for axes in (exact, real):
        axes.set_xlabel("nanoseconds for each pixel")
    small = [figure.add_subplot(grid[1, slice(2 * n, 2 * n + 2)]) for n in range(3)]
    for axes, points, title, unit, per in (
        (small[0], recorded.rays, "ray model", "relative error", "plane"),
        (small[1], recorded.calibration, "calibration", "RMS error / pixels", "micro lens"),
        (small[2], recorded.depth, "depth", "RMS error of a", "micro lens"),
    ):
        _draw(axes, points, lambda p: p.error)
        axes.set(title=title, xlabel=f"nanoseconds for each {per}", ylabel=unit)
    small[2].set(yscale="linear", ylim=(0, None))
    return figure


def _rows(points: Sequence[Point], *columns: Callable[[Point], float | None]) -> list[list[str]]:
    fronts = [{p.way for p in front(points, column)} for column in columns]
    rows = []
    for p in sorted(points, key=lambda p: p.nanoseconds):
        row = [p.way, f"{p.nanoseconds:.3g}"]
        for column, best in zip(columns, fronts, strict=True):
            value = column(p)
            text = "" if value is None else "0" if value == 0 else f"{value:.2g}"
            row.append(f"**{text}**" if text and p.way in best else text)
        rows.append(row)
    return rows


def page(recorded: Recorded) -> str:
    """The part of a page with all numbers; what no other way beats in time and error is bold."""
    lines = [
        f"Measured by `make bench RECORD=1` on {recorded.machine}: processor time, the least of "
        f"several runs. The VHDL's are those of the core of `video-m11` at the clocks that nextpnr "
        f"reached on an ECP5 of grade {GRADE}; stored products were not placed and are set at the "
        "clock of one pixel. Bold: no other way is both faster and nearer.",
        "",
    ]
    if recorded.missing:
        lines += [f"Not measured there: {', '.join(recorded.missing)}.", ""]
    for name, points in recorded.refocusing.items():
        has_objects = any(p.to_object is not None for p in points)
        columns: list[Callable[[Point], float | None]] = [lambda p: p.error]
        heads = ["way", "ns a pixel", "RMS error against the exact value / grey levels"]
        if has_objects:
            columns.append(lambda p: p.to_object)
            heads.append("against the object")
        lines += [f"### Refocusing: {name}", "", *table(heads, _rows(points, *columns))]
    for title, points, heads in (
        ("Ray model", recorded.rays, ["way", "ns a plane", "largest relative error"]),
        ("Calibration", recorded.calibration, ["way", "ns a micro lens", "RMS error / pixels"]),
        ("Depth", recorded.depth, ["way", "ns a micro lens", "RMS error of a"]),
    ):
        lines += [f"### {title}", "", *table(heads, _rows(points, lambda p: p.error))]
    return "\n".join(lines).rstrip()
