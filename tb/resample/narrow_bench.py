# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``resampler`` with frames of few pixels, and with invalid ones."""

from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import ClockCycles

from plenofir.camera.resampling import GridRegisters, Precision, Tables
from plenofir_tb.axi_video import frame_beats
from resample.resample_bench import Bench


def grid(bench: Bench, shape: tuple[int, int]) -> GridRegisters:
    """Lenses of 1 pixel, one for each pixel except at two borders, at random positions between."""
    one = 1 << bench.core.fraction_bits
    rows, columns = shape
    y, x = (bench.rng.randrange(one) for _ in range(2))
    return GridRegisters(
        image_shape=shape,
        lenses=(rows - 1, columns - 1),
        layout="rectangular",
        micro_image_size=1,
        precision=Precision(),
        origin=(y, x),
        right=(0, one),
        down=((one, 0), (one, 0)),
        outputs=columns - 1,
    )


@cocotb.test()
async def rings_of_few_pixels(dut: Any) -> None:
    """Lines shorter than the reader's start-up time are not overwritten before they are read."""
    bench = Bench(dut)
    await bench.reset()
    for stalls in (("none", "none"), ("none", "many")):
        for columns in (2, 3):
            await bench.use(grid(bench, (11, columns)), Tables())
            bench.stall(*stalls)
            for _ in range(3):
                bench.send_frame(bench.frame("random"))
            await bench.drain()
    assert not bench.errors()


@cocotb.test()
async def lines_and_columns(dut: Any) -> None:
    """A frame of one line or column raises a flag, and the next one comes out."""
    bench = Bench(dut)
    await bench.reset()
    fitting = grid(bench, (5, 3))
    for shape in ((1, 3), (5, 1), (1, 1)):
        await bench.use(fitting, Tables())
        dut.rows.value, dut.columns.value = shape
        bench.stall("none", "none")
        bench.source.append(frame_beats(np.zeros(shape, np.uint8), 8))
        await ClockCycles(dut.clk, 80)
        assert bench.errors() == {"grid"}
        await bench.clear_errors()
        await bench.use(fitting, Tables())
        bench.send_frame(bench.frame("random"))
        await bench.drain()
        assert not bench.errors()
