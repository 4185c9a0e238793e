# SPDX-License-Identifier: Apache-2.0
"""Registers that move into block RAM, and those that must not."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from plenofir.fpga.synthesis.output_registers import use_output_registers

Cells = dict[str, dict[str, Any]]
CLOCK, ENABLE, RESET = 2, 3, 4


def register(word: int, output: int, **changed: str) -> dict[str, Any]:
    parameters = {"CEMUX": "1 ", "CLKMUX": "CLK", "LSRMUX": "LSR", "REGSET": "RESET"}
    inputs: dict[str, list[int | str]] = {"CLK": [CLOCK], "DI": [word], "LSR": ["0"]}
    return {
        "type": "TRELLIS_FF",
        "parameters": parameters | changed,
        "port_directions": {**dict.fromkeys(inputs, "input"), "Q": "output"},
        "connections": {**inputs, "Q": [output]},
    }


def memory(width: int, outputs: dict[str, int]) -> dict[str, Any]:
    inputs: dict[str, list[int | str]] = {}
    for half in "AB":
        inputs |= {f"CLK{half}": [CLOCK], f"CE{half}": ["1"], f"RST{half}": ["0"]}
        inputs |= {f"OCE{half}": ["0"]}
    parameters = {"CLKAMUX": "CLKA", "CLKBMUX": "CLKB", "REGMODE_A": "NOREG", "REGMODE_B": "NOREG"}
    return {
        "type": "DP16KD",
        "parameters": parameters | {"DATA_WIDTH_A": f"{width:032b}"},
        "port_directions": {**dict.fromkeys(inputs, "input"), **dict.fromkeys(outputs, "output")},
        "connections": inputs | {port: [bit] for port, bit in outputs.items()},
    }


def moved(cells: Cells, folder: Path, ports: tuple[int, ...] = ()) -> tuple[int, Cells]:
    module = {
        "ports": {f"port{bit}": {"direction": "output", "bits": [bit]} for bit in ports},
        "cells": cells,
    }
    netlist = folder / "netlist.json"
    netlist.write_text(json.dumps({"modules": {"top": module}}))
    bits = use_output_registers(netlist)
    changed: Cells = json.loads(netlist.read_text())["modules"]["top"]["cells"]
    return bits, changed


def test_registers_move(tmp_path: Path) -> None:
    cells = {
        "ram": memory(18, {"DOB0": 10, "DOB1": 11, "DOA0": 12}),
        **{f"r{i}": register(10 + i, 20 + i) for i in range(2)},
    }
    bits, left = moved(cells, tmp_path)
    assert bits == 2
    assert list(left) == ["ram"]
    ram = left["ram"]
    assert (ram["connections"]["DOB0"], ram["connections"]["DOB1"]) == ([20], [21])
    assert ram["parameters"]["REGMODE_B"] == "OUTREG"
    assert ram["connections"]["OCEB"] == ["1"]
    # Nothing reads half A.
    assert ram["parameters"]["REGMODE_A"] == "NOREG"


def test_a_word_of_both_halves_moves_as_one(tmp_path: Path) -> None:
    enabled = [register(10 + i, 20 + i, CEMUX="CE") for i in range(2)]
    for cell in enabled:
        cell["connections"]["CE"] = [ENABLE]
        cell["port_directions"]["CE"] = "input"
    cells = {"ram": memory(36, {"DOA0": 10, "DOB0": 11}), "r0": enabled[0], "r1": enabled[1]}
    bits, left = moved(cells, tmp_path)
    assert (bits, list(left)) == (2, ["ram"])
    for half in "AB":
        assert left["ram"]["parameters"][f"REGMODE_{half}"] == "OUTREG"
        assert left["ram"]["connections"][f"OCE{half}"] == [ENABLE]


def _reads_without_register(cells: Cells) -> None:
    cells["more"] = register(30, 31)
    cells["more"]["connections"]["CE"] = [10]
    cells["more"]["port_directions"]["CE"] = "input"


def _set(cell: str, part: str, name: str, value: object) -> Callable[[Cells], None]:
    def change(cells: Cells) -> None:
        cells[cell][part][name] = value

    return change


@pytest.mark.parametrize(
    "change",
    [
        _reads_without_register,
        _set("r1", "connections", "LSR", [RESET]),
        _set("r1", "connections", "CLK", [5]),
        _set("r1", "parameters", "REGSET", "SET"),
        _set("r1", "parameters", "CLKMUX", "INV"),
        _set("r1", "parameters", "CEMUX", "INV"),
        _set("ram", "connections", "CEB", [ENABLE]),
        _set("ram", "connections", "RSTB", [RESET]),
        _set("ram", "connections", "CLKB", [5]),
        _set("ram", "parameters", "CLKBMUX", "INV"),
    ],
)
def test_registers_stay(tmp_path: Path, change: Callable[[Cells], object]) -> None:
    cells = {
        "ram": memory(18, {"DOB0": 10, "DOB1": 11}),
        **{f"r{i}": register(10 + i, 20 + i) for i in range(2)},
    }
    change(cells)
    assert moved(cells, tmp_path) == (0, cells)


def test_a_word_that_leaves_the_design_stays(tmp_path: Path) -> None:
    cells = {"ram": memory(18, {"DOB0": 10}), "r0": register(10, 20)}
    assert moved(cells, tmp_path, ports=(10,)) == (0, cells)
