# SPDX-License-Identifier: Apache-2.0
"""Move registers behind block RAM into the block RAM's output registers (ECP5).

A DP16KD's data come 4 to 6 ns after the clock, much later than with its output register. Yosys
does not use it, so `use_output_registers` changes the netlist between Yosys and nextpnr. The
circuit's behaviour stays the same, clock by clock.
"""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

Cell = dict[str, Any]

_RAM, _REGISTER = "DP16KD", "TRELLIS_FF"
# A port of a word of 36 bits is both halves of the RAM, clocked as half B.
_WIDEST = 36


def use_output_registers(netlist: Path) -> int:
    """Move registers into the block RAM whose words they take; returns how many bits moved.

    A port's registers are moved if they alone read its data, with the port's clock, one enable, no
    reset and initial value zero. The RAM must read in each clock, because the effect of its enable
    on the output register is not known for certain. The file of the netlist (Yosys's for nextpnr)
    is changed.
    """
    content = json.loads(netlist.read_text())
    moved = sum(_move_registers(module) for module in content["modules"].values())
    netlist.write_text(json.dumps(content))
    return moved


def _move_registers(module: dict[str, Any]) -> int:
    """Move those of a module; returns their bits."""
    cells: dict[str, Cell] = module["cells"]
    users: dict[int | str, list[tuple[str, str]]] = defaultdict(list)
    for name, cell in cells.items():
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                for bit in bits:
                    users[bit].append((name, port))
    for name, port in module["ports"].items():
        for bit in port["bits"]:
            users[bit].append(("", name))
    moved = 0
    for ram in [cell for cell in cells.values() if cell["type"] == _RAM]:
        wide = int(ram["parameters"]["DATA_WIDTH_A"], 2) == _WIDEST
        for halves in ("AB",) if wide else ("A", "B"):
            moved += _move_behind(cells, users, ram, halves)
    return moved


def _move_behind(
    cells: dict[str, Cell],
    users: dict[int | str, list[tuple[str, str]]],
    ram: Cell,
    halves: str,
) -> int:
    """Move the registers behind a port (one half of the RAM, or both); returns their bits."""
    nets = ram["connections"]
    half = halves[-1]
    words = {
        port: bits[0]
        for port, bits in nets.items()
        if port.startswith("DO") and port[2] in halves and bits and users[bits[0]]
    }
    registers = {
        port: users[bit][0][0] for port, bit in words.items() if _is_kept(cells, users[bit])
    }
    if (
        not words
        or len(registers) < len(words)
        or (nets[f"CE{half}"], nets[f"RST{half}"]) != (["1"], ["0"])
    ):
        return 0
    # A RAM has one output register: one clock, enable and reset for all bits, as the primitive has.
    kinds = {_kind(cells[name]) for name in registers.values()}
    clock, enable = next(iter(kinds))[:2]
    if (
        len(kinds) > 1
        or kinds != {(clock, enable, "CLK", "0", "RESET")}
        or [clock] != nets[f"CLK{half}"]
        or ram["parameters"][f"CLK{half}MUX"] != f"CLK{half}"
        or enable is None
    ):
        return 0
    for port, name in registers.items():
        nets[port] = cells.pop(name)["connections"]["Q"]
    for each in halves:
        ram["parameters"][f"REGMODE_{each}"] = "OUTREG"
        nets[f"OCE{each}"] = [enable]
    return len(registers)


def _is_kept(cells: dict[str, Cell], users: list[tuple[str, str]]) -> bool:
    """Whether a register and nothing else uses a bit."""
    name, port = users[0]
    return len(users) == 1 and port == "DI" and cells[name]["type"] == _REGISTER


def _kind(register: Cell) -> tuple[int | str, int | str | None, str, int | str, str]:
    """Clock, enable (None: an inverted one), clock's edge, reset, initial value."""
    nets, parameters = register["connections"], register["parameters"]
    enables = {"CE": nets.get("CE", ["1"])[0], "1": "1"}
    return (
        nets["CLK"][0],
        enables.get(parameters["CEMUX"].strip()),
        parameters["CLKMUX"],
        nets.get("LSR", ["0"])[0],
        parameters["REGSET"],
    )
