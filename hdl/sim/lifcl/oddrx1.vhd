-- SPDX-License-Identifier: Apache-2.0
-- Model of ODDRX1 of CrossLink-NX: D0 while the clock is high, D1 while it is low, both taken with its rising edge.
--
-- Left out: delays, registers in front of the two.

library ieee;
use ieee.std_logic_1164.all;

entity oddrx1 is
  generic (
    GSR : string := "ENABLED"
  );
  port (
    sclk : in    std_ulogic;
    rst  : in    std_ulogic;
    d0   : in    std_ulogic;
    d1   : in    std_ulogic;
    q    : out   std_ulogic
  );
end entity oddrx1;

architecture behaviour of oddrx1 is

  signal second : std_ulogic := '0';

begin

  send : process (sclk, rst) is
  begin

    if rst = '1' then
      q      <= '0';
      second <= '0';
    elsif rising_edge(sclk) then
      q      <= d0;
      second <= d1;
    elsif falling_edge(sclk) then
      q <= second;
    end if;

  end process send;

end architecture behaviour;
