-- SPDX-License-Identifier: Apache-2.0
-- Model of CLKDIV (Gowin UG286) with DIV_MODE 5: a rising edge of CLKOUT with every fifth of HCLKIN.
--
-- Left out: other ratios, CALIB, delays; the output is high for two cycles of five.

library ieee;
use ieee.std_logic_1164.all;

entity clkdiv is
  generic (
    DIV_MODE : string := "2"
  );
  port (
    hclkin : in    std_ulogic;
    resetn : in    std_ulogic;
    calib  : in    std_ulogic;
    clkout : out   std_ulogic
  );
end entity clkdiv;

architecture behaviour of clkdiv is

  signal cycle : natural range 0 to 4 := 0;

begin

  assert div_mode = "5"
    report "CLKDIV: the model knows DIV_MODE 5 only"
    severity failure;

  divide : process (hclkin, resetn) is
  begin

    if resetn /= '1' then
      cycle  <= 0;
      clkout <= '0';
    elsif rising_edge(hclkin) then
      -- The first rising edge behind the reset is also the first one that goes out.
      cycle <= (cycle + 1) mod 5;
      if cycle = 0 then
        clkout <= '1';
      elsif cycle = 2 then
        clkout <= '0';
      end if;
    end if;

  end process divide;

end architecture behaviour;
