# SPDX-License-Identifier: Apache-2.0
"""Families of FPGAs: what each calls its parts, and how Yosys maps a design to them.

A row holds all facts of a family for estimates and for counting netlists. Memories and multipliers
follow the rules of Yosys (``memory_libmap``, ``memory_bram``, ``mul2dsp``) with the numbers of its
technology files, so that block RAM and multipliers are predicted exactly.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Family = Literal[
    "spartan6", "series7", "usplus", "cyclonev", "ecp5", "nexus", "gw1n", "gw2a", "gw5a", "gatemate"
]


@dataclass(frozen=True)
class BlockRam:
    """A kind of block RAM."""

    cost: int  # its cost in Yosys
    widths: Mapping[int, int]  # bits of a word for each number of address bits
    units: int = 1  # in blocks as the family's devices are counted
    half: bool = False  # whether it is half a block
    byte: int = 9  # bits with a write enable of their own: words are rounded up to a multiple


@dataclass(frozen=True)
class LutRam:
    """Memory in look-up tables: one write port, one read port."""

    words: tuple[int, ...]  # of one memory, for each of its widths
    widths: tuple[int, ...]
    cost: float
    luts: int  # of one memory
    # Least width in bits that is charged, if the cost grows with the width.
    scaled: bool = False


@dataclass(frozen=True)
class Multiplier:
    """A rule of ``mul2dsp``: the largest and the least widths of both factors."""

    most: tuple[int, int]
    least: tuple[int, int]
    units: int  # in multipliers as devices are counted
    part: int = 0  # bits of the parts of a divided first factor; 0: the largest
    signed: bool = False  # factors are signed: unsigned ones need one more bit
    product: int = 0  # bits of the smallest product


@dataclass(frozen=True)
class Facts:
    """All that is known of a family."""

    title: str
    # LUTs, flip-flops, block RAMs, multipliers, as the vendor calls them.
    names: tuple[str, str, str, str]
    synthesis: str  # Yosys's command
    cells: tuple[Mapping[str, float], ...]  # what each cell takes, in the order of `names`
    block_rams: tuple[BlockRam, ...]
    lut_ram: LutRam | None
    multipliers: tuple[Multiplier, ...] = ()
    rom_cost: float = 1 / 16  # Yosys's cost of a bit of a ROM in logic
    # ``memory_bram`` instead of ``memory_libmap``: the best filled block RAM, if at least 5 % full.
    fullest: bool = False
    ports: str = ""  # option of Yosys that leaves out pads, so that ports need no pins


def _widths(address_bits: int, *widths: int) -> dict[int, int]:
    """Widths by address bits, from the deepest configuration on."""
    return {address_bits - i: width for i, width in enumerate(widths)}


_18K = _widths(14, 1, 2, 4, 9, 18, 36)
_XILINX_CELLS: dict[str, float] = {
    **{f"LUT{inputs}": 1 for inputs in range(1, 7)},
    # LUTs as memory come in slices of four.
    **{"RAM32M": 4, "RAM64M": 4, "RAM32X1D": 2, "RAM64X1D": 2, "RAM128X1D": 4},
    **{"SRL16E": 1, "SRLC32E": 1},
}
_XILINX_FLIP_FLOPS: dict[str, float] = dict.fromkeys(("FDRE", "FDSE", "FDCE", "FDPE"), 1)
_XILINX_LUT_RAM = LutRam((32, 64), (6, 3), 8, 4, scaled=True)
_DPR16X4 = LutRam((16,), (4,), 4, 4)
_GOWIN_FLIP_FLOPS: dict[str, float] = dict.fromkeys(
    (f"DFF{kind}{enable}" for kind in ("", "R", "S", "P", "C") for enable in ("", "E")), 1
)
_GOWIN_BLOCKS: dict[str, float] = dict.fromkeys(
    ("SP", "SPX9", "SDPB", "SDPX9B", "DPB", "DPX9B", "pROM", "pROMX9"), 1
)
_GOWIN_LUTS: dict[str, float] = {
    **{f"LUT{inputs}": 1 for inputs in range(1, 5)},
    **{"ALU": 1, "RAM16SDP4": 4},
}


def _gowin(name: str, title: str, *, multiplies: bool) -> Facts:
    multipliers = (
        Multiplier((36, 36), (22, 22), 4),
        Multiplier((18, 18), (10, 4), 1),
        Multiplier((9, 9), (4, 4), 1),
    )
    return Facts(
        title=title,
        names=("LUT4", "flip-flops", "BSRAM (18 Kbit)", "MULT18X18"),
        synthesis=f"synth_gowin -family {name} -no-rw-check",
        cells=(
            _GOWIN_LUTS,
            _GOWIN_FLIP_FLOPS,
            _GOWIN_BLOCKS,
            {"MULT9X9": 1, "MULT18X18": 1, "MULT36X36": 4},
        ),
        block_rams=(BlockRam(128, _18K),),
        lut_ram=LutRam((16,), (4,), 4, 4, scaled=True),
        # Yosys has no rule for the multipliers of GW5A: products are logic there.
        multipliers=multipliers if multiplies else (),
        ports="-noiopads",
    )


FAMILIES: dict[Family, Facts] = {
    "spartan6": Facts(
        title="Spartan-6",
        names=("LUT", "flip-flops", "block RAM (18 Kbit)", "DSP48A1"),
        synthesis="synth_xilinx -family xc6s -flatten -ise",
        cells=(
            _XILINX_CELLS,
            _XILINX_FLIP_FLOPS,
            {"RAMB16BWER": 1, "RAMB8BWER": 0.5},
            {"DSP48A1": 1},
        ),
        block_rams=(
            BlockRam(65, _widths(13, 1, 2, 4, 9, 18, 36), half=True),
            BlockRam(129, _18K),
        ),
        lut_ram=_XILINX_LUT_RAM,
        multipliers=(Multiplier((18, 18), (2, 2), 1, signed=True, product=9),),
        rom_cost=1 / 64,
        ports="-noiopad",
    ),
    "series7": Facts(
        title="7 series",
        names=("LUT", "flip-flops", "block RAM (18 Kbit)", "DSP48E1"),
        synthesis="synth_xilinx -family xc7 -flatten -noclkbuf",
        cells=(
            _XILINX_CELLS,
            _XILINX_FLIP_FLOPS,
            {"RAMB18E1": 1, "RAMB36E1": 2},
            {"DSP48E1": 1},
        ),
        block_rams=(
            BlockRam(129, _18K),
            BlockRam(257, _widths(15, 1, 2, 4, 9, 18, 36, 72), units=2),
        ),
        lut_ram=_XILINX_LUT_RAM,
        multipliers=(Multiplier((25, 18), (2, 2), 1, part=18, signed=True, product=9),),
        rom_cost=1 / 64,
        ports="-noiopad",
    ),
    "usplus": Facts(
        title="UltraScale+",
        names=("LUT", "flip-flops", "block RAM (18 Kbit)", "DSP48E2"),
        synthesis="synth_xilinx -family xcup -flatten -noclkbuf",
        cells=(
            _XILINX_CELLS,
            _XILINX_FLIP_FLOPS,
            {"RAMB18E2": 1, "RAMB36E2": 2},
            {"DSP48E2": 1},
        ),
        block_rams=(
            BlockRam(129, _18K),
            BlockRam(257, _widths(15, 1, 2, 4, 9, 18, 36, 72), units=2),
        ),
        lut_ram=_XILINX_LUT_RAM,
        multipliers=(Multiplier((27, 18), (2, 2), 1, part=18, signed=True, product=9),),
        rom_cost=1 / 64,
        ports="-noiopad",
    ),
    "cyclonev": Facts(
        title="Cyclone V",
        names=("ALM", "flip-flops", "M10K", "multipliers 18x18"),
        synthesis="synth_intel_alm -noclkbuf",
        # An ALM is a look-up table of six inputs, or two smaller ones; two bits of an MLAB.
        cells=(
            {
                "MISTRAL_ALUT6": 1,
                **dict.fromkeys((f"MISTRAL_ALUT{n}" for n in range(2, 6)), 0.5),
                "MISTRAL_ALUT_ARITH": 0.5,
                "MISTRAL_MLAB": 0.5,
            },
            {"MISTRAL_FF": 1},
            {"MISTRAL_M10K": 1},
            {"MISTRAL_MUL9X9": 1, "MISTRAL_MUL18X18": 1, "MISTRAL_MUL27X27": 2},
        ),
        block_rams=(BlockRam(1, _widths(13, 1, 2, 5, 10, 20, 40)),),
        lut_ram=LutRam((32,), (1,), 1, 1),
        multipliers=(
            Multiplier((27, 27), (19, 4), 2),
            Multiplier((18, 18), (10, 4), 1),
            Multiplier((9, 9), (4, 4), 1),
        ),
        fullest=True,
        ports="-noiopad",
    ),
    "ecp5": Facts(
        title="ECP5",
        names=("LUT4", "flip-flops", "block RAM (18 Kbit)", "MULT18X18D"),
        synthesis="synth_ecp5 -no-rw-check",
        cells=(
            {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 6, "PFUMX": 0, "L6MUX21": 0},
            {"TRELLIS_FF": 1},
            {"DP16KD": 1},
            {"MULT18X18D": 1},
        ),
        block_rams=(BlockRam(128, _18K),),
        lut_ram=_DPR16X4,
        multipliers=(Multiplier((18, 18), (2, 2), 1, product=9),),
    ),
    "nexus": Facts(
        title="Nexus",
        names=("LUT4", "flip-flops", "EBR (18 Kbit)", "MULT18X18"),
        synthesis="synth_lattice -family lifcl -no-rw-check",
        cells=(
            {"LUT4": 1, "WIDEFN9": 2, "CCU2": 2, "DPR16X4": 4},
            dict.fromkeys(("FD1P3IX", "FD1P3JX", "FD1P3BX", "FD1P3DX"), 1),
            dict.fromkeys(("PDPSC16K", "PDP16K", "DP16K"), 1),
            {"MULT9X9": 1, "MULT18X18": 1, "MULT18X36": 2, "MULT36X36": 4},
        ),
        block_rams=(BlockRam(128, _18K),),
        lut_ram=_DPR16X4,
        # Yosys counts these where a register follows the product, as all here have one.
        multipliers=(
            Multiplier((36, 36), (19, 19), 4),
            Multiplier((36, 18), (19, 2), 2),
            Multiplier((18, 18), (2, 2), 1),
        ),
        ports="-noiopad",
    ),
    "gw1n": _gowin("gw1n", "GW1N", multiplies=True),
    "gw2a": _gowin("gw2a", "GW2A", multiplies=True),
    "gw5a": _gowin("gw5a", "GW5A", multiplies=False),
    "gatemate": Facts(
        title="GateMate",
        names=("CPE halves", "flip-flops", "block RAM (20 Kbit)", "multipliers"),
        synthesis="synth_gatemate -luttree -noclkbuf",
        cells=(
            {
                **dict.fromkeys(("CC_L2T4", "CC_L2T5", "CC_LUT1", "CC_LUT2"), 1),
                **{"CC_MX2": 1, "CC_MX4": 2, "CC_ADDF": 1},
            },
            {"CC_DFF": 1},
            {"CC_BRAM_20K": 1, "CC_BRAM_40K": 2},
            {},
        ),
        block_rams=(
            BlockRam(129, _widths(14, 1, 2, 5, 10, 20, 40), byte=1),
            BlockRam(257, _widths(15, 1, 2, 5, 10, 20, 40, 80), units=2, byte=1),
        ),
        lut_ram=None,
        ports="-noiopad",
    ),
}
"""Families by name."""
MULTIPLYING = tuple(name for name, facts in FAMILIES.items() if facts.multipliers)
"""Families whose devices have multipliers that Yosys uses."""
