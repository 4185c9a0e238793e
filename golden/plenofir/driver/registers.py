# SPDX-License-Identifier: Apache-2.0
"""The registers of a core behind a bus, as hdl/axi/registers.toml has them."""

import re
import tomllib
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from plenofir.ground import project


class Access(Protocol):
    """Reads and writes words of 32 bits, by their addresses in bytes."""

    def read(self, address: int, /) -> int:
        """Read the word at an address."""

    def write(self, address: int, value: int, /) -> object:
        """Write the word at an address."""


@dataclass(frozen=True)
class _Field:
    low: int  # its first bit
    width: int
    is_signed: bool

    def value(self, word: int) -> int:
        value = word >> self.low & (1 << self.width) - 1
        return value - (1 << self.width) if self.is_signed and value >> self.width - 1 else value

    def bits(self, value: int) -> int:
        return (value & (1 << self.width) - 1) << self.low


@dataclass(frozen=True)
class _Register:
    address: int  # in bytes
    mode: str  # r, r_w, wpulse or r_wpulse
    needs: tuple[str, ...]  # it exists if the core has one of these parts; empty: always
    fields: Mapping[str, _Field]
    values: Callable[..., Any]  # what a read gives, by the names of the fields


def _registers(entries: Mapping[str, Any]) -> dict[str, _Register]:
    registers: dict[str, _Register] = {}
    for name, entry in entries.items():
        low, fields = 0, {}
        for field, about in entry.items():
            if field in ("mode", "description"):
                continue
            width = {"bit": 1, "enumeration": _bits(about)}.get(about["type"], about.get("width"))
            signed = about.get("numerical_interpretation") == "signed"
            fields[field] = _Field(low, width, signed)
            low += width
        parts = re.match(r"\(([a-z_, ]+)\) ", entry["description"])
        needs = tuple(parts[1].split(", ")) if parts else ()
        values = namedtuple(name, list(fields))  # type: ignore[misc]
        registers[name] = _Register(4 * len(registers), entry["mode"], needs, fields, values)
    return registers


def _bits(enumeration: Mapping[str, Any]) -> int:
    return max(len(enumeration.get("element", ())) - 1, 1).bit_length()


_MAP = tomllib.loads(
    (project.root() / "hdl" / "axi" / "registers.toml").read_text(encoding="utf-8")
)
_REGISTERS = _registers({n: e for n, e in _MAP.items() if e.get("type") != "constant"})

IDENTIFICATION_VALUE: int = _MAP["identification_value"]["value"]
"""Value of `identification`: Plnf."""
MAP_NUMBER: int = _MAP["map_number"]["value"]
"""Number of this map, `version.map`. Drivers take no other."""
ADDRESSES = {name: register.address for name, register in _REGISTERS.items()}
"""Address of each register in bytes."""
NEEDS = {
    name: sum(_REGISTERS["parts"].fields[part].bits(1) for part in register.needs)
    for name, register in _REGISTERS.items()
    if register.needs
}
"""Bits of the register `parts` of which a register needs one; the others are always there."""


class Registers:
    """Reads and writes registers: ``read_NAME()`` and ``write_NAME(...)`` (docs/registers.md).

    A read gives a named tuple, or the number of the only field. A write takes the fields by name,
    all but for commands, or the value of the only field. A register of which `NEEDS` has none of
    the bits of `parts` is not there.
    """

    def __init__(self, access: Access) -> None:
        self._access = access

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Give the method of a register."""
        way, _, of = name.partition("_")
        register = _REGISTERS.get(of)
        if register is not None and way == "read" and register.mode[0] == "r":
            return partial(self._read, register)
        if register is not None and way == "write" and register.mode != "r":
            return partial(self._write, register)
        raise AttributeError(f"there is no {name}")

    def _read(self, register: _Register) -> Any:
        word = self._access.read(register.address)
        values = [field.value(word) for field in register.fields.values()]
        return values[0] if len(values) == 1 else register.values(*values)

    def _write(self, register: _Register, *value: int, **fields: int) -> None:
        arguments = dict(zip(register.fields, value, strict=False)) | fields
        if not register.mode.endswith("wpulse"):
            arguments = register.values(**arguments)._asdict()
        word = sum(register.fields[name].bits(part) for name, part in arguments.items())
        self._access.write(register.address, word)
