"""Xilinx's primitives in GHDL's Verilog, as Yosys knows them.

GHDL writes a component that nothing is bound to as an empty module, in lower case, once for each
set of its generics, with texts and real numbers as bits.
"""

import re
import struct
from pathlib import Path

from plenofir import project


def primitives() -> list[str]:
    """Primitives that the sources instantiate.

    Returns
    -------
    list of str
        Names of components, lower case.
    """
    text = (project.root() / "hdl" / "sim" / "unisim" / "vcomponents.vhd").read_text()
    return re.findall(r"^  component (\w+) is", text, re.M)


def parameter_kinds(models: str, name: str) -> dict[str, str]:
    """Parameters of a cell.

    Parameters
    ----------
    models
        Verilog with the cell's module.
    name
        Cell, upper case.

    Returns
    -------
    dict
        Parameter to "text", "real" or "integer".
    """
    begin = re.search(rf"^module {name} ?\(", models, re.M)
    if begin is None:
        return {}
    body = models[begin.start() : models.index("endmodule", begin.start())]
    kinds = {}
    for kind, parameter, value in re.findall(
        r"parameter (?:(real|integer|\[\d+:0\]) )?(\w+) = ([^;]+);", body
    ):
        kinds[parameter] = "real" if kind == "real" else "text" if '"' in value else "integer"
    return kinds


def _value(kind: str, bits: str) -> str:
    """A parameter's value, from GHDL's bits."""
    if kind == "text":
        if len(bits) == 1:
            return '"TRUE"' if bits == "1" else '"FALSE"'
        return '"' + int(bits, 2).to_bytes(len(bits) // 8, "big").decode("ascii") + '"'
    if kind == "real":
        return repr(struct.unpack(">d", int(bits, 2).to_bytes(8, "big"))[0])
    return f"{len(bits)}'b{bits}"


def with_primitives(text: str, models: Path) -> str:
    """Instances of Yosys' cells instead of GHDL's empty modules.

    Parameters
    ----------
    text
        GHDL's Verilog.
    models
        Yosys' declarations of the cells.

    Returns
    -------
    str
        The same circuit; parameters that a cell does not have are left out.
    """
    declared = models.read_text()
    for name in primitives():
        if not re.search(rf"^module {name}$", text, re.M):
            continue
        text = re.sub(rf"^module {name}\n.*?^endmodule\n", "", text, flags=re.M | re.S)
        kinds = parameter_kinds(declared, name.upper())

        def instance(
            match: re.Match[str], *, name: str = name, kinds: dict[str, str] = kinds
        ) -> str:
            values = [
                f".{parameter}({_value(kinds[parameter], bits)})"
                for parameter, bits in re.findall(r"\.(\w+)\(\d+'b([01]+)\)", match["values"] or "")
                if parameter in kinds
            ]
            ports = re.sub(r"\.(\w+)\(", lambda port: f".{port[1].upper()}(", match["ports"])
            return f"  {name.upper()} #({', '.join(values)}) {match['label']} ({ports});\n"

        text = re.sub(
            rf"^  {name} (?:#\((?P<values>[^;]*?)\)\n    )?(?P<label>\w+) \((?P<ports>[^;]*)\);\n",
            instance,
            text,
            flags=re.M,
        )
    return text
