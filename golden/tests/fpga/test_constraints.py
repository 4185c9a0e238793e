# SPDX-License-Identifier: Apache-2.0
"""Constraints in each tool's language, and their names against the netlists."""

import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import get_args

import pytest
from clock_paths import Netlist

from bitstream_check.ucf import read_constraints
from plenofir.fpga import hdl
from plenofir.fpga.constraints import (
    Constraints,
    Crossing,
    Language,
    crossings_of,
    described_crossings,
)
from plenofir.ground import project
from plenofir.plan.configure import needed_sources

WHOLE = Constraints(
    {"clk": 74.25, "byte_clk": 50},
    (Crossing("first", "none"), Crossing("caught", "skew", "code"), Crossing("set", "reset")),
    {"clk": "A1"},
)
MEMORY = Constraints(
    {"clk": 100}, (Crossing("word", "memory", "memory"), Crossing("taken", "delay", "data"))
)
TEXTS = {
    "xdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
create_clock -name byte_clk -period 20.000 [get_ports byte_clk]
set_false_path -to [get_cells -hierarchical -filter {NAME =~ *first_reg*}]
set_max_delay -datapath_only -from [get_cells -hierarchical -filter {NAME =~ *code_reg*}] \
-to [get_cells -hierarchical -filter {NAME =~ *caught_reg*}] 13.468
set_bus_skew -from [get_cells -hierarchical -filter {NAME =~ *code_reg*}] -to [get_cells \
-hierarchical -filter {NAME =~ *caught_reg*}] 13.468
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *set_reg*/PRE}]
set_property PACKAGE_PIN A1 [get_ports clk]
""",
    "quartus-sdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
create_clock -name byte_clk -period 20.000 [get_ports byte_clk]
set_false_path -to [get_registers {*first*}]
set_max_skew -from [get_keepers -nowarn {*code*}] -to [get_keepers -nowarn {*caught*}] \
-get_skew_value_from_clock_period min_clock_period -skew_value_multiplier 0.8
set_net_delay -from [get_keepers -nowarn {*code*}] -to [get_keepers -nowarn {*caught*}] -max \
-get_value_from_clock_period min_clock_period -value_multiplier 0.8
set_max_delay -from [get_keepers -nowarn {*code*}] -to [get_keepers -nowarn {*caught*}] 100
set_min_delay -from [get_keepers -nowarn {*code*}] -to [get_keepers -nowarn {*caught*}] -100
set_false_path -to [get_pins -compatibility_mode -nowarn {*set*|clrn}]
set_false_path -to [get_pins -compatibility_mode -nowarn {*set*|aclr}]
""",
    "gowin-sdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
create_clock -name byte_clk -period 20.000 [get_ports byte_clk]
set_false_path -to [get_regs {*first*}]
set_max_delay -from [get_regs {*code*}] -to [get_regs {*caught*}] 13.468
set_false_path -to [get_regs {*set*}]
""",
    "radiant-pdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
create_clock -name byte_clk -period 20.000 [get_ports byte_clk]
set_false_path -to [get_cells -hierarchical *first*]
set_max_delay -datapath_only -from [get_cells -hierarchical *code*] -to [get_cells \
-hierarchical *caught*] 13.468
set_false_path -to [get_cells -hierarchical *set*]
ldc_set_location -site {A1} [get_ports clk]
""",
    "ucf": """\
NET "clk" TNM_NET = "clk";
TIMESPEC "TS_clk" = PERIOD "clk" 13.468 ns HIGH 50 %;
NET "byte_clk" TNM_NET = "byte_clk";
TIMESPEC "TS_byte_clk" = PERIOD "byte_clk" 20.000 ns HIGH 50 %;
INST "*first*" TNM = FFS "first";
TIMESPEC "TS_first" = TO "first" TIG;
INST "*code*" TNM = FFS "code";
INST "*caught*" TNM = FFS "caught";
TIMESPEC "TS_caught" = FROM "code" TO "caught" 13.468 ns DATAPATHONLY;
INST "*set*" TNM = FFS "set";
TIMESPEC "TS_set" = TO "set" TIG;
NET "clk" LOC = "A1";
""",
    "lpf": """\
FREQUENCY PORT "clk" 74.25 MHZ;
FREQUENCY PORT "byte_clk" 50 MHZ;
BLOCK PATH TO CELL "*first*";
MAXDELAY FROM CELL "*code*" TO CELL "*caught*" 13.468 ns DATAPATH_ONLY;
BLOCK PATH TO CELL "*set*";
LOCATE COMP "clk" SITE "A1";
""",
    "ccf": """\
# clk has 74.25 MHz; the file has no words for it, p_r tells what it reaches.
# byte_clk has 50 MHz; the file has no words for it, p_r tells what it reaches.
# any to first: the file has no words for it.
# code to caught: the file has no words for it.
# any to set: the file has no words for it.
NET "clk" Loc = "A1";
""",
    "cst": 'IO_LOC "clk" A1;\n',
    "pdc": "ldc_set_location -site {A1} [get_ports clk]\n",
}  # fmt: skip


def test_data_and_memories_are_limited_by_the_clock() -> None:
    """A memory in a block RAM leaves no path: Vivado and Quartus must not complain."""
    xdc = MEMORY.text("xdc").splitlines()
    ends = [f"[get_cells -hierarchical -filter {{NAME =~ *{n}_reg*}}]" for n in ("memory", "word")]
    assert xdc[1] == "set_max_delay -quiet -datapath_only -from {} -to {} 10.000".format(
        *(end.replace("get_cells", "get_cells -quiet") for end in ends)
    )
    assert "_bus_skew" not in "".join(xdc)
    assert xdc[2].startswith("set_max_delay -datapath_only -from")
    assert "set_max_delay -to [get_regs {*word*}] 10.000" in MEMORY.text("gowin-sdc")
    assert 'INST "*memory*" TNM = RAMS "memory";' in MEMORY.text("ucf")
    with pytest.raises(ValueError, match="data to taken needs a clock"):
        Constraints(crossings=MEMORY.crossings[1:]).text("xdc")


@pytest.mark.parametrize("language", get_args(Language))
def test_text(language: Language) -> None:
    pins = WHOLE.pins if "LOC" in TEXTS[language] or "A1" in TEXTS[language] else {}
    timed = language not in ("cst", "pdc")
    said = Constraints(WHOLE.clocks, WHOLE.crossings, pins) if timed else Constraints(pins=pins)
    assert said.text(language) == TEXTS[language]


def test_a_language_of_pins_has_no_clock() -> None:
    with pytest.raises(ValueError, match="cst has no clocks"):
        Constraints({"clk": 50}).text("cst")
    with pytest.raises(ValueError, match="pdc has no paths"):
        Constraints(crossings=WHOLE.crossings[:1]).text("pdc")


def test_ucf_is_read_back(tmp_path: Path) -> None:
    """By the reader that checks the constraints of the Atlys."""
    file = tmp_path / "core.ucf"
    file.write_text(Constraints({"clk": 74.25}).text("ucf"))
    assert read_constraints(file).periods == {"clk": 13.468}


# Tops with crossings: generics, and how many registers (names, of any width) each path ends in.
TOPS: dict[str, tuple[dict[str, int], dict[str, int]]] = {
    "csi_receiver": (
        {"LANES": 2, "PIXEL_BITS": 10},
        # The virtual channel comes from a port.
        {"crossing_first": 0, "crossing_caught": 2, "crossing_word": 1},
    ),
    "tmds_transmitter": ({}, {"crossing_caught": 1, "crossing_word": 1}),
    "settings_crossing": ({}, {"crossing_first": 2, "crossing_taken": 1}),
    "report_crossing": ({}, {"crossing_first": 2, "crossing_taken": 1}),
    "clock_meter": ({}, {"crossing_first": 1}),
}


STAGES = {f"crossing_{name}" for name in ("first", "second", "caught", "stable", "reset")}


def sources_of(top: str) -> list[Path]:
    (own,) = (path for path in hdl.all_sources() if path.stem == top)
    return [*needed_sources(own.read_text(), top, hdl.all_sources()), own]


def covering(crossings: Iterable[Crossing], source: str, to: str) -> list[Crossing]:
    """Crossings whose patterns match both ends of a path, as the tools' patterns do."""
    return [c for c in crossings if c.to in to and (c.source is None or c.source in source)]


TCL: tuple[Language, ...] = ("xdc", "quartus-sdc", "gowin-sdc", "radiant-pdc")
STUBS = project.root() / "tb" / "synthesis" / "constraint_stubs.tcl"


def run_constraints(
    language: Language, text: str, objects: Iterable[tuple[str, str]], folder: Path
) -> list[str]:
    """Commands of constraints, run by stubs that know the names of a design's objects."""
    tclsh = shutil.which("tclsh")
    if tclsh is None:
        pytest.skip("tclsh is not installed (scripts/setup.sh tests)")
    (folder / "constraints.tcl").write_text(text)
    (folder / "objects.txt").write_text("".join(f"{kind} {name}\n" for kind, name in objects))
    command = [tclsh, str(STUBS), language, "constraints.tcl", "objects.txt"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{language}: {done.stderr}"
    return re.findall(r"^CALL\t(\w+)$", done.stdout, re.M)


@pytest.mark.parametrize("top", TOPS)
def test_constraints_cover_each_path_between_clocks_once(top: str, tmp_path: Path) -> None:
    """And no path within a clock; the registers are flip-flops with all attributes."""
    generics, ends = TOPS[top]
    sources = sources_of(top)
    crossings = crossings_of(sources)
    netlist = Netlist(sources, top, generics, tmp_path)
    counted: dict[str, set[str]] = {name: set() for name in ends}
    for (_, source), (_, to) in netlist.paths():
        (crossing,) = covering(crossings, source, to)
        counted[crossing.to].add(to)
    assert {name: len(registers) for name, registers in counted.items()} == ends
    # Each tool finds a register for each pattern, by the names that Yosys keeps; a memory and a
    # register that a generic leaves out are the exceptions that the languages must allow.
    objects = [("port", "clk"), *(("register", name) for _, name in netlist.registers)]
    there = [c for c in crossings if ends.get(c.to)]
    for language in TCL:
        text = Constraints({"clk": 100}, tuple(there)).text(language)
        assert len(run_constraints(language, text, objects, tmp_path)) == len(text.splitlines())
    for register in netlist.registers:
        clock, name = register
        for crossing in crossings:
            if crossing.to in name and crossing.source is None:
                assert clock not in {there for there, _ in netlist.sources(register)}
            elif crossing.to in name:
                assert name in counted[crossing.to]
        signal = name.rpartition(".")[2]
        if signal in STAGES | {"crossing_code", "crossing_data", "crossing_taken"}:
            assert {"keep", "syn_preserve", "preserve"} <= set(netlist.attributes[name])
        if signal in STAGES:
            assert netlist.attributes[name]["async_reg"] == "TRUE"


PLANTED = """
library ieee;
use ieee.std_logic_1164.all;
entity planted is
  port (clk, other, level : in std_logic; level_out : out std_logic);
end entity planted;
architecture rtl of planted is
  signal sent, arrived : std_logic := '0';
begin
  level_out <= arrived;
  process (other) is
  begin
    if rising_edge(other) then
      sent <= level;
    end if;
  end process;
  process (clk) is
  begin
    if rising_edge(clk) then
      arrived <= sent and not arrived;
    end if;
  end process;
end architecture rtl;
"""


def test_a_crossing_without_description_is_noticed(tmp_path: Path) -> None:
    source = tmp_path / "planted.vhd"
    source.write_text(PLANTED)
    ((sent, arrived),) = Netlist([source], "planted", {}, tmp_path).paths()
    every = [c for paths in described_crossings().values() for c in paths]
    assert not covering(every, sent[1], arrived[1])


def test_a_reset_crosses_by_its_pins(tmp_path: Path) -> None:
    """In the top with a camera: all four registers of a bridge, set by no clock."""
    small = {"MAX_COLUMNS": 16, "ROWS": 9}
    sources = sources_of("parallel_top")
    netlist = Netlist(sources, "parallel_top", small, tmp_path)
    assert not list(netlist.paths())
    assert [c.to for c in crossings_of(sources)] == ["crossing_reset"]
    (bridge,) = (name for _, name in netlist.registers if "crossing_reset" in name)
    assert netlist.attributes[bridge]["shreg_extract"] == "no"


@pytest.mark.parametrize(
    ("language", "line", "message"),
    [
        ("xdc", "set_false_path -to [get_registers *there*]", "invalid command"),
        ("quartus-sdc", "set_bus_skew -to [get_registers *there*] 1", "invalid command"),
        ("gowin-sdc", "set_false_path -to [get_regs {*missing*}]", "no register matches"),
        ("radiant-pdc", "create_clock -name clk -period 5 [get_ports clock]", "no port matches"),
        ("xdc", "set_max_delay -datapath -to [get_ports clk] 5", "no option -datapath"),
    ],
)
def test_the_stubs_refuse(language: Language, line: str, message: str, tmp_path: Path) -> None:
    objects = [("port", "clk"), ("register", "there")]
    with pytest.raises(AssertionError, match=message):
        run_constraints(language, f"{line}\n", objects, tmp_path)


def test_names_are_told_apart() -> None:
    """Each register named crossing_ is described or a second stage; no name is part of another."""
    texts = {path.stem: path.read_text() for path in hdl.all_sources()}
    named = {
        (entity, name)
        for entity, text in texts.items()
        for name in re.findall(r"signal (crossing_\w+)", text)
    }
    described = {
        (entity, name)
        for entity, paths in described_crossings().items()
        for path in paths
        for name in (path.source, path.to)
        if name
    }
    assert named - described == {
        ("synchroniser", "crossing_second"),
        ("gray_crossing", "crossing_stable"),
    }
    assert described <= named
    names = {name for _, name in named}
    assert not [(a, b) for a in names for b in names if a != b and a in b]


def test_a_core_has_one_clock() -> None:
    core = needed_sources("use work.raster_refocuser;", "", hdl.all_sources())
    assert not crossings_of(core)
