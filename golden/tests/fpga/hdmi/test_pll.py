"""Settings of the PLL and their registers."""

import pytest

from plenofir.fpga.hdmi.modes import HD720, SVGA, VGA
from plenofir.fpga.hdmi.pll import (
    HIGH,
    LOW,
    SETTINGS,
    VCO_RANGE,
    PllSetting,
    decode,
    registers,
    setting_for,
)


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda s: s.name)
def test_setting(setting: PllSetting) -> None:
    for clock in setting.pixel_clocks:
        assert VCO_RANGE[0] <= clock * setting.multiply <= VCO_RANGE[1]
    # Ten bits in a pixel, two halves.
    assert setting.multiply == 10 * setting.serial == setting.pixel == 2 * setting.half


def test_ranges_overlap() -> None:
    assert LOW.pixel_clocks[1] > HIGH.pixel_clocks[0]
    assert (setting_for(VGA), setting_for(SVGA), setting_for(HD720)) == (LOW, HIGH, HIGH)
    with pytest.raises(ValueError, match="148500"):
        setting_for(HD720.model_copy(update={"pixel_clock": 148_500}))


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
        low, high, no_count = code & 63, code >> 6 & 63, code >> 12 & 1
        assert (1 if no_count else low + high) == ratio
        assert code >> 13 == 0
    # Bits 4 and 5 of the filter have no place.
    assert decode(written, "FILTER") == setting.filter_bits & ~0x30


def test_register_masks() -> None:
    """Bits that are written, of registers that the counters fill by themselves (XAPP879)."""
    masks = {address: mask for address, (mask, _) in registers(LOW).items()}
    assert masks[0x05] == 0xFFFF ^ 0x50FF
    assert masks[0x07] == 0xFFFF ^ 0xE02C
    assert masks[0x08] == 0xFFFF ^ 0x4001
    assert masks[0x10] == 0xFFFF ^ 0x800C
    assert masks[0x19] == 0xFFFF
