# SPDX-License-Identifier: Apache-2.0
"""Runs in the simulator: the streams of one design, one after another."""

import importlib
import json
import os
import random
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge

from hunt import VARIABLE
from hunt.streams import FaultError

# Clocks after which every write that began before the reset has reached its memory.
_WRITE_CLOCKS = 8


class Bench:
    """An entity with its clock and its ports; the one coroutine of a hunt steps them.

    A port has `step(clock)`, called after each rising edge with the number of the clock (signals
    still have the values from before the edge), and `restart()`, called at a reset. `design` is the
    result of `draw`.
    """

    def __init__(self, dut: Any, design: dict[str, Any]) -> None:
        self.dut = dut
        self.design = design
        self.ports: list[Any] = []
        self.clock = 0
        # How often each kind of scenario or damage was run.
        self.counts: Counter[str] = Counter()
        self._edge = RisingEdge(dut.clk)
        Clock(dut.clk, 10, "ns").start()

    def add(self, port: Any) -> Any:
        """Step a port from now on, too."""
        self.ports.append(port)
        return port

    def set(self, **values: int) -> None:
        for name, value in values.items():
            getattr(self.dut, name).value = value

    def number(self, name: str) -> int:
        """Value of an output, which must be defined."""
        text = str(getattr(self.dut, name).value)
        if text.strip("01"):
            raise FaultError(f"{name} is {text}")
        return int(text, 2)

    async def clocks(self, count: int = 1) -> None:
        for _ in range(count):
            await self._edge
            self.clock += 1
            for port in self.ports:
                port.step(self.clock)

    async def until(self, done: Callable[[], bool], limit: int, what: str) -> None:
        """Let clocks pass until a condition holds; a fault if it does not within the limit."""
        for _ in range(limit):
            if done():
                return
            await self.clocks()
        if not done():
            raise FaultError(f"{what}: not within {limit} clocks")

    async def reset(self, clocks: int = 1) -> None:
        """Reset for some clocks; one has to be enough."""
        self.dut.reset.value = 1
        for port in self.ports:
            port.restart()
        for _ in range(clocks):
            await self._edge
            self.clock += 1
        self.dut.reset.value = 0


async def _touch_later(verdicts: Path, clock: Any) -> None:
    """Make the file of verdicts after as many clocks as any write takes to its memory."""
    await ClockCycles(clock, _WRITE_CLOCKS)
    verdicts.touch()


@cocotb.test()
async def hunt(dut: Any) -> None:
    order = json.loads(os.environ[VARIABLE])
    module = importlib.import_module(f"hunt.{order['entity']}_hunt")
    verdicts = Path(order["verdicts"])
    bench = Bench(dut.case_0, order["design"])
    # The first edge comes from an undefined clock, which is no rising edge in VHDL.
    await bench.clocks()
    if hasattr(bench.dut, "reset"):
        await bench.reset()
    await bench.clocks()
    # From here on start values must not matter. In the first clocks a write that was under way may
    # still end a simulation, as its address has no reset.
    cocotb.start_soon(_touch_later(verdicts, bench.dut.clk))
    for number in range(order["streams"]):
        rng = random.Random(f"{order['entity']} {order['number']} {number}")
        bench.counts = Counter()
        verdict: dict[str, Any] = {"stream": number, "fault": ""}
        try:
            await module.stream(bench, rng)
        except AssertionError as fault:
            lines = traceback.format_exc().splitlines()
            places = [line.strip() for line in lines if "_hunt.py" in line]
            verdict["fault"] = f"clock {bench.clock}: {fault} ({places[-1] if places else ''})"
        verdict["counts"] = bench.counts
        with verdicts.open("a") as file:
            file.write(json.dumps(verdict) + "\n")
        if verdict["fault"]:
            return
