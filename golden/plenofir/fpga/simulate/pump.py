"""Frames through the VHDL core by way of the file pump (``tb/file_bench/refocus_pump.vhd``)."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plenofir import project
from plenofir.errors import InputError
from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import Engine, Scope
from plenofir.fpga.simulate import verilator
from plenofir.fpga.simulate.simulators import SimulationError, Simulator
from plenofir.fpga.simulate.waves import WaveSignal
from plenofir.fpga.synthesis.tools import write_verilog
from plenofir.refocus.operator import Image

TOP = "refocus_pump"


def wave_signals(engine: Engine) -> tuple[WaveSignal, ...]:
    """Signals that a waveform of whole frames shows: the streams, the tokens, the engine's."""
    scopes: tuple[Scope, ...] = (
        ("bit", "", "clk reset s_axis_tvalid s_axis_tready"),
        ("downto", "", "s_axis_tdata s_axis_tuser"),
        ("bit", "", "s_axis_tlast"),
        # GHDL writes no records, so of a token what makes it.
        ("bit", "core/shell/sequencer/", "take starts_frame line_ends"),
        ("downto", "core/shell/sequencer/", "column row slice_held"),
        ("downto", "core/shell/", "token_rows token_data"),
        *engine.WAVES,
        ("downto", "core/shell/", "result_data"),
        ("downto", "core/shell/scatter/", "on_offer"),
        ("bit", "", "m_axis_tvalid m_axis_tready"),
        ("downto", "", "m_axis_tdata m_axis_tuser m_axis_tid"),
        ("bit", "", "m_axis_tlast"),
        ("downto", "", "error_flags"),
    )
    return tuple(
        WaveSignal(f"/{TOP}/{scope}{name}", kind)
        for kind, scope, names in scopes
        for name in names.split()
    )


@dataclass(frozen=True)
class PumpResult:
    """What came out of a simulation.

    Attributes
    ----------
    frames
        Shape of the frames that went in.
    clocks
        Clocks from the first pixel taken to the last pixel out.
    input_clocks
        Clocks from the first pixel taken to the last pixel taken.
    latency_clocks
        Clocks from the first pixel taken to the first pixel out.
    slices
        Slice of each frame, an index into the configuration's shifts.
    seconds
        Wall time of the run, without analysis.
    """

    frames: Image
    clocks: int
    input_clocks: int
    latency_clocks: int
    slices: tuple[int, ...]
    seconds: float


def pump_sources() -> list[Path]:
    """VHDL files of the pump and the core, in order of analysis.

    Returns
    -------
    list of Path
        Files.
    """
    pump = project.root() / "tb" / "file_bench"
    return [*hdl.hdl_sources(), pump / "pump_pkg.vhd", pump / f"{TOP}.vhd"]


def read_counts(
    directory: Path, pixels: int, outputs: Sequence[str] = ("received",)
) -> list[tuple[str, int]]:
    """Read what a pump has counted.

    Parameters
    ----------
    directory
        Where the pump ran.
    pixels
        Pixels that went in.
    outputs
        Names of the counts that must be as many.

    Returns
    -------
    list of tuple
        Names and values of ``clocks.txt``.

    Raises
    ------
    SimulationError
        If pixels are missing, too many or wrongly framed.
    """
    lines = (directory / "clocks.txt").read_text().splitlines()
    pairs = [(name, int(value)) for name, value in (line.split() for line in lines)]
    counts = dict(pairs)
    for name in outputs:
        if counts[name] != pixels:
            raise SimulationError(
                f"{counts[name]} pixels {name} for {pixels} ({counts['accepted']} accepted)"
            )
    if counts["framing_errors"] or counts["error_flags"]:
        raise SimulationError(
            f"{counts['framing_errors']} pixels with wrong tuser or tlast, "
            f"error flags {counts['error_flags']:05b}"
        )
    return pairs


def run_pump(
    simulator: Simulator,
    configuration: CoreConfiguration,
    frames: Image,
    directory: Path,
    *,
    sweep_frames: int = 0,
    stall_percent: int = 0,
    seed: int = 1,
    waves: Path | None = None,
    built: bool = False,
    verilog: Sequence[Path] | None = None,
    progress: Callable[[int], None] | None = None,
) -> PumpResult:
    """Pump frames through the core, back to back.

    Parameters
    ----------
    simulator
        Simulator to use.
    configuration
        Generics of the core.
    frames
        Shape (frames, rows, columns) or (frames, rows, columns, channels).
    directory
        Empty directory for the library and the pump's files.
    sweep_frames
        Number of frames for each slice of a sweep; 0 uses the first slice throughout.
    stall_percent
        Share of clocks in which each side stalls at random.
    seed
        Seed of the stalls, 1 to 65535.
    waves
        Waveform file to write, or None; see `Simulator.run_command`.
    built
        Whether the directory has the library already, from an earlier run.
    verilog
        Verilator only: the core in Verilog, if not what GHDL makes of its sources.
    progress
        Called with the number of pixels that came out so far.

    Returns
    -------
    PumpResult
        Frames out and clock counts.

    Raises
    ------
    SimulationError
        If the simulator fails, or pixels are missing, too many or wrongly framed.
    """
    if simulator.name == "verilator" and waves is not None:
        raise InputError("no waveform from Verilator", where="WAVES", expected="SIM=ghdl or nvc")
    count, rows, columns = frames.shape[:3]
    directory.mkdir(parents=True, exist_ok=True)
    output = directory / "output.bin"
    # What an earlier run left is no progress of this one.
    output.unlink(missing_ok=True)
    frames.astype("<i4").tofile(directory / "input.bin")
    generics = {
        **configuration.generics(),
        "COLUMNS": columns,
        "ROWS": rows,
        "FRAMES": count,
        "SWEEP_FRAMES": sweep_frames,
        "STALL_PERCENT": stall_percent,
        "SEED": seed,
    }

    def poll() -> None:
        if progress is not None and output.exists():
            progress(output.stat().st_size // 4 // configuration.channels)

    if simulator.name == "verilator":
        files = verilog or [
            write_verilog(hdl.hdl_sources(), verilator.TOP, configuration.generics(), directory)
        ]
        command = verilator.pump_command(
            verilator.build_pump(simulator, files, directory, pixels=frames.size),
            configuration,
            frames.shape,
            sweep_frames=sweep_frames,
            stall_percent=stall_percent,
            seed=seed,
        )
    else:
        for command in [] if built else simulator.build_commands(pump_sources(), TOP):
            simulator.run(command, directory)
        command = simulator.run_command(
            TOP,
            generics,
            waves=waves,
            wave_signals=[signal.path for signal in wave_signals(configuration.engine)],
        )
    started = time.perf_counter()
    simulator.run(command, directory, poll=poll)
    seconds = time.perf_counter() - started

    pairs = read_counts(directory, count * rows * columns)
    counts = dict(pairs)
    words = np.fromfile(output, dtype="<i4")
    return PumpResult(
        frames=words.reshape(frames.shape).astype(frames.dtype),
        clocks=counts["clocks"],
        input_clocks=counts["input_clocks"],
        latency_clocks=counts["latency"],
        slices=tuple(value for name, value in pairs if name == "slice"),
        seconds=seconds,
    )
