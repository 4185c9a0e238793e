# SPDX-License-Identifier: Apache-2.0
"""Style of the VHDL sources by vsg, only of those that changed since they were found good.

Usage: python scripts/lint_vhdl.py

Good sources, with the version of vsg and its configuration, are recorded in build/vsg, as reading
all sources takes a minute. Names that are visible beside Verilog (ports, generics, signals, labels)
must not be reserved words of SystemVerilog, which some mixed-language simulators refuse. Comments
begin with their subject, header lines say something, and fields of records are given by name.
No aggregate stands for several vectors of a record, and calls write parameters as declared.
"""

import hashlib
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib.metadata import version
from pathlib import Path

from plenofir.ground import project

ROOT = project.root()
CONFIGURATION = ROOT / "scripts" / "vsg.yaml"
GOOD = ROOT / "build" / "vsg" / "good.txt"

# IEEE 1800-2017, annex B, without those that VHDL reserves too or that name no thing.
_WORDS = """
accept_on always always_comb always_ff always_latch assign automatic before bind bins binsof bit
break buf bufif0 bufif1 byte casex casez cell chandle checker class clocking cmos const
constraint continue covergroup coverpoint cross deassign default defparam design dist do edge
endcase endmodule enum eventually expect export extends extern final first_match force foreach
forever fork forkjoin genvar global highz0 highz1 iff ifnone implements implies import incdir
include initial input inside instance int integer interconnect interface intersect join join_any
join_none large let liblist local localparam logic longint macromodule matches medium modport
module negedge nettype nexttime nmos notif0 notif1 output packed parameter pmos posedge
primitive priority program property pull0 pull1 pulldown pullup rand randc randcase randsequence
rcmos real realtime ref reg reject_on repeat restrict rnmos rpmos rtran scalared sequence
shortint shortreal signed small soft solve specify specparam static string strong strong0
strong1 struct super supply0 supply1 table tagged task this throughout time timeprecision
timeunit tran tri tri0 tri1 triand trior trireg typedef union unique unique0 unsigned until
untyped uwire var vectored virtual void wand weak weak0 weak1 wildcard wire within wor
"""
RESERVED = frozenset(_WORDS.split())


def reserved_names(text: str) -> Iterator[tuple[int, str]]:
    """Lines and names of ports, generics, signals and labels that SystemVerilog reserves."""
    plain = re.sub(r"--[^\n]*", "", text)
    # Fields of records and parameters of functions are visible in VHDL only.
    for inside in (
        r"\bis record\b.*?\bend record\b",
        r"\b(?:function|procedure)\s+\w+\s*\(.*?\)\s*(?:return|;|is)",
    ):
        plain = re.sub(inside, lambda match: "\n" * match[0].count("\n"), plain, flags=re.S)
    for match in re.finditer(r"^ *(?:signal +)?(\w+(?: *, *\w+)*) *:(?!=)", plain, re.M):
        for name in re.split(r" *, *", match[1]):
            if name in RESERVED:
                yield plain.count("\n", 0, match.start(1)) + 1, name


# A comment is read without its neighbours, so it does not begin with one of these.
NO_SUBJECT = re.compile(r"(It|They|Those|That of|Of|The same)\b")
# Lines of a header that say nothing.
_RITUAL = re.compile(
    r"\b(Latency|Throughput|Equation): *(?:[Nn]one|not applicable|see the map|as its parts)\b"
)
# Split, or reuse takes the pattern for the licence of this file.
_DIRECTIVE = re.compile(r" (SPDX-License-" r"Identifier: \S+|synthesis translate_o(n|ff))$")
# Positional aggregates of more values than this are refused, as swapped ones would compile.
MOST_POSITIONAL = 4


def unclear_comments(text: str) -> Iterator[tuple[int, str]]:
    """Lines and words of comments that name no subject, that are no sentence, that say nothing.

    A comment in several lines is one; drawings stand further in, and one beside code may be words.
    """
    goes_on = False
    lines = [re.sub(r'"[^"]*"', '""', line).partition("--") for line in text.splitlines()]
    for number, (code, mark, comment) in enumerate(lines, 1):
        alone = bool(mark) and not code.strip()
        ends = number == len(lines) or not lines[number][1] or bool(lines[number][0].strip())
        if not (alone and goes_on) and NO_SUBJECT.match(comment.lstrip()):
            yield number, comment.strip()
        elif ritual := _RITUAL.search(comment):
            yield number, ritual[0]
        elif (
            alone and ends and re.match(r" \S.*[^-.:]$", comment) and not _DIRECTIVE.match(comment)
        ):
            yield number, comment.strip()
        goes_on = alone


def positional_aggregates(text: str) -> Iterator[tuple[int, str]]:
    """Lines and first values of aggregates of many values without names.

    Tables of literals or of aggregates are arrays, lists behind ``is`` enumerations, and what a
    name stands in front of is a call.
    """
    literal = re.compile(r"""[-+]?[\d_.]+(#\w+#)?|\w?"[^"]*"|'.'|true|false|\(.*""", re.S | re.I)
    plain = re.sub(r"--[^\n]*", "", text)
    # Each open bracket's place, whether it opens an aggregate, where its values begin.
    opened: list[tuple[int, bool, list[int]]] = []
    for token in re.finditer(r"""\w?"[^"\n]*"|'[^'\n]'(?!\()|[(),]""", plain):
        if token[0] == "(":
            before = re.search(
                r"([A-Za-z]\w*|\S|^)\s*$", plain[max(0, token.start() - 80) : token.start()]
            )
            word = before[1].lower() if before else ""
            aggregate = word in ("return", "when", "else") or not re.match(r"[a-z\"]", word)
            opened.append((token.start(), aggregate, [token.end()]))
        elif token[0] == "," and opened:
            opened[-1][2].append(token.end())
        elif token[0] == ")" and opened:
            place, aggregate, begins = opened.pop()
            ends = [begin - 1 for begin in begins[1:]] + [token.start()]
            values = [plain[a:b].strip() for a, b in zip(begins, ends, strict=True)]
            if (
                aggregate
                and len(values) > MOST_POSITIONAL
                and not any("=>" in value for value in values)
                and not all(literal.fullmatch(value) for value in values)
            ):
                yield plain.count("\n", 0, place) + 1, ", ".join(values[:3])


@cache
def _types(text: str) -> dict[str, str]:
    """Types of a text with what their elements are, nothing for records."""
    plain = re.sub(r"--[^\n]*", "", text).lower()
    declared = r"\btype\s+(\w+)\s+is\s+(?:record\b|array\b[^;]*?\bof\s+(\w+))"
    return dict(re.findall(declared, plain))


def shared_vectors(text: str, packages: str) -> Iterator[tuple[int, str]]:
    """Lines and names of what gives several vectors of a record one aggregate: others => (...).

    NVC 1.23 gives all these vectors the length of the first. `packages` is the text of the packages
    that declare types beside those of `text`, which hide theirs.
    """
    plain = re.sub(r"--[^\n]*", "", text).lower()
    elements = _types(packages) | _types(text)
    names = set(re.findall(r"(\w+)\s*:\s*(?:in\s+|out\s+)?(\w+)", plain))
    values = r"\b([a-z]\w*)\s*(?::[^;=]*)?(?:=>|:=|<=)\s*\(((?:\s*others\s*=>\s*\()+)"
    for found in re.finditer(values, plain):
        types = {kind for name, kind in names if name == found[1]}
        for _ in range(found[2].count("(")):
            if "" in (of := {elements[kind] for kind in types if kind in elements}):
                yield plain.count("\n", 0, found.start()) + 1, found[1]
                break
            types = of


@cache
def _parameters(text: str) -> dict[str, set[str]]:
    """Parameters of the subprograms that a text declares, by their names in small letters."""
    declared: dict[str, set[str]] = {}
    heads = r"\b(?:function|procedure)\s+(\w+)\s*\((.*?)\)\s*(?:return\b|is\b|;)"
    for name, parameters in re.findall(heads, re.sub(r"--[^\n]*", "", text), re.S):
        declared.setdefault(name.lower(), set()).update(re.findall(r"(\w+)\s*:", parameters))
    return declared


def respelled_parameters(text: str, packages: str) -> Iterator[tuple[int, str]]:
    """Lines and parameters that a call writes in other letters than the subprogram: SIZE => SIZE.

    NVC 1.23 knows no such parameter where it keeps the case of names, as cocotb asks it to.
    """
    plain = re.sub(r"--[^\n]*", "", text)
    declared = _parameters(packages) | _parameters(text)
    for call in re.finditer(r"\b(\w+)\s*\((?=([^;]*))", plain):
        spelled, values, before = declared.get(call[1].lower(), set()), call[2], ""
        # What stands in brackets belongs to other calls.
        while spelled and values != before:
            before = values
            values = re.sub(r"\([^()]*\)", lambda inner: re.sub(r"[^\n]", " ", inner[0]), values)
        for used in re.finditer(r"(\w+)\s*=>", values.partition(")")[0] if spelled else ""):
            if used[1] not in spelled and used[1].lower() in map(str.lower, spelled):
                yield plain.count("\n", 0, call.start(2) + used.start()) + 1, used[1]


def digests() -> dict[str, Path]:
    """Hashes of everything that vsg's verdict depends on, by source."""
    common = version("vsg").encode() + b"\0" + CONFIGURATION.read_bytes() + b"\0"
    return {
        hashlib.sha256(common + str(path).encode() + b"\0" + path.read_bytes()).hexdigest(): path
        for folder in ("hdl", "tb", "examples")
        for path in sorted((ROOT / folder).rglob("*.vhd"))
    }


def main() -> int:
    """Print what vsg finds, and what the checks above refuse."""
    refused = []
    packages = "".join(path.read_text() for path in (ROOT / "hdl").rglob("*_pkg.vhd"))
    for path in sorted(path for folder in ("hdl", "tb") for path in (ROOT / folder).rglob("*.vhd")):
        text = path.read_text()
        refused += [
            f"{path}:{line}: ({values}, ... without names; write field => value"
            for line, values in positional_aggregates(text)
        ]
        refused += [
            f"{path}:{line}: {name}: (others => (...)) for fields of a record; name the fields"
            for line, name in shared_vectors(text, packages)
        ]
        refused += [
            f"{path}:{line}: {name}: not in the letters that the subprogram declares it in"
            for line, name in respelled_parameters(text, packages)
        ]
        if not path.is_relative_to(ROOT / "hdl"):
            continue
        refused += [
            f"{path}:{line}: '{words}' is no sentence with a subject"
            for line, words in unclear_comments(text)
        ]
        # Models have the names that a vendor's primitives have.
        if not path.is_relative_to(ROOT / "hdl" / "sim"):
            refused += [
                f"{path}:{line}: {name} is a reserved word of SystemVerilog; choose another name"
                for line, name in reserved_names(text)
            ]
    if refused:
        print(*refused, sep="\n")
        return 1
    sources = digests()
    good = set(GOOD.read_text().split()) if GOOD.exists() else set()
    changed = [str(path) for digest, path in sources.items() if digest not in good]
    if not changed:
        return 0
    command = [str(Path(sys.executable).parent / "vsg"), "--configuration", str(CONFIGURATION)]
    command += ["--output_format", "syntastic", "--filename", *changed]
    status = subprocess.run(command, check=False).returncode
    if status == 0:
        GOOD.parent.mkdir(parents=True, exist_ok=True)
        GOOD.write_text("\n".join(sources) + "\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
