# SPDX-License-Identifier: Apache-2.0
"""The changes that `mutate.py` makes of the VHDL: one operator, constant, switch bit or reset each.

Two kinds of changes that no input can show are never made, see `is_idle`.
"""

import hashlib
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from plenofir.ground import project

sys.path.insert(0, str(project.root() / "tb"))

from hunt.simulate import entities, sources_of, started_sources

# Changes: pattern and replacement.
RULES: tuple[tuple[str, tuple[str, ...]], ...] = (
    (r"(?<= )\+(?= )", ("-",)),
    (r"(?<= )-(?= )", ("+",)),
    (r"(?<= )and(?= )", ("or",)),
    (r"(?<= )or(?= )", ("and",)),
    (r"(?<= )not (?=\w)", ("",)),
    (r"(?<= )=(?= )", ("/=",)),
    (r"(?<= )/=(?= )", ("=",)),
    (r"(?<= )<(?= )", ("<=", ">=")),
    (r"(?<= )>(?= )", (">=", "<")),
    (r"(?<= )>=(?= )", (">", "<")),
    (r"(?<== )'0'", ("'1'",)),
    (r"(?<== )'1'", ("'0'",)),
    (r"(?<=<= )'0'(?=;| when)", ("'1'",)),
    (r"(?<=<= )'1'(?=;| when)", ("'0'",)),
    (r"(?<=[-+/] )1(?=[ ;)])", ("0", "2")),
    (r"(?<=> )0(?= )", ("1",)),
)
# A line of a reset branch: dropped as a whole.
RESET = re.compile(r"if (?:\w+_)?reset = '1' then\n(.*?)\n +end if;", re.S)
# A signal with a value before the first clock; what a reset branch sets as a whole.
INITIAL = re.compile(r" *signal (\w+) +: [^:;]*:=")
SET = re.compile(r"^ *(\w+) *<=", re.M)
# Assignments in each clock: the lines right below the edge.
CLOCKED = re.compile(r"^( *)if rising_edge\(\w+\) then\n(.*?)^\1end if;", re.S | re.M)
# Parts that simulation leaves out, with the generic that selects them.
SYNTHESISED = re.compile(r"^ +(synthesised) : if .*?^ +end generate \1;", re.S | re.M)
# A vector or an array, and its bounds up to what makes it longer.
ELEMENTS = re.compile(
    r" *(?:signal (\w+) +: std_logic_vector|type (\w+) is array) ?\((?:[^()]|\([^()]*\))*[^()\s] $"
)
LONGER = re.compile(r"(\+|- 0)(?= ?1?(?: downto|\)))")
# Nothing in here is logic: text, declarations of ports, checks of generics.
SKIPPED = re.compile(r"--|assert|report|severity|: +in |: +out |library|use |generic|range")
# Changes that no test can notice, with the reason of each.
EXPLAINED = tuple(
    project.root() / "scripts" / f"survivors_{language}.toml" for language in ("vhdl", "python")
)

Key = tuple[str, str, str, int]
"""Source, line before and after, number of the line among those with its text."""


@dataclass(frozen=True)
class Mutant:
    """One change."""

    file: str
    line: int
    old: str  # the line before
    new: str  # the line after
    place: int  # among the lines of its file with the same text, from 1

    @property
    def key(self) -> Key:
        """Key that does not depend on line numbers."""
        return self.file, self.old.strip(), self.new.strip(), self.place


def is_idle(name: str, text: str, code: str, place: int, changed: str) -> bool:
    """Whether a change of a declaration cannot affect the behaviour of a design.

    Either it is the start value of a signal that a reset sets as a whole, or that every clock sets
    from other signals: all tests begin with a reset of some clocks, and so does the board. Or it is
    the start value of a signal for which the hunter draws random ones. Or a vector or an array gets
    longer at its end: VHDL refuses it if lengths no longer match; otherwise nothing drives or reads
    the new part. The change is at `place` in the line `code` of the source `name`.
    """
    initial = INITIAL.match(code)
    if initial and place >= initial.end():
        if name in drawn_starts():
            return True
        in_resets = any(initial[1] in SET.findall(block[1]) for block in RESET.finditer(text))
        return in_resets or is_set_each_clock(text, initial[1])
    # From the operator on, as the change may be in its right operand.
    start = code.rfind(" ", 0, place - 1) + 1 if code[place] == "1" else place
    declared = ELEMENTS.match(code[:start])
    return (
        declared is not None
        and LONGER.match(changed[start:]) is not None
        and f"{declared[1] or declared[2]}'" not in text
    )


@cache
def drawn_starts() -> frozenset[str]:
    """Sources for which the hunter draws start values, which must not matter."""
    return frozenset(source.name for source in started_sources())


@cache
def hunts_of(file: str) -> tuple[str, ...]:
    """Hunts that build a source, those of few sources first."""
    built = {name: [source.name for source in sources_of(name)] for name in entities()}
    hunts = [name for name, files in built.items() if file in files]
    return tuple(sorted(hunts, key=lambda name: len(built[name])))


def is_set_each_clock(text: str, name: str) -> bool:
    """Whether every clock sets a signal, whatever it was before."""
    return any(
        re.search(rf"^{block[1]}  {name} *<= (?!.*\b{name}\b)[^;\n]*;$", block[2], re.M)
        for block in CLOCKED.finditer(text)
    )


def mutants(sources: Sequence[Path]) -> Iterator[Mutant]:
    """All changes that the rules allow."""
    for source in sources:
        text = source.read_text()
        begins = [text.find(word) for word in ("\narchitecture ", "\npackage body ")]
        if max(begins) < 0:
            continue
        first = text[: max(begins) + 1].count("\n")
        lines = text.splitlines()

        counts: Counter[str] = Counter()
        places = []
        for line in lines:
            code = line.split("--")[0].strip()
            counts[code] += 1
            places.append(counts[code])

        left_out = {
            number
            for block in SYNTHESISED.finditer(text)
            for number in range(
                text.count("\n", 0, block.start()), text.count("\n", 0, block.end())
            )
        }
        for number, line in enumerate(lines[first:], first):
            code = line.split("--")[0]
            if SKIPPED.search(line) or number in left_out:
                continue
            for pattern, replacements in RULES:
                for match in re.finditer(pattern, code):
                    for replacement in replacements:
                        changed = code[: match.start()] + replacement + code[match.end() :]
                        if not is_idle(source.name, text, code, match.start(), changed):
                            yield Mutant(source.name, number + 1, code, changed, places[number])
        for block in RESET.finditer(text):
            start = text[: block.start(1)].count("\n")
            for number, line in enumerate(block.group(1).splitlines(), start):
                if "<=" in line and line.strip().endswith(";"):
                    yield Mutant(source.name, number + 1, line, "", places[number])


def chosen(every: Sequence[Mutant], seed: int, count: int) -> list[Mutant]:
    """Mutants that come first in an order of hashes, files mixed."""

    def order(mutant: Mutant) -> str:
        return hashlib.sha256(repr((seed, *mutant.key)).encode()).hexdigest()

    return sorted(every, key=order)[:count]


def is_explained(mutant: Mutant, keys: set[Key]) -> bool:
    """Whether a mutant's key is explained, or that of omitting its line."""
    file, old, _, place = mutant.key
    return mutant.key in keys or (file, old, "", place) in keys


def explained() -> set[Key]:
    """Keys of the mutants in the lists of survivors."""
    rows = [row for path in EXPLAINED for row in tomllib.loads(path.read_text())["survivor"]]
    return {(row["file"], row["line"], row["becomes"], row.get("number", 1)) for row in rows}


def write_mutant(mutant: Mutant | None, sources: Sequence[Path], folder: Path) -> list[Path]:
    """Copy the sources with one line changed."""
    folder.mkdir()
    copies = []
    for source in sources:
        lines = source.read_text().splitlines()
        if mutant is not None and source.name == mutant.file:
            lines[mutant.line - 1] = mutant.new
        copies.append(folder / source.name)
        copies[-1].write_text("\n".join([*lines, ""]))
    return copies
