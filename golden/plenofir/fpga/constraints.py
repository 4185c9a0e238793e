# SPDX-License-Identifier: Apache-2.0
"""Constraints of a design (clock, crossings, pins), written in the language of each tool.

Registers on both sides of a crossing have names in the VHDL that begin with ``crossing_``; a file
beside each entity, ``ENTITY.toml``, names its paths and how they are limited. Tools keep these
names and append a suffix of their own.
"""

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Literal, get_args

from plenofir.ground.project import root

Language = Literal[
    "xdc", "quartus-sdc", "gowin-sdc", "radiant-pdc", "ucf", "lpf", "ccf", "cst", "pdc"
]
"""Vivado, Quartus, Gowin EDA, Radiant, ISE, Diamond; with pins alone GateMate, Gowin, Nexus."""

Limit = Literal["none", "reset", "skew", "delay", "memory"]
"""Limit of a path between clocks.

``none``: not timed. ``reset``: not timed, to asynchronous pins. ``skew``: bits of a Gray code, less
than a clock apart. ``delay``: at most a clock. ``memory``: the same, out of a memory of LUTs; there
is no such path if the memory is a block RAM.
"""


@dataclass(frozen=True)
class Crossing:
    """A path between two clocks: to registers, from registers or from anywhere."""

    to: str
    limit: Limit
    source: str | None = None

    def __str__(self) -> str:
        """Both ends in words."""
        return f"{self.source or 'any'} to {self.to}"


@cache
def described_crossings() -> Mapping[str, tuple[Crossing, ...]]:
    """Crossings by the entity that has them, from the files beside the VHDL."""
    crossings = {}
    for file in sorted((root() / "hdl").rglob("*.toml")):
        paths = tomllib.loads(file.read_text(encoding="utf-8")).get("path", ())
        if paths:
            crossings[file.stem] = tuple(
                Crossing(p["to"], p["limit"], p.get("from")) for p in paths
            )
    return crossings


@dataclass(frozen=True)
class Constraints:
    """Constraints of a design for a tool."""

    clocks: Mapping[str, float] = field(default_factory=dict)  # port to MHz
    crossings: tuple[Crossing, ...] = ()
    pins: Mapping[str, str] = field(default_factory=dict)  # port to the package's pin
    limit_mhz: float = 0  # of the fastest clock, where clocks are named elsewhere

    def text(self, language: Language) -> str:
        return "".join(f"{line}\n" for line in self._lines(language))

    def _lines(self, language: Language) -> Iterator[str]:
        for port, mhz in self.clocks.items():
            yield from _clock(language, port, mhz)
        # A limit of the shortest period holds for each pair of clocks.
        fastest = max((*self.clocks.values(), self.limit_mhz))
        period = f"{1000 / fastest:.3f}" if fastest else None
        for crossing in self.crossings:
            if period is None and crossing.limit not in ("none", "reset"):
                raise ValueError(f"{crossing} needs a clock")
            yield from _crossing(language, crossing, period)
        for port, pin in self.pins.items():
            yield _PINS[language].format(port=port, pin=pin)


def crossings_of(sources: Iterable[Path]) -> tuple[Crossing, ...]:
    """Crossings in a design with these sources, each named as its entity."""
    names = {source.stem for source in sources}
    paths = (
        path for name, paths in described_crossings().items() for path in paths * (name in names)
    )
    return tuple(dict.fromkeys(paths))


_PINS: Mapping[Language, str] = {
    "xdc": "set_property PACKAGE_PIN {pin} [get_ports {port}]",
    "radiant-pdc": "ldc_set_location -site {{{pin}}} [get_ports {port}]",
    "pdc": "ldc_set_location -site {{{pin}}} [get_ports {port}]",
    "cst": 'IO_LOC "{port}" {pin};',
    "ucf": 'NET "{port}" LOC = "{pin}";',
    "ccf": 'NET "{port}" Loc = "{pin}";',
    "lpf": 'LOCATE COMP "{port}" SITE "{pin}";',
}

# Lines for each limit, with the names of both ends and the shortest period in ns. Vivado's names of
# registers end with _reg. `-quiet` and `-nowarn`: a memory in a block RAM leaves nothing to match.
_CELLS = "[get_cells -hierarchical -filter {{NAME =~ *{%s}_reg*}}]"
_VIVADO = f"-datapath_only -from {_CELLS % 'source'} -to {_CELLS % 'to'} {{period}}"
_QUIET = _VIVADO.replace("get_cells", "get_cells -quiet")
# Quartus takes the period from the clocks; it must not judge setup and hold of paths whose length
# is limited.
_ENDS = "-from [get_keepers -nowarn {{*{source}*}}] -to [get_keepers -nowarn {{*{to}*}}]"
_SKEW = "-get_skew_value_from_clock_period min_clock_period -skew_value_multiplier 0.8"
_NET = "-max -get_value_from_clock_period min_clock_period -value_multiplier 0.8"
_QUARTUS = (
    f"set_net_delay {_ENDS} {_NET}",
    f"set_max_delay {_ENDS} 100",
    f"set_min_delay {_ENDS} -100",
)
_GOWIN = "set_max_delay -from [get_regs {{*{source}*}}] -to [get_regs {{*{to}*}}] {period}"
_RADIANT = (
    "set_max_delay -datapath_only -from [get_cells -hierarchical *{source}*] "
    "-to [get_cells -hierarchical *{to}*] {period}"
)
_ISE_TO = 'INST "*{to}*" TNM = FFS "{to}";'
_ISE_BOTH = 'TIMESPEC "TS_{to}" = FROM "{source}" TO "{to}" {period} ns DATAPATHONLY;'
_ISE = ('INST "*{source}*" TNM = FFS "{source}";', _ISE_TO, _ISE_BOTH)
_DIAMOND = 'MAXDELAY FROM CELL "*{source}*" TO CELL "*{to}*" {period} ns DATAPATH_ONLY;'
_LINES: Mapping[Language, Mapping[Limit, tuple[str, ...]]] = {
    "xdc": {
        "none": (f"set_false_path -to {_CELLS % 'to'}",),
        "reset": (
            "set_false_path -to [get_pins -hierarchical -filter {{NAME =~ *{to}_reg*/PRE}}]",
        ),
        "skew": (
            f"set_max_delay {_VIVADO}",
            f"set_bus_skew {_VIVADO.removeprefix('-datapath_only ')}",
        ),
        "delay": (f"set_max_delay {_VIVADO}",),
        "memory": (f"set_max_delay -quiet {_QUIET}",),
    },
    "quartus-sdc": {
        "none": ("set_false_path -to [get_registers {{*{to}*}}]",),
        "reset": (
            "set_false_path -to [get_pins -compatibility_mode -nowarn {{*{to}*|clrn}}]",
            "set_false_path -to [get_pins -compatibility_mode -nowarn {{*{to}*|aclr}}]",
        ),
        "skew": (f"set_max_skew {_ENDS} {_SKEW}", *_QUARTUS),
        "delay": _QUARTUS,
        "memory": _QUARTUS,
    },
    "gowin-sdc": {
        "none": ("set_false_path -to [get_regs {{*{to}*}}]",),
        "reset": ("set_false_path -to [get_regs {{*{to}*}}]",),
        "skew": (_GOWIN,),
        "delay": (_GOWIN,),
        # The memory is no register, and has no name to match.
        "memory": ("set_max_delay -to [get_regs {{*{to}*}}] {period}",),
    },
    "radiant-pdc": {
        "none": ("set_false_path -to [get_cells -hierarchical *{to}*]",),
        "reset": ("set_false_path -to [get_cells -hierarchical *{to}*]",),
        "skew": (_RADIANT,),
        "delay": (_RADIANT,),
        "memory": (_RADIANT,),
    },
    "ucf": {
        "none": (_ISE_TO, 'TIMESPEC "TS_{to}" = TO "{to}" TIG;'),
        "reset": (_ISE_TO, 'TIMESPEC "TS_{to}" = TO "{to}" TIG;'),
        "skew": _ISE,
        "delay": _ISE,
        "memory": ('INST "*{source}*" TNM = RAMS "{source}";', _ISE_TO, _ISE_BOTH),
    },
    "lpf": {
        "none": ('BLOCK PATH TO CELL "*{to}*";',),
        "reset": ('BLOCK PATH TO CELL "*{to}*";',),
        "skew": (_DIAMOND,),
        "delay": (_DIAMOND,),
        "memory": (_DIAMOND,),
    },
    "ccf": dict.fromkeys(get_args(Limit), ("# {both}: the file has no words for it.",)),
}


def _clock(language: Language, port: str, mhz: float) -> Iterator[str]:
    period = f"{1000 / mhz:.3f}"
    if language == "ucf":
        yield f'NET "{port}" TNM_NET = "{port}";'
        yield f'TIMESPEC "TS_{port}" = PERIOD "{port}" {period} ns HIGH 50 %;'
    elif language == "lpf":
        yield f'FREQUENCY PORT "{port}" {mhz:g} MHZ;'
    elif language == "ccf":
        yield f"# {port} has {mhz:g} MHz; the file has no words for it, p_r tells what it reaches."
    elif language in _LINES:
        yield f"create_clock -name {port} -period {period} [get_ports {port}]"
    else:
        raise ValueError(f"{language} has no clocks")


def _crossing(language: Language, crossing: Crossing, period: str | None) -> Iterator[str]:
    if language not in _LINES:
        raise ValueError(f"{language} has no paths")
    for line in _LINES[language][crossing.limit]:
        yield line.format(source=crossing.source, to=crossing.to, period=period, both=crossing)
