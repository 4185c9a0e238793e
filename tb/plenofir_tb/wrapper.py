# SPDX-License-Identifier: Apache-2.0
"""VHDL around entities under test, so that several of them share a simulation."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

TOP = "cases"
"""Entity that holds all cases: `case_0`, `case_1` and so on."""


def wrapper(
    entities: Sequence[tuple[str, Mapping[str, int | bool | str]]], sources: Sequence[Path]
) -> str:
    """VHDL of `TOP`, which puts entities with their generics side by side.

    Its instance `case_<number>` has a signal for each port of an entity, or for each field of a
    record port, named after both, as cocotb cannot access records. For an array of records the
    signal of a field is the concatenation of its elements, the first one in the low bits.
    """
    texts = [source.read_text() for source in sources]
    records = _Records(texts)
    declared = {name: _Declaration(name, texts, records) for name, _ in entities}
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


# Records with self-explanatory fields: the last word of the port's name is left out of the signals'
# names, so that `in_video` has `in_active` and `video` has `active`.
_PLAIN = {
    *(
        "video_t",
        "raster_t",
        "decoded_t",
        "monitor_t",
        "picture_choice_t",
        "picture_info_t",
        "command_t",
    ),
    *("panel_t", "lanes_t", "clocks_state_t", "clocks_order_t"),
    *("bus_request_t", "bus_answer_t", "orders_t", "marks_t", "watched_t"),
}


# Records that become one signal, the concatenation of all fields, the first one in the low bits.
_PACKED = {"timing_t"}


@dataclass(frozen=True)
class _Object:
    """A generic, a port, or a field of a record."""

    name: str
    kind: str  # its type, with limits
    mode: str = ""  # of a port: in, out, inout
    default: str = ""  # with its :=


def _split(clause: str | None) -> list[_Object]:
    objects = []
    for declaration in (clause or "").split(";"):
        if not declaration.strip():
            continue
        names, kind = declaration.split(":", 1)
        kind, assign, default = kind.partition(":=")
        mode = re.match(r"\s*(in|out|inout)\s", kind, re.IGNORECASE)
        kind = kind[mode.end() :] if mode else kind
        objects += [
            _Object(name.strip(), kind.strip(), mode[1].lower() if mode else "", assign + default)
            for name in names.split(",")
        ]
    return objects


class _Records:
    """The record types of all packages, and the arrays of them."""

    def __init__(self, texts: Sequence[str]) -> None:
        self.fields: dict[str, list[_Object]] = {}
        self.arrays: dict[str, str] = {}
        self.contexts: dict[str, str] = {}  # context clauses for the fields' types
        for text in texts:
            plain = re.sub(r"--.*", "", text)
            package = re.search(r"^package (\w+) is(.*?)^end package", plain, re.M | re.S)
            if package is None:
                continue
            for name, body in re.findall(
                r"\btype (\w+) is record\b(.*?)\bend record", package[2], re.S
            ):
                self.fields[name] = _split(body)
                used = plain[: package.start()].split("\n")
                uses = [line for line in used if line.startswith("use work.")]
                self.contexts[name] = "\n".join([*uses, f"use work.{package[1]}.all;"])
            for name, element in re.findall(
                r"\btype (\w+) is array \([^;]*\) of (\w+);", package[2]
            ):
                self.arrays[name] = element

    def is_flat(self, kind: str) -> bool:
        """Whether a type is neither a record nor an array of the packages."""
        name = re.match(r"\w+", kind)
        return name is None or (name[0] not in self.arrays and name[0] not in self.fields)

    def record_of(self, kind: str) -> str | None:
        """The record type of a type, which may be an array of it."""
        name = re.match(r"\w+", kind)
        base = self.arrays.get(name[0], name[0]) if name else ""
        return base if base in self.fields else None

    def flat(self, port: _Object) -> tuple[list[str], list[str]]:
        """Declarations and statements for a signal for each field of a port."""
        kind = re.match(r"\w+", port.kind)
        assert kind
        if kind[0] in self.arrays:
            return self._flat_array(port)
        prefix = port.name
        if kind[0] in _PLAIN:
            prefix = "_".join(prefix.split("_")[:-1])
        return self._flat_record(prefix, f"{port.name}_record", port.kind, port.mode)

    def _flat_record(
        self, name: str, path: str, kind: str, mode: str
    ) -> tuple[list[str], list[str]]:
        """The same for a record or one of its fields."""
        record = self.record_of(kind)
        if record is None:
            sides = (path, name) if mode == "in" else (name, path)
            return [f"  signal {name} : {kind};"], ["  {} <= {};".format(*sides)]
        if record in _PACKED:
            return self._packed(name, path, record, mode)
        declarations, statements = [], []
        for field in self.fields[record]:
            inner = f"{name}_{field.name}" if name else field.name
            more = self._flat_record(inner, f"{path}.{field.name}", field.kind, mode)
            declarations += more[0]
            statements += more[1]
        return declarations, statements

    def _packed(self, name: str, path: str, record: str, mode: str) -> tuple[list[str], list[str]]:
        """A vector of all fields, the first one in the low bits."""
        statements, low = [], "0"
        for field in self.fields[record]:
            one = f"{path}.{field.name}"
            if field.kind == "std_logic":
                part, value, width = f"{name}({low})", one, "1"
            else:
                width = f"{one}'length"
                part = f"{name}({low} + {width} - 1 downto {low})"
                value = f"std_logic_vector({one})"
            if mode == "in":
                converted = part if field.kind == "std_logic" else f"unsigned({part})"
                statements.append(f"  {one} <= {converted};")
            else:
                statements.append(f"  {part} <= {value};")
            low += f" + {width}"
        return [f"  signal {name} : std_logic_vector({low} - 1 downto 0);"], statements

    def _flat_array(self, port: _Object) -> tuple[list[str], list[str]]:
        """A vector for each field, with that of all elements."""
        declarations, statements = [], []
        rows = f"{port.name}_record"
        for field in self.fields.get(self.record_of(port.kind) or "", [None]):
            # An array of vectors is one vector.
            name, path = port.name, ""
            kind = "std_logic_vector"
            if field is not None:
                name, path, kind = f"{name}_{field.name}", f".{field.name}", field.kind
            one = f"{rows}(i){path}"
            count, sample = f"{rows}'length", f"{rows}({rows}'left){path}"
            bit = kind == "std_logic"
            width = count if bit else f"{count} * {sample}'length"
            declarations.append(f"  signal {name} : std_logic_vector({width} - 1 downto 0);")
            part, value = f"{name}(i)", one
            value_in = part
            if not bit:
                part = f"{name}((i + 1) * {one}'length - 1 downto i * {one}'length)"
                is_vector = kind.startswith("std_logic_vector")
                value_in = part if is_vector else f"unsigned({part})"
                value = f"std_logic_vector({one})"
            sides = (one, value_in) if port.mode == "in" else (part, value)
            statements.append(
                f"  {name}_elements : for i in {rows}'range generate\n"
                + "    {} <= {};\n".format(*sides)
                + "  end generate;"
            )
        return declarations, statements


class _Declaration:
    """The declaration of an entity in the sources."""

    def __init__(self, name: str, texts: Sequence[str], records: _Records) -> None:
        self.name = name
        self.records = records
        text = next(text for text in texts if f"\nentity {name} is\n" in text)
        match = re.search(
            rf"^(?P<context>.*?)\bentity {name} is(?P<body>.*?)\bend entity\b",
            re.sub(r"--.*", "", text),
            re.DOTALL,
        )
        assert match, name
        context = re.sub(r"\n\s*\n", "\n", match["context"]).strip()
        clauses = re.match(
            r"\s*(?:generic\s*\((?P<generic>.*?)\)\s*;)?\s*(?:port\s*\((?P<port>.*)\)\s*;)?\s*$",
            match["body"],
            re.DOTALL | re.IGNORECASE,
        )
        assert clauses, f"generics and ports of {name}"
        self.generics = _split(clauses["generic"])
        self.ports = _split(clauses["port"])
        kinds = {records.record_of(port.kind) for port in self.ports} - {None}
        uses = [records.contexts[kind] for kind in sorted(map(str, kinds))]
        work = ["library work;"] if uses and "library work;" not in context else []
        self.context = "\n".join([context, *work, *uses])

    def case(self, number: int, values: Mapping[str, int | bool | str]) -> str:
        """Entity `case_<number>`: the entity, constants as its generics, signals as its ports."""
        declarations, generic_map, port_map, statements = [], [], [], []
        remaining = dict(values)
        for generic in self.generics:
            name, default = generic.name, generic.default
            if name in remaining:
                default = f":= {_literal(remaining.pop(name), generic.kind)}"
            declarations.append(f"  constant {name} : {generic.kind} {default};")
            generic_map.append(f"{name} => {name}")
        assert not remaining, f"{self.name} has no generics {list(remaining)}"
        for port in self.ports:
            is_record = not self.records.is_flat(port.kind)
            default = "" if is_record else port.default
            signal = f"{port.name}_record" if is_record else port.name
            port_map.append(f"{port.name} => {signal}")
            declarations.append(f"  signal {signal} : {port.kind} {default};")
            if is_record:
                signals, joined = self.records.flat(port)
                declarations += signals
                statements += joined
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
                *statements,
                "end architecture test;\n",
            ]
        )


def _literal(value: int | bool | str, kind: str) -> str:
    if isinstance(value, str) and kind.lower().startswith("string"):
        return f'"{value}"'
    return str(value).lower() if isinstance(value, bool) else str(value)
