# SPDX-License-Identifier: Apache-2.0
"""Settings of the Spartan-6 PLL that makes the serial clock: ten bits in each pixel clock.

The PLL's oscillator runs from 400 to 1080 MHz (DS162, speed grade -3), so pixel clocks of 25 to
100 MHz need two settings. The PLL takes another one at run time, through its reconfiguration port:
each field of a setting is spread over the bits of 16 bit registers (XAPP879).
"""

from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict

VCO_RANGE = (400_000, 1_080_000)
"""Oscillator in kHz (DS162)."""


class PllSetting(BaseModel):
    """Ratios of the PLL."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str  # "low" or "high"
    multiply: int  # oscillator cycles in each cycle of the pixel clock that comes in
    serial: int  # oscillator cycles in a bit
    pixel: int  # in a pixel
    half: int  # in half a pixel
    pixel_clocks: tuple[int, int]  # lowest and highest in kHz


LOW = PllSetting(
    name="low",
    multiply=20,
    serial=2,
    pixel=20,
    half=10,
    pixel_clocks=(25_000, 50_000),
)
HIGH = PllSetting(
    name="high",
    multiply=10,
    serial=1,
    pixel=10,
    half=5,
    pixel_clocks=(40_000, 100_000),
)
SETTINGS = (LOW, HIGH)

# Loop filter and lock detector for each multiplier from 1 on (Spartan-6 tables of XAPP879;
# prjcombine's database of the fabric has the same 64 rows except for the filter of 37: 46).
# Loop filter at bandwidth "OPTIMIZED": a digit for the resistor, one for the charge pump.
_FILTERS = bytes.fromhex("""
    B2 F5 B6 FE BE DE 3F 5F 9F EE EF 1F 1F 6E 6E AE
    AE AF AF AF AF CD CD CE CE CF CF CF CF CF 2E 2E
    CF CF 2D 2D 4F 2C 2C 2C 84 84 84 45 27 83 83 83
    83 83 83 83 83 83 83 83 43 43 43 43 43 43 43 43
""")
_HIGH_FREQUENCY = 0b11
# Lock detector: delay of the reference (the feedback's is 2 less), and cycles until LOCKED.
_LOCK_DELAYS = (9, 9, 13, 18, 22, 26, *[31] * 58)
_LOCK_CYCLES = (
    *[1000] * 10,
    *(900, 825, 750, 700, 650, 625, 575, 550, 525, 500, 475, 450, 425, 400, 400, 375),
    *(350, 350, 325, 325, 300, 300, 300, 275, 275, 275),
    *[250] * 28,
)
_LOCK_SATURATION = 1001


def filter_bits(multiply: int) -> int:
    """Loop filter of a multiplier: resistor (4 bits), LFHF (2), charge pump (4)."""
    resistor, pump = divmod(_FILTERS[multiply - 1], 16)
    return resistor << 6 | _HIGH_FREQUENCY << 4 | pump


def lock_bits(multiply: int) -> int:
    """Lock detector of a multiplier: both delays (5 bits each), cycles and saturation (10 each)."""
    delay = _LOCK_DELAYS[multiply - 1]
    delays = delay << 5 | delay - 2
    return delays << 20 | _LOCK_CYCLES[multiply - 1] << 10 | _LOCK_SATURATION


# Register (hexadecimal) and bit of each bit of a field, lowest first (XAPP879). Phases, delays and
# the unlock count are the same in all settings, so they are left as the bitstream has them.
_PLACES = {
    "CLKFBOUT": """
        0F.9 0F.11 0F.10 0F.13 0F.15 0F.14 10.6 10.7 10.8 10.9 10.11 10.10 0F.12
        10.5
    """,
    "CLKOUT0": """
        0D.5 0F.2 0D.4 0D.6 0B.9 0B.15 11.3 11.0 11.1 10.14 10.12 10.13 0F.3
        06.2
    """,
    "CLKOUT1": """
        11.4 06.11 06.10 06.13 06.15 06.14 07.7 07.8 07.9 07.11 07.10 07.12
        06.12 07.4
    """,
    "CLKOUT2": """
        08.7 11.6 08.8 08.9 08.10 08.13 09.5 09.4 09.6 09.7 09.9 11.7 08.11 09.3
    """,
    "FILTER": """
        18.13 18.10 18.11 18.9 -- -- 18.15 18.14 18.7 18.8
    """,
    "LOCK": """
        16.10 19.11 19.10 16.14 19.12 16.15 16.12 17.5 18.1 18.2 19.9 19.13 17.0
        17.1 19.15 19.14 18.6 16.13 1A.1 1A.0 19.0 19.2 15.1 19.3 19.1 19.7 19.6
        19.5 15.3 15.0
    """,
}


def _counter(divide: int) -> int:
    """Code of a counter at 50 %: low time, high time (6 bits each), "no count", edge.

    An odd ratio is high for half a cycle more than its high time: the edge bit (XAPP879).
    """
    if divide == 1:
        return 1 << 12 | 1 << 6 | 1
    high = divide // 2
    return divide % 2 << 13 | high << 6 | divide - high


def places(field: str) -> list[tuple[int, int] | None]:
    """Register and bit of each bit of a field, lowest first; None for bits that have no place.

    Fields are CLKFBOUT, CLKOUT0 to CLKOUT2, FILTER and LOCK.
    """
    words = _PLACES[field].split()
    pairs = [None if word == "--" else word.split(".") for word in words]
    return [None if pair is None else (int(pair[0], 16), int(pair[1])) for pair in pairs]


def registers(setting: PllSetting) -> dict[int, tuple[int, int]]:
    """Register address to (mask, value) of a setting; bits outside the mask are kept."""
    fields = {
        "CLKFBOUT": _counter(setting.multiply),
        "CLKOUT0": _counter(setting.serial),
        "CLKOUT1": _counter(setting.pixel),
        "CLKOUT2": _counter(setting.half),
        "FILTER": filter_bits(setting.multiply),
        "LOCK": lock_bits(setting.multiply),
    }
    out: dict[int, tuple[int, int]] = {}
    for field, value in fields.items():
        for i, place in enumerate(places(field)):
            if place is not None:
                register, bit = place
                mask, word = out.get(register, (0, 0))
                assert not mask >> bit & 1, f"two fields at register {register:02x} bit {bit}"
                out[register] = (mask | 1 << bit, word | (value >> i & 1) << bit)
    return dict(sorted(out.items()))


def settings_package() -> str:
    """VHDL of ``hdl/spartan6/pll_settings_pkg.vhd``, both settings."""
    low, high = registers(LOW), registers(HIGH)
    rows = []
    for address, (mask, value) in low.items():
        assert high[address][0] == mask
        words = [f'x"{word:04X}"' for word in (mask, value, high[address][1])]
        fields = ", ".join([f'b"{address:05b}"', *words])
        rows.append(f"    ({fields})")
    return _TEMPLATE.format(count=len(rows) - 1, rows=",\n".join(rows))


_TEMPLATE = """\
-- Register contents of the PLL for its two settings; built by scripts/build_hdl.py.
--
-- "low": pixel clocks of 25 to 50 MHz, the oscillator at 20 times the pixel clock; "high": 40 to
-- 100 MHz, 10 times. Register addresses and bits: XAPP879.

library ieee;
use ieee.std_logic_1164.all;

package pll_settings_pkg is

  -- One register: address, the bits that are written (the others are kept), their values.

  type pll_register_t is record
    address : std_logic_vector(4 downto 0);
    mask    : std_logic_vector(15 downto 0);
    low     : std_logic_vector(15 downto 0);
    high    : std_logic_vector(15 downto 0);
  end record pll_register_t;

  type pll_registers_t is array (0 to {count}) of pll_register_t;

  constant PLL_REGISTERS : pll_registers_t :=
  (
{rows}
  );

end package pll_settings_pkg;
"""


def decode(written: Mapping[int, int], field: str) -> int:
    """Read a field back from the contents of registers; bits without a register are 0."""
    value = 0
    for i, place in enumerate(places(field)):
        if place is not None:
            value |= (written.get(place[0], 0) >> place[1] & 1) << i
    return value
