# SPDX-License-Identifier: Apache-2.0
"""The refocuser on a GPU, timed: a frame's time, its share of the memory's bandwidth, the CPU.

Arrays stay on the GPU. A copy of a frame within its memory measures the bandwidth: it reads and
writes a frame once, as refocusing must at least. Energy is that of the devices' own counters
(`plenofir_studies.energy_meters`). The report names what cannot run; without a GPU it predicts
(`plenofir_studies.gpu_predicted`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import inf
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from plenofir.ground.extras import missing
from plenofir.refocus import refocus, refocus_stack, sharpest_slices
from plenofir.refocus.gpu.frames import Work, gpu_slices, reason
from plenofir.refocus.operator import Image
from plenofir.refocus.settings import checked
from plenofir_studies import energy_meters, gpu_predicted
from plenofir_studies.energy_meters import Meter
from plenofir_studies.gpu_predicted import SIZE, M
from plenofir_studies.report_parts import Progress, Report, machine

_SHIFTS = (-21, 1, 11, 32)
_STACK = range(-7, 9)
_RUNS = 30
_QUEUED = 24
"""Frames that are started before the first one is waited for, so that the GPU is not idle."""
_FILM = 60.0


@dataclass(frozen=True)
class Device:
    """A library's arrays on a device."""

    library: str
    name: str  # the device's
    put: Callable[[Image], Any]
    get: Callable[[Any], Image]
    copy: Callable[[Any], Any]
    wait: Callable[[], None]  # for all pending work
    meter: Meter | str  # of the device's energy, or why there is none


@dataclass(frozen=True)
class Timed:
    """A frame of a kind and a focus setting."""

    pixels: str
    work: str
    seconds: float
    cpu_seconds: float
    copy_seconds: float  # of a copy within the device's memory
    frame_bytes: int

    @property
    def gigabytes(self) -> float:
        """A frame read and a frame written, in GB a second."""
        return 2e-9 * self.frame_bytes / self.seconds

    @property
    def share(self) -> float:
        """Share of a copy's bandwidth."""
        return self.copy_seconds / self.seconds


def _meter() -> Meter | str:
    """The meter of the first GPU."""
    try:
        from cuda.core import Device as Gpu

        return energy_meters.gpu_meter(Gpu(0).pci_bus_id)
    except Exception as error:
        # Drivers fail in ways that no list has, and a time without its energy is worth having.
        return f"the GPU's energy is not known: {reason(error)}"


def devices() -> Iterator[Device | str]:
    """GPUs that can be used here, or why a library has none."""
    try:
        import cupy

        cupy.cuda.runtime.getDeviceCount()
        properties = cupy.cuda.runtime.getDeviceProperties(0)
        yield Device(
            "CuPy",
            properties["name"].decode(),
            cupy.asarray,
            cupy.asnumpy,
            lambda x: x.copy(),
            lambda: cupy.cuda.Device().synchronize(),
            _meter(),
        )
    except ImportError:
        yield "CuPy is not installed"
    except Exception as error:
        yield f"CuPy finds no GPU ({str(error).splitlines()[0]})"
    try:
        import torch

        if torch.cuda.is_available():
            yield Device(
                "PyTorch",
                torch.cuda.get_device_name(0),
                lambda x: torch.from_numpy(x).cuda(),
                lambda x: x.cpu().numpy(),
                lambda x: x.clone(),
                torch.cuda.synchronize,
                _meter(),
            )
        else:
            yield "PyTorch finds no GPU"
    except ImportError:
        yield "PyTorch is not installed"


def _least(
    work: Callable[[], object], wait: Callable[[], None], runs: int, queued: int = _QUEUED
) -> float:
    """Least wall time of a call and the work that it starts, with others queued behind it."""
    best = float("inf")
    for _ in range(runs + 1):
        # The first call compiles.
        wait()
        start = perf_counter()
        for _ in range(queued):
            work()
        wait()
        best = min(best, (perf_counter() - start) / queued)
    return best


def measure(device: Device, size: int = SIZE, m: int = M, runs: int = _RUNS) -> list[Timed]:
    """Time frames on a device, each compared with the CPU's to the bit."""
    timings = []
    random = np.random.default_rng(0)
    for text, channels, kind in (
        ("grey 8 bit", (), np.uint8),
        ("RGB 8 bit", (3,), np.uint8),
        ("grey 16 bit", (), np.uint16),
    ):
        raw = random.integers(0, np.iinfo(kind).max, (size, size, *channels), kind, endpoint=True)
        frame = device.put(raw)
        copied = _least(lambda frame=frame: device.copy(frame), device.wait, runs)  # type: ignore[misc]
        works: list[tuple[str, int, dict[str, Any]]] = [
            (f"a' = {shift}", shift, {}) for shift in _SHIFTS
        ]
        works += [
            ("a' = 1, linear", 1, {"interpolation": 1}),
            ("a' = 1, sharpened", 1, {"sharpen": "auto"}),
        ]
        for work, shift, options in works:
            a = Fraction(shift, m)

            def of(x: Any, a: Fraction = a, options: dict[str, Any] = options) -> Any:
                return refocus(x, m, a, **options)

            if not np.array_equal(device.get(of(frame)), of(raw)):
                raise ArithmeticError(f"{device.library}, {text}, {work}: not the CPU's picture")
            seconds = _least(lambda of=of, frame=frame: of(frame), device.wait, runs)  # type: ignore[misc]
            cpu = _least(lambda of=of, raw=raw: of(raw), lambda: None, min(runs, 5), 1)  # type: ignore[misc]
            timings.append(Timed(text, work, seconds, cpu, copied, raw.nbytes))
        if text == "grey 8 bit":
            timings += _stacks(device, raw, m, runs, copied)
    return timings


def _stacks(device: Device, raw: Image, m: int, runs: int, copied: float) -> list[Timed]:
    """Time a stack, and its depth and picture in focus."""
    settings, timings, frame = [Fraction(shift, m) for shift in _STACK], [], device.put(raw)
    works: list[tuple[str, Callable[[Any], Any]]] = [
        ("slices", lambda x: refocus_stack(x, m, settings)),
        ("slices: depth and in focus", lambda x: sharpest_slices(x, m, settings).image),
    ]
    for name, of in works:
        work = f"{len(settings)} {name}"
        if not np.array_equal(device.get(of(frame)), of(raw)):
            raise ArithmeticError(f"{device.library}, {work}: not the CPU's picture")
        seconds = _least(lambda of=of: of(frame), device.wait, runs, 4)  # type: ignore[misc]
        cpu = _least(lambda of=of: of(raw), lambda: None, 1, 1)  # type: ignore[misc]
        timings.append(Timed("grey 8 bit", work, seconds, cpu, copied, raw.nbytes))
    return timings


def from_memory(size: int = SIZE, frames: int = 2 * _QUEUED) -> str:
    """Time of frames (grey, 8 bit, a' = 1) that come from the host's memory and go back there."""
    raw = np.random.default_rng(0).integers(0, 256, (size, size), np.uint8)
    work = Work(raw, [checked(raw, M, Fraction(1, M))[1]])
    reasons: list[str] = []
    seconds = inf
    # The first run compiles.
    for _ in range(2):
        start = perf_counter()
        for _, made in gpu_slices(range(frames), lambda _: work, reasons.append):
            if made is None:
                return f"From the host's memory and back: not run ({'; '.join(reasons)})."
        seconds = (perf_counter() - start) / frames
    return (
        f"From the host's memory and back, grey, 8 bit: {1e3 * seconds:.3f} ms a frame, "
        f"{1e-9 * raw.nbytes / seconds:.1f} GB/s each way."
    )


def energies(
    parts: Sequence[tuple[str, Meter | str, Callable[[Image], Any], Callable[[], None]]],
    size: int = SIZE,
    seconds: float = 5,
) -> tuple[list[tuple[str, str, str]], list[str]]:
    """Energy of a pixel (grey, 8 bit, a' = 1) at full load and for one camera.

    `parts`: name, meter, what puts frames there, and what waits for them. Result: rows of
    `gpu_predicted.answer`, and sentences for what has no meter.
    """
    raw = np.random.default_rng(0).integers(0, 256, (size, size), np.uint8)
    rows, reasons = [], []
    for name, meter, put, wait in parts:
        if isinstance(meter, str):
            reasons.append(meter)
            continue
        work = partial(refocus, put(raw), M, Fraction(1, M))
        loads = ("in a loop", inf), (f"one camera of {_FILM:.0f} frames a second", _FILM)
        for load, rate in loads:
            spent = energy_meters.spent_by(meter, work, wait, seconds, rate)
            pixel = 1e12 * spent.joules / (spent.frames * size**2)
            each_second = spent.frames / spent.seconds
            known = f"measured here: {spent.watts:.0f} W, {each_second:.0f} frames a second"
            rows.append((f"{name}, {load}", known, f"{pixel:.0f}"))
    return rows, reasons


def add(report: Report, device: Device, timed: Sequence[Timed], size: int) -> None:
    """A device's part of the report."""
    report.say(f"## {device.name}, {device.library}, {size} x {size}, M = {M}")
    report.table_of(
        timed,
        {
            "pixels": "{.pixels}",
            "": "{.work}",
            "ms a frame": lambda t: f"{1e3 * t.seconds:.3f}",
            "GB/s": "{.gigabytes:.0f}",
            "share of a copy's bandwidth": lambda t: f"{100 * t.share:.0f} %",
            "CPU: ms a frame": lambda t: f"{1e3 * t.cpu_seconds:.2f}",
            "CPU over GPU": lambda t: f"{t.cpu_seconds / t.seconds:.1f}",
        },
    )


def write_report(
    folder: Path,
    progress: Progress | None = None,
    gpus: Sequence[Device | str] | None = None,
    keep: bool = False,
    seconds: float = 5,
) -> Path:
    """Time every GPU and write ``gpu.md``; what could not run is a line of it.

    Without a GPU times are predicted. `keep`: whether to keep predictions for the documentation.
    `seconds`: for which each load runs while its energy is measured.
    """
    parts = list(devices()) if gpus is None else gpus
    report = Report(folder, "gpu.md", len(parts), progress)
    report.say(
        "# The refocuser on a GPU",
        "Written by `plenofir report gpu`: least of several runs, arrays in the device's memory, "
        "every picture compared with the CPU's to the bit.",
        f"CPU: {machine()}.",
    )
    for part in parts:
        if isinstance(part, Device):
            add(report, part, measure(part), SIZE)
        report.step()
    report.say(from_memory())
    reasons = [part for part in parts if isinstance(part, str)]
    if reasons:
        line = f"Not run on a GPU: {'; '.join(reasons)}."
        report.say(line)
        print(line)
    if len(reasons) == len(parts):
        report.say("## Predicted, where no GPU is")
        report.add([*_predictions(keep), ""])
    report.say("## The question of the thesis")
    metered: list[tuple[str, Meter | str, Callable[[Image], Any], Callable[[], None]]] = [
        (f"{part.name}, {part.library}", part.meter, part.put, part.wait)
        for part in parts
        if isinstance(part, Device)
    ]
    metered.append(("the CPU above", energy_meters.cpu_meter(), lambda raw: raw, lambda: None))
    rows, unknown = energies(metered, seconds=seconds)
    report.add(gpu_predicted.answer(rows))
    if unknown:
        report.say("", f"Not measured: {'; '.join(unknown)}.")
    return report.write()


def _predictions(keep: bool) -> list[str]:
    """What is predicted, or why nothing is."""
    try:
        frames = gpu_predicted.predict()
    except ImportError as error:
        return [f"Nothing: {missing(error.name or '').problem}."]
    except RuntimeError as error:
        return [f"Nothing: NVIDIA's compiler fails ({error})."]
    recorded = gpu_predicted.recorded_here(frames)
    if keep:
        gpu_predicted.record(recorded)
    return gpu_predicted.page(recorded)
