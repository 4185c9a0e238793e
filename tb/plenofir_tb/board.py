# SPDX-License-Identifier: Apache-2.0
"""The whole board in a bench: a source, a monitor, its panel and its serial port."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import FallingEdge, First, Timer

from plenofir.fpga.hdmi.link import Packed, ReceivedFrame, encode_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.script import Code, Command, pixel_period
from plenofir.refocus import ExactArithmetic
from plenofir_tb.case import read_case
from plenofir_tb.hdmi.colour import to_full_range_rgb, way_of
from plenofir_tb.hdmi.packets import AviInfo
from plenofir_tb.serial import SerialLink, last_frames
from plenofir_tb.sources import RGB, hdmi_source

# As documented: after the board's time to lock (with the meter's window of this bench) the frame
# under way and two whole ones are lost.
LOCK_FRAMES = 4


def fast(mode: VideoMode) -> VideoMode:
    """The mode with the fast pixel clock of the build."""
    return mode.model_copy(update={"pixel_clock": read_case()["fast_khz"]})


def signal(mode: VideoMode) -> list[Command]:
    return [pixel_period(mode), Command(Code.CLOCK, 1)]


class Board:
    """Source, board and monitor of ``hdmi_bench``."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.link = SerialLink(dut)
        self.rng = np.random.default_rng(cocotb.RANDOM_SEED)
        self.random = random.Random(cocotb.RANDOM_SEED)
        self.case = read_case()

    def pictures(self, mode: VideoMode, count: int) -> list[np.ndarray]:
        shape = (count, mode.v_active, mode.h_active, 3)
        return list(self.rng.integers(0, 256, shape, np.uint8))

    def golden(self, picture: np.ndarray, slice_: int = 0, info: AviInfo = RGB) -> np.ndarray:
        rgb = to_full_range_rgb(picture, way_of(info))
        return ExactArithmetic().refocus(rgb, self.case["m"], shift=self.case["shifts"][slice_])

    def led(self) -> int:
        """Light-emitting diodes, LED 0 in bit 0."""
        return int(self.dut.led.value)

    def lost_frames(self, mode: VideoMode) -> int:
        """Most frames between a new signal and the first refocused frame."""
        frame_us = 1000 * mode.h_total * mode.v_total / mode.pixel_clock
        return int(np.ceil(self.case["lock_us"] / frame_us)) + LOCK_FRAMES

    async def relock(
        self,
        mode: VideoMode,
        script: list[Command | Packed],
        info: AviInfo | None = None,
        swapped: int = 0,
    ) -> list[ReceivedFrame]:
        """Send a script, then frames: the first whole frame that is not black must be right.

        The source sends DVI, or HDMI with packets about its pictures. `swapped` (sum of 1, 2, 4):
        wires of the pairs of channels 0, 1, 2 are swapped. Returns the frames from the first right
        one on.
        """
        lost = self.lost_frames(mode)
        frames = self.pictures(mode, lost + 3)
        source = hdmi_source(info) if info else encode_frames
        inverted = sum(0x3FF << 10 * c for c in range(3) if swapped >> c & 1)
        words = source(mode, frames) ^ np.uint32(inverted)
        received = await self.link.play([*script, *signal(mode), words])
        got = last_frames(received, mode.h_total)
        assert got, "no picture"
        assert got[-1].mode == mode.as_measured()
        pictures = [frame for frame in got if frame.pixels.any()]
        assert pictures, "nothing but black"
        # Black frames come before the picture, never in between.
        assert all(frame.pixels.any() for frame in got[-len(pictures) :])
        golden = [self.golden(frame, info=info or RGB) for frame in frames]
        first = next(
            (i for i, want in enumerate(golden) if np.array_equal(pictures[0].pixels, want)), None
        )
        assert first is not None, "the first frame is wrong"
        assert first <= lost, f"first frame {first}, {lost} may be lost"
        for frame, want in zip(pictures, golden[first:], strict=False):
            assert np.array_equal(frame.pixels, want)
        # The last frame is incomplete at the output.
        assert len(pictures) >= len(frames) - first - 2
        return pictures


async def uart_send(dut: Any, text: str) -> None:
    bit_ns = 10 * read_case()["bit_clocks"]
    for code in text.encode():
        for bit in (0, *(code >> i & 1 for i in range(8)), 1):
            dut.uart_rx.value = bit
            await Timer(bit_ns, "ns")


async def uart_line(dut: Any) -> str:
    """Receive one line from the board."""
    bit_ns = 10 * read_case()["bit_clocks"]
    text = ""
    for _ in range(600):
        if int(dut.uart_tx.value):
            patience = Timer(1000 * bit_ns, "ns")
            start = await First(FallingEdge(dut.uart_tx), patience)
            assert start is not patience, f"no answer behind {text!r}"
        code = 0
        await Timer(bit_ns / 2, "ns")
        for i in range(8):
            await Timer(bit_ns, "ns")
            code |= int(dut.uart_tx.value) << i
        await Timer(bit_ns, "ns")
        assert int(dut.uart_tx.value), "no stop bit"
        text += chr(code)
        if text.endswith("\r\n"):
            return text.strip()
    raise AssertionError(text)


async def ask(dut: Any, text: str) -> str:
    """Send a command and receive its answer."""
    answer = cocotb.start_soon(uart_line(dut))
    await uart_send(dut, text + "\r\n")
    return await answer
