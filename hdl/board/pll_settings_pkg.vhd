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

  type pll_registers_t is array (0 to 18) of pll_register_t;

  constant PLL_REGISTERS : pll_registers_t :=
  (
    (
      b"00101",
      x"AF00",
      x"0000",
      x"0000"
    ),
    (
      b"00110",
      x"FEF4",
      x"2800",
      x"0400"
    ),
    (
      b"00111",
      x"1FD3",
      x"0900",
      x"0280"
    ),
    (
      b"01000",
      x"BFFE",
      x"0180",
      x"0000"
    ),
    (
      b"01001",
      x"32FC",
      x"0060",
      x"0030"
    ),
    (
      b"01011",
      x"8200",
      x"0000",
      x"0000"
    ),
    (
      b"01101",
      x"0070",
      x"0020",
      x"0020"
    ),
    (
      b"01111",
      x"FFFC",
      x"2800",
      x"0608"
    ),
    (
      b"10000",
      x"7FF3",
      x"0280",
      x"0140"
    ),
    (
      b"10001",
      x"00FF",
      x"0008",
      x"0058"
    ),
    (
      b"10010",
      x"0400",
      x"0000",
      x"0000"
    ),
    (
      b"10100",
      x"D000",
      x"1000",
      x"1000"
    ),
    (
      b"10101",
      x"000B",
      x"000B",
      x"000B"
    ),
    (
      b"10110",
      x"F400",
      x"F400",
      x"F400"
    ),
    (
      b"10111",
      x"002F",
      x"0022",
      x"0022"
    ),
    (
      b"11000",
      x"EFC6",
      x"6C46",
      x"2546"
    ),
    (
      b"11001",
      x"FFFF",
      x"E0EB",
      x"E0EB"
    ),
    (
      b"11010",
      x"0003",
      x"0000",
      x"0000"
    ),
    (
      b"11101",
      x"D000",
      x"0000",
      x"0000"
    )
  );

end package pll_settings_pkg;
