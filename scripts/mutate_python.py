# SPDX-License-Identifier: Apache-2.0
"""Changes the Python in many small ways and reports what the tests do not notice.

Usage: python scripts/mutate_python.py [--room NAME ...] [--seed N] [--count N] [--only FILE]

A mutant is one change of one operator, number or loop, made by cosmic-ray
(scripts/requirements-mutants.txt) in a copy of the package. The room's quick tests run until one
fails, those of the changed module first. Which mutants are taken depends on a hash of their text
and the seed. Survivors must stand in docs/verification.md; exit code 1 if one does not.
"""

import argparse
import hashlib
import os
import re
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

from mutants import Key, explained
from plenofir.ground import project

ROOT = project.root()
PACKAGE = ROOT / "golden" / "plenofir"
TESTS = ROOT / "golden" / "tests"
WORK = ROOT / "build" / "mutants_python"
# Folder of the package and of its tests.
ROOMS = {"golden": "refocus", "rays": "camera/rays", "calibration": "camera/calibration"}
# Tests of foreign services, GPUs, killed processes, and folders of results.
NO_MODULES = {"__init__", "batch", "record", "threads", "arrays", "cuda"}
NO_TESTS = {"test_batch", "test_batch_kills", "test_arrays", "test_kept_code"}
OPERATORS = (
    *("AddNot", "NumberReplacer", "ReplaceAndWithOr", "ReplaceOrWithAnd", "ZeroIterationForLoop"),
    *("ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceUnaryOperator_Delete_USub"),
    *(
        f"ReplaceBinaryOperator_{pair}"
        for pair in ("Add_Sub", "Sub_Add", "Mul_Add", "FloorDiv_Mul", "Div_Mul", "Mod_FloorDiv")
    ),
    *(
        f"ReplaceComparisonOperator_{pair}"
        for pair in ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt", "Eq_NotEq", "NotEq_Eq", "Lt_GtE")
    ),
)
# Lines of text and types, and texts for people.
SKIPPED = re.compile(r'^\s*(#|"""|@|from |import |class |def |raise |where=)|Literal\[')
# Processor time until a mutant counts as one that hangs.
SECONDS = 400


@dataclass(frozen=True)
class PythonMutant:
    """One change: file in the package, line before and after, which of the lines with that text."""

    file: str
    before: str
    after: str
    number: int
    operator: str
    occurrence: int

    @property
    def key(self) -> Key:
        """As it stands in docs/verification.md."""
        return self.file, self.before, self.after, self.number


def places_of(path: Path) -> Iterator[tuple[Path, str, int, int, str]]:
    """All that may be changed in a module: file, operator, which of its places, line, its text."""
    text = path.read_text()
    lines = text.splitlines()
    tree = list(ast_nodes(get_ast(text)))
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        places = [place for node in tree for place in operator.mutation_positions(node)]
        for occurrence, ((number, _), _) in enumerate(places):
            if not SKIPPED.search(lines[number - 1]):
                yield path, name, occurrence, number - 1, lines[number - 1].strip()


def mutant_at(path: Path, name: str, occurrence: int, line: int) -> PythonMutant | None:
    """The change there, None if it changes nothing."""
    text = path.read_text()
    lines = [one.strip() for one in text.splitlines()]
    changed = mutate_code(text, get_operator(f"core/{name}")(), occurrence) or text
    after = changed.splitlines()[line].strip()
    number = lines[: line + 1].count(lines[line])
    file = str(path.relative_to(PACKAGE))
    if after == lines[line]:
        return None
    return PythonMutant(file, lines[line], after, number, name, occurrence)


def chosen(room: str, seed: int, count: int, only: str) -> list[PythonMutant]:
    """Those that come first in an order of hashes; files that are compiled lie side by side."""
    sources = [p for p in sorted((PACKAGE / ROOMS[room]).glob("*.py")) if p.stem not in NO_MODULES]
    every = [place for path in sources if only in path.name for place in places_of(path)]
    every.sort(key=lambda p: hashlib.sha256(repr((seed, p[0].name, *p[1:])).encode()).hexdigest())
    found: list[PythonMutant] = []
    for path, name, occurrence, line, _ in every:
        mutant = mutant_at(path, name, occurrence, line) if len(found) < count else None
        if mutant is not None:
            found.append(mutant)
    return sorted(found, key=lambda mutant: mutant.file)


def copy_package(mutant: PythonMutant | None) -> Path:
    """A package of links, with a file of its own where it is changed."""
    folder = WORK / "golden"
    shutil.rmtree(folder, ignore_errors=True)
    place, target = PACKAGE, folder / "plenofir"
    for part in Path(mutant.file).parts if mutant is not None else ():
        target.mkdir(parents=True)
        for entry in place.iterdir():
            if entry.name not in (part, "__pycache__"):
                (target / entry.name).symlink_to(entry)
        place, target = place / part, target / part
    if mutant is None:
        folder.mkdir(parents=True)
        target.symlink_to(place)
        return folder
    operator = get_operator(f"core/{mutant.operator}")()
    changed = mutate_code(place.read_text(), operator, mutant.occurrence)
    assert changed is not None
    target.write_text(changed)
    return folder


def tests_of(room: str, stem: str) -> list[Path]:
    """The room's tests, first those of a module."""
    tests = sorted((TESTS / ROOMS[room]).glob("test_*.py"))
    # Those elsewhere that import the module.
    module = f"plenofir.{ROOMS[room].replace('/', '.')}.{stem} "
    tests += [p for p in sorted(TESTS.rglob("test_*.py")) if f"from {module}" in p.read_text()]
    tests = [path for path in dict.fromkeys(tests) if path.stem not in NO_TESTS]
    return sorted(tests, key=lambda path: (stem not in path.stem, path.stat().st_size))


def notices(room: str, mutant: PythonMutant | None) -> str:
    """The first test that fails; nothing if none does."""
    stem = "" if mutant is None else Path(mutant.file).stem
    environment = {
        **os.environ,
        "PYTHONPATH": str(copy_package(mutant)),
        # One cache for all mutants, as its entries depend on their sources.
        "NUMBA_CACHE_DIR": str(WORK / "numba"),
    }
    words = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
    words += ["-m", "not slow", "-n", "0", "--hypothesis-seed=0", *map(str, tests_of(room, stem))]
    done = subprocess.run(
        words,
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS)),
    )
    if done.returncode == 0:
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.M)
    return failed[1] if failed else f"exit code {done.returncode}"


def main() -> int:
    """Run the mutants of one seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--room", nargs="+", choices=ROOMS, default=list(ROOMS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=120, help="of each room")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    known, unknown = explained(), 0
    for room in options.room:
        if found := notices(room, None):
            print(f"{room}: the tests fail without a change: {found}")
            return 2
        survivors = 0
        mutants = chosen(room, options.seed, options.count, options.only)
        for number, mutant in enumerate(mutants, 1):
            start = time.monotonic()
            found = notices(room, mutant)
            named = mutant.key in known
            survivors += not found
            unknown += not found and not named
            told = found or ("explained" if named else "SURVIVES")
            print(
                f"{number}/{len(mutants)} {mutant.file}: {mutant.before} -> {mutant.after} "
                f"({mutant.number}): {told}, {time.monotonic() - start:.0f} s",
                flush=True,
            )
        share = 100 * (1 - survivors / max(len(mutants), 1))
        print(f"{room}, seed {options.seed}: {len(mutants)} mutants, {share:.1f} % noticed")
    return int(unknown > 0)


if __name__ == "__main__":
    sys.exit(main())
