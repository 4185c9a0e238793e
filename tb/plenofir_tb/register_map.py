# SPDX-License-Identifier: Apache-2.0
"""The register map from its TOML file, and a model of the registers that only software sets.

It does not use the code that builds the sources from the file.
"""

import re
import tomllib
from dataclasses import dataclass

from plenofir.ground import project

PARTS = ("refocuser", "stack", "depth_index", "resampler", "mosaic")


@dataclass(frozen=True)
class Register:
    """A register: its address, mode, bits of its fields, parts of which it needs one."""

    name: str
    address: int
    mode: str
    fields: dict[str, tuple[int, int]]  # first bit, and how many
    parts: tuple[str, ...]

    @property
    def mask(self) -> int:
        """Bits that belong to a field."""
        return sum(((1 << bits) - 1) << low for low, bits in self.fields.values())

    def fields_of(self, word: int) -> dict[str, int]:
        return {name: word >> low & (1 << bits) - 1 for name, (low, bits) in self.fields.items()}

    def word_of(self, **values: int) -> int:
        return sum(value << self.fields[name][0] for name, value in values.items())


def read_map() -> dict[str, Register]:
    """Registers by their names, in order."""
    text = (project.root() / "hdl" / "axi" / "registers.toml").read_text()
    registers: dict[str, Register] = {}
    for name, entry in tomllib.loads(text).items():
        if entry.get("type") == "constant":
            continue
        place = 0
        fields = {}
        for field, value in entry.items():
            if field in ("mode", "description"):
                continue
            bits = {"bit": 1, "enumeration": 2}.get(value["type"]) or value["width"]
            fields[field] = (place, bits)
            place += bits
        assert place <= 32, name
        needs = re.match(r"\((.*?)\) ", entry["description"])
        parts = tuple(needs[1].split(", ")) if needs else ()
        assert set(parts) <= set(PARTS), name
        registers[name] = Register(name, 4 * len(registers), entry["mode"], fields, parts)
    return registers


MAP = read_map()


class Model:
    """Answers of registers: whether they can be read or written, and their values."""

    def __init__(self, parts: set[str]) -> None:
        present = (r for r in MAP.values() if not r.parts or parts & set(r.parts))
        self.present = {register.address: register for register in present}
        self.kept = {r.name: 0 for r in self.present.values() if r.mode == "r_w"}

    def writable(self, address: int, strobes: int = 15) -> bool:
        """Whether a write to a byte's address is answered with OKAY: without strobes any is."""
        word = address & ~3
        return not strobes or (word in self.present and self.present[word].mode != "r")

    def readable(self, address: int) -> bool:
        """Whether a read of a byte's address is answered with OKAY.

        Beside a word that can be read, in the same 8 bytes, any is: a bus of 64 bits reads both.
        """
        return any(self.reads(word) for word in (address & ~3, address & ~3 ^ 4))

    def reads(self, word: int) -> bool:
        """Whether a word is that of a register that can be read."""
        return word in self.present and self.present[word].mode != "wpulse"

    def write(self, address: int, word: int, strobes: int) -> None:
        """Write the bytes of a word that have a strobe; `frame_size` is not known here."""
        register = self.present.get(address & ~3)
        if register is not None and register.name in self.kept and register.name != "frame_size":
            mask = sum(0xFF << 8 * i for i in range(4) if strobes >> i & 1)
            old = self.kept[register.name]
            self.kept[register.name] = (old & ~mask | word & mask) & register.mask
