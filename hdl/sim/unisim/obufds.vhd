-- SPDX-License-Identifier: Apache-2.0
-- Model of OBUFDS (UG381): a pair of complements. Left out: delay, levels.

library ieee;
use ieee.std_logic_1164.all;

entity obufds is
  generic (
    IOSTANDARD : string := "DEFAULT"
  );
  port (
    o  : out   std_ulogic;
    ob : out   std_ulogic;
    i  : in    std_ulogic
  );
end entity obufds;

architecture behaviour of obufds is

begin

  o  <= i;
  ob <= not i;

end architecture behaviour;
