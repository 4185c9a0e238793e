# SPDX-License-Identifier: Apache-2.0
"""Checks that a reset of one clock is as good as a long one."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cocotb.triggers import FallingEdge


async def reset_is_whole(
    dut: Any,
    inputs: Sequence[Mapping[str, int]],
    ends: Iterable[int],
    *,
    cleared: Sequence[str],
    others: Sequence[str] = (),
    settled: int = 1,
    long: int = 40,
    after: int = 150,
) -> None:
    """Apply the same inputs with a reset of one clock and with a long one, and compare.

    `inputs` are values clock by clock of the entity's other inputs; its clock is falling now. The
    reset ends in each of the clocks `ends`, at least `long`. Outputs in `cleared` must be 0 in the
    last clock of the reset and in the next one, and agree from then on; `others` must agree from
    `settled` clocks after the reset on. `after` clocks after the reset are compared.
    """
    for end in ends:
        runs = []
        for begin in (end - 1, end - long):
            levels = []
            for clock, values in enumerate(inputs[: end + after]):
                for name, value in values.items():
                    getattr(dut, name).value = value
                dut.reset.value = int(begin <= clock < end)
                await FallingEdge(dut.clk)
                if clock >= end - 1:
                    names = (*cleared, *others) if clock >= end - 1 + settled else cleared
                    levels.append([str(getattr(dut, name).value) for name in names])
            runs.append(levels)
            for values in levels[:2]:
                assert "1" not in "".join(values[: len(cleared)]), f"reset up to clock {end}"
        for clock, (short, whole) in enumerate(zip(*runs, strict=True)):
            assert short == whole, f"reset up to clock {end}, {clock} clocks later"
    dut.reset.value = 0
