# SPDX-License-Identifier: Apache-2.0
"""The table of boards: sources, pins, modes and EDIDs of each."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import top_source
from plenofir.fpga.boards import BOARDS, Board, board_of
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.hdmi.edid import edid_package, make_edid, offered_modes, timing_of
from plenofir.fpga.hdmi.modes import (
    CLOCK_RANGES,
    HD720,
    HD720_30,
    PLL_CLOCKS,
    SVGA,
    VGA,
    modes_of_range,
    range_limits,
)

each_board = pytest.mark.parametrize("board", BOARDS.values(), ids=lambda board: board.name)


def test_boards_share_the_wrappers_of_a_family(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lists = {"sources.txt": "core", "sources_a.txt": "pll a", "sources_b.txt": "pll b"}
    (tmp_path / "hdl").mkdir()
    for name in ("core", "pll", "a", "b"):
        (tmp_path / "hdl" / name).touch()
    for file, names in lists.items():
        (tmp_path / "hdl" / file).write_text("\n".join(names.split()) + "\n")
    monkeypatch.setattr(hdl, "root", lambda: tmp_path)
    assert [path.name for path in hdl.all_sources()] == ["core", "pll", "a", "b"]
    assert [path.name for path in hdl.board_sources("b")] == ["core", "pll", "b"]


@each_board
def test_board_has_its_sources_and_devices(board: Board) -> None:
    assert board.top in {source.stem for source in hdl.board_sources(board.name)}
    # Boards with HDMI or a camera have pins, and lanes of their family.
    whole = bool(board.modes or board.camera)
    assert board.constraints.is_file() == whole
    assert bool(board.library and hdl.model_sources(board.library)) == whole
    assert bool(board.pixel_mhz) != whole
    if board.camera is not None:
        assert board.camera.top in {source.stem for source in hdl.board_sources(board.name)}
        assert board.constraints_of(board.camera.top).is_file()
    for device in board.devices:
        assert device in DEVICES
        # A scene's board is the first with its device, one with pins; BOARD= names others.
        chosen = board_of(device)
        assert chosen is not None
        assert chosen == board or not whole or chosen.constraints.is_file()
        assert board.device(device) == board.device(device.partition("-")[2] or device) == device
    assert board.device("xc7a35t") is None


@pytest.mark.parametrize(
    ("name", "top"),
    [("ulx3s", "ulx3s_top"), ("ulx3s", "ulx3s_camera_top"), ("pynqz2", "pynqz2_top")],
)
def test_each_port_has_one_pin_of_its_own(name: str, top: str) -> None:
    board = BOARDS[name]
    text = board.constraints_of(top).read_text()
    port = r"(\w+)(?:\[(\d+)\])?"
    if board.flow == "vivado":
        pin = r"^set_property -dict {PACKAGE_PIN (\w+) IOSTANDARD \w+.*} \[get_ports {?"
        located = [(*names, site) for site, *names in re.findall(f"{pin}{port}}}?\\]$", text, re.M)]
        standards = [(name, index) for name, index, _ in located]
    else:
        located = re.findall(rf'^LOCATE COMP "{port}" SITE "(\w+)";$', text, re.M)
        standards = re.findall(rf'^IOBUF PORT "{port}" .*IO_TYPE=\w+', text, re.M)
    wanted = set()
    for port in declarations(top_source(top).read_text(), "port"):
        high = re.search(r"\((\d+) downto 0\)", port.type_name)
        wanted |= (
            {(port.name, str(i)) for i in range(int(high[1]) + 1)} if high else {(port.name, "")}
        )
    assert {(name, index) for name, index, _ in located} == wanted
    assert set(standards) == wanted
    sites = [site for *_, site in located]
    assert len(set(sites)) == len(sites) == len(wanted)


def test_ranges_of_pixel_clocks() -> None:
    for clock_range in CLOCK_RANGES:
        low, high = range_limits(clock_range)
        # Frequencies of the PLL's oscillator in kHz.
        assert 5 * clock_range * low >= 400_000 < 5 * clock_range * high <= 800_000
        divide, mode = PLL_CLOCKS[clock_range]
        assert low <= 600_000 / divide <= high
        assert abs(600_000 / divide / mode.pixel_clock - 1) < 0.01
        assert modes_of_range(clock_range)
    limits = [range_limits(clock_range) for clock_range in CLOCK_RANGES]
    assert all(slow[1] > fast[0] for slow, fast in pairwise(limits))


def test_modes_of_the_ulx3s() -> None:
    board = BOARDS["ulx3s"]
    assert {VGA, SVGA, HD720_30, HD720} <= set(board.modes)
    assert [board.clock_range(mode) for mode in (VGA, HD720_30, SVGA, HD720)] == [4, 4, 3, 2]


@pytest.mark.parametrize("clock_range", CLOCK_RANGES)
@pytest.mark.parametrize("columns", [64, 640, 800, 1280])
def test_edid_offers_what_the_build_takes(clock_range: int, columns: int) -> None:
    modes = offered_modes(columns, clock_range)
    low, high = range_limits(clock_range)
    assert all(low <= mode.pixel_clock <= high for mode in modes)
    edid = make_edid(modes)
    assert edid.hex().upper() in re.sub(r'"\s*&\s*x"', "", edid_package())
    preferred = timing_of(edid[54:])
    assert preferred is not None
    assert preferred[:2] == (modes[-1].h_active, modes[-1].v_active)
    # The limits hold each mode, to a Hz, a kHz and 10 MHz.
    low_frame, high_frame, low_line, high_line, clock = edid[54 + 3 * 18 + 5 :][:5]
    for mode in modes:
        assert low_frame <= mode.frame_rate <= high_frame < mode.frame_rate + 32
        assert low_line <= mode.pixel_clock / mode.h_total <= high_line
        assert mode.pixel_clock <= 10_000 * clock < modes[-1].pixel_clock + 10_000
    # Every source can send 640x480, where the PLL takes it.
    assert (VGA in modes) == (low <= VGA.pixel_clock)
