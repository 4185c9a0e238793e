# SPDX-License-Identifier: Apache-2.0
"""Names that users type: of engines, boards, simulators.

They stand alone, so that the command line knows them without importing what they name.
"""

from typing import Literal

SliceEngineName = Literal["fir", "moving_sum"]
"""Engines that are set to one slice at a time: `plenofir.fpga.core.configuration.SLICE_ENGINES`."""
EngineName = Literal[SliceEngineName, "stack"]
HdmiBoardName = Literal["atlys", "ulx3s"]
BoardName = Literal[HdmiBoardName, "tangnano20k", "lifcl40", "ecp5-eval"]
"""Rows of `plenofir.fpga.boards.BOARDS`."""
SimulatorName = Literal["ghdl", "nvc", "verilator"]
Chain = Literal["core", "hdmi", "csi"]
"""The core alone, a board from serial bits to serial bits, a camera from its lanes' bytes on."""
Lanes = Literal["1", "2", "4"]
RawBits = Literal["8", "10", "12"]
