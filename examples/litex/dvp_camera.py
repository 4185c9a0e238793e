# SPDX-License-Identifier: Apache-2.0
"""A LiteX module: a camera with parallel output (DVP, such as an OV5640) as AXI4-Stream video.

It needs LiteX alone: copy it into a project. The sensor is set up over its I2C by software.
"""

from typing import Any

from litex.gen import LiteXModule
from litex.soc.interconnect import stream
from litex.soc.interconnect.axi import AXIStreamInterface
from migen import Cat, ClockDomain, If, Signal


class DvpCamera(LiteXModule):
    """Two bytes a pixel, in the camera's clock: RGB565, or the brightness of YUYV.

    Bytes come while ``href`` is high; a pulse of ``vsync`` stands between frames. ``source`` is in
    the clock domain ``sys``: ``user`` is the start of a frame, ``last`` the end of a line, red or
    grey in the low bits. The camera cannot wait: pixels that do not fit into the buffer are lost,
    and the refocuser reports a line that ended early.

    Parameters
    ----------
    pads
        ``pclk``, ``href``, ``vsync`` and ``data`` (8 bits).
    bits
        24 for RGB565, widened to three channels of 8 bits; 8 for the brightness of YUYV.
    depth
        Pixels of the buffer.
    """

    def __init__(self, pads: Any, *, bits: int, depth: int = 64) -> None:
        self.cd_camera = ClockDomain(reset_less=True)
        layout = [("data", bits), ("user", 1)]
        self.buffer = stream.ClockDomainCrossing(layout, "camera", "sys", depth=depth)
        self.source = source = AXIStreamInterface(data_width=bits, keep_width=0, user_width=1)

        # # #

        buffered = self.buffer.source
        self.comb += [
            self.cd_camera.clk.eq(pads.pclk),
            source.valid.eq(buffered.valid),
            source.data.eq(buffered.data),
            source.user.eq(buffered.user),
            source.last.eq(buffered.last),
            buffered.ready.eq(source.ready),
        ]
        # The pins in registers, then the two bytes of a pixel.
        href, vsync, byte = Signal(), Signal(), Signal(8)
        first, second, pixel = Signal(8), Signal(), Signal(bits)
        red, green, blue = first[3:8], Cat(byte[5:8], first[0:3]), byte[0:5]
        wide = Cat(red[2:5], red, green[4:6], green, blue[2:5], blue)
        self.comb += pixel.eq(wide if bits == 24 else first)
        # A pixel waits until it is known whether it is the last one of its line.
        waits, held, begins, held_begins = Signal(), Signal(bits), Signal(), Signal()
        sink = self.buffer.sink
        self.comb += [
            sink.valid.eq(waits & (~href | second)),
            sink.data.eq(held),
            sink.user.eq(held_begins),
            sink.last.eq(~href),
        ]
        self.sync.camera += [
            href.eq(pads.href),
            vsync.eq(pads.vsync),
            byte.eq(pads.data),
            If(vsync, begins.eq(1)),
            If(
                href,
                second.eq(~second),
                first.eq(byte),
                If(
                    second,
                    waits.eq(1),
                    held.eq(pixel),
                    held_begins.eq(begins),
                    begins.eq(0),
                ),
            ).Else(second.eq(0), waits.eq(0)),
        ]
