# SPDX-License-Identifier: Apache-2.0
"""User constraints (UCF): the statements that the board's file is made of.

Syntax: Xilinx UG625, Constraints Guide. Only the statements that are used here are understood;
others are refused, so that a typing error is found without ISE.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from plenofir.ground.errors import InputError


@dataclass
class Constraints:
    """Contents of a UCF file."""

    config: dict[str, str] = field(default_factory=dict)  # settings of the whole device
    # Net to LOC, IOSTANDARD and so on; True for those without a value.
    pins: dict[str, dict[str, str | bool]] = field(default_factory=dict)
    located_twice: list[str] = field(default_factory=list)  # nets that have several LOC
    # Group of registers to the nets whose registers are in it (TNM_NET).
    groups: dict[str, list[str]] = field(default_factory=dict)
    # Group to the groups that it is made of (TIMEGRP).
    unions: dict[str, list[str]] = field(default_factory=dict)
    # Group to the period of its clock in ns.
    periods: dict[str, float] = field(default_factory=dict)
    # Pairs of groups to the longest delay between them in ns, whatever their clocks do.
    limits: dict[tuple[str, str], float] = field(default_factory=dict)
    untimed: list[str] = field(default_factory=list)  # nets whose paths are not timed (TIG)

    def members(self, group: str) -> list[str]:
        """Nets of a group, with groups of groups resolved; none if there is no such group."""
        if group in self.unions:
            return [net for part in self.unions[group] for net in self.members(part)]
        return self.groups.get(group, [])


_NAME = r'"([^"]+)"'
_ATTRIBUTES = {"LOC", "IOSTANDARD", "PULLUP", "DRIVE", "SLEW", "TNM_NET"}


def _statements(path: Path) -> list[tuple[int, str]]:
    """Statements with the line that each begins in."""
    statements = []
    current, begin = "", 0
    lines = path.read_text().splitlines()
    for number, line in enumerate(lines, 1):
        rest = line.split("#", 1)[0].strip()
        while rest:
            begin = begin or number
            part, end, rest = rest.partition(";")
            current = f"{current} {part.strip()}".strip()
            rest = rest.strip()
            if end:
                statements.append((begin, current))
                current, begin = "", 0
    if current:
        raise InputError(f"there is no ; behind {current!r}", where=f"{path}:{begin}")
    return statements


def read_constraints(path: Path) -> Constraints:
    """Read a UCF file; InputError names the line that is not understood."""
    out = Constraints()
    for line, text in _statements(path):
        where = f"{path}:{line}"
        statement = " ".join(text.split())
        if match := re.fullmatch(r"CONFIG (\w+) ?= ?(\S+)", statement):
            out.config[match[1]] = match[2]
        elif match := re.fullmatch(rf"NET {_NAME} TIG", statement):
            out.untimed.append(match[1])
        elif match := re.fullmatch(rf"NET {_NAME} (.+)", statement):
            _net(out, match[1], match[2], where)
        elif match := re.fullmatch(rf'TIMEGRP {_NAME} = ((?:"[^"]+" ?)+)', statement):
            out.unions[match[1]] = re.findall(_NAME, match[2])
        elif match := re.fullmatch(
            rf'TIMESPEC "TS_\w+" = PERIOD {_NAME} ([\d.]+) ns HIGH 50 ?%', statement
        ):
            out.periods[match[1]] = float(match[2])
        elif match := re.fullmatch(
            rf'TIMESPEC "TS_\w+" = FROM {_NAME} TO {_NAME} ([\d.]+) ns DATAPATHONLY', statement
        ):
            out.limits[match[1], match[2]] = float(match[3])
        else:
            raise InputError(
                f"{statement!r} is not understood; use CONFIG, NET, TIMEGRP, or TIMESPEC "
                "with PERIOD or FROM TO and DATAPATHONLY",
                where=where,
            )
    return out


def _net(out: Constraints, net: str, attributes: str, where: str) -> None:
    """Take the attributes of a NET statement."""
    for part in attributes.split("|"):
        name, sign, value = (word.strip() for word in part.partition("="))
        if name not in _ATTRIBUTES or (sign == "=") == (name == "PULLUP"):
            raise InputError(
                f"{part.strip()!r} is not understood; use {', '.join(sorted(_ATTRIBUTES))}",
                where=where,
            )
        value = value.strip('"')
        if name == "TNM_NET":
            out.groups.setdefault(value, []).append(net)
            continue
        kept = out.pins.setdefault(net, {})
        if name == "LOC" and "LOC" in kept:
            out.located_twice.append(net)
        kept[name] = value if sign else True
