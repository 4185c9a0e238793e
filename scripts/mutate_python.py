# SPDX-License-Identifier: Apache-2.0
"""Changes the Python in many small ways and reports what the tests do not notice.

Usage: python scripts/mutate_python.py [--room NAME ...] [--seed N ...] [--count N] [--only FILE]
                                       [--jobs N]

A mutant is one change of one operator, number or loop, made by cosmic-ray
(scripts/requirements-mutants.txt) in a copy of the package. The room's quick tests run until one
fails: first those that reach the changed line, short ones first. Which mutants are taken depends
on a hash of their text and the seed. Survivors must stand in survivors_python.toml; exit code 1 if
one does not.
"""

import argparse
import ast
import hashlib
import os
import re
import resource
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator
from coverage import CoverageData

from mutants import Key, explained
from plenofir.ground import project

ROOT = project.root()
PACKAGE = ROOT / "golden" / "plenofir"
TESTS = ROOT / "golden" / "tests"
WORK = ROOT / "build" / "mutants_python"
# Folder of the package and of its tests.
ROOMS = {"golden": "refocus", "rays": "camera/rays", "calibration": "camera/calibration"}
# Tests of foreign services, GPUs, killed processes, and folders of results.
NO_MODULES = {
    "__init__",
    "batch",
    "batch_record",
    "machine_code",
    "threads",
    "arrays",
    "constants",
    "program",
}
NO_TESTS = {"test_batch", "test_batch_kills", "test_arrays", "test_kept_code"}
# Compiled modules, whose lines are not traced, and the one that calls them.
COMPILED, CALLER = (
    {
        *("blocks", "column_vectors", "columns", "pieces", "places", "row_vectors", "rows"),
        *("strips", "vector_code", "weights"),
    },
    "refocus/compiled/frames.py",
)
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
# Lines that are not changed, nor what is indented below them, by file: no result tells of them.
UNSEEN = tomllib.loads((ROOT / "scripts" / "unseen_python.toml").read_text())
# How a picture looks: its size, its letters, lines and room.
LOOKS = re.compile(
    r"\b(alpha|constrained_layout|figsize|fontsize|height_ratios|linewidth|rotation)"
    r'"?[=:] ?(\((?:[^()]|\([^()]*\))*\)|[-\w.]+)'
)
# Processor time until a mutant counts as one that hangs.
SECONDS = 400


@dataclass(frozen=True)
class PythonMutant:
    """One change: file in the package, line (from 0), before and after, which with that text."""

    file: str
    line: int
    before: str
    after: str
    number: int
    operator: str
    occurrence: int

    @property
    def key(self) -> Key:
        """Key of the mutant in survivors_python.toml."""
        return self.file, self.before, self.after, self.number


def unseen_lines(lines: Sequence[str], listed: Sequence[str | list[Any]]) -> set[int]:
    """Numbers, from 0, of listed lines and of those indented below them."""
    unseen: set[int] = set()
    for one in listed:
        text, place = (one, 0) if isinstance(one, str) else one
        alike = [n for n, line in enumerate(lines) if line.strip() == text]
        for n in alike[place - 1 : place] if place else alike:
            depth = len(lines[n]) - len(lines[n].lstrip())
            end = n + 1
            while end < len(lines) and lines[end].startswith(" " * (depth + 1)):
                end += 1
            unseen.update(range(n, end))
    return unseen


def places_of(path: Path) -> Iterator[tuple[Path, str, int, int, str]]:
    """All that may be changed in a module: file, operator, which of its places, line, its text."""
    text = path.read_text()
    lines = text.splitlines()
    unseen = unseen_lines(lines, UNSEEN.get(path.relative_to(PACKAGE).as_posix(), ()))
    tree = list(ast_nodes(get_ast(text)))
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        places = [place for node in tree for place in operator.mutation_positions(node)]
        for occurrence, ((number, _), _) in enumerate(places):
            if not SKIPPED.search(lines[number - 1]) and number - 1 not in unseen:
                yield path, name, occurrence, number - 1, lines[number - 1].strip()


def mutant_at(path: Path, name: str, occurrence: int, line: int) -> PythonMutant | None:
    """The change there, None if it changes nothing, the looks of a picture, or is no Python."""
    text = path.read_text()
    lines = [one.strip() for one in text.splitlines()]
    changed = mutate_code(text, get_operator(f"core/{name}")(), occurrence) or text
    after = changed.splitlines()[line].strip()
    number = lines[: line + 1].count(lines[line])
    file = str(path.relative_to(PACKAGE))
    try:
        same = ast.dump(ast.parse(changed)) == ast.dump(ast.parse(text))
    except SyntaxError:
        return None
    if same or LOOKS.sub("", after) == LOOKS.sub("", lines[line]):
        return None
    return PythonMutant(file, line, lines[line], after, number, name, occurrence)


def chosen(room: str, seed: int, count: int, only: str) -> list[PythonMutant]:
    """Mutants that come first in an order of hashes; files that are compiled lie side by side."""
    sources = [p for p in sorted((PACKAGE / ROOMS[room]).rglob("*.py")) if p.stem not in NO_MODULES]
    every = [place for path in sources if only in path.name for place in places_of(path)]
    every.sort(key=lambda p: hashlib.sha256(repr((seed, p[0].name, *p[1:])).encode()).hexdigest())
    mutants: list[PythonMutant] = []
    for path, name, occurrence, line, _ in every:
        mutant = mutant_at(path, name, occurrence, line) if len(mutants) < count else None
        if mutant is not None:
            mutants.append(mutant)
    return sorted(mutants, key=lambda mutant: mutant.file)


def copy_package(mutant: PythonMutant | None, work: Path) -> Path:
    """A package of links, with a file of its own where it is changed."""
    folder = work / "golden"
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


def run_tests(
    tests: list[str], mutant: PythonMutant | None, work: Path, more: tuple[str, ...] = ()
) -> subprocess.CompletedProcess[str]:
    """Run pytest on the package with that change."""
    compiled = mutant is not None and Path(mutant.file).stem in COMPILED
    environment = {
        **os.environ,
        # Half the work where all is compiled anew; what is kept is compiled as always.
        "NUMBA_OPT": "0" if compiled else "3",
        "PYTHONPATH": str(copy_package(mutant, work)),
        # Entries depend on the sources; a compiled mutant's would displace the others'.
        "NUMBA_CACHE_DIR": str(WORK / ("numba_changed" if compiled else "numba")),
        "COVERAGE_FILE": str(work / "coverage"),
    }
    words = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
    words += ["-m", "not slow", "-n", "0", "--hypothesis-seed=0"]
    words += ["--hypothesis-profile=first_failure", *more, *tests]
    return subprocess.run(
        words,
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS)),
    )


def first_failure(process: subprocess.CompletedProcess[str]) -> str:
    """The test that failed; nothing if none did."""
    if process.returncode == 0:
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", process.stdout, re.M)
    return failed[1] if failed else f"exit code {process.returncode}"


@dataclass(frozen=True)
class Reach:
    """What a run without a change tells: seconds of each test, tests that reach each line."""

    seconds: dict[str, float]
    lines: dict[str, dict[int, list[str]]]
    files: set[str]
    failure: str

    def tests(self, mutant: PythonMutant) -> list[str]:
        """First those that reach the line or, if it is compiled, its caller; elsewhere last."""
        compiled = Path(mutant.file).stem in COMPILED
        lines = self.lines.get(CALLER if compiled else mutant.file, {})
        near = set() if compiled else set(lines.get(mutant.line + 1, ()))
        near = near or {test for some in lines.values() for test in some}
        room = sorted(self.seconds, key=lambda test: (test not in near, self.seconds[test]))
        module = f"from plenofir.{mutant.file.removesuffix('.py').replace('/', '.')} "
        elsewhere = [p for p in sorted(TESTS.rglob("test_*.py")) if module in p.read_text()]
        return [*room, *(str(p) for p in elsewhere if p.stem not in (*NO_TESTS, *self.files))]


def reach_of(room: str) -> Reach:
    """Runs the room's tests without a change."""
    # The first job's folder, as compiled code is kept for the path of its source.
    work = WORK / "job0"
    more = ("--cov=plenofir", "--cov-context=test", "--cov-report=", "-vv")
    # Times of tests below 5 ms are wanted, too.
    times = ("--durations=0", "--durations-min=0")
    files = [p for p in (TESTS / ROOMS[room]).glob("test_*.py") if p.stem not in NO_TESTS]
    process = run_tests([str(path) for path in files], None, work, (*more, *times))
    seconds: dict[str, float] = {}
    for match in re.finditer(r"^([\d.]+)s +(?:call|setup) +(\S.*)$", process.stdout, re.M):
        seconds[match[2]] = seconds.get(match[2], 0.0) + float(match[1])
    data = CoverageData(work / "coverage")
    data.read()
    lines: dict[str, dict[int, list[str]]] = {}
    for file in data.measured_files():
        contexts = data.contexts_by_lineno(file)
        lines[file.split("/plenofir/", 1)[-1]] = {
            line: [name.rsplit("|", 1)[0] for name in names if name]
            for line, names in contexts.items()
        }
    return Reach(seconds, lines, {path.stem for path in files}, first_failure(process))


def main() -> int:
    """Run the mutants of the seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--room", nargs="+", choices=ROOMS, default=list(ROOMS))
    parser.add_argument("--seed", type=int, nargs="+", default=[0])
    parser.add_argument("--count", type=int, default=120, help="of each room and seed")
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time")
    options = parser.parse_args()
    explanations, unknown = explained(), 0
    for room in options.room:
        reach = reach_of(room)
        if reach.failure:
            print(f"{room}: the tests fail without a change: {reach.failure}")
            return 2
        idle: SimpleQueue[Path] = SimpleQueue()
        for job in range(options.jobs):
            idle.put(WORK / f"job{job}")

        def notice(mutant: PythonMutant, reach: Reach, idle: SimpleQueue[Path]) -> str:
            work, start = idle.get(), time.monotonic()
            # An explained mutant cannot be noticed and is not run.
            failure, verdict = "", "explained"
            if mutant.key not in explanations:
                failure = first_failure(run_tests(reach.tests(mutant), mutant, work))
                verdict = failure or "SURVIVES"
            idle.put(work)
            print(
                f"{mutant.file}: {mutant.before} -> {mutant.after} ({mutant.number}): {verdict}, "
                f"{time.monotonic() - start:.0f} s",
                flush=True,
            )
            return failure

        for seed in options.seed:
            mutants = chosen(room, seed, options.count, options.only)
            with ThreadPoolExecutor(options.jobs) as pool:
                failures = list(pool.map(notice, mutants, repeat(reach), repeat(idle)))
            survivors = [mutant for mutant, test in zip(mutants, failures, strict=True) if not test]
            unknown += sum(mutant.key not in explanations for mutant in survivors)
            share = 100 * (1 - len(survivors) / max(len(mutants), 1))
            print(f"{room}, seed {seed}: {len(mutants)} mutants, {share:.1f} % noticed", flush=True)
    return int(unknown > 0)


if __name__ == "__main__":
    sys.exit(main())
