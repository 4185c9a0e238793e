# SPDX-License-Identifier: Apache-2.0
"""Measure refocuser, ray model, calibration, golden model's forms and simulators, in one run.

Usage: python scripts/bench.py [--record] [FOLDER]

The refocuser is measured in multiples of numpy.copyto, once over a ring of frames that is larger
than any cache and once with one frame (least of many runs, taken in turns), the golden model with
one frame (medians), the simulators in clocks a second and relative to each other.
All of it is written to FOLDER (build/bench) as well, with the machine's description, beside the
reports of error against run time and of stability, and the benchmark of the thesis; --record keeps
the measurements of the latter and of error against run time for `make docs`, and their picture.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress, track
from rich.table import Table

from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.calibration.frames import grey
from plenofir.camera.plots import figure_pixels
from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.simulate.file_bench import run_bench
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.ground.images import encode_png
from plenofir.refocus import (
    ExactArithmetic,
    StoredProductArithmetic,
    first_calls,
    gather_sums,
    moving_sums,
    output_offset,
    refocus,
)
from plenofir.refocus.operator import Image, Sums
from plenofir_studies import (
    gpu_report,
    growth,
    growth_measured,
    precision_report,
    thesis_benchmark,
    work_precision,
)
from plenofir_studies import refocus_stability as stability_report
from plenofir_studies.methods import plain_numba
from plenofir_studies.ray_report import error_against_run_time
from plenofir_studies.report_parts import machine
from plenofir_studies.synthetic import regular_grid, white_image
from plenofir_studies.thesis_calibration import thesis_calibration

RUNS = 5
CASES = ((5, -3), (11, 1), (11, 22))


def median_seconds(work: Callable[[], object], runs: int = RUNS) -> float:
    """Median wall time of several runs."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


Frames = tuple[Image, Image]
"""A frame, and memory for a result."""


_ALONE = ", one thread"


def in_turns(
    works: dict[str, Callable[[Image, Image], object]], ring: list[Frames], rounds: int
) -> dict[str, float]:
    """Least time of each of several works, taken in turns so that load hits all alike.

    Each takes the next frame of the ring. Wall time; of what one thread does processor time, which
    other work on the machine hardly changes.
    """
    times = dict.fromkeys(works, float("inf"))
    turns = cycle(ring)
    for work in works.values():
        work(*ring[0])
    for _ in track(range(rounds), description="refocuser", transient=True):
        for name, work in works.items():
            raw, out = next(turns)
            clock = time.process_time if name.endswith(_ALONE) else time.perf_counter
            start = clock()
            work(raw, out)
            times[name] = min(times[name], clock() - start)
    return times


def first_call() -> tuple[float, float]:
    """Seconds of a first call: of NumPy while loops compile, and of loops that are kept."""
    code = (
        "import time, numpy as np; from plenofir.refocus import refocus; "
        "raw = np.zeros((60, 60), np.uint8); start = time.perf_counter(); "
        "refocus(raw, 11, '1/11'); print(time.perf_counter() - start)"
    )
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        seconds = [
            subprocess.run(
                [sys.executable, "-c", code],
                env=environment,
                check=True,
                capture_output=True,
                text=True,
            ).stdout
            for _ in range(2)
        ]
    return float(seconds[0]), float(seconds[1])


# 24 frames of 8 bit, grey, are larger together than any cache. Wider pixels have as many bytes.
_RING_FRAMES = 24
_SIZE = 3201
_KINDS: tuple[tuple[str, tuple[int, ...], type[np.unsignedinteger[Any]]], ...] = (
    ("grey 8 bit", (), np.uint8),
    ("RGB 8 bit", (3,), np.uint8),
    ("grey 16 bit", (), np.uint16),
    ("RGB 16 bit", (3,), np.uint16),
)
_SOME_SHIFTS = (-22, -21, -9, -3, 0, 1, 4, 7, 11, 13, 22, 27, 32, 33)


def _refocus(m: int, shift: int, **options: Any) -> Callable[[Image, Image], object]:
    a = Fraction(shift, m)
    return lambda raw, out: refocus(raw, m, a, out=out, **options)


def refocuser_works(m: int, shifts: Sequence[int]) -> dict[str, Callable[[Image, Image], object]]:
    """Operations that are compared with a copy of a frame."""
    works: dict[str, Callable[[Image, Image], object]] = {
        "numpy.copyto": lambda raw, out: np.copyto(out, raw),
        f"numpy.copyto{_ALONE}": lambda raw, out: np.copyto(out, raw),
    }
    for shift in shifts:
        works[f"a' = {shift}"] = _refocus(m, shift)
    for shift in (1, 32, m):
        works[f"a' = {shift}{_ALONE}"] = _refocus(m, shift, threads=1)
    options: dict[str, dict[str, Any]] = {
        "normalised border": {"border": "normalise"},
        "linear": {"interpolation": 1},
        "sharpened": {"sharpen": "auto"},
        "box of 3": {"box": 3},
        "box of 3, linear": {"box": 3, "interpolation": 1},
        "box of 3, sharpened": {"box": 3, "sharpen": "1/16"},
    }
    for name, option in options.items():
        works[f"a' = 1, {name}"] = _refocus(m, 1, **option)
        works[f"a' = 1, {name}{_ALONE}"] = _refocus(m, 1, threads=1, **option)
    for other in (2, 3, 5, 8, 16, 21, 33, 99, 400, 1601):
        works[f"M = {other}, a' = 1{_ALONE}"] = _refocus(other, 1, threads=1)
    works["M = 1601, a' = 1601"] = _refocus(1601, 1601)
    part = slice(1000, 1500), slice(1000, 1500)
    works["a' = 1, new memory"] = lambda raw, _: refocus(raw, m, "1/11")
    works["a' = 1, 500 x 500 of it"] = lambda raw, _: refocus(raw, m, "1/11", region=part)
    works["a = 1, a pixel each micro lens"] = lambda raw, _: refocus(raw, m, 1, upsample=False)
    return works


def refocuser_table(
    frames: int = _RING_FRAMES, m: int = 11
) -> tuple[Table, dict[str, dict[str, float]]]:
    """Time the fast refocuser in multiples of numpy.copyto, over a ring of frames."""
    columns: dict[str, dict[str, float]] = {}
    for name, channels, kind in _KINDS:
        shape = (_SIZE, _SIZE, *channels)
        random = np.random.default_rng(0)
        count = max(1, frames * _SIZE**2 // int(np.prod(shape) * np.dtype(kind).itemsize))
        ring = [
            (random.integers(0, np.iinfo(kind).max, shape, kind), np.zeros(shape, kind))
            for _ in range(count)
        ]
        grey_bytes = name == "grey 8 bit"
        shifts = range(-22, 34) if grey_bytes else _SOME_SHIFTS
        works = refocuser_works(m, shifts)
        if grey_bytes:
            works["a' = 1, plain loops for Numba, one thread"] = lambda raw, _: plain_numba(
                raw, 11, 1
            )
        seconds = in_turns(works, ring, 24 if count > 1 else 60)
        copy, alone = (seconds.pop(f"numpy.copyto{text}") for text in ("", _ALONE))
        ratios = {
            work: value / (alone if work.endswith(_ALONE) else copy)
            for work, value in seconds.items()
        }
        ratio_of = {shift: ratios.pop(f"a' = {shift}") for shift in shifts}
        between = [ratio_of[shift] for shift in shifts if shift % m]
        whole = [ratio_of[shift] for shift in shifts if shift % m == 0]
        ratios = {
            "fractional a: least": min(between),
            "fractional a: most": max(between),
            "integer a: least": min(whole),
            "integer a: most": max(whole),
            **ratios,
            "copyto / ms": 1e3 * copy,
        }
        if count > 1:
            for text, order in (("memory beside both, frames", 0), ("the same, linear", 1)):
                beside = growth_measured.extra_bytes(shape, m, kind.__name__, order=order)
                ratios[text] = beside / ring[0][0].nbytes
        columns[name] = ratios
    where = f"a ring of {frames} frames" if frames > 1 else "one frame, in the cache"
    table = Table(title=f"refocus, {_SIZE} x {_SIZE}, M = {m}, {where}: multiples of numpy.copyto")
    table.add_column("")
    for name in columns:
        table.add_column(name, justify="right")
    for work in next(iter(columns.values())):
        cells = (f"{ratios[work]:.3g}" if work in ratios else "" for ratios in columns.values())
        table.add_row(work, *cells)
    return table, columns


def both_dimensions(form: Callable[..., Sums], frame: Image, m: int, shift: int) -> None:
    """Sum rows, then columns."""
    offset = output_offset(m, shift, "centred")
    form(form(frame, m, shift, axis=1, offset=offset), m, shift, axis=0, offset=offset)


def golden_table() -> Table:
    """Time the forms of the operator on a grey frame of 1100 x 1100 pixels."""
    frame = np.random.default_rng(0).integers(0, 256, (1100, 1100), dtype=np.uint8)
    copy = np.empty_like(frame)
    copy_seconds = median_seconds(lambda: np.copyto(copy, frame), 101)
    table = Table(title="golden model, 1100 x 1100 grey, in multiples of numpy.copyto")
    for column in ("M", "a'", "gather", "moving sum", "exact image", "stored products"):
        table.add_column(column, justify="right")
    for m, shift in track(CASES, description="golden model"):
        works = (
            partial(both_dimensions, gather_sums, frame, m, shift),
            partial(both_dimensions, moving_sums, frame, m, shift),
            partial(ExactArithmetic().refocus, frame, m, shift=shift),
            partial(StoredProductArithmetic().refocus, frame, m, shift=shift),
        )
        ratios = [median_seconds(work) / copy_seconds for work in works]
        table.add_row(str(m), str(shift), *(f"{ratio:.0f}" for ratio in ratios))
    return table


def simulator_table() -> Table:
    """Time the VHDL core, M = 5, a' = -3, RGB, 320 x 100, in each installed simulator."""
    frames = np.random.default_rng(0).integers(0, 256, (1, 100, 320, 3), dtype=np.uint8)
    table = Table(title="VHDL core, M = 5, a' = -3, RGB, 320 x 100")
    for column in ("simulator", "arithmetic", "clocks", "clocks a second", "relative"):
        table.add_column(column, justify="right")
    base = None
    for name in ("ghdl", "nvc"):
        try:
            simulator = find_simulator(name)
        except InputError:
            continue
        for arithmetic in (ExactArithmetic(), StoredProductArithmetic()):
            core = CoreConfiguration(
                micro_image_size=5, shifts=(-3,), max_columns=320, channels=3, arithmetic=arithmetic
            )
            speeds = []
            for _ in track(range(3), description=f"{name}, {arithmetic.kind}"):
                with tempfile.TemporaryDirectory() as folder:
                    result = run_bench(simulator, core, frames, Path(folder))
                speeds.append(result.clocks / result.seconds)
            speed = statistics.median(speeds)
            base = base or speed
            table.add_row(
                simulator.version.split("(")[0],
                arithmetic.kind,
                str(result.clocks),
                f"{speed:.0f}",
                f"{speed / base:.2f}",
            )
    return table


def ray_model_table() -> Table:
    """Time the ways of the ray model to the distance of a plane."""
    table = Table(title="ray model: error against run time (f100, planes from 0.25 m to 100 m)")
    for column in ("way", "largest relative error", "ns a plane, array", "us a call"):
        table.add_column(column, justify="right")
    for timing in track(error_against_run_time(), description="ray model"):
        table.add_row(
            timing.way,
            f"{timing.error:.1e}",
            f"{timing.nanoseconds:.0f}",
            f"{timing.microseconds_single:.1f}",
        )
    model = RayModel.focused(load_camera("f193-mla2"), 3000.0, 13)
    planes = np.linspace(-0.1, 3.0, 1_000_000)
    seconds = median_seconds(partial(model.distance, planes), 9)
    table.caption = f"a million planes at once: {seconds * 1e3:.1f} ms"
    return table


def calibration_table() -> Table:
    """Time calibration by the grid fit and by the thesis's method, and decoding."""
    table = Table(title="calibration, pitch 11.03, in multiples of the thesis's method")
    for column in ("white image", "thesis's method / s", "grid fit", "decode", "decode, cubic"):
        table.add_column(column, justify="right")
    for size in track((1100, 3201), description="calibration"):
        grid = regular_grid((size, size), 11.03, rotation_degrees=0.1)
        white = white_image((size, size), grid)
        calibration = calibrate(white)
        text = median_seconds(partial(thesis_calibration, grey(white)), 3)
        works = (
            partial(calibrate, white),
            partial(decode, white, calibration, 11),
            partial(decode, white, calibration, 11, interpolation="cubic"),
        )
        ratios = [median_seconds(work, 3) / text for work in works]
        cells = (f"{ratio:.1f}" for ratio in ratios)
        table.add_row(f"{size} x {size}", f"{text:.2f}", *cells)
    return table


def thesis_page(folder: Path, *, record: bool) -> Path:
    """Measure the benchmark of the thesis, and write its page."""
    with Progress(transient=True) as bar:
        task = bar.add_task("benchmark of the thesis", total=6)
        recorded = thesis_benchmark.measure(lambda: bar.advance(task))
    if record:
        thesis_benchmark.save_recorded(recorded)
    path = folder / "thesis.md"
    path.write_text(thesis_benchmark.page(recorded))
    return path


def error_page(folder: Path, *, record: bool) -> Path:
    """Measure error against run time of everything, and write its page and picture."""
    with Progress(transient=True) as bar:
        task = bar.add_task("error against run time", total=None)
        recorded = work_precision.measure(lambda: bar.advance(task))
    drawing = encode_png(figure_pixels(work_precision.picture(recorded)))
    if record:
        work_precision.save_recorded(recorded)
        (project.root() / "docs" / "images" / "error-run-time.png").write_bytes(drawing)
    (folder / "error-run-time.png").write_bytes(drawing)
    path = folder / "error.md"
    path.write_text(f"# Error against run time\n\n{work_precision.page(recorded)}\n")
    return path


def tables(folder: Path) -> None:
    """Measure what stands on the console as well."""
    console = Console(record=True, width=120)
    console.print(machine())
    ratios = {}
    for name, frames in (("ring", _RING_FRAMES), ("cache", 1)):
        table, ratios[name] = refocuser_table(frames)
        console.print(table)
    compiling, cached = first_call()
    console.print(f"first call: {compiling:.2f} s of NumPy, {cached:.2f} s from the cache")
    results = {"machine": machine(), "refocuser": ratios}
    (folder / "refocuser.json").write_text(json.dumps(results, indent=2) + "\n")
    for make in (golden_table, ray_model_table, calibration_table, simulator_table):
        console.print(make())
    (folder / "bench.txt").write_text(console.export_text())
    print(f"written: {folder}/bench.txt, refocuser.json")


def main(folder: Path, *, record: bool = False) -> None:
    """Measure, print and write everything."""
    # Times are those of compiled code.
    first_calls.patient = True
    folder.mkdir(parents=True, exist_ok=True)
    tables(folder)
    print(f"written: {thesis_page(folder, record=record)}")
    print(f"written: {error_page(folder, record=record)}")
    if record:
        growth.record()
        stability_report.record()
    print(f"written: {gpu_report.write_report(folder, keep=record)}")
    for report in (precision_report, stability_report):
        print(f"written: {report.write_report(folder)}")


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--record"]
    main(Path(words[0] if words else "build/bench"), record="--record" in sys.argv)
