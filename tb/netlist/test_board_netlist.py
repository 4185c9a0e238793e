# SPDX-License-Identifier: Apache-2.0
"""The ULX3S's netlist for nextpnr, from serial bits to serial bits.

Fabric: Yosys' models of the ECP5's cells; hard blocks: ``ecp5_blocks.v``.
"""

from pathlib import Path

import numpy as np
import pytest

from netlist.netlists import FOLDER, netlist_verilog, run_netlist
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.nextpnr import range_generics, synthesise_board
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdmi.link import encode_frames
from plenofir.fpga.tools.synthesis import cell_declarations, write_verilog
from plenofir.plan import Plan, load_scene, make_plan
from plenofir.plan.configure import clock_range_of
from plenofir_tb.serial import last_frames
from plenofir_tb.video import MODE_720

BOARD = BOARDS["ulx3s"]
SCENE = "ulx3s-480p"
# 640x480p60's pixel clock; its frames would take minutes.
PERIOD_PS = 39_720
# Blanking until resets are over (1 ms of the control, 1 ms of the PLL), the clock is measured
# (160 us, several times) and delays are found; then frames, of which three are measured.
SETTLE_WORDS, FRAMES = 100_000, 9


def simulate(netlist: Path, words: np.ndarray) -> np.ndarray:
    """Send words through a netlist; result: the output at its pins."""
    (netlist.parent / "input.hex").write_text("".join(f"{word:08x}\n" for word in words))
    cells = cell_declarations("ecp5u")[0].parent
    models = [FOLDER / "ecp5_blocks.v", *(cells / f"{n}_sim.vh" for n in ("common", "ccu2c"))]
    parameters = {"WORDS": words.size, "PERIOD": PERIOD_PS}
    return run_netlist(netlist, "netlist_bench.v", models, cells, parameters)


@pytest.mark.slow
def test_netlist_of_a_scene(tmp_path: Path) -> None:
    plan = make_plan(load_scene(SCENE))
    generics = range_generics(clock_range_of(plan)) | board_generics(plan.core, BOARD.top)
    write_verilog(
        hdl.board_sources(BOARD.name), BOARD.top, generics, tmp_path, primitives=BOARD.library
    )
    synthesise_board(BOARD.top, tmp_path / f"{BOARD.top}.json")
    check_netlist(netlist_verilog(tmp_path / f"{BOARD.top}.json"), plan)


def check_netlist(netlist: Path, plan: Plan) -> None:
    """Small frames of random pixels: the output equals the golden model's."""
    seed = int(np.random.default_rng().integers(1 << 30))
    print("seed:", seed)
    shape = (FRAMES, MODE_720.v_active, MODE_720.h_active, 3)
    frames = list(np.random.default_rng(seed).integers(0, 256, shape, np.uint8))
    blanking = encode_frames(MODE_720, [np.zeros(shape[1:], np.uint8)])
    begin = np.resize(blanking, SETTLE_WORDS // blanking.size * blanking.size)
    taken = simulate(netlist, np.concatenate([begin, encode_frames(MODE_720, frames)]))
    got = last_frames(taken, MODE_720.h_total)
    assert len(got) >= 3
    # The last frame is incomplete at the output.
    for shown, frame in zip(got[::-1], frames[-2:-5:-1], strict=False):
        assert shown.mode == MODE_720.as_measured()
        assert np.array_equal(shown.pixels, plan.core.golden(frame)[0])
