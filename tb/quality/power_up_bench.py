# SPDX-License-Identifier: Apache-2.0
"""cocotb test of entities that nobody resets: their control outputs are defined from 0 ns on."""

import re
from typing import Any

import cocotb
from cocotb.triggers import Timer

from plenofir_tb.case import read_case

# Defined even before the first edge: an entity behind it would keep what is undefined then.
HANDSHAKE = re.compile("(valid|ready|sync|active|running|interrupt|locked)$")


@cocotb.test()
async def outputs_without_a_reset(dut: Any) -> None:
    case = read_case()
    for name in case["inputs"]:
        getattr(dut, name).value = 0
    undefined: set[str] = set()
    outputs = [name for name in case["outputs"] if HANDSHAKE.search(name)]
    for _ in range(12):
        for level in (0, 1):
            for clock in case["clocks"]:
                getattr(dut, clock).value = level
            await Timer(5, "ns")
            undefined |= {name for name in outputs if not defined(dut, name)}
        outputs = case["outputs"]
    assert not undefined, f"undefined at power-up: {' '.join(sorted(undefined))}"


def defined(dut: Any, name: str) -> bool:
    """Whether an output is 0 or 1; what goes with a handshake counts only where it is valid."""
    stream, _, mark = name.rpartition("_")
    if mark in ("tuser", "tlast") and str(getattr(dut, f"{stream}_tvalid").value) != "1":
        return True
    return not str(getattr(dut, name).value).strip("01")
