# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of boards with a camera: reports of the tools, pins, refusals."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from in_process import plenofir

from plenofir.fpga.bitstream import nextpnr, nexus
from plenofir.fpga.bitstream.top_level import top_source
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.sensors import registers_text
from plenofir.ground.errors import InputError, ToolError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure, scene_generics
from plenofir.plan.sensor.board_camera import sensor_camera
from plenofir.plan.sensor.scene_lanes import load_registers

OpenTools = Callable[..., dict[str, Any]]
BOARD = BOARDS["lifcl40"]
CELLS = ("OXIDE_COMB", "OXIDE_FF", "OXIDE_EBR", "MULT18_CORE", "DPHY_CORE", "SEIO33_CORE")
WANTED = {"clk": 120.4, "byte_clk": 114.0}


def report(clk: float = 130.0, byte_clk: float = 120.0) -> dict[str, Any]:
    return {
        "fmax": {
            "clk$glb_clk": {"constraint": 120.4, "achieved": clk},
            "byte_clk$glb_clk": {"constraint": 120.4, "achieved": byte_clk},
        },
        "utilization": {name: {"used": 7, "available": 100} for name in CELLS},
    }


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch, open_tools: OpenTools) -> dict[str, Any]:
    """Stand-ins for the tools."""
    monkeypatch.setattr(nexus, "synthesise_board", lambda *_: None)
    return open_tools(report(), "plenofir.bit")


def build(out: Path) -> None:
    generics = {"MICRO_IMAGE_SIZE": 5}
    nexus.build(BOARD, "lifcl-40", generics, WANTED, out, lambda *_: None, {"camera_pkg": "text"})


def test_build(tools: dict[str, Any], tmp_path: Path) -> None:
    build(tmp_path)
    assert (tmp_path / "plenofir.bit").read_bytes() == b"bits"
    content = json.loads((tmp_path / "report.json").read_text())
    assert content["timing"][1] == {"clock": "byte_clk", "wanted_mhz": 114.0, "reached_mhz": 120.0}
    assert content["utilisation"]["D-PHY"] == [7, 100]
    assert content["utilisation"]["pins"] == [7, 100]
    assert (tmp_path / "work" / "camera_pkg.vhd").read_text() == "text"


@pytest.mark.parametrize(
    ("changed", "fails", "message"),
    [
        ({"byte_clk": 113.0}, "", "timing is not met: byte_clk reaches 113 of 114 MHz"),
        ({"clk": 120.0}, "", "timing is not met: clk reaches 120 of 120.4 MHz"),
        ({}, "nextpnr", "nextpnr failed: ERROR: Unable to place cell"),
        ({}, "prjoxide", "prjoxide failed"),
    ],
)
def test_refused_builds_leave_no_bitstream(
    tools: dict[str, Any], tmp_path: Path, changed: dict[str, float], fails: str, message: str
) -> None:
    build(tmp_path)
    tools.update(report=report(**changed), fails=fails)
    with pytest.raises(InputError, match=message):
        build(tmp_path)
    assert not (tmp_path / "plenofir.bit").exists()
    assert not (tmp_path / "report.json").exists()


def test_each_port_has_one_pin_of_its_own() -> None:
    text = BOARD.constraints.read_text()
    located = re.findall(r"^ldc_set_location -site \{(\w+)\} \[get_ports \{(\S+)\}\]$", text, re.M)
    typed = re.findall(r"^ldc_set_port -iobuf \{IO_TYPE=.*\} \[get_ports \{(\S+)\}\]$", text, re.M)
    wanted = set()
    for port in declarations(top_source(BOARD.top).read_text(), "port"):
        # The D-PHY's pads have no place to choose.
        if re.fullmatch(r"cam_(clk|data)_[pn]", port.name):
            continue
        high = re.search(r"\((\d+) downto 0\)", port.type_name)
        bits = [f"[{i}]" for i in range(int(high[1]) + 1)] if high else [""]
        wanted |= {port.name + bit for bit in bits}
    assert {name for _, name in located} == set(typed) == wanted
    assert len({site for site, _ in located}) == len(located) == len(wanted)


def test_clocks_and_site_in_a_netlist(tmp_path: Path) -> None:
    cells: dict[str, Any] = {
        "oscillator": {"type": "OSCA", "connections": {"HFCLKOUT": [2]}, "attributes": {}},
        "lanes.block_itself": {
            "type": "DPHY",
            "connections": {"URWDCKHS": [3], "LMMIWRRD_N": ["0"]},
            "attributes": {},
        },
    }
    names = {"a.clk": {"bits": [2]}, "clk": {"bits": [2]}, "b": {"bits": [3]}}
    file = tmp_path / "netlist.json"
    file.write_text(json.dumps({"modules": {"top": {"cells": cells, "netnames": names}}}))
    nexus.prepare_netlist(file)
    top = json.loads(file.read_text())["modules"]["top"]
    assert {name: net["bits"] for name, net in top["netnames"].items()} == {
        "clk": [2],
        "byte_clk": [3],
    }
    block = top["cells"]["lanes.block_itself"]
    assert block["attributes"] == {"LOC": "TDPHY_CORE2"}
    assert set(block["connections"]) == {"URWDCKHS"}
    del cells["lanes.block_itself"]
    file.write_text(json.dumps({"modules": {"top": {"cells": cells, "netnames": names}}}))
    with pytest.raises(ToolError, match="0 D-PHYs"):
        nexus.prepare_netlist(file)


@pytest.mark.parametrize("name", ["lifcl40", "ulx3s-csi"])
def test_shipped_scenes_with_a_camera(name: str, tmp_path: Path) -> None:
    plan = make_plan(load_scene(name))
    assert plan.camera is not None
    assert plan.sensor is not None
    board = BOARDS["lifcl40" if name == "lifcl40" else "ulx3s"]
    assert board.camera is not None
    assert plan.camera.lane_mbits <= board.camera.lane_mbits
    # A line of the sensor, blanking included, lasts as long as the core takes for it.
    assert plan.camera.clock_mhz <= plan.camera.wanted_mhz
    sources = {path.name for path in configure(plan, tmp_path)}
    top = (tmp_path / f"{board.camera.top}.vhd").read_text()
    shifts = scene_generics(plan)["SHIFTS"]
    assert {"camera_pkg.vhd", "sensor_pkg.vhd", "csi_receiver.vhd"} <= sources
    assert re.search(rf'SHIFTS +: string +:= "{shifts}"', top)
    assert "constant CAMERA_LANES    : natural := 2;" in (tmp_path / "camera_pkg.vhd").read_text()


def test_camera_of_the_ulx3s_has_the_times_of_its_screen() -> None:
    plan = make_plan(load_scene("ulx3s-csi"))
    assert plan.camera is not None
    written = dict(plan.camera.board.registers)
    line = (written[0x0162] << 8 | written[0x0163]) / 182.4
    frame = written[0x0160] << 8 | written[0x0161]
    # 800 pixels at 25 MHz, within 100 ppm; as many lines as the mode has.
    assert abs(line / 32 - 1) < 1e-4
    assert frame == 525
    assert (written[0x030C] << 8 | written[0x030D]) * 8 == plan.camera.lane_mbits == 456


def test_build_of_a_board_with_a_camera_by_nextpnr() -> None:
    clocks = nextpnr.CameraClocks(228, 25)
    assert clocks.required() == {"clk": 25, "clk_x5": 125, "bits_clk": 114, "byte_clk": 57}
    assert 'FREQUENCY PORT "cam_hs_clk" 228.000 MHZ;' in clocks.frequencies()


SCENE = Path(BOARD.constraints.parents[1] / "scenes" / "lifcl40.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        # Its large memories (LRAM) are not used.
        (
            "columns = 640\nrows = 480",
            "columns = 1640\nrows = 1232",
            r"the LIFCL-40 is too small: it needs 1\d\d of 84 EBR \(18 Kbit\); use fewer slices",
        ),
        ("columns = 640", "columns = 650", "has no mode of 650 x 480"),
        ('input = "csi"', 'input = "frames"', "need each other"),
        ('device = "lifcl-40"', 'device = "gw2ar-18"', "needs build.device of a board with a cam"),
        ("rate_hz = 30.0", "rate_hz = 200.0", "is not possible; use"),
        ("rate_hz = 30.0", "rate_hz = 1e-300", r"greater than or equal to 0\.001"),
        ("bits = 10", "bits = 9", "needs sensor.bits of 8, 10, 12"),
        ('path = "camera"', 'path = "camera"\nborder = "normalise"', "needs path = 'core'"),
    ],
)
def test_scenes_that_no_board_has_are_refused(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = SCENE.read_text()
    assert old in text
    file = tmp_path / "scene.toml"
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message):
        make_plan(load_scene(file))


def test_a_core_faster_than_the_oscillator_is_refused() -> None:
    loaded = load_scene("lifcl40")
    core, sensor = make_plan(loaded).core, loaded.scene.sensor
    assert sensor is not None
    for needed in (250.0, 500.0):
        camera = sensor_camera(sensor, core, BOARD, None, needed, where="sensor")
        with pytest.raises(InputError, match=f"need {needed:g} MHz; the board has 210.3 MHz"):
            camera.check_clock(where="sensor")


def test_the_ulx3s_shows_one_size(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    text = SCENE.read_text().replace("lifcl-40", "lfe5u-85f").replace("bits = 10", "bits = 8")
    text = text.replace('mosaic = "rggb"\n', "")
    file.write_text(text.replace("= 640", "= 1640").replace("= 480", "= 1232"))
    with pytest.raises(InputError, match="use 640 x 480"):
        make_plan(load_scene(file))


def test_a_core_that_is_too_large_is_refused(tmp_path: Path) -> None:
    arguments = ("--board", "lifcl40", "-M", "15", "-a", "1", "--out", str(tmp_path / "out"))
    done = plenofir("bitstream", "build", *arguments, "--max-columns", "4096")
    assert (done.returncode, done.stdout) == (2, "")
    assert "the LIFCL-40 is too small" in done.stderr


LANES = SCENE.with_name("lifcl40-360.toml")


def lanes_scene(folder: Path, *changes: tuple[str, str]) -> Path:
    """The scene of four lanes, changed."""
    text = LANES.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = folder / "scene.toml"
    file.write_text(text)
    return file


def test_four_lanes_whose_frames_are_the_raster(tmp_path: Path) -> None:
    """The clock follows the lanes while a line comes, not the mean over frames."""
    (tmp_path / "registers.txt").write_text("# name\n\n0x0100 0x00  # off\nPause 7\n0x3012 255\n")
    file = lanes_scene(
        tmp_path, ("mbits = 900.0", 'mbits = 900.0\nregisters = "registers.txt"\naddress = 0x36')
    )
    plan = make_plan(load_scene(file))
    assert plan.camera is not None
    assert plan.sensor is None
    assert (plan.core.pixels_per_clock, plan.core.channels, plan.core.pixel_bits) == (4, 1, 10)
    assert plan.camera.needed_mhz == plan.clock_mhz == 90
    assert plan.camera.needed_mhz <= plan.camera.clock_mhz <= plan.camera.wanted_mhz
    generics = scene_generics(plan)
    assert (generics["ROWS"], generics["MAX_COLUMNS"], generics["PIXELS_PER_CLOCK"]) == (
        1200,
        1920,
        4,
    )
    configure(plan, tmp_path / "out")
    package = (tmp_path / "out" / "camera_pkg.vhd").read_text()
    assert "constant CAMERA_LANES    : natural := 4;" in package
    assert 'std_logic_vector(6 downto 0) := "0110110"' in package
    assert '"010000 ffff07 3012ff"' in package
    slower = lanes_scene(tmp_path, ("mbits = 900.0", "mbits = 300.0"), ("120.0", "10.0"))
    assert make_plan(load_scene(slower)).core.pixels_per_clock == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            [("mbits = 900.0", "mbits = 2501.0")],
            "a lane brings 2501 Mb/s; .* takes 2500",
        ),
        ([("bits = 10", "bits = 12")], "4 pixels of 12 bits a clock do not fit the 40 bits"),
        ([("bits = 10", "bits = 9")], "lanes need frame.bits of 8, 10, 12"),
        ([('"grey"', '"rgb"')], "lanes need frame.colour = 'grey'"),
        (
            [("lifcl-40", "lfe5u-85f")],
            "lanes need build.device of a board with parallel video: lifc",
        ),
        ([('"camera"', '"core"')], "or lanes, need each other"),
        ([("mbits = 900.0", "mbits = 2400.0")], "16 pixels of 10 bits a clock do not fit"),
        (
            [("1920", "4000"), ("120.0", "10.0"), ("= 5", "= 13"), ("/5", "/13")],
            r"too small: it needs \d+ of 84 EBR",
        ),
        (
            [("mbits = 900.0", 'mbits = 900.0\nregisters = "none.txt"')],
            "lanes.registers: .*none.txt cannot be read",
        ),
    ],
)
def test_lanes_that_no_board_takes_are_refused(
    tmp_path: Path, changes: list[tuple[str, str]], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        make_plan(load_scene(lanes_scene(tmp_path, *changes)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# nothing", "has 0 registers, not 1 to 4095"),
        ("0x0100 0x01\n" * 4096, "has 4096 registers"),
        ("0x0100 0x01\n0x0100 0x100", "line 2: '0x0100 0x100' is no register"),
        ("0x0100 256", "line 1: '0x0100 256' is no register"),
        ("pause 0x10", "line 1: 'pause 0x10' is no register"),
        ("0xffff 1", "line 1: '0xffff 1' is no register"),
        ("0100 01", "line 1: '0100 01' is no register"),
    ],
)
def test_lists_that_are_no_registers_are_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "registers.txt"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        load_registers(file, where="lanes.registers")


def test_registers_of_one_and_two_bytes(tmp_path: Path) -> None:
    """The digits of a value say how wide it is; a pause of any length is one of several entries."""
    file = tmp_path / "registers.txt"
    file.write_text("0x301A 0x00d9 # reset\npause 600\n0x302a 0x0005\n0x100 0x1\n0x0101 17\n")
    entries = load_registers(file, where="lanes.registers")
    text = registers_text(entries)
    assert text == "301a00d9 ffffff ffffff ffff5a 302a0005 010001 010111"
    path = lanes_scene(tmp_path, ("mbits = 900.0", 'mbits = 900.0\nregisters = "registers.txt"'))
    camera = make_plan(load_scene(path)).camera
    assert camera is not None
    assert registers_text(camera.board.registers) == text
