# SPDX-License-Identifier: Apache-2.0
"""Reads declarations from a VHDL source: generics, ports, units that are used.

The sources are written in one style (``scripts/vsg.yaml``), so that a few patterns read them.
"""

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Declaration:
    """One generic or port: name, mode (ports), type, default, and the comment that explains it."""

    name: str
    mode: str
    type_name: str
    default: str
    comment: str


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


def without_comments(text: str) -> str:
    """Source without its comments."""
    return re.sub(r"--[^\n]*", "", text)


def used_units(text: str) -> set[str]:
    """Names of the entities and packages of the design that a source uses."""
    return set(re.findall(r"\bwork\.(\w+)", without_comments(text)))


def used_components(text: str) -> set[str]:
    """Names of the components that a source instantiates: entities that a core may do without."""
    return set(re.findall(r"^ +\w+ : component (\w+)$", without_comments(text), re.M))
