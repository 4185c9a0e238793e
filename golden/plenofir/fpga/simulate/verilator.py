"""Cores in Verilator, by way of GHDL's Verilog and a pump in C++ (``tb/file_bench/*.cpp``)."""

from collections.abc import Sequence
from pathlib import Path

from plenofir import project
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.simulate.simulators import Simulator

TOP = "raster_refocuser"
# Compiling a fast program takes some seconds more.
_PIXELS_TO_OPTIMISE_FOR = 100_000


def build_pump(
    simulator: Simulator,
    verilog: Sequence[Path],
    directory: Path,
    *,
    top: str = TOP,
    pump: str = "refocus_pump",
    pixels: int,
) -> Path:
    """Translate a core in Verilog and compile it with the pump.

    Parameters
    ----------
    simulator
        Verilator.
    verilog
        Files; the core, or its netlist with models of the cells.
    directory
        Folder for the result.
    top
        Name of the core.
    pump
        Name of the pump.
    pixels
        How many will go through it: many are worth the time that a fast program takes.

    Returns
    -------
    Path
        The program.
    """
    optimisation = "-O3" if pixels > _PIXELS_TO_OPTIMISE_FOR else "-O0"
    simulator.run(
        [
            str(Path(simulator.environment["VERILATOR_ROOT"]) / "bin" / "verilator"),
            "--cc",
            "--exe",
            "--build",
            "--no-timing",
            "-Wno-fatal",
            "-Wno-lint",
            "-Wno-style",
            "--x-assign",
            "0",
            "--x-initial",
            "0",
            "-MAKEFLAGS",
            # The package lacks this setting, and compiles for size.
            f"CFG_CXXFLAGS_PCH_I=-include OPT_FAST={optimisation}",
            "--top-module",
            top,
            "--Mdir",
            "model",
            "-o",
            "pump",
            *(str(file.resolve()) for file in verilog),
            str(project.root() / "tb" / "file_bench" / f"{pump}.cpp"),
        ],
        directory,
    )
    return directory / "model" / "pump"


def pump_command(
    program: Path,
    core: CoreConfiguration,
    shape: Sequence[int],
    *,
    sweep_frames: int,
    stall_percent: int,
    seed: int,
) -> list[str]:
    """Command that runs the pump.

    Parameters
    ----------
    program
        The pump.
    core
        The core in it.
    shape
        Frames, rows, columns.
    sweep_frames, stall_percent, seed
        As in `plenofir.fpga.simulate.pump.run_pump`.

    Returns
    -------
    list of str
        The command.
    """
    frames, rows, columns = shape[:3]
    numbers = (
        core.channels,
        core.pixel_bits,
        columns,
        rows,
        frames,
        sweep_frames,
        stall_percent,
        seed,
    )
    return [str(program), *(str(number) for number in numbers)]
