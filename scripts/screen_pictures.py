# SPDX-License-Identifier: Apache-2.0
"""Draws what a monitor shows, from the ULX3S's serial output bits: docs/images/screen-*.png.

A part of the light field with planes goes in as serial bits; slice, outputs and text are chosen
over the serial port; what comes out is decoded. Every pixel equals the golden model, or nothing is
written. It takes some minutes.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from plenofir import project
from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.screen.shown import ShownFrame, golden_frame
from plenofir.fpga.simulate.chain import check_chain, run_chain
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.images import read_image, write_png
from plenofir.plan.scene_screen import SceneScreen, screen_of

M, SHIFTS = 5, (-5, -3, 1, 5)
CAMERA, FOCUS_MM = "f193-mla2", 1000.0
ROWS, COLUMNS = slice(80, 260), slice(130, 530)
BOARD = "ulx3s"
NAMES = {
    ShownFrame(0, 2, 1): "screen-refocused",
    ShownFrame(1, 0, 1): "screen-all-in-focus",
    ShownFrame(2, 0, 1): "screen-depth",
}


def main() -> int:
    """Simulate, compare, write."""
    raw = read_image(project.DATA / "planes_5x5.png")[ROWS, COLUMNS]
    rows, columns = raw.shape[:2]
    part = SceneScreen(output=("refocused", "all-in-focus", "depth"), overlay=True)
    model = RayModel.focused(load_camera(CAMERA), FOCUS_MM, M)
    screen = screen_of(part, SHIFTS, M, model, (rows, columns), where="scene")
    core = CoreConfiguration(
        micro_image_size=M,
        shifts=SHIFTS,
        max_columns=columns,
        channels=3,
        engine=StackEngine(input_lines=M),
    )
    check_chain(core, rows, columns, screen)
    with tempfile.TemporaryDirectory() as folder:
        result = run_chain(
            find_simulator("ghdl"),
            core,
            raw,
            Path(folder) / "bench",
            board=BOARD,
            screen=screen,
            told=tuple(NAMES),
        )
    slices = core.golden(raw)
    for frame, picture in zip(NAMES, result.frames, strict=True):
        if not np.array_equal(picture, golden_frame(core, screen, frame, slices)):
            print(f"{NAMES[frame]} differs from the golden model", file=sys.stderr)
            return 1
    for name, picture in zip(NAMES.values(), result.frames, strict=True):
        write_png(project.root() / "docs" / "images" / f"{name}.png", picture)
    print(f"{result.clocks} clocks, {result.seconds:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
