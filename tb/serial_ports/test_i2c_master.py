# SPDX-License-Identifier: Apache-2.0
"""The I2C master, against a device written from UM10204; and faults that this bench notices."""

import pytest

from plenofir.fpga import hdl
from plenofir_tb.faults import FOUND, plant
from plenofir_tb.runner import Case, run_cases

CASES = [
    Case(
        "i2c_master",
        "serial_ports.master_bench",
        {"QUARTER": quarter, "STRETCH": 60},
        {"quarter": quarter, "stretch": 60},
    )
    for quarter in (3, 8)
]


def test_i2c_master() -> None:
    run_cases(CASES)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new"),
    [
        # The data line changes a clock too early behind the clock line's fall.
        (
            "bit_begins <= to_logic(phase = hold) and time_up",
            "bit_begins <= to_logic(phase = hold and clocks >= QUARTER - 2 and scl_pull = '1')",
        ),
        # Bits are read a quarter behind the clock line's fall.
        (
            "bit_read   <= to_logic(phase = high) and time_up",
            "bit_read   <= to_logic(phase = setup) and time_up",
        ),
        # A device that stretches the clock is not waited for.
        ("if scl_now = '1' then", "if true then"),
        # A repeated start comes as soon as the clock line is seen high.
        (
            "bit_read   <= to_logic(phase = high) and time_up",
            "bit_read   <= to_logic(phase = high and (time_up = '1' or"
            " (order.start = '1' and clocks = 0)))",
        ),
        # The last bit of a byte is lost.
        ("disturbed or to_logic(bits = 8)", "disturbed or to_logic(bits = 7)"),
    ],
)
def test_planted_fault_is_found(tmp_path, monkeypatch, old: str, new: str) -> None:
    sources = plant(tmp_path, hdl.hdl_sources(), "i2c_master.vhd", old, new)
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    with pytest.raises(pytest.fail.Exception, match=rf"{FOUND}|um10204.RuleError"):
        run_cases(CASES[1:])
