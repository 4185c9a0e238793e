# SPDX-License-Identifier: Apache-2.0
"""Measurements for `growth`: software and Dask timed on a machine, stacks synthesised."""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from plenofir.fpga import hdl
from plenofir.fpga.synthesis.spartan6 import synthesise
from plenofir.ground.images import encode_png
from plenofir.refocus import processors, refocus
from plenofir.refocus.batch import run_batch
from plenofir.refocus.batch_frames import Settings
from plenofir_studies import DATA, energy
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import machine

FILE = DATA / "growth.json"
SIDE, M = 3201, 11
ROUNDS = 40

Points = dict[int, float]
Step = Callable[[], None]


class Recorded(BaseModel):
    """What was measured on a machine."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    machine: str
    # by what is varied: nanoseconds for each pixel, one thread unless threads are varied
    nanoseconds: dict[str, Points]
    # memory beside input and output, in MB, by what is varied
    megabytes: dict[str, Points]
    # milliseconds of processor time of a batch through Dask, by what is varied
    batch: dict[str, Points]
    # focal stacks of so many slices, synthesised for Spartan-6: LUT, and 9 Kbit of block RAM
    stacks: dict[int, dict[str, int]]


_STACK_SHIFTS = (-3, 3, 0, 2, -1)
_TIMED: dict[str, tuple[int, ...]] = {
    "pixels of a side": (400, 800, 1600, 3200, 6400),
    "M": (2, 5, 11, 33, 99, 400, 1601),
    "a' (M = 11)": (1, 7, 32, 100, 1000),
    "slices": (1, 2, 4, 8),
    "threads": (1, 2, 3, 4),
}
_MEMORY: dict[str, tuple[int, ...]] = {
    "pixels of a side": (800, 1600, 3200, 6400),
    "M": (2, 11, 99, 400, 1601),
    "threads": (1, 2, 3, 4),
}
_TINY, REAL = 22, 2200
RUN_FRAMES = {_TINY: 100, REAL: 16}
_BATCHES: dict[str, tuple[int, tuple[int, ...]]] = {
    "frames (2 workers)": (_TINY, (50, 100, 200, 400)),
    "workers (100 frames of 22 x 22)": (_TINY, (1, 2, 4, 8)),
    "workers (16 frames of 2200 x 2200)": (REAL, (1, 2, 4, 8)),
}


def _case(quantity: str, value: int) -> tuple[int, int, int, int, int]:
    """Side, M, a', slices and threads of a point."""
    side = value if quantity == "pixels of a side" else SIDE
    m = value if quantity == "M" else M
    shift = value if quantity.startswith("a'") else 1
    slices = value if quantity == "slices" else 1
    return side, m, shift, slices, value if quantity == "threads" else 1


def _nanoseconds() -> dict[str, Points]:
    """All points in turn, the least of several rounds for each.

    Processor time, which other work on the machine hardly changes; wall time if threads are varied.
    """
    frames = {
        side: np.random.default_rng(0).integers(0, 256, (side, side), np.uint8)
        for side in {*_TIMED["pixels of a side"], SIDE}
    }
    outs = {side: np.empty_like(frame) for side, frame in frames.items()}
    least: dict[tuple[str, int], float] = {}
    timed = dict(_TIMED)
    # This process counts as one in the load itself.
    if os.getloadavg()[0] > 0.75 * processors():
        # Other work would take processors from the threads.
        del timed["threads"]
    for _ in range(ROUNDS):
        for quantity, values in timed.items():
            for value in values:
                side, m, shift, slices, threads = _case(quantity, value)
                clock = time.perf_counter if quantity == "threads" else time.process_time
                start = clock()
                for number in range(slices):
                    a = Fraction(shift + 2 * number, m)
                    refocus(frames[side], m, a, out=outs[side], threads=threads)
                duration = 1e9 * (clock() - start) / side**2
                least[quantity, value] = min(duration, least.get((quantity, value), np.inf))
    return {quantity: {v: least[quantity, v] for v in values} for quantity, values in timed.items()}


def extra_bytes(
    shape: tuple[int, ...], m: int, kind: str = "uint8", threads: int | None = None, order: int = 0
) -> int:
    """Largest memory of a call beside input and output, in bytes."""
    # Measured in a process of its own: peak memory during the call (Linux' VmHWM, reset by
    # clear_refs), less the memory before. Freed memory is first returned to the system (glibc), or
    # its reuse would not be seen.
    options = f"interpolation={order}, threads={threads}"
    small = (1700, 1700, *shape[2:])
    code = (
        "import ctypes, pathlib, re, numpy as np; from plenofir.refocus import refocus; "
        "status, clear = pathlib.Path('/proc/self/status'), pathlib.Path('/proc/self/clear_refs'); "
        "most = lambda: int(re.search(r'VmHWM:\\s*(\\d+)', status.read_text())[1]); "
        f"refocus(np.zeros({small}, '{kind}'), {m}, '1/{m}', {options}); "
        f"raw = np.ones({shape}, '{kind}'); out = np.ones_like(raw); "
        "ctypes.CDLL(None).malloc_trim(0); clear.write_text('5'); before = most(); "
        f"refocus(raw, {m}, '1/{m}', out=out, {options}); "
        "print(most() - before)"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    )
    return 1024 * int(process.stdout)


def _megabytes() -> dict[str, Points]:
    points = {}
    for quantity, values in _MEMORY.items():
        cases = {value: _case(quantity, value) for value in values}
        points[quantity] = {
            v: extra_bytes((side, side), m, threads=threads) / 1e6
            for v, (side, m, _, _, threads) in cases.items()
        }
    return points


def _batches() -> dict[str, Points]:
    """Processor time of whole runs in ms, start-up included.

    It is that of the client and its scheduler, or with large frames that of all workers.
    """
    points: dict[str, Points] = {}
    with tempfile.TemporaryDirectory() as name:
        for quantity, (side, values) in _BATCHES.items():
            points[quantity] = {}
            for value in values:
                frames, workers = (
                    (value, 2) if quantity.startswith("frames") else (RUN_FRAMES[side], value)
                )
                ours, theirs = _batch_ms(
                    Path(name) / f"{len(points)}-{value}", side, frames, workers
                )
                points[quantity][value] = ours if side == _TINY else theirs
    return points


def _batch_ms(folder: Path, side: int, frames: int, workers: int) -> tuple[float, float]:
    folder.mkdir(parents=True)
    raw = np.random.default_rng(0).integers(0, 256, (side, side), np.uint8)
    content = encode_png(raw)
    sources = [folder / f"frame{number}.png" for number in range(frames)]
    for source in sources:
        source.write_bytes(content)
    out = folder / "out"
    out.mkdir()

    def now() -> tuple[float, float]:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time(), children.ru_utime + children.ru_stime

    start = now()
    frames_run = run_batch(sources, Settings(M, (Fraction(1, M),)), out, workers=workers)
    if any(frame.state != "done" for frame in frames_run):
        raise ArithmeticError("a frame of the batch failed")
    ours, theirs = (1e3 * (end - begin) for end, begin in zip(now(), start, strict=True))
    return ours, theirs


def stack_figures(slices: int) -> dict[str, int]:
    """Resources of a focal stack on a Spartan-6."""
    core = energy.grey(shifts=_STACK_SHIFTS[:slices], engine="stack")
    with tempfile.TemporaryDirectory() as folder:
        figures = synthesise(
            hdl.hdl_sources(), "focal_stack", core.generics(), Path(folder)
        ).figures
    return {"lut": figures.lut, "block_rams": 2 * figures.ramb16 + figures.ramb8}


def measure(step: Step = lambda: None) -> Recorded:
    """Measure everything that depends on the machine."""
    parts = []
    for part in (_nanoseconds, _megabytes, _batches):
        parts.append(part())
        step()
    stacks = {slices: stack_figures(slices) for slices in (2, 3, 4, 5)}
    step()
    return Recorded(
        machine=machine(),
        nanoseconds=parts[0],
        megabytes=parts[1],
        batch=parts[2],
        stacks=stacks,
    )


def load_recorded() -> Recorded:
    return Recorded.model_validate_json(FILE.read_text())


def save_recorded(recorded: Recorded) -> None:
    save_records(FILE, recorded.model_dump(mode="json"), levels=2)
