# SPDX-License-Identifier: Apache-2.0
"""Constraints in each tool's language, and their names against the netlists."""

from pathlib import Path
from typing import get_args

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ucf import read_constraints
from plenofir.fpga.constraints import CROSSINGS, Constraints, Crossing, Language, crossings_of
from plenofir.fpga.tools.synthesis import run_yosys, write_verilog
from plenofir.plan.configure import needed_sources

WHOLE = Constraints(
    {"clk": 74.25},
    (Crossing("crossing_first", "to"), Crossing("crossing_data", "from")),
    {"clk": "A1"},
)
TEXTS = {
    "xdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
set_false_path -to [get_cells -hierarchical -filter {NAME =~ *crossing_first_reg*}]
set_false_path -from [get_cells -hierarchical -filter {NAME =~ *crossing_data_reg*}]
set_property PACKAGE_PIN A1 [get_ports clk]
""",
    "quartus-sdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
set_false_path -to [get_registers {*crossing_first*}]
set_false_path -from [get_registers {*crossing_data*}]
""",
    "gowin-sdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
set_false_path -to [get_regs {*crossing_first*}]
set_false_path -from [get_regs {*crossing_data*}]
""",
    "radiant-pdc": """\
create_clock -name clk -period 13.468 [get_ports clk]
set_false_path -to [get_cells -hierarchical *crossing_first*]
set_false_path -from [get_cells -hierarchical *crossing_data*]
ldc_set_location -site {A1} [get_ports clk]
""",
    "ucf": """\
NET "clk" TNM_NET = "clk";
TIMESPEC "TS_clk" = PERIOD "clk" 13.468 ns HIGH 50 %;
INST "*crossing_first*" TNM = FFS "crossing_first";
TIMESPEC "TS_crossing_first" = TO "crossing_first" TIG;
INST "*crossing_data*" TNM = FFS "crossing_data";
TIMESPEC "TS_crossing_data" = FROM "crossing_data" TIG;
NET "clk" LOC = "A1";
""",
    "lpf": """\
FREQUENCY PORT "clk" 74.25 MHZ;
BLOCK PATH TO CELL "*crossing_first*";
BLOCK PATH FROM CELL "*crossing_data*";
LOCATE COMP "clk" SITE "A1";
""",
    "ccf": """\
# clk has 74.25 MHz; the file has no words for it, p_r tells what it reaches.
# Paths to crossing_first need no time.
# Paths from crossing_data need no time.
NET "clk" Loc = "A1";
""",
    "cst": 'IO_LOC "clk" A1;\n',
    "pdc": "ldc_set_location -site {A1} [get_ports clk]\n",
}


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
        Constraints(crossings=WHOLE.crossings).text("pdc")


def test_ucf_is_read_back(tmp_path: Path) -> None:
    """By the reader that checks the constraints of the Atlys."""
    file = tmp_path / "core.ucf"
    file.write_text(Constraints({"clk": 74.25}).text("ucf"))
    assert read_constraints(file).periods == {"clk": 13.468}


# Tops with crossings, and how many flip-flops theirs have at least.
TOPS = {"parallel_top": {"crossing_reset": 4}, "settings_crossing": {"crossing_data": 8}}


@pytest.mark.parametrize("top", TOPS)
def test_crossings_are_registers_of_the_netlist(top: str, tmp_path: Path) -> None:
    (own,) = (path for path in hdl.all_sources() if path.stem == top)
    sources = [*needed_sources(own.read_text(), top, hdl.all_sources()), own]
    found = crossings_of(sources)
    assert {c.register for c in found} >= set(TOPS[top])
    small = {"MAX_COLUMNS": 16, "ROWS": 9} if top == "parallel_top" else {}
    verilog = write_verilog(sources, top, small, tmp_path)
    names = {c.register: TOPS[top].get(c.register, 1) for c in found}
    run_yosys(
        [
            f"read_verilog {verilog.name}",
            f"hierarchy -check -top {top}; proc; flatten; simplemap; opt_clean",
            *(
                f"select -assert-min {least} w:*{name}* %ci2 t:*DFF* %i"
                for name, least in names.items()
            ),
            "select -assert-min 1 i:*clk*",
        ],
        tmp_path / "yosys.log",
    )


def test_every_entity_that_crosses_is_told() -> None:
    """Registers named crossing_ are in the table, except the second one of a synchroniser."""
    named = {
        path.stem
        for path in hdl.all_sources()
        if "signal crossing_" in path.read_text().replace("\n", " ")
    }
    assert named == set(CROSSINGS)
    for entity, crossing in CROSSINGS.items():
        (source,) = (path for path in hdl.all_sources() if path.stem == entity)
        assert f"signal {crossing.register}" in source.read_text()


def test_a_core_has_one_clock() -> None:
    core = needed_sources("use work.raster_refocuser;", "", hdl.all_sources())
    assert not crossings_of(core)
