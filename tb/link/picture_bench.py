# SPDX-License-Identifier: Apache-2.0
"""cocotb test from the command ``plenofir board load`` to the pixels that are shown."""

from typing import Any

import cocotb

from link.load_bench import Line, Terminal
from plenofir_tb.case import read_case
from video.sensor_bench import ALIGNED, LOST, MODE, REFOCUSED, Bench

CASE = read_case()


class Board(Bench):
    """Source of raw video, serial line, design, video sink."""

    LOADED_BY_PORT = False

    def __init__(self, dut: Any) -> None:
        super().__init__(dut)
        dut.playing.value = 1
        dut.line_in.value = 1
        self.terminal = Terminal(Line(dut, alone=False))

    async def type(self, camera: int) -> tuple[int, str]:
        """Run the command for a camera's calibration between two frames."""
        self.dut.playing.value = 0
        code, _, err = await self.terminal.load(CASE["calibrations"][camera])
        self.dut.playing.value = 1
        return code, err

    async def choose(self, place: int) -> None:
        """Select an output, and wait until it is shown."""
        self.place = place
        self.dut.shown.value = place
        await self.play(MODE, LOST)
        self.errors.clear()


@cocotb.test()
async def from_the_command_to_the_picture(dut: Any) -> None:
    """One calibration, then another; one that does not fit the board changes nothing."""
    board = Board(dut)
    await board.reset()
    await board.play(MODE, LOST)
    *fitting, too_many_lines = range(len(CASE["cameras"]))
    for camera in fitting:
        assert await board.type(camera) == (0, "")
        board.camera = camera
        for place in (ALIGNED, REFOCUSED):
            await board.choose(place)
            await board.check(MODE)
            assert not board.errors
    code, err = await board.type(too_many_lines)
    assert code == 2
    assert "lines of the ring; the board has" in err
    assert err.count("\n") == 1
    await board.choose(ALIGNED)
    await board.check(MODE)
    assert not board.errors
