# SPDX-License-Identifier: Apache-2.0
"""The table of devices: resources, speed grades, the clocks that cores are trusted to reach."""

import re
from dataclasses import dataclass, field, replace

from plenofir.fpga.families import FAMILIES, Family


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
        return dict(zip(FAMILIES[family].names, amounts, strict=True))


GRADE_STEP = 0.85
"""Share of a clock that the next slower grade keeps: ECP5's grades 6 and 8 are 0.73 apart."""


@dataclass(frozen=True)
class Device:
    """An FPGA, with the amounts of its data sheet."""

    name: str  # as users type it, without package and speed grade
    total: Usage = field(default_factory=Usage)  # its resources
    package: str = ""  # the usual one
    pins: int = 0  # of the package that a design can use; 0 if not known
    family: Family = "spartan6"
    # As the vendor's tool names it, package included, with `{}` for the speed grade.
    part_pattern: str = ""
    grade: str = ""  # speed grade
    grades: tuple[str, ...] = ()  # all that the vendor sells, from slow to fast
    # Clocks that cores reach in `grade`: most pixels a clock, and MHz. Placed designs reach them
    # (tests check that); for Spartan-6 it is what the board's build requires; for families without
    # an open router, what the nearest family reaches (`assumed`).
    clocks_mhz: tuple[tuple[int, float], ...] = ((1, 74.25),)
    assumed: bool = False
    source: str = ""  # where the amounts are from

    @property
    def part(self) -> str:
        """The part as the vendor's tool names it, package and speed grade included."""
        return self.part_pattern.format(self.grade)

    def in_grade(self, grade: str) -> "Device":
        """The device in another speed grade; ValueError with the choice if there is none.

        Faster grades are trusted to no more than this one; slower ones lose `GRADE_STEP` each.
        """
        names = {name.lower().lstrip("-"): name for name in self.grades}
        chosen = names.get(grade.strip().lower().lstrip("-"))
        if chosen is None:
            choices = ", ".join(self.grades) or "no other"
            raise ValueError(f"the {self.title} comes in {choices}")
        slower = max(self.grades.index(self.grade) - self.grades.index(chosen), 0)
        clocks = tuple((most, round(mhz * GRADE_STEP**slower, 1)) for most, mhz in self.clocks_mhz)
        return replace(self, grade=chosen, clocks_mhz=clocks, assumed=self.assumed or bool(slower))

    @property
    def title(self) -> str:
        """Name as the vendor writes it."""
        return self.name.upper()

    def clock_mhz(self, pixels_per_clock: int) -> float:
        """Clock in MHz that cores with this many pixels a clock reach; 0 if unknown."""
        return next((mhz for most, mhz in self.clocks_mhz if pixels_per_clock <= most), 0)

    def amounts(self, usage: Usage) -> dict[str, int]:
        """Amount of each resource that a design takes, by the device's name for it."""
        return usage.amounts(self.family)

    def overflow(self, usage: Usage) -> list[str]:
        """Resources of which a design needs more than there are, each with both numbers."""
        totals = self.amounts(self.total)
        return [
            f"{needed} of {totals[name]} {name}"
            for name, needed in self.amounts(usage).items()
            if needed > totals[name]
        ]


_ECP5_CLOCKS = ((1, 110.0), (16, 80.0), (32, 70.0))
# LUTs (Cyclone V: ALMs), flip-flops, block RAMs of 18 Kbit (Cyclone V: 10, GateMate: 20),
# multipliers; package; the part with it, in brackets the grade that its clocks are known for
# (`_CLOCKS`). Sources: `_SOURCES`.
_Row = tuple[str, int, int, int, int, str, str]
_ROWS: dict[Family, tuple[_Row, ...]] = {
    "spartan6": (
        ("xc6slx9", 5720, 11440, 32, 16, "csg324", "xc6slx9-[3]csg324"),
        ("xc6slx16", 9112, 18224, 32, 32, "csg324", "xc6slx16-[3]csg324"),
        ("xc6slx25", 15032, 30064, 52, 38, "fgg484", "xc6slx25-[3]fgg484"),
        ("xc6slx45", 27288, 54576, 116, 58, "csg324", "xc6slx45-[3]csg324"),
        ("xc6slx75", 46648, 93296, 172, 132, "fgg484", "xc6slx75-[3]fgg484"),
        ("xc6slx100", 63288, 126576, 268, 180, "fgg484", "xc6slx100-[3]fgg484"),
        ("xc6slx150", 92152, 184304, 268, 180, "fgg484", "xc6slx150-[3]fgg484"),
    ),
    "series7": (
        ("xc7s6", 3750, 7500, 10, 10, "ftgb196", "xc7s6ftgb196-[1]"),
        ("xc7s15", 8000, 16000, 20, 20, "ftgb196", "xc7s15ftgb196-[1]"),
        ("xc7a12t", 8000, 16000, 40, 40, "cpg238", "xc7a12tcpg238-[1]"),
        ("xc7a15t", 10400, 20800, 50, 45, "csg324", "xc7a15tcsg324-[1]"),
        ("xc7z007s", 14400, 28800, 100, 66, "clg400", "xc7z007sclg400-[1]"),
        ("xc7s25", 14600, 29200, 90, 80, "csga324", "xc7s25csga324-[1]"),
        ("xc7a25t", 14600, 29200, 90, 80, "csg325", "xc7a25tcsg325-[1]"),
        ("xc7z010", 17600, 35200, 120, 80, "clg400", "xc7z010clg400-[1]"),
        ("xc7a35t", 20800, 41600, 100, 90, "csg324", "xc7a35tcsg324-[1]"),
        ("xc7a50t", 32600, 65200, 150, 120, "csg324", "xc7a50tcsg324-[1]"),
        ("xc7s50", 32600, 65200, 150, 120, "csga324", "xc7s50csga324-[1]"),
        ("xc7k70t", 41000, 82000, 270, 240, "fbg676", "xc7k70tfbg676-[1]"),
        ("xc7z015", 46200, 92400, 190, 160, "clg485", "xc7z015clg485-[1]"),
        ("xc7a75t", 47200, 94400, 210, 180, "csg324", "xc7a75tcsg324-[1]"),
        ("xc7s75", 48000, 96000, 180, 140, "fgga484", "xc7s75fgga484-[1]"),
        ("xc7z020", 53200, 106400, 280, 220, "clg400", "xc7z020clg400-[1]"),
        ("xc7a100t", 63400, 126800, 270, 240, "csg324", "xc7a100tcsg324-[1]"),
        ("xc7s100", 64000, 128000, 240, 160, "fgga484", "xc7s100fgga484-[1]"),
        ("xc7z030", 78600, 157200, 530, 400, "fbg676", "xc7z030fbg676-[1]"),
        ("xc7k160t", 101400, 202800, 650, 600, "fbg676", "xc7k160tfbg676-[1]"),
        ("xc7a200t", 134600, 269200, 730, 740, "fbg484", "xc7a200tfbg484-[1]"),
    ),
    "usplus": (
        ("xczu2eg", 47232, 94464, 300, 240, "sbva484", "xczu2eg-sbva484-[1]-e"),
        ("xczu3eg", 70560, 141120, 432, 360, "sbva484", "xczu3eg-sbva484-[1]-e"),
        ("xcku5p", 216960, 433920, 960, 1824, "ffvb676", "xcku5p-ffvb676-[1]-e"),
        ("xczu7ev", 230400, 460800, 624, 1728, "ffvc1156", "xczu7ev-ffvc1156-[1]-e"),
    ),
    "cyclonev": (
        ("5ceba4", 18480, 73920, 308, 132, "f23", "5CEBA4F23[C8]"),
        ("5cseba6", 41910, 167640, 553, 224, "u23", "5CSEBA6U23[I7]"),
    ),
    "ecp5": (
        ("lfe5u-12f", 24288, 24288, 56, 28, "cabga381", "LFE5U-12F-[6]BG381C"),
        ("lfe5u-25f", 24288, 24288, 56, 28, "cabga381", "LFE5U-25F-[6]BG381C"),
        ("lfe5u-45f", 43848, 43848, 108, 72, "cabga381", "LFE5U-45F-[6]BG381C"),
        ("lfe5u-85f", 83640, 83640, 208, 156, "cabga381", "LFE5U-85F-[6]BG381C"),
    ),
    "nexus": (
        ("lifcl-17", 13824, 13824, 24, 24, "cabga256", "LIFCL-17-[9]BG256C"),
        ("lfd2nx-17", 13824, 13824, 24, 24, "cabga256", "LFD2NX-17-[9]BG256C"),
        ("lifcl-40", 32256, 32256, 84, 56, "cabga400", "LIFCL-40-[9]BG400C"),
        ("lfd2nx-40", 32256, 32256, 84, 56, "cabga256", "LFD2NX-40-[9]BG256C"),
    ),
    "gw1n": (("gw1nr-9", 8640, 6480, 26, 20, "qn88p", "GW1NR-LV9QN88P[C6/I5]"),),
    "gw2a": (("gw2ar-18", 20736, 15552, 46, 48, "qn88", "GW2AR-LV18QN88[C8/I7]"),),
    "gw5a": (
        ("gw5a-25", 23040, 23040, 56, 0, "mg121n", "GW5A-LV25MG121N[C1/I0]"),
        ("gw5ast-138", 138240, 138240, 340, 0, "pg484a", "GW5AST-LV138PG484A[C1/I0]"),
    ),
    "gatemate": (("ccgm1a1", 40960, 40960, 64, 0, "fbga324", "CCGM1A1"),),
}
_NEXTPNR = "what nextpnr counts ({})"
_SOURCES: dict[Family, str] = {
    "spartan6": "Xilinx DS160, table 1",
    "series7": "Xilinx DS180, DS189 (Spartan-7), DS190 (Zynq-7000); a block RAM of 36 Kbit counts "
    "twice",
    "usplus": "Xilinx DS890, DS891; a block RAM of 36 Kbit counts twice",
    "cyclonev": "what Quartus Prime's fitter says that the part has (5CEBA4F23C8: 18,480 ALMs, 308 "
    "M10K, 66 DSP blocks; 5CSEBA6U23I7: 41,910, 553, 112); an ALM has four flip-flops, a DSP block "
    "two multipliers. The data sheet (CV-51001) has 41,509 ALMs and 557 M10K for the 5CSEBA6",
    "ecp5": f"{_NEXTPNR.format('prjtrellis')}; Lattice FPGA-DS-02012",
    "nexus": f"{_NEXTPNR.format('prjoxide')}; Lattice FPGA-DS-02049",
    "gw1n": f"{_NEXTPNR.format('apicula')}; Gowin DS117",
    "gw2a": f"{_NEXTPNR.format('apicula')}; Gowin DS226",
    "gw5a": f"{_NEXTPNR.format('apicula')}, for the GW5A-25; Gowin DS1103, and DS1228 for the "
    "GW5AST-138. Their multipliers are not counted: Yosys has no rule for them",
    "gatemate": f"{_NEXTPNR.format('peppercorn')}; Cologne Chip DS1001. Multipliers are logic",
}
_CLOCKS: dict[Family, tuple[tuple[int, float], ...]] = {
    "spartan6": ((1, 74.25),),
    "ecp5": _ECP5_CLOCKS,
    "nexus": ((1, 140.0), (16, 110.0)),
    "gw1n": ((1, 60.0),),
    "gw2a": ((1, 100.0), (8, 80.0)),
    "gw5a": ((1, 100.0), (8, 80.0)),
    "gatemate": ((1, 25.0),),
}
# 28 nm, so at least as fast as ECP5 (40 nm).
_ASSUMED: tuple[Family, ...] = ("series7", "usplus", "cyclonev")
# Inputs and outputs of the usual package, by the same documents (Zynq: of its logic; Cyclone V: the
# product table). Missing are those that were not found.
_PINS = {
    **{"xc6slx9": 200, "xc6slx16": 232, "xc6slx25": 266, "xc6slx45": 218, "xc6slx75": 280},
    **{"xc6slx100": 326, "xc6slx150": 338, "xc7z010": 100, "xc7z020": 125, "xc7a35t": 210},
    **{"xc7k70t": 300, "xc7a100t": 210, "5ceba4": 224, "5cseba6": 145},
    **{"lfe5u-12f": 197, "lfe5u-25f": 197, "lfe5u-45f": 203, "lfe5u-85f": 205, "gw2ar-18": 66},
    **{"xc7s25": 150, "xc7s50": 210, "xc7s75": 338, "xc7s100": 338, "xc7a15t": 210},
    **{"xc7a25t": 150, "xc7a50t": 210, "xc7a75t": 210, "xc7a200t": 285, "xc7z007s": 100},
    **{"xc7k160t": 400, "ccgm1a1": 162},
}
# By the beginning of a device's name, from slow to fast.
_GRADES: dict[str, tuple[str, ...]] = {
    "xc6slx": ("2", "3"),
    "xc7": ("1", "2", "3"),
    "xc7s": ("1", "2"),
    "xczu": ("1", "2"),
    "xcku": ("1", "2", "3"),
    "5ce": ("C8", "C7", "C6"),
    "5cse": ("I7", "C6"),
    "lfe5u": ("6", "7", "8"),
    "lifcl": ("7", "8", "9"),
    "lfd2nx": ("7", "8", "9"),
    "gw1nr": ("C5/I4", "C6/I5", "C7/I6"),
    "gw2ar": ("C7/I6", "C8/I7", "C9/I8"),
    "gw5a": ("C1/I0", "C2/I1"),
    "ccgm": (),
}


def family_clocks(family: Family) -> tuple[tuple[int, float], ...]:
    """Clocks that cores are trusted to keep on a family: most pixels a clock, and MHz."""
    return _CLOCKS.get(family, _ECP5_CLOCKS)


_OTHER_NAMES = {
    "gw2a-18": "gw2ar-18",
    "gw5a-25a": "gw5a-25",
    "gw5ast-138c": "gw5ast-138",
    "gatemate": "ccgm1a1",
    "lifcl-40-9": "lifcl-40",
}


def _device(family: Family, row: _Row) -> Device:
    name, lut, flip_flops, blocks, dsp, package, part = row
    before, grade, after = re.split(r"[\[\]]", part) if "[" in part else (part, "", "")
    grades = max((start for start in _GRADES if name.startswith(start)), key=len)
    return Device(
        name,
        Usage(lut, flip_flops, blocks, dsp=dsp),
        package,
        _PINS.get(name, 0),
        family,
        f"{before}{{}}{after}",
        grade,
        _GRADES[grades],
        family_clocks(family),
        family in _ASSUMED,
        _SOURCES[family],
    )


DEVICES = {row[0]: _device(family, row) for family, rows in _ROWS.items() for row in rows}
"""All devices by name; those of a family from small to large."""
DEFAULT_DEVICE = "xc6slx45"
"""Device of a scene that names none."""
ECP5 = {name: device for name, device in DEVICES.items() if device.family == "ecp5"}


def device_name(text: str) -> str:
    """A device's name in the table from what people type: any case, with package and grade."""
    typed = text.strip().lower()
    names = _OTHER_NAMES | {device.part.lower(): name for name, device in DEVICES.items()}
    if typed in names:
        return names[typed]
    prefixes = [name for name in DEVICES if re.match(rf"{name}(?!\d)", typed)]
    return max(prefixes, key=len, default=typed)
