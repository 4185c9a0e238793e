# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``full_range_rgb`` against the Python arithmetic."""

import itertools
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir_tb.hdmi.colour import to_full_range_rgb, way_of
from plenofir_tb.hdmi.packets import AviInfo, Colorimetry, ColourSpace

LATENCY = 3


@cocotb.test()
async def colours_are_converted(dut: Any) -> None:
    """All conversions, and none: pixels as in the Python arithmetic, with their syncs."""
    Clock(dut.clk, 10, "ns").start()
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    ends = list(itertools.product((0, 16, 128, 240, 255), repeat=3))
    for space, limited, bt601 in itertools.product(range(4), (0, 1), (0, 1)):
        dut.colour.value, dut.limited.value, dut.bt601.value = space, limited, bt601
        info = AviInfo(
            ColourSpace(space), Colorimetry(2 - bt601), rgb_range=2 - limited, ycc_range=1 - limited
        )
        pixels = np.concatenate([ends, rng.integers(0, 256, (150, 3))]).astype(np.uint8)
        want = to_full_range_rgb(pixels, way_of(info))
        flags = rng.integers(0, 8, len(pixels)).tolist()
        for i in range(len(pixels) + LATENCY):
            if i >= LATENCY:
                packed = int(dut.out_pixel.value)
                got = [packed >> 8 * c & 255 for c in range(3)]
                assert got == want[i - LATENCY].tolist(), f"{info}: {pixels[i - LATENCY]}"
                levels = (dut.out_active.value, dut.out_h_sync.value, dut.out_v_sync.value)
                assert sum(int(v) << k for k, v in enumerate(levels)) == flags[i - LATENCY]
            at = min(i, len(pixels) - 1)
            red, green, blue = pixels[at].tolist()
            dut.in_pixel.value = red | green << 8 | blue << 16
            dut.in_active.value = flags[at] & 1
            dut.in_h_sync.value = flags[at] >> 1 & 1
            dut.in_v_sync.value = flags[at] >> 2
            if i == 0:
                # The conversion is selected a clock later.
                await FallingEdge(dut.clk)
            await FallingEdge(dut.clk)
