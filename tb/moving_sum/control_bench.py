# SPDX-License-Identifier: Apache-2.0
"""cocotb test of ``moving_sum_control``: a reset among its lines."""

import random
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge

from plenofir_tb.case import read_case
from plenofir_tb.resets import reset_is_whole

CASE = read_case()
CLOCKS = 700


def lines(rng: random.Random) -> list[dict[str, int]]:
    """Lines of any length, with pauses, at the least permitted distance; first steps of none."""
    idle = {"advance": 1, "first": 0, "live": 0, "slice": 0}
    inputs: list[dict[str, int]] = [idle] * (CASE["delay"] + 1)
    while len(inputs) < CLOCKS:
        length = rng.randint(1, 2 * CASE["delay"] + 2)
        slice_ = rng.randrange(CASE["slices"])
        for step in range(max(length, CASE["delay"] + 1 + rng.choice([0, 0, 5]))):
            pause = {"advance": 0, "first": 0, "live": 0, "slice": 0}
            inputs += [pause] * rng.choice([0, 0, 0, 1, 4])
            live = int(step < length)
            inputs.append({"advance": 1, "first": int(not step), "live": live, "slice": slice_})
    return inputs


@cocotb.test()
async def resets(dut: Any) -> None:
    """After a reset nothing enters, leaves or is due until a line begins."""
    Clock(dut.clk, 10, "ns").start()
    rng = random.Random(cocotb.RANDOM_SEED)
    inputs = lines(rng)
    places = range(60, CLOCKS - 160)
    begins = [clock for clock in places if inputs[clock]["first"]]
    await FallingEdge(dut.clk)
    await reset_is_whole(
        dut,
        inputs,
        [*rng.sample(places, 6), *(rng.choice(begins) + after for after in (1, 2, 3, 4, 5, 7))],
        cleared=(),
        others=["step", "enter", "leave", "fresh", "to_first", "to_held", "take", "due"],
        settled=0,
    )
