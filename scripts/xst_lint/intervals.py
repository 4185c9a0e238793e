# SPDX-License-Identifier: Apache-2.0
"""Least and greatest values of integer expressions, from the types and limits of their names."""

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from plenofir.fpga.core.configuration import (
    MAX_COLUMNS,
    MAX_MICRO_IMAGE_SIZE,
    MAX_ROWS,
    MAX_SHIFT,
    MAX_SLICES,
    SLICE_ENGINES,
)
from plenofir.fpga.core.engine import MAX_LANE_DELAY, MAX_PARALLEL_ROWS, PIXELS_PER_CLOCK
from plenofir.refocus.sharpness import MAX_SHARPNESS_RADIUS

Interval = tuple[float, float]

INFINITE = float("inf")
ANY: Interval = (-INFINITE, INFINITE)

_MOST_PIXELS = PIXELS_PER_CLOCK[-1]

# Limits of generics, parameters and results beyond those of their types.
LARGEST: dict[str, float] = {
    "micro_image_size": MAX_MICRO_IMAGE_SIZE,
    "phase": MAX_MICRO_IMAGE_SIZE,
    "max_columns": MAX_COLUMNS,
    "parallel_rows": MAX_PARALLEL_ROWS,
    "closed_width": MAX_MICRO_IMAGE_SIZE,
    "all_lines": MAX_ROWS,
    "radius": MAX_SHARPNESS_RADIUS,
    "pixels": _MOST_PIXELS,
    "pixels_per_clock": _MOST_PIXELS,
    "bank_count": _MOST_PIXELS + MAX_MICRO_IMAGE_SIZE,
    "token_places": _MOST_PIXELS + MAX_MICRO_IMAGE_SIZE,
    "lane_delay": MAX_LANE_DELAY,
    "shift": MAX_SHIFT,
    "slice_count": MAX_SLICES,
    "slices": MAX_SLICES,
    "bits_for": 31,
    # A shift has at most five characters and a blank.
    "shifts__length": 6 * MAX_SLICES,
    # Other texts: names, and the answers of the serial port.
    "a__length": 32,
    "text__length": 2048,
    # Bits of a number, block RAMs of a memory.
    "t": 64,
    "exponent": 64,
    "number__length": 64,
    "gray__left": 64,
    "index": 232,
    **{name: most for engine in SLICE_ENGINES.values() for name, most in engine.LARGEST.items()},
}
# The tops assert that a set of slices is not empty; tables and strings of packages have elements.
SMALLEST = {"slice_count": 1, "answers__length": 2, "pll_registers__high": 1, "gray__left": 0}

SCALAR = r"(positive|natural|integer)(?: range ([^;:]+?) (?:to|downto) ([^;:]+?))?"
_PARENTHESES = r"[^()\n]*(?:\((?:[^()\n]|\([^()\n]*\))*\)[^()\n]*)*"


@dataclass
class Names:
    """What sources declare, by name in small letters."""

    # Integer objects and functions with an integer result: type and bounds (empty if there are
    # none).
    types: dict[str, tuple[str, str, str]] = field(default_factory=dict)
    values: dict[str, str] = field(default_factory=dict)  # constant to its expression
    # Array, or its type, to the bounds of its index.
    ranges: dict[str, tuple[str, str]] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)  # object to the name of its type

    def bounds(self, array: str) -> tuple[str, str] | None:
        """Bounds of the index of an array, or of its type."""
        name = array.lower()
        return self.ranges.get(name) or self.ranges.get(self.kinds.get(name, ""))

    def read(self, text: str) -> "Names":
        """Read the declarations of a text; if a name is declared twice, the wider type counts."""
        order = ("integer", "natural", "positive")
        types: dict[str, tuple[str, str, str]] = {}
        for pattern in (
            rf"\b(\w+)\s*:\s*(?:in\s+|out\s+)?{SCALAR}\s*(?=;|:=|\n|\))",
            rf"\bsubtype (\w+) is {SCALAR};",
            r"\bfunction (\w+)(?:\s*\([^)]*\))?\s*return (positive|natural|integer)()()\b",
        ):
            for name, kind, low, high in re.findall(pattern, text):
                old = types.get(name.lower())
                if old is None or order.index(kind) < order.index(old[0]):
                    types[name.lower()] = (kind, low, high)
        self.types |= types
        for name, value in re.findall(r"\bconstant (\w+)\s*:[^:;]*?:=\s*([^;]*);", text):
            self.values[name.lower()] = value
        for name, low, high in re.findall(
            r"\b(\w+)\s*(?::|is)[^;:()\n]*\((?:natural range )?"
            rf"({_PARENTHESES}) (?:to|downto) ({_PARENTHESES})\)",
            text,
        ):
            self.ranges[name.lower()] = (low, high)
        for name, kind in re.findall(r"\b(?:constant|variable|signal) (\w+)\s*:\s*(\w+)", text):
            self.kinds[name.lower()] = kind.lower()
        return self


def interval(expression: str, names: Names) -> Interval:
    """Least and greatest value that an expression of integers can have; infinite if unknown."""
    return _Evaluation(names, frozenset()).of_text(expression)


@dataclass(frozen=True)
class _Evaluation:
    """An evaluation under way, with the names that it is inside of."""

    names: Names
    inside: frozenset[str]

    def of_text(self, expression: str) -> Interval:
        plain = re.sub(r"'(\w+)", r"__\1", " ".join(expression.split()).lower())
        plain = re.sub(r"\b(?:mod|rem)\b", "%", plain)
        try:
            return self.of(ast.parse(plain, mode="eval").body)
        except SyntaxError:
            return ANY

    def of(self, node: ast.expr) -> Interval:
        match node:
            case ast.Constant(value=int(value)):
                return (value, value)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                low, high = self.of(operand)
                return (-high, -low)
            # A field of a record has its declaration in the record.
            case ast.Name(id=name) | ast.Attribute(attr=name):
                return self.of_name(name)
            case ast.BinOp(left=left, op=op, right=right):
                return _of_pair(op, self.of(left), self.of(right))
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self.of_call(name, [self.of(argument) for argument in arguments])
        return ANY

    def of_name(self, name: str) -> Interval:
        if name in self.inside:
            return ANY
        inner = _Evaluation(self.names, self.inside | {name})
        low, high = inner.of_type(name)
        if name in self.names.values:
            value = inner.of_text(self.names.values[name])
            low, high = max(low, value[0]), min(high, value[1])
        if name.endswith("__length"):
            low = 1
        return (max(low, SMALLEST.get(name, -INFINITE)), min(high, LARGEST.get(name, INFINITE)))

    def of_type(self, name: str) -> Interval:
        if name not in self.names.types:
            return ANY
        kind, *bounds = self.names.types[name]
        low, high = {"positive": 1.0, "natural": 0.0, "integer": -INFINITE}[kind], INFINITE
        if all(bounds):
            ends = [self.of_text(bound) for bound in bounds]
            low, high = max(low, min(e[0] for e in ends)), max(e[1] for e in ends)
        return (low, high)

    def of_call(self, name: str, arguments: Sequence[Interval]) -> Interval:
        if name == "larger":
            return (max(a[0] for a in arguments), max(a[1] for a in arguments))
        if name == "choose":
            return (min(a[0] for a in arguments[1:]), max(a[1] for a in arguments[1:]))
        if name == "divide_up":
            return (min(arguments[0][0], 1), arguments[0][1])
        if name == "bits_for" and arguments[0][1] < INFINITE:
            return (1, max(1, int(arguments[0][1]).bit_length()))
        return self.of_name(name)


def _of_pair(op: ast.operator, a: Interval, b: Interval) -> Interval:
    match op:
        case ast.Add():
            return (a[0] + b[0], a[1] + b[1])
        case ast.Sub():
            return (a[0] - b[1], a[1] - b[0])
        # For other operators only non-negative operands are evaluated.
        case ast.Mult() if a[0] >= 0 <= b[0]:
            return (a[0] * b[0], a[1] * b[1])
        case ast.Div() if a[0] >= 0:
            return (a[0] // b[1] if b[1] < INFINITE else 0, a[1] // max(b[0], 1))
        case ast.Mod():
            return (0, b[1] - 1)
        case ast.Pow() if a[0] >= 0 <= b[0]:
            return (a[0] ** b[0], a[1] ** b[1] if b[1] <= 64 else INFINITE)
    return ANY
