# SPDX-License-Identifier: Apache-2.0
"""Place and route for ECP5: recorded clocks reach their goals; a small design goes all the way."""

from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.trellis_config import check_configuration, read_configuration
from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.resources.record import ECP5_FASTEST, ECP5_SLOWEST, load_record
from plenofir.fpga.synthesis.ecp5 import check_tools
from plenofir.ground import project
from plenofir.plan import load_scene, make_plan
from plenofir.plan.loaded_scene import scene_files
from plenofir.plan.synthesised import is_nextpnr_board, is_stack_core
from plenofir_studies.placed_ecp5 import make_netlist, place, write_bitstream
from plenofir_studies.records import load_builds
from plenofir_tb.tools import or_skip
from self_test import TOP, self_test_generics

VIDEO_720P, VIDEO_1080P = 74.25, 148.5


def _placed(file: Path) -> bool:
    """Cores with a sensor are too large for the ECP5; Vivado alone places its boards."""
    loaded = load_scene(file)
    build = loaded.scene.build
    board = board_of(build.device) if build.path == "video" else None
    of_vivado = board is not None and board.flow == "vivado"
    return not of_vivado and (loaded.sensor is None or build.path == "camera")


SCENES = [file for file in scene_files() if _placed(file)]


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_scenes_reach_their_clock(file: Path) -> None:
    plan = make_plan(load_scene(file))
    if is_nextpnr_board(plan):
        timing = {clock.clock: clock for clock in load_builds()[plan.scene].timing}
        assert plan.clock_mhz is not None
        assert timing["clk"].reached_mhz >= plan.clock_mhz
        assert all(clock.reached_mhz >= clock.wanted_mhz for clock in timing.values())
        return
    slowest = load_record().placed[ECP5_SLOWEST][plan.scene].fmax_mhz
    # Of stacks the planner promises half of the clock.
    least = plan.core.kept_mhz(DEVICES[plan.device]) if is_stack_core(plan) else VIDEO_720P
    assert slowest >= max(least, plan.clock_mhz or 0)


def test_fastest_configuration_reaches_1080p() -> None:
    fastest = load_record().placed[ECP5_FASTEST]
    assert max(placed.fmax_mhz for placed in fastest.values()) >= VIDEO_1080P


@pytest.mark.slow
def test_bitstream_of_a_board(tmp_path: Path) -> None:
    with or_skip():
        check_tools()
    core = CoreConfiguration(micro_image_size=3, shifts=(1,), max_columns=64)
    netlist = make_netlist(hdl.hdl_sources(), TOP, self_test_generics(core, 48), tmp_path)
    constraints = project.root() / "constraints" / "ulx3s_self_test.lpf"
    placed = place(netlist, goal_mhz=25, constraints=constraints)
    assert placed.fmax_mhz >= VIDEO_720P
    # Its configuration has what the constraints say of each pin.
    _, pins = check_configuration(
        read_configuration(netlist.with_suffix(".config").read_text()),
        (tmp_path / "nextpnr.log").read_text(),
        constraints.read_text(),
    )
    assert set(pins) == {"clk", "reset", "tested", "passed", "blink"}
    assert write_bitstream(netlist.with_suffix(".config")).stat().st_size > 100_000
