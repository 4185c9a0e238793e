# SPDX-License-Identifier: Apache-2.0
"""The table of boards, one row each."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from plenofir.fpga.devices import device_name
from plenofir.fpga.hdmi.modes import CLOCK_RANGES, VGA, VGA_MIDDLE, VideoMode, modes_of_range
from plenofir.fpga.names import BoardName
from plenofir.ground import project

Flow = Literal["ise", "vivado", "nextpnr", "gowin", "nexus"]
_CONSTRAINTS: dict[Flow, str] = {
    "ise": "ucf",
    "vivado": "xdc",
    "nextpnr": "lpf",
    "gowin": "cst",
    "nexus": "pdc",
}


@dataclass(frozen=True)
class CameraInput:
    """A board's lanes for a camera with MIPI CSI-2."""

    top: str  # top level with a camera; constraints of its name, if there are any
    lane_mbits: float  # largest rate of a lane by the data sheet (docs/resampling.md)
    out_bits: int = 0  # of its parallel video; 0 with a screen
    # What its screen shows of a camera; None: parallel video, with the frames' own timing.
    screen: VideoMode | None = None
    screen_mhz: float = 0  # pixel clock of the screen


@dataclass(frozen=True)
class Board:
    """A board that a bitstream can be built for."""

    name: BoardName  # as users type it; ``hdl/sources_NAME.txt`` lists its own sources
    title: str
    devices: tuple[str, ...]  # of `plenofir.fpga.devices.DEVICES`, the usual one first
    # Tools that build its bitstream: Xilinx ISE, or GHDL, Yosys and nextpnr for ECP5, Gowin, Nexus;
    # Vivado, from a project (`plenofir.plan.project_files`).
    flow: Flow
    top: str
    library: str = ""  # of its family's primitives, see `plenofir.fpga.hdl.model_sources`
    package: str = ""  # if it is not the usual one of its devices; for nextpnr, ECP5
    # Whether `ecp5_netlist.CLOCK_PLACES` has places for its pin of the TMDS clock.
    places_clock: bool = False
    # Ranges that its PLL can be built for (`hdmi.modes.modes_of_range`); none without HDMI in.
    clock_ranges: tuple[int, ...] = ()
    pixel_mhz: float = 0  # of a board without HDMI
    # Part of the shown mode that the core of a board without HDMI in refocuses.
    own_mode: VideoMode | None = None
    scene: str = ""  # shipped scene that is built by default
    camera: CameraInput | None = None  # lanes of MIPI CSI-2

    @property
    def constraints(self) -> Path:
        """File of pins and clocks; it does not exist for a target without pins."""
        return project.root() / "constraints" / f"{self.name}.{_CONSTRAINTS[self.flow]}"

    def constraints_of(self, top: str) -> Path:
        """Pins and clocks of one of its top levels."""
        if self.camera is None or top != self.camera.top or top == self.top:
            return self.constraints
        return self.constraints.with_stem(f"{self.name}_camera")

    @property
    def bitstream(self) -> str:
        """Name of the file that is loaded into it."""
        return "plenofir.fs" if self.flow == "gowin" else "plenofir.bit"

    def device(self, typed: str) -> str | None:
        """Device of the board by its name, its part, or the name's end: ``lfe5u-25f``, ``25f``."""
        name = device_name(typed)
        ends = [d for d in self.devices if d.endswith(f"-{typed.strip().lower()}")]
        return name if name in self.devices else next(iter(ends), None)

    @property
    def modes(self) -> tuple[VideoMode, ...]:
        """Video modes that a build for each of its ranges takes, all together."""
        if self.own_mode is not None:
            return (self.own_mode,)
        modes = {m.name: m for c in self.clock_ranges for m in modes_of_range(c)}
        return tuple(sorted(modes.values(), key=lambda mode: mode.pixel_clock))

    def clock_range(self, mode: VideoMode) -> int:
        """Range to build for, the one of the slowest clocks that has a mode."""
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
            devices=("lfe5u-85f", "lfe5u-45f", "lfe5u-25f", "lfe5u-12f"),
            flow="nextpnr",
            top="ulx3s_top",
            library="ecp5u",
            places_clock=True,
            clock_ranges=CLOCK_RANGES,
            scene="flower-480p",
            # VGA at 25 MHz, which the oscillator gives; the slowest grade has GDDRX2 of 624 Mb/s.
            camera=CameraInput(top="ulx3s_camera_top", lane_mbits=624, screen=VGA, screen_mhz=25.0),
        ),
        Board(
            name="pynqz2",
            title="TUL PYNQ-Z2",
            devices=("xc7z020",),
            flow="vivado",
            top="pynqz2_top",
            library="unisim",
            clock_ranges=(4, 2),
            scene="pynqz2-720p",
        ),
        Board(
            name="tangnano20k",
            title="Sipeed Tang Nano 20K",
            devices=("gw2ar-18",),
            flow="gowin",
            top="tangnano20k_top",
            library="gw2a",
            own_mode=VGA_MIDDLE,
            scene="tangnano20k",
        ),
        Board(
            name="lifcl40",
            title="CrossLink-NX Evaluation Board",
            devices=("lifcl-40",),
            flow="nexus",
            top="lifcl40_top",
            library="lifcl",
            camera=CameraInput(top="lifcl40_top", lane_mbits=2500, out_bits=40),
            scene="lifcl40",
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
    """Board with a device, the first one in the table."""
    return next((board for board in BOARDS.values() if device in board.devices), None)
