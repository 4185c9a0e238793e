# SPDX-License-Identifier: Apache-2.0
"""The mutation check: small changes of the VHDL are noticed, or explained."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import mutant_proof
import mutant_tests
import mutants
from plenofir.fpga import hdl
from plenofir.ground import project

SCRIPT = project.root() / "scripts" / "mutate.py"


@pytest.mark.slow
def test_survivors_are_explained(tmp_path: Path) -> None:
    out = tmp_path / "mutants.json"
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--count", "120", "--out", str(out)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"(\d+) of (\d+) mutants killed", done.stdout)
    assert found
    assert int(found.group(2)) >= 100
    assert len(json.loads(out.read_text())) == 120


def test_explained_mutants_exist() -> None:
    # Explained changes are changes of existing lines by the rules.
    keys = {mutant.key for mutant in mutants.mutants(hdl.board_sources())}
    assert len(keys) > 3000
    known = mutants.explained()
    of_python = {key for key in known if key[0].endswith(".py")}
    assert known - of_python - keys == set()
    # Changes of Python are known to cosmic-ray, which is not installed here.
    for file, old, _, place in of_python:
        lines = (project.root() / "golden" / "plenofir" / file).read_text().splitlines()
        assert [line.strip() for line in lines].count(old) >= place, (file, old)


def test_lines_that_are_not_changed_exist() -> None:
    listed = tomllib.loads((SCRIPT.parent / "unseen_python.toml").read_text())
    for file, entries in listed.items():
        lines = (project.root() / "golden" / "plenofir" / file).read_text().splitlines()
        for entry in entries:
            text, place = (entry, 1) if isinstance(entry, str) else entry
            assert [line.strip() for line in lines].count(text) >= place, (file, text)


def test_what_simulation_leaves_out_is_not_changed() -> None:
    memory = [m for m in mutants.mutants(hdl.hdl_sources()) if m.file == "ram_simple_dual_port.vhd"]
    enables = [m for m in memory if "if writes = " in m.old]
    # Of two branches with this line the simulated one; once its =, once its '1'.
    assert [(m.place, m.new.strip()) for m in enables] == [
        (2, "if writes /= '1' then"),
        (2, "if writes = '0' then"),
    ]
    assert not any("not is_simulation" in m.old for m in memory)


def test_every_source_has_mutants_and_tests() -> None:
    files = {mutant.file for mutant in mutants.mutants(hdl.board_sources())}
    names = {source.name for source in hdl.board_sources()}
    # Packages of constants, wiring.
    without = {
        "camera_pkg.vhd",
        "clock_input.vhd",
        "colour_pkg.vhd",
        "crossing_pkg.vhd",
        "edid_pkg.vhd",
        "fault_pkg.vhd",
        "focal_stack.vhd",
        "gearbox_5_to_10.vhd",
        "i2c_pkg.vhd",
        "marks_pkg.vhd",
        "pixel_clock_select.vhd",
        "pll_settings_pkg.vhd",
        "raster_refocuser.vhd",
        "register_map_pkg.vhd",
        "screen_pkg.vhd",
        "sensor_pkg.vhd",
        "serial_clocks.vhd",
        "status_pkg.vhd",
        "stored_pkg.vhd",
        "stored_product.vhd",
    }
    assert names - files == without
    for _, tests in mutant_tests.TESTS:
        for test in tests:
            file = next(w for w in test.split() if ".py" in w).partition("::")[0]
            assert (project.root() / file).is_file()


def test_changes_that_show_in_nothing_are_not_made(tmp_path: Path) -> None:
    source = tmp_path / "idle.vhd"
    declarations = """
  signal set_1 : std_logic := '0';
  signal set_2 : std_logic := '0';
  signal set_3 : std_logic := '0';
  signal set_4 : std_logic := '0';
  signal set_5 : std_logic := '0';
  signal part  : std_logic_vector(N - 1 downto 0);
  signal count : unsigned(N - 1 downto 0);
  type list_t is array (0 to N - 1) of integer;
"""
    source.write_text(
        f"""-- A source.
architecture rtl of idle is
{declarations}
begin
    if rising_edge(clk) then
      set_3 <= x;
      set_4 <= not set_4;
      if x = '1' then
        set_5 <= x;
      end if;
      if reset = '1' then
        set_1 <= x;
      end if;
    end if;
"""
    )
    made = [(m.old.split()[1], m.new.strip()) for m in mutants.mutants([source]) if m.line < 13]
    assert made == [
        ("set_2", "signal set_2 : std_logic := '1';"),
        ("set_4", "signal set_4 : std_logic := '1';"),
        ("set_5", "signal set_5 : std_logic := '1';"),
        ("part", "signal part  : std_logic_vector(N - 2 downto 0);"),
        ("count", "signal count : unsigned(N + 1 downto 0);"),
        ("count", "signal count : unsigned(N - 0 downto 0);"),
        ("count", "signal count : unsigned(N - 2 downto 0);"),
        ("list_t", "type list_t is array (0 to N - 2) of integer;"),
    ]


def test_sample_stays_where_sources_change() -> None:
    every = list(dict.fromkeys(mutants.mutants(hdl.board_sources())))
    sample = {mutant.key for mutant in mutants.chosen(every, 1, 120)}
    rest = [mutant for mutant in every if mutant.file != "fir_array.vhd"]
    without = {mutant.key for mutant in mutants.chosen(rest, 1, 120)}
    assert {key for key in sample if key[0] != "fir_array.vhd"} <= without


@pytest.mark.parametrize(
    ("text", "becomes", "equal"),
    [
        # Each tap has its own copy of the input.
        ("BROADCAST_TAPS > TAPS,", "BROADCAST_TAPS < TAPS,", True),
        ("w <= TAPS - 1 - DELAY", "w < TAPS - 1 - DELAY", False),
        # Nothing drives it.
        ("step_now    <= step;", "", False),
    ],
)
def test_equal_circuits_are_told_apart(
    tmp_path: Path, text: str, becomes: str, equal: bool
) -> None:
    source = next(path for path in hdl.hdl_sources() if path.name == "switched_fir.vhd")
    lines = source.read_text().splitlines()
    # The last one: there are latches of the input.
    number = max(number for number, line in enumerate(lines) if text in line)
    changed = lines[number].replace(text, becomes)
    mutant = mutants.Mutant(source.name, number + 1, lines[number], changed, 1)
    generics = {"TAPS": 3, "DELAY": 1, "DEPTH": 1, "HOLD": False}
    generics |= {"DATA_MAX": 1, "SUM_MAX": 3, "BROADCAST_TAPS": 2}
    made = mutant_proof.circuit("switched_fir", generics)
    before = mutant_proof.synthesised(None, made, tmp_path / "before")
    after = mutant_proof.synthesised(mutant, made, tmp_path / "after")
    assert before["switched_fir"] != after["switched_fir"] or not equal
    assert mutant_proof.Comparison(before, after, tmp_path).equal("switched_fir") == equal
