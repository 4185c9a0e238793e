# SPDX-License-Identifier: Apache-2.0
"""Sources whose registers and memories start with random values instead of the declared ones.

Simulators have no option for that, so declarations are rewritten: `signal x : t := v;` gets a value
of its type. Constants and signals without a declared value (undefined in simulation) stay.
"""

import random
import re
from collections.abc import Iterable
from pathlib import Path

PACKAGE = Path(__file__).with_suffix(".vhd")
_OBJECT = re.compile(r"^( *(?:signal|shared variable) +\w[\w, ]* *:)([^;:]*?):=([^;]*);", re.M)
_TYPE = re.compile(r"^ *(?:sub)?type +(\w+) +is +(.*?);(?= *(?:--.*)?$)", re.M | re.S)
_RECORD = re.compile(r"^ *type +(\w+) +is +record(.*?)end record", re.M | re.S)
_VECTOR = re.compile(r"(std_logic_vector|std_ulogic_vector|unsigned|signed)\s*\((.*)\)", re.S)
_NUMBER = re.compile(r"(natural|integer|positive)\s+range\s+(.*?)\s+to\s+(.*)", re.S)
# A random address may lie beyond a memory or a table, which is an error only in simulation.
_ADDRESSES = (
    (r"\bmemory\(to_integer\((\w+)\)\)", r"memory(to_integer(\1) mod memory'length)"),
    (
        r"ADDRESS_OF\(RING_OF\(phase\)\.base \+ place / BANKS\)",
        "ADDRESS_OF((RING_OF(phase).base + place / BANKS) mod ADDRESS_OF'length)",
    ),
    # So is a random partial sum above the largest one.
    (r"sums\(w\) := (to_integer\(.*\));", r"sums(w) := \1 mod (partial_sum_t'high + 1);"),
)


def _types(text: str) -> dict[str, str]:
    plain = re.sub(r"--.*", "", text)
    found = {name: " ".join(meaning.split()) for name, meaning in _TYPE.findall(plain)}
    return found | {name: f"record {' '.join(f.split())}" for name, f in _RECORD.findall(plain)}


def _split_array(meaning: str) -> str:
    """Type of the elements of `array (...) of T`; the range may hold brackets."""
    depth = 0
    for place, character in enumerate(meaning):
        depth += {"(": 1, ")": -1}.get(character, 0)
        if character == ")" and depth == 0:
            return meaning[place + 1 :].strip().removeprefix("of").strip()
    return ""


class _Drawer:
    """Draws expressions for the types visible in a source."""

    def __init__(self, types: dict[str, str], rng: random.Random) -> None:
        self.types, self.rng = types, rng

    def value(self, kind: str) -> str:
        """An expression of a type; empty if there is none for it."""
        kind = " ".join(kind.split())
        seed = self.rng.randrange(1 << 30)
        if kind in ("std_logic", "std_ulogic"):
            return f"'{seed & 1}'"
        if kind == "boolean":
            return ("false", "true")[seed & 1]
        if vector := _VECTOR.fullmatch(kind):
            return f"work.start_values.bits({seed}, {_length(vector[2])})"
        if number := _NUMBER.fullmatch(kind):
            return f"work.start_values.number({seed}, {number[2]}, {number[3]})"
        name, _, constraint = kind.partition("(")
        meaning = self.types.get(name.strip(), "")
        if not meaning or (constraint and "<>" not in meaning):
            return ""
        if meaning.startswith("array"):
            inner = self.value(_split_array(meaning))
            return f"(others => {inner})" if inner else ""
        if meaning.startswith("record"):
            return self._record(meaning.removeprefix("record "))
        if meaning.startswith("("):
            return f"{name}'val({seed} mod ({name}'pos({name}'high) + 1))"
        if _VECTOR.fullmatch(meaning):
            return f"work.start_values.bits({seed}, {name}'length)"
        if _NUMBER.fullmatch(meaning):
            return f"work.start_values.number({seed}, {name}'low, {name}'high)"
        return self.value(meaning)

    def _record(self, fields: str) -> str:
        values = []
        for field in filter(None, (f.strip() for f in fields.split(";"))):
            names, kind = field.split(":", 1)
            for name in names.split(","):
                inner = self.value(kind)
                if not inner:
                    return ""
                values.append(f"{name.strip()} => {inner}")
        return f"({', '.join(values)})"


def _length(bounds: str) -> str:
    if bounds.endswith("'range"):
        return bounds.removesuffix("range") + "length"
    high, down, low = bounds.partition(" downto ")
    if down:
        return f"({high}) - ({low}) + 1"
    low, _, high = bounds.partition(" to ")
    return f"({high}) - ({low}) + 1"


def with_start_values(
    sources: Iterable[Path],
    folder: Path,
    rng: random.Random,
    *,
    share: float = 1,
    keep: Iterable[str] = (),
) -> list[Path]:
    """Copies of sources (in order) with a share of random start values; files in `keep` stay."""
    texts = {source: source.read_text() for source in sources}
    packages = {s.stem: _types(text) for s, text in texts.items() if s.stem.endswith("_pkg")}
    shared = {name: kind for types in packages.values() for name, kind in types.items()}
    folder.mkdir(parents=True, exist_ok=True)
    copies = [PACKAGE]
    for source, text in texts.items():
        # Packages may have a type of the same name each: those count that are used.
        used = {
            name: kind
            for package, selected in re.findall(r"use work\.(\w+_pkg)\.(\w+)", text)
            for name, kind in packages.get(package, {}).items()
            if selected in ("all", name)
        }
        drawer = _Drawer(shared | used | _types(text), rng)

        def drawn(found: re.Match[str], drawer: _Drawer = drawer) -> str:
            value = drawer.value(found[2]) if rng.random() < share else ""
            # Line numbers stay the same, for coverage.
            rest = "\n" * found[3].count("\n")
            return f"{found[1]}{found[2]}:= {value};{rest}" if value else found[0]

        if source.name not in keep:
            text = _OBJECT.sub(drawn, text)
            for old, new in _ADDRESSES:
                text = re.sub(old, new, text)
        copies.append(folder / source.name)
        copies[-1].write_text(text)
    return copies
