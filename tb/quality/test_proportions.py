# SPDX-License-Identifier: Apache-2.0
"""Limits that keep the sources readable."""

import ast
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

from lint_vhdl import (
    NO_SUBJECT,
    positional_aggregates,
    respelled_parameters,
    shared_vectors,
    unclear_comments,
)
from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import declarations, used_components, used_units
from plenofir.ground import project

ROOT = project.root()

# In the synthesised VHDL: share of the code that is associations in port or generic maps.
MOST_WIRING = 0.12
# Entities for users, and tops of boards, have a generic for each choice.
CORES = ("raster_refocuser", "refocuser_axi")


def kinds(text: str) -> Counter[str]:
    """How many lines of a source are code, and wiring."""
    found: Counter[str] = Counter()
    depth = 0
    for line in text.splitlines():
        code = line.partition("--")[0]
        found["code"] += bool(code.strip())
        if depth or re.search(r"\b(port|generic) map\b", code):
            found["wiring"] += "=>" in code
            depth += code.count("(") - code.count(")")
    return found


def processes(text: str) -> dict[str, int]:
    found = re.finditer(r"^( *)(?:(\w+) : )?process\b.*?^\1end process", text, re.S | re.M)
    return {str(match[2]): match[0].count("\n") + 1 for match in found}


def test_lines_are_counted() -> None:
    text = """-- A comment.
  add : entity work.adder
    generic map (BITS => 8)
    port map (
      clk => clk, -- beside
      sum => open
    );
  word <= (others => '0');

  count : process (clk) is
  begin
  end process count;
"""
    assert kinds(text) == {"code": 10, "wiring": 3}
    assert processes(text) == {"count": 3}


def test_proportion_of_the_vhdl() -> None:
    total = sum((kinds(path.read_text()) for path in hdl.all_sources()), Counter())
    assert total["wiring"] < MOST_WIRING * total["code"], total


@pytest.mark.parametrize(
    ("comment", "lines"),
    [
        ("-- Of a column, and of MIN_STEPS to compare it with.", [1]),
        ("-- Width of a column.\n-- It holds MIN_STEPS too.", []),
        ("-- Width of a column.\nsignal a : b; -- They are two.", [2]),
        ("-- Width of a column", [1]),
        ("--   drawn -> further in", []),
        ("-- synthesis translate_off\nassert false;", []),
        ("-- Latency: 2 clocks. Throughput: not applicable.", [1]),
        ("-- Equation: see the map.", [1]),
        ('text <= "-- It is a text";', []),
    ],
)
def test_comments_are_sentences_with_a_subject(comment: str, lines: list[int]) -> None:
    assert [line for line, _ in unclear_comments(comment)] == lines


@pytest.mark.parametrize(
    ("code", "lines"),
    [
        ("constant BUILD : build_t :=\n(M, SLICES, P, LENSES, 8);", [2]),
        ("return (a, b, c,\n        f(d, e), '0');", [1]),
        ("size => ((1, 2), a, b, c, d);", [1]),
        (
            "constant B : build_t := (m => M, slices => SLICES, p => P, lenses => 2, bits => 8);",
            [],
        ),
        ("constant FEW : few_t := (M, SLICES, P, LENSES);", []),
        ("value := bits_of(M, SLICES, P, LENSES, 8);", []),
        ("type state_t is (idle, fetch, wait_lines, offer, finish);", []),
        ("constant TABLE : words_t := (1, 2, x\"0F\", '0', -4, true);", []),
        ("constant ROWS : rows_t := ((a, b), (c, d), (a, b), (c, d), (a, b));", []),
        ("-- (a, b, c, d, e)", []),
    ],
)
def test_long_aggregates_have_names(code: str, lines: list[int]) -> None:
    assert [line for line, _ in positional_aggregates(code)] == lines


@pytest.mark.parametrize(
    ("code", "lines"),
    [
        ("signal held : size_t := (others => (others => '0'));", [1]),
        ("signal held : state_t := (\nopen => '0',\nsize => (others => (others => '0')));", [3]),
        ("signal at : sizes_t;\nat <= (others => (others => (others => '0')));", [2]),
        ("signal held : size_t := (a => (others => '0'), b => (others => '0'));", []),
        ("signal held : words_t := (others => (others => '0'));", []),
        ("type size_t is array (0 to 1) of word_t;\nx : size_t := (others => (others => 0));", []),
        ("signal held : waits_t := (others => -1);", []),
    ],
)
def test_vectors_of_a_record_have_names(code: str, lines: list[int]) -> None:
    packages = """
type size_t is record
  a, b : word_t;
end record;
type sizes_t is array (1 to 2) of size_t;
type words_t is array (1 to 2) of word_t;
"""
    fields = "type state_t is record open : std_logic; size : size_t; end record; "
    assert [line for line, _ in shared_vectors(fields + code, packages)] == lines


@pytest.mark.parametrize(
    ("code", "lines"),
    [
        ("constant A : core_t := core_of(name => f(B),\nSIZE => SIZE);", [2]),
        ("x := Core_Of(size => SIZE, shifts => (others => 0));", []),
        ("result <= core_of(g(a => 1, SIZE => 2), SHIFTS);", []),
        ("generic map (\nSIZE => SIZE,\nSHIFTS => core_of(b, Size => 1));", [3]),
        ("procedure send (value : natural) is\nbegin\nend;\nsend(VALUE => 3);", [4]),
    ],
)
def test_parameters_have_their_spelling(code: str, lines: list[int]) -> None:
    packages = """
function core_of (
  name   : string;
  size   : positive := bits_for(4);
  shifts : shifts_t := (others => 0)
) return core_t;
"""
    assert [line for line, _ in respelled_parameters(code, packages)] == lines


def test_the_vhdl_is_read_once() -> None:
    packages = "".join(path.read_text() for path in (ROOT / "hdl").rglob("*_pkg.vhd"))
    for path in (*(ROOT / "hdl").rglob("*.vhd"), *(ROOT / "tb").rglob("*.vhd")):
        assert not list(positional_aggregates(path.read_text())), path
        assert not list(shared_vectors(path.read_text(), packages)), path
        assert not list(respelled_parameters(path.read_text(), packages)), path
    for path in (ROOT / "hdl").rglob("*.vhd"):
        assert not list(unclear_comments(path.read_text())), path


def without_subject(text: str) -> list[str]:
    """Comments and docstrings of a Python source that name no subject.

    A comment in several lines is one; "The same grid" of a docstring has one.
    """
    unclear = []
    for before, line in pairwise(["", *text.splitlines()]):
        code, _, comment = line.partition("# ")
        goes_on = not code.strip() and before.lstrip().startswith("#")
        docstring = line.strip().removeprefix('"""').removeprefix("The same ")
        if not goes_on and NO_SUBJECT.match(comment):
            unclear.append(comment)
        elif line.lstrip().startswith('"""') and NO_SUBJECT.match(docstring):
            unclear.append(docstring)
    return unclear


def test_comments_of_the_python_have_a_subject() -> None:
    source = '# A list.\n# It is long.\nx = 1  # Of it.\n\n# They\n    """Of it."""\n'
    assert without_subject(source) == ["Of it.", "They", 'Of it."""']
    rooms = ("golden/plenofir", "studies", "scripts")
    for path in (path for room in rooms for path in (ROOT / room).rglob("*.py")):
        assert without_subject(path.read_text()) == [], path


def test_processes_are_read_at_once() -> None:
    for path in hdl.all_sources():
        long = {name: lines for name, lines in processes(path.read_text()).items() if lines > 100}
        assert not long, path


def test_entities_have_few_generics() -> None:
    for path in hdl.all_sources():
        if path.stem not in CORES and not path.stem.endswith("_top"):
            assert len(declarations(path.read_text(), "generic")) <= 16, path


def test_few_levels_of_instances() -> None:
    """From a core and from a board's top down to a block RAM, whatever the generics allow."""
    texts = {path.stem: path.read_text() for path in hdl.all_sources()}
    entities = {name for name, text in texts.items() if "\nentity " in text}
    parts = {
        name: (used_units(texts[name]) | used_components(texts[name])) & entities
        for name in entities
    }

    def levels(entity: str) -> int:
        return 1 + max((levels(part) for part in parts[entity]), default=0)

    assert levels("raster_refocuser") <= 6
    assert max(levels(entity) for entity in entities if entity.endswith("_top")) <= 9


def test_files_are_short() -> None:
    python = [
        path for room in ("golden/plenofir", "scripts") for path in (ROOT / room).rglob("*.py")
    ]
    for path in (*(ROOT / "hdl").rglob("*.vhd"), *python):
        assert len(path.read_text().splitlines()) <= 500, path


def test_few_pages() -> None:
    assert len(list((ROOT / "docs").glob("*.md"))) <= 25


@pytest.mark.parametrize(
    ("pages", "words"), [("boards/*.md", 2100), ("verification.md", 3500), ("studies.md", 4500)]
)
def test_pages_are_read_at_once(pages: str, words: int) -> None:
    """A long table has a page of its own in docs/measured, or a file beside its tool."""
    for path in (ROOT / "docs").glob(pages):
        assert len(path.read_text().split()) <= words, path


def test_a_run_is_short() -> None:
    """Each kind of simulation has its own class instead of code in ``run``."""
    text = Path(ROOT / "golden" / "plenofir" / "fpga" / "simulate" / "run.py").read_text()
    (run,) = (n for n in ast.parse(text).body if isinstance(n, ast.FunctionDef) and n.name == "run")
    assert run.end_lineno is not None
    assert run.end_lineno - run.lineno < 60
