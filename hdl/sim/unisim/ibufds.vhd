-- SPDX-License-Identifier: Apache-2.0
-- Model of IBUFDS (UG381): high when I is above IB, low when below.
--
-- Where the two do not differ (an open cable) the output stays. Left out: delay, thresholds, noise.

library ieee;
use ieee.std_logic_1164.all;

entity ibufds is
  generic (
    DIFF_TERM  : boolean := false;
    IOSTANDARD : string  := "DEFAULT"
  );
  port (
    o  : out   std_ulogic;
    i  : in    std_ulogic;
    ib : in    std_ulogic
  );
end entity ibufds;

architecture behaviour of ibufds is

begin

  compare : process (i, ib) is
  begin

    if i = '1' and ib = '0' then
      o <= '1';
    elsif i = '0' and ib = '1' then
      o <= '0';
    end if;

  end process compare;

end architecture behaviour;
