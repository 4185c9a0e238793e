# SPDX-License-Identifier: Apache-2.0
"""An entity inside a core as a top of its own, for tools whose generics are numbers and texts."""

import re
from collections.abc import Mapping

from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import declarations

TOP = "part"


def wrapped(entity: str, constants: Mapping[str, str]) -> str:
    """VHDL of an entity `TOP` without generics that instantiates another.

    Its ports are those of the entity. `constants`: each generic without a default and, in front of
    it, what its value is computed from, as "type := value"; generics have capital letters.

    Raises StopIteration for an entity that is not there.
    """
    text = next(f for f in hdl.hdl_sources() if f.stem == entity).read_text()
    ports = re.search(r"^  port \(\n(.*?)^  \);", text, re.S | re.M)
    assert ports is not None, entity
    context = text[text.index("library ieee;") : text.index(f"entity {entity} is")]
    generics = {generic.name.upper() for generic in declarations(text, "generic")}
    values = [f"{name} => {name}" for name in constants if name in generics]
    wires = [f"{port.name} => {port.name}" for port in declarations(text, "port")]
    return "\n".join(
        [
            context,
            "package part_pkg is",
            *(f"  constant {name} : {value};" for name, value in constants.items()),
            "end package part_pkg;",
            f"{context}use work.part_pkg.all;",
            f"entity {TOP} is port (\n{ports[1]}); end entity {TOP};",
            f"architecture rtl of {TOP} is begin",
            f"  inner : entity work.{entity} generic map ({', '.join(values)})",
            f"    port map ({', '.join(wires)});",
            "end architecture rtl;\n",
        ]
    )
