# SPDX-License-Identifier: Apache-2.0
"""Names that users type: of engines, boards, simulators.

This module imports nothing, so that the command line has the names without loading the rest.
"""

from typing import Literal, NamedTuple, get_args

SliceEngineName = Literal["fir", "moving_sum"]
"""Engines that are set to one slice at a time: `plenofir.fpga.core.configuration.SLICE_ENGINES`."""
SLICE_ENGINE_NAMES: tuple[SliceEngineName, ...] = get_args(SliceEngineName)
DEFAULT_ENGINE: SliceEngineName = "fir"


class EngineRow(NamedTuple):
    """Names of an engine for the command line."""

    method: str  # how it computes
    fields: tuple[str, ...]  # options that users set and not all engines have


ENGINE_ROWS: dict[SliceEngineName, EngineRow] = {
    "fir": EngineRow("switched filters", ("parallel_rows",)),
    "moving_sum": EngineRow("moving sums", ("any_rows", "pixels_per_clock")),
}
EngineName = Literal[SliceEngineName, "stack"]
HdmiBoardName = Literal["atlys", "ulx3s", "pynqz2"]
DEFAULT_BOARD: HdmiBoardName = "atlys"
BoardName = Literal[HdmiBoardName, "tangnano20k", "lifcl40", "ecp5-eval"]
"""Rows of `plenofir.fpga.boards.BOARDS`."""
SimulatorName = Literal["ghdl", "nvc", "verilator"]
"""Keys of `plenofir.fpga.tools.simulators.FINDERS`, the usual one first."""
DEFAULT_SIMULATOR: SimulatorName = "ghdl"
VHDL_SIMULATORS: tuple[SimulatorName, ...] = ("ghdl", "nvc")
"""Simulators that read VHDL; others simulate cores alone, from Verilog, and write no waveforms."""
Chain = Literal["core", "hdmi", "csi"]
"""The core alone, a board from serial bits to serial bits, a camera from its lanes' bytes on."""
WaveChoice = Literal["0", "1", "all"]
"""No waveform, one of the named signals, or one of all signals, records included."""
MAX_SEED = 65535
"""Largest seed of the file benches' stalls."""
Lanes = Literal["1", "2", "4"]
RawBits = Literal["8", "10", "12"]


def engines_with(field: str) -> tuple[SliceEngineName, ...]:
    """Engines that have a field, the usual one first."""
    return tuple(name for name, row in ENGINE_ROWS.items() if field in row.fields)
