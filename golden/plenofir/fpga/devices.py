# SPDX-License-Identifier: Apache-2.0
"""What a device has and what a design takes of it."""

from dataclasses import dataclass, field
from typing import Literal

Family = Literal["spartan6", "ecp5"]

_NAMES: dict[Family, tuple[str, str, str, str]] = {
    "spartan6": ("LUT", "flip-flops", "block RAM (18 Kbit)", "DSP48A1"),
    "ecp5": ("LUT4", "flip-flops", "block RAM (18 Kbit)", "MULT18X18D"),
}


@dataclass(frozen=True)
class Usage:
    """Resources that a design takes."""

    # Look-up tables of six inputs (ECP5: four), those used as memory and shift registers included.
    lut: int = 0
    flip_flops: int = 0
    ramb16: int = 0  # block RAMs of 18 Kbit
    ramb8: int = 0  # halves of them, used as RAM of 9 Kbit
    dsp: int = 0  # multipliers: DSP48A1 slices, or MULT18X18D

    @property
    def block_rams(self) -> int:
        """Block RAMs of 18 Kbit that are in use, two halves to each."""
        return self.ramb16 + -(-self.ramb8 // 2)

    def __add__(self, other: "Usage") -> "Usage":
        """Resources of both."""
        return Usage(
            self.lut + other.lut,
            self.flip_flops + other.flip_flops,
            self.ramb16 + other.ramb16,
            self.ramb8 + other.ramb8,
            self.dsp + other.dsp,
        )

    def __mul__(self, copies: int) -> "Usage":
        """Resources of several copies."""
        return Usage(
            self.lut * copies,
            self.flip_flops * copies,
            self.ramb16 * copies,
            self.ramb8 * copies,
            self.dsp * copies,
        )

    def amounts(self, family: Family = "spartan6") -> dict[str, int]:
        """Amount of each resource, by the name that devices of a family have for it."""
        amounts = (self.lut, self.flip_flops, self.block_rams, self.dsp)
        return dict(zip(_NAMES[family], amounts, strict=True))


@dataclass(frozen=True)
class Device:
    """An FPGA: Spartan-6 LX (Xilinx DS160, table 1) or ECP5 (Lattice FPGA-DS-02012)."""

    name: str  # part without package and speed grade
    total: Usage = field(default_factory=Usage)  # what it has
    # That it comes in, with the slowest usual speed grade: part for the tools.
    package: str = "csg324"
    family: Family = "spartan6"
    # Clocks that cores keep in the slowest grade: the most pixels a clock, and MHz. ECP5: what
    # placed designs reach at least, which tests hold. Spartan-6: what the board's build asks for;
    # none with several, as there is no open router that could tell.
    clocks_mhz: tuple[tuple[int, float], ...] = ((1, 74.25),)

    def clock_mhz(self, pixels_per_clock: int) -> float:
        """Clock in MHz that cores with so many pixels a clock keep; 0 if it is not known."""
        return next((mhz for most, mhz in self.clocks_mhz if pixels_per_clock <= most), 0)

    def amounts(self, usage: Usage) -> dict[str, int]:
        """Amount of each resource that a design takes, by the device's name for it."""
        return usage.amounts(self.family)

    def overflow(self, usage: Usage) -> list[str]:
        """Resources that a design needs more of than there are, each with both numbers."""
        totals = self.amounts(self.total)
        return [
            f"{needed} of {totals[name]} {name}"
            for name, needed in self.amounts(usage).items()
            if needed > totals[name]
        ]


def _device(name: str, lut: int, ramb16: int, dsp: int, package: str) -> Device:
    return Device(name, Usage(lut=lut, flip_flops=2 * lut, ramb16=ramb16, dsp=dsp), package)


def _ecp5(name: str, lut: int, blocks: int, dsp: int) -> Device:
    total = Usage(lut=lut, flip_flops=lut, ramb16=blocks, dsp=dsp)
    clocks = ((1, 110), (16, 80), (32, 70))
    return Device(name, total, "cabga381", "ecp5", clocks_mhz=clocks)


SPARTAN6 = {
    device.name: device
    for device in (
        _device("xc6slx9", 5720, 32, 16, "csg324"),
        _device("xc6slx16", 9112, 32, 32, "csg324"),
        _device("xc6slx25", 15032, 52, 38, "fgg484"),
        _device("xc6slx45", 27288, 116, 58, "csg324"),
        _device("xc6slx75", 46648, 172, 132, "fgg484"),
        _device("xc6slx100", 63288, 268, 180, "fgg484"),
        _device("xc6slx150", 92152, 268, 180, "fgg484"),
    )
}
"""Spartan-6 by name, from small to large."""

ECP5 = {
    device.name: device
    for device in (
        _ecp5("lfe5u-25f", 24288, 56, 28),
        _ecp5("lfe5u-45f", 43848, 108, 72),
        _ecp5("lfe5u-85f", 83640, 208, 156),
    )
}
"""ECP5 by name, from small to large."""

DEVICES = SPARTAN6 | ECP5
"""All devices."""
