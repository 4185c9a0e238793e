# SPDX-License-Identifier: Apache-2.0
"""An example of a LiteX SoC with a refocuser: its streams and a Wishbone port at the pins.

Usage: python refocus_soc.py FOLDER [--build]

FOLDER is what ``plenofir configure SCENE --verilog --out FOLDER`` wrote. Leaves ``refocus_soc.v``
and the map of its registers, ``csr.csv``, in FOLDER/litex; with --build also a bitstream (Yosys,
nextpnr, ecppack). The pins are not placed: a board has a camera or a link there.
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

from refocuser import Refocuser

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


class RefocusSoC(SoCMini):
    """A refocuser between two streams, its registers on a Wishbone bus.

    `folder` is what ``plenofir configure --verilog`` wrote.
    """

    def __init__(self, folder: str | Path) -> None:
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
                _stream("s_axis", bits),
                _stream("m_axis", bits),
                *bus.get_ios("wishbone"),
            ]
        )
        self.comb += bus.connect_to_pads(platform.request("wishbone"), mode="slave")
        for name, stream in (("s_axis", self.refocuser.sink), ("m_axis", self.refocuser.source)):
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
    parser.add_argument("--build", action="store_true", help="run Yosys and nextpnr too")
    options = parser.parse_args()
    out = Path(options.folder) / "litex"
    builder = Builder(
        RefocusSoC(options.folder),
        output_dir=str(out),
        gateware_dir=str(out),
        compile_software=False,
        csr_csv=str(out / "csr.csv"),
    )
    builder.build(build_name=NAME, run=options.build)


if __name__ == "__main__":
    main()
