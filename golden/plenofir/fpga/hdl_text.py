# SPDX-License-Identifier: Apache-2.0
"""Reads declarations from a VHDL source: generics, ports, instances, clocks.

The sources are written in one style (``scripts/vsg.yaml``), so that a few patterns read them.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Declaration:
    """One generic or port: name, mode (ports), type, default, and the comment that explains it."""

    name: str
    mode: str
    type_name: str
    default: str
    comment: str

    def bits(self) -> list[str]:
        """Names of the bits of a port as constraints have them: ``led<0>``, or the name itself."""
        bounds = re.search(r"\((\d+) downto (\d+)\)", self.type_name)
        if bounds is None:
            return [self.name]
        return [f"{self.name}<{i}>" for i in range(int(bounds[2]), int(bounds[1]) + 1)]


def declarations(text: str, kind: str) -> list[Declaration]:
    """Read the generic or port clause ("generic", "port") of an entity.

    A comment beside a declaration explains it alone; one above explains all that follow, up to the
    next comment above or an empty line. A long one goes on in lines that stand further in.
    """
    clause = re.search(rf"^  {kind} \(\n(.*?)^  \);", text, re.S | re.M)
    body = re.sub(r"\n {5,}", " ", clause[1]) if clause else ""
    entries: list[Declaration] = []
    above: list[str] = []
    complete = False
    for line in body.splitlines():
        code, _, beside = (part.strip() for part in line.partition("--"))
        if not code:
            # A comment after a declaration, or an empty line, begins a new group.
            above = [] if complete or not beside else above
            above += [beside] if beside else []
            complete = False
            continue
        complete = True
        name, _, rest = (part.strip() for part in code.rstrip(";").partition(":"))
        mode = ""
        if kind == "port":
            mode, rest = rest.split(None, 1)
        type_name, _, default = (part.strip() for part in rest.partition(":="))
        entries.append(Declaration(name, mode, type_name, default, beside or " ".join(above)))
    return entries


@dataclass(frozen=True)
class Instance:
    """One instance: label, entity or component, and the actuals of its generics and ports."""

    label: str
    of: str
    is_component: bool
    generics: dict[str, str]
    ports: dict[str, str]


_INSTANCE = re.compile(r"^\s+(\w+) : (entity work\.|component )(\w+)$", re.M)


def _without_comments(text: str) -> str:
    return re.sub(r"--[^\n]*", "", text)


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
    plain = _without_comments(text)
    for match in _INSTANCE.finditer(plain):
        rest = plain[match.end() :].split(";", 1)[0]
        generics = _map(rest, "generic")
        at_ports = re.search(r"\bport map\b", rest)
        ports = _map(rest[at_ports.start() :], "port") if at_ports else {}
        yield Instance(match[1], match[3], match[2] == "component ", generics, ports)


def used_units(text: str) -> set[str]:
    """Names of the entities and packages of the design that a source uses."""
    return set(re.findall(r"\bwork\.(\w+)", _without_comments(text)))


def used_components(text: str) -> set[str]:
    """Names of the components that a source instantiates: entities that a core may do without."""
    return set(re.findall(r"^ +\w+ : component (\w+)$", _without_comments(text), re.M))


def clocks(text: str) -> set[str]:
    """Names of the signals whose rising edge a source waits for."""
    return set(re.findall(r"\brising_edge\((\w+)\)", _without_comments(text)))


def renamings(text: str) -> list[tuple[str, str]]:
    """Assignments of one signal to another, as they are: target and source."""
    return re.findall(r"^  (\w+)\s+<= (\w+);$", _without_comments(text), re.M)
