# SPDX-License-Identifier: Apache-2.0
"""Place and route, to measure the clock, for families other than ECP5 with pip-installable tools.

A core is put behind three pins (`few_pins.three_pins`), so the result includes a shift register on
either side. Timing is that of open databases, not of the vendors' tools.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from plenofir.fpga.families import FAMILIES, Family
from plenofir.fpga.resources.record import Placed
from plenofir.fpga.synthesis.ecp5 import ecp5_tool as tool_command
from plenofir.fpga.synthesis.placers import PLACERS, check_placer, open_carries
from plenofir.fpga.tools.synthesis import Generics, run_tool, run_yosys, write_verilog
from plenofir_studies.few_pins import NAME, three_pins
from plenofir_studies.placed_ecp5 import seed_option

REPORTED = {
    "nexus": (("OXIDE_COMB",), ("OXIDE_FF",), ("OXIDE_EBR",), ("MULT18_CORE",)),
    "gw1n": (("LUT4", "ALU"), ("DFF",), ("BSRAM",), ("MULT18X18",)),
    "gw2a": (("LUT4", "ALU"), ("DFF",), ("BSRAM",), ("MULT18X18",)),
    "gw5a": (("LUT4", "ALU"), ("DFF",), ("BSRAM",), ()),
    "gatemate": (("CPE_LT",), ("CPE_FF",), ("RAM_HALF",), ()),
}
"""Names that nextpnr's reports have for LUTs, flip-flops, block RAMs, multipliers."""


_NETLIST = "netlist.json"
_GOAL_MHZ = "200"

# nextpnr-nexus does not reach the global clocks from every pin; the oscillator drives them. It
# takes no ldc_create_clock, so the clock to aim at is an option, and wants a place for every pin.
_OSCILLATOR = f"""
module clocked(input data_in, output data_out);
  wire clk;
  OSCA #(.HF_CLK_DIV("1"), .HF_OSC_EN("ENABLED")) oscillator (.HFOUTEN(1'b1), .HFCLKOUT(clk));
  {NAME} core (.clk(clk), .data_in(data_in), .data_out(data_out));
endmodule
"""


def place_core(
    name: str,
    family: Family,
    sources: Sequence[Path],
    top: str,
    generics: Generics,
    directory: Path,
) -> Placed:
    """Synthesise a core for a device, place, route, and pack a bitstream, in a folder."""
    synthesise_core(name, family, sources, top, generics, directory)
    placed = route_core(name, family, directory)
    placer = PLACERS[name]
    run_tool([tool_command(placer.pack[0]), *placer.pack[1:]], directory / "pack.log")
    return placed


def synthesise_core(
    name: str,
    family: Family,
    sources: Sequence[Path],
    top: str,
    generics: Generics,
    directory: Path,
) -> None:
    """Make the netlist of a core for a device, behind three pins, in a folder."""
    placer = check_placer(name)
    verilog = write_verilog(sources, top, generics, directory)
    text = verilog.read_text()
    verilog.write_text("\n".join([text, three_pins(text, top), *[_OSCILLATOR] * placer.clocked]))
    wrapped, netlist = "clocked" if placer.clocked else NAME, directory / _NETLIST
    command = FAMILIES[family].synthesis.replace("-noclkbuf", "")
    pads = "-iopad" if family == "nexus" else ""
    run_yosys(
        [
            f"read_verilog {verilog.name}",
            f"{command} {pads} {placer.synthesis} -top {wrapped} -json {netlist.name}",
        ],
        directory / "yosys.log",
        reads=[verilog],
        writes=[netlist.name],
    )
    if family == "nexus":
        open_carries(netlist)


def route_core(name: str, family: Family, directory: Path, *, seed: int | None = None) -> Placed:
    """Place and route the netlist that `synthesise_core` made in a folder; its clock and amounts.

    `seed` is that of the random initial placement; nextpnr's default if None.
    """
    placer = check_placer(name)
    # YoWASP's tools only see the folder that they run in, so all files are in it.
    file, language, constraints = placer.pins
    (directory / file).write_text(constraints.text(language))
    run_tool(
        [
            *(tool_command(placer.tool), "--device", placer.part, "--json", _NETLIST),
            *(*placer.options, "--freq", _GOAL_MHZ, "--timing-allow-fail"),
            *(*seed_option(seed), "--report", "report.json"),
        ],
        directory / "nextpnr.log",
    )
    report = json.loads((directory / "report.json").read_text())
    used = report["utilization"]
    lut, flip_flops, block_rams, multipliers = (
        sum(used[kind]["used"] for kind in kinds if kind in used) for kinds in REPORTED[family]
    )
    fmax = min(clock["achieved"] for clock in report["fmax"].values())
    return Placed(
        device=name,
        fmax_mhz=round(fmax, 1),
        lut=lut,
        flip_flops=flip_flops,
        block_rams=block_rams,
        multipliers=multipliers,
    )
