# SPDX-License-Identifier: Apache-2.0
"""cocotb test of csi_receiver: lines arrive faster than they leave, with a sensor's blanking."""

import cocotb

from csi.receiver_bench import Bench
from plenofir.fpga.csi import frame_packets
from plenofir.fpga.sensors import IMX219_MODES
from plenofir_tb.case import read_case

# The receiver's bench has the rates, which are the same for all cases here.
CASE = read_case()


@cocotb.test()
async def lines_of_an_imx219(dut) -> None:
    """Nothing is lost with the computed buffer, and something is with half of it."""
    mode = next(mode for mode in IMX219_MODES if mode.columns == CASE["columns"])
    lines = 3
    bench = Bench(dut, mode.columns, lines)
    await bench.begin()
    picture = bench.picture()
    packets = frame_packets(picture, 10)
    # A byte of each of two lanes is 1.6 pixels.
    line_clocks = round(mode.line_pixels / 1.6)
    for packet in packets:
        bench.lanes.send([packet], gap=max(line_clocks - len(packet) // 2, 8))
    await bench.lanes.sent()
    lost = bench.counts().get("lost", 0)
    if CASE["whole"]:
        bench.check([picture])
        assert bench.counts() == {}
    else:
        assert lost
