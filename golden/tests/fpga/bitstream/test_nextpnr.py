# SPDX-License-Identifier: Apache-2.0
"""Builds with nextpnr: what its report must say, and what is left when it does not."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from in_process import plenofir

from plenofir.errors import InputError, ToolError
from plenofir.fpga.bitstream import nextpnr
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdmi.modes import range_limits

RANGE = 4
FASTEST = range_limits(RANGE)[1] / 1000


def report(**changed: Any) -> dict[str, Any]:
    """What nextpnr reports of a build that passes."""
    clocks = {
        "$glbnet$in_clk$TRELLIS_IO_IN": (FASTEST, 150.0),
        "$glbnet$clk_100": (100, 120.0),
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
def tools(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Tools that write what the real ones would; the report can be changed."""
    content: dict[str, Any] = {"report": report(), "fails": ""}

    def run_tool(command: Sequence[str], log: Path, **_: object) -> None:
        name = Path(command[0]).name
        if content["fails"] and content["fails"] in name:
            raise ToolError(f"{name} failed with status 1:\nERROR: Unable to place cell")
        if "nextpnr" in name:
            (log.parent / "nextpnr.json").write_text(json.dumps(content["report"]))
            (log.parent / command[command.index("--textcfg") + 1]).write_text("config")
        else:
            (log.parent / "plenofir.bit").write_bytes(b"bits")

    monkeypatch.setattr(nextpnr, "run_tool", run_tool)
    monkeypatch.setattr(nextpnr, "run_yosys", lambda *_, **__: None)
    monkeypatch.setattr(nextpnr, "use_output_registers", lambda *_: None)
    monkeypatch.setattr(nextpnr, "name_clocks", lambda *_: None)
    monkeypatch.setattr(nextpnr, "write_verilog", lambda *_, **__: None)
    monkeypatch.setattr(nextpnr, "_tools", lambda: {"nextpnr": "1"})
    return content


def build(out: Path) -> nextpnr.NextpnrReport:
    return nextpnr.build(
        BOARDS["ulx3s"], "lfe5u-45f", {"MICRO_IMAGE_SIZE": 3}, RANGE, out, lambda *_: None
    )


def test_build(tools: dict[str, Any], tmp_path: Path) -> None:
    result = build(tmp_path)
    assert (tmp_path / "plenofir.bit").read_bytes() == b"bits"
    content = json.loads((tmp_path / "report.json").read_text())
    assert content["timing"][2] == {"clock": "clk", "wanted_mhz": FASTEST, "reached_mhz": 80.0}
    assert content["utilisation"]["LUT4"] == [7, 100]
    assert content["tools"] == {"nextpnr": "1"}
    assert result.generics["CLOCK_RANGE"] == RANGE
    assert result.crossings[0].reached_ns == 2.0
    constraints = (tmp_path / "work" / "ulx3s.lpf").read_text()
    assert f'FREQUENCY PORT "in_clk" {FASTEST:.3f} MHZ;' in constraints


@pytest.mark.parametrize(
    ("changed", "fails", "message"),
    [
        ({"clocks": {"$glbnet$clk": (FASTEST, 30.0)}}, "", "timing is not met: clk reaches 30 MHz"),
        ({"clocks": {"$glbnet$clk_x5": (12, 300.0)}}, "", "clk_x5 was placed for 12.0 MHz"),
        ({"clocks": {"$glbnet$clk_100": (100, 0)}}, "", "clk_100 was placed for nothing"),
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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--board", "ulx3s", "--device", "lfe5u-25f"), "expected lfe5u-85f or lfe5u-45f"),
        (
            (*("--board", "ulx3s", "--device", "lfe5u-45f", "-M", "9"), *("-a", "3")),
            "does not fit the LFE5U-45F",
        ),
    ],
)
def test_boards_and_scenes_refused(
    tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    done = plenofir("bitstream", "build", "--out", str(tmp_path / "out"), *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
