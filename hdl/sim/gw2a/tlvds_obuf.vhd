-- SPDX-License-Identifier: Apache-2.0
-- Model of TLVDS_OBUF (Gowin UG289): a signal to a pair of pins.
--
-- Left out: levels, delays.

library ieee;
use ieee.std_logic_1164.all;

entity tlvds_obuf is
  port (
    i  : in    std_ulogic;
    o  : out   std_ulogic;
    ob : out   std_ulogic
  );
end entity tlvds_obuf;

architecture behaviour of tlvds_obuf is

begin

  o  <= i;
  ob <= not i;

end architecture behaviour;
