# SPDX-License-Identifier: Apache-2.0
"""Energy that a GPU and a processor take, by their own counters.

A GPU's is that of NVML, whose library comes with NVIDIA's driver; a processor's is that of RAPL,
which Linux shows as files.
"""

import ctypes
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from time import perf_counter, sleep

NVML = "libnvidia-ml.so.1"
RAPL = Path("/sys/class/powercap")


@dataclass(frozen=True)
class Meter:
    """Counters of energy, in joules; each begins again at 0 when it reaches its range."""

    read: Callable[[], Sequence[float]]
    ranges: Sequence[float]

    def spent(self, before: Sequence[float], after: Sequence[float]) -> float:
        """Joules between two readings."""
        each = zip(before, after, self.ranges, strict=True)
        return sum((last - first) % range_ for first, last, range_ in each)


def gpu_meter(bus_id: str, library: str = NVML) -> Meter | str:
    """The meter of a GPU at a PCI address such as ``0000:01:00.0``, or why there is none."""
    try:
        nvml = ctypes.CDLL(library)
    except OSError:
        return f"the GPU's energy is not known: {library} of NVIDIA's driver is missing"
    handle, millijoules = ctypes.c_void_p(), ctypes.c_ulonglong()

    def call(name: str, *arguments: object) -> None:
        try:
            status = nvml[name](*arguments)
        except AttributeError:
            raise RuntimeError(f"{library} has no {name}") from None
        if status:
            raise RuntimeError(f"{name} gives the error {status}")

    def read() -> list[float]:
        call("nvmlDeviceGetTotalEnergyConsumption", handle, ctypes.byref(millijoules))
        return [1e-3 * millijoules.value]

    try:
        call("nvmlInit_v2")
        call("nvmlDeviceGetHandleByPciBusId_v2", bus_id.encode(), ctypes.byref(handle))
        read()
    except RuntimeError as error:
        return f"the GPU's energy is not known: {error}"
    return Meter(read, [inf])


def cpu_meter(folder: Path = RAPL) -> Meter | str:
    """The meter of all packages of the processor, or why there is none."""
    packages = []
    for zone in sorted(folder.glob("intel-rapl:*")):
        with suppress(OSError):
            if (zone / "name").read_text().startswith("package"):
                packages.append(zone)
    if not packages:
        return f"the processor's energy is not known: {folder} has no package of RAPL"

    def numbers(name: str) -> list[float]:
        return [1e-6 * int((zone / name).read_text()) for zone in packages]

    try:
        numbers("energy_uj")
        return Meter(lambda: numbers("energy_uj"), numbers("max_energy_range_uj"))
    except (OSError, ValueError) as error:
        return f"the processor's energy is not known: {error}"


@dataclass(frozen=True)
class Spent:
    """Energy of frames."""

    joules: float
    seconds: float
    frames: int

    @property
    def watts(self) -> float:
        """Mean power."""
        return self.joules / self.seconds


def spent_by(
    meter: Meter,
    work: Callable[[], object],
    wait: Callable[[], None],
    seconds: float,
    rate: float = inf,
) -> Spent:
    """Energy of frames in a loop for some seconds, at most `rate` frames a second.

    `work` starts a frame, `wait` waits for all that were started.
    """
    work()
    wait()
    frames, before, start = 0, meter.read(), perf_counter()
    while (now := perf_counter() - start) < seconds:
        if now * rate < frames:
            sleep(frames / rate - now)
        work()
        frames += 1
        if rate < inf or frames % 32 == 0:
            wait()
    wait()
    took = perf_counter() - start
    return Spent(meter.spent(before, meter.read()), took, frames)
