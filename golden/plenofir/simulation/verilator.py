"""The core in Verilator, by way of GHDL's Verilog and a C++ pump (``tb/pump/refocus_pump.cpp``)."""

from collections.abc import Sequence
from pathlib import Path

from plenofir import project
from plenofir.core import CoreConfiguration
from plenofir.simulation.simulators import Simulator

TOP = "raster_refocuser"


def build_pump(
    simulator: Simulator, verilog: Sequence[Path], directory: Path, *, optimise: bool = True
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
    optimise
        Whether to spend time on a fast simulation.

    Returns
    -------
    Path
        The program.
    """
    pump = project.root() / "tb" / "pump" / "refocus_pump.cpp"
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
            f"CFG_CXXFLAGS_PCH_I=-include OPT_FAST={'-O3' if optimise else '-O0'}",
            "--top-module",
            TOP,
            "--Mdir",
            "model",
            "-o",
            "pump",
            *(str(file.resolve()) for file in verilog),
            str(pump),
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
        As in `plenofir.simulation.pump.run_pump`.

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
