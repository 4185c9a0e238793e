# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of pictures without a source, and of black sides."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge

from plenofir.fpga.hdmi.link import raster_signals
from plenofir_tb.case import read_case
from plenofir_tb.entities import for_entity
from plenofir_tb.video import in_the_middle, random_mode, reset, shrunken, timing_vector

PACKED = (1, 256, 65536)


@for_entity("stored_light_field")
async def stored_in_the_middle(dut: Any) -> None:
    """Two frames after each reset, also after one in the middle of a frame."""
    case = read_case()
    mode = shrunken("stored", **case["mode"])
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    dut.timing.value = timing_vector(mode)
    raster = np.array(case["raster"], np.uint8)
    picture = in_the_middle(raster, case["micro_image_size"], mode)
    signals = raster_signals(mode, [picture] * 2)
    packed = signals.pixels.astype(int) @ PACKED
    for clocks in (rng.randrange(len(packed)), len(packed)):
        await reset(dut, 5)
        # The raster starts a clock after the reset, its pixels come four clocks later.
        await ClockCycles(dut.clk, 5)
        await FallingEdge(dut.clk)
        for n in range(clocks):
            got = (int(dut.active.value), int(dut.h_sync.value), int(dut.v_sync.value))
            assert got == (signals.active[n], signals.h_sync[n], signals.v_sync[n]), f"pixel {n}"
            if got[0]:
                assert int(dut.pixel.value) == packed[n], f"pixel {n}"
            await FallingEdge(dut.clk)


@for_entity("black_sides")
async def sides_of_any_mode(dut: Any) -> None:
    """Random pictures in random modes: the same in the middle, syncs as long as before."""
    side = read_case()["columns"]
    rng = random.Random(cocotb.RANDOM_SEED)
    Clock(dut.clk, 10, "ns").start()
    for _ in range(4):
        narrow = random_mode(rng)
        back = narrow.h_back + side
        narrow = narrow.model_copy(
            update={"h_front": narrow.h_front + side, "h_back": back, "v_positive": False}
        )
        update = {"h_active": narrow.h_active + 2 * side, "h_front": narrow.h_front - side}
        wide = narrow.model_copy(update={**update, "h_back": back - side})
        seed = rng.randrange(1 << 31)
        size = (3, narrow.v_active, narrow.h_active, 3)
        frames = np.random.default_rng(seed).integers(0, 256, size, np.uint8)
        signals = raster_signals(narrow, list(frames))
        want = raster_signals(
            wide, [np.pad(frame, ((0, 0), (side, side), (0, 0))) for frame in frames]
        )
        packed, wanted = (s.pixels.astype(int) @ PACKED for s in (signals, want))
        await reset(dut, 3)
        # A picture's line begins `side` clocks before its first pixel comes out.
        for n in range(len(packed)):
            dut.in_active.value = int(signals.active[n])
            dut.in_h_sync.value = int(signals.h_sync[n])
            dut.in_v_sync.value = int(signals.v_sync[n])
            dut.in_pixel.value = int(packed[n])
            await FallingEdge(dut.clk)
            place = n - 1
            if n < side + 2 or place >= len(packed):
                continue
            got = (int(dut.out_active.value), int(dut.out_h_sync.value), int(dut.out_v_sync.value))
            late = n - side - 1
            places = (want.active[place], signals.h_sync[late], signals.v_sync[late])
            assert got == places, f"{narrow}, pixel {n}"
            if got[0]:
                assert int(dut.out_pixel.value) == wanted[place], f"{narrow}, pixel {n}"
