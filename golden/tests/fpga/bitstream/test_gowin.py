# SPDX-License-Identifier: Apache-2.0
"""Bitstreams for the Tang Nano 20K: reports of the tools, pins, refusals."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from in_process import plenofir

from plenofir.fpga import hdl
from plenofir.fpga.bitstream import gowin
from plenofir.fpga.bitstream.steps import nextpnr_stage
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.hdmi.modes import VGA_MIDDLE
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir_studies.records import load_builds

OpenTools = Callable[..., dict[str, Any]]
BOARD = BOARDS["tangnano20k"]
CELLS = ("LUT4", "ALU", "DFF", "BSRAM", "MULT18X18", "IOLOGICO", "rPLL", "IOB")


def test_the_stage_of_nextpnr_is_the_last_that_its_log_names(tmp_path: Path) -> None:
    log, stages = tmp_path / "nextpnr.log", [nextpnr_stage(tmp_path / "none.log")]
    for line in (
        "Info: Packing IOs..",
        "Info: Running main analytical placer, max placement attempts per cell = 10000.",
        "Info: Running simulated annealing placer for refinement.",
        "Info: Running router2...",
        "Info:     iter=1 wires=44759 overused=4824 overuse=5777 archfail=NA",
    ):
        log.write_text(f"{log.read_text() if log.exists() else ''}{line}\n")
        stages.append(nextpnr_stage(log))
    assert stages == ["reading", "packing", "placing", "placing, last steps", *2 * ["routing"]]


def report(constraint: float = 25.2, achieved: float = 40.0) -> dict[str, Any]:
    return {
        "fmax": {"clk": {"constraint": constraint, "achieved": achieved}},
        "utilization": {name: {"used": 7, "available": 100} for name in CELLS},
        "critical_paths": [],
    }


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch, open_tools: OpenTools) -> dict[str, Any]:
    """Stand-ins for the tools."""
    monkeypatch.setattr(gowin, "synthesise_board", lambda *_: None)
    return open_tools(report(), "plenofir.fs")


def build(out: Path) -> None:
    gowin.build(
        BOARD, "gw2ar-18", {"MICRO_IMAGE_SIZE": 3}, out, lambda *_: None, {"stored_pkg": "text"}
    )


def test_build(tools: dict[str, Any], tmp_path: Path) -> None:
    build(tmp_path)
    assert (tmp_path / "plenofir.fs").read_bytes() == b"bits"
    content = json.loads((tmp_path / "report.json").read_text())
    assert content["timing"] == [{"clock": "clk", "wanted_mhz": 25.2, "reached_mhz": 40.0}]
    assert content["utilisation"]["BSRAM (18 Kbit)"] == [7, 100]
    assert content["tools"] == {"nextpnr": "1"}
    assert content["generics"] == {"MICRO_IMAGE_SIZE": 3}
    assert (tmp_path / "work" / "stored_pkg.vhd").read_text() == "text"
    clocks = (tmp_path / "work" / "clocks.sdc").read_text().splitlines()
    assert clocks[2] == "create_clock -name clk -period 39.683 [get_nets clk]"


@pytest.mark.parametrize(
    ("changed", "fails", "message"),
    [
        ({"achieved": 25.1}, "", "timing is not met: clk reaches 25.1 of 25.2 MHz"),
        ({"constraint": 12.0}, "", "clk was placed for 12.0 MHz"),
        ({}, "nextpnr", "nextpnr failed: ERROR: Unable to place cell"),
        ({}, "gowin_pack", "gowin_pack failed"),
    ],
)
def test_refused_builds_leave_no_bitstream(
    tools: dict[str, Any], tmp_path: Path, changed: dict[str, float], fails: str, message: str
) -> None:
    build(tmp_path)
    tools.update(report=report(**changed), fails=fails)
    with pytest.raises(InputError, match=message):
        build(tmp_path)
    assert not (tmp_path / "plenofir.fs").exists()
    assert not (tmp_path / "report.json").exists()


def test_recorded_build_is_that_of_the_scene() -> None:
    made, plan = load_builds()[BOARD.scene], make_plan(load_scene(BOARD.scene))
    assert made.generics == board_generics(plan.core, BOARD.top)
    (clock,) = made.timing
    assert clock.reached_mhz >= clock.wanted_mhz == VGA_MIDDLE.pixel_clock / 1000
    # Three channels and the clock; pairs of pins, keys, LEDs, the oscillator.
    assert made.utilisation["OSER10"][0] == 4
    assert made.utilisation["pins"][0] == 4 * 2 + 2 + 6 + 1
    assert set(made.seconds) == {"ghdl", "yosys", "nextpnr", "gowin_pack"}
    assert "apycula" in made.tools


def test_each_port_has_one_pin_of_its_own() -> None:
    text = BOARD.constraints.read_text()
    located = re.findall(r'^IO_LOC "([^"]+)" (\d+);$', text, re.M)
    wanted = set()
    for port in declarations(hdl.board_sources(BOARD.name)[-1].read_text(), "port"):
        high = re.search(r"\((\d+) downto 0\)", port.type_name)
        bits = [f"[{i}]" for i in range(int(high[1]) + 1)] if high else [""]
        wanted |= {port.name + bit for bit in bits}
    assert {name for name, _ in located} == wanted
    assert len({pin for _, pin in located}) == len(located) == len(wanted)
    # Pins of a pair stand side by side.
    pins = {name: int(pin) for name, pin in located}
    for name, pin in pins.items():
        if "_p" in name:
            assert pins[name.replace("_p", "_n")] == pin + 1


def test_clocks_of_the_mode() -> None:
    # The oscillator's 27 MHz * 14 / 3 are five times the pixel clock of 60 frames a second.
    assert abs(27 * 14 / 3 - gowin.SERIAL * VGA_MIDDLE.pixel_clock / 1000) < 1e-9
    assert round(VGA_MIDDLE.frame_rate, 3) == 60.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--board tangnano20k --device lfe5u-25f", "gw2ar-18"),
        (
            "--board tangnano20k --scene ulx3s-480p",
            "the Sipeed Tang Nano 20K has no input for ulx3s-480p",
        ),
        ("--board ulx3s --scene tangnano20k", "480 x 480 at 60 Hz is not a mode of the Radiona"),
        ("--board tangnano20k -M 9 -a 3", "the GW2AR-18 is too small"),
    ],
)
def test_boards_and_scenes_refused(tmp_path: Path, arguments: str, message: str) -> None:
    done = plenofir("bitstream", "build", "--out", str(tmp_path / "out"), *arguments.split())
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
