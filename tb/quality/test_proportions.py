# SPDX-License-Identifier: Apache-2.0
"""Limits that keep the sources readable."""

import ast
import re
from collections import Counter
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import declarations
from plenofir.ground import project

ROOT = project.root()
# In the synthesised VHDL: share of the code that is associations in port or generic maps; share of
# all lines that is comments.
MOST_WIRING = 0.12
LEAST_COMMENTS = 0.15
# Entities for users, and tops of boards, have a generic for each choice.
CORES = ("raster_refocuser", "refocuser_axi")


def kinds(text: str) -> Counter[str]:
    """How many lines of a source are comments, code, and wiring."""
    found: Counter[str] = Counter()
    depth = 0
    for line in text.splitlines():
        code, mark, _ = line.partition("--")
        found["lines"] += 1
        found["comments"] += bool(mark) and not code.strip()
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
    assert kinds(text) == {"lines": 12, "comments": 1, "code": 10, "wiring": 3}
    assert processes(text) == {"count": 3}


def test_proportion_of_the_vhdl() -> None:
    total = sum((kinds(path.read_text()) for path in hdl.all_sources()), Counter())
    assert total["wiring"] < MOST_WIRING * total["code"], total
    assert total["comments"] > LEAST_COMMENTS * total["lines"], total


def test_processes_are_read_at_once() -> None:
    for path in hdl.all_sources():
        long = {name: lines for name, lines in processes(path.read_text()).items() if lines > 100}
        assert not long, path


def test_entities_have_few_generics() -> None:
    for path in hdl.all_sources():
        if path.stem not in CORES and not path.stem.endswith("_top"):
            assert len(declarations(path.read_text(), "generic")) <= 16, path


def test_files_are_short() -> None:
    python = [
        path for room in ("golden/plenofir", "scripts") for path in (ROOT / room).rglob("*.py")
    ]
    for path in (*(ROOT / "hdl").rglob("*.vhd"), *python):
        assert len(path.read_text().splitlines()) <= 500, path


def test_few_pages() -> None:
    assert len(list((ROOT / "docs").glob("*.md"))) <= 24


def test_a_run_is_short() -> None:
    """Each kind of simulation has its own class instead of code in ``run``."""
    text = Path(ROOT / "golden" / "plenofir" / "fpga" / "simulate" / "run.py").read_text()
    (run,) = (n for n in ast.parse(text).body if isinstance(n, ast.FunctionDef) and n.name == "run")
    assert run.end_lineno is not None
    assert run.end_lineno - run.lineno < 60
