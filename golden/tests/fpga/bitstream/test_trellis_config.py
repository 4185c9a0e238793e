# SPDX-License-Identifier: Apache-2.0
"""Finished configurations of an ECP5 read back, and netlists prepared for nextpnr."""

import json
from pathlib import Path
from typing import Any

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ecp5_netlist import CLOCK_PLACES, PLL_WORDS, prepare_netlist
from plenofir.fpga.bitstream.trellis_config import (
    check_configuration,
    constrained_settings,
    match_complements,
    pin_places,
    read_configuration,
)
from plenofir.fpga.boards import BOARDS
from plenofir.ground.errors import ToolError

BOARD = BOARDS["ulx3s"]
# As nextpnr 0.11 writes them.
LOG = """\
Info: pin 'in_clk$tr_io' constrained to Bel 'X0/Y32/PIOA'.
Info: pin 'out_data[0]$tr_io' constrained to Bel 'X62/Y0/PIOA'.
Info: pin 'led[0]$tr_io' constrained to Bel 'X4/Y0/PIOB'.
"""
CONSTRAINTS = """\
# IOBUF PORT "comment" PULLMODE=UP;
IOBUF PORT "in_clk" PULLMODE=NONE IO_TYPE=LVDS DIFFRESISTOR=100;
IOBUF PORT "out_data[0]" PULLMODE=NONE IO_TYPE=LVCMOS33D DRIVE=16 SLEWRATE=FAST;
IOBUF PORT "led[0]" PULLMODE=NONE IO_TYPE=LVCMOS33 DRIVE=4;
"""
CONFIG = """\
.device LFE5U-45F

.tile CIB_R1C62:CIB
arc: A0 B0

.tile MIB_R0C4:PIOT0
enum: PIOA.BASE_TYPE INPUT_LVCMOS33

.tile MIB_R0C5:PIOT1
enum: PIOB.BASE_TYPE OUTPUT_LVCMOS33
enum: PIOB.DRIVE 4
enum: PIOB.PULLMODE NONE

.tile MIB_R0C62:PIOT0
enum: PIOA.BASE_TYPE OUTPUT_LVCMOS33D
enum: PIOA.DRIVE 16
enum: PIOA.PULLMODE NONE
enum: PIOA.SLEWRATE FAST

.tile MIB_R0C63:PIOT1
enum: PIOA.BASE_TYPE OUTPUT_LVCMOS33D
enum: PIOB.DRIVE 16

.tile MIB_R32C0:PICL0
enum: PIOA.BASE_TYPE INPUT_LVDS

.tile MIB_R33C0:PICL1
enum: PIOA.BASE_TYPE INPUT_LVDS
enum: PIOB.PULLMODE NONE
enum: PIOA.PULLMODE NONE
enum: PIOA.DIFFRESISTOR 100

.tile_group MIB_R71C2:PLL0_LL MIB_R71C3:BANKREF8
word: CLKI_DIV 0000000
word: LPF_RESISTOR 0001000
word: ICP_CURRENT 01100
word: MFG_GMC_TEST 1110
word: MFG_GMCREF_SEL 10
word: MFG_ENABLE_FILTEROPAMP 1
enum: MODE EHXPLLL
"""


def test_read_back() -> None:
    plls, pins = check_configuration(read_configuration(CONFIG), LOG, CONSTRAINTS)
    assert plls == {"LL": PLL_WORDS}
    assert pins == {
        "in_clk": "INPUT_LVDS PULLMODE=NONE DIFFRESISTOR=100",
        "out_data[0]": "OUTPUT_LVCMOS33D DRIVE=16 PULLMODE=NONE SLEWRATE=FAST",
        "led[0]": "OUTPUT_LVCMOS33 DRIVE=4 PULLMODE=NONE",
    }
    assert pin_places(LOG)["out_data[0]"] == (62, 0, "PIOA")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("word: ICP_CURRENT 01100", "word: ICP_CURRENT 00000", "PLL LL is configured with"),
        ("word: MFG_GMCREF_SEL 10\n", "", "PLL LL is configured with"),
        ("enum: PIOA.SLEWRATE FAST\n", "", r"out_data\[0\] is configured as .*, not SLEWRATE=FAST"),
        ("enum: PIOA.DRIVE 16", "enum: PIOA.DRIVE 4", "not DRIVE=16"),
        ("enum: PIOA.DIFFRESISTOR 100", "", "in_clk is configured as .*, not DIFFRESISTOR=100"),
        ("enum: PIOA.PULLMODE NONE\nenum: PIOA.DIFF", "enum: PIOA.DIFF", "not PULLMODE=NONE"),
        ("INPUT_LVDS", "INPUT_LVCMOS33", "not IO_TYPE=LVDS"),
        ("MIB_R0C5:", "MIB_R0C9:", r"led\[0\] is configured as nothing"),
    ],
)
def test_what_differs_is_named(old: str, new: str, message: str) -> None:
    assert old in CONFIG
    with pytest.raises(ToolError, match=message):
        check_configuration(read_configuration(CONFIG.replace(old, new)), LOG, CONSTRAINTS)


def test_pin_that_is_missing() -> None:
    more = CONSTRAINTS + 'IOBUF PORT "other" IO_TYPE=LVCMOS33;\n'
    with pytest.raises(ToolError, match="other is not in the configuration"):
        check_configuration(read_configuration(CONFIG), LOG, more)


def test_complements_have_the_slew_of_their_pins() -> None:
    matched = match_complements(CONFIG, LOG, CONSTRAINTS)
    tile = ".tile MIB_R0C63:PIOT1\nenum: PIOA.BASE_TYPE OUTPUT_LVCMOS33D\n"
    assert tile + "enum: PIOB.SLEWRATE FAST\nenum: PIOB.DRIVE 16\n" in matched
    assert len(matched.splitlines()) == len(CONFIG.splitlines()) + 1
    assert match_complements(matched, LOG, CONSTRAINTS) == matched
    with pytest.raises(ToolError, match="the complement of"):
        match_complements(CONFIG.replace("enum: PIOB.DRIVE 16\n", ""), LOG, CONSTRAINTS)


def test_constraints_ask_for_what_monitors_and_sources_need() -> None:
    wanted = constrained_settings(BOARD.constraints.read_text())
    for port in ("out_clk", *(f"out_data[{c}]" for c in range(3))):
        fast = {"DRIVE": "16", "SLEWRATE": "FAST"}
        assert wanted[port] == {"PULLMODE": "NONE", "IO_TYPE": "LVCMOS33D", **fast}
    for port in ("in_clk", *(f"in_data[{c}]" for c in range(3))):
        assert wanted[port] == {"PULLMODE": "NONE", "IO_TYPE": "LVDS", "DIFFRESISTOR": "100"}
    for port in ("wifi_gpio0", "wifi_gpio0_new"):
        assert wanted[port]["PULLMODE"] == "UP"


PIXEL_PLL = "pixel_clocks_of_both.pll"


def netlist(choices: int = 1) -> dict[str, Any]:
    """Both PLLs and what chooses the clock of one, as Yosys has them."""

    def pll(clki: int, clkop: int) -> dict[str, Any]:
        connections = {"CLKI": [clki], "CLKOP": [clkop], "CLKOS": [clkop + 1]}
        return {"type": "EHXPLLL", "attributes": {}, "connections": connections}

    lut = {"type": "LUT4", "attributes": {}, "connections": {"A": [2], "Z": [20]}}
    cells = {PIXEL_PLL: pll(20, 30), "oscillator.pll": pll(3, 40)}
    cells |= {f"choice{i}": json.loads(json.dumps(lut)) for i in range(choices)}
    names = {"some.name": {"bits": [20]}, "other": {"bits": [30]}, "kept": {"bits": [2]}}
    return {"modules": {"top": {"cells": cells, "netnames": names}}}


def test_netlist_for_nextpnr(tmp_path: Path) -> None:
    file = tmp_path / "top.json"
    for device, places in CLOCK_PLACES.items():
        file.write_text(json.dumps(netlist()))
        prepare_netlist(file, device)
        top = json.loads(file.read_text())["modules"]["top"]
        names = set(top["netnames"])
        assert names == {"source_clk", "clk", "clk_x5", "control_clk", "own_clk", "kept"}
        cells = top["cells"]
        for name in (PIXEL_PLL, "oscillator.pll"):
            for word, value in PLL_WORDS.items():
                assert cells[name]["attributes"][word] == str(value)
        assert cells["choice0"]["attributes"]["BEL"] == places.choice
        assert cells[PIXEL_PLL]["attributes"]["BEL"] == places.pll
        assert "BEL" not in cells["oscillator.pll"]["attributes"]
    assert set(CLOCK_PLACES) == set(BOARD.devices)
    # The instances of the top level.
    top = next(file for file in hdl.board_sources(BOARD.name) if file.stem == BOARD.top).read_text()
    assert "  pixel_clocks_of_both : entity work.pixel_clocks\n" in top
    assert "  oscillator : entity work.oscillator_clocks\n" in top
    unknown = netlist()
    cells = unknown["modules"]["top"]["cells"]
    cells["renamed.pll"] = cells.pop(PIXEL_PLL)
    file.write_text(json.dumps(unknown))
    with pytest.raises(ToolError, match=r"PLL renamed\.pll is none of"):
        prepare_netlist(file, "lfe5u-45f")
    file.write_text(json.dumps(netlist(choices=2)))
    with pytest.raises(ToolError, match="2 look-up tables choose"):
        prepare_netlist(file, "lfe5u-45f")


def test_the_clock_of_a_camera_s_bytes_has_its_name(tmp_path: Path) -> None:
    """It is the output of a flip-flop, to which Yosys gives an arbitrary name."""

    def register(clock: int, output: int) -> dict[str, Any]:
        ports = {"CLK": [clock], "DI": [9], "Q": [output]}
        return {"type": "TRELLIS_FF", "connections": ports, "attributes": {}}

    cells = {"half": register(2, 3), "byte": register(3, 4), "bit": register(2, 5)}
    names = {"lanes.n214_q": {"bits": [3]}, "camera.clk": {"bits": [3]}, "bit": {"bits": [5]}}
    file = tmp_path / "top.json"
    file.write_text(json.dumps({"modules": {"top": {"cells": cells, "netnames": names}}}))
    prepare_netlist(file)
    found = json.loads(file.read_text())["modules"]["top"]["netnames"]
    assert {name: net["bits"] for name, net in found.items()} == {"byte_clk": [3], "bit": [5]}
