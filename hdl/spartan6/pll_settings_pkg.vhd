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

  type pll_registers_t is array (0 to 14) of pll_register_t;

  constant PLL_REGISTERS : pll_registers_t :=
  (
    (b"00110", x"FC04", x"2800", x"0400"),
    (b"00111", x"1F90", x"0900", x"0280"),
    (b"01000", x"2F80", x"0180", x"0080"),
    (b"01001", x"02F8", x"0060", x"0018"),
    (b"01011", x"8200", x"0000", x"0000"),
    (b"01101", x"0070", x"0020", x"0020"),
    (b"01111", x"FE0C", x"2800", x"0608"),
    (b"10000", x"7FE0", x"0280", x"0140"),
    (b"10001", x"00DB", x"0008", x"0058"),
    (b"10101", x"000B", x"000B", x"000B"),
    (b"10110", x"F400", x"F400", x"F400"),
    (b"10111", x"0023", x"0021", x"0022"),
    (b"11000", x"EFC6", x"6F46", x"4FC6"),
    (b"11001", x"FEEF", x"C0EB", x"40EB"),
    (b"11010", x"0003", x"0002", x"0003")
  );

end package pll_settings_pkg;
