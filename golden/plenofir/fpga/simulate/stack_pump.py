"""A frame through focal stack and depth index in VHDL (``tb/file_bench/stack_pump``)."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plenofir import project
from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.simulate import verilator
from plenofir.fpga.simulate.pump import read_counts
from plenofir.fpga.simulate.simulators import Simulator
from plenofir.fpga.synthesis.tools import write_verilog
from plenofir.refocus.operator import Image

TOP = "stack_pump"
CORES = "stack_and_index"
"""Entity of both cores, one behind the other."""


@dataclass(frozen=True)
class StackPumpResult:
    """What came out of a simulation.

    Attributes
    ----------
    slices
        Shape (slices, rows, columns[, 3]).
    image
        All-in-focus picture.
    index
        Slice of each of its pixels, shape (rows, columns).
    clocks
        Clocks from the first pixel taken to the last pixel out.
    input_clocks
        Clocks from the first pixel taken to the last pixel taken.
    seconds
        Wall time of the run, without analysis.
    """

    slices: Image
    image: Image
    index: npt.NDArray[np.uint8]
    clocks: int
    input_clocks: int
    seconds: float


def stack_sources() -> list[Path]:
    """VHDL files of focal stack and depth index, in order of analysis.

    Returns
    -------
    list of Path
        Files.
    """
    return [*hdl.hdl_sources(), project.root() / "tb" / "file_bench" / f"{CORES}.vhd"]


def run_stack_pump(
    simulator: Simulator,
    core: CoreConfiguration,
    radius: int,
    raw: Image,
    directory: Path,
    *,
    stall_percent: int = 0,
    seed: int = 1,
    verilog: Sequence[Path] | None = None,
    progress: Callable[[int], None] | None = None,
) -> StackPumpResult:
    """Pump a frame through a focal stack and its depth index.

    Parameters
    ----------
    simulator
        Simulator to use.
    core
        Generics of the stack.
    radius
        See `plenofir.refocus.sharpness.local_sharpness`.
    raw
        Shape (rows, columns) or (rows, columns, 3).
    directory
        Folder for the library and the pump's files; made if it is missing.
    stall_percent
        Share of clocks in which source and sink stall at random.
    seed
        Seed of the stalls, 1 to 65535.
    verilog
        Verilator only: both cores in Verilog, if not what GHDL makes of their sources.
    progress
        Called with the number of pixels that came out so far.

    Returns
    -------
    StackPumpResult
        Pictures and clock counts.

    Raises
    ------
    SimulationError
        If the simulator fails, or pixels are missing, too many or wrongly framed.
    """
    rows, columns = raw.shape[:2]
    directory.mkdir(parents=True, exist_ok=True)
    raw.astype("<i4").tofile(directory / "input.bin")
    pump = project.root() / "tb" / "file_bench"
    generics = {**core.generics(), "RADIUS": radius}
    size = {"COLUMNS": columns, "ROWS": rows, "STALL_PERCENT": stall_percent, "SEED": seed}
    if simulator.name == "verilator":
        program = verilator.build_pump(
            simulator,
            verilog or [write_verilog(stack_sources(), CORES, generics, directory)],
            directory,
            top=CORES,
            pump=TOP,
            pixels=raw.size,
        )
        shape = (core.micro_image_size, len(core.shifts), core.channels, core.pixel_bits)
        command = [str(program), *(str(number) for number in (*shape, *size.values()))]
    else:
        sources = [*stack_sources(), pump / "pump_pkg.vhd", pump / f"{TOP}.vhd"]
        for command in simulator.build_commands(sources, TOP):
            simulator.run(command, directory)
        command = simulator.run_command(TOP, {**generics, **size})
    found_file = directory / "found.bin"
    words = 4 * (core.channels + 1)

    def poll() -> None:
        if progress is not None and found_file.exists():
            progress(found_file.stat().st_size // words)

    started = time.perf_counter()
    simulator.run(command, directory, poll=poll)
    seconds = time.perf_counter() - started
    counts = dict(read_counts(directory, rows * columns, ("stacked", "received")))
    slices_shape = (rows, columns, len(core.shifts), *raw.shape[2:])
    slices = np.fromfile(directory / "slices.bin", "<i4").reshape(slices_shape).astype(raw.dtype)
    found = np.fromfile(found_file, "<i4").reshape(rows, columns, core.channels + 1)
    return StackPumpResult(
        slices=np.moveaxis(slices, 2, 0),
        image=found[..., :-1].reshape(raw.shape).astype(raw.dtype),
        index=found[..., -1].astype(np.uint8),
        clocks=counts["clocks"],
        input_clocks=counts["input_clocks"],
        seconds=seconds,
    )
