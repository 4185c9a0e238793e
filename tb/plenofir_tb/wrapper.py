# SPDX-License-Identifier: Apache-2.0
"""VHDL around entities under test, so that one simulation holds several of them."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

TOP = "cases"
"""Entity that holds all cases: `case_0`, `case_1` and so on."""


def wrapper(
    entities: Sequence[tuple[str, Mapping[str, int | bool | str]]], sources: Sequence[Path]
) -> str:
    """VHDL of `TOP`, which puts entities with their generics side by side.

    Its instance `case_<number>` has a signal for each port of an entity.
    """
    texts = [source.read_text() for source in sources]
    declared = {name: _Declaration(name, texts) for name, _ in entities}
    cases = [declared[name].case(i, generics) for i, (name, generics) in enumerate(entities)]
    instances = [f"  case_{i} : entity work.case_{i};" for i in range(len(entities))]
    return "\n".join(
        [
            *cases,
            f"entity {TOP} is",
            f"end entity {TOP};\n",
            f"architecture test of {TOP} is\nbegin",
            *instances,
            "end architecture test;\n",
        ]
    )


def _split(clause: str | None) -> list[tuple[list[str], str, str]]:
    """Names, type and " := default" (or nothing) of each declaration of a clause."""
    found = []
    for declaration in (clause or "").split(";"):
        names, kind = declaration.split(":", 1)
        kind, assign, default = kind.partition(":=")
        kind = re.sub(r"^\s*(in|out|inout)\s", "", kind, flags=re.IGNORECASE)
        found.append(([n.strip() for n in names.split(",")], kind.strip(), assign + default))
    return found


class _Declaration:
    """What the sources say of an entity."""

    def __init__(self, name: str, texts: Sequence[str]) -> None:
        self.name = name
        text = next(text for text in texts if f"\nentity {name} is\n" in text)
        found = re.search(
            rf"^(?P<context>.*?)\bentity {name} is(?P<body>.*?)\bend entity\b",
            re.sub(r"--.*", "", text),
            re.DOTALL,
        )
        assert found, name
        self.context = re.sub(r"\n\s*\n", "\n", found["context"]).strip()
        clauses = re.match(
            r"\s*(?:generic\s*\((?P<generic>.*?)\)\s*;)?\s*(?:port\s*\((?P<port>.*)\)\s*;)?\s*$",
            found["body"],
            re.DOTALL | re.IGNORECASE,
        )
        assert clauses, f"generics and ports of {name}"
        self.generics = _split(clauses["generic"]) if clauses["generic"] else []
        self.ports = _split(clauses["port"]) if clauses["port"] else []

    def case(self, number: int, values: Mapping[str, int | bool | str]) -> str:
        """Entity `case_<number>`: the entity, constants as its generics, signals as its ports."""
        declarations, generic_map, port_map = [], [], []
        left = dict(values)
        for names, kind, default in self.generics:
            for name in names:
                value = f":= {_literal(left.pop(name), kind)}" if name in left else default
                declarations.append(f"  constant {name} : {kind} {value};")
                generic_map.append(f"{name} => {name}")
        assert not left, f"{self.name} has no generics {list(left)}"
        for names, kind, default in self.ports:
            for name in names:
                declarations.append(f"  signal {name} : {kind} {default};")
                port_map.append(f"{name} => {name}")
        maps = [
            f"    {word} map ({', '.join(items)})"
            for word, items in (("generic", generic_map), ("port", port_map))
            if items
        ]
        return "\n".join(
            [
                self.context,
                f"entity case_{number} is",
                f"end entity case_{number};\n",
                f"architecture test of case_{number} is",
                *declarations,
                "begin",
                f"  under_test : entity work.{self.name}",
                *maps,
                "  ;",
                "end architecture test;\n",
            ]
        )


def _literal(value: int | bool | str, kind: str) -> str:
    if isinstance(value, str) and kind.lower().startswith("string"):
        return f'"{value}"'
    return str(value).lower() if isinstance(value, bool) else str(value)
