"""Measure the ray model, the golden model's forms and the simulators, each in one run.

Usage: python scripts/bench.py

The golden model is measured in multiples of numpy.copyto of the same frame (median of several
runs), the simulators in clocks a second and relative to each other.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from plenofir.core import CoreConfiguration
from plenofir.errors import InputError
from plenofir.rays import RayModel, load_camera
from plenofir.rays.report import error_against_run_time
from plenofir.refocus import (
    ExactArithmetic,
    StoredProductArithmetic,
    gather_sums,
    moving_sums,
    output_offset,
)
from plenofir.refocus.operator import Image, Sums
from plenofir.simulation.pump import run_pump
from plenofir.simulation.simulators import find_simulator

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
            partial(ExactArithmetic().refocus, frame, m, shift),
            partial(StoredProductArithmetic().refocus, frame, m, shift),
        )
        ratios = [median_seconds(work) / copy_seconds for work in works]
        table.add_row(str(m), str(shift), *(f"{ratio:.0f}" for ratio in ratios))
    return table


def simulator_table() -> Table:
    """Time the VHDL core, M = 5, a' = -3, RGB, 320 x 100, in each simulator that is there."""
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
                    result = run_pump(simulator, core, frames, Path(folder))
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


if __name__ == "__main__":
    console = Console()
    console.print(ray_model_table())
    console.print(golden_table())
    console.print(simulator_table())
