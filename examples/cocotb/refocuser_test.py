# SPDX-License-Identifier: Apache-2.0
"""A test of your own with cocotb: each pixel of a scene's core against the golden model.

plenofir configure examples/verilog/scene.toml --verilog --out build/example
python examples/cocotb/refocuser_test.py build/example/scene_top.v
"""

import random
import sys
from pathlib import Path

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import RisingEdge
from cocotb_tools.runner import get_results, get_runner

from plenofir.refocus import refocus

M, FOCUS = 3, ("-2/3", "0", "1/3")  # as in the scene
ROWS, COLUMNS, CHANNELS = 18, 24, 3


async def send(dut, frame: np.ndarray) -> None:
    """Send a frame, with a pause now and then."""
    words = (frame.reshape(-1, CHANNELS).astype(int) << [0, 8, 16]).sum(axis=1)
    for number, word in enumerate(words):
        while random.random() < 0.2:
            dut.s_axis_tvalid.value = 0
            await RisingEdge(dut.clk)
        dut.s_axis_tdata.value, dut.s_axis_tvalid.value = int(word), 1
        dut.s_axis_tuser.value = number == 0
        dut.s_axis_tlast.value = (number + 1) % COLUMNS == 0
        await RisingEdge(dut.clk)
        while not dut.s_axis_tready.value:
            await RisingEdge(dut.clk)
    dut.s_axis_tvalid.value = 0


async def receive(dut) -> np.ndarray:
    """Take a frame, with a pause now and then."""
    pixels: list[int] = []
    while len(pixels) < ROWS * COLUMNS:
        dut.m_axis_tready.value = random.random() < 0.8
        await RisingEdge(dut.clk)
        if dut.m_axis_tvalid.value and dut.m_axis_tready.value:
            pixels.append(dut.m_axis_tdata.value.to_unsigned())
    return (np.array(pixels)[:, None] >> [0, 8, 16] & 255).reshape(ROWS, COLUMNS, CHANNELS)


@cocotb.test
async def every_pixel_of_every_slice(dut) -> None:
    """Random frames, one for each slice."""
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    for name in ("reset", "slice", "sweep", "sweep_frames", "error_clear", "m_axis_tready"):
        getattr(dut, name).value = name == "reset"
    for name in ("tvalid", "tdata", "tuser", "tlast"):
        getattr(dut, f"s_axis_{name}").value = 0
    cocotb.start_soon(Clock(dut.clk, 10, "ns").start())
    for _ in range(4):
        await RisingEdge(dut.clk)
    dut.reset.value = 0
    for number, a in enumerate(FOCUS):
        frame = rng.integers(0, 256, (ROWS, COLUMNS, CHANNELS), dtype=np.uint8)
        dut.slice.value = number
        sender = cocotb.start_soon(send(dut, frame))
        np.testing.assert_array_equal(await receive(dut), refocus(frame, M, a))
        await sender
    assert dut.error_flags.value == 0


if __name__ == "__main__":
    verilog = Path(sys.argv[1]).resolve()
    runner, folder = get_runner("icarus"), verilog.parent / "cocotb"
    runner.build(
        sources=[verilog], hdl_toplevel="scene_top", build_dir=folder, timescale=("1ns", "1ps")
    )
    results = runner.test(
        test_module="refocuser_test", hdl_toplevel="scene_top", build_dir=folder, test_dir=folder
    )
    sys.exit(get_results(results)[1] > 0)
