# SPDX-License-Identifier: Apache-2.0
"""The record of resources, ``data/resources.json``: what tools counted and placed, and weights.

Tests synthesise the counted designs and require the same figures, so that a change that costs area
shows in review. scripts/resources.py writes the file, and fits the weights to what it holds.
"""

import json
from functools import cache
from typing import Any

from pydantic import BaseModel, ConfigDict

from plenofir.fpga.devices import Usage
from plenofir.ground import project

FILE = project.DATA / "resources.json"
ECP5_SLOWEST, ECP5_FASTEST = "ecp5-6", "ecp5-8"
"""Places of ECP5 designs in `Record.placed`: grade 6, the slowest that is sold, and grade 8."""


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Figures(_Entry):
    """What Yosys counts in a netlist."""

    lut: int  # those used as memory and shift registers included
    flip_flops: int
    ramb16: int  # block RAMs of 18 Kbit
    ramb8: int = 0  # of 9 Kbit
    dsp: int = 0  # multipliers
    # With a Spartan-6: chains of 4 bits, and cells on the longest path between registers.
    carry: int = 0
    path: int = 0

    @property
    def usage(self) -> Usage:
        """The figures as resources of a device."""
        return Usage(self.lut, self.flip_flops, self.ramb16, self.ramb8, self.dsp)


class Placed(_Entry):
    """A placed and routed design."""

    device: str  # as nextpnr names it
    speed_grade: int | None = None
    fmax_mhz: float  # highest clock of the paths between registers
    lut: int  # of an ECP5 those of four inputs
    flip_flops: int
    block_rams: int  # of 18 Kbit
    multipliers: int  # 18 x 18

    @property
    def usage(self) -> Usage:
        """The figures as resources of a device."""
        return Usage(self.lut, self.flip_flops, self.block_rams, dsp=self.multipliers)


class Weights(_Entry):
    """What each part of a kind of block takes of a family, and how good that is."""

    lut: dict[str, float] = {}
    flip_flops: dict[str, float] = {}
    block_rams: dict[str, int] = {}
    multipliers: dict[str, int] = {}
    times: tuple[float, float] | None = None  # LUTs and flip-flops for each of a Spartan-6, instead
    within: float  # largest relative error of LUTs and flip-flops against designs
    spare_block_rams: int = 0  # block RAMs that may be too many


class Record(_Entry):
    """Content of the file."""

    ghdl: str  # versions that counted for Spartan-6
    yosys: str
    counted: dict[str, dict[str, Figures]]  # by family and design
    placed: dict[str, dict[str, Placed]]  # by ECP5 grade or device, and design
    # LUTs and flip-flops of a family for each of a Spartan-6, for kinds without a fit.
    times: dict[str, tuple[float, float]]
    weights: dict[str, dict[str, Weights]]  # by kind of block and family
    # For "lut" and "flip_flops": number of drawn cores, the largest relative error by weights that
    # were fitted without the core, and the error that 95 % of them keep.
    drawn_errors: dict[str, tuple[int, float, float]]
    builds: dict[str, dict[str, Any]]  # reports of boards' bitstreams (`NextpnrReport`)

    def counted_with(self, ghdl: str, yosys: str) -> dict[str, Figures]:
        """Designs for Spartan-6 as these versions counted them; none for others."""
        return self.counted["spartan6"] if (ghdl, yosys) == (self.ghdl, self.yosys) else {}


@cache
def load_record() -> Record:
    """Read the file."""
    return Record.model_validate(json.loads(FILE.read_text(encoding="utf-8")))
