# SPDX-License-Identifier: Apache-2.0
"""Finds statements and branches of the VHDL, and lines of the package, that no test reaches.

Usage: python scripts/measure_coverage.py [--full] [--tests FILE ... | --folder DIR]

Runs the tests with NVC, without the slow ones unless --full, and writes docs/measured/coverage.md.
With --tests it runs only these and adds to the data of an earlier run; with --folder it only reads
such data. Exit code 1 below the goals of docs/verification.md, or if something is unreached that
scripts/unreached.toml does not explain.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

from coverage import Coverage

from plenofir.fpga import hdl
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground import project
from plenofir.ground.errors import InputError

ROOT = project.root()
PAGE = ROOT / "docs" / "measured" / "coverage.md"
EXPLAINED = ROOT / "scripts" / "unreached.toml"
STATEMENT = "statement"
STATEMENT_GOAL, LINE_GOAL = 99, 95
STUDIES = "studies/plenofir_studies/"
FOLDER = ROOT / "build" / "coverage"
# Tests of sources, pages and installed copies, or of changed VHDL.
LEFT_OUT = (
    "golden/tests/test_architecture.py",
    "golden/tests/test_docs_commands.py",
    "golden/tests/test_install.py",
    "golden/tests/test_links.py",
    "golden/tests/view/test_browser.py",
    "tb/quality",
)
# The first line of an assignment or a return, for those that no simulation elaborates.
ASSIGNS = re.compile(r" +(?:[\w.]+(?:\([^=]*\))? +(?:<=|:=) |return )")
DECLARES = re.compile(r" *(?:signal|constant|variable|alias|attribute|type|subtype|file) ")
HEAD = """\
# What tests reach

Written by `make coverage`; [what is counted and what the rest is](../verification.md#coverage).
Files have the names that they had in that run, of {date}.

"""

Item = tuple[str, int, str, str]
"""Entity, line, place in the entity, and ``statement`` or which way of a branch."""


@dataclass
class Unreached:
    """Items of a file, and those not reached."""

    statements: int = 0
    branches: int = 0
    missed: set[int] = field(default_factory=set)
    missed_statements: int = 0
    missed_branches: dict[int, set[str]] = field(default_factory=dict)


def items(
    scope: ElementTree.Element, unit: str = "", path: str = "", line: int = 0
) -> Iterator[tuple[Item, int]]:
    """Counts of an exported database below a scope; the same position in all instances is one."""
    entity, dash, _ = scope.get("block_name", "").rpartition("-")
    if dash:
        unit, path = entity.lower(), ""
    else:
        # Some runs keep the case of names. Unnamed items have numbers after those optimised away.
        path += "." + re.sub(r"\(.*\)|^_s\d+$", "", scope.get("name", "").lower())
    line = int(scope.get("line", line))
    for child in scope:
        if child.tag == "scope":
            yield from items(child, unit, path, line)
        elif child.tag in (STATEMENT, "branch"):
            way = STATEMENT if child.tag == STATEMENT else child.get("hier", "").split(".")[-1]
            yield (unit, line, path, way), int(child.get("data", 0))


def exported(database: Path) -> ElementTree.Element:
    """A database of NVC as XML."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "exported.xml"
        command = ["nvc", "--cover-export", "--format=xml"]
        command += ["-o", str(file), str(database.resolve())]
        # NVC makes a library where it runs.
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        return ElementTree.parse(file).getroot()


def merged(databases: Iterable[Path]) -> Counter[Item]:
    """How often each item was reached in all simulations together."""
    hits: Counter[Item] = Counter()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for root in pool.map(exported, databases):
            for item, count in items(root):
                hits[item] += count
    return hits


def assignments(source: str) -> set[int]:
    """Lines of an architecture that begin an assignment or a return."""
    lines = source.splitlines()
    first = next(
        (n for n, text in enumerate(lines) if text.startswith("architecture ")), len(lines)
    )
    numbers, continued = set(), False
    for number, text in enumerate(lines[first:], first + 1):
        code = text.split("--")[0].rstrip()
        if not continued and ASSIGNS.match(code) and not DECLARES.match(code):
            numbers.add(number)
        continued = bool(code) and not code.endswith(
            (";", " is", "begin", "then", "else", "loop", "generate", "=>")
        )
    return numbers


def vhdl_files(hits: Counter[Item], sources: Iterable[Path]) -> dict[Path, Unreached]:
    """Coverage of each entity; an assignment that is never elaborated counts as unreached."""
    files = {}
    for source in sources:
        text = source.read_text()
        if "\narchitecture " not in text:
            continue
        hits_here = {item: count for item, count in hits.items() if item[0] == source.stem}
        result = files[source] = Unreached()
        for (_, line, _, way), count in hits_here.items():
            if way == STATEMENT:
                result.statements += 1
                result.missed_statements += not count
                if not count:
                    result.missed.add(line)
            else:
                result.branches += 1
                if not count:
                    result.missed_branches.setdefault(line, set()).add(way)
        counted = {line for _, line, _, _ in hits_here}
        absent = assignments(text) - counted
        result.statements += len(absent)
        result.missed_statements += len(absent)
        result.missed |= absent
    return files


def python_files(folder: Path) -> dict[str, tuple[int, list[int]]]:
    """Lines of each file of the package that can run, how many, and those that none did."""
    with TemporaryDirectory() as scratch:
        report = Path(scratch) / "report.json"
        coverage = Coverage(data_file=str(Path(scratch) / "all"), config_file=False)
        # Compiled code is not traced; each such function is compared with its definition.
        coverage.exclude("@compiled")
        coverage.combine([str(file) for file in folder.glob("data.*")], strict=True, keep=True)
        coverage.json_report(outfile=str(report))
        files = json.loads(report.read_text())["files"]
    entries = {}
    for name, content in files.items():
        path = Path(name).resolve().as_posix()
        missed = content["missing_lines"]
        count = len(content["executed_lines"]) + len(missed)
        if count:
            entries["golden/" + path.rpartition("/golden/")[2]] = (count, missed)
    return dict(sorted(entries.items()))


def explained(kind: str) -> dict[tuple[str, str], str]:
    """Why something is not reached, in ``vhd`` or ``py``: file, line, reason."""
    rows = tomllib.loads(EXPLAINED.read_text())["unreached"]
    return {(row["file"], row["line"]): row["why"] for row in rows if row["file"].endswith(kind)}


def share(reached: int, of: int) -> str:
    """Per cent, never rounded up to 100."""
    return f"{int(1000 * reached / of) / 10:.1f} %" if of else "-"


def vhdl_page(files: dict[Path, Unreached]) -> tuple[list[str], float, list[str]]:
    """Table and list of the VHDL, its share of statements, and what is not explained."""
    reasons = explained(".vhd")
    rows, listed, open_ends = [], [], []
    totals = Counter[str]()
    for path, unreached in sorted(files.items()):
        name = path.relative_to(ROOT / "hdl").as_posix()
        missed_ways = sum(map(len, unreached.missed_branches.values()))
        numbers = (
            unreached.statements - unreached.missed_statements,
            unreached.statements,
            unreached.branches - missed_ways,
            unreached.branches,
        )
        totals.update(dict(zip(("s", "S", "b", "B"), numbers, strict=True)))
        rows.append(row(f"`{name}`", numbers))
        lines = path.read_text().splitlines()
        for line in sorted(unreached.missed | unreached.missed_branches.keys()):
            text = lines[line - 1].split("--")[0].strip()
            ways = unreached.missed_branches.get(line, set())
            outcomes = (
                "never" if line in unreached.missed else " and ".join(sorted(map(way_name, ways)))
            )
            why = reasons.get((path.name, text)) or reasons.get((path.name, "*"))
            if not why:
                open_ends.append(f"{name}:{line}: {outcomes}: {text}")
            listed.append(
                f"| `{name}` {line} | `{escaped(text)}` | {outcomes} | {why or '**open**'} |"
            )
    total = tuple(totals[key] for key in ("s", "S", "b", "B"))
    page = [
        "## VHDL",
        "",
        "| entity | statements | reached | branches | reached |",
        "| --- | --- | --- | --- | --- |",
        *rows,
        row("**all**", total),
        "",
        "| where | what | not reached | why |",
        "| --- | --- | --- | --- |",
        *listed,
    ]
    return page, 100 * total[0] / total[1], open_ends


def way_name(way: str) -> str:
    """One way of a branch, in words."""
    return {"BIN_TRUE": "true", "BIN_FALSE": "false"}.get(way, "a choice")


def escaped(text: str) -> str:
    """Code in a cell of a table."""
    return text.replace("|", "\\|")


def row(name: str, numbers: tuple[int, ...]) -> str:
    """Row of a table from pairs of what is reached and what is there."""
    pairs = zip(numbers[::2], numbers[1::2], strict=True)
    return " | ".join([f"| {name}", *(f"{of} | {share(got, of)}" for got, of in pairs)]) + " |"


def ranges(lines: list[int]) -> str:
    """Line numbers, neighbours as one."""
    parts: list[list[int]] = []
    for line in lines:
        if parts and line == parts[-1][1] + 1:
            parts[-1][1] = line
        else:
            parts.append([line, line])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in parts)


def python_page(files: dict[str, tuple[int, list[int]]]) -> tuple[list[str], float]:
    """Table of the package, and its share of lines outside of the studies."""
    reasons = explained(".py")
    rows, total, reached = [], 0, 0
    for name, (count, missed) in files.items():
        if not name.startswith(STUDIES):
            total += count
            reached += count - len(missed)
        short = name.removeprefix("golden/plenofir/")
        why = reasons.get((short, "*"), "")
        numbers = (count - len(missed), count)
        rows.append(f"{row(f'`{short}`', numbers)} {ranges(missed)} | {why} |")
    page = [
        "## Python",
        "",
        "| file | lines | reached | not reached | why |",
        "| --- | --- | --- | --- | --- |",
        *rows,
        f"{row('**all but studies**', (reached, total))} | |",
    ]
    return page, 100 * reached / total


def run_tests(folder: Path, tests: Sequence[str], *, full: bool) -> None:
    """Run tests, or all; databases and data of coverage.py go into a folder."""
    (folder / "vhdl").mkdir(parents=True, exist_ok=True)
    (folder / "python").mkdir(exist_ok=True)
    which = list(tests) or [f"--ignore={name}" for name in LEFT_OUT]
    which += [] if full else ["-m", "not slow or counted"]
    jobs = os.environ.get("JOBS") or str(os.cpu_count())
    command = [sys.executable, "-m", "coverage", "run", "-m", "pytest", "-q", "-n", jobs]
    environment = {
        "SIM": "nvc",
        "NVC_COVERAGE": str(folder / "vhdl"),
        "COVERAGE_FILE": str(folder / "python" / "data"),
    }
    process = subprocess.run(
        [*command, "--dist", "worksteal", *which],
        cwd=ROOT,
        env={**os.environ, **environment},
        check=False,
    )
    if process.returncode:
        print("coverage: tests failed; what they reach counts all the same", file=sys.stderr)


def main() -> int:
    """Measure, write the page, and say what is below the goals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="the slow tests too")
    parser.add_argument("--tests", nargs="+", default=[], help="these alone, added to earlier runs")
    parser.add_argument("--folder", type=Path, help="what an earlier run left, to read it again")
    options = parser.parse_args()
    try:
        find_simulator("nvc")
    except InputError as error:
        print(f"coverage: {error}", file=sys.stderr)
        return 2
    folder = options.folder or FOLDER
    if not options.folder:
        if not options.tests:
            shutil.rmtree(folder, ignore_errors=True)
        run_tests(folder, options.tests, full=options.full)
    vhdl = vhdl_files(merged(sorted((folder / "vhdl").glob("*.ncdb"))), hdl.all_sources())
    vhdl_lines, statements, open_ends = vhdl_page(vhdl)
    python_lines, lines = python_page(python_files(folder / "python"))
    PAGE.write_text("\n".join([HEAD.format(date=date.today()), *vhdl_lines, "", *python_lines, ""]))
    print(f"statements of the VHDL {statements:.1f} %, lines of the package {lines:.1f} %")
    print(*open_ends, sep="\n")
    return int(bool(open_ends) or statements < STATEMENT_GOAL or lines < LINE_GOAL)


if __name__ == "__main__":
    sys.exit(main())
