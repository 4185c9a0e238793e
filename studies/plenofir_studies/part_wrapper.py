# SPDX-License-Identifier: Apache-2.0
"""An entity inside a core as a top of its own, for tools whose generics are numbers and texts."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import declarations

TOP = "part"


def literal(value: int | bool | str) -> str:
    """A generic's value in VHDL."""
    return f'"{value}"' if isinstance(value, str) else str(value).lower()


def core_call(
    generics: Mapping[str, int | bool | str], *, of: str = "work.refocuser_pkg.core_of"
) -> str:
    """VHDL of the core that generics of ``raster_refocuser`` describe, or parameters of `of`."""
    values = {"name": TOP, **generics}
    chosen = ", ".join(f"{name.lower()} => {literal(value)}" for name, value in values.items())
    return f"{of}({chosen})"


def wrapped(entity: str, values: Mapping[str, object]) -> str:
    """VHDL of an entity `TOP` without generics that instantiates another and has its ports.

    `values`: expressions for generics, as constants of their types; the others keep their defaults.
    Raises StopIteration for an entity that is not there.
    """
    text = next(f for f in hdl.hdl_sources() if f.stem == entity).read_text()
    ports = re.search(r"^  port \(\n(.*?)^  \);", text, re.S | re.M)
    assert ports is not None, entity
    context = text[text.index("library ieee;") : text.index(f"entity {entity} is")]
    generics = declarations(text, "generic")
    constants = [
        f"  constant {g.name} : {g.type_name} := {values.get(g.name.upper(), g.default)};"
        for g in generics
    ]
    chosen = ", ".join(f"{generic.name} => {generic.name}" for generic in generics)
    wires = ", ".join(f"{port.name} => {port.name}" for port in declarations(text, "port"))
    return "\n".join(
        [
            context,
            "package part_pkg is",
            *constants,
            "end package part_pkg;",
            f"{context}use work.part_pkg.all;",
            f"entity {TOP} is port (\n{ports[1]}); end entity {TOP};",
            f"architecture rtl of {TOP} is begin",
            f"  inner : entity work.{entity} generic map ({chosen}) port map ({wires});",
            "end architecture rtl;\n",
        ]
    )


def with_part(sources: Sequence[Path], wrapper: str, folder: Path) -> list[Path]:
    """Sources and a wrapper, which is written into a folder."""
    file = folder / f"{TOP}.vhd"
    file.write_text(wrapper)
    return [*sources, file]
