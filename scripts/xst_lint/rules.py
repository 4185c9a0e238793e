# SPDX-License-Identifier: Apache-2.0
"""The rules, and where each comes from."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from xst_lint.intervals import SCALAR, Interval, Names, interval

MAX_TEXT_LOOPS = 4
"""Loops around and in the parsing of a text: slices and phases, and slices and characters."""

Places = Iterator[tuple[int, str]]
"""Places in a text, and what is wrong there."""


@dataclass(frozen=True)
class Design:
    """Common to all sources: names of the packages, and the whole text, for its functions."""

    names: Names
    text: str
    loop_limit: int  # turns of a loop that XST takes

    @cached_property
    def text_functions(self) -> dict[str, str]:
        """Functions with a parameter of type string, and their bodies."""
        return {
            name: body
            for name, parameters, body in re.findall(
                r"\bfunction (\w+) \(([^)]*)\) return [\w.]+ is(.*?)\bend function\b",
                self.text,
                re.S,
            )
            if re.search(r":\s*string\b", parameters)
        }


@dataclass(frozen=True)
class Source:
    """A source without its comments."""

    text: str
    design: Design

    @cached_property
    def names(self) -> Names:
        """Names visible in it: its own before those of the packages."""
        shared = self.design.names
        copies = (dict(shared.types), dict(shared.values), dict(shared.ranges), dict(shared.kinds))
        return Names(*copies).read(self.text)

    @cached_property
    def functions(self) -> list[tuple[int, int]]:
        """Where its functions begin and end."""
        pattern = r"\bfunction \w+(?: \([^)]*\))? return [\w.]+ is.*?\bend function\b"
        return [match.span() for match in re.finditer(pattern, self.text, re.S)]

    def interval(self, expression: str) -> Interval:
        """Evaluate an expression that stands in it."""
        return interval(expression, self.names)


@dataclass(frozen=True)
class Rule:
    """A rule: its source, and what it finds."""

    precedent: str
    find: Callable[[Source], Places]


def loop_limit(script: str) -> int:
    """XST's limit of turns of a loop, as a script for it or the Tcl of a project sets it."""
    match = re.search(r"-loop_iteration_limit (\d+)", script)
    return int(match[1]) if match else 64


def long_loops(source: Source) -> Places:
    """Loops with more iterations than XST allows; in functions, also those of unknown number.

    Iterations outside of functions make hardware, so the device is too small before the limit.
    """
    for match in re.finditer(r"\bfor \w+ in ((?:(?!\bgenerate\b)[^;])*?) loop\b", source.text):
        bounds = " ".join(match[1].split())
        if whole := re.fullmatch(r"(\w+)'range", bounds):
            length = source.interval(f"{whole[1]}'length")[1]
            ends = source.names.bounds(whole[1]) or ("1", str(length))
        else:
            first, way, last = re.split(r" (to|downto) ", bounds.removeprefix("natural range "))
            ends = (first, last) if way == "to" else (last, first)
        turns = source.interval(ends[1])[1] - source.interval(ends[0])[0] + 1
        is_known = turns < float("inf")
        is_in_function = any(begin <= match.start() < end for begin, end in source.functions)
        limit = source.design.loop_limit
        if turns > limit and (is_known or is_in_function):
            number = f"{turns:.0f}" if is_known else "an unknown number of"
            yield match.start(), f"{number} turns of {bounds}, {limit} are allowed"


def computed_attributes(source: Source) -> Places:
    """Attributes whose value is not a literal."""
    for match in re.finditer(r"\battribute (\w+) of [\w, ]+: \w+ is ([^;]+);", source.text):
        if not re.fullmatch(r'"[^"]*"|true|false|\d+', match[2].strip()):
            yield match.start(), f"the value of {match[1]} is computed: {match[2]}"


def named_slices(source: Source) -> Places:
    """Slices by the name or the range of a subtype."""
    for name, *scalar in re.findall(rf"\bsubtype (\w+) is(?: {SCALAR};)?", source.text):
        pattern = rf"[\w)]\(({name})\)" if scalar[0] else rf"[\w)]\(({name}'range)\)"
        for match in re.finditer(pattern, source.text):
            yield match.start(1), f"a slice by {match[1]}"


def empty_ranges(source: Source) -> Places:
    """Integer ranges that may have a single value, and vectors that may have no element."""
    generics = re.search(r"\bgeneric \((.*?)^  \);", source.text, re.S | re.M)
    for match in re.finditer(
        r"^\s*(?:(?:signal|variable)?\s*\w+\s*:\s*(?:in\s+|out\s+)?|subtype \w+ is )"
        r"(?:natural|integer|positive) range ([^;:]+?) to ([^;:]+?)\s*(?:;|:=|$)",
        source.text,
        re.M,
    ):
        if generics and generics.start() <= match.start() < generics.end():
            continue
        if source.interval(match[1])[1] >= source.interval(match[2])[0]:
            yield match.start(1), f"{match[1]} to {match[2]} may be one value alone"
    for match in re.finditer(
        r":\s*(?:in\s+|out\s+)?(?:std_logic_vector|unsigned|signed)\(([^;\n]+) downto 0\)",
        source.text,
    ):
        if source.interval(match[1])[0] < 0:
            yield match.start(1), f"{match[1]} downto 0 may be empty"


_ONE_ZERO = r"(?:'0'|x?\"0+\"|0|false|\(others => (?:'0'|0|\(others => '0'\))\))"
# Or a record of them.
_ZERO = re.compile(rf"{_ONE_ZERO}|\( ?(?:(?:\w+ +=> )?{_ONE_ZERO}(?:, | ?(?=\))))+\)")


def reset_values(source: Source) -> Places:
    """Registers whose initial value differs from their reset value."""
    first_literals = dict(re.findall(r"\btype (\w+) is \(\s*(\w+)", source.text))
    begins: dict[str, str] = {}
    for name, kind, low, value in re.findall(
        r"^\s*signal (\w+)\s*:\s*(\w+)(?: range (\S+) to [^;:]+)?[^;:]*?(?::=([^;]+))?;",
        source.text,
        re.M,
    ):
        begins[name] = " ".join((value or low or first_literals.get(kind, "'0'")).split())
    for block in re.finditer(
        r"\b(?:if|elsif) (?:\w*reset\w*|request) = '1' then(.*?)\b(?:elsif|else|end if)\b",
        source.text,
        re.S,
    ):
        for match in re.finditer(r"^\s*(\w+)([^;<]*?)\s*<=([^;]+);", block[1], re.M):
            value, begin = (
                source.names.values.get(text.lower(), text).strip()
                for text in (" ".join(match[3].split()), begins.get(match[1], "'0'"))
            )
            if value != begin and not (_ZERO.fullmatch(value) and _ZERO.fullmatch(begin)):
                at = block.start(1) + match.start(1)
                yield at, f"{match[1]}{match[2]} powers up as {begin}, its reset is {value}"


def text_loops(source: Source) -> Places:
    """Loops that parse a string in each iteration, which takes XST hours for many slices."""
    for at, loops, name in _parsings(source.text, source.design.text_functions):
        if loops > MAX_TEXT_LOOPS:
            yield at, f"{loops} loops around and in {name}, which parses a text"


def _parsings(
    text: str, functions: Mapping[str, str], inside: frozenset[str] = frozenset()
) -> Iterator[tuple[int, int, str]]:
    """Calls that parse a string, and loops over one: position, nesting depth, name."""
    calls = rf"\b({'|'.join(functions or ['$'])}) ?\((?!\n)"
    around = 0
    for match in re.finditer(
        rf"\b(end loop)\b|\bfor \w+ in ([^;]*?) (?:loop|generate)\b|\bend (generate)\b|{calls}",
        text,
    ):
        if match[1] or match[3]:
            around -= 1
            continue
        inner = [match[4]] if match[4] else re.findall(calls, match[2])
        if match[2] == "shifts'range":
            yield match.start(), around + 1, match[2]
        for name in inner:
            if name not in inside:
                deepest = max(
                    (
                        loops
                        for _, loops, _ in _parsings(functions[name], functions, inside | {name})
                    ),
                    default=0,
                )
                if deepest:
                    yield match.start(), around + deepest, name
        around += match[2] is not None


def other_words(source: Source) -> Places:
    """Words of VHDL that XST ignores or refuses."""
    for match in re.finditer(
        r"\b(after|wait|buffer|guarded|disconnect|file|access|real)\b", source.text
    ):
        yield match.start(), f"the word {match[0]}"


RULES = {
    "loop-limit": Rule(
        "XST ends with an error at a loop of more than -loop_iteration_limit turns; clash-compiler "
        "issue 638",
        long_loops,
    ),
    "attribute-value": Rule(
        "UG687 shows literals as values of attributes, and no design built with ISE was found that "
        "computes one",
        computed_attributes,
    ),
    "named-slice": Rule(
        "no design built with ISE was found that slices by the name of a subtype", named_slices
    ),
    "empty-range": Rule(
        "HDLParsers:3350, null range, in vhdl2008c issue 2; tools differ, Quartus swaps the bounds",
        empty_ranges,
    ),
    "reset-value": Rule(
        "UG384: a register has one attribute for power-up and reset, so that another value costs "
        "logic, or a latch (Xst:3002); without initial value it powers up as 0 (AR 18605)",
        reset_values,
    ),
    "text-loops": Rule(
        "XST interprets functions at elaboration, one character after the other", text_loops
    ),
    "word": Rule("UG687, VHDL that is ignored or not supported", other_words),
}
"""Name of each rule to the rule."""
