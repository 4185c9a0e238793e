# SPDX-License-Identifier: Apache-2.0
"""Constraints of a design (clock, crossings, pins), written in the language of each tool.

Crossings from one clock to another are registers whose names in the VHDL begin with ``crossing_``
(`CROSSINGS`). Tools keep these names and append a suffix of their own.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

Language = Literal[
    "xdc", "quartus-sdc", "gowin-sdc", "radiant-pdc", "ucf", "lpf", "ccf", "cst", "pdc"
]
"""Vivado, Quartus, Gowin EDA, Radiant, ISE, Diamond; with pins alone GateMate, Gowin, Nexus."""


@dataclass(frozen=True)
class Crossing:
    """Registers between two clocks, with paths to or from them that are not timed."""

    register: str
    end: Literal["to", "from"]


CROSSINGS: Mapping[str, Crossing] = {
    # Levels and resets may be sampled at any time; data are stable while they are sampled.
    "synchroniser": Crossing("crossing_first", "to"),
    "reset_bridge": Crossing("crossing_reset", "to"),
    "bus_crossing": Crossing("crossing_data", "from"),
}
"""By the entity that has them."""


@dataclass(frozen=True)
class Constraints:
    """Constraints of a design for a tool."""

    clocks: Mapping[str, float] = field(default_factory=dict)  # port to MHz
    crossings: tuple[Crossing, ...] = ()
    pins: Mapping[str, str] = field(default_factory=dict)  # port to the package's pin

    def text(self, language: Language) -> str:
        return "".join(f"{line}\n" for line in self._lines(language))

    def _lines(self, language: Language) -> Iterator[str]:
        for port, mhz in self.clocks.items():
            yield from _clock(language, port, mhz)
        for crossing in self.crossings:
            yield from _crossing(language, crossing)
        for port, pin in self.pins.items():
            yield _PINS[language].format(port=port, pin=pin)


def crossings_of(sources: Iterable[Path]) -> tuple[Crossing, ...]:
    """Crossings in a design with these sources, each named as its entity."""
    names = {source.stem for source in sources}
    return tuple(crossing for entity, crossing in CROSSINGS.items() if entity in names)


_PINS: Mapping[Language, str] = {
    "xdc": "set_property PACKAGE_PIN {pin} [get_ports {port}]",
    "radiant-pdc": "ldc_set_location -site {{{pin}}} [get_ports {port}]",
    "pdc": "ldc_set_location -site {{{pin}}} [get_ports {port}]",
    "cst": 'IO_LOC "{port}" {pin};',
    "ucf": 'NET "{port}" LOC = "{pin}";',
    "ccf": 'NET "{port}" Loc = "{pin}";',
    "lpf": 'LOCATE COMP "{port}" SITE "{pin}";',
}
# Pattern by which each tool finds registers; Vivado's names end with _reg.
_REGISTERS: Mapping[Language, str] = {
    "xdc": "[get_cells -hierarchical -filter {{NAME =~ *{name}_reg*}}]",
    "quartus-sdc": "[get_registers {{*{name}*}}]",
    "gowin-sdc": "[get_regs {{*{name}*}}]",
    "radiant-pdc": "[get_cells -hierarchical *{name}*]",
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
    elif language in _REGISTERS:
        yield f"create_clock -name {port} -period {period} [get_ports {port}]"
    else:
        raise ValueError(f"{language} has no clocks")


def _crossing(language: Language, crossing: Crossing) -> Iterator[str]:
    name, end = crossing.register, crossing.end
    if language == "ucf":
        yield f'INST "*{name}*" TNM = FFS "{name}";'
        yield f'TIMESPEC "TS_{name}" = {end.upper()} "{name}" TIG;'
    elif language == "ccf":
        yield f"# Paths {end} {name} need no time."
    elif language == "lpf":
        yield f'BLOCK PATH {end.upper()} CELL "*{name}*";'
    elif language in _REGISTERS:
        yield f"set_false_path -{end} {_REGISTERS[language].format(name=name)}"
    else:
        raise ValueError(f"{language} has no paths")
