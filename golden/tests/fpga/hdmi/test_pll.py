# SPDX-License-Identifier: Apache-2.0
"""Settings of the PLL and their registers."""

import re

import pytest

from plenofir.fpga.hdmi.modes import HD720, MODES, SVGA, VGA
from plenofir.ground import project
from plenofir_tb.hdmi.pll import (
    HIGH,
    LOW,
    SETTINGS,
    VCO_RANGE,
    PllSetting,
    decode,
    filter_bits,
    lock_bits,
    registers,
)


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda s: s.name)
def test_setting(setting: PllSetting) -> None:
    for clock in setting.pixel_clocks:
        assert VCO_RANGE[0] <= clock * setting.multiply <= VCO_RANGE[1]
    # Ten bits in a pixel, two halves.
    assert setting.multiply == 10 * setting.serial == setting.pixel == 2 * setting.half


def test_ranges_overlap() -> None:
    assert LOW.pixel_clocks[1] > HIGH.pixel_clocks[0]
    for clock in (VGA.pixel_clock, SVGA.pixel_clock, HD720.pixel_clock):
        assert LOW.pixel_clocks[0] <= clock <= HIGH.pixel_clocks[1]


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda s: s.name)
def test_registers(setting: PllSetting) -> None:
    words = registers(setting)
    for mask, value in words.values():
        assert value & ~mask == 0
    written = {address: value for address, (_, value) in words.items()}
    for field, ratio in (
        ("CLKFBOUT", setting.multiply),
        ("CLKOUT0", setting.serial),
        ("CLKOUT1", setting.pixel),
        ("CLKOUT2", setting.half),
    ):
        code = decode(written, field)
        low, high, no_count, edge = code & 63, code >> 6 & 63, code >> 12 & 1, code >> 13
        assert (1 if no_count else low + high) == ratio
        # Half of the time high.
        assert no_count or 2 * high + edge == ratio
    # Bits 4 and 5 of the filter have no place.
    assert decode(written, "FILTER") == filter_bits(setting.multiply) & ~0x30


# Rows of the tables as XAPP879 and prjcombine's database of the Spartan-6 print them: resistor,
# LFHF and charge pump; reference delay, feedback delay, lock count, saturation.
ROWS = {
    1: ("1011_11_0010", "01001_00111_1111101000_1111101001"),
    3: ("1011_11_0110", "01101_01011_1111101000_1111101001"),
    6: ("1101_11_1110", "11010_11000_1111101000_1111101001"),
    10: ("1110_11_1110", "11111_11101_1111101000_1111101001"),
    11: ("1110_11_1111", "11111_11101_1110000100_1111101001"),
    16: ("1010_11_1110", "11111_11101_1001110001_1111101001"),
    20: ("1010_11_1111", "11111_11101_0111110100_1111101001"),
    25: ("1100_11_1110", "11111_11101_0110010000_1111101001"),
    32: ("0010_11_1110", "11111_11101_0100101100_1111101001"),
    36: ("0010_11_1101", "11111_11101_0100010011_1111101001"),
    40: ("0010_11_1100", "11111_11101_0011111010_1111101001"),
    45: ("0010_11_0111", "11111_11101_0011111010_1111101001"),
    55: ("1000_11_0011", "11111_11101_0011111010_1111101001"),
    64: ("0100_11_0011", "11111_11101_0011111010_1111101001"),
}


@pytest.mark.parametrize("multiply", ROWS)
def test_rows_of_the_tables(multiply: int) -> None:
    filter_row, lock_row = ROWS[multiply]
    assert f"{filter_bits(multiply):010b}" == filter_row.replace("_", "")
    assert f"{lock_bits(multiply):030b}" == lock_row.replace("_", "")


def test_words_of_working_firmware() -> None:
    """The values that firmware running on this board writes for 10 and 20 times the clock."""
    low, high = (
        {address: value for address, (_, value) in registers(setting).items()}
        for setting in (LOW, HIGH)
    )
    assert [low[a] for a in (0x17, 0x18, 0x19, 0x1A)] == [0x0021, 0x6F46, 0xC0EB, 0x0002]
    assert [high[a] for a in (0x18, 0x19, 0x1A)] == [0x4FC6, 0x40EB, 0x0003]
    # Divide by 5: low for 3 cycles, high for 2 and a half.
    assert decode(high, "CLKOUT2") == 1 << 13 | 2 << 6 | 3


def test_nothing_needless_is_written() -> None:
    written = registers(LOW)
    assert not {0x05, 0x14, 0x1D} & set(written)
    assert {address: mask for address, (mask, _) in written.items()} == {
        address: mask for address, (mask, _) in registers(HIGH).items()
    }


def test_supervisor_takes_what_the_constraints_cover() -> None:
    constraints = (project.root() / "constraints" / "atlys.ucf").read_text()
    period = float(re.findall(r'"TS_tmds" = PERIOD "tmds" ([\d.]+) ns', constraints)[0])
    supervisor = (project.root() / "hdl" / "link" / "link_supervisor.vhd").read_text()
    fastest = int(re.findall(r"FASTEST : positive := (\d+)", supervisor)[0])
    # In units of 100 kHz, rounded up.
    assert fastest - 1 < 1e4 / period <= fastest
    assert all(mode.pixel_clock <= 100 * fastest for mode in MODES)
