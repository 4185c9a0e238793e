# SPDX-License-Identifier: Apache-2.0
"""Proves for `mutate.py` that a change of the VHDL leaves the circuits of its tests equivalent.

Usage: python scripts/mutant_proof.py OUT WORD... (lists what a run of pytest would build)

GHDL synthesises each entity that the tests of a source build, and the board, with and without the
change. The smallest modules around the difference are compared: Yosys connects the inputs of both,
and ABC proves by induction over the clocks, from registers of zeros on, that no output ever
differs. Undriven bits may have any value. Circuits that are too large, or that GHDL cannot
synthesise, are not proved.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from formal import abc_program
from mutant_tests import is_apart, rounds_of
from mutants import Mutant, write_mutant
from plenofir.fpga import hdl
from plenofir.fpga.tools.synthesis import run_yosys, write_verilog
from plenofir.ground import project
from plenofir.ground.errors import ToolError

# Processor time of one proof.
PROOF_SECONDS = 90
MODULE = re.compile(r"^module (\w+).*?^endmodule", re.S | re.M)
HEADER = re.compile(r"^module .*?\);", re.S | re.M)
INSTANCE = re.compile(r"^  (\w+) \S+ \(", re.M)
NUMBERED = re.compile(r"\bn\d+(?=_)")

Circuit = tuple[str, tuple[tuple[str, int | bool | str], ...], str]
"""Entity, generics, board whose primitives it needs."""


def circuit(top: str, generics: Mapping[str, int | bool | str], board: str = "") -> Circuit:
    """One that can be compared with others."""
    return top, tuple(sorted(generics.items())), board


def list_circuits(out: Path, words: Sequence[str]) -> int:
    """List what a run of pytest would build, without simulating."""
    sys.path.insert(0, str(project.root() / "tb"))
    from plenofir_tb import runner

    circuits: set[Circuit] = set()

    def note(cases: Sequence[Any], *_: Any, **options: Any) -> set[str]:
        board = options["board"]
        # The bench around a board simulates its primitives.
        circuits.update(
            circuit(f"{board}_top", {}, board) if board else circuit(case.top, case.generics)
            for case in cases
        )
        return set()

    with (
        mock.patch.object(runner, "_simulate", note),
        mock.patch("shutil.rmtree"),
        mock.patch.dict(os.environ, {"SEED": "1"}),
    ):
        pytest.main(["-q", "-p", "no:cacheprovider", "-m", "", *words])
    out.write_text(json.dumps(sorted(circuits, key=repr)))
    return 0


@cache
def circuits_of(test: str) -> tuple[Circuit, ...]:
    """Circuits that a round of `mutant_tests.rounds_of` builds."""
    words = [word for word in test.split() if "=" not in word]
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "circuits.json"
        subprocess.run(
            [sys.executable, __file__, str(out), *words],
            cwd=project.root(),
            stdout=subprocess.DEVNULL,
            check=True,
        )
        listed = json.loads(out.read_text())
    return tuple(circuit(top, dict(values), board) for top, values, board in listed)


def modules_of(verilog: str) -> dict[str, str]:
    """Modules of GHDL's Verilog, its numbers of signals counted from each module's first."""
    verilog = re.sub(r"/\*.*?\*/|//[^\n]*", "", verilog, flags=re.S)
    return {match[1]: _renumbered(match[0]) for match in MODULE.finditer(verilog)}


def _renumbered(module: str) -> str:
    numbers: dict[str, str] = {}
    return NUMBERED.sub(lambda name: numbers.setdefault(name[0], f"n{len(numbers)}"), module)


def synthesised(mutant: Mutant | None, circuit: Circuit, folder: Path) -> dict[str, str]:
    """Modules of a circuit; those of the sources are kept while they stay as they are."""
    top, generics, board = circuit
    sources = hdl.board_sources(board) if board else hdl.hdl_sources()
    benches = {path.stem: path for path in (project.root() / "tb").rglob("*.vhd")}
    text = repr((circuit, [source.read_text() for source in sources]))
    kept = project.root() / "build" / "mutant_proof" / hashlib.sha256(text.encode()).hexdigest()
    if mutant is None and kept.is_file():
        return modules_of(kept.read_text())
    folder.mkdir(parents=True)
    files = write_mutant(mutant, sources, folder / "hdl")
    wrappers = [benches[top]] if top in benches else []
    primitives = {"": "", "atlys": "unisim", "ulx3s": "ecp5u"}[board]
    verilog = write_verilog([*files, *wrappers], top, dict(generics), folder, primitives=primitives)
    if mutant is None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(verilog.read_text())
    return modules_of(verilog.read_text())


class Comparison:
    """Modules of one circuit without and with a change."""

    def __init__(self, before: dict[str, str], after: dict[str, str], folder: Path) -> None:
        self.before, self.after, self.folder = before, after, folder
        # Whether a module is proved to be equal.
        self.proved: dict[str, bool] = {}

    def below(self, modules: dict[str, str], name: str) -> list[str]:
        """A module and all in it."""
        names, todo = [], [name]
        while todo:
            one = todo.pop()
            if one in modules and one not in names:
                names.append(one)
                todo += INSTANCE.findall(modules[one])
        return names

    def text(self, modules: dict[str, str], name: str) -> str:
        """Verilog of a module and all in it."""
        return "\n".join(modules[one] for one in sorted(self.below(modules, name)))

    def equal(self, name: str) -> bool:
        """Whether a module's outputs with and without the change are always equal."""
        if name not in self.proved:
            self.proved[name] = self._equal(name)
        return self.proved[name]

    def _equal(self, name: str) -> bool:
        if name not in self.before or name not in self.after:
            # A primitive of the board.
            return name not in self.before and name not in self.after
        if self.text(self.before, name) == self.text(self.after, name):
            return True
        headers = [HEADER.match(side[name]) for side in (self.before, self.after)]
        assert headers[0] is not None
        assert headers[1] is not None
        if headers[0][0] != headers[1][0]:
            return False
        children = INSTANCE.findall(self.before[name])
        # All are looked at: an equal one may be part of other circuits.
        parts = [self.equal(child) for child in dict.fromkeys(children)]
        if self.before[name] == self.after[name] and all(parts):
            return True
        return are_equivalent(
            name, self.text(self.before, name), self.text(self.after, name), self.folder
        )


# Proofs by their texts: the same module is part of many circuits.
_verdicts: dict[str, bool] = {}


def are_equivalent(name: str, before: str, after: str, folder: Path) -> bool:
    """Whether Yosys and ABC prove two circuits equal."""
    key = hashlib.sha256(f"{before}\0{after}".encode()).hexdigest()
    if key not in _verdicts:
        place = folder / key[:12]
        place.mkdir(parents=True)
        try:
            _verdicts[key] = _prove(name, before, after, place)
        except ToolError:
            _verdicts[key] = False
    return _verdicts[key]


def _prove(name: str, before: str, after: str, place: Path) -> bool:
    commands = []
    for side, text in (("before", before), ("after", after)):
        (place / f"{side}.v").write_text(text)
        commands += [
            f"read_verilog {side}.v; hierarchy -check -top {name}; proc; flatten; opt",
            f"memory_map; opt -full; async2sync; rename {name} {side}; design -stash {side}",
        ]
    commands += [
        "design -copy-from before -as before before; design -copy-from after -as after after",
        "setundef -undriven -anyseq; setundef -init -zero",
        "miter -equiv -flatten before after both; hierarchy -top both",
        "techmap; opt -full; dffunmap; setundef -init -zero; zinit -all",
        "dfflegalize -cell $_DFF_P_ 01; aigmap; opt_clean; write_aiger -zinit proof.aig",
    ]
    run_yosys(commands, place / "yosys.log")
    abc = f"ulimit -t {PROOF_SECONDS}; exec '{abc_program()}' -q "
    abc += "'read_aiger proof.aig; strash; dprove; print_status'"
    log = place / "abc.log"
    with log.open("wb") as output:
        subprocess.run(["sh", "-c", abc], cwd=place, stdout=output, stderr=output, check=False)
    return re.search(r"^Status = 1\b", log.read_text(errors="replace"), re.M) is not None


def proved_circuits(mutant: Mutant, folder: Path) -> int:
    """Number of circuits of its tests that hold a mutant's source, if all are proved to be equal.

    0 if one differs or is not proved.
    """
    tests = (test for test in rounds_of(mutant) if not is_apart(test))
    circuits = dict.fromkeys(circuit for test in tests for circuit in circuits_of(test))
    entity = Path(mutant.file).stem
    package = entity.endswith("_pkg")
    proved: set[str] = set()
    holding = 0
    for number, circuit in enumerate(circuits):
        try:
            before = synthesised(None, circuit, folder / f"before-{number}")
            versions = {name for name in before if re.fullmatch(rf"{entity}(_[\d_a-f]+)?", name)}
            if not versions and not package:
                continue
            holding += 1
            if versions and versions <= proved:
                continue
            after = synthesised(mutant, circuit, folder / f"after-{number}")
        except ToolError:
            return 0
        comparison = Comparison(before, after, folder / "proofs")
        if not comparison.equal(circuit[0]):
            return 0
        proved |= {name for name in versions if comparison.equal(name)}
    return holding


if __name__ == "__main__":
    sys.exit(list_circuits(Path(sys.argv[1]), sys.argv[2:]))
