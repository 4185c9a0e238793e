# SPDX-License-Identifier: Apache-2.0
"""The bitstream of a scene's board with the open tools of its family."""

from pathlib import Path

from plenofir.fpga.bitstream import gowin, nextpnr, nexus
from plenofir.fpga.bitstream.open_build import NextpnrReport
from plenofir.fpga.bitstream.steps import Progress
from plenofir.fpga.boards import Board, board_of
from plenofir.plan.configure import board_packages, clock_range_of, scene_generics
from plenofir.plan.plan import Plan


def build_scene(
    plan: Plan,
    out: Path,
    progress: Progress,
    *,
    board: Board | None = None,
    beyond: bool = False,
) -> NextpnrReport:
    """Build the bitstream of a scene whose board is not ISE's; see the family's own ``build``.

    `board` is one with the plan's device, None the first of them; `beyond` accepts clocks beyond
    the data sheet.
    """
    board, camera = board or board_of(plan.device), plan.camera
    assert board is not None
    target, packages = (board, plan.device, scene_generics(plan)), board_packages(plan)
    if board.flow == "gowin":
        return gowin.build(*target, out, progress, packages)
    if board.flow == "nexus":
        assert camera is not None
        clocks_mhz = {"clk": camera.wanted_mhz, "byte_clk": camera.byte_mhz}
        return nexus.build(*target, clocks_mhz, out, progress, packages)
    clocks, lanes = 0, None
    if camera is None:
        clocks = clock_range_of(plan)
    else:
        lanes = nextpnr.CameraClocks(camera.lane_mbits / 2, camera.clock_mhz)
    return nextpnr.build(*target, clocks, out, progress, packages, beyond=beyond, camera=lanes)
