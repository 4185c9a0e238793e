# SPDX-License-Identifier: Apache-2.0
"""Elaborates single entities, to check whether and with which message generics are refused."""

import os
import random
import re
import subprocess
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.tools.simulators import find_simulator, generic_text
from plenofir.ground import project

Generics = Mapping[str, int | bool | str]
# GHDL 5 also writes "assert".
_REFUSED = re.compile(r"(?:\(assert(?:ion)? failure\)|\*\* Failure: \(init\)): (.*)")
_INTEGER = re.compile(r"(positive|natural|integer)(?: range (-?\d+) to (-?\d+))?")
# Memories of some megabits need more than GHDL's default of 16 MB.
_NVC = ("nvc", "--std=1993", "-H", "1g", "-e", "--jit", "--no-save")
_LARGEST = 2**31 - 1


def seeded() -> random.Random:
    """Random numbers by the variable SEED; the seed is printed."""
    seed = int(os.environ.get("SEED") or 1)
    print(f"seed {seed}")
    return random.Random(seed)


class Elaborator:
    """A library in a folder of all sources that need no vendor's library, and of given others."""

    def __init__(self, simulator: str, folder: Path, *more: Path) -> None:
        self._folder = folder
        self._nvc = simulator == "nvc"
        self._environment = {**os.environ, **find_simulator(simulator, brief=True).environment}
        self.analyse(*hdl.hdl_sources(), *more)

    def analyse(self, *sources: Path) -> None:
        command = ["nvc", "--std=1993", "-a"] if self._nvc else ["ghdl", "-a", "--std=93"]
        refused, text = self._run([*command, *map(str, sources)])
        assert not refused, text

    def _run(self, command: Sequence[str]) -> tuple[str, str]:
        """The first refusal that is printed, and all that is until then; none if it succeeds."""
        text = ""
        with subprocess.Popen(
            command,
            cwd=self._folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process:
            assert process.stdout is not None
            for line in process.stdout:
                text += line
                match = _REFUSED.search(text)
                if match:
                    # GHDL 5 would go on, and take all memory for what it has refused.
                    process.kill()
                    return match[1], text
        assert process.returncode == 0, f"{' '.join(command)}\n{text}"
        return "", text

    def refusal(self, entity: str, generics: Generics) -> str:
        """The message of the refusal; empty if it elaborates. Any other end fails."""
        values = [f"-g{name}={generic_text(value)}" for name, value in generics.items()]
        if self._nvc:
            command = [*_NVC, *values, entity]
        else:
            command = ["ghdl", "--elab-run", "--std=93", entity, *values]
            command += ["--no-run", "--max-stack-alloc=0"]
        return self._run(command)[0]

    def refusals(self, cases: Sequence[tuple[str, Generics]]) -> list[str]:
        """Refusals of many cases, some in parallel."""
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(lambda case: self.refusal(*case), cases))

    def printed(self, entity: str) -> str:
        command = [*_NVC, entity, "-r"] if self._nvc else ["ghdl", "--elab-run", "--std=93", entity]
        refused, text = self._run(command)
        assert not refused, text
        return text


def declared(entity: str) -> dict[str, str]:
    """Generics of an entity, or of a bench in VHDL, and their types."""
    benches = (project.root() / "tb").rglob("*.vhd")
    (path,) = (path for path in (*hdl.all_sources(), *benches) if path.stem == entity)
    return {g.name: g.type_name for g in declarations(path.read_text(), "generic")}


def _ends(kind: str) -> tuple[int, int]:
    match = _INTEGER.fullmatch(kind)
    assert match, kind
    low = int(match[2]) if match[2] else int(match[1] == "positive")
    return low, int(match[3]) if match[3] else _LARGEST


def may_be(kind: str, value: int | bool | str) -> bool:
    """Whether a value is within a generic's type."""
    if isinstance(value, int) and _INTEGER.fullmatch(kind):
        low, high = _ends(kind)
        return low <= value <= high
    return kind == {bool: "boolean", str: "string"}.get(type(value))


def draw_integer(rng: random.Random, kind: str) -> int:
    """A random value of a declared range: often one of its ends, otherwise mostly small."""
    low, high = _ends(kind)
    small = min(high, low + int(2 ** rng.uniform(0, 7)))
    return rng.choice([low, high, small, small, small, rng.randint(low, min(high, low + 9999))])
