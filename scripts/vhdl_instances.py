# SPDX-License-Identifier: Apache-2.0
"""Instances and clocks of a VHDL source, as `plenofir.fpga.hdl_text` reads its declarations."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from plenofir.fpga.hdl_text import without_comments


@dataclass(frozen=True)
class Instance:
    """One instance: label, entity or component, and the actuals of its generics and ports."""

    label: str
    of: str
    is_component: bool
    generics: dict[str, str]
    ports: dict[str, str]


_INSTANCE = re.compile(r"^\s+(\w+) : (entity work\.|component )(\w+)$", re.M)


def _map(text: str, kind: str) -> dict[str, str]:
    """Associations of the generic or port map at the beginning of the text, if there is one."""
    begin = re.match(rf"\s*{kind} map\s*\(", text)
    if begin is None:
        return {}
    parts = [""]
    depth = 1
    for character in text[begin.end() :]:
        depth += {"(": 1, ")": -1}.get(character, 0)
        if depth == 0:
            break
        if character == "," and depth == 1:
            parts.append("")
        else:
            parts[-1] += character
    pairs = (part.split("=>", 1) for part in parts)
    return {formal.strip(): " ".join(actual.split()) for formal, actual in pairs}


def instances(text: str) -> Iterator[Instance]:
    """Read the instances of a source; those in a generate statement come once."""
    plain = without_comments(text)
    for match in _INSTANCE.finditer(plain):
        rest = plain[match.end() :].split(";", 1)[0]
        generics = _map(rest, "generic")
        at_ports = re.search(r"\bport map\b", rest)
        ports = _map(rest[at_ports.start() :], "port") if at_ports else {}
        yield Instance(match[1], match[3], match[2] == "component ", generics, ports)


def clocks(text: str) -> set[str]:
    """Names of the signals whose rising edge a source waits for."""
    return set(re.findall(r"\brising_edge\((\w+)\)", without_comments(text)))


def renamings(text: str) -> list[tuple[str, str]]:
    """Assignments of one signal to another, as they are: target and source."""
    return re.findall(r"^  (\w+)\s+<= (\w+);$", without_comments(text), re.M)
