# SPDX-License-Identifier: Apache-2.0
"""The Tang Nano 20K's netlist for nextpnr, from the stored flower to serial bits.

Fabric: Yosys' models of the GW2A's cells; hard blocks: ``gowin_blocks.v``.
"""

from pathlib import Path

import pytest

from hdmi.test_tangnano import golden_frames, shown_slices
from netlist.netlists import FOLDER, netlist_verilog, run_netlist
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.gowin import synthesise_board
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdmi.link import decode_frames
from plenofir.fpga.hdmi.modes import VGA, VGA_MIDDLE
from plenofir.fpga.tools.synthesis import cell_declarations, write_verilog
from plenofir.plan import Plan, load_scene, make_plan
from plenofir.plan.configure import board_packages
from plenofir_tb.video import in_the_middle

BOARD = BOARDS["tangnano20k"]
# Number of frames; the timing is followed after three of them.
FRAMES = 6


def check_netlist(netlist: Path, plan: Plan) -> None:
    """Whole frames of 640x480: each is black or the golden model's."""
    declared, cells = cell_declarations(BOARD.library)
    words = FRAMES * VGA.h_total * VGA.v_total + 1000
    models = [FOLDER / "gowin_blocks.v", cells]
    taken = run_netlist(netlist, "tangnano20k_bench.v", models, declared.parent, {"WORDS": words})
    got = decode_frames(taken)
    assert plan.stored is not None
    raw = in_the_middle(plan.stored.raster(), plan.core.micro_image_size, VGA_MIDDLE)
    assert len(shown_slices(got, golden_frames(plan.core, raw, plan.screen, 80))) >= 2
    assert {frame.mode for frame in got} == {VGA.as_measured()}


@pytest.mark.slow
def test_netlist_of_the_shipped_scene(tmp_path: Path) -> None:
    plan = make_plan(load_scene(BOARD.scene))
    sources = hdl.with_packages(hdl.board_sources(BOARD.name), board_packages(plan), tmp_path)
    generics = board_generics(plan.core, BOARD.top)
    write_verilog(
        *(sources, BOARD.top, generics, tmp_path),
        primitives=BOARD.library,
        contents_in_files=True,
    )
    netlist = tmp_path / f"{BOARD.top}.json"
    synthesise_board(BOARD, netlist)
    check_netlist(netlist_verilog(netlist), plan)
