# SPDX-License-Identifier: Apache-2.0
"""An example of a LiteX SoC with a refocuser: its streams and a Wishbone port at the pins.

Usage: python refocus_soc.py FOLDER [--camera] [--build]

FOLDER is what ``plenofir configure SCENE --verilog --out FOLDER`` wrote. Leaves ``refocus_soc.v``
and the map of its registers, ``csr.csv``, in FOLDER/litex; with --build also a bitstream (Yosys,
nextpnr, ecppack). With --camera an OV5640 is in front of the refocuser, in RGB565, or in YUYV for
a grey scene. The pins are not placed: a board has a link there.
"""

import argparse
from pathlib import Path

from litex.build.generic_platform import Pins, Subsignal
from litex.build.lattice import LatticeECP5Platform
from litex.gen import LiteXModule
from litex.soc.integration.builder import Builder
from litex.soc.integration.soc_core import SoCMini
from litex.soc.interconnect import wishbone
from migen import ClockDomain

from dvp_camera import DvpCamera
from refocuser import Refocuser

try:  # Clock, reset and I2C of the sensor: in LiteX since 2024.12.
    from litex.soc.cores.ov5640 import OV5640Camera
except ImportError:
    OV5640Camera = None

NAME = "refocus_soc"
CLOCK_HZ = 75_000_000


class _Clock(LiteXModule):
    """The clock domain ``sys`` from the pins."""

    def __init__(self, platform: LatticeECP5Platform) -> None:
        self.cd_sys = ClockDomain()
        self.comb += [
            self.cd_sys.clk.eq(platform.request("clk")),
            self.cd_sys.rst.eq(platform.request("reset")),
        ]


def _stream(name: str, bits: int) -> tuple[object, ...]:
    widths = {"tvalid": 1, "tready": 1, "tdata": bits, "tuser": 1, "tid": 8, "tlast": 1}
    return (name, 0, *(Subsignal(signal, Pins(width)) for signal, width in widths.items()))


def _camera() -> tuple[object, ...]:
    pins = ["pclk", "href", "vsync"]
    if OV5640Camera is not None:
        pins += ["xclk", "pwdn", "rst_n", "scl", "sda"]
    return ("camera", 0, *(Subsignal(pin, Pins(1)) for pin in pins), Subsignal("data", Pins(8)))


class RefocusSoC(SoCMini):
    """A refocuser between two streams, or behind a camera; its registers on a Wishbone bus.

    `folder` is what ``plenofir configure --verilog`` wrote.
    """

    def __init__(self, folder: str | Path, *, camera: bool = False) -> None:
        platform = LatticeECP5Platform(
            "LFE5U-45F-6BG381C",
            [("clk", 0, Pins(1)), ("reset", 0, Pins(1))],
            name=NAME,
            toolchain="trellis",
        )
        self.crg = _Clock(platform)
        super().__init__(platform, CLOCK_HZ, ident="")
        self.refocuser = Refocuser(platform, folder)
        bus = wishbone.Interface(data_width=32, adr_width=30)
        self.bus.add_master("pins", bus)
        bits = len(self.refocuser.sink.data)
        platform.add_extension(
            [
                _camera() if camera else _stream("s_axis", bits),
                _stream("m_axis", bits),
                *bus.get_ios("wishbone"),
            ]
        )
        self.comb += bus.connect_to_pads(platform.request("wishbone"), mode="slave")
        streams = {"s_axis": self.refocuser.sink, "m_axis": self.refocuser.source}
        if camera:
            pads = platform.request("camera")
            self.camera = DvpCamera(pads, bits=bits)
            self.comb += self.camera.source.connect(streams.pop("s_axis"))
            if OV5640Camera is not None:
                self.ov5640 = OV5640Camera(pads, CLOCK_HZ, with_capture=False)
        for name, stream in streams.items():
            pins = platform.request(name)
            pairs = [(pins.tvalid, stream.valid), (pins.tdata, stream.data)]
            pairs += [(pins.tuser, stream.user), (pins.tid, stream.id), (pins.tlast, stream.last)]
            back = (stream.ready, pins.tready)
            if name == "s_axis":
                pairs, back = [(right, left) for left, right in pairs], back[::-1]
            self.comb += [left.eq(right) for left, right in (*pairs, back)]


def main() -> None:
    """Write the SoC."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", help="what plenofir configure --verilog wrote")
    parser.add_argument("--camera", action="store_true", help="an OV5640 in front")
    parser.add_argument("--build", action="store_true", help="run Yosys and nextpnr too")
    options = parser.parse_args()
    out = Path(options.folder) / "litex"
    builder = Builder(
        RefocusSoC(options.folder, camera=options.camera),
        output_dir=str(out),
        gateware_dir=str(out),
        compile_software=False,
        csr_csv=str(out / "csr.csv"),
    )
    builder.build(build_name=NAME, run=options.build)


if __name__ == "__main__":
    main()
