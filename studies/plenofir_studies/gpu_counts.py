# SPDX-License-Identifier: Apache-2.0
"""Instructions that a GPU's kernel executes, counted in NVIDIA's compiled code without a GPU.

NVRTC gives PTX. The threads of a block are followed through it, from the first barrier that is no
vote on only one of each warp: integers are computed, and pixels are zeros, so that loops and
branches that depend on places and not on pixels are taken as on a GPU. A warp counts as its first
thread, which has no less to do than its others.
"""

import re
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

ARCHITECTURE = "compute_90"
_MOST_STEPS = 1_000_000
_WARP = 32
_BITS = {"8": 8, "16": 16, "32": 32, "64": 64}

_TABLE = re.compile(r"^\.global \.align \d \.b8 (\w+)\[\d+\] = \{([^}]*)\};", re.MULTILINE)

Operation = Callable[[int, int], int]


def compiled(text: str) -> str:
    """PTX of a source of CUDA C++. Raises ImportError without NVRTC."""
    from cuda.bindings import nvrtc

    def asked(answer: tuple[Any, ...]) -> Any:
        status, *rest = answer
        if status != nvrtc.nvrtcResult.NVRTC_SUCCESS:
            raise RuntimeError(str(status))
        return rest[0] if rest else None

    program = asked(nvrtc.nvrtcCreateProgram(text.encode(), b"", 0, [], []))
    options = [f"--gpu-architecture={ARCHITECTURE}".encode(), b"--std=c++17"]
    asked(nvrtc.nvrtcCompileProgram(program, len(options), options))
    code = b" " * asked(nvrtc.nvrtcGetPTXSize(program))
    asked(nvrtc.nvrtcGetPTX(program, code))
    return bytes(code).decode().rstrip("\0")


@dataclass(frozen=True)
class _Instruction:
    predicate: str  # with ! in front if inverted; empty for none
    operation: Sequence[str]
    operands: Sequence[str]


def _divided(a: int, b: int) -> int:
    """Quotient towards zero."""
    quotient = abs(a) // abs(b) if b else 0
    return quotient if (a < 0) == (b < 0) else -quotient


_TWO: Mapping[str, Operation] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "and": lambda a, b: a & b,
    "or": lambda a, b: a | b,
    "xor": lambda a, b: a ^ b,
    "min": min,
    "max": max,
    "shl": lambda a, b: a << min(b, 64),
    "shr": lambda a, b: a >> min(b, 64),
    "div": _divided,
    "rem": lambda a, b: a - _divided(a, b) * b,
}
_COMPARED: Mapping[str, Callable[[int, int], bool]] = {
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
}
# What gives no number here: it is counted, and its results are 0.
_OPAQUE = {"atom", "red", "prmt", "shf", "bfe", "bfi", "dp2a", "dp4a"}


def _typed(value: int, kind: str) -> int:
    """A number as a type such as s32 has it."""
    if kind == "pred":
        return value & 1
    bits = _BITS[kind[1:]]
    value &= (1 << bits) - 1
    return value - (1 << bits) if kind[0] == "s" and value >> (bits - 1) else value


class Kernel:
    """A kernel of PTX."""

    def __init__(self, ptx: str, name: str) -> None:
        # Tables get addresses that no parameter has.
        self._tables: dict[str, int] = {}
        self._memory: dict[int, int] = {}
        for number, (table, numbers) in enumerate(_TABLE.findall(ptx), 1):
            self._tables[table] = number << 40
            values = bytes(map(int, numbers.split(",")))
            for n in range(0, len(values), 4):
                word = int.from_bytes(values[n : n + 4].ljust(4, b"\0"), "little", signed=True)
                self._memory[(number << 40) + n] = word
        start = ptx.index(f".entry {name}(")
        self._text = ptx[start : ptx.index("\n}", start)]

    @cached_property
    def _lines(self) -> tuple[list[_Instruction], dict[str, int]]:
        """Instructions, and where labels stand among them."""
        instructions: list[_Instruction] = []
        labels: dict[str, int] = {}
        body = self._text[self._text.index("\n{") + 2 :]
        for line in map(str.strip, body.splitlines()):
            if match := re.match(r"(\$\w+):", line):
                labels[match[1]] = len(instructions)
            elif match := re.match(r"(?:@(!?%p\d+)\s+)?([a-z][\w.:]*)\s*(.*);", line):
                vectors = re.findall(r"\{[^}]*\}|\[[^]]*\]|[^,\s]+", match[3])
                split = match[2].split(".")
                instructions.append(_Instruction(match[1] or "", split, vectors))
        return instructions, labels

    def executed(
        self,
        parameters: Sequence[int],
        block: tuple[int, int],
        threads: int,
        grid: tuple[int, int],
        given: Mapping[int, int] | None = None,
    ) -> int:
        """Instructions that the warps of a block execute; `given`: numbers in memory."""
        memory = self._memory | dict(given or {})
        place = {
            "%ntid.x": threads,
            "%ctaid.x": block[0],
            "%ctaid.y": block[1],
            "%nctaid.x": grid[0],
            "%nctaid.y": grid[1],
        }
        running = {
            thread: self._of_thread(parameters, place | {"%tid.x": thread}, memory)
            for thread in range(threads)
        }
        executed = 0
        vote: int | None = None
        while running:
            votes: list[int | None] = []
            for thread, steps in [*running.items()]:
                try:
                    votes.append(steps.send(vote))
                except StopIteration as end:
                    executed += end.value * (thread % _WARP == 0)
                    del running[thread]
            if None in votes:
                running = {thread: each for thread, each in running.items() if thread % _WARP == 0}
            vote = int(any(votes))
        return executed

    def _of_thread(
        self, parameters: Sequence[int], values: dict[str, int], memory: dict[int, int]
    ) -> Generator[int | None, int | None, int]:
        """Instructions that a thread executes.

        It stops at barriers: with its vote, and goes on with that of all, or with none.
        """
        instructions, labels = self._lines
        at = 0
        for counted in range(1, _MOST_STEPS):
            each = instructions[at]
            at += 1
            if each.predicate:
                holds = values.get(each.predicate.lstrip("!"), 0)
                if bool(holds) == each.predicate.startswith("!"):
                    continue
            name = each.operation[0]
            if name in ("ret", "exit"):
                return counted
            if each.operation[:2] == ["bar", "red"]:
                values[each.operands[0]] = (yield self._value(each.operands[-1], values)) or 0
            elif name in ("bar", "barrier"):
                yield None
            elif each.operation[:2] == ["atom", "shared"]:
                place = self._place(each.operands[1], values)
                values[each.operands[0]] = memory.get(place, 0)
                memory[place] = values[each.operands[0]] + self._value(each.operands[2], values)
            elif name == "bra":
                at = labels[each.operands[0]]
            elif name in ("ld", "st"):
                self._moved(each, parameters, values, memory)
            elif name in _OPAQUE:
                values[each.operands[0]] = 0
            else:
                given = [self._value(operand, values) for operand in each.operands[1:]]
                values[each.operands[0]] = _result(each.operation, given)
        raise RuntimeError("a loop does not end")

    def _value(self, operand: str, values: Mapping[str, int]) -> int:
        """A register, an address, or a number."""
        if operand.startswith("%"):
            return values.get(operand, 0)
        if operand in self._tables:
            return self._tables[operand]
        return int(operand, 0) if re.fullmatch(r"-?\d\w*", operand) else 0

    def _place(self, operand: str, values: Mapping[str, int]) -> int:
        """An address in brackets."""
        return sum(self._value(part, values) for part in operand.strip("[]").split("+"))

    def _moved(
        self,
        each: _Instruction,
        parameters: Sequence[int],
        values: dict[str, int],
        memory: dict[int, int],
    ) -> None:
        """Load or store a number, or a vector of words."""
        stores = each.operation[0] == "st"
        of_registers, place_of = each.operands[::-1] if stores else each.operands
        registers = re.findall(r"-?[%\w.]+", of_registers)
        if number := re.search(r"_param_(\d+)", place_of):
            values[registers[0]] = parameters[int(number[1])]
            return
        place = self._place(place_of, values)
        for n, register in enumerate(registers):
            if stores:
                memory[place + 4 * n] = self._value(register, values)
            else:
                values[register] = memory.get(place + 4 * n, 0)


def _result(operation: Sequence[str], given: list[int]) -> int:
    """What an instruction computes."""
    name, kind = operation[0], operation[-1]
    if name == "setp":
        source = [_typed(each, kind if kind[0] != "b" else f"u{kind[1:]}") for each in given[:2]]
        result = int(_COMPARED[operation[1]](*source))
        if len(given) > 2:
            result = result & given[2] if operation[2] == "and" else result | given[2]
        return result
    if name == "selp":
        return given[0] if given[2] else given[1]
    if name == "cvta":
        return given[0]
    if name in ("mov", "cvt"):
        return _typed(_typed(given[0], kind), operation[-2] if name == "cvt" else kind)
    if name in ("not", "neg", "abs"):
        operand = _typed(given[0], kind)
        return _typed({"not": ~operand, "neg": -operand, "abs": abs(operand)}[name], kind)
    if name in ("mul", "mad"):
        product = _typed(given[0], kind) * _typed(given[1], kind)
        bits = _BITS[kind[1:]]
        if operation[1] == "hi":
            product >>= bits
        wide = f"{kind[0]}{2 * bits}" if operation[1] == "wide" else kind
        return _typed(product + (given[2] if name == "mad" else 0), wide)
    if name not in _TWO:
        raise RuntimeError(f"{'.'.join(operation)} is not known")
    shifts = name in ("shl", "shr")
    numbers = _typed(given[0], kind), given[1] if shifts else _typed(given[1], kind)
    return _typed(_TWO[name](*numbers), kind)
