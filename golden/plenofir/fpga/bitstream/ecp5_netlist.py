# SPDX-License-Identifier: Apache-2.0
"""Changes of a board's netlist between Yosys and nextpnr: names, PLL words, places."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plenofir.fpga.bitstream.netlist_names import name_nets
from plenofir.ground.errors import ToolError

SLOW, FAST = "clk", "clk_x5"
"""The pixel clock and the lanes' one."""
# Net to cell and port of a top level.
_CLOCK_NETS = {
    "source_clk": ("pixel_clocks_of_both.pll", "CLKI"),
    SLOW: ("pixel_clocks_of_both.pll", "CLKOP"),
    FAST: ("pixel_clocks_of_both.pll", "CLKOS"),
    "control_clk": ("oscillator.pll", "CLKOP"),
    "own_clk": ("oscillator.pll", "CLKOS"),
    # The divided clock of a camera's lanes.
    "bits_clk": ("lanes.bits_clock", "CDIVX"),
}
PLL_WORDS = {
    "ICP_CURRENT": 12,
    "LPF_RESISTOR": 8,
    "MFG_ENABLE_FILTEROPAMP": 1,
    "MFG_GMCREF_SEL": 2,
}
"""Charge pump, loop filter and bias of every PLL, as Project Trellis' ``ecppll`` sets them (LiteX:
6, 16, 1, 2). nextpnr writes what is left out as 0, which no design that is known to run has."""


@dataclass(frozen=True)
class ClockPlaces:
    """Placement of the cells in the path of the TMDS clock, near its pin."""

    choice: str  # look-up table beside the pin that selects it or the board's own clock
    pll: str  # the nearest of the device


# Pin G3 (PCLKT7_1) is at row 23, 32 or 44; smaller devices have PLLs at the lower edge only.
_SMALL = ClockPlaces("X2/Y23/SLICEA.K0", "X2/Y49/EHXPLL_LL")
CLOCK_PLACES = {
    "lfe5u-12f": _SMALL,
    "lfe5u-25f": _SMALL,
    "lfe5u-45f": ClockPlaces("X2/Y32/SLICEA.K0", "X1/Y4/EHXPLL_UL"),
    "lfe5u-85f": ClockPlaces("X2/Y44/SLICEA.K0", "X1/Y4/EHXPLL_UL"),
}
"""For each device in the package of the ULX3S. Left alone, nextpnr puts the PLL to the far side of
the die. A clock multiplexer of the device (DCSC) would do without the fabric; nextpnr 0.11 ends
with an exception where it routes one."""


def prepare_netlist(netlist: Path, device: str | None = None) -> None:
    """Change a netlist's file for nextpnr.

    Clocks get the names that constraints and reports know them by, PLLs their `PLL_WORDS`, and
    with a device what the TMDS clock goes through its place. ToolError if it is not there, or a
    PLL has another name than those known.
    """
    content = json.loads(netlist.read_text())
    named = {cell for cell, _ in _CLOCK_NETS.values()}
    for module in content["modules"].values():
        cells, nets = module["cells"], module["netnames"]
        # A PLL under another name would be placed without its words.
        if other := {n for n, cell in cells.items() if cell["type"] == "EHXPLLL"} - named:
            raise ToolError(f"PLL {min(other)} is none of {', '.join(sorted(named))}")
        name_nets(module, {**_CLOCK_NETS, "byte_clk": _divided_clock(cells)})
        for cell in cells.values():
            if cell["type"] == "EHXPLLL":
                cell["attributes"].update({name: str(word) for name, word in PLL_WORDS.items()})
        if device is not None and "source_clk" in nets:
            _place_clock(cells, nets["source_clk"]["bits"][0], CLOCK_PLACES[device])
    netlist.write_text(json.dumps(content))


def _divided_clock(cells: dict[str, Any]) -> tuple[str, str]:
    """Cell and port of the byte clock of a camera's lanes, which a flip-flop makes."""
    registers = {name: c["connections"] for name, c in cells.items() if c["type"] == "TRELLIS_FF"}
    clocks = {ports["CLK"][0] for ports in registers.values()}
    return next((name for name, ports in registers.items() if ports["Q"][0] in clocks), ""), "Q"


def _place_clock(cells: dict[str, Any], source: int, places: ClockPlaces) -> None:
    choices = [
        cell
        for cell in cells.values()
        if cell["type"] == "LUT4" and cell["connections"]["Z"] == [source]
    ]
    if len(choices) != 1:
        raise ToolError(f"{len(choices)} look-up tables choose the PLL's clock, not 1")
    choices[0]["attributes"]["BEL"] = places.choice
    cells[_CLOCK_NETS["source_clk"][0]]["attributes"]["BEL"] = places.pll
