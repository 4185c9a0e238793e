# SPDX-License-Identifier: Apache-2.0
"""The table of boards: a row is all that the project knows of one."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from plenofir import project
from plenofir.fpga.hdmi.modes import CLOCK_RANGES, VideoMode, modes_of_range

BoardName = Literal["atlys", "ulx3s", "ecp5-eval"]
Flow = Literal["ise", "nextpnr"]


@dataclass(frozen=True)
class Board:
    """A board that a bitstream can be built for.

    Attributes
    ----------
    name
        As users type it; ``hdl/sources_NAME.txt`` lists its own sources.
    title
        What it is.
    devices
        Devices (`plenofir.fpga.devices.DEVICES`) it is sold with, the usual one first.
    flow
        Tools that build its bitstream: Xilinx ISE, or GHDL, Yosys and nextpnr.
    top
        Entity.
    library
        Library of its family's primitives, see `plenofir.fpga.hdl.model_sources`.
    clock_ranges
        What its PLL can be built for, see `plenofir.fpga.hdmi.modes.modes_of_range`; none for a
        board without HDMI.
    pixel_mhz
        Pixel clock that a board without HDMI is built for.
    """

    name: BoardName
    title: str
    devices: tuple[str, ...]
    flow: Flow
    top: str
    library: str = ""
    clock_ranges: tuple[int, ...] = ()
    pixel_mhz: float = 0

    @property
    def constraints(self) -> Path:
        """Pins and clocks; no such file for a target without pins of its own."""
        suffix = "ucf" if self.flow == "ise" else "lpf"
        return project.root() / "constraints" / f"{self.name}.{suffix}"

    @property
    def modes(self) -> tuple[VideoMode, ...]:
        """Video modes that a build for each of its ranges takes, all together."""
        modes = {m.name: m for c in self.clock_ranges for m in modes_of_range(c)}
        return tuple(sorted(modes.values(), key=lambda mode: mode.pixel_clock))

    def clock_range(self, mode: VideoMode) -> int:
        """Range to build for, the one of the slowest clocks that has a mode.

        Parameters
        ----------
        mode
            One of `modes`.

        Returns
        -------
        int
            One of `clock_ranges`.
        """
        return next(c for c in self.clock_ranges if mode in modes_of_range(c))


BOARDS: dict[str, Board] = {
    board.name: board
    for board in (
        Board(
            name="atlys",
            title="Digilent Atlys",
            devices=("xc6slx45",),
            flow="ise",
            top="atlys_top",
            library="unisim",
            clock_ranges=(0,),
        ),
        Board(
            name="ulx3s",
            title="Radiona ULX3S",
            devices=("lfe5u-85f", "lfe5u-45f"),
            flow="nextpnr",
            top="ulx3s_top",
            library="ecp5u",
            clock_ranges=CLOCK_RANGES,
        ),
        Board(
            name="ecp5-eval",
            title="ECP5 evaluation target",
            devices=("lfe5u-25f",),
            flow="nextpnr",
            top="parallel_top",
            pixel_mhz=74.25,
        ),
    )
}
"""Boards by name."""


def board_of(device: str) -> Board | None:
    """Board that has a device.

    Parameters
    ----------
    device
        Its name.

    Returns
    -------
    Board or None
        None if no board has it.
    """
    return next((board for board in BOARDS.values() if device in board.devices), None)
