# SPDX-License-Identifier: Apache-2.0
"""The refocuser on a GPU, timed: a frame's time, its share of the memory's bandwidth, the CPU.

Arrays stay on the GPU. A copy of a frame within its memory measures the bandwidth: it reads and
writes a frame once, as refocusing must at least. The report names what cannot run; without a GPU it
predicts (`plenofir_studies.gpu_predicted`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from plenofir.ground.extras import missing
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image
from plenofir_studies import gpu_predicted
from plenofir_studies.gpu_predicted import SIZE, M
from plenofir_studies.report_parts import Progress, Report, machine

_SHIFTS = (-21, 1, 11, 32)
_RUNS = 30


@dataclass(frozen=True)
class Device:
    """A library's arrays on a device."""

    library: str
    name: str  # the device's
    put: Callable[[Image], Any]
    get: Callable[[Any], Image]
    copy: Callable[[Any], Any]
    wait: Callable[[], None]  # for all pending work


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
            )
        else:
            yield "PyTorch finds no GPU"
    except ImportError:
        yield "PyTorch is not installed"


def _least(work: Callable[[], object], wait: Callable[[], None], runs: int) -> float:
    """Least wall time of a call and the work that it starts."""
    best = float("inf")
    for _ in range(runs + 1):
        # The first call compiles.
        wait()
        start = perf_counter()
        work()
        wait()
        best = min(best, perf_counter() - start)
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
            cpu = _least(lambda of=of, raw=raw: of(raw), lambda: None, min(runs, 5))  # type: ignore[misc]
            timings.append(Timed(text, work, seconds, cpu, copied, raw.nbytes))
    return timings


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
) -> Path:
    """Time every GPU and write ``gpu.md``; what could not run is a line of it.

    Without a GPU times are predicted. `keep`: whether to keep predictions for the documentation.
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
    reasons = [part for part in parts if isinstance(part, str)]
    if reasons:
        line = f"Not run on a GPU: {'; '.join(reasons)}."
        report.say(line)
        print(line)
    if len(reasons) == len(parts):
        report.say("## Predicted, where no GPU is")
        report.add([*_predictions(keep), ""])
    report.say("## The question of the thesis")
    report.add(gpu_predicted.answer())
    return report.write()


def _predictions(keep: bool) -> list[str]:
    """What is predicted, or why nothing is."""
    try:
        frames = gpu_predicted.predict()
    except ImportError as error:
        return [f"Nothing: {missing(error.name or '').problem}."]
    except RuntimeError as error:
        return [f"Nothing: NVIDIA's compiler fails ({error})."]
    if keep:
        gpu_predicted.record(frames)
    return gpu_predicted.page(gpu_predicted.Recorded(machine=machine(), frames=frames))
