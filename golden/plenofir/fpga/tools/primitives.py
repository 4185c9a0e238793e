# SPDX-License-Identifier: Apache-2.0
"""Converts a vendor's primitives in GHDL's Verilog to the cells of Yosys.

GHDL writes instances of unbound components in lower case, with real numbers as bits. GHDL 2.0 also
adds an empty module for each set of generics and writes strings as bits.
"""

import re
import struct
from collections.abc import Sequence
from pathlib import Path

from plenofir.fpga import hdl


def component_package(library: str) -> Path:
    """Package that declares the components of a library of models."""
    return next(s for s in hdl.model_sources(library) if s.stem.endswith("components"))


def primitives(components: Path) -> list[str]:
    """Components that a package declares, in lower case."""
    return re.findall(r"^  component (\w+) is", components.read_text(), re.M)


def parameter_kinds(models: str, name: str) -> dict[str, str]:
    """Parameters of a cell (upper case) to "text", "real" or "integer"."""
    begin = re.search(rf"^module {name} ?\(", models, re.M)
    if begin is None:
        return {}
    body = models[begin.start() : models.index("endmodule", begin.start())]
    kinds = {}
    for kind, parameter, value in re.findall(
        r"parameter (?:(real|integer|\[\d+:0\]) )?(\w+) *= *([^;]+);", body
    ):
        kinds[parameter] = "real" if kind == "real" else "text" if '"' in value else "integer"
    return kinds


def _value(kind: str, value: str) -> str:
    """A parameter's value, from GHDL's text or bits."""
    bits = value.partition("'b")[2]
    if value.startswith('"') or kind == "integer":
        return value
    if kind == "real":
        return repr(struct.unpack(">d", int(bits, 2).to_bytes(8, "big"))[0])
    if len(bits) == 1:
        return '"TRUE"' if bits == "1" else '"FALSE"'
    return '"' + int(bits, 2).to_bytes(len(bits) // 8, "big").decode("ascii") + '"'


def with_primitives(text: str, components: Path, models: Sequence[Path]) -> str:
    """Replace GHDL's components in Verilog by Yosys' cells, declared in the files `models`.

    `components` is the package that declares them. Parameters that a cell does not have are left
    out.
    """
    declared = "".join(model.read_text() for model in models)
    names = "|".join(primitives(components))
    text = re.sub(rf"^module (?:{names})\n.*?^endmodule\n", "", text, flags=re.M | re.S)

    # Most have names in capitals, some of Gowin's not.
    spelled = {name.lower(): name for name in re.findall(r"^module (\w+)", declared, re.M)}

    def instance(match: re.Match[str]) -> str:
        name = spelled.get(match["name"], match["name"].upper())
        kinds = parameter_kinds(declared, name)
        values = [
            f".{parameter}({_value(kinds[parameter], value)})"
            for parameter, value in re.findall(
                r"""\.(\w+)\((\d+'b[01]+|"[^"]*")\)""", match["values"] or ""
            )
            if parameter in kinds
        ]
        ports = re.sub(r"\.(\w+)\(", lambda port: f".{port[1].upper()}(", match["ports"])
        return f"  {name} #({', '.join(values)}) {match['label']} ({ports});\n"

    return re.sub(
        rf"^  (?P<name>{names}) (?:#\((?P<values>[^;]*?)\)\n    )?"
        r"(?P<label>\w+) \((?P<ports>[^;]*)\);\n",
        instance,
        text,
        flags=re.M,
    )
