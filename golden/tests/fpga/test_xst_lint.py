# SPDX-License-Identifier: Apache-2.0
"""The sources pass all rules of XST's linter; planted faults of each rule are found."""

from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise import xst_script
from xst_lint import lint, loop_limit
from xst_lint.intervals import ANY, INFINITE, Interval, Names, interval
from xst_lint.rules import RULES

LIMIT = loop_limit(xst_script())


def found(folder: Path, text: str, package: str = "") -> list[str]:
    """Rules that a source breaks, with the line of each place."""
    packages = folder / "a_pkg.vhd", folder / "a.vhd"
    for path, content in zip(packages, (package, text), strict=True):
        path.write_text(content)
    return [f"{f.path.name}:{f.line} {f.rule}" for f in lint(packages, LIMIT)]


def test_sources_pass() -> None:
    assert [str(finding) for finding in lint(hdl.board_sources(), LIMIT)] == []


def test_message(tmp_path: Path) -> None:
    path = tmp_path / "a.vhd"
    path.write_text("-- wait, in a comment\n\n  x <= y after 1 ns;\n")
    (finding,) = lint([path], LIMIT)
    assert str(finding) == f"{path}:3: the word after (word: {RULES['word'].precedent})"


FUNCTION = """\
  function f return natural is
  begin
    for i in {} loop
    end loop;
  end function f;
"""


@pytest.mark.parametrize(
    ("bounds", "is_found"),
    [
        ("0 to 2 ** 16 - 1", False),
        ("0 to 2 ** 17 - 1", False),
        ("0 to 2 ** 17", True),
        ("2 ** VALUE_BITS - 1 downto 0", False),
        ("0 to 2 ** (VALUE_BITS + 2)", True),
        ("0 to UNKNOWN", True),
        ("words_t'range", False),
        ("WORDS'range", False),
        ("longer_t'range", True),
        ("0 to MICRO_IMAGE_SIZE * MICRO_IMAGE_SIZE - 1", False),
        ("shifts'range", False),
    ],
)
def test_loop_limit(tmp_path: Path, bounds: str, is_found: bool) -> None:
    """A function's loop has a known number of turns, and no more than XST allows."""
    assert loop_limit("run\n-opt_mode Speed\n") == 64
    declared = """\
    VALUE_BITS : positive range 1 to 16;
    UNKNOWN : natural;
    MICRO_IMAGE_SIZE : positive
  type words_t is array (natural range 0 to 2 ** VALUE_BITS - 1) of bit;
  type longer_t is array (natural range 0 to 2 ** 18 - 1) of bit;
  constant WORDS : words_t := all_words;
"""
    text = declared + FUNCTION.format(bounds)
    assert found(tmp_path, text) == (["a.vhd:9 loop-limit"] if is_found else [])


def test_loop_in_a_process(tmp_path: Path) -> None:
    """There each turn is hardware, and the device ends first; a known number still counts."""
    for bounds, rules in (("0 to LANES - 1", []), ("0 to 200000", ["a.vhd:3 loop-limit"])):
        text = f"    LANES : positive;\n  p : process (clk) is\n    for i in {bounds} loop\n"
        assert found(tmp_path, text) == rules


def test_attribute_value(tmp_path: Path) -> None:
    text = """\
  attribute keep of a : signal is "TRUE";
  attribute rom_style of b : signal is STYLE;
  attribute rom_style of c : signal is style_of("block");
"""
    assert found(tmp_path, text) == ["a.vhd:2 attribute-value", "a.vhd:3 attribute-value"]


def test_named_slice(tmp_path: Path) -> None:
    text = """\
  subtype field is natural range 7 downto 4;
  subtype tag_t is std_logic_vector(3 downto 0);
  a <= b(field);
  c(0)(field) <= a;
  d <= b(tag_t'range);
  e <= (tag_t'range => '0');
  f : tag_t;
  g <= b(7 downto 4);
"""
    assert found(tmp_path, text) == [f"a.vhd:{line} named-slice" for line in (3, 4, 5)]


@pytest.mark.parametrize(
    ("declaration", "is_found"),
    [
        ("  signal a : natural range 0 to N - 1;", True),
        ("    a : in    natural range 0 to N - 1;", True),
        ("  subtype a is natural range 0 to N - 1;", True),
        ("    variable a : integer range -1 to ANY_NUMBER - 1;", True),
        ("  signal a : natural range 0 to larger(N - 1, 1);", False),
        ("  signal a : natural range 0 to N := 0;", False),
        ("  signal a : natural range 0 to MORE - 1;", False),
        ("  signal a : natural range 0 to LAST;", False),
        ("  signal a : std_logic_vector(ANY_NUMBER - 1 downto 0);", True),
        ("    a : out   unsigned(ANY_NUMBER * N - 1 downto 0)", True),
        ("  signal a : std_logic_vector(N - 1 downto 0);", False),
        ("  signal a : unsigned(bits_for(N - 1) - 1 downto 0);", False),
    ],
)
def test_empty_range(tmp_path: Path, declaration: str, is_found: bool) -> None:
    text = f"""\
  generic (
    -- Its own range may be what it is.
    N : positive range 1 to 1;
    ANY_NUMBER : natural;
    MORE : positive range 2 to 9
  );
  constant LAST : positive := N;
{declaration}
"""
    package = "  function bits_for (\n    value : natural\n  ) return positive;\n"
    wanted = ["a.vhd:8 empty-range"] if is_found else []
    assert found(tmp_path, text, package) == wanted


@pytest.mark.parametrize(
    ("declaration", "value", "is_found"),
    [
        ("std_logic := '0'", "'0'", False),
        ("std_logic := '1'", "'1'", False),
        ("std_logic := '1'", "'0'", True),
        ("std_logic", "'0'", False),
        ("std_logic", "'1'", True),
        ('std_logic_vector(3 downto 0) := "0000"', "(others => '0')", False),
        ("std_logic_vector(3 downto 0)", "(others => '1')", True),
        ("natural range 1 to 5", "1", False),
        ("natural range 1 to 5", "2", True),
        ("natural range 0 to 5 := 3", "0", True),
        ("state_t", "idle", False),
        ("state_t", "busy", True),
        ("state_t := busy", "busy", False),
        ("timing_t := NO_TIMING", "NO_TIMING", False),
        ("std_logic_vector(1 downto 0)", "NOTHING", False),
        ("std_logic_vector(1 downto 0)", "ALL_OF_IT", True),
    ],
)
def test_reset_value(tmp_path: Path, declaration: str, value: str, is_found: bool) -> None:
    text = f"""\
  type state_t is (idle, busy);
  signal a : {declaration};
      if enable = '1' then
        a <= b;
      end if;
      if reset = '1' then
        a <= {value};
      end if;
"""
    package = """\
  constant NOTHING : std_logic_vector(1 downto 0) := "00";
  constant ALL_OF_IT : std_logic_vector(1 downto 0) := "11";
"""
    assert found(tmp_path, text, package) == (["a.vhd:7 reset-value"] if is_found else [])


PARSING = """\
  function slice_shift (
    shifts : string;
    index  : natural
  ) return integer is
  begin
    for i in shifts'range loop
    end loop;
  end function slice_shift;
  function delay (
    shifts : string
  ) return natural is
  begin
    for i in 0 to 3 loop
      d := d + slice_shift(shifts, i);
    end loop;
  end function delay;
"""


@pytest.mark.parametrize(
    ("loops", "call", "is_found"),
    [
        (3, "slice_shift(SHIFTS, 0)", False),
        (4, "slice_shift(SHIFTS, 0)", True),
        (2, "delay(SHIFTS)", False),
        (3, "delay(SHIFTS)", True),
        (6, "table(0)", False),
    ],
)
def test_text_loops(tmp_path: Path, loops: int, call: str, is_found: bool) -> None:
    lines = ["for i in 0 to 3 loop"] * loops + [f"a := {call};"] + ["end loop;"] * loops
    wanted = [f"a.vhd:{loops + 1} text-loops"] if is_found else []
    assert found(tmp_path, "\n".join(lines), PARSING) == wanted


def test_each_rule_is_planted() -> None:
    """The tests above have one for each rule."""
    text = Path(__file__).read_text()
    assert all(f"def test_{name.replace('-', '_')}(" in text or name == "word" for name in RULES)


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        ("3", (3, 3)),
        ("-N", (-9, -1)),
        ("N + 2 * N - 1", (2, 26)),
        ("2 ** N", (2, 512)),
        ("(N + 7) / 2", (4, 8)),
        ("A mod 4", (0, 3)),
        ("larger(N - 1, 1)", (1, 8)),
        ("choose(FLAG, N, 0)", (0, 9)),
        ("divide_up(N, 2)", (1, 9)),
        ("LAST", (8, 8)),
        ("A", (0, INFINITE)),
        ("Q'length", (1, INFINITE)),
        ("B", ANY),
        ("B & C", ANY),
        ("ROUND", ANY),
    ],
)
def test_intervals(expression: str, wanted: Interval) -> None:
    names = Names().read(
        "    N : positive range 1 to 9;\n    A : natural;\n"
        "  constant LAST : natural := 9 - 1;\n  constant ROUND : integer := ROUND + 1;\n"
    )
    assert interval(expression, names) == wanted
