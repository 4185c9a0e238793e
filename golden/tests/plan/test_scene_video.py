# SPDX-License-Identifier: Apache-2.0
"""Scenes of a board's video path: modes, blanking, EDID, files."""

import re
from pathlib import Path

import pytest
from written_scenes import scene

from plenofir.fpga import hdl
from plenofir.fpga.hdmi.edid import make_edid
from plenofir.fpga.hdmi.modes import HD720
from plenofir.ground.errors import InputError
from plenofir.plan import make_plan
from plenofir.plan.configure import configure

RATE = ("rows = 480", "rows = 480\nrate_hz = 60.0")


def test_video_path(tmp_path: Path) -> None:
    core = make_plan(scene(tmp_path, RATE))
    assert core.core.engine.kind == "moving_sum"
    plan = make_plan(scene(tmp_path, RATE, build='path = "video"'))
    assert plan.clock_mhz == 25.175
    assert plan.blanking == (160, 45)
    assert plan.frame_clocks == 800 * 525
    # With nearest neighbours and exact sums: D lines, and D + 35 pixels, with taps 14 fewer.
    assert plan.latency_clocks == plan.core.delay * 801 + 36
    taps = make_plan(scene(tmp_path, RATE, build='path = "video"\nengine = "fir"'))
    assert taps.latency_clocks == plan.latency_clocks - 15
    assert plan.core == core.core
    assert plan.video_needs is not None
    assert core.video_needs is None
    assert all(plan.needs[name] == n + plan.video_needs[name] for name, n in core.needs.items())
    # What one has, the other leaves out.
    texts = [part.what for part in core.left_out if "TMDS" in part.what]
    assert len(texts) == 1
    assert not any("TMDS" in part.what for part in plan.left_out)


@pytest.mark.parametrize(
    ("changes", "build", "message"),
    [
        (
            [("rows = 480", "rows = 480\nrate_hz = 61.0")],
            "",
            "61 Hz is not a mode of the Digilent Atlys",
        ),
        ([("rows = 480", "rows = 481\nrate_hz = 60.0")], "", "640 x 481 at 60 Hz is not a mode"),
        ([RATE, ('"rgb"', '"grey"')], "", "needs frame.colour = 'rgb'"),
        ([RATE], "parallel_rows = 2", "needs parallel_rows = 1"),
        ([RATE], 'device = "xc6slx9"', "xc6slx45 (Digilent Atlys)"),
        ([RATE, ("near_mm = 800.0\nfar_mm = inf", 'slices = ["-160"]')], "", "exceeds"),
    ],
)
def test_video_paths_that_cannot_be(
    tmp_path: Path, changes: list[tuple[str, str]], build: str, message: str
) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        make_plan(scene(tmp_path, *changes, build=f'path = "video"\n{build}'))


@pytest.mark.parametrize(
    ("columns", "rows", "rate", "clock"),
    [(1280, 720, 50, 74.25), (1280, 720, 60, 74.25), (1024, 768, 60, 65.0)],
)
def test_video_modes(tmp_path: Path, columns: int, rows: int, rate: int, clock: float) -> None:
    size = ("columns = 640\nrows = 480", f"columns = {columns}\nrows = {rows}\nrate_hz = {rate}.0")
    plan = make_plan(scene(tmp_path, size, build='path = "video"'))
    assert plan.clock_mhz == clock
    assert abs(clock * 1e6 / plan.frame_clocks - rate) < 0.01 * rate


def test_own_edid(tmp_path: Path) -> None:
    """It takes the place of the board's in the list of sources, and in nothing else."""
    build = 'path = "video"\nedid = "own.bin"'
    with pytest.raises(InputError, match=r"build.edid: .*own.bin cannot be read"):
        scene(tmp_path, RATE, build=build)
    (tmp_path / "own.bin").write_bytes(bytes(128))
    with pytest.raises(InputError, match=r"build.edid: .*own.bin: begins with 00 00"):
        scene(tmp_path, RATE, build=build)
    own = make_edid((HD720,))
    (tmp_path / "own.bin").write_bytes(own)
    out = tmp_path / "out"
    plan = make_plan(scene(tmp_path, RATE, build=build))
    with_own, without = (
        configure(part, out) for part in (plan, plan.model_copy(update={"edid": None}))
    )
    package = out / "edid_pkg.vhd"
    assert with_own == [package if path.name == package.name else path for path in without]
    assert package not in without
    assert own[-16:].hex().upper() in package.read_text()


def test_video_path_that_does_not_fit_is_refused_with_it(tmp_path: Path) -> None:
    # All RAM is needed for 720p with M = 11; LUTs of the core and of the video path are counted.
    changes = [("columns = 640", "columns = 1280"), ("rows = 480", "rows = 720\nrate_hz = 60.0")]
    slices = ("near_mm = 800.0\nfar_mm = inf", 'slices = ["-2", "1/5", "2"]')
    build = 'path = "video"\narithmetic = "exact"\nengine = "fir"'
    with pytest.raises(InputError, match=r"XC6SLX45 is too small: it needs \d+ of 116 block RAM"):
        make_plan(scene(tmp_path, *changes, slices, build=build))


def test_configure_of_the_board(tmp_path: Path) -> None:
    plan = make_plan(scene(tmp_path, RATE, build='path = "video"'))
    sources = configure(plan, tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "plan.json",
        "atlys_top.prj",
        "atlys_top.ucf",
        "atlys_top.vhd",
        "atlys_top.xst",
        "sources.txt",
        "xst",
    }
    # Everything that the board is built of, in order, and nothing else.
    built_of = {source.stem for source in sources}
    assert {"refocus_video", "tmds_receiver", "serial_clocks", "atlys_top"} <= built_of
    assert not {"self_test", "scene_top", "scene_pkg"} & built_of
    listed = hdl.board_sources()
    order = [[path.stem for path in listed].index(source.stem) for source in sources]
    assert order == sorted(order)
    top = (tmp_path / "out" / "atlys_top.vhd").read_text()
    shifts = plan.core.generics()["SHIFTS"]
    assert re.search(rf'SHIFTS +: string +:= "{shifts}";', top)
    assert re.search(r"MAX_COLUMNS +: positive range 1 to 8192 +:= 640;", top)
    assert re.search(r"EXACT +: boolean +:= true;", top)
    script = (tmp_path / "out" / "atlys_top.xst").read_text()
    assert "-ifn atlys_top.prj" in script
