# SPDX-License-Identifier: Apache-2.0
"""Frames through a core of any engine by way of files (``tb/file_bench``)."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import Generics, Scope, within
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.names import VHDL_SIMULATORS
from plenofir.fpga.simulate import verilator
from plenofir.fpga.simulate.waves import WaveSignal, wave_signals_of
from plenofir.fpga.tools.simulators import SimulationError, Simulator, Waves
from plenofir.fpga.tools.synthesis import write_verilog
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

TOP = "file_bench"
CORE = "bench_core"
"""Entity of a core of any engine; a stack has a depth index behind it. Synthesisable."""


def stream_waves(prefix: str, more: str = "") -> tuple[Scope, ...]:
    """The signals of a stream; `more` are the names of vectors beside its data."""
    return (
        ("bit", "", f"{prefix}_tvalid {prefix}_tready"),
        ("downto", "", f"{prefix}_tdata {prefix}_tuser {more}"),
        ("bit", "", f"{prefix}_tlast"),
    )


def _engine_waves(engine: Iterable[Scope]) -> tuple[Scope, ...]:
    """An engine in its shell, which makes tokens of its stream."""
    return (
        # GHDL writes no records, so the signals beside the sequencer's records stand for it.
        ("bit", "shell/sequencer/faults/", "take starts_frame line_ends"),
        ("downto", "shell/sequencer/", "column rows_left slice_held"),
        ("downto", "shell/", "token_rows token_data"),
        *engine,
        ("downto", "shell/scatter/", "on_offer"),
    )


def core_waves(
    core: CoreConfiguration, index: DepthIndexConfiguration | None = None
) -> tuple[Scope, ...]:
    """Signals of the entity `CORE` that a waveform shows."""
    engine = _engine_waves((*core.engine.waves(core), ("downto", "", "result_data")))
    if index is None:
        return within("raster/core/planned", engine)
    return within(
        "stack_and_index",
        (*within("core/planned", engine), *within("index/planned", _engine_waves(index.waves))),
    )


def wave_signals(
    core: CoreConfiguration, index: DepthIndexConfiguration | None = None
) -> tuple[WaveSignal, ...]:
    """Signals in a waveform of whole frames: streams, tokens, the engine's signals."""
    stack = index is not None
    return wave_signals_of(
        TOP,
        (
            ("bit", "", "clk reset"),
            *stream_waves("s_axis"),
            *within("design", core_waves(core, index)),
            *(stream_waves("slices") if stack else ()),
            *stream_waves("m_axis", "m_axis_index m_axis_depth" if stack else "m_axis_tid"),
            ("downto", "", "error_flags"),
        ),
    )


@dataclass(frozen=True)
class BenchResult:
    """Results of a simulation."""

    # In the shape of the input frames; for a stack the pictures in focus, for a sensor's raw frames
    # the rasters.
    frames: Image
    clocks: int  # from the first pixel taken to the last pixel out
    input_clocks: int  # from the first pixel taken to the last pixel taken
    latency_clocks: (
        int | None
    )  # from the first pixel taken to the first pixel out; None for a stack
    # Slice of each frame, an index into the configuration's shifts; empty if none is selected.
    slices: tuple[int, ...]
    seconds: float  # wall time of the run, without analysis
    # Only for a stack: all slices, shape (frames, slices, rows, columns[, 3]).
    stacks: Image | None = None
    # Only for a stack: slice of each pixel of `frames`, shape (frames, rows, columns).
    index: npt.NDArray[np.uint8] | None = None
    # Words of depth between slices: fraction in the low byte, confidence above.
    depth: npt.NDArray[np.uint16] | None = None
    # For a sensor's raw frames: clocks in which the source had to wait.
    refused_clocks: int = 0


@dataclass(frozen=True)
class FileBench:
    """A bench that reads frames from ``input.bin`` and writes pixels and counts into files."""

    top: str  # its entity, and its source in C++ for Verilator
    core: str  # entity between its streams
    core_sources: Sequence[Path]  # in order of analysis

    def run(
        self,
        simulator: Simulator,
        generics: Generics,
        sizes: Mapping[str, int],
        directory: Path,
        *,
        widths: Sequence[int],
        pixels: int,
        built: bool = False,
        verilog: Sequence[Path] | None = None,
        toggles: bool = False,
        waves: Waves | None = None,
        poll: Callable[[], None] | None = None,
    ) -> tuple[list[tuple[str, int]], float]:
        """Run it in a folder with its input: lines of ``clocks.txt``, and seconds of the run.

        `generics` are the core's, `sizes` the bench's; the bench in C++ takes `widths` and `sizes`
        as arguments. `pixels` go in; the others are as in `run_bench`.
        """
        if simulator.name not in VHDL_SIMULATORS:
            program = directory / verilator.PROGRAM
            if not built:
                written = (self.core_sources, self.core, generics, directory)
                verilator.build_bench(
                    *(simulator, verilog or [write_verilog(*written)], self.core, directory),
                    pixels=pixels,
                    toggles=toggles,
                    bench=self.top,
                )
            numbers = map(str, (*widths, *sizes.values()))
            seconds = simulator.timed_run([str(program), *numbers], directory, poll)
        else:
            seconds = simulator.simulate(
                *(
                    [*self.core_sources, *bench_sources(self.top)],
                    self.top,
                    {**generics, **sizes},
                    directory,
                ),
                built=built,
                waves=waves,
                poll=poll,
            )
        lines = (directory / "clocks.txt").read_text().splitlines()
        return [(name, int(value)) for name, value in map(str.split, lines)], seconds


def bench_sources(top: str) -> list[Path]:
    """VHDL files of a file bench without the design under test, in order of analysis."""
    folder = project.root() / "tb" / "file_bench"
    return [folder / "bench_pkg.vhd", folder / f"{top}.vhd"]


def check_counts(counts: Mapping[str, int], tokens: int) -> None:
    """Refuse tokens that are missing, too many or wrongly framed."""
    for name in ("stacked", "received"):
        if counts.get(name, tokens) != tokens:
            raise SimulationError(
                f"{counts[name]} tokens {name} for {tokens} ({counts['accepted']} accepted)"
            )
    if counts["framing_errors"] or counts["error_flags"]:
        raise SimulationError(
            f"{counts['framing_errors']} tokens with wrong tuser or tlast, "
            f"error flags {counts['error_flags']:06b}"
        )


def core_sources() -> list[Path]:
    """VHDL files of the entity `CORE`, in order of analysis."""
    return [*hdl.hdl_sources(), project.root() / "tb" / "file_bench" / f"{CORE}.vhd"]


def core_generics(
    core: CoreConfiguration, index: DepthIndexConfiguration | None = None
) -> Generics:
    """Generics of the entity `CORE`, with those of the depth index behind a stack."""
    values: Generics = {**core.generics(), "ENGINE": core.engine.kind}
    if index is not None:
        judged = index.generics()
        values |= {name: judged[name] for name in ("RADIUS", "CONFIDENCE", "VOTE_RADIUS")}
        # GHDL takes no empty text.
        values |= {"INDEX_SHIFTS": judged["SHIFTS"]} if index.shifts else {}
        values["PICTURE"] = index.picture
        values["SHARP_TOO"] = index.sharp_too
    return values


def run_bench(
    simulator: Simulator,
    core: CoreConfiguration,
    frames: Image,
    directory: Path,
    *,
    index: DepthIndexConfiguration | None = None,
    sweep_frames: int = 0,
    stall_percent: int = 0,
    seed: int = 1,
    waves: Waves | None = None,
    built: bool = False,
    verilog: Sequence[Path] | None = None,
    toggles: bool = False,
    progress: Callable[[int], None] | None = None,
) -> BenchResult:
    """Move frames (frames, rows, columns[, channels]) through a core, back to back.

    `index` is the depth index behind a stack. A sweep has `sweep_frames` for each slice; with 0
    the first slice is used throughout. In up to `stall_percent` of the clocks a side stalls at
    random, `seed` is 1 to 65535. `built`: the directory has the library already, from an earlier
    run. `verilog` and `toggles` are for Verilator: the entity `CORE` in Verilog, if not what GHDL
    makes of its sources, and whether to count changes for `simulate.toggles.read_toggles`.
    `progress` is called with the number of pixels that came out so far.

    SimulationError if the simulator fails, or pixels are missing, too many or wrongly framed.
    """
    if simulator.name not in VHDL_SIMULATORS and waves is not None:
        use = " or ".join(VHDL_SIMULATORS)
        raise InputError(f"{simulator.name} writes no waveform; use {use}", where="waves")
    stack = isinstance(core.engine, StackEngine)
    count, rows, columns = frames.shape[:3]
    directory.mkdir(parents=True, exist_ok=True)
    output = directory / ("found.bin" if stack else "output.bin")
    # Output of an earlier run must not count as progress of this one.
    output.unlink(missing_ok=True)
    together = core.pixels_per_clock
    tokens = core.line_tokens(columns)
    behind = [(0, 0)] * frames.ndim
    behind[2] = (0, tokens * together - columns)
    # Lanes beyond a line's last pixel must not matter.
    filled = np.pad(frames, behind, constant_values=(1 << core.pixel_bits) - 1)
    filled.astype("<i4").tofile(directory / "input.bin")
    # A stack's pixels of a clock are followed by their slices and their depths between slices.
    words = core.channels + 2 * stack
    slices = len(core.shifts) if stack else 0
    pairs, seconds = FileBench(TOP, CORE, core_sources()).run(
        simulator,
        core_generics(core, index),
        {
            "COLUMNS": columns,
            "ROWS": rows,
            "FRAMES": count,
            "SWEEP_FRAMES": sweep_frames,
            "STALL_PERCENT": stall_percent,
            "SEED": seed,
        },
        directory,
        widths=(core.micro_image_size, slices, core.channels, together, core.pixel_bits),
        pixels=frames.size,
        built=built,
        verilog=verilog,
        toggles=toggles,
        waves=waves,
        poll=output_poll(output, words, progress),
    )
    counts = dict(pairs)
    check_counts(counts, count * rows * tokens)
    values = np.fromfile(output, "<i4").reshape(count, rows, tokens, words * together)
    parts = np.split(values, [core.channels * together, (core.channels + 1) * together], axis=3)
    lines = [part.reshape(count, rows, tokens * together, -1) for part in parts[: 1 + 2 * stack]]
    results = np.concatenate(lines, axis=3)
    if results[:, :, columns:].any():
        raise SimulationError("what comes out behind a line's last pixel is not zero")
    results = results[:, :, :columns]
    stacks = disparity_index = depth = None
    if stack:
        disparity_index = results[..., -2].astype(np.uint8)
        depth = results[..., -1].astype(np.uint16)
        shape = (count, rows, tokens * together, len(core.shifts), *frames.shape[3:])
        pixels = np.fromfile(directory / "slices.bin", "<i4").reshape(shape)[:, :, :columns]
        stacks = np.ascontiguousarray(np.moveaxis(pixels, 3, 1).astype(frames.dtype))
    return BenchResult(
        frames=results[..., : core.channels].reshape(frames.shape).astype(frames.dtype),
        clocks=counts["clocks"],
        input_clocks=counts["input_clocks"],
        latency_clocks=counts.get("latency"),
        slices=tuple(value for name, value in pairs if name == "slice"),
        seconds=seconds,
        stacks=stacks,
        index=disparity_index,
        depth=depth,
    )


def output_poll(
    output: Path, words: int, progress: Callable[[int], None] | None
) -> Callable[[], None]:
    """Poll that reports how many pixels, of some words of 32 bits, a file has so far."""

    def poll() -> None:
        if progress is not None and output.exists():
            progress(output.stat().st_size // 4 // words)

    return poll
