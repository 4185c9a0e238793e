# SPDX-License-Identifier: Apache-2.0
"""The work-precision report: error over run time for every way to refocus, Markdown and figures."""

import textwrap
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
from scipy import ndimage

from plenofir import project
from plenofir.camera.lightfield.pictures import figure_pixels
from plenofir.camera.lightfield.stack import sharpness
from plenofir.files import check_folder, publish
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.images import encode_png, read_image
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic, refocus, shift_to_text
from plenofir.refocus.operator import Image
from plenofir_studies.methods import (
    Method,
    exact_sums,
    hardware,
    running_sums,
    shift_and_sum,
    software,
)
from plenofir_studies.report_parts import machine, table

Floats = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]

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
    # the object itself, a value for each micro lens in grey levels; None if it is not known
    truth: Floats | None


@dataclass(frozen=True)
class Result:
    """What a method does on a light field."""

    method: Method
    seconds: float  # median run time of a slice; for hardware its clocks at `PIXEL_CLOCK_HZ`
    # distance from the exact value in grey levels, beyond the correct rounding where the result
    # is rounded; nan where the method computes something else
    largest: float
    rms: float
    truth_db: float  # PSNR against the object itself; nan if that is not known
    sharp: float  # sharpness divided by the object's own; nan if that is not known
    # memory for line buffers and ROMs, and bits of the adders, of which each takes a LUT
    ram_bits: int = 0
    adder_bits: int = 0


def plane_field(m: int, shift: int, lenses: tuple[int, int], seed: int = 0) -> Field:
    """Light field of a textured plane that is in focus at a' = shift."""
    # A point x is at micro lens x - a (u - c) in view u.
    margin = int(np.ceil(abs(shift) / m * (m - 1) / 2)) + 4
    shape = [n + 2 * margin for n in lenses]
    noise = np.random.default_rng(seed).normal(size=shape)
    # Most of it below a quarter of a cycle each micro lens: what a lens would let through.
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
    truth = texture[margin : margin + lenses[0], margin : margin + lenses[1]]
    name = f"textured plane, M = {m}, a = {shift_to_text(shift, m)}"
    return Field(name, np.clip(np.rint(raw), 0, 255).astype(np.uint8), m, shift, truth)


def fields() -> list[Field]:
    """Real and synthetic light fields."""
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
    return core.array_frame_clocks(columns, rows), ram, core.taps * sum(widths)


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
        # Near the borders views are missing, and methods differ in what they take for them.
        margin = int(np.ceil(abs(shift) / m * (m - 1) / 2)) + 2
    else:
        margin = 0
    comparable = method.order is not None or shift % m == 0
    error = (values - exact)[margin : exact.shape[0] - margin, margin : exact.shape[1] - margin]
    largest = float(np.abs(error).max()) if comparable else float("nan")
    rms = float(np.sqrt(np.mean(error**2))) if comparable else float("nan")
    truth_db = sharp = float("nan")
    if field.truth is not None:
        lenses = image if method.lenses else image[middle::m, middle::m]
        border = int(np.ceil(abs(shift) / m * (m - 1) / 2)) + 4
        inside = slice(border, rows - border), slice(border, columns - border)
        got, want = lenses[inside].astype(np.float64), field.truth[inside]
        truth_db = 20 * log10(255 / float(np.sqrt(np.mean((got - want) ** 2))))
        sharp = sharpness(got) / sharpness(want)
    if method.hardware is not None:
        clocks, ram, adders = _cost(field, method.hardware)
        return Result(method, clocks / PIXEL_CLOCK_HZ, largest, rms, truth_db, sharp, ram, adders)
    seconds = median_seconds(lambda: method.work(field.raw, m, shift))
    return Result(method, seconds, largest, rms, truth_db, sharp)


def measure_all(
    field: Field, methods: Sequence[Method], step: Callable[[int], None] | None = None
) -> tuple[list[Result], list[str]]:
    """Run several methods on a light field."""
    results: list[Result] = []
    left_out: list[str] = []
    for done, method in enumerate(methods, 1):
        try:
            results.append(measure(field, method))
        except Exception as failure:
            if not method.peer:
                raise
            why = textwrap.shorten(str(failure), 120)
            left_out.append(f"{method.name} does not run on {field.name}: {why}")
        if step is not None:
            step(done)
    return results, left_out


def pareto(results: Sequence[Result], error: Callable[[Result], float]) -> list[Result]:
    """Results that no other one beats in both time and error."""
    front: list[Result] = []
    candidates = [r for r in results if not np.isnan(error(r))]
    for result in sorted(candidates, key=lambda r: (r.seconds, error(r))):
        if not front or error(result) < error(front[-1]):
            front.append(result)
    return front


def _picture(field: Field, results: Sequence[Result]) -> Image:
    measures: list[tuple[str, Callable[[Result], float]]] = [
        ("RMS error against the exact value / grey levels", lambda r: max(r.rms, _FLOOR))
    ]
    if field.truth is not None:
        measures.append(
            ("RMS error against the object / grey levels", lambda r: 255 / 10 ** (r.truth_db / 20))
        )
    figure, panels = plt.subplots(
        1, len(measures), figsize=(7 * len(measures), 5.5), constrained_layout=True, squeeze=False
    )
    for axes, (label, error) in zip(panels[0], measures, strict=True):
        for kind, marker, colour in ((False, "o", "tab:blue"), (True, "s", "tab:orange")):
            group = [r for r in results if (r.method.hardware is not None) == kind]
            axes.loglog(
                [1e3 * r.seconds for r in group],
                [error(r) for r in group],
                marker,
                color=colour,
                label="core at 74.25 MHz" if kind else "software",
            )
        front = pareto([r for r in results if r.method.hardware is None], error)
        axes.loglog(
            [1e3 * r.seconds for r in front],
            [error(r) for r in front],
            "-",
            color="tab:blue",
            label="Pareto front of the software",
        )
        for result in results:
            if result.method.hardware is None and not np.isnan(error(result)):
                axes.annotate(
                    result.method.name,
                    (1e3 * result.seconds, error(result)),
                    fontsize=6,
                    xytext=(3, 3),
                    textcoords="offset points",
                )
        axes.set(xlabel="run time of a slice / ms", ylabel=label)
        axes.grid(True, which="major", alpha=0.3)
        axes.legend(fontsize=7)
    figure.suptitle(f"{field.name} (errors of 0 are drawn at the bottom)", fontsize=10)
    return figure_pixels(figure)


def _cell(value: float, form: str = ".2g") -> str:
    return "-" if np.isnan(value) else ("0" if value == 0 else format(value, form))


def _psnr(rms: float) -> str:
    if np.isnan(rms):
        return "-"
    return "exact" if rms == 0 else f"{20 * log10(255 / rms):.1f}"


def _tables(field: Field, results: Sequence[Result]) -> list[str]:
    base = results[0].seconds
    fastest = {r.method.name for r in pareto(results, lambda r: r.rms)}
    heads = ["method", "ms", "relative", "largest error", "RMS", "PSNR / dB"]
    heads += ["PSNR to the object / dB", "sharpness", "Pareto"]
    lines = table(
        heads,
        [
            [
                r.method.name,
                f"{1e3 * r.seconds:.3g}",
                f"{r.seconds / base:.2g}",
                _cell(r.largest),
                _cell(r.rms),
                _psnr(r.rms),
                _cell(r.truth_db, ".1f"),
                _cell(r.sharp, ".3f"),
                "yes" if r.method.name in fastest else "",
            ]
            for r in results
            if r.method.hardware is None
        ],
    )
    lines += table(
        ["core", "ms", "largest error", "RMS", "PSNR / dB", "memory / bit", "adder bits (LUTs)"],
        [
            [
                r.method.name,
                f"{1e3 * r.seconds:.3g}",
                _cell(r.largest),
                _cell(r.rms),
                _psnr(r.rms),
                str(r.ram_bits),
                str(r.adder_bits),
            ]
            for r in results
            if r.method.hardware is not None
        ],
    )
    return lines


def _growth() -> tuple[list[str], Image]:
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
    lines = ["## Growth", "", "Milliseconds, and the largest error in grey levels.", ""]
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
        for panel, what in zip(panels[:, column], ("ms", "largest error"), strict=True):
            panel.set(yscale="log", xlabel=label, ylabel=what)
            if label[0] != "a":
                panel.set_xscale("log")
            panel.grid(True, alpha=0.3)
        panels[0, column].legend(fontsize=7)
        lines += table([label, *ways], rows)
    return lines, figure_pixels(figure)


def _advice(chosen: Sequence[Field], everything: dict[str, list[Result]]) -> str:
    """One paragraph from the numbers."""

    def times(names: Sequence[str]) -> str:
        ratios = [
            r.seconds / results[0].seconds
            for results in everything.values()
            for r in results
            if any(r.method.name.startswith(name) for name in names)
        ]
        return f"{min(ratios):.2g} to {max(ratios):.2g}"

    stored = [
        r
        for results in everything.values()
        for r in results
        if isinstance(r.method.hardware, StoredProductArithmetic)
    ]
    names = dict.fromkeys(r.method.name for r in stored)
    worst = {n: max(r.largest for r in stored if r.method.name == n) for n in names}
    near = next((n for n, error in worst.items() if error <= 1), "stored products")
    between = [
        r
        for field in chosen
        if field.truth is not None and field.shift % field.m
        for r in everything[field.name]
    ]
    best = max((r for r in between if r.method.lenses), key=lambda r: r.truth_db)
    own = next(r for r in between if r.method.name == "refocus")
    return (
        "For pictures take `refocus`: it is exact. The other exact ways, the reference and "
        f"separable integers in NumPy, took {times(['reference', 'NumPy'])} times as long here, "
        f"running sums in floating point {times(['running'])} times and sums of shifted views in "
        f"floating point {times(['shift and sum, float'])} times, without being exact; linear and "
        f"cubic interpolation of `refocus` took {times(['refocus, '])} times. If there is to be "
        "one pixel for each micro lens at a setting between integers, band-limited interpolation "
        f"of the views comes nearest to the object ({best.method.name}: {best.truth_db:.1f} dB, "
        f"`refocus`: {own.truth_db:.1f} dB), at {best.seconds / own.seconds:.2g} times the time. "
        "In the core exact arithmetic needs no ROM; where its wide sums are too dear, "
        f"{near} is the smallest setting of stored products that was never off by more than one "
        "grey level."
    )


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Measure everything and write ``precision.md`` with its figures."""
    check_folder(folder, str(folder), ["precision.md"])
    chosen = fields()
    methods = [*software(), *hardware()]
    total = len(chosen) * len(methods) + 1
    everything: dict[str, list[Result]] = {}
    left_out: list[str] = []
    for number, field in enumerate(chosen):

        def step(done: int, start: int = number * len(methods)) -> None:
            if progress is not None:
                progress(start + done, total)

        everything[field.name], failed = measure_all(field, methods, step)
        left_out += failed
    growth, growth_picture = _growth()
    if progress is not None:
        progress(total, total)
    lines = [
        "# Error against run time",
        "",
        _advice(chosen, everything),
        "",
        f"Measured on: {machine()}. Run times are medians of one run; errors are distances from "
        "the operator's value, integer sums and one division. Where a result is rounded to grey "
        "levels, they are what it is off beyond the correct rounding. Errors against the object "
        "compare with the texture that a synthetic light field was made from, a value for each "
        "micro lens, as is the sharpness (1: as sharp as the object).",
        "",
        *(f"{line}\n" for line in left_out),
    ]
    pictures = {}
    for number, field in enumerate(chosen, 1):
        name = f"precision_{number}.png"
        pictures[name] = encode_png(_picture(field, everything[field.name]))
        rows, columns = field.raw.shape
        lines += [f"## {field.name} ({columns} x {rows})", "", f"![]({name})", ""]
        lines += _tables(field, everything[field.name])
    pictures["precision_growth.png"] = encode_png(growth_picture)
    lines += [*growth, "![](precision_growth.png)", ""]
    publish({**pictures, "precision.md": "\n".join(lines)}, folder)
    return folder / "precision.md"
