# SPDX-License-Identifier: Apache-2.0
"""Raw frames through mosaic and resampler by way of files (``tb/file_bench/sensor_bench``)."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plenofir import project
from plenofir.fpga import hdl
from plenofir.fpga.core.engine import Generics
from plenofir.fpga.core.resampler import Load, ResamplerConfiguration
from plenofir.fpga.simulate import verilator
from plenofir.fpga.tools.simulators import SimulationError, Simulator
from plenofir.fpga.tools.synthesis import write_verilog
from plenofir.refocus.operator import Image

TOP = "sensor_bench"
CORE = "sensor_raster"
_HALF = (1 << 20) - 1


@dataclass(frozen=True)
class SensorResult:
    """What came out of a simulation."""

    frames: Image  # rasters of micro images
    clocks: int  # from the first raw pixel taken to the last pixel out
    input_clocks: int  # from the first raw pixel taken to the last one
    latency_clocks: int  # from the first raw pixel taken to the first pixel out
    # Clocks in which the source was refused; it offers a pixel every clock but the one in which the
    # bench reads it.
    refused_clocks: int
    seconds: float  # wall time of the run, without analysis


def sensor_generics(core: ResamplerConfiguration, *, mosaic: bool) -> Generics:
    """Generics of the entity `CORE`."""
    return {**core.generics(), "MOSAIC": mosaic}


def run_sensor(
    simulator: Simulator,
    core: ResamplerConfiguration,
    loads: Sequence[Load],
    frames: Image,
    raster_shape: tuple[int, int],
    directory: Path,
    *,
    red_place: tuple[int, int] | None = None,
    stall_percent: int = 0,
    seed: int = 1,
    verilog: Sequence[Path] | None = None,
    progress: Callable[[int], None] | None = None,
) -> SensorResult:
    """Move raw frames (frames, rows, columns[, channels]) through the resampler.

    A mosaic in front of it has its first red pixel at `red_place` (row, column); the core's
    channels are those behind it. `raster_shape` is rows and columns that come out; the others are
    as in `plenofir.fpga.simulate.file_bench.run_bench`.
    """
    count, rows, columns = frames.shape[:3]
    directory.mkdir(parents=True, exist_ok=True)
    output = directory / "output.bin"
    output.unlink(missing_ok=True)
    frames.astype("<i4").tofile(directory / "input.bin")
    words = [(kind, address, word & _HALF, word >> 20) for kind, address, word in loads]
    np.array(words, "<i4").tofile(directory / "loads.bin")
    generics = sensor_generics(core, mosaic=red_place is not None)
    place = 0 if red_place is None else 2 * red_place[0] + red_place[1]
    sizes = {
        "RED_PLACE": place,
        "LOADS": len(words),
        "COLUMNS": columns,
        "ROWS": rows,
        "FRAMES": count,
        "OUT_COLUMNS": raster_shape[1],
        "OUT_ROWS": raster_shape[0],
        "STALL_PERCENT": stall_percent,
        "SEED": seed,
    }

    def poll() -> None:
        if progress is not None and output.exists():
            progress(output.stat().st_size // 4 // core.channels)

    if simulator.name == "verilator":
        files = verilog or [write_verilog(hdl.hdl_sources(), CORE, generics, directory)]
        program = verilator.build_bench(
            simulator, files, CORE, directory, pixels=frames.size, bench=TOP
        )
        in_channels = 1 if red_place is not None else core.channels
        numbers = (in_channels, core.channels, core.pixel_bits, *sizes.values())
        command = [str(program), *(str(number) for number in numbers)]
    else:
        bench = project.root() / "tb" / "file_bench" / f"{TOP}.vhd"
        for command in simulator.build_commands([*hdl.hdl_sources(), bench], TOP):
            simulator.run(command, directory)
        command = simulator.run_command(TOP, {**generics, **sizes})
    started = time.perf_counter()
    simulator.run(command, directory, poll=poll)
    seconds = time.perf_counter() - started
    lines = (directory / "clocks.txt").read_text().splitlines()
    counts = {name: int(value) for name, value in (line.split() for line in lines)}
    pixels = count * raster_shape[0] * raster_shape[1]
    if counts["received"] != pixels:
        raise SimulationError(
            f"{counts['received']} pixels received for {pixels} ({counts['accepted']} accepted)"
        )
    if counts["framing_errors"] or counts["error_flags"]:
        raise SimulationError(
            f"{counts['framing_errors']} pixels with wrong tuser or tlast, "
            f"error flags {counts['error_flags']:06b}"
        )
    shape = (count, *raster_shape, *([core.channels] if core.channels > 1 else []))
    return SensorResult(
        frames=np.fromfile(output, "<i4").reshape(shape).astype(frames.dtype),
        clocks=counts["clocks"],
        input_clocks=counts["input_clocks"],
        latency_clocks=counts["latency"],
        refused_clocks=counts["refused"],
        seconds=seconds,
    )
