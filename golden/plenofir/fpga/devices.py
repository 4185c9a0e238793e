"""What a device has and what a design takes of it."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Usage:
    """Resources that a design takes.

    Attributes
    ----------
    lut
        Look-up tables with six inputs, those used as memory and shift registers included.
    flip_flops
        Flip-flops.
    ramb16, ramb8
        Block RAMs of 18 Kbit, and halves of them used as RAM of 9 Kbit.
    dsp
        DSP48A1 slices.
    """

    lut: int = 0
    flip_flops: int = 0
    ramb16: int = 0
    ramb8: int = 0
    dsp: int = 0

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

    def amounts(self) -> dict[str, int]:
        """Amount of each resource that a device has, by the device's name for it.

        Returns
        -------
        dict
            Name to amount.
        """
        return {
            "LUT": self.lut,
            "flip-flops": self.flip_flops,
            "block RAM (18 Kbit)": self.block_rams,
            "DSP48A1": self.dsp,
        }


@dataclass(frozen=True)
class Device:
    """An FPGA of the Spartan-6 LX family (Xilinx DS160, table 1).

    Attributes
    ----------
    name
        Part without package and speed grade.
    total
        What it has.
    package
        A package it comes in, with the slowest usual speed grade: part for the tools.
    """

    name: str
    total: Usage = field(default_factory=Usage)
    package: str = "csg324"

    def overflow(self, usage: Usage) -> list[str]:
        """Resources that a design needs more of than the device has.

        Parameters
        ----------
        usage
            What the design takes.

        Returns
        -------
        list of str
            One text for each, with both numbers; empty if the design fits.
        """
        totals = self.total.amounts()
        return [
            f"{needed} of {totals[name]} {name}"
            for name, needed in usage.amounts().items()
            if needed > totals[name]
        ]


def _device(name: str, lut: int, ramb16: int, dsp: int, package: str) -> Device:
    return Device(name, Usage(lut=lut, flip_flops=2 * lut, ramb16=ramb16, dsp=dsp), package)


DEVICES = {
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
"""Devices by name, from small to large."""
