# SPDX-License-Identifier: Apache-2.0
"""The work-precision report: error over run time for every way to refocus, Markdown and figures."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import log10
from pathlib import Path
from statistics import median
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import ndimage

from plenofir.camera.lightfield.stack import sharpness
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic, refocus, shift_to_text
from plenofir.refocus.operator import Image
from plenofir_studies.clock_counts import array_frame_clocks
from plenofir_studies.methods import (
    Method,
    exact_sums,
    hardware,
    running_sums,
    shift_and_sum,
    software,
)
from plenofir_studies.report_parts import Columns, Progress, Report, machine
from plenofir_studies.resolution import enlarged

Floats = npt.NDArray[np.float64]
PIXEL_CLOCK_HZ = 74.25e6
_FLOOR = 1e-16
_LEAST_SECONDS = 0.2


@dataclass(frozen=True)
class Field:
    """A light field to compare on."""

    name: str  # name for the report
    raw: Image  # grey raw image
    # M, and the a' in which the object is in focus
    m: int
    shift: int
    # the object itself at each pixel, in grey levels; None if it is not known
    truth: Floats | None


@dataclass(frozen=True)
class Result:
    """Result of a method on a light field."""

    method: Method
    seconds: float  # median run time of a slice; for hardware its clocks at `PIXEL_CLOCK_HZ`
    # error in grey levels, beyond correct rounding if the result is rounded; nan if the method
    # computes something else
    largest: float
    rms: float
    truth_db: float  # PSNR of all pixels against the object; nan if that is not known
    sharp: float  # sharpness divided by the object's own; nan if that is not known
    # memory for line buffers and ROMs; bits of the adders, one LUT each
    ram_bits: int = 0
    adder_bits: int = 0


def plane_field(m: int, shift: int, lenses: tuple[int, int], seed: int = 0) -> Field:
    """Light field of a textured plane that is in focus at a' = shift."""
    # A point x is at micro lens x - a (u - c) in view u.
    margin = int(np.ceil(abs(shift) / m * (m - 1) / 2)) + 4
    shape = [n + 2 * margin for n in lenses]
    noise = np.random.default_rng(seed).normal(size=shape)
    # Mostly below a quarter of a cycle per micro lens, as lenses limit the resolution.
    texture = ndimage.gaussian_filter(noise, 0.9)
    texture = np.clip(128 + 45 * texture / texture.std(), 5, 250)
    a, c = shift / m, (m - 1) / 2
    raw = np.empty((lenses[0] * m, lenses[1] * m))
    for v in range(m):
        for u in range(m):
            y = np.arange(lenses[0]) + margin + a * (v - c)
            x = np.arange(lenses[1]) + margin + a * (u - c)
            place = np.stack(np.meshgrid(y, x, indexing="ij"))
            raw[v::m, u::m] = ndimage.map_coordinates(texture, place, order=3)
    at_pixels = [margin + (np.arange(n * m) - c) / m for n in lenses]
    place = np.stack(np.meshgrid(*at_pixels, indexing="ij"))
    truth = ndimage.map_coordinates(texture, place, order=3)
    name = f"textured plane, M = {m}, a = {shift_to_text(shift, m)}"
    return Field(name, np.clip(np.rint(raw), 0, 255).astype(np.uint8), m, shift, truth)


def fields() -> list[Field]:
    flower = read_image(project.DATA / "flower_5x5.png")
    green = np.ascontiguousarray(flower[..., 1] if flower.ndim == 3 else flower)
    return [
        plane_field(5, 3, (100, 120)),
        plane_field(11, 11, (60, 70)),
        Field("flower, M = 5, a = -3/5", green, 5, -3, None),
    ]


def median_seconds(work: Callable[[], object]) -> float:
    """Median wall time of at least three runs."""
    work()
    times: list[float] = []
    while len(times) < 3 or (sum(times) < _LEAST_SECONDS and len(times) < 50):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return median(times)


def _cost(field: Field, arithmetic: StoredProductArithmetic | ExactArithmetic) -> tuple[int, ...]:
    """Clocks of a frame, bits of memory, bits of adders."""
    rows, columns = field.raw.shape
    core = CoreConfiguration(
        micro_image_size=field.m, shifts=(field.shift,), max_columns=columns, arithmetic=arithmetic
    )
    bits = 8 * field.raw.dtype.itemsize
    ram = core.line_buffer_bits
    if isinstance(arithmetic, StoredProductArithmetic):
        middle = bits + arithmetic.guard_bits
        drop = arithmetic.fraction_bits - arithmetic.guard_bits
        for address, scale in ((bits, arithmetic.fraction_bits), (middle, drop)):
            product = (((1 << address) - 1 << scale) + field.m // 2) // field.m
            ram += product.bit_length() << address
        widths = [arithmetic.largest_sum(field.m, bits).bit_length()] * 2
    else:
        widths = [(field.m * ((1 << bits) - 1)).bit_length()]
        widths.append(arithmetic.largest_sum(field.m, bits).bit_length())
    return array_frame_clocks(core, columns, rows), ram, core.taps * sum(widths)


def measure(field: Field, method: Method) -> Result:
    """Run a method on a light field."""
    m, shift = field.m, field.shift
    image = method.work(field.raw, m, shift)
    exact = exact_sums(field.raw, m, shift, method.order or 0)
    if np.issubdtype(image.dtype, np.integer):
        exact = np.floor(exact + 0.5)
    values = image.astype(np.longdouble)
    middle = m // 2
    rows, columns = field.raw.shape[0] // m, field.raw.shape[1] // m
    if method.lenses:
        exact = exact[middle::m, middle::m][:rows, :columns]
        # Near the borders views are missing, which methods treat differently.
        margin = int(np.ceil(abs(shift) / m * (m - 1) / 2)) + 2
    else:
        margin = 0
    comparable = method.order is not None
    error = (values - exact)[margin : exact.shape[0] - margin, margin : exact.shape[1] - margin]
    largest = float(np.abs(error).max()) if comparable else float("nan")
    rms = float(np.sqrt(np.mean(error**2))) if comparable else float("nan")
    truth_db = sharp = float("nan")
    if field.truth is not None:
        border = m * (int(np.ceil(abs(shift) / m * (m - 1) / 2)) + 4)
        inside = slice(border, rows * m - border), slice(border, columns * m - border)
        # People see what splines make of a value for each micro lens.
        whole = enlarged(image.astype(np.float64), m, 3) if method.lenses else image
        got, want = whole[inside].astype(np.float64), field.truth[inside]
        truth_db = 20 * log10(255 / float(np.sqrt(np.mean((got - want) ** 2))))
        sharp = sharpness(got, m) / sharpness(want, m)
    if method.hardware is not None:
        clocks, ram, adders = _cost(field, method.hardware)
        return Result(method, clocks / PIXEL_CLOCK_HZ, largest, rms, truth_db, sharp, ram, adders)
    seconds = median_seconds(lambda: method.work(field.raw, m, shift))
    return Result(method, seconds, largest, rms, truth_db, sharp)


def pareto(results: Sequence[Result], error: Callable[[Result], float]) -> list[Result]:
    """Results that no other one beats in both time and error (Pareto front)."""
    front: list[Result] = []
    candidates = [r for r in results if not np.isnan(error(r))]
    for result in sorted(candidates, key=lambda r: (r.seconds, error(r))):
        if not front or error(result) < error(front[-1]):
            front.append(result)
    return front


def _draw(axes: Axes, results: Sequence[Result], error: Callable[[Result], float]) -> None:
    software = [r for r in results if r.method.hardware is None]
    core = [r for r in results if r.method.hardware is not None]
    for group, style, colour, label in (
        (software, "o", "tab:blue", "software"),
        (core, "s", "tab:orange", "core at 74.25 MHz"),
        (pareto(software, error), "-", "tab:blue", "Pareto front of the software"),
    ):
        places = [1e3 * r.seconds for r in group]
        axes.loglog(places, [error(r) for r in group], style, color=colour, label=label)
    for r in software:
        if not np.isnan(error(r)):
            place = 1e3 * r.seconds, error(r)
            axes.annotate(
                r.method.name, place, fontsize=6, xytext=(3, 3), textcoords="offset points"
            )
    axes.set_xlabel("run time of a slice / ms")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=7)


def _picture(field: Field, results: Sequence[Result]) -> Figure:
    count = 1 if field.truth is None else 2
    figure, panels = plt.subplots(
        1, count, figsize=(7 * count, 5.5), constrained_layout=True, squeeze=False
    )
    _draw(panels[0, 0], results, lambda r: max(r.rms, _FLOOR))
    panels[0, 0].set_ylabel("RMS error against the exact value / grey levels")
    if field.truth is not None:
        _draw(panels[0, 1], results, lambda r: 255 / 10 ** (r.truth_db / 20))
        panels[0, 1].set_ylabel("RMS error against the object / grey levels")
    figure.suptitle(f"{field.name} (errors of 0 are drawn at the bottom)", fontsize=10)
    return figure


def _cell(value: float, form: str = ".2g") -> str:
    return "-" if np.isnan(value) else ("0" if value == 0 else format(value, form))


def _psnr(rms: float) -> str:
    if np.isnan(rms):
        return "-"
    return "exact" if rms == 0 else f"{20 * log10(255 / rms):.1f}"


def _tables(report: Report, results: Sequence[Result]) -> None:
    fastest = pareto(results, lambda r: r.rms)
    milliseconds: Columns = {"ms": lambda r: f"{1e3 * r.seconds:.3g}"}
    errors: Columns = {
        "largest error": lambda r: _cell(r.largest),
        "RMS": lambda r: _cell(r.rms),
        "PSNR / dB": lambda r: _psnr(r.rms),
    }
    report.table_of(
        [r for r in results if r.method.hardware is None],
        {
            "method": "{.method.name}",
            **milliseconds,
            "relative": lambda r: f"{r.seconds / results[0].seconds:.2g}",
            **errors,
            "PSNR to the object / dB": lambda r: _cell(r.truth_db, ".1f"),
            "sharpness": lambda r: _cell(r.sharp, ".3f"),
            "Pareto": lambda r: "yes" if r in fastest else "",
        },
    )
    report.table_of(
        [r for r in results if r.method.hardware is not None],
        {
            "core": "{.method.name}",
            **milliseconds,
            **errors,
            "memory / bit": "{.ram_bits}",
            "adder bits (LUTs)": "{.adder_bits}",
        },
    )


def _growth(report: Report) -> None:
    """How time and error grow with M, a' and the size of the frame."""
    rng = np.random.default_rng(0)
    ways: dict[str, Callable[[Image, int, int], Any]] = {
        "refocus": lambda raw, m, s: refocus(raw, m, Fraction(s, m)),
        "NumPy, separable int32": lambda raw, m, s: running_sums(raw, m, s, np.int32),
        "running sums, float32": lambda raw, m, s: running_sums(raw, m, s, np.float32),
        "shift and sum, float32": lambda raw, m, s: shift_and_sum(raw, m, s, np.float32),
    }
    sweeps: list[tuple[str, list[tuple[int, int, int]]]] = [
        ("M (a' = 1, 500 x 500)", [(m, 1, 500) for m in (2, 3, 5, 7, 11, 16, 23, 31)]),
        ("a' (M = 11, 500 x 500)", [(11, s, 500) for s in (-22, -9, -3, 1, 4, 7, 13, 24, 33)]),
        ("rows and columns (M = 5, a' = -3)", [(5, -3, n) for n in (100, 200, 400, 800, 1600)]),
    ]
    figure, panels = plt.subplots(2, 3, figsize=(15, 8), constrained_layout=True)
    report.say("## Growth", "Milliseconds, and the largest error in grey levels.")
    for column, (label, cases) in enumerate(sweeps):
        places = [{"M": c[0], "a": c[1], "r": c[2]}[label[0]] for c in cases]
        rows = [[str(place)] for place in places]
        for name, way in ways.items():
            times, errors = [], []
            for (m, shift, size), row in zip(cases, rows, strict=True):
                raw = rng.integers(0, 256, (size, size), dtype=np.uint8)
                if name.startswith("shift") and (m > 16 or size > 800):
                    row.append("-")
                    continue
                image = way(raw, m, shift)
                exact = exact_sums(raw, m, shift)
                if np.issubdtype(image.dtype, np.integer):
                    exact = np.floor(exact + 0.5)
                errors.append(float(np.abs(image - exact).max()))
                times.append(1e3 * median_seconds(lambda w=way, r=raw, m=m, s=shift: w(r, m, s)))  # type: ignore[misc]
                row.append(f"{times[-1]:.3g} ({_cell(errors[-1])})")
            panels[0, column].plot(places[: len(times)], times, ".-", label=name)
            panels[1, column].plot(
                places[: len(times)], np.maximum(errors, _FLOOR), ".-", label=name
            )
        for panel, quantity in zip(panels[:, column], ("ms", "largest error"), strict=True):
            panel.set(yscale="log", xlabel=label, ylabel=quantity)
            if label[0] != "a":
                panel.set_xscale("log")
            panel.grid(True, alpha=0.3)
        panels[0, column].legend(fontsize=7)
        report.table([label, *ways], rows)
    report.picture("precision_growth", figure)


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Measure everything and write ``precision.md`` with its figures."""
    chosen, methods = fields(), [*software(), *hardware()]
    report = Report(folder, "precision.md", len(chosen) * len(methods), progress)
    report.say(
        "# Error against run time",
        f"Measured on: {machine()}. Run times are medians; errors are distances from the "
        "operator's value (integer sums and one division), beyond correct rounding where a result "
        "is rounded to grey levels. Errors against the object compare all pixels with the texture "
        "of a synthetic light field, and so does the sharpness (1: as sharp as the object); a "
        "value for each micro lens is first enlarged by cubic splines.",
    )
    for number, field in enumerate(chosen, 1):
        results = []
        for method in methods:
            results.append(measure(field, method))
            report.step()
        rows, columns = field.raw.shape
        report.say(f"## {field.name} ({columns} x {rows})")
        report.picture(f"precision_{number}", _picture(field, results))
        _tables(report, results)
    _growth(report)
    return report.write()
