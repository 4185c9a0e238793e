# SPDX-License-Identifier: Apache-2.0
"""Build files from the register map, hdl/axi/registers.toml, by hdl-registers.

Committed: its VHDL package, its C header and the table of docs/registers.md. Not committed: the
page build/docs/registers.html.

Usage: python scripts/build_registers.py [--check]

With --check nothing is written; exit code 1 if a committed file is missing or stale.
"""

import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from textwrap import wrap
from typing import Any

from hdl_registers.field.enumeration import Enumeration
from hdl_registers.generator.c.header import CHeaderGenerator
from hdl_registers.generator.html.page import HtmlPageGenerator
from hdl_registers.generator.register_code_generator import RegisterCodeGenerator
from hdl_registers.parser.toml import from_toml

from marks import between_marks
from plenofir.ground import project

ROOT = project.root()
MAP = ROOT / "hdl" / "axi" / "registers.toml"
PAGE = ROOT / "docs" / "registers.md"
HTML = ROOT / "build" / "docs" / "registers.html"
# In two parts: a whole one would be the licence of this file, too.
LICENCE = "SPDX-License-" + "Identifier: Apache-2.0"
BUILT = "Built by scripts/build_registers.py from hdl/axi/registers.toml"
MODES = {"r": "read", "r_w": "read, write", "wpulse": "write", "r_wpulse": "read, write"}


def parts_of(register: Any) -> list[str]:
    """Parts that a register needs one of; none: it is always there."""
    match = re.match(r"\(([a-z_, ]+)\) ", register.description)
    return match[1].split(", ") if match else []


def text_of(thing: Any) -> str:
    """What a register, a field or a constant is, without its parts."""
    return re.sub(r"^\([a-z_, ]+\) ", "", thing.description).replace("``", "`")


def needs(generator: RegisterCodeGenerator, register: Any) -> int:
    """Bits of the register `parts` of which one must be set; 0: the register always exists."""
    (parts,) = (r for r, _ in generator.iterate_registers() if r.name == "parts")
    bits = {field.name: 1 << field.base_index for field in parts.fields}
    return sum(bits[name] for name in parts_of(register))


class Vhdl93Generator(RegisterCodeGenerator):
    """Constants as XST takes them: hdl-registers' own package is VHDL-2008."""

    SHORT_DESCRIPTION = "VHDL-93 package"
    COMMENT_START = "--"

    @property
    def output_file(self) -> Path:
        """Where the package lies."""
        return MAP.parent / "register_map_pkg.vhd"

    def constants(self) -> Iterator[tuple[str, str, str, str]]:
        """Comment, name, type and value of each constant; of a group the first has the comment."""
        release = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
        major, minor, patch = (int(part) for part in release.split("."))
        values = {c.name: c.value for c in self.register_list.constants}
        registers = [register for register, _ in self.iterate_registers()]
        count = len(registers)
        yield "Number of registers.", "REGISTERS_TOTAL", "positive", str(count)
        number = values["identification_value"]
        yield "Constant contents of registers.", "IDENTIFICATION_WORD", "word_t", f'x"{number:08X}"'
        version = f'x"{values["map_number"]:02X}{major:02X}{minor:02X}{patch:02X}"'
        yield "", "VERSION_WORD", "word_t", version
        comment = "Places of the registers: a quarter of the address in bytes."
        for place, register in enumerate(registers):
            yield comment, f"AT_{register.name.upper()}", "natural", str(place)
            comment = ""
        group = "Fields of the registers: the first bit, and the number of bits above 1.\n\n"
        for register in registers:
            comment = f"{group}{register.name}: {text_of(register)}"
            for field in register.fields:
                name = f"{register.name}_{field.name}".upper()
                if field.width == 32:
                    continue
                yield comment, name, "natural", str(field.base_index)
                comment = group = ""
                if field.width > 1:
                    yield "", f"{name}_BITS", "positive", str(field.width)
        modes = [register.mode for register in registers]
        for name, bits, remark in (
            ("READABLE", [m.software_can_read for m in modes], "Registers that can be read."),
            ("WRITABLE", [m.software_can_write for m in modes], "Registers that can be written."),
        ):
            digits = "".join(str(int(bit)) for bit in bits)
            yield remark, name, f"std_logic_vector(0 to {count - 1})", f'"{digits}"'
        kept = {
            register.name: sum(((1 << f.width) - 1) << f.base_index for f in register.fields)
            * (register.mode.shorthand == "r_w")
            for register in registers
        }
        yield (
            "Bits that a register keeps as written.",
            "KEPT",
            f"words_t(0 to {count - 1})",
            self.table({name: f'x"{mask:08X}"' for name, mask in kept.items()}, 'x"00000000"'),
        )
        yield (
            "Bits of the register `parts` of which one must be set; 0: the register always exists.",
            "NEEDS",
            f"naturals_t(0 to {count - 1})",
            self.table({r.name: str(needs(self, r)) for r in registers}, "0"),
        )

    @staticmethod
    def table(rows: dict[str, str], nothing: str) -> str:
        """Make the value of an array over registers, one a line, without empty ones."""
        lines = [(f"AT_{name.upper()}", value) for name, value in rows.items() if value != nothing]
        width = max(len(name) for name, _ in lines)
        each = [f"{name:{width}} => {value}" for name, value in [*lines, ("others", nothing)]]
        return "\n  (\n    " + ",\n    ".join(each) + "\n  )"

    def get_code(self, **_: Any) -> str:
        """Make the package."""
        lines = [
            f"-- {LICENCE}",
            f"-- The register map of a core behind a bus. {BUILT}.",
            "",
            "library ieee;",
            "use ieee.std_logic_1164.all;",
            "",
            "package register_map_pkg is",
            "",
            "  subtype word_t is std_logic_vector(31 downto 0);",
            "",
            "  type words_t is array (natural range <>) of word_t;",
            "",
            "  type naturals_t is array (natural range <>) of natural;",
        ]
        group: list[tuple[str, str, str]] = []

        def close() -> None:
            names = max((len(name) for name, _, _ in group), default=0)
            types = max((len(type_) for _, type_, _ in group), default=0)
            for name, type_, value in group:
                if value.startswith("\n"):
                    lines.append(f"  constant {name} : {type_} :={value};")
                else:
                    lines.append(f"  constant {name:{names}} : {type_:{types}} := {value};")
            group.clear()

        for comment, name, type_, value in self.constants():
            if comment:
                close()
                for part in comment.split("\n\n"):
                    wrapped = wrap(part, 115)
                    lines.extend(["", *(f"  -- {line}" for line in wrapped)])
            group.append((name, type_, value))
        close()
        return "\n".join([*lines, "", "end package register_map_pkg;", ""])


def c_header(generator: CHeaderGenerator) -> str:
    """hdl-registers' header, shortened, with its includes, and as C99 (hexadecimal masks)."""
    code = re.sub(r"0b([01]+)u", lambda match: f"0x{int(match[1], 2):X}u", generator.get_code())
    code = re.sub(r"#define \w+_MASK_INVERSE .*\n", "", code)
    start, rest = code.split("\n\n", 1)
    return (
        f"// {LICENCE}\n"
        f"// The registers of a core behind a bus. {BUILT}.\n\n"
        f"{start}\n\n#include <stdint.h>\n\n{rest}\n"
    )


def table(generator: RegisterCodeGenerator) -> str:
    """Make the table of the documentation."""
    rows = ["| address | register | part | mode | bits | field | what it is |"]
    rows.append("| --- " * 7 + "|")
    for register, _ in generator.iterate_registers():
        part = ", ".join(name.replace("_", " ") for name in parts_of(register))
        mode = MODES[register.mode.shorthand]
        head = f"0x{4 * register.index:02X} | `{register.name}` | {part} | {mode}"
        rows.append(f"| {head} | | | {text_of(register)} |")
        for field in register.fields:
            low, high = field.base_index, field.base_index + field.width - 1
            bits = str(low) if low == high else f"{high}:{low}"
            meaning = text_of(field)
            if isinstance(field, Enumeration):
                meaning += (
                    " " + "; ".join(f"{e.value}: {text_of(e)[:-1]}" for e in field.elements) + "."
                )
            rows.append(f"| | | | | {bits} | `{field.name}` | {meaning} |")
    return "\n".join(row.replace("|  |", "| |") for row in rows)


def main() -> int:
    """Write or check the files."""
    registers = from_toml("plenofir", MAP)
    header = CHeaderGenerator(registers, MAP.parent, file_name="plenofir_registers.h")
    vhdl = Vhdl93Generator(registers, MAP.parent)
    # Reserved words of any language, names that are there twice.
    vhdl._sanity_check()
    files = {
        vhdl.output_file: vhdl.get_code(),
        header.output_file: c_header(header),
        PAGE: between_marks(PAGE.read_text(), "registers", table(vhdl)),
    }
    stale = {p for p, text in files.items() if not p.exists() or p.read_text() != text}
    if "--check" in sys.argv[1:]:
        for path in sorted(stale):
            print(
                f"{path.relative_to(ROOT)} is stale; run scripts/build_registers.py",
                file=sys.stderr,
            )
        return 1 if stale else 0
    for path in stale:
        path.write_text(files[path])
    page = HtmlPageGenerator(registers, HTML.parent)
    HTML.parent.mkdir(parents=True, exist_ok=True)
    HTML.write_text(page.get_code())
    return 0


if __name__ == "__main__":
    sys.exit(main())
