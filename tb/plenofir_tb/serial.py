# SPDX-License-Identifier: Apache-2.0
"""Serial TMDS bits of the board, by way of ``tb/file_bench/hdmi_bench.vhd``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from cocotb.triggers import FallingEdge, First, RisingEdge, Timer

from plenofir.fpga.hdmi.link import LinkError, Packed, ReceivedFrame, decode_frames
from plenofir.fpga.hdmi.script import Code, Command, write_script

# Far longer than any script that the tests play, in ms of simulated time.
PATIENCE_MS = 50
SKEWS = (Code.SKEW_0, Code.SKEW_1, Code.SKEW_2)


class SerialLink:
    """Plays scripts on ``hdmi_bench``."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.taken: Packed = np.zeros(0, np.uint32)

    async def reset(self) -> None:
        """Reset the board, with all switches off, an ideal cable and no clock."""
        dut = self.dut
        for name in (
            *("start", "button_up", "button_down", "button_clear"),
            *("switch_pattern", "switch_pass", "switch_sweep"),
        ):
            getattr(dut, name).value = 0
        dut.uart_rx.value = 1
        dut.reset_n.value = 0
        # Longer than a bounce of the button by the board's filter.
        await Timer(2, "us")
        await self.play(
            [
                *(Command(code, 0) for code in (*SKEWS, Code.CLOCK_SKEW, Code.JITTER)),
                Command(Code.CLOCK, 0),
                Command(Code.CABLE, 1),
            ]
        )
        dut.reset_n.value = 1
        # Until the clocks that a board makes from its oscillator have locked and its reset is over.
        await Timer(8, "us")

    async def play(self, script: Sequence[Command | Packed]) -> Packed:
        """Play commands and words, and return the output meanwhile."""
        write_script(Path("input.bin"), script)
        self.dut.start.value = 1
        patience = Timer(PATIENCE_MS, "ms")
        assert await First(RisingEdge(self.dut.done), patience) is not patience, "the bench hangs"
        self.dut.start.value = 0
        await FallingEdge(self.dut.done)
        # The bench notices the end of `start` at its next pixel.
        await Timer(100, "ns")
        self.taken = np.fromfile("output.bin", "<u4")
        return self.taken


def last_frames(words: Packed, step: int) -> list[ReceivedFrame]:
    """Whole frames after the last disturbance of a signal, which may last to its end.

    The beginning of the regular signal is found to `step` words.
    """

    def frames_from(begin: int) -> list[ReceivedFrame]:
        try:
            return decode_frames(words[begin:])
        except LinkError:
            return []

    # A signal that is regular from one point on is regular from any later one too.
    regular = next((b for b in range(0, len(words), 16 * step) if frames_from(b)), None)
    if regular is None:
        return []
    disturbed = max(regular - 16 * step, 0)
    while regular - disturbed > step:
        middle = (regular + disturbed) // 2
        if frames_from(middle):
            regular = middle
        else:
            disturbed = middle
    frames = frames_from(regular)
    # A restarted raster looks like one frame with another blanking.
    others = [i for i, frame in enumerate(frames) if frame.mode != frames[-1].mode]
    return frames[others[-1] + 1 :] if others else frames
