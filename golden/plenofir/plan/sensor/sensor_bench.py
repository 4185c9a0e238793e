# SPDX-License-Identifier: Apache-2.0
"""Simulation of mosaic and resampler with frames in files (``tb/file_bench/sensor_bench``)."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plenofir.fpga import hdl
from plenofir.fpga.core.engine import Generics, Scope, within
from plenofir.fpga.simulate.file_bench import (
    BenchResult,
    FileBench,
    check_counts,
    output_poll,
    stream_waves,
)
from plenofir.fpga.simulate.waves import WaveSignal, wave_signals_of
from plenofir.fpga.tools.simulators import Simulator, Waves
from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration
from plenofir.refocus.operator import Image

TOP = "sensor_bench"
CORE = "sensor_raster"
_HALF = (1 << 20) - 1


WAVES: tuple[Scope, ...] = (
    *stream_waves("raw"),
    *within(
        "lenses_out",
        (
            ("bit", "sequencer/faults/", "take starts_frame line_ends"),
            ("downto", "sequencer/", "column rows_left"),
            ("downto", "", "token_data"),
            ("downto", "writer/", "line_number column frame_first done"),
            ("bit", "writer/", "waits room_this room_next"),
            ("bit", "", "line_valid line_taken"),
            ("downto", "lines_of_lenses/", "y x row_index top bottom needed kept"),
            ("bit", "walk/", "active lens_ends line_ends take"),
            ("downto", "walk/", "y x lens_now"),
            ("downto", "samples/", "moved_y moved_x pixel_00 pixel_01 pixel_10 pixel_11"),
            ("downto", "samples/", "weight_y weight_x gain"),
            ("downto", "samples/channel(0)/", "sample value"),
            ("bit", "", "have_credit value_valid"),
            ("downto", "", "credits values word out_word"),
            ("bit", "", "out_valid out_ready"),
        ),
    ),
)
"""Signals of the entity `CORE` that a waveform shows."""


def wave_signals() -> tuple[WaveSignal, ...]:
    """Signals in a waveform of raw frames through the resampler."""
    return wave_signals_of(
        TOP,
        (
            ("bit", "", "clk reset"),
            *stream_waves("s_axis"),
            *within("design", WAVES),
            *stream_waves("m_axis"),
            ("downto", "", "error_flags"),
        ),
    )


def load_words(loads: Sequence[Load]) -> npt.NDArray[np.int32]:
    """Words of the load port for a bench: kind, address, low and high 20 bits each."""
    words = [(kind, address, word & _HALF, word >> 20) for kind, address, word in loads]
    return np.array(words, "<i4")


def sensor_generics(core: ResamplerConfiguration, *, mosaic: bool) -> Generics:
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
    waves: Waves | None = None,
    built: bool = False,
    verilog: Sequence[Path] | None = None,
    progress: Callable[[int], None] | None = None,
) -> BenchResult:
    """Move raw frames (frames, rows, columns[, channels]) through the resampler.

    A mosaic's first red pixel is at `red_place` (row, column); the core's channels are those after
    its interpolation. `raster_shape` is rows and columns of the output; the others are as in
    `plenofir.fpga.simulate.file_bench.run_bench`. The source offers a pixel every clock except the
    one in which the bench reads it.
    """
    count, rows, columns = frames.shape[:3]
    directory.mkdir(parents=True, exist_ok=True)
    output = directory / "output.bin"
    output.unlink(missing_ok=True)
    frames.astype("<i4").tofile(directory / "input.bin")
    words = load_words(loads)
    words.tofile(directory / "loads.bin")
    in_channels = 1 if red_place is not None else core.channels
    pairs, seconds = FileBench(TOP, CORE, hdl.hdl_sources()).run(
        simulator,
        sensor_generics(core, mosaic=red_place is not None),
        {
            "RED_PLACE": 0 if red_place is None else 2 * red_place[0] + red_place[1],
            "LOADS": len(words),
            "COLUMNS": columns,
            "ROWS": rows,
            "FRAMES": count,
            "OUT_COLUMNS": raster_shape[1],
            "OUT_ROWS": raster_shape[0],
            "STALL_PERCENT": stall_percent,
            "SEED": seed,
        },
        directory,
        widths=(in_channels, core.channels, core.pixel_bits),
        pixels=frames.size,
        built=built,
        verilog=verilog,
        waves=waves,
        poll=output_poll(output, core.channels, progress),
    )
    counts = dict(pairs)
    check_counts(counts, count * raster_shape[0] * raster_shape[1])
    shape = (count, *raster_shape, *([core.channels] if core.channels > 1 else []))
    return BenchResult(
        frames=np.fromfile(output, "<i4").reshape(shape).astype(frames.dtype),
        clocks=counts["clocks"],
        input_clocks=counts["input_clocks"],
        latency_clocks=counts["latency"],
        slices=(),
        seconds=seconds,
        refused_clocks=counts["refused"],
    )
